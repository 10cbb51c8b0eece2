#include "scene/clear_sky.h"

#include "scene/scene.h"

#include "base/error.h"
#include "base/input_file.h"
#include "base/modules.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <span>
#include <string>
#include <string_view>

namespace crt {
namespace {

constexpr const char* kDataFile = "sky/hosek_wilkie.txt";
constexpr std::size_t kTurbidities = 10, kAlbedos = 2, kControls = 6, kSkyNumbers = 10;
constexpr std::size_t kPieces = 45, kPieceNumbers = 4, kLimbNumbers = 6;

/// The published numbers of one wavelength.
struct SkyData {
    using Controls = std::array<std::array<double, kSkyNumbers>, kControls>;
    using Pieces = std::array<std::array<double, kPieceNumbers>, kPieces>;
    std::array<std::array<Controls, kAlbedos>, kTurbidities> sky;
    std::array<Pieces, kTurbidities> sun;
    std::array<double, kLimbNumbers> limb;
};
using AllSkyData = std::array<SkyData, kSkyWavelengths>;

std::string dataFile() {
    std::error_code unknown;
    for (const std::string& folder : dataDirectories()) {
        const std::filesystem::path path = std::filesystem::path(folder) / kDataFile;
        if (std::filesystem::exists(path, unknown)) return plainPath(path);
    }
    throw Error(ErrorKind::Scene, fmt::format("there is no '{}' in crt's data: {}", kDataFile,
                                              fmt::join(dataDirectories(), ", ")));
}

/// The words and numbers of the file, one after the other.
class SkyText {
public:
    explicit SkyText(std::string file) : file_(std::move(file)) {
        try {
            text_ = readInput(file_, kMostSpectrumBytes);
        } catch (const InputRefused& refused) {
            throw Error(ErrorKind::Scene, fmt::format("the data file '{}' {}", file_, refused.what()),
                        {file_});
        }
        left_ = text_;
    }

    void word(std::string_view wanted) {
        skip();
        if (!left_.starts_with(wanted)) fail(fmt::format("has no '{}' there", wanted));
        left_.remove_prefix(wanted.size());
    }
    void number(std::size_t wanted) {
        if (number() != static_cast<double>(wanted)) fail(fmt::format("has no {} there", wanted));
    }
    double number() {
        skip();
        double value = 0;
        const auto [end, error] = std::from_chars(left_.data(), left_.data() + left_.size(), value);
        if (error != std::errc() || !std::isfinite(value)) fail("has no number there");
        left_.remove_prefix(static_cast<std::size_t>(end - left_.data()));
        return value;
    }
    template <class Numbers>
    void numbers(Numbers& all) {
        for (double& value : all) value = number();
    }

private:
    /// Blanks, ends of lines and comments.
    void skip() {
        while (!left_.empty()) {
            if (left_.front() == '#')
                left_.remove_prefix(std::min(left_.find('\n'), left_.size()));
            else if (left_.front() == ' ' || left_.front() == '\n' || left_.front() == '\r')
                left_.remove_prefix(1);
            else
                return;
        }
    }
    [[noreturn]] void fail(const std::string& what) const {
        const auto read = text_.begin() + static_cast<std::ptrdiff_t>(text_.size() - left_.size());
        const auto line = static_cast<int>(1 + std::count(text_.begin(), read, '\n'));
        throw Error(ErrorKind::Scene,
                    fmt::format("{}:{}: error: the data of the clear sky {}", file_, line, what),
                    {file_, line});
    }

    std::string file_, text_;
    std::string_view left_;
};

AllSkyData readSkyData() {
    SkyText text(dataFile());
    AllSkyData all;
    for (std::size_t k = 0; k < kSkyWavelengths; ++k) {
        const std::size_t wavelength_nm = kWavelengthMin_nm + k * kSkyWavelengthStep_nm;
        for (std::size_t turbidity = 0; turbidity < kTurbidities; ++turbidity)
            for (std::size_t albedo = 0; albedo < kAlbedos; ++albedo) {
                text.word("sky"), text.number(turbidity + 1), text.number(albedo);
                text.number(wavelength_nm);
                for (auto& control : all[k].sky[turbidity][albedo]) text.numbers(control);
            }
        for (std::size_t turbidity = 0; turbidity < kTurbidities; ++turbidity) {
            text.word("sun"), text.number(turbidity + 1), text.number(wavelength_nm);
            for (auto& piece : all[k].sun[turbidity]) text.numbers(piece);
        }
        text.word("limb"), text.number(wavelength_nm);
        text.numbers(all[k].limb);
    }
    return all;
}

const AllSkyData& skyData() {
    static const AllSkyData all = readSkyData();
    return all;
}

/// Where the model has its values: the cube root of the elevation over that of the zenith, 0 to 1.
double positionOf(double elevation) { return std::cbrt(elevation / (std::numbers::pi / 2)); }

/// Bernstein's polynomials of fifth degree.
std::array<double, kControls> bernstein(double x) {
    const double y = 1 - x;
    return {std::pow(y, 5),         5 * std::pow(y, 4) * x, 10 * std::pow(y, 3) * x * x,
            10 * y * y * x * x * x, 5 * y * std::pow(x, 4), std::pow(x, 5)};
}

std::array<double, kSkyNumbers> onCurve(const SkyData::Controls& controls, double position) {
    const std::array<double, kControls> weights = bernstein(position);
    std::array<double, kSkyNumbers> sum{};
    for (std::size_t c = 0; c < kControls; ++c)
        for (std::size_t i = 0; i < kSkyNumbers; ++i) sum[i] += weights[c] * controls[c][i];
    return sum;
}

double onPieces(const SkyData::Pieces& pieces, double elevation) {
    const auto piece = std::min(static_cast<std::size_t>(positionOf(elevation) * kPieces), kPieces - 1);
    const double first = std::pow(static_cast<double>(piece) / kPieces, 3) * (std::numbers::pi / 2);
    const double x = elevation - first;
    const auto& [c0, c1, c2, c3] = pieces[piece];
    return c0 + x * (c1 + x * (c2 + x * c3));
}

}  // namespace

ClearSkyModel::ClearSkyModel(double turbidity, const SkyValues& ground_albedo, double sun_elevation_rad)
    : elevation_(sun_elevation_rad) {
    const auto lower = std::min(static_cast<std::size_t>(turbidity), kTurbidities - 1);
    const double hazier = turbidity - static_cast<double>(lower);
    const double position = positionOf(elevation_);
    for (std::size_t k = 0; k < kSkyWavelengths; ++k) {
        const SkyData& data = skyData()[k];
        const double albedo = ground_albedo[k];
        sky_[k] = {};
        for (const auto& [turbid, share] : {std::pair(lower - 1, 1 - hazier), {lower, hazier}})
            for (const auto& [bright, part] : {std::pair(0, 1 - albedo), {1, albedo}}) {
                const auto numbers = onCurve(data.sky[turbid][static_cast<std::size_t>(bright)], position);
                for (std::size_t i = 0; i < kSkyNumbers; ++i) sky_[k][i] += share * part * numbers[i];
            }
        sun_[k] = std::max(0.0, (1 - hazier) * onPieces(data.sun[lower - 1], elevation_) +
                                    hazier * onPieces(data.sun[lower], elevation_));
        limb_[k] = data.limb;
    }
}

SkyValues ClearSkyModel::radiance(double cos_zenith, double to_sun_rad, double cos_to_sun) const {
    SkyValues all{};
    if (!(cos_zenith > 0)) return all;
    const double height = 1 / (cos_zenith + 0.01), root = std::sqrt(cos_zenith);
    const double rayleigh = cos_to_sun * cos_to_sun;
    for (std::size_t k = 0; k < kSkyWavelengths; ++k) {
        const auto& [a, b, c, d, e, f, g, h, i, mean] = sky_[k];
        const double about = 1 + i * i - 2 * i * cos_to_sun;
        const double mie = (1 + rayleigh) / (about * std::sqrt(about));
        all[k] = std::max(0.0, mean * (1 + a * std::exp(b * height)) *
                                   (c + d * std::exp(e * to_sun_rad) + f * rayleigh + g * mie + h * root));
    }
    return all;
}

SkyValues ClearSkyModel::horizontalIrradiance() const {
    // The midpoint rule in the square of the cosine, in which level ground is lit evenly, and around.
    constexpr int kHeights = 128, kAround = 256;
    const double cos_sun = std::sin(elevation_), sin_sun = std::cos(elevation_);
    SkyValues sum{};
    for (int i = 0; i < kHeights; ++i)
        for (int j = 0; j < kAround; ++j) {
            const double square = (i + 0.5) / kHeights, up = std::sqrt(square);
            const double along = std::sqrt(1 - square) * std::cos((j + 0.5) * std::numbers::pi / kAround);
            const double cosine = std::clamp(up * cos_sun + along * sin_sun, -1.0, 1.0);
            const SkyValues values = radiance(up, std::acos(cosine), cosine);
            for (std::size_t k = 0; k < kSkyWavelengths; ++k)
                sum[k] += values[k] * std::numbers::pi / (kHeights * kAround);
        }
    return sum;
}

std::vector<SunDisk> ClearSkyModel::sunDisks(std::size_t count) const {
    // Rings of equal area: the square of the cosine at the sun's surface falls by 1/count from ring to ring.
    const auto mean_of_ring = [&](std::size_t ring, std::size_t k) {
        const double most = 1 - static_cast<double>(ring) / static_cast<double>(count),
                     least = 1 - static_cast<double>(ring + 1) / static_cast<double>(count);
        double sum = 0;
        for (std::size_t i = 0; i < kLimbNumbers; ++i) {
            const double power = static_cast<double>(i) / 2 + 1;  // Of the square of the cosine.
            sum += limb_[k][i] * (std::pow(most, power) - std::pow(least, power)) / (power * (most - least));
        }
        return sum * sun_[k];
    };
    std::vector<SunDisk> disks(count);
    for (std::size_t i = 0; i < count; ++i) {
        disks[i].diameter = std::sqrt(static_cast<double>(i + 1) / static_cast<double>(count));
        for (std::size_t k = 0; k < kSkyWavelengths; ++k)
            disks[i].radiance[k] =
                std::max(0.0, mean_of_ring(i, k) - (i + 1 < count ? mean_of_ring(i + 1, k) : 0));
    }
    return disks;
}

ClearSkyModel ClearSky::model() const {
    const double elevation = std::asin(std::clamp(dot(towards_sun, axes.up), 0.0, 1.0));
    return {turbidity, ground_albedo, elevation};
}

Spectrum skySpectrum(const SkyValues& values) {
    std::vector<double> wavelengths;
    for (std::size_t k = 0; k < kSkyWavelengths; ++k)
        wavelengths.push_back(kWavelengthMin_nm + static_cast<double>(k) * kSkyWavelengthStep_nm);
    return tableSpectrum(wavelengths, {values.begin(), values.end()}, Outside::Clamp);
}

SkyValues skyValues(const Spectrum& spectrum) {
    SkyValues values;
    for (std::size_t k = 0; k < kSkyWavelengths; ++k) values[k] = spectrum[k * kSkyWavelengthStep_nm];
    return values;
}

}  // namespace crt
