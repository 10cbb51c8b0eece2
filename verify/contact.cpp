// Group O: emitters that touch the surfaces they light, or nearly do. There the two techniques of direct
// light, points on the emitter and scattered rays, must still be about one point, with one density, in every
// order of the vertices.
#include "verify/context.h"
#include "verify/references.h"
#include "verify/scenes.h"

#include "base/vec3d.h"
#include "kernel/dialect/features.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

namespace crt::verify {
namespace {

constexpr std::uint64_t kDirectLight = CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE;

/// A way to find direct light: keys of the integrator, and what to call it.
struct Technique {
    const char* keys;
    const char* name;
};
constexpr Technique kTechniques[] = {{"nee: true", "both techniques"},
                                     {"nee: true, mis: false", "light sampling"},
                                     {"nee: false", "scattered rays"}};
constexpr const Technique &kBoth = kTechniques[0], &kLight = kTechniques[1], &kChance = kTechniques[2];

/// A lamp stands on the edge from `a` to `b`, and reaches `depth` away from it.
struct Lamp {
    Vec3d a, b, depth;
    bool two_sided = false;

    std::vector<Vec3d> quad() const { return {a, b, b + depth, a + depth}; }
    std::vector<Vec3d> triangle() const { return {a, b, (a + b) * 0.5 + depth}; }
};

/// A point on a receiver of reflectance 1, a square of half side `reach`, that is looked at from `eye` above
/// it.
struct Receiver {
    Vec3d point, normal;
    double reach, eye;
};

std::string corner(const Vec3d& v) { return fmt::format("[{}, {}, {}]", v[0], v[1], v[2]); }

std::string corners(const std::vector<Vec3d>& polygon) {
    std::string text;
    for (const Vec3d& v : polygon) text += (text.empty() ? "" : ", ") + corner(v);
    return "[" + text + "]";
}

/// One of the two axes across `normal`, which is an axis itself.
Vec3d acrossOf(const Vec3d& normal) { return normal[1] != 0 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0}; }

/// The square, moved so that the point is not on the diagonal, which is an edge of triangles: paths begin a
/// few 1e-6 of a triangle's size off those.
std::vector<Vec3d> squareAround(const Receiver& receiver) {
    const Vec3d u = acrossOf(receiver.normal) * receiver.reach, v = cross(receiver.normal, u);
    const Vec3d centre = receiver.point + u * 0.25;
    return {centre - u - v, centre + u - v, centre + u + v, centre - u + v};
}

/// Along the axes, where products of coordinates are exact, and as far from any axis as can be.
enum class Frame { Axes, Turned };

/// A direction or a point in that frame.
Vec3d in(Frame frame, const Vec3d& v) {
    if (frame == Frame::Axes) return v;
    // A rotation in whole numbers: rows and columns have length 9.
    return Vec3d{v[0] + 4 * v[1] + 8 * v[2], 8 * v[0] - 4 * v[1] + v[2], 4 * v[0] + 7 * v[1] - 4 * v[2]} *
           (1.0 / 9);
}

/// Vertices in that frame as single precision has them, which the answer is worked out from.
std::vector<Vec3d> in(Frame frame, std::vector<Vec3d> polygon) {
    for (Vec3d& v : polygon) {
        v = in(frame, v);
        for (double& x : v) x = static_cast<float>(x);
    }
    return polygon;
}

/// The polygon as it is, or turned over, so that its front sees `point`.
std::vector<Vec3d> facing(std::vector<Vec3d> polygon, const Vec3d& point) {
    if (dot(cross(polygon[1] - polygon[0], polygon[2] - polygon[0]), point - polygon[0]) < 0)
        std::reverse(polygon.begin(), polygon.end());
    return polygon;
}

std::string integrator(const Technique& technique, int depth = 1) {
    return fmt::format("{{max_depth: {}, roulette: false, {}}}", depth, technique.keys);
}

/// The receiver through a needle's eye and the lamp, its vertices numbered from `first` on. Two specks at ±
/// 16, which block 1e-8 of the sky, keep the origin of single precision where lamp and receiver meet.
std::string contactScene(const std::vector<Vec3d>& lamp, bool two_sided, std::size_t first,
                         const Receiver& receiver, Frame frame, const Technique& technique) {
    std::string face;
    for (std::size_t i = 0; i < lamp.size(); ++i)
        face += fmt::format("{}{}", face.empty() ? "" : ", ", (first + i) % lamp.size());
    const auto speck = [](double at) {
        const double near = at * (1 - 0x1p-10);
        return corners({{at, at, at}, {near, at, at}, {at, at, near}});
    };
    return Stage(
               fmt::format("{{position: {}, target: {}, up: {}, fov: 0.01}}",
                           corner(in(frame, receiver.point + receiver.normal * receiver.eye)),
                           corner(in(frame, receiver.point)), corner(in(frame, acrossOf(receiver.normal)))),
               integrator(technique))
        .material("white", "{type: diffuse, reflectance: 1}")
        .material("black", "{type: diffuse, reflectance: 0}")
        .mesh("receiver", corners(in(frame, squareAround(receiver))), "[[0, 1, 2, 3]]", "white")
        .mesh("lamp", corners(lamp), "[[" + face + "]]", "black", two_sided ? "1, two_sided: true" : "1")
        .mesh("speck below", speck(-16), "[[0, 1, 2]]", "black")
        .mesh("speck above", speck(16), "[[0, 1, 2]]", "black")
        .yaml();
}

/// The question at one distance.
struct Question {
    std::string where;
    Lamp lamp;
    Receiver receiver;
    double tolerance = 0.005;
};

/// True if scattered rays find the lamp often enough for an answer.
bool foundByChance(double form_factor) { return form_factor > 0.05; }

/// The answer for one shape of the lamp, in one order of its vertices and one frame.
Outcome answer(Context& context, const Question& q, const Technique& technique,
               const std::vector<Vec3d>& lamp, std::size_t first, Frame frame, double expected) {
    const std::string what = fmt::format("{}, {}: {} from vertex {}{}", q.where, technique.name,
                                         lamp.size() == 4 ? "quadrilateral" : "triangle", first,
                                         frame == Frame::Turned ? ", turned" : "");
    const JointMeasure measure = [](const std::vector<Film>& f) { return radiance(f.front()); };
    return context
        .estimated({{what, measure, expected}},
                   {contactScene(lamp, q.lamp.two_sided, first, q.receiver, frame, technique)}, q.tolerance,
                   {.samples = 256, .most = 65536}, {})
        .front();
}

/// Of all orders of the vertices, as a quadrilateral and as a triangle, along the axes and turned, the
/// answer farthest from Lambert's formula, for each technique.
void ask(Context& context, const Question& q) {
    const auto badness = [](const Outcome& x) {
        return std::pair(x.verdict, std::abs(*x.measured / *x.expected - 1));
    };
    for (const Technique& technique : kTechniques) {
        std::optional<Outcome> worst;
        for (const bool quad : {true, false})
            for (const Frame frame : {Frame::Axes, Frame::Turned}) {
                const std::vector<Vec3d> lamp =
                    in(frame, facing(quad ? q.lamp.quad() : q.lamp.triangle(), q.receiver.point));
                const double expected =
                    polygonFormFactor(in(frame, q.receiver.point), in(frame, q.receiver.normal), lamp);
                if (&technique == &kChance && !foundByChance(expected)) continue;
                // On every commit two orders of the quadrilateral: one can be right when the other is not.
                const std::size_t orders = context.atLeast(Level::Merge) ? lamp.size() : quad ? 2 : 1;
                for (std::size_t first = 0; first < orders; ++first) {
                    const Outcome o = answer(context, q, technique, lamp, first, frame, expected);
                    if (!worst || badness(o) >= badness(*worst)) worst = o;
                }
            }
        if (worst) context.add(*worst);
    }
}

/// Powers of two near 1e-1 … 1e-5; on every commit one where both techniques failed and one that is nearer
/// still.
std::vector<double> distances(const Context& context) {
    if (!context.atLeast(Level::Merge)) return {0x1p-10, 0x1p-14};
    return {0x1p-3, 0x1p-7, 0x1p-10, 0x1p-12, 0x1p-14, 0x1p-17};
}

/// A receiver as small as single precision needs to place its points to 1e-6 of the distance in question.
Receiver smallReceiver(const Vec3d& point, const Vec3d& normal, double distance) {
    return {point, normal, 8 * distance, 16 * distance};
}

void standingLamp(Context& context) {
    const Lamp lamp{{-1, 0, 0}, {1, 0, 0}, {0, 2, 0}, true};
    const Vec3d up{0, 1, 0};
    for (const double d : distances(context)) {
        ask(context,
            {fmt::format("floor of 18, {:.2g} from the foot", d), lamp, {{0, 0, d}, up, 9, 16 * d}});
        if (context.atLeast(Level::Merge))
            ask(context, {fmt::format("small floor, {:.2g} from the foot", d), lamp,
                          smallReceiver({0, 0, d}, up, d)});
    }
}

/// A square of light that looks down, with an edge and its middle at the origin.
const Lamp kCeiling{{0, 0, -0.5}, {0, 0, 0.5}, {1, 0, 0}};

void underAnEdge(Context& context) {
    const Vec3d inwards{1, 0, 0};
    for (const double d : distances(context)) {
        const Vec3d point{0, -d, 0};
        ask(context, {fmt::format("wall, {:.2g} under the edge", d), kCeiling, {point, inwards, 1, 16 * d}});
        if (context.atLeast(Level::Merge))
            ask(context, {fmt::format("small wall, {:.2g} under the edge", d), kCeiling,
                          smallReceiver(point, inwards, d)});
    }
}

void inACorner(Context& context) {
    const Lamp lamp{{0, 0, 0}, {0, 0, 1}, {1, 0, 0}};
    const Vec3d inwards{1, 0, 0};
    for (const double d : distances(context)) {
        ask(context,
            {fmt::format("wall, {:.2g} under the corner", d), lamp, smallReceiver({0, -d, 0}, inwards, d)});
        ask(context, {fmt::format("wall, {0:.2g} under the edge and {0:.2g} from its end", d), lamp,
                      smallReceiver({0, -d, d}, inwards, d)});
    }
}

void beside(Context& context) {
    for (const double d : distances(context))
        for (const double gap : {1.0, 2.0})
            ask(context, {fmt::format("wall, {:.2g} under the plane and {:.2g} beside the edge", d, gap * d),
                          kCeiling, smallReceiver({-gap * d, -d, 0}, {1, 0, 0}, d), 0.01});
}

void nearlyCoplanar(Context& context) {
    const std::vector<double> gaps =
        context.atLeast(Level::Merge) ? std::vector<double>{-1, 0, 1, 2} : std::vector<double>{-1, 1};
    for (const double d : distances(context))
        for (const double gap : gaps)
            ask(context,
                {fmt::format("floor, {:.2g} under the plane and {:.2g} beside the edge", d, gap * d),
                 kCeiling,
                 {{-gap * d, -d, 0}, {0, 1, 0}, 8 * d, d / 2},
                 0.01});
}

void grazing(Context& context) {
    // Past the end of a lamp that stands on the floor, hardly off its plane: the visible part of the lamp
    // is as thin as the distance.
    const Lamp lamp{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, true};
    for (const double d : distances(context))
        for (const double gap : {0.0, 0.5})
            ask(context, {fmt::format("floor, {:.2g} off the plane and {:.2g} past the end", d, gap), lamp,
                          smallReceiver({-gap, 0, d}, {0, 1, 0}, d), 0.01});
}

/// Mean over the square that a pixel sees: a camera straight before its centre.
std::string before(const Vec3d& centre, const Vec3d& normal, double side) {
    const double distance = 4 * side, fov = 2 * std::atan(0.5 * side / distance) * 180 / std::numbers::pi;
    return fmt::format("{{position: {}, target: {}, up: {}, fov: {:.17g}}}",
                       corner(centre + normal * distance), corner(centre), corner(acrossOf(normal)), fov);
}

void strip(Context& context) {
    // A wall's strip under the edge of a ceiling lamp, seen by one pixel as wide as it is high.
    constexpr double kSide = 0x1p-10;
    const std::vector<Vec3d> lamp{{0, 0, -0.5}, {1, 0, -0.5}, {1, 0, 0.5}, {0, 0, 0.5}};
    const Vec3d normal{1, 0, 0};
    const double expected = rectangleIntegral(
                                [&](double y, double z) {
                                    return polygonFormFactor({0, -y, z}, normal, lamp);
                                },
                                0, kSide, -kSide / 2, kSide / 2) /
                            (kSide * kSide);
    for (const Technique& technique : kTechniques)
        for (std::size_t first = 0; first < (context.atLeast(Level::Merge) ? 4 : 2); ++first) {
            const std::string scene = Stage(before({0, -kSide / 2, 0}, normal, kSide), integrator(technique))
                                          .set("film", "{resolution: [1, 1]}")
                                          .material("white", "{type: diffuse, reflectance: 1}")
                                          .material("black", "{type: diffuse, reflectance: 0}")
                                          .quad("wall", "[[0,-1,-1], [0,0,-1], [0,0,1], [0,-1,1]]", "white")
                                          .mesh("lamp", corners(lamp),
                                                fmt::format("[[{}, {}, {}, {}]]", first, (first + 1) % 4,
                                                            (first + 2) % 4, (first + 3) % 4),
                                                "black", "1")
                                          .yaml();
            context.estimate(fmt::format("{}, from vertex {}", technique.name, first), scene, meanRadiance,
                             expected, 0.005, {.samples = 4096, .most = 262144});
        }
}

void perpendicularRectangles(Context& context) {
    // Receiver 1 × 1 on the floor, lamp 1 × height on the wall, with a common edge: the image of the
    // receiver, which fills the film, is the form factor.
    const bool merge = context.atLeast(Level::Merge);
    for (const double height : merge ? std::vector<double>{1, 0.25, 4} : std::vector<double>{1}) {
        for (const Technique& technique : kTechniques) {
            const std::string scene =
                Stage(before({0, 0, 0.5}, {0, 1, 0}, 1), integrator(technique))
                    .material("white", "{type: diffuse, reflectance: 1}")
                    .material("black", "{type: diffuse, reflectance: 0}")
                    .quad("receiver", "[[-0.5,0,0], [-0.5,0,1], [0.5,0,1], [0.5,0,0]]", "white")
                    .quad("lamp", fmt::format("[[-0.5,0,0], [0.5,0,0], [0.5,{0},0], [-0.5,{0},0]]", height),
                          "black", "1")
                    .yaml();
            const double tolerance = &technique == &kChance ? 0.003 : merge ? 0.001 : 0.002;
            context.estimate(fmt::format("lamp 1 × {}, {}", height, technique.name), scene, meanRadiance,
                             perpendicularFormFactor(1, height), tolerance,
                             {.samples = 1024, .most = 65536});
        }
    }
}

void threeWays(Context& context) {
    // A room with a lamp that stands on the floor against the wall, one along the ceiling's edge, and one in
    // a corner.
    const auto room = [](const Technique& technique) {
        Cube cube;
        cube.reflectance = "0.7";
        cube.emitting = "none";
        cube.camera = "{position: [0.5, 0.5, 0.01], target: [0.5, 0.4, 0.9], fov: 100}";
        cube.integrator = integrator(technique, 4);
        cube.film = "{resolution: [16, 16]}";
        return yaml(cube) +
               "  - {name: standing, mesh: {positions: [[0,0,0.5],[0.25,0,0.5],[0.25,0.5,0.5],[0,0.5,0.5]], "
               "faces: [[0,1,2,3]]}, "
               "material: wall, emission: {radiance: 1, two_sided: true}}\n"
               "  - {name: edge, mesh: {positions: [[1,0.999,0],[1,0.999,1],[0.75,0.999,1],[0.75,0.999,0]], "
               "faces: [[1,2,3,0]]}, "
               "material: wall, emission: {radiance: 1, two_sided: true}}\n"
               "  - {name: corner, mesh: {positions: [[1,0,0.875],[0.875,0,1],[1,0.125,1]], faces: "
               "[[2,0,1]]}, material: wall, emission: {radiance: 1, two_sided: true}}\n";
    };
    const JointMeasure ratio = [](const std::vector<Film>& f) { return radiance(f[0]) / radiance(f[1]); };
    const Effort effort{.samples = 256, .most = 4096};
    context.estimate("light sampling alone over both techniques", {room(kLight), room(kBoth)}, ratio, 1,
                     0.002, effort);
    context.estimate("scattered rays alone over both techniques", {room(kChance), room(kBoth)}, ratio, 1,
                     0.002, effort);
}

}  // namespace

std::vector<Case> contactCases() {
    constexpr const char* kLambert = "Lambert's polygon formula in double";
    return {
        row("O01", "standing-lamp", "A floor 0.1 to 1e-5 from the foot of a lamp that stands on it",
            "the form factor, in the limit 1/2", kLambert, "± 0.5 %", Level::Commit, kDirectLight,
            standingLamp),
        row("O02", "under-an-edge",
            "A wall 0.1 to 1e-5 under the edge of a ceiling lamp, every order of its vertices",
            "the form factor, in the limit 1/2", kLambert, "± 0.5 %", Level::Commit, kDirectLight,
            underAnEdge),
        row("O03", "in-a-corner", "A wall under the corner of a ceiling lamp, as near", "the form factor",
            kLambert, "± 0.5 %", Level::Commit, kDirectLight, inACorner),
        row("O04", "beside-a-lamp", "A wall beside a ceiling lamp, as near to its edge and its plane",
            "the form factor", kLambert, "± 1 %", Level::Commit, kDirectLight, beside),
        row("O05", "nearly-coplanar", "A floor close under the plane of a lamp, at its edge and beside it",
            "the form factor", kLambert, "± 1 %", Level::Commit, kDirectLight, nearlyCoplanar),
        row("O06", "grazing-lamp",
            "A floor hardly off the plane of a lamp, at its end and half its width past it",
            "the form factor", kLambert, "± 1 %", Level::Commit, kDirectLight, grazing),
        row("O07", "strip-under-an-edge", "A pixel that sees the last 1e-3 of a wall under a ceiling lamp",
            "the form factor's mean over it", "quadrature of Lambert's polygon formula", "± 0.5 %",
            Level::Commit, kDirectLight, strip),
        row("O08", "perpendicular-rectangles",
            "A lamp that stands on the edge of the floor that it lights, seen as a whole",
            "the form factor of two rectangles with a common edge, 0.2000437761 for squares", "Howell C-14",
            "± 0.2 % (± 0.1 % from level merge on), by scattered rays ± 0.3 %", Level::Commit,
            kDirectLight,
            perpendicularRectangles),
        row("O09", "three-ways",
            "A room with lamps along its edges, by light sampling, by scattered rays and by both",
            "one mean", "all are unbiased", "ratio 1 ± 0.2 %", Level::Merge, kDirectLight, threeWays),
    };
}

}  // namespace crt::verify
