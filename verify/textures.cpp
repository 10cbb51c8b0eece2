// Group H, the part about values that depend on the place: the radiance of a textured surface in constant
// light is the reflectance at that place.
#include "base/temporary_folder.h"
#include "film/resolve.h"
#include "image/image_io.h"
#include "image/open_module.h"
#include "kernel/dialect/features.h"
#include "scene/aov.h"
#include "verify/context.h"
#include "verify/scenes.h"
#include "verify/shapes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace crt::verify {
namespace {

/// A square with (u, v) = ((x + 1) / 2, (z + 1) / 2), seen from above at (u, v).
std::string squareSeenAt(double u, double v, const std::string& reflectance, const std::string& radiance,
                         const std::string& attributes = "uvs: [[0,0],[0,1],[1,1],[1,0]]") {
    const double x = 2 * u - 1, z = 2 * v - 1;
    return fmt::format(
        "crt: 1\ncamera: {{position: [{0:.9g}, 1, {1:.9g}], target: [{0:.9g}, 0, {1:.9g}], up: [0, 0, 1], "
        "fov: 0.0005}}\nfilm: {{resolution: [4, 4]}}\nintegrator: {2}\nenvironment: {{radiance: {3}}}\n"
        "materials: {{it: {{type: diffuse, reflectance: {4}}}}}\nobjects:\n  - {{mesh: {{positions: "
        "[[-1,0,-1],[-1,0,1],[1,0,1],[1,0,-1]], {5}, faces: [[0,1,2,3]]}}, material: it}}\n",
        x, z, kDirect, radiance, reflectance, attributes);
}

/// Greys, the top row first.
struct Greys {
    std::int64_t width, height;
    std::vector<double> values;

    double at(std::int64_t x, std::int64_t y) const {
        return values[static_cast<std::size_t>(y * width + x)];
    }
};

enum class Wrap { Repeat, Mirror, Clamp };

/// The image as it goes on for ever, one texel after the other.
double beyond(const Greys& image, std::int64_t x, std::int64_t y, Wrap wrap) {
    const auto fold = [wrap](std::int64_t i, std::int64_t n) {
        if (wrap == Wrap::Clamp) return std::clamp<std::int64_t>(i, 0, n - 1);
        const std::int64_t period = wrap == Wrap::Repeat ? n : 2 * n;
        const std::int64_t r = ((i % period) + period) % period;
        return r < n ? r : 2 * n - 1 - r;
    };
    return image.at(fold(x, image.width), fold(y, image.height));
}

/// Between the centres of texels, in double. `v` up.
double bilinear(const Greys& image, double u, double v, Wrap wrap) {
    const double x = u * static_cast<double>(image.width) - 0.5,
                 y = (1 - v) * static_cast<double>(image.height) - 0.5;
    const auto left = static_cast<std::int64_t>(std::floor(x)),
               top = static_cast<std::int64_t>(std::floor(y));
    const double fx = x - std::floor(x), fy = y - std::floor(y);
    return (1 - fy) * ((1 - fx) * beyond(image, left, top, wrap) + fx * beyond(image, left + 1, top, wrap)) +
           fy *
               ((1 - fx) * beyond(image, left, top + 1, wrap) + fx * beyond(image, left + 1, top + 1, wrap));
}

/// Against a white square, whose paths have the same wavelengths.
double seen(Context& context, const std::string& yaml) {
    const Render how{.samples = 16};
    return radiance(context.render(yaml, how)) /
           radiance(context.render(squareSeenAt(0.5, 0.5, "1", "1"), how));
}

void textureLookUps(Context& context) {
    const TemporaryFolder folder;
    const std::string path = folder.path() + "/greys.pfm";
    Dice dice(20);
    Greys image{5, 3, {}};
    std::vector<float> rgb;
    for (int i = 0; i < 15; ++i) {
        const auto value = static_cast<float>(dice.uniform(0.05, 0.95));
        image.values.push_back(double{value});
        rgb.insert(rgb.end(), 3, value);
    }
    writeRgb(path, OutputFormat::Pfm, 5, 3, rgb);

    const std::pair<Wrap, const char*> wraps[] = {
        {Wrap::Repeat, "repeat"}, {Wrap::Mirror, "mirror"}, {Wrap::Clamp, "clamp"}};
    for (const auto& [wrap, word] : wraps)
        for (int i = 0; i < 6; ++i) {
            const double u = dice.uniform(0.02, 0.98), v = dice.uniform(0.02, 0.98);
            // Scaled, turned and moved, far enough for every side of the image to be met.
            const double scale_u = dice.uniform(-3, 3), scale_v = dice.uniform(-3, 3),
                         angle = dice.uniform(-180, 180) * (std::acos(-1.0) / 180),
                         move_u = dice.uniform(-1, 1), move_v = dice.uniform(-1, 1);
            const double s = scale_u * u, t = scale_v * v;
            const double at_u = std::cos(angle) * s - std::sin(angle) * t + move_u,
                         at_v = std::sin(angle) * s + std::cos(angle) * t + move_v;
            const std::string value = fmt::format(
                "{{texture: '{}', wrap: {}, scale: [{:.17g}, {:.17g}], rotation_deg: {:.17g}, offset: "
                "[{:.17g}, {:.17g}]}}",
                path, word, scale_u, scale_v, angle * 180 / std::acos(-1.0), move_u, move_v);
            context.absolute(fmt::format("{}, at ({:.3f}, {:.3f}) of the image", word, at_u, at_v),
                             seen(context, squareSeenAt(u, v, value, "1")),
                             bilinear(image, at_u, at_v, wrap), 1e-4,
                             {{bilinear(image, at_u, 1 - at_v, wrap), "the image stands on its head"},
                              {bilinear(image, at_u + 0.1, at_v - 1.0 / 6, wrap),
                               "texels have their centres at whole numbers"}});
        }
    for (int i = 0; i < 4; ++i) {
        const double u = dice.uniform(0.02, 0.98), v = dice.uniform(0.02, 0.98);
        const double nearest =
            image.at(static_cast<std::int64_t>(u * 5), static_cast<std::int64_t>((1 - v) * 3));
        context.absolute(
            fmt::format("nearest, at ({:.3f}, {:.3f})", u, v),
            seen(context, squareSeenAt(u, v, fmt::format("{{texture: '{}', filter: nearest}}", path), "1")),
            nearest, 1e-4);
        // Squares of an eighth, from (-1/16, 0) on.
        const bool even = static_cast<int>(std::floor(8 * u + 0.5) + std::floor(8 * v)) % 2 == 0;
        context.absolute(
            fmt::format("checker, at ({:.3f}, {:.3f})", u, v),
            seen(context, squareSeenAt(u, v, "{checker: [0.75, 0.25], scale: 8, offset: [0.5, 0]}", "1")),
            even ? 0.75 : 0.25, 1e-6);
        // Triangles (0, 1, 2) and (0, 2, 3): above the diagonal u = v and below it.
        const double expected =
            v > u ? 0.2 * (1 - v) + 0.4 * (v - u) + 0.8 * u : 0.2 * (1 - u) + 0.6 * (u - v) + 0.8 * v;
        context.absolute(fmt::format("colours of vertices, at ({:.3f}, {:.3f})", u, v),
                         seen(context, squareSeenAt(u, v, "{attribute: colors}", "1",
                                                    "colors: [[0.2,0.2,0.2],[0.4,0.4,0.4],[0.8,0.8,0.8],"
                                                    "[0.6,0.6,0.6]], color_space: linear")),
                         expected, 1e-4);
    }
}

void textureColours(Context& context) {
    // Codes of an image, and their colours under D65.
    const TemporaryFolder folder;
    const std::string path = folder.path() + "/codes.png";
    try {
        (void)imageModule(ModuleFormat::Plain, path, ErrorKind::Output);
    } catch (const Error& error) {  // An archive for machines on which nothing can be installed has none.
        context.notApplicable("texels of 8 bits", error.what());
        return;
    }
    const std::array<std::array<int, 3>, 6> codes{
        {{255, 0, 0}, {12, 200, 40}, {30, 60, 250}, {250, 240, 230}, {128, 128, 128}, {90, 45, 20}}};
    std::vector<float> linear;
    for (const auto& texel : codes)
        for (const int code : texel) linear.push_back(static_cast<float>(srgbToLinear(code / 255.0)));
    writeRgb(path, OutputFormat::Png, 3, 2, linear);
    for (int i = 0; i < 6; ++i) {
        const double u = (i % 3 + 0.5) / 3, v = i < 3 ? 0.75 : 0.25;
        const Scene scene = context.scene(
            squareSeenAt(u, v, fmt::format("{{texture: '{}', wrap: clamp}}", path), "{illuminant: D65}"));
        const Film film = context.render(scene, samples(1u << 15, kAovAlbedo));
        const Image image = resolveImage(film, developmentOf(scene).forFloats(), kAovAlbedo);
        const auto mean = [&](const std::string& name) {
            const auto found = std::find(image.channels.begin(), image.channels.end(), name);
            double sum = 0;
            for (auto c = static_cast<std::size_t>(found - image.channels.begin()); c < image.pixels.size();
                 c += image.channels.size())
                sum += image.pixels[c];
            return sum / (static_cast<double>(image.width) * image.height);
        };
        for (std::size_t k = 0; k < 3; ++k) {
            const double code = codes[static_cast<std::size_t>(i)][k] / 255.0;
            const double expected = code <= 0.04045 ? code / 12.92 : std::pow((code + 0.055) / 1.055, 2.4);
            const std::string name(1, "RGB"[k]);
            context.absolute(fmt::format("texel {}: {} in the image", i, name), mean(name), expected, 4e-3,
                             {{code, "codes are taken for linear numbers"}});
            // The albedo is what equal energy makes of it: the same for a grey alone.
            if (codes[static_cast<std::size_t>(i)] == std::array<int, 3>{128, 128, 128})
                context.absolute(fmt::format("texel {}: {} of the albedo", i, name), mean("Albedo." + name),
                                 expected, 1e-3);
        }
    }
}

}  // namespace

std::vector<Case> textureCases() {
    constexpr std::uint64_t needs = CRT_FEATURE_DIFFUSE | CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_TEXTURE;
    return {
        row("H12", "textures",
            "Images of greys, wrapped three ways, scaled, turned and moved; nearest texels; checkers; "
            "colours "
            "of vertices, in constant light",
            "the reflectance at the place", "bilinear weights in double arithmetic", "± 1e-4",
            Level::Commit, needs, textureLookUps),
        row("H13", "texture-colours", "Texels of 8 bits under D65, in the image and in the albedo",
            "their linear sRGB", "IEC 61966-2-1", "± 4e-3", Level::Commit, needs | CRT_FEATURE_AOV,
            textureColours),
    };
}

}  // namespace crt::verify
