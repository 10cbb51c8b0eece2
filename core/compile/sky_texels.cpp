#include "compile/sky_texels.h"

#include "base/parallel.h"
#include "scene/cie_sky.h"
#include "spectra/sigmoid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>
#include <vector>

namespace crt {
namespace {

constexpr double kPi = std::numbers::pi;

struct SineCosine {
    double sine, cosine;
};

SineCosine sineCosine(double angle) { return {std::sin(angle), std::cos(angle)}; }

/// Calls add(texel, direction) for four points of each texel, as skies are steep at the horizon and at the
/// sun. [any thread]
template <class Add>
void forPointsOfTexels(const Axes& axes, std::size_t rows, const Add& add) {
    constexpr std::array kPoints{0.5 - 0.28867513459481287, 0.5 + 0.28867513459481287};
    const std::size_t columns = 2 * rows;
    std::vector<SineCosine> azimuths;
    for (std::size_t column = 0; column < columns; ++column)
        for (const double x : kPoints)
            azimuths.push_back(
                sineCosine(((static_cast<double>(column) + x) / static_cast<double>(rows) - 1) * kPi));
    const auto row_of_texels = [&](std::size_t row) {
        for (const double y : kPoints) {
            const SineCosine zenith =
                sineCosine((static_cast<double>(row) + y) * kPi / static_cast<double>(rows));
            for (std::size_t i = 0; i < azimuths.size(); ++i)
                add(row * columns + i / 2, axes.right * (zenith.sine * azimuths[i].sine) +
                                               axes.up * zenith.cosine +
                                               axes.ahead * (zenith.sine * azimuths[i].cosine));
        }
    };
    parallelFor(rows, 16, [&](std::size_t first, std::size_t end) {
        for (std::size_t row = first; row < end; ++row) row_of_texels(row);
    });
}
constexpr double kPointsOfTexel = 4;

EnvironmentTexels emptyTexels(int rows) {
    EnvironmentTexels out;
    out.height = static_cast<std::uint32_t>(rows);
    out.width = 2 * out.height;
    out.texels.resize(std::size_t{out.width} * out.height);
    out.brightness.resize(out.texels.size());
    return out;
}

/// ∫ cos over the upper half, of values of the texels.
double horizontalIntegral(const std::vector<double>& of_texels, std::size_t rows) {
    double sum = 0;
    for (std::size_t row = 0; row < rows; ++row) {
        const double upper = kPi * static_cast<double>(row) / static_cast<double>(rows),
                     lower = kPi * static_cast<double>(row + 1) / static_cast<double>(rows);
        const double squares = std::pow(std::sin(lower), 2) - std::pow(std::sin(upper), 2);
        for (std::size_t column = 0; column < 2 * rows; ++column)
            sum += of_texels[row * 2 * rows + column] * (kPi / static_cast<double>(rows)) * squares / 2;
    }
    return sum;
}

/// The share of each of the model's wavelengths in XYZ, times the environment's spectrum.
struct SkyColours {
    explicit SkyColours(const Spectrum& unit) : of_unit(skyValues(unit)) {
        for (std::size_t k = 0; k < kSkyWavelengths; ++k) {
            SkyValues one{};
            one[k] = of_unit[k];
            const Vec3d of_one = spectrumToXyz(skySpectrum(one));
            xyz[k] = of_one;
            responses[k] = of_one[0] + of_one[1] + of_one[2];
            t[k] = sigmoidWavelength(static_cast<double>(k) * kSkyWavelengthStep_nm);
        }
        for (std::size_t i = 0; i < kSpectrumSize; ++i)
            bin_y[i / kBin_nm] += unit[i] * cieObserver()[1][i] / cieYIntegral();
        for (std::size_t bin = 0; bin < kBins; ++bin)
            bin_t[bin] = sigmoidWavelength(static_cast<double>(bin * kBin_nm) + (kBin_nm - 1) / 2.0);
    }

    /// Y of the environment's spectrum times a sigmoid, by bins of 10 nm.
    double luminance(const Vec3d& c) const {
        double sum = 0;
        for (std::size_t bin = 0; bin < kBins; ++bin) sum += bin_y[bin] * sigmoidAt(c, bin_t[bin]);
        return sum;
    }

    SkyValues of_unit, responses, t;
    std::array<Vec3d, kSkyWavelengths> xyz;

private:
    static constexpr std::size_t kBin_nm = 10, kBins = (kSpectrumSize + kBin_nm - 1) / kBin_nm;
    std::array<double, kBins> bin_y{}, bin_t{};
};

/// A texel of this radiance, and its brightness.
std::pair<kernel::CrtEnvironmentTexel, float> texelOf(const SkyValues& radiance, const SkyColours& colours) {
    SkyValues ratios{};
    double largest = 0, total = 0;
    Vec3d wanted{};
    for (std::size_t k = 0; k < kSkyWavelengths; ++k) {
        if (colours.of_unit[k] > 0) ratios[k] = radiance[k] / colours.of_unit[k];
        largest = std::max(largest, ratios[k]);
        total += colours.responses[k];
        wanted = wanted + colours.xyz[k] * ratios[k];
    }
    if (!(largest > 0) || !(wanted[1] > 0)) return {};
    // As rgbEmission: half of the range, where the sigmoid is smoothest.
    std::array<SigmoidTarget, kSkyWavelengths> targets;
    constexpr double kEverywhere = 0.02;  // So that the ends, which eyes hardly see, are not lost.
    for (std::size_t k = 0; k < kSkyWavelengths; ++k)
        targets[k] = {colours.t[k], ratios[k] / (2 * largest), colours.responses[k] / total + kEverywhere,
                      colours.xyz[k] * (2 * largest / wanted[1])};
    const Vec3d c = nearestSigmoid(targets);
    return {{static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2]),
             static_cast<float>(wanted[1] / colours.luminance(c))},
            static_cast<float>(wanted[0] + wanted[1] + wanted[2])};
}

}  // namespace

EnvironmentTexels skyTexels(const CieSky& sky, const Spectrum& unit) {
    EnvironmentTexels out = emptyTexels(sky.rows);
    const CieSkyLuminance luminance(sky.type, sky.towards_sun, sky.axes.up);
    std::vector<double> relative(out.texels.size());
    forPointsOfTexels(sky.axes, out.height, [&](std::size_t texel, const Vec3d& direction) {
        relative[texel] += luminance(direction);
    });
    for (double& value : relative) value /= kPointsOfTexel;
    const double scale = sky.horizontal ? sky.amount / horizontalIntegral(relative, out.height) : sky.amount;
    const Vec3d xyz = spectrumToXyz(unit);
    for (std::size_t i = 0; i < relative.size(); ++i) {
        // Coefficients of 0 are the constant ½.
        out.texels[i] = {0, 0, 0, static_cast<float>(2 * relative[i] * scale)};
        out.brightness[i] = static_cast<float>((xyz[0] + xyz[1] + xyz[2]) * relative[i] * scale);
    }
    return out;
}

EnvironmentTexels skyTexels(const ClearSky& sky, const Spectrum& unit) {
    EnvironmentTexels out = emptyTexels(sky.rows);
    const ClearSkyModel model = sky.model();
    std::vector<SkyValues> radiances(out.texels.size());
    forPointsOfTexels(sky.axes, out.height, [&](std::size_t texel, const Vec3d& direction) {
        const double cosine = std::clamp(dot(direction, sky.towards_sun), -1.0, 1.0);
        const SkyValues here = model.radiance(dot(direction, sky.axes.up), std::acos(cosine), cosine);
        for (std::size_t k = 0; k < kSkyWavelengths; ++k)
            radiances[texel][k] += here[k] * (sky.scale / kPointsOfTexel);
    });
    const SkyColours colours(unit);
    parallelFor(radiances.size(), std::size_t{1} << 12, [&](std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i)
            std::tie(out.texels[i], out.brightness[i]) = texelOf(radiances[i], colours);
    });
    return out;
}

}  // namespace crt
