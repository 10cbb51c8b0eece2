#include "scene/import/gltf_import.h"

#include "scene/gltf/gltf_accessor.h"
#include "scene/gltf/gltf_json.h"
#include "scene/gltf/gltf_mesh.h"
#include "scene/gltf/gltf_model.h"
#include "scene/gltf/gltf_tangents.h"
#include "scene/import/gltf_graph.h"
#include "scene/import/gltf_materials.h"
#include "scene/import/gltf_variants.h"
#include "scene/light_units.h"
#include "scene/scene.h"
#include "spectra/spectra.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <set>
#include <utility>
#include <vector>

namespace crt {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;

std::string steps(const Matrix4d& world) {
    if (world == kIdentity4d) return "[]";
    const Vec3d moved{world[3], world[7], world[11]};
    Matrix4d only_moved = kIdentity4d;
    for (std::size_t r = 0; r < 3; ++r) only_moved[4 * r + 3] = moved[r];
    return world == only_moved ? fmt::format("[{{translate: {}}}]", yamlList(moved))
                               : fmt::format("[{{matrix: {}}}]", yamlList(world));
}

class Writer {
public:
    Writer(GltfFile& file, std::string file_name, std::string folder, const ImportOptions& options,
           Losses& losses)
        : file_(file),
          model_(file.model()),
          file_name_(std::move(file_name)),
          allow_outside_(options.allow_outside),
          variants_(file, options.variant, losses),
          losses_(losses),
          graph_(readGltfGraph(file, losses)),
          textures_(file, file_name_, std::move(folder), losses),
          nit_(graph_.lights.empty() ? 1 : 1 / luminanceOfUnitY_cd_m2()),
          materials_(file, textures_, nit_, losses) {}

    std::string text() {
        const std::string objects = objectsText();
        if (objects.empty())
            file_.fail("/scenes", "nothing is visible: no node of the scene has a mesh of triangles");
        std::string all = cameraText();
        all += environmentText() + lightsText();
        all += "\nmaterials:\n" + materials_.text();
        return all + "\nobjects:\n" + objects;
    }

private:
    std::string objectsText();
    std::vector<PaintedTriangle> paintedTriangles(std::size_t fewest_materials);
    std::string primitiveText(int mesh, std::size_t number, const std::vector<Matrix4d>& worlds,
                              const std::string& name);
    std::string cameraText();
    std::string lightsText() const;
    std::string environmentText() const;
    double illuminance() const;
    double exposure() const;
    std::string environmentBesideLights() const;
    void noteTangents(std::size_t mesh, std::size_t primitive, std::size_t uv_set);

    GltfFile& file_;
    const tinygltf::Model& model_;
    std::string file_name_;
    bool allow_outside_;
    GltfVariants variants_;
    Losses& losses_;
    GltfGraph graph_;
    GltfTextures textures_;
    double nit_;
    GltfMaterials materials_;
    UniqueNames names_;
    Bounds bounds_;
    double extent_ = 0, mirroring_extent_ = 0;   ///< Squares of sizes of primitives, as a measure of area.
    std::vector<std::vector<Matrix4d>> worlds_;  ///< By mesh, where it stands.
    std::optional<InnerView> inner_;             ///< Of the camera, if it is within the model.
};

double luminanceOf(const std::vector<double>& c) {
    return c.size() < 3 ? 1 : 0.2126729 * c[0] + 0.7151522 * c[1] + 0.0721750 * c[2];
}

std::string colorOfLight(const std::vector<double>& c) {
    return c.size() < 3 ? "{rgb: [1, 1, 1], space: linear}"
                        : fmt::format("{{rgb: {}, space: linear}}", yamlList(c.data(), 3));
}

std::string Writer::primitiveText(int mesh, std::size_t number, const std::vector<Matrix4d>& worlds,
                                  const std::string& name) {
    const tinygltf::Primitive& primitive = model_.meshes[static_cast<std::size_t>(mesh)].primitives[number];
    const std::string pointer = fmt::format("/meshes/{}/primitives/{}", mesh, number);
    if (primitive.mode < TINYGLTF_MODE_TRIANGLES) {
        losses_.add("points or lines, which have no surface");
        return {};
    }
    const auto position = primitive.attributes.find("POSITION");
    if (position == primitive.attributes.end()) {
        losses_.add("a primitive without positions");
        return {};
    }
    const GltfAccessor positions(file_, position->second, pointer + "/attributes/POSITION");
    positions.requireComponents(3, 3);
    Bounds own;
    for (const Vec3d& p : positions.rows<3>()) own.add(p);
    double extent = 0;
    for (const Matrix4d& world : worlds) {
        Bounds placed;
        for (int corner = 0; corner < 8; ++corner)
            placed.add(pointAt(
                world, {corner & 1 ? own.upper[0] : own.lower[0], corner & 2 ? own.upper[1] : own.lower[1],
                        corner & 4 ? own.upper[2] : own.lower[2]}));
        bounds_.add(placed.lower);
        bounds_.add(placed.upper);
        extent += placed.radius() * placed.radius();
    }
    GltfMaterialUse use{.material = variants_.materialOf(primitive),
                        .colors = primitive.attributes.contains("COLOR_0")};
    if (use.colors && use.material >= 0 &&
        static_cast<std::size_t>(use.material) < model_.materials.size() &&
        model_.materials[static_cast<std::size_t>(use.material)].alphaMode != "OPAQUE")
        use.alpha = alphaRange(file_, static_cast<std::size_t>(mesh), number);
    for (unsigned set = 0; set < 8; ++set)
        if (primitive.attributes.contains(fmt::format("TEXCOORD_{}", set))) use.uv_sets |= 1u << set;
    const GltfMaterialText& material = materials_.of(use);
    extent_ += extent;
    mirroring_extent_ += extent * material.mirrors;
    if (material.normal_map && primitive.attributes.contains("TANGENT"))
        noteTangents(static_cast<std::size_t>(mesh), number, material.uv_set);
    std::string text =
        fmt::format("  - name: {}\n    gltf: {{file: {}, mesh: {}, primitive: {}",
                    yamlText(names_.take(name, "object")), yamlText(file_name_), mesh, number);
    if (material.uv_set > 0) text += fmt::format(", uv_set: {}", material.uv_set);
    if (use.colors && material.color_factor != std::array<double, 3>{1, 1, 1})
        text += ", color_factor: " + yamlList(material.color_factor);
    if (material.vertex_opacity) text += ", vertex_opacity: true";
    if (allow_outside_) text += ", allow_outside: true";
    text += fmt::format("}}\n    material: {}\n", yamlText(material.name));
    if (!material.emission.empty()) text += fmt::format("    emission: {}\n", material.emission);
    if (worlds.size() == 1) {
        if (worlds[0] != kIdentity4d) text += fmt::format("    transform: {}\n", steps(worlds[0]));
        return text;
    }
    text += "    transforms:\n";
    for (const Matrix4d& world : worlds) text += fmt::format("      - {}\n", steps(world));
    return text;
}

void Writer::noteTangents(std::size_t mesh, std::size_t primitive, std::size_t uv_set) {
    std::uint64_t without_area = 0;
    const Mesh read =
        readGltfPrimitive(file_, {.mesh = mesh, .primitive = primitive, .uv_set = uv_set}, without_area);
    if (hasOtherTangents(read, readGltfTangents(file_, mesh, primitive)))
        losses_.add(
            "tangents (TANGENT) that differ from those of the texture coordinates, which crt uses for "
            "normal maps");
}

/// An object for each primitive, placed as often as its mesh is.
std::string Writer::objectsText() {
    worlds_.resize(model_.meshes.size());
    std::vector<std::string> names(model_.meshes.size());
    std::vector<int> order;
    for (const GltfPlaced& placed : graph_.meshes) {
        const auto mesh = static_cast<std::size_t>(placed.what);
        const Matrix4d world = gltfBindPose(file_, graph_, placed, losses_);
        if (flattens(world)) {
            losses_.add("a node that flattens its mesh");
            continue;
        }
        if (worlds_[mesh].empty()) {
            order.push_back(placed.what);
            names[mesh] = model_.nodes[static_cast<std::size_t>(placed.node)].name;
        }
        worlds_[mesh].push_back(world);
    }
    std::string text;
    for (const int mesh : order) {
        const auto i = static_cast<std::size_t>(mesh);
        const std::string& own = model_.meshes[i].name;
        const std::string name = worlds_[i].size() == 1 && !names[i].empty() ? names[i]
                                 : own.empty()                               ? fmt::format("mesh {}", mesh)
                                                                             : own;
        for (std::size_t k = 0; k < model_.meshes[i].primitives.size(); ++k)
            text += primitiveText(mesh, k, worlds_[i], name);
    }
    return text;
}

/// The geometry of the objects, in the world; nothing if it is too much to search for a place in, or has
/// fewer materials.
std::vector<PaintedTriangle> Writer::paintedTriangles(std::size_t fewest_materials) {
    std::vector<PaintedTriangle> triangles;
    const auto forPrimitives = [&](const auto& what) {
        for (std::size_t mesh = 0; mesh < worlds_.size(); ++mesh)
            for (std::size_t k = 0; k < model_.meshes[mesh].primitives.size(); ++k) {
                const tinygltf::Primitive& primitive = model_.meshes[mesh].primitives[k];
                const auto position = primitive.attributes.find("POSITION");
                if (primitive.mode >= TINYGLTF_MODE_TRIANGLES && position != primitive.attributes.end())
                    what(mesh, k, primitive.indices >= 0 ? primitive.indices : position->second);
            }
    };
    std::size_t corners = 0;
    std::set<int> materials;
    forPrimitives([&](std::size_t mesh, std::size_t k, int accessor) {
        corners += worlds_[mesh].size() * model_.accessors[static_cast<std::size_t>(accessor)].count;
        materials.insert(variants_.materialOf(model_.meshes[mesh].primitives[k]));
    });
    if (corners > 3 * kMostPaintedTriangles || materials.size() < fewest_materials)
        return triangles;
    forPrimitives([&](std::size_t mesh, std::size_t k, int) {
        if (worlds_[mesh].empty()) return;
        std::uint64_t without_area = 0;
        const Mesh read = readGltfPrimitive(file_, {.mesh = mesh, .primitive = k}, without_area);
        const auto material =
            static_cast<std::uint32_t>(variants_.materialOf(model_.meshes[mesh].primitives[k]));
        for (const Matrix4d& world : worlds_[mesh]) {
            const bool mirrors = dot(cross(directionAt(world, {1, 0, 0}), directionAt(world, {0, 1, 0})),
                                     directionAt(world, {0, 0, 1})) < 0;
            for (const auto& corner : read.triangles) {
                const Vec3d a = pointAt(world, read.positions[corner[0]]),
                            b = pointAt(world, read.positions[corner[1]]),
                            c = pointAt(world, read.positions[corner[2]]);
                triangles.emplace_back(a, mirrors ? c : b, mirrors ? b : c, material);
            }
        }
    });
    return triangles;
}

/// Of a surface in the middle that faces the light, roughly: lamps within the model count as if on its edge.
double Writer::illuminance() const {
    double sum = 0;
    const Vec3d centre = bounds_.centre();
    for (const GltfPlaced& placed : graph_.lights) {
        const tinygltf::Light& light = model_.lights[static_cast<std::size_t>(placed.what)];
        const double amount = light.intensity * luminanceOf(light.color);
        const double distance =
            std::max(length(pointAt(placed.world, {0, 0, 0}) - centre), bounds_.radius());
        sum += light.type == "directional" ? amount : distance > 0 ? amount / (distance * distance) : 0;
    }
    return sum;
}

std::string Writer::cameraText() {
    constexpr int kLonger = 960;
    double aspect = 1.5;
    std::string camera;
    for (const GltfPlaced& placed : graph_.cameras) {
        const tinygltf::Camera& own = model_.cameras[static_cast<std::size_t>(placed.what)];
        if (own.type != "perspective") {
            losses_.add("an orthographic camera, which crt does not support");
            continue;
        }
        if (!camera.empty()) {
            losses_.add("a second camera");
            continue;
        }
        const double yfov = own.perspective.yfov, given = own.perspective.aspectRatio;
        const Vec3d position = pointAt(placed.world, {0, 0, 0}),
                    ahead = directionAt(placed.world, {0, 0, -1}), up = directionAt(placed.world, {0, 1, 0});
        const double way = length(ahead), steep = length(cross(ahead, up));
        if (!(yfov > 1e-3 && yfov < 3.1) || !(way > 1e-30 && way < 1e30) ||
            !(steep > 1e-6 * way * length(up))) {
            losses_.add("a camera that sees nothing");
            continue;
        }
        if (given > 0.05 && given < 20) aspect = given;
        const double shorter = aspect >= 1 ? yfov : 2 * std::atan(std::tan(yfov / 2) * aspect);
        const double far = std::max(length(bounds_.centre() - position), 1e-3 * bounds_.radius());
        const Vec3d target = position + ahead * ((far > 0 ? far : 1) / way);
        camera =
            fmt::format("position: {}, target: {}, up: {}, fov: {}", yamlList(position), yamlList(target),
                        yamlList(up * (1 / length(up))), yamlNumber(shorter * kDegrees));
        // Light from outside does not reach a closed room, or what is under the dome of a painted sky.
        if (graph_.lights.empty())
            if (const auto distance =
                    distanceWithin(paintedTriangles(1), position, ahead * (1 / way), shorter))
                inner_ = InnerView{position, target, shorter * kDegrees, *distance};
    }
    const int width = aspect >= 1 ? kLonger : std::max(static_cast<int>(std::lround(kLonger * aspect)), 1),
              height = aspect >= 1 ? std::max(static_cast<int>(std::lround(kLonger / aspect)), 1) : kLonger;
    std::string text;
    if (camera.empty()) {
        const double chosen_aspect = static_cast<double>(width) / height;
        inner_ = innerView(paintedTriangles(kFewestMaterialsOfBuildings), chosen_aspect);
        text += chosenCamera(bounds_, inner_, chosen_aspect, losses_);
    } else {
        text += fmt::format("\ncamera: {{{}}}\n", camera);
    }
    std::string film = fmt::format("resolution: [{}, {}]", width, height);
    if (!graph_.lights.empty()) {
        text += "# Exposed for a white surface that faces the lights.\n";
        film += fmt::format(", exposure_ev: {:.2f}", exposure());
    }
    text += fmt::format("film: {{{}}}\nsampler: {{samples: 128}}\n", film);
    return text;
}

/// In stops.
double Writer::exposure() const {
    constexpr double kMost_ev = 100;
    const double lux = illuminance();
    const double ev = lux > 0 ? std::log2(0.8 * std::numbers::pi / (lux * nit_)) : std::log2(1 / nit_);
    return std::clamp(ev, -kMost_ev, kMost_ev);
}

/// Lights of glTF have no size: metal and glass, which show what surrounds them, would be black.
std::string Writer::environmentBesideLights() const {
    constexpr double kMostMirrors = 0.5;
    if (!(mirroring_extent_ > kMostMirrors * extent_)) return {};
    losses_.choose(
        "a grey sky in addition to the file's lights, since most surfaces are metal or glass, which reflect "
        "their surroundings (`--set environment=null` leaves it out)");
    return chosenSky("most surfaces of the file are metal or glass, which reflect their surroundings",
                     std::exp2(-exposure()));
}

std::string Writer::environmentText() const {
    if (!graph_.lights.empty()) return environmentBesideLights();
    losses_.choose(inner_ ? "a grey sky and a lamp at the camera" : "a grey sky and a lamp");
    return chosenLight(inner_);
}

std::string Writer::lightsText() const {
    std::string text;
    UniqueNames names;
    for (const GltfPlaced& placed : graph_.lights) {
        const tinygltf::Light& light = model_.lights[static_cast<std::size_t>(placed.what)];
        const std::string pointer = fmt::format("/extensions/KHR_lights_punctual/lights/{}", placed.what);
        const Vec3d way = directionAt(placed.world, {0, 0, -1});
        const double amount = light.intensity * luminanceOf(light.color);
        if (!std::all_of(light.color.begin(), light.color.end(),
                         [](double c) { return c >= 0 && c < 1e6; }) ||
            !(amount >= 0 && amount < 1e20))
            file_.fail(pointer, "its colour or intensity is negative or too large");
        if (amount == 0) continue;
        if (light.range > 0) losses_.add("the range of a light: light in crt has no range limit");
        std::string keys;
        const std::string position = "position: " + yamlList(pointAt(placed.world, {0, 0, 0}));
        if (light.type == "point") {
            keys = fmt::format("type: point, {}, luminous_intensity_cd: {}", position, yamlNumber(amount));
        } else if (!(length(way) > 0)) {
            losses_.add("a light without a direction");
            continue;
        } else if (light.type == "directional") {
            keys = fmt::format("type: directional, direction: {}, illuminance_lx: {}", yamlList(way),
                               yamlNumber(amount));
        } else if (light.type == "spot") {
            const double outer = light.spot.outerConeAngle, inner = light.spot.innerConeAngle;
            if (!(inner >= 0 && inner <= outer && outer > 0 && outer <= std::numbers::pi))
                file_.fail(pointer + "/spot", "its inner angle must be between 0 and the outer one, and the "
                                              "outer one at most pi");
            constexpr double kLeast_deg = 0.01;  // As scenes take it.
            keys = fmt::format(
                "type: spot, {}, direction: {}, cone_angle_deg: {}, penumbra_deg: {}, "
                "luminous_intensity_cd: {}",
                position, yamlList(way), yamlNumber(std::max(outer * kDegrees, kLeast_deg)),
                yamlNumber((outer - inner) * kDegrees), yamlNumber(amount));
        } else {
            losses_.add("a light of an unknown type");
            continue;
        }
        text += fmt::format("  - {{name: {}, {}, spectrum: {}}}\n",
                            yamlText(names.take(light.name, "light")), keys, colorOfLight(light.color));
    }
    return text.empty() ? text : "\nlights:\n" + text;
}

}  // namespace

std::string gltfScene(GltfFile& file, const std::string& file_name, const std::string& folder,
                      const ImportOptions& options, Losses& losses) {
    const tinygltf::Model& model = file.model();
    if (file.animationCount() > 0) losses.add("animations: objects keep their initial places");
    for (const std::string& name : model.extensionsUsed)
        if (!knowsGltfExtension(name)) losses.add(fmt::format("the extension '{}'", name.substr(0, 60)));
    return Writer(file, file_name, folder, options, losses).text();
}

}  // namespace crt
