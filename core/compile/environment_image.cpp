#include "compile/environment_image.h"

#include "base/error.h"
#include "base/log.h"
#include "base/parallel.h"
#include "compile/distributions.h"
#include "compile/sky_texels.h"
#include "image/texels.h"
#include "scene/scene_limits.h"
#include "spectra/sigmoid.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <system_error>

namespace crt {
namespace {

[[noreturn]] void refuse(const SourcePlace& place, const std::string& sentence) {
    throw Error(ErrorKind::Scene, fmt::format("{}: error: {}", place.text(), sentence), place);
}

/// Solid angle of a texel of a row, per radian of its width: cos at its upper edge less that at its lower
/// one, without cancellation at the poles.
double heightOf(std::size_t row, std::size_t rows) {
    const double step = std::numbers::pi / static_cast<double>(rows);
    return 2 * std::sin((static_cast<double>(row) + 0.5) * step) * std::sin(step / 2);
}

/// X + Y + Z of linear sRGB: columns of IEC 61966-2-1 added up.
double brightnessOf(const float* rgb) {
    return 0.64441441 * rgb[0] + 1.19191779 * rgb[1] + 1.20318306 * rgb[2];
}

void checkShape(const EnvironmentImage& image, const TexelsInfo& info) {
    if (info.width == 2 * info.height) return;
    refuse(image.place,
           fmt::format("'{}' has {} x {} pixels; an image of the surroundings is twice as wide as high, "
                       "longitudes by latitudes",
                       image.file, info.width, info.height));
}

/// The first texel that cannot be light, in words; empty when all can.
std::string fault(const std::vector<float>& rgb, std::uint32_t width, double scale) {
    for (std::size_t i = 0; i < rgb.size(); ++i) {
        const double value = rgb[i] * scale;
        if (value >= 0 && value <= kMostRadiance) continue;
        const std::size_t texel = i / 3;
        return fmt::format("is {} in pixel ({}, {}), from the top left; {}", rgb[i], texel % width,
                           texel / width,
                           std::isnan(rgb[i])   ? "light is a number"
                           : std::isinf(rgb[i]) ? "light is finite"
                           : rgb[i] < 0         ? "light is not negative"
                                                : fmt::format("radiance goes up to {:g}", kMostRadiance));
    }
    return {};
}

/// A small file may hold a large image: what it becomes is counted before it is read.
void checkSize(const EnvironmentImage& image, const TexelsInfo& info) {
    constexpr std::uint64_t kBytesPerPixel = 56;  // While it is made, at the peak.
    std::error_code unknown;
    const std::uint64_t bytes = std::filesystem::file_size(image.file, unknown);
    const std::string why =
        ExpansionLimit(unknown ? 0 : bytes)
            .refusal(std::uint64_t{info.width} * info.height, "pixels of an environment", kBytesPerPixel);
    if (!why.empty()) refuse(image.place, fmt::format("'{}': {}", image.file, why));
}

/// The result of `read`. Its errors get the place of the image in the scene.
template <class Read>
auto readAt(const SourcePlace& place, const Read& read) {
    try {
        return read();
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::Scene || error.place().line > 0) throw;
        refuse(place, error.what());
    }
}

/// Codes of 8 and 16 bits end at the white of a screen, and the sun is brighter by factors of ten thousands.
void warnOfCodes(const EnvironmentImage& image, const TexelsInfo& info) {
    if (info.type == TexelType::Float) return;
    logWarning("{}: '{}' has {} bits per colour, which cannot hold values above white such as the sun or "
               "lamps: shadows will be faint; use an EXR, HDR or PFM file",
               image.place.text(), image.file, info.type == TexelType::Uint8 ? 8 : 16);
}

EnvironmentTexels texelsOf(const EnvironmentImage& image) {
    EnvironmentTexels out;
    const TexelsInfo info = readAt(image.place, [&] { return texelsInfo(image.file); });
    checkShape(image, info);
    checkSize(image, info);
    warnOfCodes(image, info);
    for (const std::string& sentence : sentencesOf(info.tags, image.file, PixelUse::EncodedColors))
        logWarning("{}", sentence);
    out.width = info.width;
    out.height = info.height;
    const std::vector<float> rgb = readAt(image.place, [&] {
        return linearRgb(readTexels(image.file), TexelColor::Auto, image.file);
    });
    if (const std::string wrong = fault(rgb, out.width, image.scale); !wrong.empty())
        refuse(image.place, fmt::format("'{}' {}", image.file, wrong));
    const std::size_t count = std::size_t{out.width} * out.height;
    out.texels.resize(count);
    out.brightness.resize(count);
    sigmoidCoefficients({0.5f, 0.25f, 0.5f});  // makes the table, once
    parallelFor(count, std::size_t{1} << 14, [&](std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i) {
            const float* color = rgb.data() + 3 * i;
            const float largest = std::max({color[0], color[1], color[2]});
            if (!(largest > 0)) continue;
            // As rgbEmission: half of the range, where the sigmoid is smoothest.
            const float by = 0.5f / largest;
            const SigmoidCoefficients c = sigmoidCoefficients({color[0] * by, color[1] * by, color[2] * by});
            out.texels[i] = {c[0], c[1], c[2], static_cast<float>(2.0 * largest * image.scale)};
            out.brightness[i] = static_cast<float>(brightnessOf(color) * image.scale);
        }
    });
    return out;
}

/// Shares of 2³² by which items are chosen: where each begins.
template <class Weights>
void choose(const Weights& weights, std::span<kernel::u32> first) {
    const std::vector<std::uint64_t> boundaries = choiceTable(weights);
    for (std::size_t i = 0; i < first.size(); ++i) first[i] = static_cast<kernel::u32>(boundaries[i]);
}

/// Bits of a 32-bit number that a guide to `count` items drops: it has a part for 16 to 31 of them. With one
/// for each item, guides fill caches: `sun` of bench/scenes/race is 1.1 times slower. At most 31, so that a
/// kernel may shift by it.
kernel::u32 guideShift(std::size_t count) {
    return std::min(31u, 37u - static_cast<kernel::u32>(std::bit_width(count)));
}

std::size_t guideSize(kernel::u32 shift) { return (std::size_t{0xFFFFFFFFu} >> shift) + 2; }

/// The item that each multiple of 2^shift chooses, and the last.
void fillGuide(std::span<const kernel::u32> first, kernel::u32 shift, std::span<kernel::u32> guide) {
    const auto last = static_cast<kernel::u32>(first.size() - 1);
    kernel::u32 item = 0;
    for (std::size_t part = 0; part + 1 < guide.size(); ++part) {
        while (item < last && first[item + 1] <= part << shift) ++item;
        guide[part] = item;
    }
    guide.back() = last;
}

}  // namespace

EnvironmentTexels environmentTexels(const Environment& environment) {
    EnvironmentTexels out = environment.image ? texelsOf(*environment.image)
                            : environment.sky
                                ? skyTexels(*environment.sky, environment.radiance)
                                : skyTexels(environment.clear_sky.value(), environment.radiance);
    double sum = 0;
    for (std::size_t row = 0; row < out.height; ++row) {
        double of_row = 0;
        for (std::size_t i = row * out.width; i < (row + 1) * out.width; ++i) of_row += out.brightness[i];
        sum += of_row / out.width * heightOf(row, out.height) / 2;
    }
    out.mean_brightness = sum;
    return out;
}

kernel::CrtSpan appendEnvironmentImage(BlobWriter& blob, const Environment& environment,
                                       const EnvironmentTexels& texels) {
    kernel::CrtEnvironmentImage image{};
    image.width = texels.width;
    image.height = texels.height;
    const Axes& axes = environment.image ? environment.image->axes
                       : environment.sky ? environment.sky->axes
                                         : environment.clear_sky->axes;
    for (std::size_t k = 0; k < 3; ++k) {
        image.right[k] = static_cast<float>(axes.right[k]);
        image.up[k] = static_cast<float>(axes.up[k]);
        image.ahead[k] = static_cast<float>(axes.ahead[k]);
    }
    image.texels = blob.append(texels.texels);
    std::vector<double> of_rows(texels.height);
    image.columns = blob.appendFilled<kernel::u32>(texels.texels.size(), [&](std::span<kernel::u32> first) {
        parallelFor(texels.height, 16, [&](std::size_t begin, std::size_t end) {
            std::vector<double> weights(texels.width);
            for (std::size_t row = begin; row < end; ++row) {
                double sum = 0;
                for (std::size_t column = 0; column < texels.width; ++column) {
                    weights[column] = texels.brightness[row * texels.width + column];
                    sum += weights[column];
                }
                of_rows[row] = sum * heightOf(row, texels.height);
                if (!(sum > 0)) std::fill(weights.begin(), weights.end(), 1.0);
                choose(weights, first.subspan(row * texels.width, texels.width));
            }
        });
    });
    if (!(texels.mean_brightness > 0)) std::fill(of_rows.begin(), of_rows.end(), 1.0);
    image.rows = blob.appendFilled<kernel::u32>(
        texels.height, [&](std::span<kernel::u32> first) { choose(of_rows, first); });
    image.row_shift = guideShift(texels.height);
    image.row_guide =
        blob.appendFilled<kernel::u32>(guideSize(image.row_shift), [&](std::span<kernel::u32> guide) {
            fillGuide(blob.items<kernel::u32>(image.rows), image.row_shift, guide);
        });
    image.column_shift = guideShift(texels.width);
    const std::size_t size = guideSize(image.column_shift);
    image.column_guides =
        blob.appendFilled<kernel::u32>(texels.height * size, [&](std::span<kernel::u32> guides) {
            const std::span<const kernel::u32> columns = blob.items<kernel::u32>(image.columns);
            parallelFor(texels.height, 16, [&](std::size_t begin, std::size_t end) {
                for (std::size_t row = begin; row < end; ++row)
                    fillGuide(columns.subspan(row * texels.width, texels.width), image.column_shift,
                              guides.subspan(row * size, size));
            });
        });
    return blob.append(std::vector{image});
}

}  // namespace crt
