#include "judge/converge/report_maps.h"

#include "base/error.h"
#include "base/log.h"
#include "base/unit_text.h"
#include "image/image_io.h"
#include "judge/converge/findings.h"
#include "judge/converge/quantity_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <span>

namespace crt::converge {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kLongestSide = 384;
constexpr double kDecades = 3;  ///< Of the error maps' scale.
/// Beyond it the colour stays. Rare when all is well, but not as rare as with a normal z: the standard error
/// of a pixel is pooled from its surroundings, which may be quieter than it is.
constexpr double kLargestZ = 4;

using Rgb = std::array<std::uint8_t, 3>;

// Magma, nine steps of it (van der Walt and Smith 2015, CC0): even steps of lightness, readable in grey and
// for the colour-blind.
constexpr std::array<Rgb, 9> kMagma{{{0x00, 0x00, 0x04},
                                     {0x1d, 0x11, 0x47},
                                     {0x51, 0x12, 0x7c},
                                     {0x82, 0x26, 0x81},
                                     {0xb6, 0x36, 0x79},
                                     {0xe6, 0x51, 0x64},
                                     {0xfb, 0x88, 0x61},
                                     {0xfe, 0xc2, 0x87},
                                     {0xfc, 0xfd, 0xbf}}};
// Too dark in blue, right in white, too bright in vermillion: Okabe and Ito's pair.
constexpr std::array<Rgb, 3> kDiverging{{{0x00, 0x72, 0xb2}, {0xf7, 0xf7, 0xf7}, {0xd5, 0x5e, 0x00}}};
constexpr Rgb kNotFinite{0xff, 0x00, 0xff};

Rgb colourAt(std::span<const Rgb> anchors, double position) {
    if (std::isnan(position)) return kNotFinite;
    const double at = std::clamp(position, 0.0, 1.0) * static_cast<double>(anchors.size() - 1);
    const auto left = std::min(static_cast<std::size_t>(at), anchors.size() - 2);
    Rgb colour{};
    for (std::size_t c = 0; c < 3; ++c)
        colour[c] = static_cast<std::uint8_t>(
            std::lround(anchors[left][c] +
                        (at - static_cast<double>(left)) * (anchors[left + 1][c] - anchors[left][c])));
    return colour;
}

std::vector<std::string> hexColours(std::span<const Rgb> anchors) {
    std::vector<std::string> colours;
    for (const Rgb& c : anchors) colours.push_back(fmt::format("#{:02x}{:02x}{:02x}", c[0], c[1], c[2]));
    return colours;
}

/// The value that the writer of PNG encodes to this byte (IEC 61966-2-1).
float linearOfSrgb8(std::uint8_t byte) {
    const double s = byte / 255.0;
    return static_cast<float>(s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4));
}

std::uint32_t reductionOf(std::uint32_t width, std::uint32_t height) {
    return (std::max(width, height) + kLongestSide - 1) / kLongestSide;
}

/// Blocks of pixels become one; `pool` gets their values.
Plane reduce(const Plane& plane, const std::function<float(std::span<const float>)>& pool) {
    const std::uint32_t factor = reductionOf(plane.width, plane.height);
    if (factor <= 1) return plane;
    Plane small{(plane.width + factor - 1) / factor, (plane.height + factor - 1) / factor, {}};
    std::vector<float> block;
    for (std::uint32_t y = 0; y < plane.height; y += factor)
        for (std::uint32_t x = 0; x < plane.width; x += factor) {
            block.clear();
            for (std::uint32_t v = y; v < std::min(y + factor, plane.height); ++v)
                for (std::uint32_t u = x; u < std::min(x + factor, plane.width); ++u)
                    block.push_back(plane.values[std::size_t{v} * plane.width + u]);
            small.values.push_back(pool(block));
        }
    return small;
}

float meanOf(std::span<const float> block) {
    double sum = 0;
    for (const float value : block) sum += value;
    return static_cast<float>(sum / static_cast<double>(block.size()));
}

float rootMeanSquareOf(std::span<const float> block) {
    double sum = 0;
    for (const float value : block) sum += double{value} * value;
    return static_cast<float>(std::sqrt(sum / static_cast<double>(block.size())));
}

float largestOf(std::span<const float> block) {
    return *std::max_element(block.begin(), block.end(),
                             [](float a, float b) { return std::abs(a) < std::abs(b); });
}

Image emptyRgb(std::uint32_t width, std::uint32_t height) {
    Image image;
    image.width = width;
    image.height = height;
    image.channels = {"R", "G", "B"};
    image.pixels.reserve(std::size_t{3} * width * height);
    return image;
}

Image coloured(const Plane& plane, const std::function<Rgb(double)>& colour) {
    Image image = emptyRgb(plane.width, plane.height);
    for (const float value : plane.values)
        for (const std::uint8_t byte : colour(value)) image.pixels.push_back(linearOfSrgb8(byte));
    return image;
}

/// R, G and B of the image, reduced.
Image reducedImage(const Image& image) {
    std::array<Plane, 3> planes;
    for (std::size_t c = 0; c < 3; ++c) {
        const std::string name(1, "RGB"[c]);
        const auto found = std::find(image.channels.begin(), image.channels.end(), name);
        if (found == image.channels.end())
            throw Error(ErrorKind::Internal, "a map's image has no channel " + name);
        planes[c] = {image.width, image.height, {}};
        for (auto i = static_cast<std::size_t>(found - image.channels.begin()); i < image.pixels.size();
             i += image.channels.size())
            planes[c].values.push_back(image.pixels[i]);
        planes[c] = reduce(planes[c], meanOf);
    }
    Image small = emptyRgb(planes[0].width, planes[0].height);
    small.metadata = image.metadata;  // With the colour space.
    small.chromaticities = image.chromaticities;
    for (std::size_t i = 0; i < planes[0].values.size(); ++i)
        for (const Plane& plane : planes)
            small.pixels.push_back(std::clamp(plane.values[i], 0.0f, 1.0f));  // The range of 8 bits.
    return small;
}

Picture writePicture(const std::string& folder, const std::string& file, const std::string& title,
                     const Image& image) {
    writeImage((fs::path(folder) / file).string(), OutputFormat::Png, image);
    return {file, title, image.width, image.height};
}

/// The upper end of the error maps' scale: 99.5 % of all pixels of the scene lie below, rounded up to 1, 2
/// or 5.
double topOfErrors(const std::vector<const Maps*>& maps) {
    std::vector<float> values;
    for (const Maps* map : maps)
        for (const Plane* plane : {&map->error, &map->standard_error})
            for (const float value : plane->values)
                if (std::isfinite(value)) values.push_back(value);
    if (values.empty()) return 1;
    const auto at =
        values.begin() + static_cast<std::ptrdiff_t>(0.995 * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    const double top = std::max(double{*at}, 1e-12), decade = std::pow(10.0, std::floor(std::log10(top)));
    for (const double digit : {1.0, 2.0, 5.0})
        if (top <= digit * decade) return digit * decade;
    return 10 * decade;
}

MapSet mapsOfScene(const std::string& folder, const Run& run, const std::string& scene) {
    std::vector<const Maps*> all;
    for (const Configuration& configuration : run.configurations)
        if (configuration.key.scene == scene) all.push_back(&configuration.maps);
    const double top = topOfErrors(all);
    const auto error_colour = [&](double value) {
        return colourAt(kMagma, 1 + std::log10(value / top) / kDecades);
    };
    const auto z_colour = [](double value) { return colourAt(kDiverging, 0.5 + value / (2 * kLargestZ)); };
    const auto flip_colour = [](double value) { return colourAt(kMagma, value); };

    MapSet set;
    set.scene = scene;
    bool z = false, flip = false, errors = false;
    std::size_t number = 0;
    for (const Configuration& configuration : run.configurations) {
        if (configuration.key.scene != scene) continue;
        const Maps& maps = configuration.maps;
        MapSet::OfConfiguration of{configuration.key, maps.samples, {}};
        const std::string stem = fmt::format("map-{}-{}", slug(scene), ++number);
        const auto add = [&](const char* what, const char* title, const Image& image) {
            of.pictures.push_back(writePicture(folder, fmt::format("{}-{}.png", stem, what), title, image));
        };
        if (!maps.image.pixels.empty()) add("image", "image", reducedImage(maps.image));
        if (!maps.error.empty())
            add("error", "error", coloured(reduce(maps.error, rootMeanSquareOf), error_colour));
        if (!maps.standard_error.empty())
            add("standard-error", "standard error",
                coloured(reduce(maps.standard_error, rootMeanSquareOf), error_colour));
        if (!maps.z.empty()) add("z", "z", coloured(reduce(maps.z, largestOf), z_colour));
        if (!maps.flip.empty()) add("flip", "FLIP", coloured(reduce(maps.flip, meanOf), flip_colour));
        errors = errors || !maps.error.empty() || !maps.standard_error.empty();
        z = z || !maps.z.empty();
        flip = flip || !maps.flip.empty();
        if (!of.pictures.empty()) set.configurations.push_back(std::move(of));
    }
    if (errors)
        set.keys.push_back({"error and standard error, relative to the image mean, logarithmic",
                            percentText(top / std::pow(10.0, kDecades), 1), percentText(top, 1),
                            hexColours(kMagma)});
    if (z)
        set.keys.push_back({"z = error / standard error", fmt::format("−{} too dark", kLargestZ),
                            fmt::format("+{} too bright", kLargestZ), hexColours(kDiverging)});
    if (flip)
        set.keys.push_back({"FLIP, the perceived difference", "0 none", "1 largest", hexColours(kMagma)});
    return set;
}

}  // namespace

std::string slug(const std::string& name) {
    std::string text;
    for (const char c : name) {
        const bool plain = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
        if (plain)
            text += c;
        else if (!text.empty() && text.back() != '-')
            text += '-';
    }
    while (!text.empty() && text.back() == '-') text.pop_back();
    return text.empty() ? "unnamed" : text;
}

std::vector<MapSet> writeMaps(const std::string& folder, const Run& run) {
    std::vector<MapSet> sets;
    for (const std::string& scene : scenesOf(run)) {
        try {
            sets.push_back(mapsOfScene(folder, run, scene));
        } catch (const Error& error) {
            logWarning("there are no maps of '{}': {}", scene, error.what());
            sets.push_back({scene, {}, {}, error.what()});
        }
    }
    return sets;
}

}  // namespace crt::converge
