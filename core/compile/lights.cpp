#include "compile/lights.h"

#include "base/vec3d.h"
#include "compile/distributions.h"
#include "compile/emission_image.h"
#include "compile/geometry.h"
#include "compile/light_tree.h"
#include "compile/point_lights.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>

namespace crt {
namespace {

const Emission& emissionOf(const Scene& scene, const FlatTriangle& triangle) {
    return scene.emissions[static_cast<std::size_t>(triangle.emission)];
}

/// If triangles i and i + 1 emit alike and make a parallelogram, as the halves of a quad do: the corner of
/// triangle i across from their common edge.
std::optional<std::uint32_t> parallelogramCorner(const FlatScene& flat, std::size_t i) {
    if (i + 1 >= flat.triangles.size()) return std::nullopt;
    const FlatTriangle &one = flat.triangles[i], &next = flat.triangles[i + 1];
    if (next.object != one.object || next.emission != one.emission) return std::nullopt;
    for (std::size_t corner = 0; corner < 3; ++corner) {
        const Vec3d o = vertexOf(flat, i, corner), a = vertexOf(flat, i, (corner + 1) % 3),
                    b = vertexOf(flat, i, (corner + 2) % 3);
        const Vec3d across = a + b - o;
        for (std::size_t v = 0; v < 3; ++v) {
            // Turned the same way round: across, b, a.
            const Vec3d gap = vertexOf(flat, i + 1, v) - across;
            const Vec3d edge = a - o;
            if (vertexOf(flat, i + 1, (v + 1) % 3) == b && vertexOf(flat, i + 1, (v + 2) % 3) == a &&
                dot(gap, gap) <= 1e-12 * dot(edge, edge))
                return static_cast<std::uint32_t>(corner);
        }
    }
    return std::nullopt;
}

/// By luminance, but never zero for a lamp that the eye hardly sees: the film keeps all of XYZ.
double brightness(const Spectrum& radiance) {
    const Vec3d xyz = spectrumToXyz(radiance);
    return xyz[0] + xyz[1] + xyz[2] + 1e-6 * radiance.max();
}

/// True if rays may pass the triangle. Light sampling would need the opacity at each sampled point of such
/// an emitter; scattered rays find it without extra work.
bool isPassable(const Scene& scene, const FlatTriangle& triangle) {
    const auto material = static_cast<std::size_t>(triangle.material);
    return triangle.material >= 0 && material < scene.materials.size() &&
           !scene.materials[material].isOpaque();
}

/// Area of the sphere around the scene: as much light of the environment enters it as a lamp of this area
/// sends.
double areaAround(const FlatScene& flat) {
    Vec3d lower{}, upper{};
    for (std::size_t i = 0; i < flat.triangles.size(); ++i)
        for (std::size_t corner = 0; corner < 3; ++corner) {
            const Vec3d v = vertexOf(flat, i, corner);
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const bool first = i == 0 && corner == 0;
                lower[axis] = first ? v[axis] : std::min(lower[axis], v[axis]);
                upper[axis] = first ? v[axis] : std::max(upper[axis], v[axis]);
            }
        }
    const Vec3d diagonal = upper - lower;
    // 4 π r², and something where all lies in one point.
    return std::max(std::numbers::pi * dot(diagonal, diagonal), 1e-12);
}

/// Of a triangle, of two that make a parallelogram, or of a part of one. `corners`: the first three are
/// those of a triangle, by which way it faces.
LightBounds boundsOfEmitter(const std::vector<Vec3d>& corners, bool two_sided, double power) {
    LightBounds bounds;
    bounds.lower = bounds.upper = corners[0];
    for (const Vec3d& v : corners)
        for (std::size_t k = 0; k < 3; ++k) {
            bounds.lower[k] = std::min(bounds.lower[k], v[k]);
            bounds.upper[k] = std::max(bounds.upper[k], v[k]);
        }
    const Vec3d normal = cross(corners[1] - corners[0], corners[2] - corners[0]);
    const double length2 = dot(normal, normal);
    // A sliver's normal is rounding: it may shine anywhere.
    if (length2 > 0)
        bounds.axis = normal * (1 / std::sqrt(length2));
    else
        bounds.theta_o = std::numbers::pi;
    bounds.theta_e = std::numbers::pi / 2;
    bounds.two_sided = two_sided;
    bounds.power = power;
    return bounds;
}

std::vector<Vec3d> cornersOfTriangles(const FlatScene& flat, std::size_t triangle, std::size_t triangles) {
    std::vector<Vec3d> corners;
    for (std::size_t i = triangle; i < triangle + triangles; ++i)
        for (std::size_t corner = 0; corner < 3; ++corner) corners.push_back(vertexOf(flat, i, corner));
    return corners;
}

/// The tiles of what emits by images: how many, and how bright.
class Tiles {
public:
    Tiles(const Scene& scene, const FlatScene& flat, const std::vector<std::uint32_t>& emitting)
        : scene_(scene), flat_(flat) {
        double wanted = 0;
        for (const std::uint32_t i : emitting)
            if (const Emission& emission = emissionOf(scene, flat.triangles[i]);
                emission.texture != kNoTexture) {
                images_.try_emplace(emission.texture,
                                    scene.textures[static_cast<std::size_t>(emission.texture)]);
                wanted += texelsUnder(i);
            }
        share_ = std::min(1.0, kMostTiles / std::max(wanted, 1.0));
    }

    /// One for each texel under the triangle, or fewer where there are many.
    std::uint32_t rowsOf(std::uint32_t triangle) const {
        const double rows = std::sqrt(texelsUnder(triangle) * share_);
        return static_cast<std::uint32_t>(std::clamp<double>(rows, 1, CRT_TILE_ROWS_MAX));
    }
    /// Of 1 where all texels are white; nowhere 0, and nowhere far less than in the image as a whole.
    double brightnessOf(std::uint32_t triangle, const TileCorners& tile) const {
        constexpr TileCorners kWhole{{{0, 0}, {1, 0}, {0, 1}}};
        constexpr double kLeast = 1e-6, kEven = 0.01;
        const EmissionImage& image = imageOf(triangle);
        const kernel::CrtUvs& uvs = flat_.uvs[triangle];
        return std::max(image.mean(uvs, tile), kEven * image.mean(uvs, kWhole)) + kLeast;
    }

private:
    const EmissionImage& imageOf(std::uint32_t triangle) const {
        return images_.at(emissionOf(scene_, flat_.triangles[triangle]).texture);
    }
    double texelsUnder(std::uint32_t triangle) const {
        return std::min<double>(imageOf(triangle).texelsUnder(flat_.uvs[triangle]), kMostTiles);
    }

    const Scene& scene_;
    const FlatScene& flat_;
    std::map<TextureIndex, EmissionImage> images_;
    double share_ = 1;
};

/// Of a shape: a disk has one normal, all others have normals all round.
LightBounds boundsOfShape(const FlatScene& flat, std::size_t id, bool two_sided, double power) {
    const kernel::CrtShape& record = flat.shapes[id - flat.firstShape()].record;
    LightBounds bounds;
    bounds.lower = vertexOf(flat, id, 0);
    bounds.upper = vertexOf(flat, id, 1);
    bounds.axis = {record.z[0], record.z[1], record.z[2]};
    if (record.kind != CRT_SHAPE_DISK) bounds.theta_o = std::numbers::pi;
    bounds.theta_e = std::numbers::pi / 2;
    bounds.two_sided = two_sided;
    bounds.power = power;
    return bounds;
}

/// Of an emitter that light sampling leaves to scattered rays.
constexpr double kHardlyEver = 1e-6;

/// Adds the tiles of a triangle, each a light like `light`.
void addTiles(const FlatScene& flat, const Tiles& tiles, std::uint32_t triangle, kernel::CrtLight light,
              double brightness, LightPart& part, std::vector<double>& power,
              std::vector<std::optional<LightBounds>>& bounds) {
    part.light_of[triangle] = static_cast<std::uint32_t>(part.lights.size());
    const std::uint32_t rows = tiles.rowsOf(triangle);
    const double area = areaOf(flat, triangle) / (static_cast<double>(rows) * rows);
    const bool two_sided = (light.flags & CRT_LIGHT_TWO_SIDED) != 0;
    const double scale = area * brightness * (two_sided ? 2 : 1) *
                         ((light.flags & CRT_LIGHT_UNSAMPLED) != 0 ? kHardlyEver : 1);
    const Vec3d o = vertexOf(flat, triangle, 0), a = vertexOf(flat, triangle, 1) - o,
                b = vertexOf(flat, triangle, 2) - o;
    light.area = static_cast<float>(area);
    for (const Tile& tile : tilesOf(rows)) {
        light.corner = tile.corner;
        part.lights.push_back(light);
        power.push_back(scale * tiles.brightnessOf(triangle, tile.at));
        std::vector<Vec3d> corners;
        for (const auto& [b1, b2] : tile.at) corners.push_back(o + a * b1 + b * b2);
        bounds.push_back(boundsOfEmitter(corners, two_sided, power.back()));
    }
}

/// Nothing for lights that lie nowhere, and beams, which light what is in them alone.
std::optional<LightBounds> boundsOfPoint(const PointLight& light, const kernel::CrtPointLight& compiled,
                                         double power) {
    if (!shinesFromPoint(light.type)) return std::nullopt;
    const bool spot = light.type == PointLightType::Spot;
    constexpr double kDegree = std::numbers::pi / 180;
    LightBounds bounds;
    for (std::size_t k = 0; k < 3; ++k)
        bounds.lower[k] = bounds.upper[k] = static_cast<double>(compiled.position[k]);
    bounds.axis = light.direction;
    bounds.theta_o = spot ? (light.cone_angle_deg - light.penumbra_deg) * kDegree : std::numbers::pi;
    bounds.theta_e = spot ? light.penumbra_deg * kDegree : std::numbers::pi / 2;
    bounds.power = power;
    return bounds;
}

/// Puts the lights that lie at a place first, if they are many, and a tree over them. `power` and `bounds`
/// are theirs, and change with them.
void growTree(const std::vector<std::optional<LightBounds>>& bounds, LightPart& part,
              std::vector<double>& power) {
    std::vector<std::uint32_t> order(part.lights.size());
    std::iota(order.begin(), order.end(), 0u);
    const auto others = std::stable_partition(order.begin(), order.end(),
                                              [&](std::uint32_t i) { return bounds[i].has_value(); });
    const auto placed = static_cast<std::size_t>(others - order.begin());
    if (placed < kLightTreeLights) return;
    std::vector<LightBounds> own;
    std::vector<kernel::CrtLight> lights;
    std::vector<double> powers{0};  // Of the tree, then of the others.
    std::vector<std::uint32_t> now(order.size());
    for (const std::uint32_t i : order) {
        now[i] = static_cast<std::uint32_t>(lights.size());
        if (now[i] < placed) {
            own.push_back(*bounds[i]);
            powers[0] += power[i];
        } else {
            powers.push_back(power[i]);
        }
        lights.push_back(part.lights[i]);
    }
    LightTree tree = buildLightTree(own);
    for (std::size_t i = 0; i < placed; ++i) lights[i].choice = tree.leaf_of[i];
    part.lights = std::move(lights);
    part.tree = std::move(tree.nodes);
    part.tree_lights = static_cast<std::uint32_t>(placed);
    if (part.environment > 0) part.environment = now[part.environment - 1] + 1;
    for (kernel::CrtPointLight& light : part.point_lights) light.light = now[light.light];
    power = std::move(powers);
}

}  // namespace

std::vector<std::uint32_t> emittingTriangles(const Scene& scene, const FlatScene& flat) {
    std::vector<std::uint32_t> emitting;
    if (!measuresLight(scene.integrator.type)) return emitting;
    std::vector<bool> shines;
    for (const Emission& emission : scene.emissions) shines.push_back(emission.radiance.max() > 0);
    for (std::size_t i = 0; i < flat.triangles.size(); ++i) {
        const std::int32_t emission = flat.triangles[i].emission;
        if (emission >= 0 && shines[static_cast<std::size_t>(emission)] &&
            (i >= flat.firstShape() || areaOf(flat, i) > 0))
            emitting.push_back(static_cast<std::uint32_t>(i));
    }
    return emitting;
}

LightPart compileLights(const Scene& scene, const FlatScene& flat,
                        const std::vector<std::uint32_t>& emitting, const AcceleratorPart& accelerator,
                        SpectrumTable& spectra, const EnvironmentTexels* around,
                        const std::vector<TextureIndex>& textures) {
    LightPart part;
    part.light_of.assign(flat.triangles.size(), CRT_NONE);
    struct Shared {
        kernel::CrtValue radiance = 0;
        double brightness = 0;
    };
    std::vector<std::optional<Shared>> shared(scene.emissions.size());  // made once an emission
    std::vector<double> power;
    std::vector<std::optional<LightBounds>> bounds;
    const Tiles tiles(scene, flat, emitting);
    for (const std::uint32_t i : emitting) {
        if (part.light_of[i] != CRT_NONE) continue;  // the other half of a parallelogram
        const Emission& emission = emissionOf(scene, flat.triangles[i]);
        std::optional<Shared>& own = shared[static_cast<std::size_t>(flat.triangles[i].emission)];
        if (!own) own = {spectra.valueOf(emission.radiance), brightness(emission.radiance)};
        if (emission.texture != kNoTexture) {
            part.features |= CRT_FEATURE_EMISSION_IMAGE;
            const auto record = std::find(textures.begin(), textures.end(), emission.texture);
            kernel::CrtLight light{};
            light.kind = CRT_LIGHT_TILE;
            light.slot = accelerator.slot_of_id[i];
            light.radiance = CRT_VALUE_TEXTURE | static_cast<std::uint32_t>(record - textures.begin());
            light.flags = emission.two_sided ? CRT_LIGHT_TWO_SIDED : 0;
            if (isPassable(scene, flat.triangles[i])) light.flags |= CRT_LIGHT_UNSAMPLED;
            addTiles(flat, tiles, i, light, own->brightness, part, power, bounds);
            continue;
        }
        const bool shape = i >= flat.firstShape();
        double area = shape ? areaOf(flat.shapes[i - flat.firstShape()]) : areaOf(flat, i);
        kernel::CrtLight light{};
        if (shape) light.kind = CRT_LIGHT_SHAPE;
        light.slot = accelerator.slot_of_id[i];
        light.radiance = own->radiance;
        light.flags = emission.two_sided ? CRT_LIGHT_TWO_SIDED : 0;
        part.light_of[i] = static_cast<std::uint32_t>(part.lights.size());
        if (const auto corner = shape ? std::nullopt : parallelogramCorner(flat, i)) {
            light.kind = CRT_LIGHT_PARALLELOGRAM;
            light.corner = *corner;
            part.light_of[i + 1] = part.light_of[i];
            area += areaOf(flat, i + 1);
        }
        light.area = static_cast<float>(area);
        const bool passable = isPassable(scene, flat.triangles[i]);
        if (passable) light.flags |= CRT_LIGHT_UNSAMPLED;
        part.lights.push_back(light);
        if (passable) area *= kHardlyEver;
        power.push_back(area * own->brightness * (emission.two_sided ? 2 : 1));
        bounds.push_back(shape ? boundsOfShape(flat, i, emission.two_sided, power.back())
                               : boundsOfEmitter(cornersOfTriangles(
                                                     flat, i, light.kind == CRT_LIGHT_PARALLELOGRAM ? 2 : 1),
                                                 emission.two_sided, power.back()));
    }
    part.emitters = static_cast<std::uint32_t>(part.lights.size());
    if (samplesEnvironment(scene) && (around == nullptr || around->mean_brightness > 0)) {
        kernel::CrtLight light{};
        light.kind = CRT_LIGHT_ENVIRONMENT;
        part.lights.push_back(light);
        part.environment = static_cast<std::uint32_t>(part.lights.size());
        power.push_back(areaAround(flat) *
                        (around ? around->mean_brightness : brightness(scene.environment->radiance)));
        bounds.emplace_back();
    }
    const std::vector<const PointLight*> point_lights = shiningPointLights(scene);
    const double area_around = point_lights.empty() ? 0 : areaAround(flat);
    for (const PointLight* own : point_lights) {
        kernel::CrtLight light{};
        light.kind = kindOf(*own);
        light.radiance = spectra.valueOf(own->spectrum);
        light.slot = static_cast<std::uint32_t>(part.point_lights.size());
        part.point_lights.push_back(compilePointLight(*own, flat));
        part.point_lights.back().light = static_cast<std::uint32_t>(part.lights.size());
        part.lights.push_back(light);
        power.push_back(powerOf(*own, part.point_lights.back(), area_around, flat.scale_exponent) *
                        brightness(own->spectrum));
        bounds.push_back(boundsOfPoint(*own, part.point_lights.back(), power.back()));
    }
    part.power = std::accumulate(power.begin(), power.end(), 0.0);
    growTree(bounds, part, power);
    const std::vector<std::uint64_t> first = choiceTable(power);
    for (std::size_t i = 0; i < part.lights.size(); ++i) {
        // The lights of the tree have one share together.
        const std::size_t share = part.tree.empty()      ? i
                                  : i < part.tree_lights ? 0
                                                         : i - part.tree_lights + 1;
        if (part.tree.empty() || share > 0)
            part.lights[i].choice = static_cast<std::uint32_t>(first[share]);
        part.lights[i].choice_probability =
            static_cast<float>(std::ldexp(static_cast<double>(first[share + 1] - first[share]), -32));
    }
    return part;
}

kernel::CrtSpan appendLights(const LightPart& part, BlobWriter& blob) {
    constexpr std::size_t kRows = sizeof(kernel::CrtLightNode) / sizeof(kernel::CrtLight);
    static_assert(kRows * sizeof(kernel::CrtLight) == sizeof(kernel::CrtLightNode));
    std::vector<kernel::CrtLight> rows = part.lights;
    rows.resize(part.lights.size() + kRows * part.tree.size());
    if (!part.tree.empty())
        std::memcpy(static_cast<void*>(rows.data() + part.lights.size()), part.tree.data(),
                    part.tree.size() * sizeof part.tree[0]);
    kernel::CrtSpan span = blob.append(rows);
    span.count = static_cast<std::uint32_t>(part.lights.size());
    return span;
}

bool shadowRaysLeave(const Scene& scene) {
    return samplesEnvironment(scene) || !shiningPointLights(scene).empty();
}

bool samplesEnvironment(const Scene& scene) {
    const Spectrum* radiance = spectrumOfEnvironment(scene);
    return radiance != nullptr && scene.environment->light_sampling && radiance->max() > 0;
}

const Spectrum* spectrumOfEnvironment(const Scene& scene) {
    const bool shown = scene.environment && measuresLight(scene.integrator.type);
    return shown ? &scene.environment->radiance : nullptr;
}

}  // namespace crt
