// ICC.1:2010: 7.2 is the header, 7.3 the table of tags, 10 the types. Every number is big-endian.
#include "image/icc_profile.h"

#include <libdeflate.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

namespace crt::image {
namespace {

/// Colour is off by this fraction of white where a profile is not that of sRGB. A gamma of 2.2 is within it.
constexpr double kTolerance = 0.01;

/// Nothing beyond the end.
std::optional<double> numberAt(std::string_view bytes, std::size_t at, std::size_t size) {
    if (at > bytes.size() || size > bytes.size() - at) return std::nullopt;
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < size; ++i) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
    return value;
}

/// s15Fixed16Number.
std::optional<double> fixedAt(std::string_view bytes, std::size_t at) {
    const std::optional<double> value = numberAt(bytes, at, 4);
    if (!value) return std::nullopt;
    constexpr double kUnit = 65536, kSign = 2147483648.0;
    return (*value >= kSign ? *value - 2 * kSign : *value) / kUnit;
}

/// The data of a tag; empty if there is none, or it lies beyond the end.
std::string_view tagOf(std::string_view profile, std::string_view name) {
    constexpr std::size_t kHeader = 128, kEntry = 12, kMostTags = 1000;
    const auto tags = static_cast<std::size_t>(numberAt(profile, kHeader, 4).value_or(0));
    for (std::size_t i = 0; i < std::min(tags, kMostTags); ++i) {
        const std::size_t at = kHeader + 4 + i * kEntry;
        const std::optional<double> offset = numberAt(profile, at + 4, 4),
                                    size = numberAt(profile, at + 8, 4);
        if (!offset || !size) return {};
        if (profile.substr(at, 4) != name) continue;
        if (*offset + *size > static_cast<double>(profile.size())) return {};
        return profile.substr(static_cast<std::size_t>(*offset), static_cast<std::size_t>(*size));
    }
    return {};
}

/// A curve of type 'curv' at 0 to 1.
std::optional<double> sampledCurve(std::string_view curve, double x) {
    constexpr std::size_t kHead = 12;
    const std::optional<double> count = numberAt(curve, 8, 4);
    if (!count) return std::nullopt;
    if (*count == 0) return x;
    if (*count == 1) {
        const std::optional<double> gamma = numberAt(curve, kHead, 2);
        return gamma ? std::optional(std::pow(x, *gamma / 256)) : std::nullopt;
    }
    const double place = x * (*count - 1), lower = std::min(std::floor(place), *count - 2);
    const std::size_t at = kHead + 2 * static_cast<std::size_t>(lower);
    const std::optional<double> a = numberAt(curve, at, 2), b = numberAt(curve, at + 2, 2);
    if (!a || !b) return std::nullopt;
    return (*a + (place - lower) * (*b - *a)) / 65535;
}

/// A curve of type 'para' at 0 to 1.
std::optional<double> parametricCurve(std::string_view curve, double x) {
    constexpr std::size_t kHead = 12, kParameters[] = {1, 3, 4, 5, 7};
    const auto type = static_cast<std::size_t>(numberAt(curve, 8, 2).value_or(99));
    if (type >= std::size(kParameters)) return std::nullopt;
    std::array<double, 7> p{};  // g a b c d e f
    for (std::size_t i = 0; i < kParameters[type]; ++i) {
        const std::optional<double> value = fixedAt(curve, kHead + 4 * i);
        if (!value) return std::nullopt;
        p[i] = *value;
    }
    const auto [g, a, b, c, d, e, f] = p;
    switch (type) {
        case 0: return std::pow(x, g);
        case 1: return a * x + b >= 0 ? std::pow(a * x + b, g) : 0;
        case 2: return a * x + b >= 0 ? std::pow(a * x + b, g) + c : c;
        case 3: return x >= d ? std::pow(a * x + b, g) : c * x;
        default: return x >= d ? std::pow(a * x + b, g) + e : c * x + f;
    }
}

/// True if a curve decodes as IEC 61966-2-1 does.
bool decodesAsSrgb(std::string_view curve) {
    constexpr int kSteps = 64;
    for (int i = 0; i <= kSteps; ++i) {
        const double x = static_cast<double>(i) / kSteps;
        const double expected = x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4);
        std::optional<double> value;
        if (curve.substr(0, 4) == "curv") value = sampledCurve(curve, x);
        if (curve.substr(0, 4) == "para") value = parametricCurve(curve, x);
        if (!value || !(std::abs(*value - expected) < kTolerance)) return false;
    }
    return true;
}

/// True if a tag has these X, Y and Z.
bool hasXyz(std::string_view tag, const std::array<double, 3>& xyz) {
    for (std::size_t k = 0; k < 3; ++k) {
        const std::optional<double> value = fixedAt(tag, 8 + 4 * k);
        if (!value || !(std::abs(*value - xyz[k]) < kTolerance)) return false;
    }
    return tag.substr(0, 4) == "XYZ ";
}

bool isSrgb(std::string_view profile) {
    if (!tagOf(profile, "A2B0").empty()) return false;  // A table, which counts before matrix and curves.
    const std::string_view space = profile.substr(std::min<std::size_t>(16, profile.size()), 4);
    if (space == "GRAY") return decodesAsSrgb(tagOf(profile, "kTRC"));
    // The primaries of sRGB, adapted to D50 as profiles require.
    return space == "RGB " && hasXyz(tagOf(profile, "rXYZ"), {0.43607, 0.22249, 0.01392}) &&
           hasXyz(tagOf(profile, "gXYZ"), {0.38515, 0.71687, 0.09708}) &&
           hasXyz(tagOf(profile, "bXYZ"), {0.14307, 0.06061, 0.71410}) &&
           decodesAsSrgb(tagOf(profile, "rTRC")) && decodesAsSrgb(tagOf(profile, "gTRC")) &&
           decodesAsSrgb(tagOf(profile, "bTRC"));
}

/// The characters of a text that can be printed.
std::string printable(std::string_view text) {
    constexpr std::size_t kLongest = 60;
    std::string shown;
    for (const char c : text)
        if (c >= ' ' && c <= '~' && shown.size() < kLongest) shown += c;
    return shown;
}

/// Of the types 'desc' (version 2) and 'mluc' (version 4), the first of its languages.
std::string descriptionOf(std::string_view profile) {
    const std::string_view tag = tagOf(profile, "desc");
    const bool unicode = tag.substr(0, 4) == "mluc";
    const auto at = unicode ? static_cast<std::size_t>(numberAt(tag, 24, 4).value_or(0)) : 12;
    const auto size = static_cast<std::size_t>(numberAt(tag, unicode ? 20 : 8, 4).value_or(0));
    if (tag.empty() || at > tag.size()) return {};
    return printable(tag.substr(at, size));
}

/// Nothing for a stream that is damaged or longer than profiles are.
std::optional<std::string> inflated(std::string_view stream) {
    constexpr std::size_t kUsual = std::size_t{1} << 14, kMost = std::size_t{1} << 22;
    const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> decompressor(
        libdeflate_alloc_decompressor(), &libdeflate_free_decompressor);
    for (std::size_t room = kUsual; decompressor && room <= kMost; room *= 16) {
        std::string profile(room, '\0');
        std::size_t size = 0;
        const libdeflate_result result = libdeflate_zlib_decompress(
            decompressor.get(), stream.data(), stream.size(), profile.data(), profile.size(), &size);
        if (result == LIBDEFLATE_INSUFFICIENT_SPACE) continue;
        if (result != LIBDEFLATE_SUCCESS) return std::nullopt;
        profile.resize(size);
        return profile;
    }
    return std::nullopt;
}

}  // namespace

std::string nameUnlessSrgb(std::string_view profile, std::string_view otherwise) {
    if (isSrgb(profile)) return {};
    const std::string name = descriptionOf(profile);
    return name.empty() ? std::string(otherwise) : name;
}

std::string nameUnlessSrgbOfPng(std::string_view chunk) {
    constexpr std::size_t kMethod = 1;
    const std::size_t end = std::min(chunk.find('\0'), chunk.size());
    const std::string name = printable(chunk.substr(0, end));
    const std::string_view rest = chunk.substr(end);
    const std::optional<std::string> profile = inflated(rest.substr(std::min(1 + kMethod, rest.size())));
    const std::string otherwise = name.empty() ? "without a name" : name;
    return profile ? nameUnlessSrgb(*profile, otherwise) : otherwise;
}

}  // namespace crt::image
