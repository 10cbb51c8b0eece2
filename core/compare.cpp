#include "compare.h"

#include "error.h"
#include "image_io.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

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
    double value(std::size_t pixel) const { return isInteger() ? static_cast<double>(integers[pixel * stride]) : floats[pixel * stride]; }
};

/// By name: the same image may have its channels in another order.
std::optional<Plane> findPlane(const Image& image, const std::string& name) {
    if (const auto f = std::find(image.channels.begin(), image.channels.end(), name); f != image.channels.end())
        return Plane{image.pixels.data() + (f - image.channels.begin()), nullptr, image.channels.size()};
    if (const auto i = std::find(image.integer_channels.begin(), image.integer_channels.end(), name); i != image.integer_channels.end())
        return Plane{nullptr, image.integers.data() + (i - image.integer_channels.begin()), image.integer_channels.size()};
    return std::nullopt;
}

bool hasColor(const Image& image) {
    for (const char* name : {"R", "G", "B"})
        if (std::find(image.channels.begin(), image.channels.end(), name) == image.channels.end()) return false;
    return true;
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

/// The colour of both images side by side; throws when they do not match.
struct ColorPair {
    std::array<Plane, 3> a, b;
    std::size_t pixels;
};
ColorPair colorPair(const Image& a, const Image& b) {
    if (a.width != b.width || a.height != b.height)
        throw Error(ErrorKind::Usage, fmt::format("the images differ in size ({} × {} and {} × {}), so there is no difference image", a.width,
                                                  a.height, b.width, b.height));
    if (!hasColor(a) || !hasColor(b)) throw Error(ErrorKind::Usage, "only images with channels R, G and B have a difference image");
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

std::string number(double v) { return fmt::format("{:.6g}", v); }

}  // namespace

CompareResult compareImages(const Image& a, const Image& b, const CompareOptions& options) {
    CompareResult result;
    result.tolerance = options.tolerance;
    if (a.width != b.width || a.height != b.height) {
        result.mismatch = fmt::format("the images differ in size: {} × {} and {} × {} pixels", a.width, a.height, b.width, b.height);
        return result;
    }
    result.width = a.width;
    result.height = a.height;
    result.other_channels = missingFrom(a, b);
    for (const std::string& name : missingFrom(b, a))
        if (std::find(result.other_channels.begin(), result.other_channels.end(), name) == result.other_channels.end())
            result.other_channels.push_back(name);

    const bool color = hasColor(a) && hasColor(b);
    if ((options.all_channels || !color) && !result.other_channels.empty()) {
        result.mismatch = fmt::format("the images differ in channels: {} only in one of them or of another type", fmt::join(result.other_channels, ", "));
        return result;
    }
    const std::vector<std::string> metric_channels = color ? std::vector<std::string>{"R", "G", "B"} : a.channels;
    result.channels = metric_channels;
    if (options.all_channels) {
        result.channels = a.channels;
        result.channels.insert(result.channels.end(), a.integer_channels.begin(), a.integer_channels.end());
    }

    const std::size_t pixels = std::size_t{a.width} * a.height;
    std::vector<std::pair<Plane, Plane>> compared;
    for (const std::string& name : result.channels) compared.emplace_back(*findPlane(a, name), *findPlane(b, name));
    for (std::size_t p = 0; p < pixels; ++p)
        for (std::size_t c = 0; c < compared.size(); ++c) {
            const auto& [plane_a, plane_b] = compared[c];
            if (plane_a.bits(p) == plane_b.bits(p)) continue;
            ++result.differing_pixels;
            if (!result.first_difference)
                result.first_difference = Difference{static_cast<std::uint32_t>(p % a.width), static_cast<std::uint32_t>(p / a.width),
                                                     result.channels[c], plane_a.value(p), plane_b.value(p)};
            break;
        }

    // Two passes, because relMSE needs the mean of the reference first.
    std::vector<std::pair<Plane, Plane>> metric;
    for (const std::string& name : metric_channels) metric.emplace_back(*findPlane(a, name), *findPlane(b, name));
    const auto for_each = [&](const auto& visit) {
        for (std::size_t p = 0; p < pixels; ++p)
            for (const auto& [plane_a, plane_b] : metric) visit(plane_a.floats[p * plane_a.stride], plane_b.floats[p * plane_b.stride]);
    };
    const double count = static_cast<double>(pixels) * static_cast<double>(metric.size());
    double sum_a = 0, sum_b = 0;
    for_each([&](float va, float vb) {
        result.not_finite[0] += !std::isfinite(va);
        result.not_finite[1] += !std::isfinite(vb);
        sum_a += va;
        sum_b += vb;
    });
    result.metrics_valid = result.not_finite[0] == 0 && result.not_finite[1] == 0 && count > 0;
    if (result.metrics_valid) {
        result.mean = {sum_a / count, sum_b / count};
        result.mean_ratio = result.mean[0] / result.mean[1];
        const double epsilon = 1e-2 * result.mean[1];
        double squares = 0, relative = 0, absolute = 0, symmetric = 0;
        for_each([&](float va, float vb) {
            const double x = va, y = vb, difference = std::abs(x - y);
            result.max_ulp = std::max(result.max_ulp, static_cast<std::uint64_t>(std::abs(place(va) - place(vb))));
            if (difference == 0) return;  // Adds nothing, and keeps 0/0 out where both are black.
            result.max_absolute = std::max(result.max_absolute, difference);
            squares += difference * difference;
            relative += difference * difference / (y * y + epsilon * epsilon);
            absolute += difference;
            symmetric += 2 * difference / (std::abs(x) + std::abs(y));
        });
        result.rmse = std::sqrt(squares / count);
        result.relative_rmse = squares == 0 ? 0.0 : result.rmse / std::abs(result.mean[1]);
        result.relmse = relative / count;
        result.mae = absolute / count;
        result.smape = symmetric / count;
    }

    if (options.tolerance > 0) {
        result.same = result.metrics_valid && result.relative_rmse <= options.tolerance;
    } else {
        result.same = result.differing_pixels == 0;
    }
    return result;
}

std::string compareText(const CompareResult& r) {
    if (!r.mismatch.empty()) return "different: " + r.mismatch;
    std::string text;
    const std::uint64_t pixels = std::uint64_t{r.width} * r.height;
    const char* const verdict = r.same ? (r.differing_pixels == 0 ? "same bits" : "same within the tolerance") : "different";
    text += fmt::format("{}: {} of {} pixels differ ({})", verdict, r.differing_pixels, pixels, fmt::join(r.channels, ", "));
    const auto line = [&text](const char* name, const std::string& value) { text += fmt::format("\n  {:<18}{}", name, value); };
    if (r.first_difference) {
        const Difference& d = *r.first_difference;
        line("first difference", fmt::format("pixel {},{} channel {}: {:.9g} and {:.9g}", d.x, d.y, d.channel, d.first, d.second));
    }
    if (!r.metrics_valid) {
        line("not finite", fmt::format("{} values in the first image, {} in the second: no metric means anything", r.not_finite[0],
                                       r.not_finite[1]));
    } else if (r.differing_pixels > 0) {
        line("largest", fmt::format("{} absolute, {} ulp", number(r.max_absolute), r.max_ulp));
        line("RMSE", fmt::format("{} ({} of the mean{})", number(r.rmse), number(r.relative_rmse),
                                 r.tolerance > 0 ? fmt::format(", {} allowed", number(r.tolerance)) : ""));
        line("relMSE", number(r.relmse));
        line("MAE", number(r.mae));
        line("SMAPE", number(r.smape));
        line("mean", fmt::format("{} and {}, ratio {:.9g}", number(r.mean[0]), number(r.mean[1]), r.mean_ratio));
    }
    if (!r.other_channels.empty()) line("not compared", fmt::format("{} (in one image only)", fmt::join(r.other_channels, ", ")));
    return text;
}

std::string compareJson(const CompareResult& r) {
    using nlohmann::ordered_json;
    ordered_json json;
    json["same"] = r.same;
    json["tolerance"] = r.tolerance;
    json["mismatch"] = r.mismatch.empty() ? ordered_json(nullptr) : ordered_json(r.mismatch);
    if (!r.mismatch.empty()) return json.dump(2);
    json["width"] = r.width;
    json["height"] = r.height;
    json["channels"] = r.channels;
    json["other_channels"] = r.other_channels;
    json["differing_pixels"] = r.differing_pixels;
    if (r.first_difference) {
        const Difference& d = *r.first_difference;
        json["first_difference"] = {{"x", d.x}, {"y", d.y}, {"channel", d.channel}, {"first", d.first}, {"second", d.second}};
    } else {
        json["first_difference"] = nullptr;
    }
    json["not_finite"] = r.not_finite;
    // The library writes infinities and NaN as null, which JSON has no numbers for.
    json["metrics"] = nullptr;
    if (r.metrics_valid)
        json["metrics"] = ordered_json{{"max_absolute", r.max_absolute}, {"max_ulp", r.max_ulp},         {"rmse", r.rmse},
                                       {"relative_rmse", r.relative_rmse}, {"relmse", r.relmse},         {"mae", r.mae},
                                       {"smape", r.smape},               {"mean", r.mean},               {"mean_ratio", r.mean_ratio}};
    return json.dump(2);
}

Image differenceImage(const Image& a, const Image& b) {
    const ColorPair pair = colorPair(a, b);
    Image image = rgbImage(a);
    image.chromaticities = a.chromaticities;
    for (std::size_t p = 0; p < pair.pixels; ++p)
        for (std::size_t c = 0; c < 3; ++c) image.pixels.push_back(static_cast<float>(pair.a[c].value(p) - pair.b[c].value(p)));
    return image;
}

Image falseColorDifference(const Image& a, const Image& b) {
    const ColorPair pair = colorPair(a, b);
    double sum = 0;
    for (std::size_t p = 0; p < pair.pixels; ++p)
        for (const Plane& plane : pair.b)
            if (const double v = plane.value(p); std::isfinite(v)) sum += std::abs(v);
    // Against a black image every difference is large.
    const double mean = std::max(sum / (3.0 * static_cast<double>(pair.pixels)), std::numeric_limits<double>::min());

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
            color = t < 0.5f ? std::array<float, 3>{0, 2 * t, 1 - 2 * t} : std::array<float, 3>{2 * t - 1, 2 - 2 * t, 0};
        }
        image.pixels.insert(image.pixels.end(), color.begin(), color.end());
    }
    return image;
}

void writeDifference(const std::string& path, const Image& a, const Image& b) {
    const std::optional<OutputFormat> format = formatOfFile(path);
    if (!format) throw Error(ErrorKind::Usage, fmt::format("the extension of '{}' is none of .exr, .pfm, .png, .ppm", path), {path});
    const bool as_values = *format == OutputFormat::Exr || *format == OutputFormat::Pfm;
    writeImage(path, *format, as_values ? differenceImage(a, b) : falseColorDifference(a, b));
}

}  // namespace crt
