// The same bits: against another backend, and however the work is cut.
//
// Over 450 lines: the list of scenes whose bits are held, in one place.
#include "conformance.h"

#include "bits_hashes.h"
#include "kernel/dialect/bits_version.h"
#include "kernel/dialect/features.h"
#include "render/session.h"

#include <fmt/format.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <span>
#include <sstream>
#include <utility>

using namespace conformance;

namespace {

/// Kinds of glass other than smooth: in a separate scene, so that others keep their bits.
constexpr const char* kGlasswareMaterials = R"(
  frosted: {type: rough_dielectric, ior: 1.5, roughness: 0.5}
  matt_flint: {type: rough_dielectric, ior: {glass: SF10}, roughness: 0.3}
  pane: {type: thin_dielectric, ior: {glass: N-BK7}}
  polished: {type: plastic, reflectance: red}
  satin: {type: plastic, reflectance: 0.8, roughness: 0.5, ior: 1.6}
  bottle: {type: dielectric, ior: 1.5, absorption: {rgb: [0.9, 0.1, 0.7], space: linear, scale: 8}})";
constexpr const char* kGlasswareObjects = R"(
  - {name: window, mesh: {positions: [[0.1,0.05,0],[0.1,0.95,0],[0.45,0.95,0.1],[0.45,0.05,0.1]],
      faces: [[0,1,2,3]]}, material: pane}
  - name: frosted
    material: frosted
    mesh: {positions: [[0,0,0],[1,0,0],[0,1,0],[0,0,1]], faces: [[0,2,1],[0,1,3],[0,3,2],[1,2,3]]}
    transform: [{scale: 0.35}, {translate: [0.55, 0.55, 0.25]}]
  - {name: tile, mesh: {positions: [[0.05,0.02,0.1],[0.05,0.02,0.5],[0.5,0.02,0.5],[0.5,0.02,0.1]],
      faces: [[0,1,2,3]]}, material: polished}
  - {name: board, mesh: {positions: [[0.05,0.6,0.95],[0.05,0.9,0.9],[0.4,0.9,0.9],[0.4,0.6,0.95]],
      faces: [[0,1,2,3]]}, material: satin}
  - name: bottle, and a grain inside it
    material: bottle
    mesh: {positions: [[0,0,0],[1,0,0],[0,1,0],[0,0,1]], faces: [[0,2,1],[0,1,3],[0,3,2],[1,2,3]]}
    transform: [{scale: 0.3}, {translate: [0.1, 0.25, 0.15]}]
  - {name: grain, mesh: {positions: [[0.14,0.3,0.19],[0.2,0.3,0.19],[0.14,0.36,0.19]], faces: [[0,1,2]]},
     material: satin}
  - {name: spark, mesh: {positions: [[0.14,0.3,0.17],[0.17,0.27,0.17],[0.14,0.27,0.2]], faces: [[0,1,2]]},
     material: white, emission: {radiance: 4, two_sided: true}}
  - name: matt flint
    material: matt_flint
    mesh: {positions: [[0,0,0],[1,0,0],[1,1,0],[0,1,0],[0,0,1],[1,0,1],[1,1,1],[0,1,1]],
      normals: [[-1,-1,-1],[1,-1,-1],[1,1,-1],[-1,1,-1],[-1,-1,1],[1,-1,1],[1,1,1],[-1,1,1]],
      faces: [[0,3,2,1],[4,5,6,7],[0,1,5,4],[2,3,7,6],[0,4,7,3],[1,2,6,5]]}
    transform: [{scale: 0.3}, {rotate: {axis: [0, 1, 0], angle_deg: 20}}, {translate: [0.55, 0.1, 0.2]}]
)";

std::string richScene(const std::string& integrator, const std::string& sampler,
                      const std::string& camera_extra, const std::string& filter, bool glassware = false) {
    return fmt::format(R"(crt: 1
camera: {{position: [0.5, 0.5, -1.4], target: [0.5, 0.5, 0.5], fov: 40{}}}
film: {{resolution: [48, 40], filter: {}}}
integrator: {}
sampler: {}
environment: {{radiance: {{illuminant: D65, scale: 0.1}}}}
spectra:
  red: {{rgb: [0.6, 0.1, 0.05], space: linear}}
materials:
  white: {{type: diffuse, reflectance: 0.7}}
  red: {{type: diffuse, reflectance: red}}
  mirror: {{type: mirror, reflectance: 0.9}}
  gold: {{type: conductor, metal: Au}}
  copper: {{type: rough_conductor, metal: Cu, roughness: 0.4}}
  glass: {{type: dielectric, ior: 1.5}}
  flint: {{type: dielectric, ior: {{glass: SF10}}}}{}
objects:
  - {{name: floor, mesh: {{positions: [[0,0,0],[0,0,1],[1,0,1],[1,0,0]], faces: [[0,1,2,3]]}},
      material: white}}
  - {{name: back, mesh: {{positions: [[0,0,1],[0,1,1],[1,1,1],[1,0,1]], faces: [[0,1,2,3]]}}, material: red}}
  - {{name: shield, mesh: {{positions: [[0.75,0.5,0.9],[0.75,0.9,0.8],[0.95,0.9,0.7],[0.95,0.5,0.8]],
      faces: [[0,1,2,3]]}}, material: copper}}
  - {{name: left, mesh: {{positions: [[0,0,0],[0,1,0],[0,1,1],[0,0,1]], faces: [[0,1,2,3]]}},
      material: gold}}
  - {{name: right, mesh: {{positions: [[1,0,0],[1,0,1],[1,1,1],[1,1,0]], faces: [[0,1,2,3]]}},
      material: mirror}}
  - {{name: lamp, mesh: {{positions: [[0.3,0.99,0.3],[0.7,0.99,0.3],[0.7,0.99,0.7],[0.3,0.99,0.7]],
      faces: [[0,1,2,3]]}}, material: white,
     emission: {{radiance: {{blackbody: 3000, scale: 5}}}}}}
  - {{name: strip, mesh: {{positions: [[0.02,0.1,0.2],[0.02,0.1,0.8],[0.02,0.12,0.8]],
      faces: [[0,1,2]]}}, material: white, emission: {{radiance: 8, two_sided: true}}}}
  - name: gems
    material: flint
    mesh: {{positions: [[0,0,0],[1,0,0],[1,1,0],[0,1,0],[0,0,1],[1,0,1],[1,1,1],[0,1,1]],
      normals: [[-1,-1,-1],[1,-1,-1],[1,1,-1],[-1,1,-1],[-1,-1,1],[1,-1,1],[1,1,1],[-1,1,1]],
      faces: [[0,3,2,1],[4,5,6,7],[0,1,5,4],[2,3,7,6],[0,4,7,3],[1,2,6,5]]}}
    transforms: [[{{scale: 0.25}}, {{rotate: {{axis: [0, 1, 0], angle_deg: 30}}}},
        {{translate: [0.2, 0.05, 0.3]}}],
      [{{scale: [-0.2, 0.3, 0.2]}}, {{translate: [0.9, 0.1, 0.5]}}]]
  - name: glass
    material: glass
    mesh: {{positions: [[0,0,0],[1,0,0],[0,1,0],[0,0,1]], faces: [[0,2,1],[0,1,3],[0,3,2],[1,2,3]]}}
    transform: [{{scale: 0.3}}, {{translate: [0.35, 0.5, 0.4]}}]
)",
                       camera_extra, filter, integrator, sampler, glassware ? kGlasswareMaterials : "") +
           (glassware ? kGlasswareObjects : "");
}

struct Case {
    const char* integrator;
    const char* sampler;
    const char* camera_extra;
    const char* filter;
    bool sampled_environment = false;
    const char* more = "";  // Further top-level lines.
    bool glassware = false;
    bool textured = false;
    bool sky = false;
    bool composed = false;
    bool mapped = false;
    bool instruments = false;
    bool films = false;
    bool lamps = false;
    bool many_lights = false;
    bool brushed = false;
    bool colored = false;
    bool rough_bases = false;
    bool fuzzy = false;
    bool coated = false;
    bool shaped = false;
    bool instanced = false;
    bool varying = false;
    bool tinted = false;
    bool sheets = false;
    bool screens = false;
};

const char* const kPointLights = R"(lights:
  - {type: point, position: [0.2, 0.8, 0.2], luminous_flux_lm: 20000}
  - {type: spot, position: [0.9, 0.9, 0.1], target: [0.4, 0, 0.6], penumbra_deg: 12, radiant_intensity: 2}
  - {type: directional, direction: [0.2, -1, 0.3], irradiance: {blackbody: 4000}}
  - {type: sun, direction: [0.3, -1, 0.1], angular_diameter_deg: 10, radiance: 40}
)";

/// IES lamps, all round and with sides, a disk of collimated light and a slit of it.
void addLamps(crt::Scene& scene) {
    crt::PointLight lamp;
    lamp.spectrum = crt::constantSpectrum(1);
    const auto add = [&](crt::PointLightType type, const crt::Vec3d& position, double strength) {
        lamp.type = type;
        lamp.position = position;
        lamp.strength = strength;
        scene.point_lights.push_back(lamp);
    };
    lamp.ies = std::make_shared<crt::IesProfile>(crt::IesProfile{{0, 30, 90}, {0}, {3, 2, 0}});
    add(crt::PointLightType::Ies, {0.4, 0.9, 0.4}, 0.5);
    lamp.direction = {0, 0, 1};
    lamp.ies = std::make_shared<crt::IesProfile>(
        crt::IesProfile{{0, 45, 90, 180},
                        {0, 70, 180, 290, 360},
                        {4, 3, 2, 1, 4, 1, 0, 2, 4, 2, 6, 1, 4, 0, 1, 3, 4, 3, 2, 1}});
    add(crt::PointLightType::Ies, {0.6, 0.5, 0.3}, 0.2);
    lamp.radius = 0.2;
    add(crt::PointLightType::Beam, {0.5, 0.6, -0.2}, 3);
    lamp.direction = {0.6, 0, 0.8};
    lamp.across = {0.8, 0, -0.6};
    lamp.radius = 0;
    lamp.width = 0.3;
    lamp.height = 0.15;
    add(crt::PointLightType::Beam, {0.2, 0.4, 0.1}, 5);
}

/// Enough lights for a tree, of all kinds that it holds.
void addManyLights(crt::Scene& scene) {
    for (int i = 0; i < 24; ++i) {
        const double x = 0.1 + 0.15 * (i % 6), z = 0.1 + 0.2 * (i / 6), y = 0.6 + 0.013 * i;
        if (i % 4 == 3) {
            crt::PointLight light;
            light.type = i % 8 == 3 ? crt::PointLightType::Point : crt::PointLightType::Spot;
            light.spectrum = crt::constantSpectrum(1);
            light.strength = 0.01 * i;
            light.position = {x, y, z};
            scene.point_lights.push_back(light);
            continue;
        }
        crt::Mesh mesh;
        mesh.positions = {{x, y, z}, {x + 0.02, y, z}, {x, y + 0.01 * (i % 3), z + 0.03}};
        mesh.triangles = {{0, 1, 2}};
        crt::Object object;
        object.mesh = static_cast<std::uint32_t>(scene.meshes.size());
        object.material = 0;
        object.emission = static_cast<std::int32_t>(scene.emissions.size());
        scene.emissions.push_back({crt::constantSpectrum(2.0 + i), i % 2 == 0});
        scene.meshes.push_back(mesh);
        scene.objects.push_back(object);
    }
}

/// Of random words, made again for each compilation: any texel is a value.
std::shared_ptr<const crt::TextureImage> randomImage(std::uint32_t width, std::uint32_t height,
                                                     crt::TexelKind kind) {
    auto image = std::make_shared<crt::TextureImage>();
    image->file = "random";
    image->width = width;
    image->height = height;
    image->kind = kind;
    image->decode = [](std::span<std::uint16_t> words) {
        std::uint64_t state = 1;
        for (std::uint16_t& word : words) {
            state = state * 6364136223846793005u + 1442695040888963407u;
            word = static_cast<std::uint16_t>(state >> 40);
        }
    };
    return image;
}

void addUvs(crt::Scene& scene) {
    for (crt::Mesh& mesh : scene.meshes) {
        for (const crt::Vec3d& p : mesh.positions)
            mesh.uvs.push_back({p[0] + 0.3 * p[1], p[2] - 0.7 * p[1]});
        mesh.uv_index = mesh.triangles;
    }
}

/// Every kind of texture, filter and wrap.
void addTextures(crt::Scene& scene) {
    using crt::Texture;
    const auto put = [&](const char* material, bool roughness, Texture texture) {
        scene.textures.push_back(std::move(texture));
        const auto index = static_cast<crt::TextureIndex>(scene.textures.size() - 1);
        for (crt::Material& m : scene.materials)
            if (m.name == material) (roughness ? m.roughness_texture : m.reflectance_texture) = index;
        return index;
    };
    Texture mirrored;
    mirrored.image = randomImage(7, 5, crt::TexelKind::Spectra);
    mirrored.wrap = crt::TextureWrap::Mirror;
    mirrored.transform = {2.5, 0.25, -0.5, -0.5, 3, 0.125};
    Texture clamped = mirrored;
    clamped.wrap = crt::TextureWrap::Clamp;
    Texture nearest = mirrored;
    nearest.wrap = crt::TextureWrap::Repeat;
    nearest.filter = crt::TextureFilter::Nearest;
    Texture checker;
    checker.kind = Texture::Kind::Checker;
    checker.transform = {8, 0, -3.5, 0, 8, 0};
    checker.values[0].texture = put("", false, nearest);
    checker.values[1].spectrum = scene.materials[1].reflectance;  // a table
    put("white", false, mirrored);
    put("red", false, checker);
    put("mirror", false, clamped);
    Texture rough;
    rough.image = randomImage(16, 3, crt::TexelKind::Numbers);
    put("copper", true, rough);
    Texture vertices;
    vertices.kind = Texture::Kind::VertexColors;
    crt::Material coloured;
    coloured.name = "coloured";
    scene.materials.push_back(coloured);
    put("coloured", false, vertices);
    for (crt::Object& object : scene.objects)
        if (object.name == "strip") object.material = static_cast<std::int32_t>(scene.materials.size() - 1);
    for (crt::Mesh& mesh : scene.meshes)
        for (const crt::Vec3d& p : mesh.positions)
            mesh.colors.push_back({static_cast<float>(0.1 + 0.8 * p[0]), 0.4f,
                                   static_cast<float>(0.9 - 0.8 * p[2])});
    addUvs(scene);
}

/// Mixes in mixes, by a number and by a texture, of lobes and deltas; sides; surfaces with holes, emitters
/// among them.
void addCompositions(crt::Scene& scene) {
    addUvs(scene);
    const auto indexOf = [&](const std::string& name) {
        std::int32_t index = 0;
        while (scene.materials[static_cast<std::size_t>(index)].name != name) ++index;
        return index;
    };
    const auto compose = [&](const char* name, crt::MaterialType type, const char* first,
                             const char* second) -> crt::Material& {
        crt::Material m;
        m.name = name;
        m.type = type;
        m.parts = {indexOf(first), indexOf(second)};
        scene.materials.push_back(m);
        return scene.materials.back();
    };
    const auto give = [&](const char* object, const char* material) {
        for (crt::Object& o : scene.objects)
            if (o.name == object) o.material = indexOf(material);
    };
    crt::Texture numbers;
    numbers.image = randomImage(6, 9, crt::TexelKind::Numbers);
    scene.textures.push_back(numbers);
    compose("worn", crt::MaterialType::Mix, "mirror", "red").amount_texture = 0;
    compose("sheet", crt::MaterialType::TwoSided, "copper", "worn");
    compose("everything", crt::MaterialType::Mix, "sheet", "flint").amount = 0.375;
    crt::Material& veil = compose("veil", crt::MaterialType::Mix, "gold", "white");
    veil.amount = 0.75;
    veil.opacity = 0.5;
    for (crt::Material& m : scene.materials)
        if (m.name == "glass") m.opacity_texture = 0;
    give("back", "worn");
    give("shield", "veil");
    give("gems", "everything");
    give("right", "sheet");
    give("strip", "veil");
}

/// Of random directions, some below the surface, on every material, flat and smooth, with either handedness.
void addNormalMaps(crt::Scene& scene) {
    addUvs(scene);
    crt::Texture map;
    map.image = randomImage(8, 4, crt::TexelKind::Normals);
    map.transform = {2, 0.5, 0.25, -0.5, 3, 0.125};
    scene.textures.push_back(map);
    map.filter = crt::TextureFilter::Nearest;
    map.transform = {-1, 0, 0, 0, 1, 0};
    scene.textures.push_back(map);
    for (std::size_t i = 0; i < scene.materials.size(); ++i) {
        scene.materials[i].normal_texture = static_cast<crt::TextureIndex>(i % 2);
        scene.materials[i].normal_strength = i % 3 == 0 ? 1 : 0.375;
    }
}

/// Bins that do not cover all wavelengths, and two sensors.
void addInstruments(crt::Scene& scene) {
    crt::SpectralFilm& film = scene.film.spectral;
    film.bins = {400, 731.5, 13};
    for (const std::size_t peak : {90u, 300u}) {
        crt::Spectrum response;
        for (std::size_t i = 0; i < crt::kSpectrumSize; ++i) {
            const double away = (static_cast<double>(i) - static_cast<double>(peak)) / 60;
            response[i] = std::max(0.0, 1 - away * away);
        }
        film.responses.push_back({peak < 200 ? "blue" : "red", response});
    }
}

/// Films on all that may have one, each of another thickness; of a texture on smooth metal, if there is one.
void addFilms(crt::Scene& scene) {
    double thickness_nm = 250;
    for (crt::Material& m : scene.materials) {
        using enum crt::MaterialType;
        if (m.type == Diffuse || m.type == Mirror || m.type == Plastic) continue;
        m.film_thickness_nm = thickness_nm += 60;
        m.film_index = crt::constantSpectrum(1.4);
        if (m.type == Conductor && !scene.textures.empty()) m.film_texture = 0;
    }
}

/// Rough surfaces that are rougher one way, each by its own: about coordinates on every other mesh.
void addBrushes(crt::Scene& scene) {
    addUvs(scene);
    for (std::size_t i = 0; i < scene.meshes.size(); i += 2) scene.meshes[i].uv_index.clear();
    double anisotropy = 0.5;
    for (crt::Material& m : scene.materials) {
        m.anisotropy = anisotropy;
        m.anisotropy_rotation_deg = 100 * anisotropy;
        anisotropy = anisotropy < 0.9 ? anisotropy + 0.125 : 0.25;
    }
}

/// Metals and gloss by their colours, of a table and of a texture.
void addColors(crt::Scene& scene) {
    addUvs(scene);
    crt::Texture colors;
    colors.image = randomImage(5, 7, crt::TexelKind::Spectra);
    scene.textures.push_back(colors);
    for (crt::Material& m : scene.materials) {
        using enum crt::MaterialType;
        if (m.type != Conductor && m.type != RoughConductor && m.type != Diffuse) continue;
        if (m.type == RoughConductor) m.reflectance_texture = 0;
        m.reflectance = scene.materials[1].reflectance;
        m.type = m.type == Diffuse ? Plastic : RoughConductor;
        m.edge_tint = m.reflectance;
        m.eta = crt::constantSpectrum(1.4);
        m.weight = 0.875;
        m.roughness = 0.3;
        m.by_color = true;
    }
}

/// Fuzz on every material, each by its own.
void addFuzz(crt::Scene& scene) {
    double share = 0.25;
    for (crt::Material& m : scene.materials) {
        m.fuzz = share;
        m.fuzz_roughness = 1.25 - share;
        m.fuzz_color = share < 0.5 ? crt::constantSpectrum(1) : scene.materials[1].reflectance;
        share = share < 1 ? share + 0.25 : 0.25;
    }
}

/// Coats on every material that reflects, each its own: smooth and rough, clear and tinted, under fuzz; some
/// about interpolated normals.
void addCoats(crt::Scene& scene) {
    double share = 0;
    for (crt::Material& m : scene.materials) {
        if (m.name == "flint") {
            m.type = crt::MaterialType::Plastic;
            m.eta = crt::constantSpectrum(1.25);
            m.reflectance = scene.materials[1].reflectance;
        }
        if (m.transmits()) continue;
        crt::Clearcoat& coat = m.clearcoat.emplace();
        coat.ior = 1.25 + share;
        coat.roughness = share;
        coat.depth = share < 0.5 ? crt::constantSpectrum(0) : scene.materials[1].reflectance;
        coat.darkening = 1 - share;
        coat.base_roughness = share;
        if (share == 0.5) {
            m.fuzz = 0.5;
            m.fuzz_roughness = 0.5;
            m.fuzz_color = crt::constantSpectrum(0.75);
        }
        share = share < 1 ? share + 0.25 : 0;
    }
}

/// Gloss and coats whose roughness is in an image: gloss bare and under coats, metal under them, and a coat
/// of its own roughness on gloss that varies.
void addVaryingGloss(crt::Scene& scene) {
    addUvs(scene);
    crt::Texture rough;
    rough.image = randomImage(9, 4, crt::TexelKind::Numbers);
    scene.textures.push_back(rough);
    const auto index = static_cast<crt::TextureIndex>(scene.textures.size() - 1);
    int number = 0;
    for (crt::Material& m : scene.materials) {
        if (m.transmits()) continue;
        if (m.type == crt::MaterialType::Diffuse) {
            m.type = crt::MaterialType::Plastic;
            m.eta = crt::constantSpectrum(1.375);
        }
        const bool gloss = m.type == crt::MaterialType::Plastic,
                   metal = m.type == crt::MaterialType::RoughConductor;
        if (gloss && number % 2 == 0) m.roughness_texture = index;
        if (number++ % 3 == 0) continue;
        crt::Clearcoat& coat = m.clearcoat.emplace();
        coat.ior = 1.5;
        coat.roughness = 0.25;
        if (number % 2 == 0) coat.roughness_texture = index;
        coat.depth = crt::constantSpectrum(0.25);
        coat.base_share = 0.5;
        coat.roughens = (gloss || metal) && (number % 2 == 0 || m.roughness_texture != crt::kNoTexture);
    }
}

/// A tint on all that has one, of a table and of a texture in turn.
void addTints(crt::Scene& scene) {
    addUvs(scene);
    crt::Texture colors;
    colors.image = randomImage(4, 6, crt::TexelKind::Spectra);
    scene.textures.push_back(colors);
    const auto index = static_cast<crt::TextureIndex>(scene.textures.size() - 1);
    for (crt::Material& m : scene.materials) {
        if (&m - scene.materials.data() & 1)
            m.tint = scene.materials[1].reflectance;
        else
            m.tint_texture = index;
    }
}

/// Diffuse and plastic surfaces become sheets, bare, glossy or rough, of numbers and of an image in turn.
void addSheets(crt::Scene& scene) {
    addUvs(scene);
    crt::Texture colors;
    colors.image = randomImage(6, 5, crt::TexelKind::Spectra);
    scene.textures.push_back(colors);
    const auto index = static_cast<crt::TextureIndex>(scene.textures.size() - 1);
    int number = 0;
    for (crt::Material& m : scene.materials) {
        if (m.type != crt::MaterialType::Diffuse && m.type != crt::MaterialType::Plastic) continue;
        if (m.type == crt::MaterialType::Diffuse) m.eta = crt::constantSpectrum(number % 2 == 0 ? 1 : 1.375);
        m.type = crt::MaterialType::Plastic;
        m.roughness = number % 3 == 0 ? 0.4 : 0;
        m.diffuse_roughness = 0;
        if (number % 2 == 1) m.transmittance_texture = index;
        else m.transmittance = crt::constantSpectrum(0.375);
        m.by_color = number++ % 4 == 3;
    }
}

/// All that emits shows an image, tables of radiance times texels; another image is times a spectrum.
void addScreens(crt::Scene& scene) {
    addUvs(scene);
    crt::Texture picture;
    picture.image = randomImage(12, 9, crt::TexelKind::Spectra);
    for (crt::Emission& emission : scene.emissions) {
        picture.factor = crt::TextureValue{emission.radiance, crt::kNoTexture};
        emission.texture = static_cast<crt::TextureIndex>(scene.textures.size());
        scene.textures.push_back(picture);
    }
    picture.factor = crt::TextureValue{scene.materials[1].reflectance, crt::kNoTexture};
    picture.wrap = crt::TextureWrap::Mirror;
    scene.materials[0].reflectance_texture = static_cast<crt::TextureIndex>(scene.textures.size());
    scene.textures.push_back(picture);
}

/// Shapes of every kind, whole and in part, from outside and from inside, one material each; some shine.
void addShapes(crt::Scene& scene) {
    const auto empty = static_cast<std::uint32_t>(scene.meshes.size());
    scene.meshes.emplace_back();
    std::int32_t material = 0;
    const auto add = [&](const crt::Quadric& shape, const crt::Matrix4d& transform) {
        crt::Object object;
        object.mesh = empty;
        object.shape = shape;
        object.transforms = {transform};
        object.material = material++ % static_cast<std::int32_t>(scene.materials.size());
        scene.objects.push_back(object);
    };
    using enum crt::QuadricType;
    // Turned by the cosine 0.6 and the sine 0.8, some mirrored.
    const auto at = [](double x, double y, double z, double scale, double mirrored = 1) -> crt::Matrix4d {
        return {0.6 * scale, 0, 0.8 * scale * mirrored, x, 0.8 * scale, 0, -0.6 * scale * mirrored, y,
                0, scale, 0, z, 0, 0, 0, 1};
    };
    add({Sphere, 1, -1, 1}, at(0.2, 0.2, 0.25, 0.15));
    add({Sphere, 1, -0.5, 0.75}, at(0.5, 0.3, 0.3, 0.12));
    add({Disk, 1, 0, 0}, at(0.8, 0.3, 0.4, 0.2));
    add({Cylinder, 1, -1, 2}, at(0.7, 0.7, 0.4, 0.06, -1));
    add({Sphere, 2, 1, 2, true}, at(0.3, 0.5, 0.6, 0.1, -1));
    add({Sphere, 1, -1, 1}, at(0.5, 0.55, 0.15, 0.1));
    add({Sphere, 1, -1, 1}, at(0.25, 0.75, 0.2, 0.1));
    add({Cylinder, 0.5, -1, 1, true}, at(0.85, 0.85, 0.6, 0.1));
    for (const crt::Vec3d& p : {crt::Vec3d{0.1, 0.9, 0.7}, {0.4, 0.1, 0.1}, {0.9, 0.1, 0.2}})
        add({Sphere, 1, -1, 1}, at(p[0], p[1], p[2], 0.04));
    const auto lamps = static_cast<std::int32_t>(scene.emissions.size());
    scene.emissions.push_back({crt::constantSpectrum(5), false});
    scene.emissions.push_back({scene.materials[1].reflectance, true});
    const std::size_t first = scene.objects.size() - 11;  // the first shape
    for (const auto& [shape, emission] : {std::pair{1, 1}, {2, 0}, {7, 1}, {9, 0}, {10, 1}})
        scene.objects[first + static_cast<std::size_t>(shape)].emission = lamps + emission;
}

/// One copy of each mesh that does not emit; the small ones in two more places, turned, stretched and
/// mirrored.
void addInstances(crt::Scene& scene) {
    for (crt::Object& object : scene.objects) {
        if (object.shape || object.emission >= 0) continue;
        object.sharing = crt::Sharing::Always;
        if (object.name != "gems" && object.name != "glass" && object.name != "strip") continue;
        const crt::Matrix4d first = object.transforms[0];
        for (const crt::Matrix4d& m : {crt::Matrix4d{0.3, 0, 0.4, 0.1, 0.4, 0, -0.3, 0.5, 0, 0.75, 0, 0.1,
                                                     0, 0, 0, 1},
                                       {-0.5, 0, 0, 0.9, 0, 0.25, 0, 0.55, 0, 0, 0.5, 0.3, 0, 0, 0, 1}}) {
            object.transforms.push_back(crt::multiply(m, first));
        }
    }
}

/// Rough diffuse surfaces, bare and glossy, in turn; some about interpolated normals.
void addRoughBases(crt::Scene& scene) {
    double eta = 1;
    for (crt::Material& m : scene.materials) {
        if (m.type != crt::MaterialType::Diffuse && m.type != crt::MaterialType::Plastic) continue;
        m.type = crt::MaterialType::Plastic;
        m.eta = crt::constantSpectrum(eta);
        m.roughness = eta > 1.3 ? 0.4 : 0;
        m.by_color = eta > 1;
        m.diffuse_roughness = eta < 1.7 ? eta / 2 : 1;
        eta = eta < 1.5 ? eta + 0.25 : 1;
    }
}

// Together every feature bit, sampler, accelerator and view: asserted below.
const Case kCases[] = {
    {"{max_depth: 12}", "{type: sobol}", "", "box"},
    {"{max_depth: 12, accelerator: bvh}", "{type: independent, seed: 7}",
     ", aperture_radius: 0.05, focus_distance: 1.9", "gaussian"},
    {"{max_depth: 5, accelerator: aabb, nee: false}", "{type: xorshift, seed: 18446744073709551615}", "",
     "blackman-harris"},
    {"{type: normals, accelerator: bvh}", "{type: sobol}", "", "box"},
    {"{type: aabb}", "{type: sobol}", "", "box"},
    {"{max_depth: 12}", "{type: sobol}", "", "box", true},
    {"{max_depth: 4, accelerator: bvh}", "{type: independent}", "", "box", true},
    {"{max_depth: 12}", "{type: sobol}", "", "box", true, kPointLights},
    {"{max_depth: 4, accelerator: bvh, mis: false}", "{type: independent}", "", "box", false, kPointLights},
    {"{max_depth: 12}", "{type: sobol}", "", "box", false, "", true},
    {"{max_depth: 8, accelerator: bvh}", "{type: xorshift}", "", "box", true, "", true},
    {"{max_depth: 6}", "{type: sobol}", "", "box", false, "", false, true},
    {"{max_depth: 6, accelerator: bvh}", "{type: independent}", "", "box", false, "", false, true},
    {"{max_depth: 12}", "{type: sobol}", "", "box", true, "", false, false, true},
    {"{max_depth: 4, accelerator: bvh}", "{type: xorshift}", "", "box", true, kPointLights, false, false,
     true},
    {"{max_depth: 8}", "{type: sobol}", "", "box", true, kPointLights, false, false, false, true},
    {"{max_depth: 4, accelerator: bvh}", "{type: xorshift}", "", "box", false, "", false, false, false,
     true},
    {"{max_depth: 4, accelerator: bvh, mis: false}", "{type: independent}", "", "box", true, "", false,
     false, false, true},
    {"{max_depth: 8}", "{type: sobol}", "", "box", true, kPointLights, false, false, false, false, true},
    {"{max_depth: 6, accelerator: bvh}", "{type: xorshift}", "", "box", true, "", true, false, true, false,
     true},
    {"{max_depth: 12}", "{type: sobol}", "", "box", false, "", false, false, false, false, false,
     true},
    {"{max_depth: 12}", "{type: sobol}", "", "box", false, "", true, false, false, false, false, false,
     true},
    {"{max_depth: 6, accelerator: bvh}", "{type: independent}", "", "box", true, "", true, true, false,
     false, false, false, true},
    {"{max_depth: 6}", "{type: sobol}", "", "box", false, kPointLights, false, false, false, false, false,
     false, false, true},
    {"{max_depth: 6}", "{type: sobol}", "", "box", true, kPointLights, true, false, false, false, false,
     false, false, false, true},
    {"{max_depth: 8}", "{type: sobol}", "", "box", false, "", true, false, false, false, false, false, false,
     false, false, true},
    {"{max_depth: 8}", "{type: sobol}", "", "box", false, "", false, false, false, false, false, false,
     false, false, false, false, true},
    {"{max_depth: 8}", "{type: sobol}", "", "box", false, kPointLights, true, false, false, false, false,
     false, false, false, false, false, false, true},
    {"{max_depth: 8}", "{type: sobol}", "", "box", true, kPointLights, true, false, false, false, false,
     false, false, false, false, false, false, false, true},
    {"{max_depth: 8}", "{type: sobol}", "", "box", true, kPointLights, true, false, false, false, true,
     false, false, false, false, false, false, false, false, true},
    {"{max_depth: 8}", "{type: sobol}", "", "box", true, "", false, false, false, false, false, false, false,
     false, false, false, false, false, false, false, true},
    {"{max_depth: 6, accelerator: bvh}", "{type: independent}", "", "box", true, kPointLights, false, true,
     false, true, false, false, false, false, false, true, false, false, false, false, true},
    {"{max_depth: 5, accelerator: aabb}", "{type: xorshift}", "", "box", false, "", true, false, false,
     false, true, false, false, false, false, false, false, false, false, false, true},
    {.integrator = "{max_depth: 8}", .sampler = "{type: sobol}", .camera_extra = "", .filter = "box",
     .sampled_environment = true, .glassware = true, .instanced = true},
    {.integrator = "{max_depth: 6}", .sampler = "{type: independent}", .camera_extra = "", .filter = "box",
     .more = kPointLights, .textured = true, .brushed = true, .shaped = true, .instanced = true},
    {.integrator = "{max_depth: 6}", .sampler = "{type: xorshift}", .camera_extra = "", .filter = "box",
     .composed = true, .mapped = true, .instanced = true},
    {.integrator = "{type: splat_test}", .sampler = "{type: independent}", .camera_extra = "",
     .filter = "box"},
    {.integrator = "{type: splat_test, accelerator: bvh}", .sampler = "{type: sobol, replicates: 8}",
     .camera_extra = "", .filter = "box", .textured = true},
    {.integrator = "{max_depth: 8}", .sampler = "{type: sobol}", .camera_extra = "", .filter = "box",
     .varying = true, .tinted = true},
    {.integrator = "{max_depth: 6}", .sampler = "{type: sobol}", .camera_extra = "", .filter = "box",
     .more = kPointLights, .glassware = true, .films = true, .tinted = true},
    {.integrator = "{max_depth: 6, accelerator: bvh}", .sampler = "{type: independent}", .camera_extra = "",
     .filter = "box", .sampled_environment = true, .more = kPointLights, .shaped = true, .instanced = true,
     .varying = true},
    {.integrator = "{max_depth: 8}", .sampler = "{type: sobol}", .camera_extra = "", .filter = "box",
     .more = kPointLights, .sheets = true, .screens = true},
    {.integrator = "{max_depth: 6, accelerator: bvh}", .sampler = "{type: independent}", .camera_extra = "",
     .filter = "box", .sampled_environment = true, .mapped = true, .instanced = true, .sheets = true},
    {.integrator = "{max_depth: 6, mis: false}", .sampler = "{type: xorshift}", .camera_extra = "",
     .filter = "box", .composed = true, .many_lights = true, .screens = true},
};

/// A room that needs little of the kernel, so that the lean kernel is another than the full one also where
/// only a few are compiled ahead.
crt::Scene plainScene(const std::string& integrator, const std::string& normals) {
    return sceneFrom(fmt::format(R"(crt: 1
camera: {{position: [0.5, 0.5, -1.4], target: [0.5, 0.5, 0.5], fov: 40}}
film: {{resolution: [48, 40]}}
integrator: {}
materials: {{white: {{type: diffuse, reflectance: 0.7}}}}
objects:
  - name: floor
    mesh: {{positions: [[0,0,0],[0,0,1],[1,0,1],[1,0,0]], faces: [[0,1,2,3]]}}
    material: white
  - name: back
    mesh: {{positions: [[0,0,1],[0,1,1],[1,1,1],[1,0,1]]{}, faces: [[0,1,2,3]]}}
    material: white
  - {{name: lamp, material: white,
     mesh: {{positions: [[0.3,0.99,0.3],[0.7,0.99,0.3],[0.7,0.99,0.7],[0.3,0.99,0.7]], faces: [[0,1,2,3]]}},
     emission: {{radiance: {{blackbody: 3000, scale: 5}}}}}}
)",
                                 integrator, normals));
}

crt::Scene sceneOf(const Case& c) {
    crt::Scene scene =
        sceneFrom(richScene(c.integrator, c.sampler, c.camera_extra, c.filter, c.glassware) + c.more);
    scene.environment->light_sampling = c.sampled_environment;
    if (c.shaped) addShapes(scene);
    if (c.textured) addTextures(scene);
    if (c.composed) addCompositions(scene);
    if (c.mapped) addNormalMaps(scene);
    if (c.films) addFilms(scene);
    if (c.sky)
        scene.environment->sky =
            crt::CieSky{.towards_sun = {0.36, 0.8, -0.48}, .amount = 4, .rows = 32};
    if (c.instruments) addInstruments(scene);
    if (c.lamps) addLamps(scene);
    if (c.many_lights) addManyLights(scene);
    if (c.brushed) addBrushes(scene);
    if (c.colored) addColors(scene);
    if (c.rough_bases) addRoughBases(scene);
    if (c.fuzzy) addFuzz(scene);
    if (c.coated) addCoats(scene);
    if (c.varying) addVaryingGloss(scene);
    if (c.tinted) addTints(scene);
    if (c.sheets) addSheets(scene);
    if (c.screens) addScreens(scene);
    if (c.instanced) addInstances(scene);
    return scene;
}

}  // namespace

std::vector<Named> conformance::allScenes() {
    const char* const names[] = {"sobol",
                                 "tree, independent, lens, gaussian",
                                 "boxes, xorshift, blackman-harris",
                                 "normals",
                                 "boxes",
                                 "sampled environment",
                                 "sampled environment, tree, independent",
                                 "point lights",
                                 "point lights, tree, independent, light sampling alone",
                                 "glassware",
                                 "glassware, tree, xorshift, sampled environment",
                                 "textures",
                                 "textures, tree, independent",
                                 "sky",
                                 "sky and point lights, tree, xorshift",
                                 "mixes and holes",
                                 "mixes and holes, tree, xorshift",
                                 "mixes and holes, tree, independent, light sampling alone",
                                 "normal maps",
                                 "normal maps, glassware, tree, xorshift",
                                 "spectral film",
                                 "films",
                                 "films, textures, tree, independent, sampled environment",
                                 "IES lamps and beams",
                                 "many lights",
                                 "brushed",
                                 "metals and gloss by their colours",
                                 "rough bases",
                                 "fuzz",
                                 "coats",
                                 "shapes",
                                 "shapes, mixes, brushed, tree, independent, textures",
                                 "shapes, normal maps, boxes, xorshift",
                                 "instances, glassware, sampled environment",
                                 "instances, shapes, textures, brushed, independent",
                                 "instances, mixes and holes, normal maps, xorshift",
                                 "splats",
                                 "splats, eight replicates, tree, sobol",
                                 "gloss and coats of varying roughness, tints",
                                 "tints, films, glassware, point lights",
                                 "varying gloss, shapes, instances, tree, independent",
                                 "sheets, screens, point lights",
                                 "sheets, normal maps, instances, tree, independent",
                                 "screens, many lights, mixes and holes, light sampling alone"};
    static_assert(std::size(names) == std::size(kCases));
    std::vector<Named> all;
    for (std::size_t i = 0; i < std::size(kCases); ++i) all.push_back({names[i], sceneOf(kCases[i])});
    all.push_back({"plain, without a tree", plainScene("{max_depth: 4, accelerator: none}", ""), true});
    all.push_back({"plain, with a tree and smooth normals",
                   plainScene("{max_depth: 4, accelerator: bvh}",
                              ", normals: [[0.1,0.1,-1],[0.1,-0.1,-1],[-0.1,-0.1,-1],[-0.1,0.1,-1]]"),
                   true});
    return all;
}

namespace {

/// Of everything in the film, as doubles: the order of additions, which is the backend's own, shows 2^-100
/// below the value.
std::string hashOf(const crt::Film& film) {
    std::vector<double> values;
    for (std::uint32_t y = 0; y < film.shape().height; ++y)
        for (std::uint32_t x = 0; x < film.shape().width; ++x) {
            for (std::uint32_t c = 0; c < film.shape().channels; ++c) values.push_back(film.sum(x, y, c));
            const std::size_t pixel = std::size_t{y} * film.shape().width + x;
            values.push_back(static_cast<double>(film.counts[pixel]));
            if (!film.primitives.empty()) values.push_back(film.primitives[pixel]);
        }
    for (const std::uint64_t word : film.splats)  // In halves, which a double holds.
        for (const std::uint64_t half : {word >> 32, word & 0xffffffff})
            values.push_back(static_cast<double>(half));
    const XXH128_hash_t hash = XXH3_128bits(values.data(), values.size() * sizeof values[0]);
    return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

/// Lines of bits_hashes.txt: version, hash, name.
struct StoredHash {
    std::uint32_t version;
    std::string hash, name;
};

std::vector<StoredHash> storedHashes() {
    std::vector<StoredHash> all;
    std::istringstream lines{std::string(kStoredHashes)};
    for (std::string line; std::getline(lines, line);) {
        if (line.empty() || line[0] == '#') continue;
        StoredHash stored{};
        std::istringstream words(line);
        words >> stored.version >> stored.hash >> std::ws;
        std::getline(words, stored.name);
        all.push_back(std::move(stored));
    }
    return all;
}

/// The new file: its comments, other versions' lines, then those of this version.
void storeHashes(const std::string& path, const std::map<std::string, std::string>& rendered) {
    std::string text;
    std::istringstream lines{std::string(kStoredHashes)};
    const std::string mine = std::to_string(CRT_BITS_VERSION) + " ";
    for (std::string line; std::getline(lines, line);)
        if (line.compare(0, mine.size(), mine) != 0) text += line + "\n";
    for (const auto& [name, hash] : rendered) text += fmt::format("{}{} {}\n", mine, hash, name);
    std::ofstream file(path, std::ios::binary);
    file << text;
    REQUIRE(file.flush());
}

}  // namespace

TEST_CASE("the scenes have together every feature bit", "[bits]") {
    std::uint64_t together = 0;
    for (const Case& c : kCases) together |= crt::compileScene(sceneOf(c), kAllAovs).header().features;
    INFO("no scene needs " << crt::featureNames(CRT_FEATURES_ALL & ~together));
    CHECK(together == CRT_FEATURES_ALL);
}

TEST_CASE("a change of bits needs a new version of them", "[bits]") {
    std::map<std::string, std::string> rendered, stored;
    for (const Named& n : allScenes()) {
        Run run;
        run.samples = 4;
        run.aovs = kAllAovs;
        run.options.kernel = CRT_KERNEL_FULL;  // The lean ones are compared with it below.
        rendered[n.name] = hashOf(render(backend(), n.scene, run));
    }
    // Two scenes of the same hash would mean that it sees too little.
    for (const auto& [name, hash] : rendered)
        for (const auto& [other, other_hash] : rendered) CHECK((name == other) == (hash == other_hash));
    if (const char* path = std::getenv("CRT_UPDATE_BITS")) return storeHashes(path, rendered);

    for (const StoredHash& line : storedHashes())
        if (line.version == CRT_BITS_VERSION) stored[line.name] = line.hash;
    INFO("bits version "
         << CRT_BITS_VERSION
         << ": raise CRT_BITS_VERSION and store the new hash (core/kernel/dialect/bits_version.h says "
            "when): CRT_UPDATE_BITS=tests/bits_hashes.txt crt_conformance --backend embree "
            "'a change of bits*'");
    for (const auto& [name, hash] : rendered) {
        INFO(name);
        CHECK(hash == stored[name]);
    }
    CHECK(stored.size() == rendered.size());
}

TEST_CASE("the same bits as the portable build of the kernel", "[bits]") {
    for (const Case& c : kCases) {
        Run run;
        run.samples = 8;
        run.aovs = kAllAovs;
        run.options.kernel = CRT_KERNEL_FULL;
        const crt::Film ours = render(backend(), sceneOf(c), run);
        const crt::Film theirs = render(reference(), sceneOf(c), run);
        INFO(c.integrator << " " << c.sampler);
        CHECK(differingPixels(ours, theirs) == 0);
        CHECK(imageMean(ours) > 0);
        CHECK(ours.invalidSamples() == 0);
    }
}

TEST_CASE("threads and tiles do not show", "[bits]") {
    crt::Scene scene = sceneOf(kCases[0]);
    scene.film.width = 24;  // A tile of one pixel is a launch.
    scene.film.height = 20;
    Run run;
    run.samples = 8;
    run.options.threads = 1;
    const crt::Film one = render(backend(), scene, run);
    for (const auto& [threads, tile] : {std::pair{2u, 1u}, {7u, 5u}, {2u, 16u}, {7u, 64u}}) {
        run.options.threads = threads;
        run.options.tile_size = tile;
        INFO(threads << " threads, tiles of " << tile);
        CHECK(differingPixels(one, render(backend(), scene, run)) == 0);
    }
}

TEST_CASE("what a backend brings shows in no bit", "[bits]") {
    const crt::CompileOptions brings = crt::compileOptionsFor(backend());
    if (brings.accelerator_reach == 0) {  // Nothing: both films would be of the same compiled scene.
        for (const Named& n : allScenes()) CHECK_FALSE(crt::compileScene(n.scene, 0, brings).without_nodes);
        return;
    }
    const auto filmOf = [](const crt::Scene& scene, const crt::CompileOptions& options) {
        const crt::CompiledScene compiled = crt::compileScene(scene, kAllAovs, options);
        CHECK_FALSE((compiled.without_nodes && (compiled.nodes > 0 || options.accelerator_reach == 0)));
        crt::Integrator integrator(backend(), {});
        integrator.setScene(compiled);
        REQUIRE(integrator.render({.first_sample = 0, .sample_count = 4}));
        crt::Film film(crt::filmShapeOf(compiled));
        integrator.readFilm(film);
        return film;
    };
    bool any = false;
    for (const Named& n : allScenes()) {
        crt::Scene scene = n.scene;
        scene.integrator.accelerator = crt::Accelerator::Bvh;
        INFO(n.name);
        any = any || crt::compileScene(scene, 0, brings).without_nodes;
        CHECK(differingPixels(filmOf(scene, {}), filmOf(scene, brings)) == 0);
    }
    CHECK(any);  // Otherwise nothing was compared with anything.

    // A camera from beyond the reach of what it brings.
    crt::Scene far = sceneOf(kCases[0]);
    far.integrator.accelerator = crt::Accelerator::Bvh;
    for (double& x : far.camera.position) x *= 300;
    far.camera.tan_half_width /= 300;
    far.camera.tan_half_height /= 300;
    if (brings.accelerator_reach < 300) CHECK_FALSE(crt::compileScene(far, 0, brings).without_nodes);
    const crt::Film expected = filmOf(far, {});
    CHECK(imageMean(expected) > 0);
    CHECK(differingPixels(expected, filmOf(far, brings)) == 0);
}

TEST_CASE("sample ranges add up, in any order", "[bits]") {
    const crt::Scene scene = sceneOf(kCases[1]);
    Run run;
    run.samples = 24;
    run.aovs = kAllAovs;
    const crt::Film whole = render(backend(), scene, run);
    const auto part = [&](std::uint64_t first, std::uint64_t count) {
        Run r = run;
        r.first_sample = first;
        r.samples = count;
        return render(backend(), scene, r);
    };
    crt::Film merged = part(17, 7);
    merged.add(part(0, 5));
    merged.add(part(5, 12));
    CHECK(differingPixels(whole, merged) == 0);
    CHECK(merged.samples.text() == "0-24");
    // Another range gives another image: the comparison above could have failed.
    CHECK(differingPixels(whole, part(24, 24)) > 0);
}

TEST_CASE("crops tile the whole image", "[bits]") {
    Case c = kCases[0];
    Run run;
    run.samples = 4;
    const crt::Film whole = render(backend(), sceneOf(c), run);
    for (const auto& [x0, y0, x1, y1] :
         {std::array{0, 0, 20, 40}, std::array{20, 0, 48, 13}, std::array{20, 13, 48, 40}}) {
        const crt::Scene scene = sceneFrom(richScene(c.integrator, c.sampler, c.camera_extra, c.filter),
                                           {{"film.crop", fmt::format("[{}, {}, {}, {}]", x0, y0, x1, y1)}});
        const crt::Film crop = render(backend(), scene, run);
        std::uint64_t differing = 0;
        for (int y = y0; y < y1; ++y)
            for (int x = x0; x < x1; ++x)
                for (std::uint32_t channel = 0; channel < 3; ++channel)
                    differing +=
                        whole.mean(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), channel) !=
                        crop.mean(static_cast<std::uint32_t>(x - x0), static_cast<std::uint32_t>(y - y0),
                                  channel);
        CHECK(differing == 0);
    }
}

TEST_CASE("moving a scene by a power of two of its size, or scaling it by one, does not show", "[bits]") {
    const auto cube = [](double scale, double shift) {
        return fmt::format(R"(crt: 1
camera: {{position: [{1}, {1}, {2}], target: [{1}, {1}, {1}], fov: 50}}
film: {{resolution: [24, 24]}}
integrator: {{max_depth: 6}}
materials: {{white: {{type: diffuse, reflectance: 0.7}}}}
objects:
  - {{name: floor, mesh: {{positions: [[{4},{4},{4}],[{4},{4},{3}],[{3},{4},{3}],[{3},{4},{4}]],
      faces: [[0,1,2,3]]}}, material: white}}
  - {{name: lamp, mesh: {{positions: [[{4},{3},{4}],[{3},{3},{4}],[{3},{3},{3}],[{4},{3},{3}]],
      faces: [[0,1,2,3]]}}, material: white, emission: {{radiance: 1}}}}
)",
                           scale, shift, shift - 3 * scale, shift + scale, shift - scale);
    };
    Run run;
    run.samples = 4;
    const crt::Film here = render(backend(), sceneFrom(cube(1, 0)), run);
    CHECK(imageMean(here) > 0.01);
    CHECK(differingPixels(here, render(backend(), sceneFrom(cube(1, 1048576)), run)) == 0);
    CHECK(differingPixels(here, render(backend(), sceneFrom(cube(1048576, 0)), run)) == 0);
    CHECK(differingPixels(here, render(backend(), sceneFrom(cube(std::ldexp(1.0, -20), 0)), run)) == 0);
}

TEST_CASE("an empty scene renders its background", "[bits]") {
    Run run;
    const crt::Film film = render(backend(),
                                  sceneFrom("crt: 1\ncamera: {position: [0, 0, 0], target: [0, 0, 1], fov: "
                                            "40}\nfilm: {resolution: [8, 8]}\nenvironment: {radiance: 1}\n"),
                                  run);
    CHECK(imageMean(film) == Approx(1).margin(0.05));
    CHECK(film.invalidSamples() == 0);
}
