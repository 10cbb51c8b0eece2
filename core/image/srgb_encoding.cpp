#include "image/srgb_encoding.h"

#include "base/error.h"
#include "base/log.h"
#include "base/parallel.h"
#include "base/unit_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>

namespace crt {
namespace {

Matrix3d inverse(const Matrix3d& m) {
    Matrix3d r{};
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            const int a = (j + 1) % 3, b = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;
            r[i][j] = m[a][c] * m[b][d] - m[a][d] * m[b][c];
        }
    const double determinant = m[0][0] * r[0][0] + m[0][1] * r[1][0] + m[0][2] * r[2][0];
    for (Vec3d& row : r)
        for (double& entry : row) entry /= determinant;
    return r;
}

}  // namespace

std::array<std::size_t, 3> colorChannels(const Image& image) {
    std::array<std::size_t, 3> index{};
    constexpr const char* kNames[] = {"R", "G", "B"};
    for (std::size_t c = 0; c < 3; ++c) {
        const auto found = std::find(image.channels.begin(), image.channels.end(), kNames[c]);
        if (found == image.channels.end())
            throw Error(ErrorKind::Output, fmt::format("the image has no channel '{}'", kNames[c]));
        index[c] = static_cast<std::size_t>(found - image.channels.begin());
    }
    return index;
}

std::optional<Matrix3d> toLinearSrgb(const Image& image) {
    if (!image.chromaticities) return std::nullopt;
    const auto is = [&](ColorSpace space) {
        const std::array<double, 8> known = chromaticities(space);
        // A file holds them as float.
        return std::equal(known.begin(), known.end(), image.chromaticities->begin(),
                          [](double a, double b) { return std::abs(a - b) < 1e-6; });
    };
    if (is(ColorSpace::LinearSrgb)) return std::nullopt;
    for (const ColorSpace space : {ColorSpace::AcesCg, ColorSpace::Xyz})
        if (is(space)) return multiply(xyzToRgb(ColorSpace::LinearSrgb), inverse(xyzToRgb(space)));
    if (const std::optional<Matrix3d> matrix = linearSrgbOf(*image.chromaticities)) return matrix;
    throw Error(ErrorKind::Output, "the image's primaries span no colours, so it cannot become 8-bit sRGB");
}

namespace {

/// Of R, G and B; at least 0.
double largestColor(const Image& image) {
    const std::array<std::size_t, 3> color = colorChannels(image);
    double largest = 0;
    for (std::size_t p = 0; p < image.pixels.size(); p += image.channels.size())
        for (const std::size_t c : color) largest = std::max(largest, double{image.pixels[p + c]});
    return largest;
}

/// The linear sRGB of pixels, whatever the space of the image.
class SrgbPixels {
public:
    explicit SrgbPixels(const Image& image)
        : image_(image), color_(colorChannels(image)), to_srgb_(toLinearSrgb(image)) {}

    Vec3d operator[](std::size_t p) const {
        const float* const pixel = image_.pixels.data() + p * image_.channels.size();
        const Vec3d rgb{pixel[color_[0]], pixel[color_[1]], pixel[color_[2]]};
        return to_srgb_ ? multiply(*to_srgb_, rgb) : rgb;
    }

private:
    const Image& image_;
    std::array<std::size_t, 3> color_;
    std::optional<Matrix3d> to_srgb_;
};

/// By how many stops 8 bits show too little of a picture: as many as bring all but a twentieth of its pixels
/// below white. 0 where no more than a tenth is above it: lights may be.
double stopsTooBright(const Image& image) {
    const SrgbPixels srgb(image);
    const std::size_t pixels = std::size_t{image.width} * image.height;
    std::vector<double> brightest(pixels);
    for (std::size_t p = 0; p < pixels; ++p) {
        const Vec3d rgb = srgb[p];
        const double value = std::max({rgb[0], rgb[1], rgb[2]});
        brightest[p] = std::isfinite(value) ? value : 0;
    }
    const auto above = static_cast<std::size_t>(
        std::count_if(brightest.begin(), brightest.end(), [](double value) { return value > 1; }));
    if (above <= pixels / 10) return 0;
    const auto nearly_all = brightest.begin() + static_cast<std::ptrdiff_t>(pixels - 1 - pixels / 20);
    std::nth_element(brightest.begin(), nearly_all, brightest.end());
    return std::log2(*nearly_all);
}

void tellClipped(const std::string& path, const Image& image, const EncodedImage& encoded) {
    const double share =
        static_cast<double>(encoded.clipped_values) / static_cast<double>(encoded.rgb.size());
    const std::string clipped = fmt::format(
        "'{}': {} of the colour values are above white or outside the colour space and were clipped", path,
        percentText(share));
    // Above white are no more pixels than clipped values.
    const double stops = 3 * share > 0.1 ? stopsTooBright(image) : 0;
    if (stops > 0)
        logWarning(
            "{}; the image is overexposed: reduce film.exposure_ev by about {:.1f} stops",
            clipped, std::ceil(stops * 10) / 10);
    else
        logInfo("{}", clipped);
}

}  // namespace

EncodedImage encodeSrgb8(const Image& image) {
    const SrgbPixels srgb(image);
    const std::size_t pixels = std::size_t{image.width} * image.height;
    EncodedImage encoded;
    encoded.rgb.resize(3 * pixels);
    std::atomic<std::uint64_t> clipped{0};
    parallelFor(pixels, std::size_t{1} << 14, [&](std::size_t first, std::size_t end) {
        std::uint64_t clipped_here = 0;
        for (std::size_t p = first; p < end; ++p) {
            const Vec3d rgb = onScreen(image.view, srgb[p]);
            for (std::size_t c = 0; c < 3; ++c) {
                const double value = rgb[c] >= 0.0 ? std::min(rgb[c], 1.0) : 0.0;  // NaN is 0.
                // One rounding of float in the conversion from another space is no clipping worth a warning.
                if (!(rgb[c] >= -1e-6 && rgb[c] <= 1.0 + 1e-6)) ++clipped_here;
                encoded.rgb[3 * p + c] =
                    static_cast<std::uint8_t>(std::floor(linearToSrgb(value) * 255.0 + 0.5));
            }
        }
        clipped += clipped_here;
    });
    encoded.clipped_values = clipped;
    return encoded;
}

void tellWhatIsLost(const std::string& path, const Image& image, const EncodedImage& encoded) {
    if (const double brightest = largestColor(image);
        brightest > 0 &&
        std::all_of(encoded.rgb.begin(), encoded.rgb.end(), [](std::uint8_t v) { return v == 0; }))
        logWarning(
            "'{}' is black: its brightest value is {:.2g}, too dark for 8 bits; increase film.exposure_ev "
            "by about {} stops",
            path, brightest, std::ceil(std::log2(0.5 / brightest)));
    if (encoded.clipped_values > 0) tellClipped(path, image, encoded);
}

}  // namespace crt
