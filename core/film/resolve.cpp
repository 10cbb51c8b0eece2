#include "film/resolve.h"

#include "base/error.h"
#include "base/parallel.h"
#include "base/statistics.h"
#include "film/error_estimate.h"
#include "film/luminance_error.h"
#include "film/pooled_variance.h"
#include "image/image_metadata.h"
#include "scene/aov.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

namespace crt {
namespace {

const char* spaceName(ColorSpace space) {
    switch (space) {
        case ColorSpace::LinearSrgb: return "lin_rec709_scene";
        case ColorSpace::AcesCg: return "lin_ap1_scene";
        case ColorSpace::Xyz: break;
    }
    return "lin_ciexyzd65_scene";
}

/// As Fichet et al. 2021 have it, and pbrt-v4: Stokes component 0, and a comma in the number, since a point
/// would divide layers.
std::string binName(double centre_nm) {
    std::string name = fmt::format("S0.{:.6f}nm", centre_nm);
    name[name.rfind('.')] = ',';
    return name;
}

void nameSpectralChannels(const SpectralChannels& spectral, Image& image) {
    for (std::uint32_t bin = 0; bin < spectral.bins.count; ++bin)
        image.channels.push_back(binName(spectral.bins.centre_nm(bin)));
    for (const std::string& name : spectral.responses) image.channels.push_back("Response." + name);
}

/// Student's 97.5 % quantile, linear in 1/dof between 1,024 values, which is right to 1e-6: the quantile
/// itself takes microseconds, too long for each pixel.
class StudentTable {
public:
    StudentTable() {
        values_[0] = stats::normalQuantile(0.975);
        for (std::size_t i = 1; i <= kSteps; ++i)
            values_[i] = stats::studentQuantile(0.975, static_cast<double>(kSteps) / static_cast<double>(i));
    }
    /// For one degree of freedom or more.
    double operator()(double dof) const {
        const double at = static_cast<double>(kSteps) / std::max(1.0, dof);
        const std::size_t i = std::min(static_cast<std::size_t>(at), kSteps - 1);
        const double part = at - static_cast<double>(i);
        return values_[i] + part * (values_[i + 1] - values_[i]);
    }

private:
    static constexpr std::size_t kSteps = 1024;
    std::array<double, kSteps + 1> values_;
};

/// The noise of the pixels, for images that include it.
struct PixelNoise {
    std::vector<double> own;  ///< Variances of the pixels' means of Y, unbiased.
    stats::PooledVariances pooled;
    double degrees_of_freedom;  ///< Of each of `own`.
    StudentTable quantile;

    explicit PixelNoise(const Film& film) {
        const LuminanceVariance variance(film);
        degrees_of_freedom = variance.degreesOfFreedom();
        const std::uint32_t width = film.shape().width, height = film.shape().height;
        own.resize(std::size_t{width} * height);
        for (std::uint32_t y = 0; y < height; ++y)
            for (std::uint32_t x = 0; x < width; ++x) own[std::size_t{y} * width + x] = variance(x, y);
        pooled = stats::pooledVariances(own, width, height, degrees_of_freedom);
        pooled.variances = stats::variancesWithoutZeros(std::move(pooled.variances), width, height);
    }
    double standardError(std::size_t pixel) const { return std::sqrt(pooled.variances[pixel]); }
    double halfWidth(std::size_t pixel) const {
        if (!std::isfinite(own[pixel])) return own[pixel];
        return quantile(pooled.degrees_of_freedom[pixel]) * standardError(pixel);
    }
};

/// Standard errors of R, G and B, which are `color` times X, Y and Z.
std::array<std::vector<double>, 3> colorErrors(const Film& film, const Matrix3d& color) {
    const LuminanceVariance variance(film);
    const std::uint32_t width = film.shape().width, height = film.shape().height;
    std::array<std::vector<double>, 3> errors;
    for (std::size_t c = 0; c < 3; ++c) {
        std::vector<double> own(std::size_t{width} * height);
        for (std::uint32_t y = 0; y < height; ++y)
            for (std::uint32_t x = 0; x < width; ++x)
                own[std::size_t{y} * width + x] = variance.ofColor(x, y, color[c]);
        errors[c] = stats::variancesWithoutZeros(
            stats::pooledVariances(own, width, height, variance.degreesOfFreedom()).variances, width,
            height);
        for (double& error : errors[c]) error = std::sqrt(error);
    }
    return errors;
}

}  // namespace

Image resolveImage(const Film& film, const Development& development, std::uint32_t aovs,
                   const SpectralChannels& spectral) {
    const FilmShape& shape = film.shape();
    if (spectral.count() > shape.spectral)
        throw Error(ErrorKind::Internal, "an image needs more spectral channels than its film has");
    for (const AovRow& row : kAovRows)
        if ((aovs & (kAovsOfFirstHits | kAovColorError) & ~shape.aovs & row.aov) != 0)
            throw Error(ErrorKind::Usage,
                        fmt::format("an output needs the {} plane, but the film was rendered without it",
                                    row.name));

    const ColorSpace space = development.color_space;
    const double exposure = std::exp2(development.exposure_ev);
    const Matrix3d to_rgb = xyzToRgb(space);
    Matrix3d color = to_rgb;
    // To D65 in every space: it is the white of sRGB, xyzToRgb takes it to ACEScg's own, and an XYZ image
    // then still becomes the sRGB one by the standard matrix.
    if (development.white) color = multiply(color, bradfordAdaptation(*development.white, d65WhiteXyz()));
    for (Vec3d& row : color)
        for (double& entry : row) entry *= exposure;
    // The film has the noise of Y alone, and a white balance mixes X, Y and Z: what becomes of that noise is
    // known where it changes brightness and not colour. Then the relative error of luminance stays what it
    // was.
    const stats::Rgb luminance_weights = stats::luminanceWeights(space);
    const auto luminanceGain = [&](const Vec3d& xyz) {
        if (!development.white || !(xyz[1] > 0)) return exposure;
        return std::abs(stats::luminance(multiply(color, xyz), luminance_weights)) / xyz[1];
    };
    // Albedo is a reflectance: the film has it as XYZ under equal-energy light, and a perfect white must
    // come out as (1,1,1) in the RGB spaces whatever the exposure and white balance.
    const Matrix3d albedo_color = multiply(to_rgb, bradfordAdaptation({1, 1, 1}, d65WhiteXyz()));

    Image image;
    image.width = shape.width;
    image.height = shape.height;
    image.channels = {"R", "G", "B"};
    for (const AovRow& row : kAovRows) {
        if ((aovs & row.aov) == 0) continue;
        std::vector<std::string>& names = row.integer ? image.integer_channels : image.channels;
        for (std::string& name : exrNames(row)) names.push_back(std::move(name));
    }

    std::array<std::vector<double>, 3> color_errors;
    if ((aovs & kAovColorError) != 0) color_errors = colorErrors(film, color);
    std::optional<PixelNoise> noise;
    if ((aovs & (kAovVariance | kAovError)) != 0) {
        noise.emplace(film);
        if ((aovs & kAovError) != 0) image.channels.emplace_back(kHalfWidthChannel);
        image.channels.emplace_back(kOwnVarianceChannel);
    }
    nameSpectralChannels(spectral, image);

    const std::size_t pixels = std::size_t{shape.width} * shape.height;
    image.pixels.resize(pixels * image.channels.size());
    image.integers.resize(pixels * image.integer_channels.size());
    const auto resolvePixel = [&](std::uint32_t x, std::uint32_t y, float* out, std::uint32_t* integers) {
        const auto triple = [&](std::uint32_t c) {
            return Vec3d{film.mean(x, y, c), film.mean(x, y, c + 1), film.mean(x, y, c + 2)};
        };
        const auto add = [&](double value) { *out++ = static_cast<float>(value); };
        const auto append = [&](const Vec3d& v) {
            for (const double component : v) add(component);
        };
        const std::size_t pixel = std::size_t{y} * shape.width + x;
        append(multiply(color, triple(0)));
        const double gain = luminanceGain(triple(0));
        // In the order of the names above.
        for (const AovRow& row : kAovRows) {
            if ((aovs & row.aov) == 0) continue;
            const std::uint32_t first = firstChannel(shape.aovs, row.aov);
            switch (row.aov) {
                case kAovAlbedo: append(multiply(albedo_color, triple(first))); break;
                case kAovNormal: append(triple(first)); break;
                case kAovDepth: add(film.mean(x, y, first)); break;
                case kAovSquares:
                case kAovSplats:
                case kAovReplicates: break;
                case kAovPrimitive: *integers++ = film.primitives[pixel]; break;
                case kAovVariance: add(noise->pooled.variances[pixel] * gain * gain); break;
                case kAovSamples:
                    *integers++ = static_cast<std::uint32_t>(std::min<std::uint64_t>(
                        film.counts[pixel], std::numeric_limits<std::uint32_t>::max()));
                    break;
                case kAovError: add(noise->standardError(pixel) * gain); break;
                case kAovColorError:
                    append({color_errors[0][pixel], color_errors[1][pixel], color_errors[2][pixel]});
                    break;
            }
        }
        if ((aovs & kAovError) != 0) add(noise->halfWidth(pixel) * gain);
        if (noise) add(noise->own[pixel] * gain * gain);
        for (std::uint32_t c = 0; c < spectral.count(); ++c) add(film.mean(x, y, shape.firstSpectral() + c));
    };
    constexpr std::size_t kRows = 16;
    parallelFor(shape.height, kRows, [&](std::size_t first, std::size_t end) {
        for (auto y = static_cast<std::uint32_t>(first); y < end; ++y)
            for (std::uint32_t x = 0; x < shape.width; ++x) {
                const std::size_t pixel = std::size_t{y} * shape.width + x;
                resolvePixel(x, y, image.pixels.data() + pixel * image.channels.size(),
                             image.integers.data() + pixel * image.integer_channels.size());
            }
    });

    image.chromaticities = chromaticities(space);
    image.view = development.view;
    // The caller adds who rendered it, where and when.
    image.metadata = {{kColorInteropIdKey, spaceName(space)},
                      {"crt/spp", std::to_string(film.samples.count())},
                      {"crt/sampleRanges", film.samples.text()},
                      {kExposureKey, fmt::format("{}", development.exposure_ev)},
                      {kWhiteBalanceKey, whiteBalanceText(development)},
                      {"crt/invalidSamples", std::to_string(film.invalidSamples())}};
    if (image.view != ViewTransform::None)
        image.metadata.emplace_back(kViewKey, kViewTransformNames[static_cast<std::size_t>(image.view)]);
    if (!film.splats.empty())
        image.metadata.emplace_back("crt/droppedSplats", std::to_string(film.droppedSplats()));
    if (spectral.bins.count > 0) {
        image.metadata.emplace_back("spectralLayoutVersion", "1.0");
        image.metadata.emplace_back("emissiveUnits", "W.m^-2.sr^-1.nm^-1");
    }
    if (noise && noise->degrees_of_freedom >= 1)
        image.metadata.emplace_back(kErrorDofKey, fmt::format("{:.6g}", noise->degrees_of_freedom));
    return image;
}

}  // namespace crt
