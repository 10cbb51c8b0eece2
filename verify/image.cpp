// Group J: film and camera.
#include "film/resolve.h"
#include "verify/context.h"
#include "verify/references.h"
#include "verify/scenes.h"

#include "base/log.h"
#include "compile/compile.h"
#include "kernel/dialect/features.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <tuple>
#include <utility>

namespace crt::verify {
namespace {

/// A room with a lamp, a mirror and a glass block, so that there is something to be seen everywhere.
std::string room(const std::string& camera, const std::string& film) {
    return Stage(camera, "{max_depth: 4}")
        .set("film", film)
        .material("wall", "{type: diffuse, reflectance: 0.6}")
        .material("mirror", "{type: mirror, reflectance: 0.9}")
        .material("glass", "{type: dielectric, ior: 1.5}")
        .mesh("walls", "[[0,0,0],[1,0,0],[0,1,0],[1,1,0],[0,0,1],[1,0,1],[0,1,1],[1,1,1]]",
              "[[0,1,3,2],[4,6,7,5],[0,4,5,1],[0,2,6,4],[1,5,7,3]]", "wall")
        .quad("ceiling", "[[0,1,0],[1,1,0],[1,1,1],[0,1,1]]", "wall", "1")
        .box("block", {0.6, 0.1, 0.6}, {0.8, 0.4, 0.8}, "glass")
        .box("cube", {0.2, 0.1, 0.5}, {0.4, 0.3, 0.7}, "mirror")
        .yaml();
}

constexpr const char* kInside = "{position: [0.5, 0.5, 0.05], target: [0.5, 0.4, 1], fov: 70}";

void sizes(Context& context) {
    for (const char* film : {"[1, 1]", "[1, 64]", "[64, 1]"}) {
        const Film f =
            context.render(room(kInside, fmt::format("{{resolution: {}}}", film)), {.samples = 16});
        context.holds(
            fmt::format("film {}", film),
            std::all_of(f.counts.begin(), f.counts.end(), [](std::uint64_t n) { return n == 16; }) &&
                luminance(f) > 0,
            "16 samples in each pixel", "pixels are missed");
    }
    // A crop of a film of 46340² pixels, the largest below 2^31, at its far corner: pixel numbers there
    // need all 31 bits, offsets of bytes 37.
    const auto corner = [](int size) {
        return fmt::format("{{resolution: [{0}, {0}], crop: [{1}, {1}, {0}, {0}]}}", size, size - 4);
    };
    for (const int size : {16384, 46340}) {
        const std::string eye = "{position: [0, 0, 0], target: [0, 0, 1], fov: 90}";
        // The lamp fills the last two columns of the film: image right is −x here.
        const double edge = -(1 - 4.0 / size);
        const std::string text =
            Stage(eye, "{max_depth: 0}")
                .set("film", corner(size))
                .material("black", "{type: diffuse, reflectance: 0}")
                .quad("lamp", fmt::format("[[{0:.17g},-2,1],[-2,-2,1],[-2,2,1],[{0:.17g},2,1]]", edge),
                      "black", "1, two_sided: true")
                .yaml();
        const Film f = context.render(text, {.samples = 256});
        double lit = 0, dark = 0;
        for (std::uint32_t y = 0; y < 4; ++y)
            for (std::uint32_t x = 0; x < 4; ++x) (x >= 2 ? lit : dark) += radiance(f, x, y) / 8;
        context.absolute(fmt::format("{0} × {0} pixels, the last four columns: the last two, lit", size),
                         lit, 1, 0.05,
                         {{0, "the corner is not where it should be: do pixel numbers overflow?"}});
        context.absolute(fmt::format("{0} × {0} pixels, the last four columns: the two before, dark", size),
                         dark, 0, 0.05);
    }
}

/// Stripes as wide as two pixels across a narrow field of view in an oblique direction: pixels that see the
/// right stripe, as a share of all.
double stripesSeen(Context& context, double fov_degrees, int pixels) {
    // The view axis is (1, 1, 1); image right is (1,1,1) × (0,1,0) normalised.
    const double half = std::tan(fov_degrees / 2 * kDegree), r = 1 / std::sqrt(3.0), q = 1 / std::sqrt(2.0);
    const auto point = [&](double across, double up) {
        // At distance 1 along the axis.
        const double right[3] = {-q, 0, q},
                     upward[3] = {-1 / std::sqrt(6.0), 2 / std::sqrt(6.0), -1 / std::sqrt(6.0)};
        return fmt::format("[{:.17g},{:.17g},{:.17g}]", r + across * right[0] + up * upward[0],
                           r + across * right[1] + up * upward[1], r + across * right[2] + up * upward[2]);
    };
    std::string positions, faces;
    int n = 0;
    for (int pixel = 0; pixel < pixels; pixel += 4) {
        const double from = half * (2.0 * pixel / pixels - 1), to = half * (2.0 * (pixel + 2) / pixels - 1),
                     height = 1;
        for (const std::string& p :
             {point(from, -height), point(to, -height), point(to, height), point(from, height)})
            positions += (positions.empty() ? "" : ",") + p;
        faces += fmt::format("{}[{},{},{},{}]", faces.empty() ? "" : ",", n, n + 1, n + 2, n + 3);
        n += 4;
    }
    // fov goes across the shorter side, which is one pixel.
    const double fov = 2 * std::atan(half / pixels) / kDegree;
    const std::string text =
        Stage(fmt::format("{{position: [0,0,0], target: [1,1,1], fov: {:.17g}}}", fov), "{max_depth: 0}")
            .set("film", fmt::format("{{resolution: [{}, 1]}}", pixels))
            .material("black", "{type: diffuse, reflectance: 0}")
            .mesh("stripes", "[" + positions + "]", "[" + faces + "]", "black", "1, two_sided: true")
            .yaml();
    const Film film = context.render(text, {.samples = 64});
    int right = 0;
    for (int x = 0; x < pixels; ++x)
        right += (radiance(film, static_cast<std::uint32_t>(x), 0) > 0.5) == (x % 4 < 2) ? 1 : 0;
    return static_cast<double>(right) / pixels;
}

void narrowView(Context& context) {
    constexpr int pixels = 256;
    // 256 pixels: at 1e-2° a pixel is 6.8e-7 rad, 11 times the spacing of directions in single precision.
    for (const double fov : {10.0, 1.0, 0.1, 0.01})
        context.relative(fmt::format("{}° over {} pixels: pixels that see the right stripe", fov, pixels),
                         stripesSeen(context, fov, pixels), 1, 0.01);
    const double beyond = stripesSeen(context, 0.001, pixels);
    const int before = warningCount();
    compileScene(context.scene(room("{position: [0.5, 0.5, 0.05], target: [0.5, 0.4, 1], fov: 0.001}",
                                    "{resolution: [256, 256]}")),
                 0);
    context.holds("0.001° over 256 pixels: a warning", warningCount() > before, "warned",
                  "pixels finer than directions in single precision are rendered without a warning",
                  fmt::format("{:.0f} % of the pixels see the right stripe", 100 * beyond));
}

void wideView(Context& context) {
    const Film film = context.render(
        room("{position: [0.5, 0.5, 0.5], target: [0.5, 0.5, 1], fov: 179.9}", "{resolution: [16, 16]}"),
        {.samples = 16});
    context.holds("179.9°", std::isfinite(luminance(film)) && luminance(film) > 0, "finite, not black",
                  "the widest view sees nothing");
    // In the limit the image plane is seen almost edge-on: a wall parallel to it at the same solid angles
    // still looks uniform.
    const std::string sky = Stage("{position: [0,0,0], target: [0,0,1], fov: 179.9}")
                                .set("environment", "{radiance: 1}")
                                .set("film", "{resolution: [16, 16]}")
                                .yaml();
    context.relative("179.9°, environment of 1", radiance(context.render(sky, {.samples = 1024})), 1, 1e-3);
}

void cameraPlaces(Context& context) {
    struct Place {
        const char* what;
        const char* camera;
    };
    for (const Place& p :
         {Place{"on a wall", "{position: [0.5, 0, 0.5], target: [0.5, 1, 0.5], up: [0, 0, 1], fov: 60}"},
          {"on a wall, looking along it", "{position: [0.5, 0, 0.2], target: [0.5, 0, 0.9], fov: 60}"},
          {"in a corner of the room", "{position: [0, 0, 0], target: [1, 1, 1], fov: 60}"},
          {"on an edge", "{position: [0, 0, 0.5], target: [1, 1, 0.5], fov: 60}"},
          {"within glass", "{position: [0.7, 0.2, 0.7], target: [0.5, 0.5, 0], fov: 60}"},
          {"on the glass", "{position: [0.7, 0.4, 0.7], target: [0.5, 0.9, 0.5], up: [0, 0, 1], fov: 60}"},
          {"on the lamp", "{position: [0.5, 1, 0.5], target: [0.5, 0, 0.5], up: [0, 0, 1], fov: 60}"},
          {"outside everything", "{position: [0.5, 0.5, -3], target: [0.5, 0.5, 0], fov: 60}"},
          {"very far away", "{position: [0.5, 0.5, -1e6], target: [0.5, 0.5, 0], fov: 60}"}}) {
        // render() fails the case on samples that are no numbers.
        const Film film = context.render(room(p.camera, "{resolution: [16, 16]}"), {.samples = 16});
        context.holds(fmt::format("{}: every sample is there and finite", p.what),
                      std::isfinite(luminance(film)) && luminance(film) >= 0, "finite",
                      "the eye's place breaks the rays");
    }
}

void nothingThere(Context& context) {
    const auto sky = [](const std::string& camera) {
        return Stage(camera)
            .set("environment", "{radiance: {illuminant: D65}}")
            .set("film", "{resolution: [8, 8]}");
    };
    const std::string ahead = "{position: [0, 0, 0], target: [0, 0, 1], fov: 60}";
    const Film empty = context.render(sky(ahead).yaml(), {.samples = 16});
    Stage behind = sky(ahead);
    behind.material("it", "{type: diffuse, reflectance: 0.5}")
        .quad("it", "[[-1,-1,-1],[1,-1,-1],[1,1,-1],[-1,1,-1]]", "it");
    context.sameBits("everything behind the eye", empty, context.render(behind.yaml(), {.samples = 16}),
                     "what is behind the eye is seen");
    const Film dark =
        context.render(Stage(ahead).set("film", "{resolution: [8, 8]}").yaml(), {.samples = 16});
    context.relative("no objects, no environment", radiance(dark), 0, 0);
}

void crops(Context& context) {
    const Film whole = context.render(room(kInside, "{resolution: [24, 16]}"), {.samples = 8});
    std::uint64_t differing = 0;
    for (const auto& [x0, y0, x1, y1] :
         {std::array{0u, 0u, 7u, 16u}, {7u, 0u, 24u, 5u}, {7u, 5u, 24u, 16u}}) {
        const Film part = context.render(
            room(kInside, fmt::format("{{resolution: [24, 16], crop: [{}, {}, {}, {}]}}", x0, y0, x1, y1)),
            {.samples = 8});
        for (std::uint32_t y = y0; y < y1; ++y)
            for (std::uint32_t x = x0; x < x1; ++x)
                for (std::uint32_t c = 0; c < 3; ++c)
                    differing += static_cast<float>(whole.mean(x, y, c)) ==
                                         static_cast<float>(part.mean(x - x0, y - y0, c))
                                     ? 0
                                     : 1;
    }
    context.relative("values of three crops that are not the whole film's", static_cast<double>(differing),
                     0, 0, {{static_cast<double>(differing), "a crop has its own random numbers, or rays"}});
}

void brightFiles(Context& context) {
    // 1e5 is beyond half precision (65504).
    const Scene scene = context.scene(
        Stage("{position: [0,0,0], target: [0,0,1], fov: 1}").set("environment", "{radiance: 1e5}").yaml());
    const Image image =
        resolveImage(context.render(scene, {.samples = 1024}), developmentOf(scene).forFloats(), 0);
    double largest = 0;
    for (const float v : image.pixels) largest = fartherFrom(0, largest, v);
    context.holds("radiance 1e5 in the image", std::isfinite(largest) && largest > 6.6e4,
                  "above 65504, finite", "values are kept in half precision",
                  fmt::format("{:.6g}; files hold single precision", largest));
}

void developing(Context& context) {
    // A sky of illuminant A, seen. Its XYZ under D65 by Bradford's matrix as published (Lindbloom,
    // "Chromatic Adaptation", A to D65).
    constexpr double kBradford[3][3] = {{0.8446965, -0.1179225, 0.3948108},
                                        {-0.1366303, 1.1041226, 0.1291718},
                                        {0.0798489, -0.1348999, 3.1924009}};
    const auto developed = [&](const char* light, const std::string& film, bool floats) {
        const Scene scene = context.scene(Stage("{position: [0,0,0], target: [0,0,1], fov: 1}")
                                              .set("environment", fmt::format("{{radiance: {}}}", light))
                                              .set("film", fmt::format("{{resolution: [1, 1], {}}}", film))
                                              .yaml());
        const Film seen = context.render(scene, {.samples = 1u << 14});
        const Development development = developmentOf(scene);
        const Image image = resolveImage(seen, floats ? development.forFloats() : development, 0);
        return std::pair(Vec3d{image.pixels[0], image.pixels[1], image.pixels[2]}, meanXyz(seen));
    };
    constexpr const char* kLamp = "{illuminant: A, scale: 0.3}";
    const std::string balanced = "white_balance: {illuminant: A}, exposure_ev: 1.5";
    const double brighter = std::exp2(1.5);
    const Vec3d grey = developed(kLamp, balanced, false).first;
    for (std::size_t k = 0; k < 3; ++k)
        context.relative(fmt::format("A under its own white balance, 1.5 stops brighter: {}", "RGB"[k]),
                         grey[k], 0.3 * brighter, 2e-3,
                         {{0.3, "exposure_ev is left out"}, {0.3 * 1.5, "exposure is a factor, not stops"}});
    // Another colour, in XYZ.
    constexpr const char* kOther = "{rgb: [0.9, 0.4, 0.1], scale: 2}";
    for (const auto& [film, floats, adapts, factor] :
         {std::tuple{balanced, false, true, brighter},
          {balanced, true, false, 1.0},
          {balanced + ", apply_to_float: true", true, true, brighter},
          {std::string("exposure_ev: -3"), false, false, 0.125}}) {
        const auto [measured, xyz] = developed(kOther, film + ", color_space: xyz", floats);
        for (std::size_t k = 0; k < 3; ++k) {
            const double adapted =
                adapts ? kBradford[k][0] * xyz[0] + kBradford[k][1] * xyz[1] + kBradford[k][2] * xyz[2]
                       : xyz[k];
            context.relative(
                fmt::format("{{{}}}, {} file: {}", film, floats ? "in a float" : "in a PNG", "XYZ"[k]),
                measured[k], factor * adapted, adapts ? 2e-3 : 1e-6,
                {{factor * xyz[k], "the white is not adapted"}, {adapted, "exposure is left out"}});
        }
    }
}

}  // namespace

std::vector<Case> imageCases() {
    constexpr std::uint64_t rooms = CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE |
                                    CRT_FEATURE_CONDUCTOR | CRT_FEATURE_DIELECTRIC;
    return {
        row("J01", "film-sizes",
            "Films of 1 × 1, 1 × 64, 64 × 1; corners of 16384² and 46340² pixels", "every pixel",
            "2^31 pixels; docs/scene.md", "exactly; ± 0.05", Level::Commit, rooms, sizes),
        row("J02", "narrow-view", "256 pixels of stripes over 10° to 0.01°; 0.001°",
            "each pixel its stripe; below, a warning", "directions in single precision are 6e-8 apart",
            "1 % of the pixels", Level::Commit, CRT_FEATURE_AREA_LIGHT, narrowView),
        row("J03", "wide-view", "A field of view of 179.9°", "finite, the environment's 1",
            "docs/scene.md", "1e-3", Level::Commit, rooms | CRT_FEATURE_ENVIRONMENT, wideView),
        row("J05", "camera-places",
            "The eye on a wall, in a corner, on an edge, in glass, on glass, on the lamp, outside, far away",
            "finite values", "–", "finite", Level::Commit, rooms, cameraPlaces),
        row("J06", "nothing-there", "An empty scene, and one behind the eye", "the background", "–",
            "same bits", Level::Commit, CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_DIFFUSE, nothingThere),
        row("J07", "crops", "Three crops that tile the film", "the film", "–", "same bits", Level::Commit,
            rooms, crops),
        row("J08", "bright-files", "Radiance 1e5, beyond half precision", "kept", "mitsuba3 #35", "finite",
            Level::Commit, CRT_FEATURE_ENVIRONMENT, brightFiles),
        row("J12", "developing",
            "Illuminant A and another colour under A's white balance, 1.5 stops brighter and 3 darker, as "
            "PNG and as files of floats with and without apply_to_float",
            "A becomes grey; Bradford's matrix; 2^EV; files of floats stay as they are",
            "Lindbloom's published matrix from A to D65", "2e-3; 1e-6 without a white balance",
            Level::Commit, CRT_FEATURE_ENVIRONMENT, developing),
    };
}

}  // namespace crt::verify
