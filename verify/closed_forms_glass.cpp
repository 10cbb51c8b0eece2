// Group A, the part about smooth interfaces: Fresnel, Snell, the scaling of radiance by n², dispersion.
//
// Over 450 lines: cases, each a scene and its answer, that share nothing with their neighbours.
#include "verify/context.h"
#include "verify/references.h"
#include "verify/scenes.h"

#include "kernel/dialect/features.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace crt::verify {
namespace {

/// n of the glass in these cases, unless a case sets another.
constexpr double kIndex = 1.5;
constexpr std::uint64_t kGlass = CRT_FEATURE_DIELECTRIC | CRT_FEATURE_ENVIRONMENT;

void clearBody(Context& context) {
    const auto scene = [](bool body, double ior, int depth) {
        Stage stage("{position: [0.2, 3, 4], target: [0.5, 0.5, 0.5], fov: 15}",
                    fmt::format("{{max_depth: {}, roulette: false}}", depth));
        stage.set("environment", "{radiance: 1}").set("film", "{resolution: [8, 8]}");
        if (body)
            stage.material("glass", fmt::format("{{type: dielectric, ior: {}}}", ior))
                .box("cube", {0, 0, 0}, {1, 1, 1}, "glass");
        return stage.yaml();
    };
    const Render how{.samples = 64};
    const Film empty = context.render(scene(false, 1, 1), how);
    for (const double ior : {1.5, 1 / 1.5, 2.4})
        context.relative(
            fmt::format("index {:.3g}: the worst pixel", ior),
            worstRatio(context.render(scene(true, ior, 256), how), empty), 1, 1e-5,
            {{kIndex * kIndex, "radiance is scaled by n² on the way in but not back on the way out"}});
    const Film dark = context.render(scene(true, 1.5, 0), how);
    context.holds("at depth 0 its silhouette is black", radiance(dark) < 0.7 * radiance(empty),
                  "darker by a third", "the cube is not in the picture");
}

/// The half space y < 0 of glass, seen from `camera`.
Stage halfSpace(const std::string& camera, const std::string& glass, int depth) {
    Stage stage(camera, fmt::format("{{max_depth: {}, roulette: false}}", depth));
    stage.material("black", "{type: diffuse, reflectance: 0}").material("glass", glass);
    stage.quad("interface", "[[-10,0,-10],[-10,0,10],[10,0,10],[10,0,-10]]", "glass");
    return stage;
}

/// An eye 1 away from the origin at `degrees` from the vertical, above or below.
std::string eyeAt(double degrees, double side) {
    return fmt::format("{{position: [{:.17g}, {:.17g}, 0], target: [0, 0, 0], up: [0, 0, 1], fov: 0.0001}}",
                       std::sin(degrees * kDegree), side * std::cos(degrees * kDegree));
}

void fresnel(Context& context) {
    // From outside: the environment is seen by reflection, black by refraction.
    const auto outside = [](double degrees, const std::string& material) {
        return halfSpace(eyeAt(degrees, 1), material, 2)
            .set("environment", "{radiance: 1}")
            .quad("bottom", "[[-1000,-1,-1000],[-1000,-1,1000],[1000,-1,1000],[1000,-1,-1000]]", "black")
            .yaml();
    };
    struct Angle {
        double degrees, ior;
    };
    const double brewster = std::atan(kIndex) / kDegree;
    for (const Angle& a : {Angle{0, 1.5}, {brewster, 1.5}, {60, 1.5}, {89.9, 1.5}, {0, 2.4}, {0, 100}}) {
        const double expected = fresnelDielectric(std::cos(a.degrees * kDegree), a.ior);
        const std::string where = fmt::format("n = {:g}, {:.6g}°", a.ior, a.degrees);
        // A conductor without absorption reflects as the dielectric does, but every ray: no variance. The
        // empty scene has the same wavelengths.
        const Film empty = context.render(
            Stage(eyeAt(a.degrees, 1)).set("environment", "{radiance: 1}").yaml(), {.samples = 16});
        const Film mirror = context.render(
            outside(a.degrees, fmt::format("{{type: conductor, eta: {}, k: 0}}", a.ior)), {.samples = 16});
        context.absolute(where + ", as a conductor without absorption", radiance(mirror) / radiance(empty),
                         expected, 1e-6);
        // One decision by one stratified number: its share is right to 1/N.
        context.estimate(where + ", as a dielectric",
                         outside(a.degrees, fmt::format("{{type: dielectric, ior: {}}}", a.ior)),
                         meanRadiance, expected, 0.001, {.samples = 1024, .most = 65536});
    }
    // From inside: the lamp below is seen by reflection, nothing by refraction. Beyond the critical angle
    // all of it.
    const auto inside = [](double degrees, int depth) {
        return halfSpace(eyeAt(degrees, -1), "{type: dielectric, ior: 1.5}", depth)
            .quad("lamp", "[[-1000,-2,-1000],[-1000,-2,1000],[1000,-2,1000],[1000,-2,-1000]]", "black", "1")
            .yaml();
    };
    const double critical = std::asin(1 / kIndex) / kDegree;
    const std::string lamp_alone =
        Stage("{position: [0,-1,0], target: [0,-2,0], up: [0,0,1], fov: 0.0001}", "{max_depth: 0}")
            .material("black", "{type: diffuse, reflectance: 0}")
            .quad("lamp", "[[-1000,-2,-1000],[-1000,-2,1000],[1000,-2,1000],[1000,-2,-1000]]", "black", "1")
            .yaml();
    const Film lamp = context.render(lamp_alone, {.samples = 64});
    for (const double beyond : {0.01, 1.0, 30.0})
        context.relative(fmt::format("from inside, {}° beyond the critical angle: the worst pixel", beyond),
                         worstRatio(context.render(inside(critical + beyond, 2), {.samples = 64}), lamp), 1,
                         2e-6, {{0, "light is refracted where it is totally reflected"}});
    context.estimate("from inside, 40°", inside(40, 2), meanRadiance,
                     fresnelDielectric(std::cos(40 * kDegree), 1 / kIndex), 0.002,
                     {.samples = 1024, .most = 65536});
    if (!context.atLeast(Level::Merge)) return;
    // Diffuse light: a white floor sees the environment through the interface alone; what the interface
    // sends back is not scattered again.
    const double reflected_outside = 0.0917779593, reflected_inside = 0.5963457597;
    const auto diffuse = [](const char* interface) {
        return Stage("{position: [0, 0.05, 0.1], target: [0, 0, 0], fov: 0.01}",
                     "{max_depth: 2, roulette: false}")
            .set("environment", "{radiance: 1}")
            .material("white", "{type: diffuse, reflectance: 1}")
            .material("glass", "{type: dielectric, ior: 1.5}")
            .quad("floor", "[[-1000,0,-1000],[-1000,0,1000],[1000,0,1000],[1000,0,-1000]]", "white")
            .quad("interface", interface, "glass")
            .yaml();
    };
    const Effort effort{.samples = 1024, .most = 65536};
    context.estimate("diffuse light into glass, (1 − 0.0917779593)/n²",
                     diffuse("[[-1000,1,-1000],[1000,1,-1000],[1000,1,1000],[-1000,1,1000]]"), meanRadiance,
                     (1 - reflected_outside) / (kIndex * kIndex), 0.001, effort,
                     {{1 - reflected_outside, "radiance is not divided by n² on the way into glass"}});
    context.estimate("diffuse light out of glass, (1 − 0.5963457597)·n²",
                     diffuse("[[-1000,1,-1000],[-1000,1,1000],[1000,1,1000],[1000,1,-1000]]"), meanRadiance,
                     (1 - reflected_inside) * kIndex * kIndex, 0.001, effort,
                     {{1 - reflected_inside, "radiance is not multiplied by n² on the way out of glass"}});
}

void slab(Context& context) {
    const auto scene = [](double lamp_z, const char* lamp) {
        return Stage("{position: [0, 0, 5], target: [0, 0, 0], fov: 0.001}",
                     "{max_depth: 64, roulette: false}")
            .material("glass", "{type: dielectric, ior: 1.5}")
            .material("black", "{type: diffuse, reflectance: 0}")
            .box("slab", {-10, -10, -0.5}, {10, 10, 0.5}, "glass")
            .quad("lamp", fmt::format(fmt::runtime(lamp), lamp_z), "black", "1")
            .yaml();
    };
    const double r = fresnelDielectric(1, kIndex), transmitted = (1 - r) / (1 + r);
    context.estimate("transmitted", scene(-3, "[[-9,-9,{0}],[9,-9,{0}],[9,9,{0}],[-9,9,{0}]]"), meanRadiance,
                     transmitted, 0.0005, {.samples = 1024, .most = 65536},
                     {{(1 - r) * (1 - r), "light reflected to and fro inside the slab is missing"}});
    context.estimate("reflected", scene(8, "[[-9,-9,{0}],[-9,9,{0}],[9,9,{0}],[9,-9,{0}]]"), meanRadiance,
                     1 - transmitted, 0.005, {.samples = 1024, .most = 262144},
                     {{r, "only the front face reflects"}});
}

void glassCube(Context& context) {
    const auto scene = [](const char* camera, const char* film, int depth) {
        return Stage(camera, fmt::format("{{max_depth: {}, roulette: false}}", depth))
            .set("environment", "{radiance: 1}")
            .set("film", film)
            .material("glass", "{type: dielectric, ior: 1.5}")
            .box("cube", {-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}, "glass")
            .yaml();
    };
    constexpr int size = 32;
    constexpr const char* film_text = "{resolution: [32, 32]}";
    constexpr const char* forward = "{position: [0,0,0], target: [0,0,1], fov: 90}";
    const Film empty = context.render(
        Stage(forward).set("environment", "{radiance: 1}").set("film", film_text).yaml(), {.samples = 16});
    const Film film = context.render(scene(forward, film_text, 64), {.samples = 16});
    const double rim = 1 / std::sqrt(kIndex * kIndex - 1);  // tangent of the critical angle
    double worst = 1, trapped = 0, weighted = 0, weights = 0;
    for (std::uint32_t y = 0; y < size; ++y)
        for (std::uint32_t x = 0; x < size; ++x) {
            const double u0 = 2.0 * x / size - 1, u1 = u0 + 2.0 / size, v0 = 2.0 * y / size - 1,
                         v1 = v0 + 2.0 / size;
            const double farthest =
                std::hypot(std::max(std::abs(u0), std::abs(u1)), std::max(std::abs(v0), std::abs(v1)));
            const double nearest =
                std::hypot(std::min(std::abs(u0), std::abs(u1)), std::min(std::abs(v0), std::abs(v1)));
            const double ratio = film.mean(x, y, 1) / empty.mean(x, y, 1);
            if (farthest < rim) worst = fartherFrom(1, worst, ratio / (kIndex * kIndex));
            if (nearest > rim) trapped += film.mean(x, y, 1);
            const double weight = std::pow(1 + (u0 + u1) * (u0 + u1) / 4 + (v0 + v1) * (v0 + v1) / 4, -1.5);
            weighted += weight * ratio;
            weights += weight;
        }
    context.relative("within 41.81° of the axis, n²: the worst pixel", worst * kIndex * kIndex,
                     kIndex * kIndex, 1e-5,
                     {{1, "radiance is not multiplied by n² on the way out of glass"}});
    context.relative("beyond it: totally reflected for ever", trapped, 0, 0,
                     {{1, "light enters where it is totally reflected"}});
    context.relative("mean over all directions", weighted / weights, kIndex * kIndex * (3 - std::sqrt(5.0)),
                     0.005);
    const double r = fresnelDielectric(1, kIndex);
    for (const int depth : {1, 2, 3})
        context.estimate(
            fmt::format("along the axis at depth {}, n²(1 − 0.04^{})", depth, depth),
            scene("{position: [0,0,0], target: [0,0,1], fov: 0.001}", "{resolution: [4, 4]}", depth),
            meanRadiance, kIndex * kIndex * (1 - std::pow(r, depth)), 0.0005,
            {.samples = 1024, .most = 65536});
    // Throughput stays 1 for ever, so that only the depth ends these paths.
    const std::string lost =
        scene("{position: [0,0,0], target: [1,1,1], fov: 1}", "{resolution: [1, 1]}", 1000);
    context.render(lost, {.samples = 16});
    context.relative("rays of a trapped path at depth 1000",
                     static_cast<double>(context.report().closest_rays) / 16, 1001, 0);
}

void outOfGlass(Context& context) {
    const std::string scene = halfSpace("{position: [0,-1,0], target: [0,0,0], up: [0,0,1], fov: 0.0001}",
                                        "{type: dielectric, ior: 1.5}", 1)
                                  .set("film", "{resolution: [2, 2]}")
                                  .quad("lamp", "[[-9,5,-9],[9,5,-9],[9,5,9],[-9,5,9]]", "black", "1")
                                  .yaml();
    const std::string alone =
        Stage("{position: [0,-1,0], target: [0,0,0], up: [0,0,1], fov: 0.0001}", "{max_depth: 0}")
            .set("film", "{resolution: [2, 2]}")
            .material("black", "{type: diffuse, reflectance: 0}")
            .quad("lamp", "[[-9,5,-9],[9,5,-9],[9,5,9],[-9,5,9]]", "black", "1")
            .yaml();
    // One decision by one stratified number: right to 1/N in each pixel.
    const Render how{.samples = 1u << 19};
    context.relative(
        "n²(1 − R)", radiance(context.render(scene, how)) / radiance(context.render(alone, how)),
        kIndex * kIndex * (1 - fresnelDielectric(1, kIndex)), 1e-5,
        {{0.96, "radiance is not multiplied by n² on the way out of glass"},
         {0.96 / (kIndex * kIndex), "radiance is divided by n² on the way out of glass, not multiplied"},
         {kIndex * kIndex, "nothing is reflected"}});
}

// ------------------------------------------------------------------------------------------------ the prism

struct Vec2 {
    double x, y;
};
Vec2 operator+(Vec2 a, Vec2 b) { return {a.x + b.x, a.y + b.y}; }
Vec2 operator*(Vec2 a, double s) { return {a.x * s, a.y * s}; }
double dot(Vec2 a, Vec2 b) { return a.x * b.x + a.y * b.y; }
Vec2 atAngle(double radians) { return {std::cos(radians), std::sin(radians)}; }

/// Snell's law; n against d, both unit, eta the index beyond over the index before.
Vec2 refract(Vec2 d, Vec2 n, double eta) {
    const double c = -dot(d, n);
    return d * (1 / eta) + n * (c / eta - std::sqrt(1 - (1 - c * c) / (eta * eta)));
}

/// The point at which o + t·d meets the line through p with normal n.
Vec2 meet(Vec2 o, Vec2 d, Vec2 p, Vec2 n) { return o + d * (dot(n, p + o * -1.0) / dot(n, d)); }

/// A 60° prism with its apex up, entered at the middle of its left face at 49.3233489°, the angle of least
/// deviation for the d line.
class Prism {
public:
    /// Position on the screen, along `along`, of the ray that enters at `entry`.
    double onScreen(double index) const {
        const Vec2 inside = refract(axis, left, index);
        const Vec2 out = meet(entry, inside, exit, right);
        const Vec2 leaves = refract(inside, right * -1.0, 1 / index);
        return dot(meet(out, leaves, screen, towards) + screen * -1.0, along);
    }
    double deviation(double index) const {
        const Vec2 leaves = refract(refract(axis, left, index), right * -1.0, 1 / index);
        return (std::atan2(axis.y, axis.x) - std::atan2(leaves.y, leaves.x)) / kDegree;
    }

    double incidence = 49.3233489 * kDegree;
    Vec2 left{-std::sqrt(0.75), 0.5}, right{std::sqrt(0.75), 0.5};
    Vec2 entry{-0.25, std::sqrt(3.0) / 4}, exit{0.25, std::sqrt(3.0) / 4};
    Vec2 axis = atAngle(incidence - 30 * kDegree);
    Vec2 towards = atAngle(30 * kDegree - incidence);  ///< Of the d line behind the prism.
    Vec2 along{-towards.y, towards.x};
    Vec2 screen = exit + towards;                      ///< 1 behind the exit.
};

double sellmeierBk7(double nm) {
    const double l2 = nm * nm * 1e-6;
    return std::sqrt(1 + 1.03961212 * l2 / (l2 - 0.00600069867) + 0.231792344 * l2 / (l2 - 0.0200179144) +
                     1.01046945 * l2 / (l2 - 103.560653));
}

/// A beam this narrow is a point on the screen.
constexpr const char* kBeam = "fov: 1e-6";
/// 0.1 pixel of 0.01°.
constexpr double kTolerance_degrees = 0.001;

/// The lamp's spectrum: flat over the nanometre in which the line lies, and down to 0 in the next on both
/// sides. Its corners are whole nanometres, where spectra have theirs, so that the compiled scene has the
/// same.
struct Band {
    double floor_nm;
    explicit Band(double line_nm) : floor_nm(std::floor(line_nm)) {}
    double lower_nm() const { return floor_nm - 1; }
    double upper_nm() const { return floor_nm + 2; }
    double at(double nm) const { return std::clamp(std::min(nm - lower_nm(), upper_nm() - nm), 0.0, 1.0); }
    std::string yaml() const {
        return fmt::format("{{table: {{nm: [{},{},{},{}], value: [0,1,1,0]}}, outside: zero}}", lower_nm(),
                           floor_nm, floor_nm + 1, upper_nm());
    }
};

/// x̄ + ȳ + z̄, which is what radiance() weighs wavelengths by.
double observer(double nm) {
    const auto i = static_cast<std::size_t>(nm - kWavelengthMin_nm);
    const double f = nm - kWavelengthMin_nm - static_cast<double>(i);
    double sum = 0;
    for (const Spectrum& s : cieObserver()) sum += s[i] + f * (s[i + 1] - s[i]);
    return sum;
}

/// Of the band's light, the share of wavelengths below `nm`; and its inverse.
class BandShare {
public:
    explicit BandShare(const Band& band) : band_(band), below_{0} {
        const long steps = std::lround((band.upper_nm() - band.lower_nm()) / kStep_nm);
        for (long step = 0; step < steps; ++step) {
            const double nm = band.lower_nm() + (static_cast<double>(step) + 0.5) * kStep_nm;
            below_.push_back(below_.back() + band.at(nm) * observer(nm));
        }
    }
    double quantile_nm(double share) const {
        const double wanted = std::clamp(share, 0.0, 1.0) * below_.back();
        const auto above = std::upper_bound(below_.begin() + 1, below_.end() - 1, wanted);
        const double fraction = (wanted - *(above - 1)) / (*above - *(above - 1));
        return band_.lower_nm() +
               (static_cast<double>(above - below_.begin() - 1) + std::clamp(fraction, 0.0, 1.0)) * kStep_nm;
    }

private:
    static constexpr double kStep_nm = 0.001;
    Band band_;
    std::vector<double> below_;
};

/// A beam without width enters the prism and leaves as a spectrum. Of a lamp that begins where the line goes
/// and reaches beyond all longer wavelengths the beam sees a share that says which wavelength really goes to
/// its edge. By as much as that one's deviation is too small, the line's is too large.
void prism(Context& context) {
    const Prism p;
    const auto scene = [&](double line_nm, double edge) {
        const Vec2 from = p.screen + p.along * edge, to = p.screen + p.along * 0.4;
        const Vec2 eye = p.entry + p.axis * -2.0;
        const double h = std::sqrt(0.75);
        return Stage(fmt::format(
                         "{{position: [{:.17g},{:.17g},0], target: [{:.17g},{:.17g},0], up: [0,0,-1], {}}}",
                         eye.x, eye.y, p.entry.x, p.entry.y, kBeam),
                     "{max_depth: 2, roulette: false}")
            .material("glass", "{type: dielectric, ior: {glass: N-BK7}}")
            .material("black", "{type: diffuse, reflectance: 0}")
            .mesh("prism",
                  fmt::format("[[-0.5,0,-1],[0.5,0,-1],[0,{0:.17g},-1],[-0.5,0,1],[0.5,0,1],[0,{0:.17g},1]]",
                              h),
                  "[[0,2,1],[3,4,5],[0,1,4,3],[1,2,5,4],[2,0,3,5]]", "glass")
            .quad("lamp",
                  fmt::format("[[{0:.17g},{1:.17g},-0.1],[{2:.17g},{3:.17g},-0.1],[{2:.17g},{3:.17g},0.1],[{"
                              "0:.17g},{1:.17g},0.1]]",
                              from.x, from.y, to.x, to.y),
                  "black", Band(line_nm).yaml() + ", two_sided: true")
            .yaml();
    };
    struct Line {
        const char* name;
        double nm, deviation;
    };
    for (const Line& line : {Line{"d", 587.5618, 38.6466985},
                             {"F", 486.1327, 39.1390498},
                             {"C", 656.2725, 38.4293164},
                             {"400 nm", 400, 39.8956926},
                             {"700 nm", 700, 38.3192326}}) {
        if (line.nm != 587.5618 && !context.atLeast(Level::Merge)) continue;
        const double index = sellmeierBk7(line.nm);
        context.absolute(fmt::format("{}: deviation by Snell's law, degrees", line.name), p.deviation(index),
                         line.deviation, 1e-6);
        const Band band(line.nm);
        const BandShare share(band);
        const auto inImage = [&](double edge_nm) {
            return 2 * p.deviation(index) - p.deviation(sellmeierBk7(edge_nm));
        };
        context.estimate(
            fmt::format("{}: deviation in the image, degrees", line.name),
            {scene(line.nm, p.onScreen(index)), scene(line.nm, -0.4)},
            [&](const std::vector<Film>& f) {
                return inImage(share.quantile_nm(1 - radiance(f[0]) / radiance(f[1])));
            },
            line.deviation, kTolerance_degrees / line.deviation, {.samples = 8192, .most = 1u << 17},
            {{line.deviation,
              "the line is not where its wavelength goes: is the index that of another wavelength?"}});
    }
}

}  // namespace

std::vector<Case> glassCases() {
    return {
        {.id = "A10",
         .name = "clear-cube",
         .title = "A clear dielectric cube in a constant environment, n = 1.5, 1/1.5 and 2.4",
         .expected = "it cannot be seen: the n² of leaving cancels the 1/n² of entering",
         .source = "conservation of radiance over n²",
         .tolerance = "1e-5 in every pixel",
         .level = Level::Commit,
         .needs = kGlass,
         .run = clearBody},
        {.id = "A11",
         .name = "reflectance",
         .title = "Reflectance of an interface: 0°, Brewster's angle, 60°, 89.9°, the critical angle, "
                  "diffuse light (from level merge on); n = 1.5, 2.4, 100",
         .expected = "0.04, 0.073964497, 0.089186713, 0.98991188, exactly "
                     "1 beyond 41.810315°; 0.16955017, 0.96078816",
         .source = "Fresnel's equations; diffuse averages by quadrature",
         .tolerance = "± 1e-6 without variance, ± 0.1 % with; 2e-6 for total reflection",
         .level = Level::Commit,
         .needs = kGlass | CRT_FEATURE_CONDUCTOR | CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT,
         .run = fresnel},
        {.id = "A12",
         .name = "slab",
         .title = "A plane-parallel slab of n = 1.5 at normal incidence",
         .expected = "T = (1 − R)/(1 + R) = 0.9230769231, the rest reflected",
         .source = "geometric series of internal reflections",
         .tolerance = "± 0.05 % transmitted, ± 0.5 % reflected",
         .level = Level::Commit,
         .needs = CRT_FEATURE_DIELECTRIC | CRT_FEATURE_AREA_LIGHT,
         .run = slab},
        {.id = "A13",
         .name = "glass-cube-trap",
         .title = "Eye in the centre of a glass cube in a constant environment",
         .expected = "n² within 41.81° of each axis, exactly 0 elsewhere, "
                     "mean n²(3 − √5) = 1.7188470506; "
                     "paths end at the depth",
         .source = "total internal reflection at all three pairs of faces",
         .tolerance = "1e-5 and exactly 0; mean 0.5 %; ± 0.05 % for n²(1 − 0.04^k)",
         .level = Level::Commit,
         .needs = kGlass,
         .run = glassCube},
        {.id = "A14",
         .name = "out-of-glass",
         .title = "Eye in glass that looks straight out",
         .expected = "n²(1 − R) = 2.16",
         .source = "Fresnel's equations",
         .tolerance = "1e-5",
         .level = Level::Commit,
         .needs = CRT_FEATURE_DIELECTRIC | CRT_FEATURE_AREA_LIGHT,
         .run = outOfGlass},
        {.id = "A15",
         .name = "prism",
         .title = "60° prism of N-BK7 at the d line's least deviation: where the lines d, F, C, 400 and "
                  "700 nm go (d alone at level commit)",
         .expected = "deviations of 38.6466985°, 39.1390498°, 38.4293164°, 39.8956926°, 38.3192326°",
         .source = "Snell's law and Schott's Sellmeier coefficients to 30 digits, the lines at 587.5618, "
                   "486.1327 and 656.2725 nm",
         .tolerance = "± 0.001° in the image, 99.9 % interval",
         .level = Level::Commit,
         .needs = CRT_FEATURE_DIELECTRIC | CRT_FEATURE_DISPERSION | CRT_FEATURE_AREA_LIGHT,
         .run = prism},
    };
}

}  // namespace crt::verify
