// Group D, the part about meshes that are stored once and placed many times.
#include "verify/context.h"
#include "verify/probes.h"
#include "verify/references.h"
#include "verify/scenes.h"
#include "verify/shapes.h"

#include "kernel/dialect/features.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace crt::verify {
namespace {

/// Scaled along its own axes, turned so that these are x, y and z, and moved.
Matrix4d pose(const Vec3d& scale, const Vec3d& x, const Vec3d& y, const Vec3d& z, const Vec3d& centre) {
    Matrix4d m = kIdentity4d;
    for (std::size_t r = 0; r < 3; ++r) {
        m[4 * r] = scale[0] * x[r];
        m[4 * r + 1] = scale[1] * y[r];
        m[4 * r + 2] = scale[2] * z[r];
        m[4 * r + 3] = centre[r];
    }
    return m;
}
Matrix4d turned(const Vec3d& scale, const Vec3d& axis, const Vec3d& centre) {
    const Vec3d z = unit(axis), x = unit(cross(z, std::abs(z[0]) < 0.5 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0}));
    return pose(scale, x, cross(z, x), z, centre);
}

Object& addPlaced(Scene& scene, Mesh mesh, Material material, std::vector<Matrix4d> transforms) {
    Object& object = scene.objects[addObject(scene, std::move(mesh), std::move(material))];
    object.sharing = Sharing::Always;
    object.transforms = std::move(transforms);
    return object;
}

void closedInstances(Context& context) {
    struct Room {
        const char* name;
        Vec3d scale, centre;
        double far;
    };
    for (const Room& room : {Room{"as it is", {1, 1, 1}, {0, 0, 0}, 0},
                             {"mirrored", {-1, 1, 1}, {0, 0, 0}, 0},
                             {"a needle", {100, 1, 1}, {0, 0, 0}, 0},
                             {"a mirrored plate", {-3, 3, 0.01}, {0.3, 0.2, -0.1}, 0},
                             {"tiny in its scene", {1e-3, 1e-3, 1e-3}, {0.3, 0.2, -0.1}, 1},
                             {"far away", {1, 1, 1}, {148376, 1234, -223423}, 0}}) {
        const int resolution = context.atLeast(Level::Merge) ? 96 : 32;
        Scene scene = emptyScene(resolution, 5, room.centre,
                                 room.centre + Vec3d{0, 0, 1e-3 * std::abs(room.scale[2])}, 1);
        scene.integrator.max_depth = 40;
        scene.environment = Environment{constantSpectrum(1000)};
        addPlaced(scene, icosphere(2, 1, {0, 0, 0}), diffuse(1),
                  {turned(room.scale, {1, 2, 3}, room.centre)});
        if (room.far > 0) addAnchors(scene, {0, 0, 0}, room.far);
        const Film film = context.render(scene, samples(16));
        Tally tally;
        for (std::uint32_t y = 0; y < film.shape().height; ++y)
            for (std::uint32_t x = 0; x < film.shape().width; ++x) {
                tally.rays += 16 * 41;
                tally.failures += radiance(film, x, y) > 0;
            }
        rareFailures(context, fmt::format("paths in a closed instance, {}, of 40 bounces", room.name), tally,
                     1e-6, "a ray starts behind the wall that it leaves, or slips between two triangles");
    }
}

/// Absorbing cubes of index 1 in a row, in light of radiance 1: what is left knows how thick each is, and
/// which side of its surface is inside.
void absorbingInstances(Context& context) {
    constexpr double kSigma = 0.7;
    const Vec3d x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
    struct Row {
        const char* name;
        std::vector<Matrix4d> cubes;
        double thickness;
    };
    for (const Row& row :
         {Row{"a cube", {pose({1, 1, 1}, x, y, z, {0, 0, 0})}, 1},
          {"mirrored", {pose({-1, 1, 1}, x, y, z, {0, 0, 0})}, 1},
          {"mirrored along the ray, twice as thick", {pose({1, 1, -2}, x, y, z, {0, 0, 0})}, 2},
          {"a plate on its edge", {pose({0.01, 3, 1.5}, z, x, y, {0, 0, 0})}, 0.01},
          {"three of one mesh",
           {pose({1, 1, 0.5}, x, y, z, {0, 0, -2}), pose({-3, 1, 1}, z, x, y, {0, 0, 0.5}),
            pose({1, 0.25, -1}, y, z, x, {0, 0, 4})},
           0.5 + 3 + 0.25}}) {
        Scene scene = emptyScene(16, 3, {0.03, 0.02, -10}, {0.03, 0.02, 0}, 1e-4);
        scene.integrator.max_depth = 16;
        scene.environment = Environment{constantSpectrum(1)};
        const double empty = meanRadiance(context.render(scene, samples(4)));
        Material it = glass(1);
        it.absorption = constantSpectrum(kSigma);
        addPlaced(scene, boxMesh({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}), it, row.cubes);
        context.relative(fmt::format("light behind {}", row.name),
                         meanRadiance(context.render(scene, samples(4))) / empty,
                         std::exp(-kSigma * row.thickness), 1e-5,
                         {{1, "nothing is absorbed: is the inside outside where a place mirrors?"},
                          {std::exp(-kSigma), "each cube as thick as the mesh: are scales lost?"}});
    }
}

/// First hits of instances against those of the same triangles written out. Where a ray meets an edge within
/// rounding it may pass on one side of it, and hit on the other.
void againstFlattened(Context& context) {
    constexpr std::uint32_t kFirstHit = kAovNormal | kAovDepth;
    for (const double distance : {0.05, 3.0, 100.0}) {
        Dice dice(7);
        Scene scene = emptyScene(context.atLeast(Level::Merge) ? 512 : 128, 3,
                                 Vec3d{0.1, 0.2, -1} * distance, {0, 0, 0}, distance > 1 ? 1 / distance : 1);
        scene.integrator.max_depth = 0;
        std::vector<Matrix4d> transforms;
        for (int i = 0; i < 40; ++i) {
            const double size = std::pow(10.0, dice.uniform(-2.5, -0.7));
            transforms.push_back(turned(Vec3d{i % 3 == 0 ? -size : size, size * dice.uniform(0.2, 2), size},
                                        dice.direction(), dice.inBox(0.8)));
        }
        addPlaced(scene, icosphere(2, 1, {0, 0, 0}), diffuse(0.5), transforms);
        const Film shared = context.render(scene, samples(1, kFirstHit));
        scene.objects.back().sharing = Sharing::Never;
        const Film flat = context.render(scene, samples(1, kFirstHit));
        const std::size_t depth = firstChannel(flat.shape().aovs, kAovDepth),
                          normal = firstChannel(flat.shape().aovs, kAovNormal);
        Tally tally;
        for (std::uint32_t y = 0; y < flat.shape().height; ++y)
            for (std::uint32_t x = 0; x < flat.shape().width; ++x) {
                ++tally.rays;
                const double at = flat.mean(x, y, depth), other = shared.mean(x, y, depth);
                bool same = at == other || std::abs(at - other) <= 1e-5 * (1 + distance);
                for (std::size_t k = 0; k < 3; ++k)
                    same = same &&
                           std::abs(flat.mean(x, y, normal + k) - shared.mean(x, y, normal + k)) <= 1e-3;
                tally.failures += !same;
            }
        rareFailures(context,
                     fmt::format("40 places, first hits from {:g} away against triangles", distance), tally,
                     1e-3, "corners or normals are not where the transform takes them");
    }
}

/// A square that is the only mesh of its scene, placed twice, with an attribute of its corners.
struct Attribute {
    const char *name, *material, *corners, *surroundings;
    double expected, lost;  ///< Seen at (u, v) = (0.6, 0.3); and without the attribute.
};

void sharedAttributes(Context& context) {
    constexpr const char* sky = "environment: {radiance: 1}";
    constexpr const char* sun = "lights: [{type: directional, direction: [0, -1, 0], irradiance: 1}]";
    constexpr const char* uvs = "uvs: [[0,0],[0,1],[1,1],[1,0]]";
    constexpr const char* tilted = "normals: [[.6,.8,0],[.6,.8,0],[.6,.8,0],[.6,.8,0]]";
    const auto seen = [&](const Attribute& it, const char* share) {
        return radiance(context.render(
            fmt::format(
                "crt: 1\ncamera: {{position: [0.2, 1, -0.4], target: [0.2, 0, -0.4], up: [0, 0, 1], "
                "fov: 0.0005}}\nfilm: {{resolution: [4, 4]}}\nintegrator: {}\n{}\nmaterials: {{it: "
                "{}}}\nobjects:\n  - {{mesh: {{positions: [[-1,0,-1],[-1,0,1],[1,0,1],[1,0,-1]], {}, "
                "faces: [[0,1,2,3]]}}, material: it, share: {}, transforms: [[], [{{translate: [50, "
                "0, 0]}}]]}}\n",
                kDirect, it.surroundings, it.material, it.corners, share),
            samples(64)));
    };
    const double white = seen({"", "{type: diffuse, reflectance: 1}", uvs, sky, 1, 1}, "never");
    for (const Attribute& it :
         {Attribute{"texture coordinates", "{type: diffuse, reflectance: {checker: [0.9, 0.2], scale: 4}}",
                    uvs, sky, 0.2, 0.9},
          {"opacity by texture coordinates",
           "{type: diffuse, reflectance: 0, opacity: {checker: [1, 0], scale: 4}}", uvs, sky, 1, 0},
          {"colours of vertices", "{type: diffuse, reflectance: {attribute: colors}}",
           "color_space: linear, colors: [[.2,.2,.2],[.2,.2,.2],[.7,.7,.7],[.7,.7,.7]]", sky, 0.5, 0},
          // Of cosine .8 with the light; what goes below the face is raised (decision 0029).
          {"normals of vertices", "{type: diffuse, reflectance: 1}", tilted, sun, 0.9 / kPi, 1 / kPi}})
        for (const char* share : {"always", "never"})
            context.absolute(fmt::format("{}, share: {}", it.name, share), seen(it, share) / white,
                             it.expected, 1e-4, {{it.lost, "the attribute is lost where all is shared"}});
    // The tangent, by which half of the sky lights brushed metal: none of it is as without coordinates.
    const Attribute brushed{"",
                            "{type: rough_conductor, metal: Al, roughness: 0.5, roughness_anisotropy: 0.9}",
                            "uvs: [[0,0],[1,1],[2,0],[1,-1]]",
                            "lights: [{type: directional, direction: [-0.5, -1, 0], irradiance: 1}]",
                            1,
                            0};
    context.relative("tangents, shared over written out", seen(brushed, "always") / seen(brushed, "never"),
                     1, 1e-4);
}

void instances(Context& context) {
    closedInstances(context);
    absorbingInstances(context);
    sharedAttributes(context);
    againstFlattened(context);
}

}  // namespace

std::vector<Case> instanceCases() {
    return {
        row("D12", "instances",
            "Paths in closed meshes that are placed, not copied: mirrored, stretched, tiny, far away; light "
            "through absorbing ones in a row; attributes of a scene all of whose triangles are shared; "
            "first "
            "hits and those of the same triangles written out",
            "none gets out; exp(−σ Σd); the value at the place; the same but for edges",
            "topology; Beer and Lambert", "rate ≤ 1e-6; 1e-5; 1e-5 of the scene, but for one ray in 1,000",
            Level::Commit,
            CRT_FEATURE_INSTANCES | CRT_FEATURE_BVH | CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_DIELECTRIC |
                CRT_FEATURE_MEDIA | CRT_FEATURE_AOV | CRT_FEATURE_TEXTURE | CRT_FEATURE_OPACITY |
                CRT_FEATURE_SMOOTH_NORMALS | CRT_FEATURE_ANISOTROPY | CRT_FEATURE_ROUGH_CONDUCTOR |
                CRT_FEATURE_POINT_LIGHT,
            instances),
    };
}

}  // namespace crt::verify
