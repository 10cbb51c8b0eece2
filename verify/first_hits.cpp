// Group J, the part about the outputs of first hits: normal, albedo and depth; and the places of the
// attributes of placed meshes and of shapes, which these outputs show.
#include "base/temporary_folder.h"
#include "verify/context.h"
#include "verify/references.h"
#include "verify/scenes.h"
#include "verify/shapes.h"

#include "kernel/dialect/features.h"
#include "scene/aov.h"

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace crt::verify {
namespace {

constexpr std::uint32_t kNormalAndDepth = kAovNormal | kAovDepth;

double channel(const Film& film, std::uint32_t aov, std::uint32_t component = 0) {
    return film.mean(0, 0, firstChannel(film.shape().aovs, aov) + component);
}
Vec3d normalOf(const Film& film) {
    return {channel(film, kAovNormal, 0), channel(film, kAovNormal, 1), channel(film, kAovNormal, 2)};
}
/// X + Y + Z of the albedo: of grey, in proportion to it at the same wavelengths.
double albedoOf(const Film& film) {
    return channel(film, kAovAlbedo, 0) + channel(film, kAovAlbedo, 1) + channel(film, kAovAlbedo, 2);
}

/// The worst of three components.
void sameDirection(Context& context, const std::string& what, const Vec3d& measured, const Vec3d& expected,
                   double tolerance, const std::vector<std::pair<Vec3d, std::string>>& mistakes = {}) {
    std::size_t worst = 0;
    for (std::size_t k = 1; k < 3; ++k)
        if (!(std::abs(measured[k] - expected[k]) <= std::abs(measured[worst] - expected[worst]))) worst = k;
    std::vector<Mistake> of_worst;
    for (const auto& [value, physics] : mistakes) of_worst.push_back({value[worst], physics});
    context.absolute(fmt::format("{}: {} of the normal", what, "xyz"[worst]), measured[worst],
                     expected[worst], tolerance, of_worst);
}

void normalsOfHits(Context& context) {
    // Normals of the corners on the left and on the right of a floor: between them the interpolated one.
    const Vec3d left = unit({-0.4, 1, 0.2}), right = unit({0.6, 1, -0.1});
    for (const double x : {-1.5, 0.25, 1.0}) {
        const double share = (x + 2) / 4;
        const std::string scene =
            Stage(fmt::format("{{position: [{0}, 3, 1], target: [{0}, 0, 0.3], fov: 0.0001}}", x),
                  "{max_depth: 1}")
                .material("it", "{type: diffuse, reflectance: 0.5}")
                .mesh("floor",
                      fmt::format("[[-2,0,-2],[-2,0,2],[2,0,2],[2,0,-2]], normals: [{0}, {0}, {1}, {1}]",
                                  point(left), point(right)),
                      "[[0,1,2,3]]", "it")
                .yaml();
        sameDirection(context, fmt::format("a floor with normals of its corners, at x = {}", x),
                      normalOf(context.render(context.scene(scene), samples(16, kNormalAndDepth))),
                      unit(left * (1 - share) + right * share), 1e-5,
                      {{{0, 1, 0}, "the output is the geometric normal, not that of shading"}});
    }
}

void albedosOfHits(Context& context) {
    const auto of = [&](const std::string& material) {
        return albedoOf(
            context.render(context.scene(Stage(eyeAt({0.6, 0.8, 0}, "[0, 0, 1]"), "{max_depth: 0}")
                                             .material("it", material)
                                             .quad("it", "[[-2,0,-2],[-2,0,2],[2,0,2],[2,0,-2]]", "it")
                                             .yaml()),
                           samples(16, kAovAlbedo)));
    };
    const double white = of("{type: diffuse, reflectance: 1}");
    const double metal = fresnelConductor(1, 0.2, 3);
    for (const auto& [material, expected] :
         {std::pair<const char*, double>{"type: diffuse, reflectance: 0.37", 0.37},
          {"type: mirror, reflectance: 0.6", 0.6},
          {"type: conductor, eta: 0.2, k: 3", metal},
          {"type: rough_conductor, eta: 0.2, k: 3, roughness: 0.3", metal},
          {"type: conductor, eta: 1.5, k: 0.8", fresnelConductor(1, 1.5, 0.8)},
          {"type: dielectric, ior: 1.5", 1}})
        context.relative(fmt::format("albedo of {{{}}}", material),
                         of(fmt::format("{{{}}}", material)) / white, expected, 1e-5);
}

void depthsOfHits(Context& context) {
    // Along the ray, in units of the scene, whatever its size.
    for (const double size : {1.0, 1e-6, 3e-3, 700.0, 1e7}) {
        const auto floor = [size](const std::string& camera, const std::string& film) {
            return Stage(camera, "{max_depth: 0}")
                .set("film", film)
                .material("it", "{type: diffuse, reflectance: 0.5}")
                .quad("floor",
                      fmt::format("[[-{0},0,-{0}],[-{0},0,{0}],[{0},0,{0}],[{0},0,-{0}]]", 4 * size), "it")
                .yaml();
        };
        const auto depth = [&](const std::string& scene) {
            return channel(context.render(context.scene(scene), samples(64, kNormalAndDepth)), kAovDepth);
        };
        context.relative(fmt::format("depth of a floor of {:g}, straight ahead", 8 * size),
                         depth(floor(fmt::format("{{position: [0, {}, {}], target: [0, 0, 0], fov: 0.0001}}",
                                                 2 * size, 1.5 * size),
                                     "{resolution: [1, 1]}")),
                         2.5 * size, 1e-5);
        // The mean over a pixel at the edge of a wide film.
        const double mean = rectangleIntegral(
            [](double x, double y) { return std::sqrt(1 + x * x + y * y); }, 1 - 2.0 / 64, 1, 0, 2.0 / 64);
        context.relative(
            fmt::format("depth of a floor of {:g}, at the edge of a film of 90°", 8 * size),
            depth(floor(
                fmt::format("{{position: [0, {}, 0], target: [0, 0, 0], up: [0, 0, 1], fov: 90}}", 2 * size),
                "{resolution: [64, 64], crop: [0, 31, 1, 32]}")),
            2 * size * mean * (64.0 / 2) * (64.0 / 2), 1e-3,
            {{2 * size, "depth is taken along the view axis"}});
    }
}

void firstHits(Context& context) {
    normalsOfHits(context);
    albedosOfHits(context);
    depthsOfHits(context);
}

/// An image of 4 × 4 greys, no two the same, as it is asked for at (u, v), v up.
constexpr int kGreys = 4;
double greyAt(double u, double v) {
    return (1 + std::floor(kGreys * u) + kGreys * std::floor(kGreys * v)) / (kGreys * kGreys + 1);
}
void writeGreys(const std::string& path) {
    std::vector<float> rgb;
    for (int row = 0; row < kGreys; ++row)
        for (int column = 0; column < kGreys; ++column)
            for (int c = 0; c < 3; ++c)
                rgb.push_back(
                    static_cast<float>(greyAt((column + 0.5) / kGreys, (kGreys - row - 0.5) / kGreys)));
    writeRgb(path, OutputFormat::Pfm, kGreys, kGreys, rgb);
}

/// An object, seen along its normal at `there`: the normal and the grey that it shows.
struct Shown {
    Vec3d normal;
    double grey;
};
class Shows {
public:
    explicit Shows(Context& context) : context_(context), path_(folder_.path() + "/greys.pfm") {
        writeGreys(path_);
        white_ = albedoOf(render({0, 0, 0}, {0, 1, 0},
                                 "mesh: {positions: [[-1,0,-1],[-1,0,1],[1,0,1],[1,0,-1]], faces: "
                                 "[[0,1,2,3]]}",
                                 "1"));
    }
    Shown operator()(const Vec3d& there, const Vec3d& normal, const std::string& object) {
        const Film film =
            render(there, normal, object, fmt::format("{{texture: '{}', filter: nearest}}", path_));
        return {normalOf(film), albedoOf(film) / white_};
    }

private:
    Film render(const Vec3d& there, const Vec3d& normal, const std::string& object,
                const std::string& reflectance) {
        return context_.render(
            context_.scene(
                Stage(fmt::format("{{position: {}, target: {}, up: [0.3, 0.2, 1], fov: 0.0001}}",
                                  point(there + normal), point(there)),
                      "{max_depth: 0}")
                    .material("it", fmt::format("{{type: diffuse, reflectance: {}}}", reflectance))
                    .object(object + ", material: it")
                    .yaml()),
            samples(16, kAovNormal | kAovAlbedo));
    }

    Context& context_;
    TemporaryFolder folder_;
    std::string path_;
    double white_ = 0;
};

void placedAttributes(Context& context) {
    // Of a place M points go with M, normals with its inverse transpose, and texture coordinates stay. The
    // mesh is a square with (u, v) = ((x + 1)/2, (z + 1)/2).
    const Vec3d normal = unit({0.5, 1, -0.3});
    Shows shows(context);
    for (const auto& [name, x_row, y_row, z_row, shift] :
         {std::tuple<const char*, Vec3d, Vec3d, Vec3d, Vec3d>{
              "as it is", {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}},
          {"stretched", {3, 0, 0}, {0, 0.5, 0}, {0, 0, 1}, {0.5, 0, -0.25}},
          {"turned and stretched", {0.6, -1.6, 0}, {0.8, 1.2, 0}, {0, 0, 0.7}, {0, 0.5, 0}},
          {"mirrored and sheared", {-1, 0.5, 0}, {0, 2, 0.25}, {0.5, 0, 1}, {0, 0, 0}}}) {
        const Vec3d &a = x_row, &b = y_row, &c = z_row;
        // The cofactors are the inverse transpose but for the determinant, whose sign is the side's.
        const double side = dot(a, cross(b, c)) < 0 ? -1 : 1;
        const auto placed = [&](const Vec3d& n) {
            return unit({dot(cross(b, c), n), dot(cross(c, a), n), dot(cross(a, b), n)}) * side;
        };
        const auto turned = [&](const Vec3d& p) { return Vec3d{dot(a, p), dot(b, p), dot(c, p)}; };
        const Vec3d up = placed({0, 1, 0});
        for (const char* share : {"always", "never"})
            for (const auto& [x, z] : {std::pair{-0.375, 0.125}, std::pair{0.625, -0.875}}) {
                const double u = (x + 1) / 2, v = (z + 1) / 2;
                const Shown shown = shows(
                    turned({x, 0, z}) + shift, up,
                    fmt::format(
                        "mesh: {{positions: [[-1,0,-1],[-1,0,1],[1,0,1],[1,0,-1]], faces: [[0,1,2,3]], "
                        "normals: [{0},{0},{0},{0}], uvs: [[0,0],[0,1],[1,1],[1,0]]}}, share: {1}, "
                        "transform: [{{matrix: [{2:.17g}, {3:.17g}, {4:.17g}, {5}, {6:.17g}, {7:.17g}, "
                        "{8:.17g}, {9}, {10:.17g}, {11:.17g}, {12:.17g}, {13}, 0, 0, 0, 1]}}]",
                        point(normal), share, a[0], a[1], a[2], shift[0], b[0], b[1], b[2], shift[1], c[0],
                        c[1], c[2], shift[2]));
                const std::string what = fmt::format("{}, share: {}, ({}, {})", name, share, u, v);
                sameDirection(context, what, shown.normal, placed(normal), 2e-5,
                              {{unit(turned(normal)), "the normal goes as directions do"},
                               {up, "the normal is the geometric one"}});
                context.absolute(what + ": the texel", shown.grey, greyAt(u, v), 1e-4,
                                 {{greyAt(1 - u, v), "u is mirrored"},
                                  {greyAt(u, 1 - v), "v is mirrored"},
                                  {greyAt(v, u), "u and v are exchanged"}});
            }
    }
}

void shapeCoordinates(Context& context) {
    // A shape turned by 90° about x, and moved: its axes x, y, z become x, z, −y.
    const auto turned = [](const Vec3d& q) { return Vec3d{q[0], -q[2], q[1]}; };
    const Vec3d centre{0.25, -0.5, 1};
    const std::string transform =
        ", transform: [{rotate: {axis: [1, 0, 0], angle_deg: 90}}, {translate: [0.25, -0.5, 1]}]";
    Shows shows(context);
    const auto ask = [&](const std::string& what, const std::string& shape, const Vec3d& q,
                         const Vec3d& normal, double u, double v) {
        const Shown shown = shows(turned(q) + centre, turned(normal), shape + transform);
        sameDirection(context, what, shown.normal, turned(normal), 2e-5);
        context.absolute(what + ": the texel", shown.grey, greyAt(u, v), 1e-4,
                         {{greyAt(1 - u, v), "u is mirrored"},
                          {greyAt(u, 1 - v), "v is mirrored"},
                          {greyAt(u < 0.5 ? u + 0.5 : u - 0.5, v), "u begins on the other side"}});
    };
    for (const double u : {0.07, 0.37, 0.6, 0.9}) {
        const Vec3d around{std::cos(2 * kPi * u), std::sin(2 * kPi * u), 0};
        for (const double v : {0.2, 0.7}) {
            const double latitude = kPi * (v - 0.5);
            const Vec3d n = around * std::cos(latitude) + Vec3d{0, 0, std::sin(latitude)};
            ask(fmt::format("a sphere, ({}, {})", u, v), "sphere: {radius: 0.5}", n * 0.5, n, u, v);
        }
        ask(fmt::format("a cylinder, ({}, 0.3)", u), "cylinder: {radius: 0.5, from_z: -1, to_z: 0.5}",
            around * 0.5 + Vec3d{0, 0, -1 + 0.3 * 1.5}, around, u, 0.3);
        // The square around a disk.
        const Vec3d q = around * 0.35;
        ask(fmt::format("a disk, at {:.0f}°", 360 * u), "disk: {radius: 0.5}", q, {0, 0, 1}, q[0] + 0.5,
            q[1] + 0.5);
    }
}

}  // namespace

std::vector<Case> firstHitCases() {
    constexpr std::uint64_t hit = CRT_FEATURE_AOV | CRT_FEATURE_DIFFUSE;
    return {
        row("J11", "first-hit-planes",
            "Normal, albedo and depth of first hits: floors with normals at their corners; smooth and rough "
            "metals, mirrors, paint, glass; floors of 8e-6 to 8e7",
            "the interpolated normal; what is reflected straight on; the way along the ray",
            "geometry; Fresnel's equations in complex double", "1e-5; 1e-5; 1e-5, 1e-3 over a pixel",
            Level::Commit,
            hit | CRT_FEATURE_SMOOTH_NORMALS | CRT_FEATURE_CONDUCTOR | CRT_FEATURE_ROUGH_CONDUCTOR |
                CRT_FEATURE_MIRROR | CRT_FEATURE_DIELECTRIC,
            firstHits),
        row("D13", "placed-attributes",
            "Normals and texture coordinates of a square that is stretched, turned, mirrored and sheared, "
            "its mesh shared and not",
            "M⁻ᵀ n; (u, v) stay", "linear algebra", "2e-5; 1e-4", Level::Commit,
            hit | CRT_FEATURE_SMOOTH_NORMALS | CRT_FEATURE_TEXTURE | CRT_FEATURE_INSTANCES,
            placedAttributes),
        row("D14", "shape-coordinates",
            "Normals and texture coordinates of spheres, cylinders and disks that are turned and moved",
            "u goes once around the axis z from x towards y, v from below; a disk's square", "docs/scene.md",
            "2e-5; 1e-4", Level::Commit, hit | CRT_FEATURE_TEXTURE | CRT_FEATURE_SHAPES, shapeCoordinates),
    };
}

}  // namespace crt::verify
