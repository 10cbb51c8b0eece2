#include "judge/stats/color_difference.h"

#include "base/error.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace crt::stats {
namespace {

constexpr std::array<Color, 3> kRgbToXyz{{{0.412386563252992, 0.357591490920625, 0.180450491203564},
                                          {0.212636821677324, 0.715182981841251, 0.072180196481425},
                                          {0.019330620152484, 0.119197163640208, 0.950372587005435}}};
constexpr std::array<Color, 3> kXyzToRgb{{{3.241003232976359, -1.537398969488786, -0.498615881996363},
                                          {-0.969224252202517, 1.875929983695176, 0.041554226340085},
                                          {0.055639419851975, -0.20401120612391, 1.057148977187533}}};

Color product(const std::array<Color, 3>& m, const Color& v) {
    Color r;
    for (std::size_t i = 0; i < 3; ++i) r[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
    return r;
}

double radians(double degrees) { return degrees * (std::numbers::pi / 180); }

/// In degrees, [0, 360); 0 where there is no hue.
double hueOf(double a, double b) {
    if (a == 0 && b == 0) return 0;
    const double degrees = std::atan2(b, a) * (180 / std::numbers::pi);
    return degrees < 0 ? degrees + 360 : degrees;
}

/// √(C⁷ / (C⁷ + 25⁷)): how far a chroma is beyond the nearly neutral colours.
double saturation(double chroma) {
    const double c7 = std::pow(chroma, 7), k = 6103515625.0;
    return std::sqrt(c7 / (c7 + k));
}

}  // namespace

void requireSameSize(const RgbView& a, const RgbView& b) {
    const std::size_t values = std::size_t{3} * a.width * a.height;
    if (a.width != b.width || a.height != b.height || a.values.size() != values || b.values.size() != values)
        throw Error(ErrorKind::Internal,
                    "a perceptual metric needs two images of the same size with three values per pixel");
}

Color linearSrgbToXyz(const Color& rgb) { return product(kRgbToXyz, rgb); }
Color xyzToLinearSrgb(const Color& xyz) { return product(kXyzToRgb, xyz); }

Lab labFromLinearSrgb(const Color& rgb) {
    const Color xyz = linearSrgbToXyz(rgb);
    const auto f = [](double t) {
        constexpr double delta = 6.0 / 29;
        return t > delta * delta * delta ? std::cbrt(t) : t / (3 * delta * delta) + 4.0 / 29;
    };
    const double x = f(xyz[0] / kD65White[0]), y = f(xyz[1] / kD65White[1]), z = f(xyz[2] / kD65White[2]);
    return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

// Names and numbers of equations are the paper's.
double deltaE2000(const Lab& lab1, const Lab& lab2) {
    // Step 1: chroma and hue, a* stretched where colours are nearly neutral (2–7).
    const double mean_chroma = 0.5 * (std::hypot(lab1.a, lab1.b) + std::hypot(lab2.a, lab2.b));
    const double stretch = 1 + 0.5 * (1 - saturation(mean_chroma));
    const double a1 = stretch * lab1.a, a2 = stretch * lab2.a;
    const double c1 = std::hypot(a1, lab1.b), c2 = std::hypot(a2, lab2.b);
    const double h1 = hueOf(a1, lab1.b), h2 = hueOf(a2, lab2.b);

    // Step 2: differences (8–11). Hues are on a circle, and a neutral colour has none.
    const double dl = lab2.lightness - lab1.lightness, dc = c2 - c1;
    const bool neutral = c1 * c2 == 0;
    double dh = neutral ? 0 : h2 - h1;
    if (dh > 180) dh -= 360;
    if (dh < -180) dh += 360;
    const double dbig_h = 2 * std::sqrt(c1 * c2) * std::sin(radians(0.5 * dh));

    // Step 3: weights at the mean of both (12–22).
    const double l = 0.5 * (lab1.lightness + lab2.lightness), c = 0.5 * (c1 + c2);
    double h = neutral ? h1 + h2 : 0.5 * (h1 + h2);
    if (!neutral && std::abs(h1 - h2) > 180) h += h1 + h2 < 360 ? 180 : -180;
    const double t = 1 - 0.17 * std::cos(radians(h - 30)) + 0.24 * std::cos(radians(2 * h)) +
                     0.32 * std::cos(radians(3 * h + 6)) - 0.20 * std::cos(radians(4 * h - 63));
    const double from_fifty = (l - 50) * (l - 50);
    const double sl = 1 + 0.015 * from_fifty / std::sqrt(20 + from_fifty), sc = 1 + 0.045 * c,
                 sh = 1 + 0.015 * c * t;
    const double turn = 30 * std::exp(-((h - 275) / 25) * ((h - 275) / 25));
    const double rt = -std::sin(radians(2 * turn)) * 2 * saturation(c);
    const double x = dl / sl, y = dc / sc, z = dbig_h / sh;
    return std::sqrt(x * x + y * y + z * z + rt * y * z);
}

ColorDifference deltaE2000(const RgbView& test, const RgbView& reference) {
    requireSameSize(test, reference);
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    if (!test.allFinite() || !reference.allFinite()) return {nan, nan};
    const auto shown = [](const RgbView& image, std::size_t i) {
        Color rgb;
        for (std::size_t c = 0; c < 3; ++c)
            rgb[c] = std::clamp(static_cast<double>(image.values[3 * i + c]), 0.0, 1.0);
        return labFromLinearSrgb(rgb);
    };
    ColorDifference result;
    const std::size_t pixels = reference.values.size() / 3;
    for (std::size_t i = 0; i < pixels; ++i) {
        const double difference = deltaE2000(shown(test, i), shown(reference, i));
        result.mean += difference;
        result.max = std::max(result.max, difference);
    }
    result.mean /= static_cast<double>(pixels);
    return result;
}

}  // namespace crt::stats
