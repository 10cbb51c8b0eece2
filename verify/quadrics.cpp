// Groups D and G, the part about spheres, disks and cylinders: lenses, closed rooms of them, what trees
// find.
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

// ---- Lenses ---------------------------------------------------------------------------------------------

/// A surface of a lens about the axis z, met from −z: a sphere's part, with glass behind it or before it.
struct Refracting {
    double centre, radius;
    bool bulges;  ///< Towards −z.
    bool enters;  ///< Into glass.
};

/// Where a ray in a plane of the axis ends: slope angle, and the share of light that is refracted all the
/// way. By exact intersections and Snell's law, in double.
struct Traced {
    double angle, passed;
};

Traced through(const std::vector<Refracting>& lens, double n, double from_z, double angle) {
    double z = from_z, y = 0, passed = 1;
    for (const Refracting& surface : lens) {
        const double dz = std::cos(angle), dy = std::sin(angle);
        const double oz = z - surface.centre;
        const double b = oz * dz + y * dy, c = oz * oz + y * y - surface.radius * surface.radius;
        const double root = std::sqrt(b * b - c);
        const double t = surface.bulges ? -b - root : -b + root;
        z += t * dz;
        y += t * dy;
        // The normal against the ray; angles from it to the ray.
        const double side = surface.bulges ? 1 : -1;
        const double normal = std::atan2(side * y, -side * (z - surface.centre));
        const double incidence = angle + normal;
        const double eta = surface.enters ? n : 1 / n;
        passed *= 1 - fresnelDielectric(std::cos(incidence), eta);
        angle = std::asin(std::sin(incidence) / eta) - normal;
    }
    return {angle, passed};
}

std::vector<Refracting> ballLens() { return {{0, 1, true, true}, {0, 1, false, false}}; }

/// Radii of curvature 4, 0.3 thick, of radius 1.
constexpr double kCurvature = 4, kThickness = 0.3;
std::vector<Refracting> biconvexLens() {
    return {{kCurvature - kThickness / 2, kCurvature, true, true},
            {kThickness / 2 - kCurvature, kCurvature, false, false}};
}
const std::string& biconvexObjects() {
    static const double rim = std::sqrt(kCurvature * kCurvature - 1);
    static const double edge = kThickness / 2 - (kCurvature - rim);
    static const std::string objects = fmt::format(
        "[{{material: it, sphere: {{radius: {0}, to_z: -{1}}}, transform: [{{translate: [0, 0, {2}]}}]}},"
        " {{material: it, sphere: {{radius: {0}, from_z: {1}}}, transform: [{{translate: [0, 0, -{2}]}}]}},"
        " {{material: it, cylinder: {{radius: 1, from_z: -{3}, to_z: {3}}}}}]",
        kCurvature, rim, kCurvature - kThickness / 2, edge);
    return objects;
}
const std::string kBall = "[{material: it, sphere: {radius: 1}}]";

/// Seen from the axis, at −z, a sun on the axis behind the lens fills a disk whose size gives the focal
/// length: a ray at the angle u leaves at u (1 − s/f), s from the lens.
struct Sighting {
    double distance;    ///< Of the camera.
    double sun;         ///< Angle from its middle to its edge.
    double half_frame;  ///< Tangent.
};

/// Mean radiance of the frame where the sun has radiance 1.
double seen(const std::vector<Refracting>& lens, double n, const Sighting& at) {
    // The lit part is a disk: the angle only grows with the ray's.
    double inside = 0, outside = std::atan(at.half_frame);
    for (int i = 0; i < 60; ++i) {
        const double middle = (inside + outside) / 2;
        (std::abs(through(lens, n, -at.distance, middle).angle) < at.sun ? inside : outside) = middle;
    }
    const double edge = std::tan(inside);
    double sum = 0;
    constexpr int kSteps = 400;
    for (int i = 0; i < kSteps; ++i) {
        const double x = edge * (i + 0.5) / kSteps;
        sum += through(lens, n, -at.distance, std::atan(x)).passed * x;
    }
    return sum * edge / kSteps * 2 * kPi / (4 * at.half_frame * at.half_frame);
}

std::string lensScene(const std::string& objects, const std::string& index, const Sighting& at,
                      const std::string& film) {
    return fmt::format(
        "crt: 1\ncamera: {{position: [0, 0, -{}], target: [0, 0, 0], fov: {}}}\n"
        "film: {{resolution: [32, 32]{}}}\nintegrator: {{max_depth: 2, roulette: false}}\n"
        "materials: {{it: {{type: dielectric, ior: {}}}}}\nobjects: {}\n"
        "lights: [{{type: sun, direction: [0, 0, -1], angular_diameter_deg: {}, radiance: 1}}]\n",
        at.distance, 2 * std::atan(at.half_frame) / kDegree, film, index, objects, 2 * at.sun / kDegree);
}

/// A frame half as wide again as what is lit.
Sighting sighting(double distance, double focal_length, double sun) {
    return {distance, sun, 1.5 * std::abs(sun / (1 - distance / focal_length))};
}

double ballFocalLength(double n) { return n / (2 * (n - 1)); }
double biconvexFocalLength(double n) {
    return 1 / ((n - 1) * (2 / kCurvature - (n - 1) * kThickness / (n * kCurvature * kCurvature)));
}

void lenses(Context& context) {
    const Effort effort{.samples = 64, .most = 4096};
    struct Lens {
        const char* name;
        const std::string& objects;
        std::vector<Refracting> surfaces;
        double (*focalLength)(double);
    };
    for (const Lens& lens :
         {Lens{"a ball", kBall, ballLens(), ballFocalLength},
          {"two caps and a rim", biconvexObjects(), biconvexLens(), biconvexFocalLength}}) {
        for (const double n : {1.5, 1.8}) {
            if (n > 1.5 && !context.atLeast(Level::Merge)) continue;
            const double f = lens.focalLength(n);
            for (const double distance : {2 * f, 1.25 * f}) {
                const Sighting at = sighting(distance, f, 0.002);
                const double expected = seen(lens.surfaces, n, at);
                const auto wrong = [&](double other) {
                    return expected * std::pow((1 - distance / f) / (1 - distance / other), 2);
                };
                context.estimate(
                    fmt::format("{}, index {}, f = {:.4f}, from {:.2f}", lens.name, n, f, distance),
                    lensScene(lens.objects, fmt::format("{}", n), at, ""), meanRadiance, expected, 3e-3,
                    effort,
                    {{wrong(f * 1.02), "the focal length is too long"},
                     {wrong(f * 0.98), "the focal length is too short"}});
            }
        }
        if (lens.focalLength != ballFocalLength && !context.atLeast(Level::Merge)) continue;
        // Colours: the nearer the camera to the focus, the larger the sun, and that depends on f (λ).
        constexpr double kFrom = 400, kTo = 700;
        constexpr std::uint32_t kBins = 6;
        const Spectrum index = *glassIndex("SF10");
        const auto at_nm = [&](double nm) {
            const double position = nm - kWavelengthMin_nm;
            const auto i = static_cast<std::size_t>(position);
            return index[i] + (position - static_cast<double>(i)) * (index[i + 1] - index[i]);
        };
        const double f = lens.focalLength(at_nm(550));
        Sighting at = sighting(1.3 * f, f, 0.002);
        at.half_frame *= 1.2;
        std::vector<Quantity> quantities;
        for (std::uint32_t bin = 0; bin < kBins; ++bin) {
            const double width = (kTo - kFrom) / kBins, lower = kFrom + bin * width;
            double mean = 0;
            for (int i = 0; i < 25; ++i)
                mean += seen(lens.surfaces, at_nm(lower + width * (i + 0.5) / 25), at) / 25;
            quantities.push_back({fmt::format("{} of SF10, f = {:.4f} at {:.0f} nm", lens.name,
                                              lens.focalLength(at_nm(lower + width / 2)), lower + width / 2),
                                  [bin](const std::vector<Film>& films) { return meanOfBin(films[0], bin); },
                                  mean});
        }
        context.estimate(
            quantities,
            {lensScene(lens.objects, "{glass: SF10}", at,
                       fmt::format(", spectral: {{from_nm: {}, to_nm: {}, bins: {}}}", kFrom, kTo, kBins))},
            0.01, {.samples = 256, .most = 16384});
    }
}

// ---- Furnaces -------------------------------------------------------------------------------------------

const std::string kCan =
    "[{material: it, cylinder: {radius: 0.6, from_z: -0.5, to_z: 0.5}},"
    " {material: it, disk: {radius: 0.6}, transform: [{translate: [0, 0, 0.5]}]},"
    " {material: it, disk: {radius: 0.6}, transform: [{rotate: {axis: [1, 0, 0], angle_deg: 180}},"
    " {translate: [0, 0, -0.5]}]}]";

/// In light of radiance 1 from everywhere what loses none of it cannot be seen.
void furnaces(Context& context) {
    for (const auto& [shape, objects] : {std::pair<const char*, const std::string&>{"ball", kBall},
                                         {"lens", biconvexObjects()},
                                         {"can", kCan}})
        for (const auto& [name, material] :
             {std::pair{"white", "{type: diffuse, reflectance: 1}"},
              {"glass", "{type: dielectric, ior: 1.5}"},
              {"frosted glass", "{type: rough_dielectric, ior: 1.5, roughness: 0.5}"},
              {"mirror", "{type: mirror, reflectance: 1}"}}) {
            const std::string yaml = fmt::format(
                "crt: 1\ncamera: {{position: [1.5, 2, -2.5], target: [0, 0, 0], fov: 40}}\n"
                "film: {{resolution: [24, 24]}}\nintegrator: {{max_depth: 256, roulette: false}}\n"
                "materials: {{it: {}}}\nobjects: {}\nenvironment: {{radiance: 1, light_sampling: true}}\n",
                material, objects);
            context.estimate(fmt::format("a {} of {}", shape, name), yaml, meanRadiance, 1, 2e-3,
                             {.samples = 32, .most = 2048});
        }

    // An integrating sphere: a black lamp of area A on both sides, small, in its middle. The wall lights
    // itself equally everywhere, by ρΦ/4πR² over the loss at each round, except for the light that the
    // lamp hides and absorbs: on average A/2πR².
    constexpr double kSide = 0.1, kReflectance = 0.8, kRadiance = 100;
    constexpr double kArea = kSide * kSide, kFlux = 2 * kPi * kArea * kRadiance, kWall = 4 * kPi;
    const double taken = 2 * kArea / kWall;
    const double indirect = kReflectance * kFlux / kWall / (1 - kReflectance * (1 - taken));
    for (const auto& [name, towards, cosine] :
         {std::tuple{"before the lamp", "[0, 1, 0]", 1.0},
          {"beside it", "[0.70710678, 0.70710678, 0]", std::sqrt(0.5)}}) {
        const double direct = kRadiance * kArea * cosine;
        context.estimate(
            fmt::format("the wall of an integrating sphere, {}", name),
            fmt::format(
                "crt: 1\ncamera: {{position: [0, 0, -0.5], target: {}, up: [0, 0, 1], fov: 0.01}}\n"
                "film: {{resolution: [4, 4]}}\nintegrator: {{max_depth: 96, roulette: false}}\n"
                "materials: {{it: {{type: diffuse, reflectance: {}}}, black: {{type: diffuse, "
                "reflectance: 0}}}}\n"
                "objects:\n  - {{material: it, sphere: {{radius: 1, inward: true}}}}\n"
                "  - {{material: black, rectangle: {{size: [{}, {}]}}, transform: [{{rotate: {{axis: "
                "[1, 0, 0], angle_deg: 90}}}}], emission: {{radiance: {}, two_sided: true}}}}\n",
                towards, kReflectance, kSide, kSide, kRadiance),
            meanRadiance, kReflectance / kPi * (direct + indirect * (1 - kArea * cosine / kPi)), 5e-3,
            {.samples = 256, .most = 16384});
    }
}

// ---- Rays -----------------------------------------------------------------------------------------------

Object shapeObject(Scene& scene, const Quadric& shape, const Vec3d& centre, double scale,
                   const Vec3d& axis) {
    const Vec3d z = unit(axis), x = unit(cross(z, std::abs(z[0]) < 0.5 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0})),
                y = cross(z, x);
    Object object;
    object.mesh = static_cast<std::uint32_t>(scene.meshes.size());
    scene.meshes.emplace_back();
    object.shape = shape;
    object.material = 0;
    Matrix4d m = kIdentity4d;
    for (std::size_t r = 0; r < 3; ++r) {
        m[4 * r] = scale * x[r];
        m[4 * r + 1] = scale * y[r];
        m[4 * r + 2] = scale * z[r];
        m[4 * r + 3] = centre[r];
    }
    object.transforms = {m};
    return object;
}

Quadric sphereOf(double radius, double from, double to) {
    return {.type = QuadricType::Sphere, .radius = radius, .from_z = from, .to_z = to};
}

/// Closed rooms of shapes.
void addRoom(Scene& scene, int which, const Vec3d& centre, double scale, const Vec3d& axis) {
    const auto add = [&](const Quadric& shape, double along) {
        scene.objects.push_back(
            shapeObject(scene, shape, centre + unit(axis) * (along * scale), scale, axis));
    };
    const Quadric disk{.type = QuadricType::Disk, .radius = 1, .from_z = 0, .to_z = 0};
    if (which == 0) add(sphereOf(1, -1, 1), 0);
    if (which != 1 && which != 2) return;
    const double height = which == 1 ? 0.5 : 0.2;
    add({.type = QuadricType::Cylinder, .radius = 1, .from_z = -height, .to_z = height}, 0);
    if (which == 1) {
        add(disk, height);
        add(disk, -height);
    } else {
        const double rim = std::sqrt(3.0);
        add(sphereOf(2, rim, 2), height - rim);
        add(sphereOf(2, -2, -rim), rim - height);
    }
}

void closedRooms(Context& context) {
    const char* const names[] = {"ball", "can", "lens"};
    for (int which = 0; which < 3; ++which) {
        Tally tally;
        for (const auto& [scale, shift, far] : {std::tuple{1.0, Vec3d{0, 0, 0}, 0.0},
                                                {1e-3, Vec3d{0.3, 0.2, -0.1}, 1.0},
                                                {1e6, Vec3d{0, 0, 0}, 0.0},
                                                {1.0, Vec3d{148376, 1234, -223423}, 0.0},
                                                {1e-5, Vec3d{0.3, 0.2, -0.1}, 1.0}}) {
            const int resolution = context.atLeast(Level::Merge) ? 96 : 24;
            Scene scene = emptyScene(resolution, 5, shift, shift + Vec3d{0, 0, scale}, 1);
            scene.integrator.max_depth = 40;
            scene.environment = Environment{constantSpectrum(1000)};
            scene.materials.push_back(diffuse(1));
            addRoom(scene, which, shift, scale, {1, 2, 3});
            if (far > 0) addAnchors(scene, {0, 0, 0}, far);
            const Film film = context.render(scene, samples(16));
            for (std::uint32_t y = 0; y < film.shape().height; ++y)
                for (std::uint32_t x = 0; x < film.shape().width; ++x) {
                    tally.rays += 16 * 41;
                    tally.failures += radiance(film, x, y) > 0;
                }
        }
        rareFailures(context, fmt::format("paths in a closed {}, of 40 bounces", names[which]), tally, 1e-6,
                     "a ray starts behind the surface that it leaves, or slips through where two meet");
    }
}

void outsides(Context& context) {
    // A white mirror in light from everywhere, after one reflection: what meets the mirror again is dark.
    // Where shapes end in one circle they overlap by half a clearance: of the rays at a can some 4e-6 come
    // that near to a rim, and of these some go on inside.
    for (const double scale : {1.0, 1e-3, 1e6})
        for (int which = 0; which < 2; ++which) {
            Scene scene = emptyScene(512, 7, Vec3d{0, 0, -3} * scale, {0, 0, 0}, 0.42);
            scene.integrator.max_depth = 1;
            scene.environment = Environment{constantSpectrum(1000)};
            scene.materials.push_back(mirror(1));
            addRoom(scene, which, {0, 0, 0}, scale, {0.2, 1, -0.3});
            const Film film = context.render(scene, samples(1));
            Tally tally{film.counts.size(), 0};
            for (std::uint32_t y = 0; y < film.shape().height; ++y)
                for (std::uint32_t x = 0; x < film.shape().width; ++x)
                    tally.failures += radiance(film, x, y) < 1;
            rareFailures(
                context,
                fmt::format("reflected by the outside, scale {:g}, {}", scale, which == 0 ? "ball" : "can"),
                tally, which == 0 ? 1e-5 : 5e-5, "a ray meets the shape that it leaves");
        }
}

void treesOfShapes(Context& context) {
    for (const int count : {12, 300})
        for (const double distance : {0.05, 3.0, 1e4}) {
            Dice dice(static_cast<std::uint64_t>(count));
            Scene scene =
                emptyScene(context.atLeast(Level::Merge) ? 256 : 64, 3, Vec3d{0.1, 0.2, -1} * distance,
                           {0, 0, 0}, distance > 1 ? 1 / distance : 1);
            scene.integrator.max_depth = 0;
            scene.materials.push_back(diffuse(0.5));
            for (int i = 0; i < count; ++i) {
                const Quadric shape =
                    i % 4 == 0   ? sphereOf(1, -1, 1)
                    : i % 4 == 1 ? sphereOf(2, -0.5, 1.8)
                    : i % 4 == 2
                        ? Quadric{.type = QuadricType::Cylinder, .radius = 0.5, .from_z = -1, .to_z = 2}
                        : Quadric{.type = QuadricType::Disk, .radius = 1, .from_z = 0, .to_z = 0};
                scene.objects.push_back(shapeObject(scene, shape, dice.inBox(0.8),
                                                    std::pow(10.0, dice.uniform(-2.5, -0.7)),
                                                    dice.direction()));
            }
            Mesh sheet;
            addQuad(sheet, {-1, -1, 0.5}, {1, -1, 0.4}, {1, 1, 0.5}, {-1, 1, 0.6});
            addObject(scene, std::move(sheet), diffuse(0.5));
            scene.integrator.accelerator = Accelerator::Bvh;
            constexpr std::uint32_t kFirstHit = kAovNormal | kAovDepth | kAovPrimitive;
            const Film tree = context.render(scene, samples(1, kFirstHit));
            scene.integrator.accelerator = Accelerator::None;
            context.sameBits(fmt::format("{} shapes and a sheet, from {:g} away", count, distance),
                             context.render(scene, samples(1, kFirstHit)), tree,
                             "the tree loses a shape: its box is too small");
        }
}

void quadricRays(Context& context) {
    closedRooms(context);
    outsides(context);
    treesOfShapes(context);
}

}  // namespace

std::vector<Case> quadricCases() {
    return {
        row("D11", "quadrics",
            "Paths in closed rooms of spheres, disks and cylinders, large, tiny and far away; rays that "
            "their outsides reflect; first hits with and without a tree",
            "none gets out; none meets what it leaves; the same", "topology",
            "rates ≤ 1e-6, 1e-5 and, of rims, 5e-5; same bits", Level::Commit,
            CRT_FEATURE_SHAPES | CRT_FEATURE_BVH | CRT_FEATURE_BRUTE_FORCE | CRT_FEATURE_ENVIRONMENT |
                CRT_FEATURE_AOV,
            quadricRays),
        row("G40", "lenses",
            "A sun seen through a ball and through two caps with a rim, of index 1.5, from two distances; "
            "through a ball of SF10, in six bins of wavelengths; from level merge on also of index 1.8, and "
            "the "
            "caps of SF10",
            "the disk that it fills: f = nR / (2 (n − 1)) and the lensmaker's equation, with what is lost "
            "by "
            "reflection",
            "exact rays in double, Snell's law", "± 0.3 %; ± 1 %", Level::Commit,
            CRT_FEATURE_SHAPES | CRT_FEATURE_DIELECTRIC | CRT_FEATURE_POINT_LIGHT |
                CRT_FEATURE_SPECTRAL_FILM | CRT_FEATURE_DISPERSION,
            lenses),
        row("G41", "shapes-in-furnaces",
            "White, clear, frosted and mirroring balls, lenses and cans in light from everywhere; the wall "
            "of an integrating sphere",
            "1; ρ/π (direct + Φ/4πR² ρ/(1 − ρ))", "conservation of energy", "± 0.2 %; ± 0.5 %",
            Level::Commit,
            CRT_FEATURE_SHAPES | CRT_FEATURE_DIELECTRIC | CRT_FEATURE_ROUGH_DIELECTRIC | CRT_FEATURE_MIRROR |
                CRT_FEATURE_DIFFUSE | CRT_FEATURE_ENVIRONMENT_LIGHT,
            furnaces),
    };
}

}  // namespace crt::verify
