#include "judge/compare/compare.h"

#include "base/error.h"
#include "film/luminance_error.h"
#include "image/image_io.h"
#include "image/image_metadata.h"
#include "judge/compare/image_noise.h"
#include "judge/stats/metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace crt {
namespace {

/// One channel of one image, float or integer.
struct Plane {
    const float* floats = nullptr;
    const std::uint32_t* integers = nullptr;
    std::size_t stride = 0;

    bool isInteger() const { return integers != nullptr; }
    std::uint32_t bits(std::size_t pixel) const {
        return isInteger() ? integers[pixel * stride] : std::bit_cast<std::uint32_t>(floats[pixel * stride]);
    }
    double value(std::size_t pixel) const {
        return isInteger() ? static_cast<double>(integers[pixel * stride]) : floats[pixel * stride];
    }
};

/// By name: the same image may have its channels in another order.
std::optional<Plane> findPlane(const Image& image, const std::string& name) {
    if (const auto f = std::find(image.channels.begin(), image.channels.end(), name);
        f != image.channels.end())
        return Plane{image.pixels.data() + (f - image.channels.begin()), nullptr, image.channels.size()};
    if (const auto i = std::find(image.integer_channels.begin(), image.integer_channels.end(), name);
        i != image.integer_channels.end())
        return Plane{nullptr, image.integers.data() + (i - image.integer_channels.begin()),
                     image.integer_channels.size()};
    return std::nullopt;
}

/// Channels of `image` that the other lacks or has in another type.
std::vector<std::string> missingFrom(const Image& image, const Image& other) {
    std::vector<std::string> names;
    const auto collect = [&names](const auto& from, const auto& in) {
        for (const std::string& name : from)
            if (std::find(in.begin(), in.end(), name) == in.end()) names.push_back(name);
    };
    collect(image.channels, other.channels);
    collect(image.integer_channels, other.integer_channels);
    return names;
}

/// Place of a finite float on the number line: neighbours differ by one, and −0 and +0 share theirs.
std::int64_t place(float v) {
    const auto bits = std::bit_cast<std::uint32_t>(v);
    const auto magnitude = static_cast<std::int64_t>(bits & 0x7fffffffu);
    return bits >> 31 ? -magnitude : magnitude;
}

/// Floats between two, when both are numbers.
std::optional<std::uint64_t> ulpsBetween(const Plane& a, const Plane& b, std::size_t pixel) {
    if (a.isInteger() || b.isInteger() || !std::isfinite(a.value(pixel)) || !std::isfinite(b.value(pixel)))
        return std::nullopt;
    return static_cast<std::uint64_t>(
        std::abs(place(a.floats[pixel * a.stride]) - place(b.floats[pixel * b.stride])));
}

/// Values of the named planes, pixel by pixel.
std::vector<float> valuesOf(const Image& image, const std::vector<std::string>& names) {
    std::vector<Plane> planes;
    for (const std::string& name : names) planes.push_back(*findPlane(image, name));
    std::vector<float> values;
    const std::size_t pixels = std::size_t{image.width} * image.height;
    values.reserve(pixels * planes.size());
    for (std::size_t p = 0; p < pixels; ++p)
        for (const Plane& plane : planes) values.push_back(plane.floats[p * plane.stride]);
    return values;
}

void addMetrics(CompareResult& result, const std::vector<float>& a, const std::vector<float>& b) {
    const stats::ErrorMetrics m = stats::errorMetrics(a, b);
    result.not_finite = {m.test.total(), m.reference.total()};
    result.metrics_valid = m.valid();
    if (!m.valid()) return;
    for (std::size_t i = 0; i < a.size(); ++i)
        result.max_ulp =
            std::max(result.max_ulp, static_cast<std::uint64_t>(std::abs(place(a[i]) - place(b[i]))));
    result.max_absolute = m.max_absolute;
    result.p99_absolute = m.p99_absolute;
    result.mse = m.mse;
    result.rmse = m.rmse;
    result.rmse_over_mean = m.relative_rmse;
    result.relmse = m.relmse;
    result.mae = m.mae;
    result.smape = m.smape;
    result.mean = {m.test_mean, m.reference_mean};
    result.mean_ratio = m.mean_ratio;
}

void addLooks(CompareResult& result, const Image& a, const Image& b, bool display_referred) {
    // An image that does not name its primaries is assumed to have the other's.
    const auto seen_a = linearSrgb(a, a.chromaticities ? a.chromaticities : b.chromaticities);
    const auto seen_b = linearSrgb(b, b.chromaticities ? b.chromaticities : a.chromaticities);
    if (!seen_a || !seen_b) return;
    // Same colours look the same; the answer is known without seconds of FLIP.
    result.perceived = *seen_a == *seen_b
                           ? PerceivedDifference{0, !display_referred, 0, 0}
                           : perceivedDifference(*seen_a, *seen_b, a.width, a.height, display_referred);
}

/// Reason why pixels of two crop windows of one image do not correspond; empty if they do, or if one image
/// does not state its crop window.
std::string windowConflict(const Image& a, const Image& b) {
    if (a.whole_width == 0 || b.whole_width == 0) return {};
    const auto same = [](const Image& i) {
        return std::array<std::int64_t, 4>{i.left, i.top, i.whole_width, i.whole_height};
    };
    if (same(a) == same(b)) return {};
    const auto window = [](const Image& i) {
        return fmt::format("[{}, {}) × [{}, {}) of {} × {} pixels", i.left, i.left + std::int64_t{i.width},
                           i.top, i.top + std::int64_t{i.height}, i.whole_width, i.whole_height);
    };
    return fmt::format("A and B are different parts of the image: {} and {}", window(a), window(b));
}

/// The colour of both images side by side; throws when they do not match.
struct ColorPair {
    std::array<Plane, 3> a, b;
    std::size_t pixels;
};
ColorPair colorPair(const Image& a, const Image& b) {
    if (a.width != b.width || a.height != b.height)
        throw Error(
            ErrorKind::Usage,
            fmt::format("the images differ in size ({} × {} and {} × {}), so there is no difference image",
                        a.width, a.height, b.width, b.height));
    if (!hasColor(a) || !hasColor(b))
        throw Error(ErrorKind::Usage, "only images with channels R, G and B have a difference image");
    ColorPair pair{{*findPlane(a, "R"), *findPlane(a, "G"), *findPlane(a, "B")},
                   {*findPlane(b, "R"), *findPlane(b, "G"), *findPlane(b, "B")},
                   std::size_t{a.width} * a.height};
    return pair;
}

Image rgbImage(const Image& like) {
    Image image;
    image.width = like.width;
    image.height = like.height;
    image.channels = {"R", "G", "B"};
    image.pixels.reserve(std::size_t{3} * like.width * like.height);
    return image;
}

}  // namespace

bool hasColor(const Image& image) {
    for (const char* name : {"R", "G", "B"})
        if (std::find(image.channels.begin(), image.channels.end(), name) == image.channels.end())
            return false;
    return true;
}

CompareResult compareImages(const Image& a, const Image& b, const CompareOptions& options) {
    CompareResult result;
    result.tolerance = options.tolerance;
    if (a.width != b.width || a.height != b.height) {
        result.mismatch = fmt::format("the images differ in size: {} × {} and {} × {} pixels", a.width,
                                      a.height, b.width, b.height);
        return result;
    }
    result.mismatch = windowConflict(a, b);
    if (!result.mismatch.empty()) return result;
    result.width = a.width;
    result.height = a.height;
    result.other_channels = missingFrom(a, b);
    for (const std::string& name : missingFrom(b, a))
        if (std::find(result.other_channels.begin(), result.other_channels.end(), name) ==
            result.other_channels.end())
            result.other_channels.push_back(name);

    const bool color = hasColor(a) && hasColor(b);
    if ((options.all_channels || !color) && !result.other_channels.empty()) {
        result.mismatch =
            fmt::format("the images differ in channels: {} only in one image or of a different type",
                        fmt::join(result.other_channels, ", "));
        return result;
    }
    if (color) {
        const ColorConditions of_a = colorConditions(a), of_b = colorConditions(b);
        result.mismatch = conflictOf(of_a, "A", of_b, "B");
        if (!result.mismatch.empty()) return result;
        result.notes = unknownConditions(of_a, "A", of_b, "B");
    }
    const std::vector<std::string> metric_channels =
        color ? std::vector<std::string>{"R", "G", "B"} : a.channels;
    result.channels = metric_channels;
    if (options.all_channels) {
        result.channels = a.channels;
        result.channels.insert(result.channels.end(), a.integer_channels.begin(), a.integer_channels.end());
    }

    const std::size_t pixels = std::size_t{a.width} * a.height;
    std::vector<std::pair<Plane, Plane>> compared;
    for (const std::string& name : result.channels)
        compared.emplace_back(*findPlane(a, name), *findPlane(b, name));
    for (std::size_t p = 0; p < pixels; ++p)
        for (std::size_t c = 0; c < compared.size(); ++c) {
            const auto& [plane_a, plane_b] = compared[c];
            if (plane_a.bits(p) == plane_b.bits(p)) continue;
            ++result.differing_pixels;
            if (!result.first_difference)
                result.first_difference = Difference{static_cast<std::uint32_t>(p % a.width),
                                                     static_cast<std::uint32_t>(p / a.width),
                                                     result.channels[c],
                                                     plane_a.value(p),
                                                     plane_b.value(p),
                                                     ulpsBetween(plane_a, plane_b, p)};
            break;
        }

    const std::vector<float> values_a = valuesOf(a, metric_channels);
    const std::vector<float> values_b = valuesOf(b, metric_channels);
    addMetrics(result, values_a, values_b);
    if (result.metrics_valid && color) {
        const stats::Rgb weights = luminanceWeights(b.chromaticities ? b : a);
        result.relative_rmse =
            stats::luminanceError(stats::luminances(values_a, weights), stats::luminances(values_b, weights))
                .relative_rmse;
        addLooks(result, a, b, options.display_referred);
    }

    if (options.tolerance > 0) {
        result.same = result.metrics_valid && result.rmse_over_mean <= options.tolerance;
    } else {
        result.same = result.differing_pixels == 0;
    }
    return result;
}

Image differenceImage(const Image& a, const Image& b) {
    const ColorPair pair = colorPair(a, b);
    Image image = rgbImage(a);
    image.chromaticities = a.chromaticities ? a.chromaticities : b.chromaticities;
    for (std::size_t p = 0; p < pair.pixels; ++p)
        for (std::size_t c = 0; c < 3; ++c)
            image.pixels.push_back(static_cast<float>(pair.a[c].value(p) - pair.b[c].value(p)));
    return image;
}

Image falseColorDifference(const Image& a, const Image& b) {
    const ColorPair pair = colorPair(a, b);
    double sum = 0;
    for (std::size_t p = 0; p < pair.pixels; ++p)
        for (const Plane& plane : pair.b)
            if (const double v = plane.value(p); std::isfinite(v)) sum += std::abs(v);
    // Against a black image every difference is large.
    const double mean =
        std::max(sum / (3.0 * static_cast<double>(pair.pixels)), std::numeric_limits<double>::min());

    Image image = rgbImage(a);
    for (std::size_t p = 0; p < pair.pixels; ++p) {
        bool same = true, finite = true;
        double largest = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            same = same && pair.a[c].bits(p) == pair.b[c].bits(p);
            finite = finite && std::isfinite(pair.a[c].value(p)) && std::isfinite(pair.b[c].value(p));
            largest = std::max(largest, std::abs(pair.a[c].value(p) - pair.b[c].value(p)));
        }
        std::array<float, 3> color{0, 0, 0};
        if (!finite) {
            color = {1, 0, 1};
        } else if (!same) {
            const double decades = std::log10(std::max(largest / mean, 1e-30));
            const auto t = static_cast<float>(std::clamp((decades + 7.0) / 6.0, 0.0, 1.0));
            color = t < 0.5f ? std::array<float, 3>{0, 2 * t, 1 - 2 * t}
                             : std::array<float, 3>{2 * t - 1, 2 - 2 * t, 0};
        }
        image.pixels.insert(image.pixels.end(), color.begin(), color.end());
    }
    return image;
}

void writeDifference(const std::string& path, const Image& a, const Image& b) {
    const std::optional<OutputFormat> format = formatOfFile(path);
    if (!format)
        throw Error(ErrorKind::Usage, fmt::format("'{}' does not end in {}", path, kImageEnds), {path});
    const bool as_values = *format == OutputFormat::Exr || *format == OutputFormat::Pfm;
    writeImage(path, *format, as_values ? differenceImage(a, b) : falseColorDifference(a, b));
}

}  // namespace crt
