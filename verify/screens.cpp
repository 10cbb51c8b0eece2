// Group G, the part about emission that is an image.
#include "base/temporary_folder.h"
#include "verify/context.h"
#include "verify/scenes.h"
#include "verify/shapes.h"

#include "image/image_io.h"
#include "kernel/dialect/features.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

namespace crt::verify {
namespace {

constexpr Effort kScreenEffort{.samples = 256, .most = 65536};
constexpr double kRadiance = 3;

/// Greys, the top row first.
struct Picture {
    int side = 0;
    bool nearest = false;
    std::vector<double> greys;

    double at(int x, int y) const {
        const auto held = [&](int i) { return static_cast<std::size_t>(std::clamp(i, 0, side - 1)); };
        return greys[held(y) * static_cast<std::size_t>(side) + held(x)];
    }
    /// Bilinear between the middles of texels, or the texel itself; v up.
    double value(double u, double v) const {
        const double x = u * side, y = (1 - v) * side;
        if (nearest) return at(static_cast<int>(x), static_cast<int>(y));
        const int left = static_cast<int>(std::floor(x - 0.5)), top = static_cast<int>(std::floor(y - 0.5));
        const double fx = x - 0.5 - left, fy = y - 0.5 - top;
        return std::lerp(std::lerp(at(left, top), at(left + 1, top), fx),
                         std::lerp(at(left, top + 1), at(left + 1, top + 1), fx), fy);
    }
    std::string write(const TemporaryFolder& folder, const char* name) const {
        std::string path = folder.path() + "/" + name;
        std::vector<float> rgb;
        for (const double grey : greys) rgb.insert(rgb.end(), 3, static_cast<float>(grey));
        writeRgb(path, OutputFormat::Pfm, static_cast<std::uint32_t>(side), static_cast<std::uint32_t>(side),
                 rgb);
        return path;
    }
};

/// A screen of side 1 at height 1 that shines down: u along x, v along z.
std::string screen(const std::string& color) {
    return fmt::format(
        "mesh: {{positions: [[-0.5,1,-0.5],[0.5,1,-0.5],[0.5,1,0.5],[-0.5,1,0.5]], uvs: "
        "[[0,0],[1,0],[1,1],[0,1]], faces: [[0,1,2,3]]}}, material: black, emission: "
        "{{radiance: {}, color: {}}}",
        kRadiance, color);
}

/// The floor of reflectance 1 at (x, 0, z) under such a lamp.
Stage floorUnder(double x, double z, const char* integrator) {
    Stage stage(
        fmt::format("{{position: [{0}, 0.1, {1}], target: [{0}, 0, {1}], up: [0, 0, 1], fov: 0.001}}", x, z),
        integrator);
    stage.material("white", "{type: diffuse, reflectance: 1}")
        .material("black", "{type: diffuse, reflectance: 0}")
        .quad("floor", "[[-9,0,-9],[-9,0,9],[9,0,9],[9,0,-9]]", "white");
    return stage;
}

/// The radiance of the floor there: midpoint rule over the screen.
double underScreen(const Picture& picture, double x, double z) {
    constexpr int kSteps = 1024;
    double sum = 0;
    for (int i = 0; i < kSteps; ++i)
        for (int j = 0; j < kSteps; ++j) {
            const double u = (i + 0.5) / kSteps, v = (j + 0.5) / kSteps;
            const double dx = u - 0.5 - x, dz = v - 0.5 - z;
            const double square = dx * dx + dz * dz + 1;
            sum += picture.value(u, v) / (square * square);
        }
    return kRadiance * sum / (double{kSteps} * kSteps) / std::numbers::pi;
}

Picture noise() {
    Picture picture{5, false, {}};
    Dice dice(4711);
    for (int i = 0; i < 25; ++i) picture.greys.push_back(i % 6 == 0 ? 0.0 : dice.uniform());
    return picture;
}

/// Black but for one texel.
Picture star() {
    Picture picture{64, true, std::vector<double>(64 * 64)};
    picture.greys[20 * 64 + 41] = 1;
    return picture;
}

void screens(Context& context) {
    const TemporaryFolder folder;
    for (const auto& [name, picture] : {std::pair{"noise", noise()}, {"a star", star()}}) {
        const std::string color =
            fmt::format("{{texture: {}, wrap: clamp{}}}",
                        picture.write(folder, picture.nearest ? "star.pfm" : "noise.pfm"),
                        picture.nearest ? ", filter: nearest" : "");
        double mean = 0;
        for (const double grey : picture.greys) mean += grey / static_cast<double>(picture.greys.size());
        for (const auto& [x, z] : {std::pair{0.2, -0.1}, {-0.7, 0.4}}) {
            if (x < 0 && !context.atLeast(Level::Merge)) break;
            const double expected = underScreen(picture, x, z);
            for (const auto& [technique, integrator] : kDirectTechniques) {
                // Scattered rays alone would need millions of samples for one texel.
                if (picture.nearest && std::string(technique) == "scattered rays") continue;
                context.estimate(fmt::format("a floor under {}, at ({}, {}), {}", name, x, z, technique),
                                 floorUnder(x, z, integrator).object(screen(color)).yaml(), meanRadiance,
                                 expected, 3e-3, kScreenEffort,
                                 {{expected * mean, "the image counts twice, once as its mean"}});
            }
        }
        // Seen itself, at the middles of texels.
        const int texel = picture.nearest ? 41 : 3, row = picture.nearest ? 20 : 1;
        const double u = (texel + 0.5) / picture.side, v = 1 - (row + 0.5) / picture.side;
        Stage stage(
            fmt::format("{{position: [{0:.9g}, 0, {1:.9g}], target: [{0:.9g}, 1, {1:.9g}], up: "
                        "[0, 0, 1], fov: 0.0001}}",
                        u - 0.5, v - 0.5));
        stage.material("black", "{type: diffuse, reflectance: 0}").object(screen(color));
        context.relative(fmt::format("a texel of {}", name),
                         radiance(context.render(stage.yaml(), {.samples = 16})),
                         kRadiance * picture.at(texel, row), 1e-3);
    }
    // One bright texel is found: of paths that do not look for it, one in thousands meets it.
    const std::string color =
        fmt::format("{{texture: {}, wrap: clamp, filter: nearest}}", star().write(folder, "star2.pfm"));
    const Film film = context.render(
        floorUnder(0.2, -0.1, kDirect).set("sampler", "{type: independent}").object(screen(color)).yaml(),
        {.samples = 16384, .squares = true});
    const double spread = pathVariance(film) / std::pow(luminance(film), 2);
    context.holds("the variance of a path's light from a star, over its mean squared", spread < 20, "< 20",
                  "tiles are chosen without looking at their texels: some 4,000",
                  fmt::format("{:.3g}", spread));
}

}  // namespace

std::vector<Case> screenCases() {
    return {row("G48", "screens",
                "A floor under a screen that shows noise, and one bright texel of 4,096, by MIS and by each "
                "technique alone, from level merge on also from the side; texels seen themselves; the "
                "variance of a path under the one bright texel",
                "the irradiance of the picture, by the midpoint rule with 1,024² points; texels; 20 times "
                "the mean squared",
                "quadrature", "± 0.3 %, ± 0.1 %; 20", Level::Commit,
                CRT_FEATURE_EMISSION_IMAGE | CRT_FEATURE_FACTOR | CRT_FEATURE_TEXTURE |
                    CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE | CRT_FEATURE_DIFFUSE | CRT_FEATURE_LIGHT_TREE |
                    CRT_FEATURE_TABLE,
                screens)};
}

}  // namespace crt::verify
