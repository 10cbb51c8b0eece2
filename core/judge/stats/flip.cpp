#include "judge/stats/flip.h"

#include "judge/stats/color_difference.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <future>
#include <limits>
#include <numbers>
#include <numeric>
#include <thread>

namespace crt::stats {
namespace {

using std::numbers::pi;
using Plane = std::vector<double>;
using Planes = std::array<Plane, 3>;

// Section 4.1 and table 1 of the 2020 paper: contrast sensitivity as Gaussians; 4.2: exponents and knee of
// the colour error; 4.3: feature width.
struct ContrastSensitivity {
    double a1, b1, a2, b2;
};
constexpr ContrastSensitivity kAchromatic{1, 0.0047, 0, 1e-5}, kRedGreen{1, 0.0053, 0, 1e-5},
    kBlueYellow{34.1, 0.04, 13.5, 0.025};
constexpr double kColorExponent = 0.7, kKneeIn = 0.4, kKneeOut = 0.95;
constexpr double kFeatureExponent = 0.5, kFeatureWidthDegrees = 0.082;

// -------------------------------------------------------------------------------------------- colour spaces

/// Opponent colours, linear in XYZ: what contrast sensitivities are measured in.
Color toYcxcz(const Color& rgb) {
    const Color xyz = linearSrgbToXyz(rgb);
    const double x = xyz[0] / kD65White[0], y = xyz[1] / kD65White[1], z = xyz[2] / kD65White[2];
    return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

Color fromYcxcz(const Color& c) {
    const double y = (c[0] + 16) / 116, x = y + c[1] / 500, z = y - c[2] / 200;
    return xyzToLinearSrgb({x * kD65White[0], y * kD65White[1], z * kD65White[2]});
}

/// CIE L*a*b*, its chroma weighed by lightness: colours of dark pixels differ less to the eye (Hunt 1952).
Lab toHuntLab(const Color& rgb) {
    const Lab lab = labFromLinearSrgb(rgb);
    return {lab.lightness, 0.01 * lab.lightness * lab.a, 0.01 * lab.lightness * lab.b};
}

/// City block in lightness, Euclidean in chroma, which large differences ask for (Abasi et al. 2020).
double hyab(const Lab& p, const Lab& q) {
    return std::abs(p.lightness - q.lightness) + std::hypot(p.a - q.a, p.b - q.b);
}

// -------------------------------------------------------------------------------------------------- filters

/// Taps −r … r.
using Taps = std::vector<double>;

/// Row by row and then column by column; what lies beyond the border is the pixel at the border.
Plane convolve(const Plane& in, std::size_t width, std::size_t height, const Taps& horizontal,
               const Taps& vertical) {
    const std::size_t radius = horizontal.size() / 2;
    Plane rows(in.size(), 0.0), out(in.size(), 0.0), padded(width + 2 * radius);
    for (std::size_t y = 0; y < height; ++y) {
        const double* line = &in[y * width];
        std::fill_n(padded.begin(), radius, line[0]);
        std::copy_n(line, width, padded.begin() + static_cast<std::ptrdiff_t>(radius));
        std::fill_n(padded.end() - static_cast<std::ptrdiff_t>(radius), radius, line[width - 1]);
        double* to = &rows[y * width];
        for (std::size_t k = 0; k < horizontal.size(); ++k)
            for (std::size_t x = 0; x < width; ++x) to[x] += horizontal[k] * padded[x + k];
    }
    const auto reach = static_cast<std::ptrdiff_t>(vertical.size() / 2);
    const auto last = static_cast<std::ptrdiff_t>(height) - 1;
    for (std::ptrdiff_t y = 0; y <= last; ++y)
        for (std::ptrdiff_t k = -reach; k <= reach; ++k) {
            const double* from =
                &rows[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(y + k, 0, last)) * width];
            double* to = &out[static_cast<std::size_t>(y) * width];
            const double weight = vertical[static_cast<std::size_t>(k + reach)];
            for (std::size_t x = 0; x < width; ++x) to[x] += weight * from[x];
        }
    return out;
}

void scale(Taps& taps, double factor) {
    for (double& t : taps) t *= factor;
}
double sum(const Taps& taps) { return std::accumulate(taps.begin(), taps.end(), 0.0); }

/// exp(−π²x²/b), x in degrees: the Fourier transform of a Gaussian contrast sensitivity (2020, equation
/// 2).
Taps sensitivityTaps(double b, int radius, double pixels_per_degree) {
    Taps taps;
    for (int i = -radius; i <= radius; ++i)
        taps.push_back(std::exp(-pi * pi * i * i / (pixels_per_degree * pixels_per_degree * b)));
    return taps;
}

/// One channel as the eye resolves it at this distance. The two-dimensional filter is a sum of two
/// Gaussians, each of them separable; together they weigh 1.
Plane blurAsSeen(const Plane& in, std::size_t width, std::size_t height, const ContrastSensitivity& csf,
                 double pixels_per_degree) {
    const double widest = std::max({kAchromatic.b1, kRedGreen.b1, kBlueYellow.b1});
    const int radius =
        static_cast<int>(std::ceil(3 * std::sqrt(widest / (2 * pi * pi)) * pixels_per_degree));
    Taps first = sensitivityTaps(csf.b1, radius, pixels_per_degree),
         second = sensitivityTaps(csf.b2, radius, pixels_per_degree);
    const double s1 = csf.a1 * std::sqrt(pi / csf.b1) * sum(first) * sum(first),
                 s2 = csf.a2 * std::sqrt(pi / csf.b2) * sum(second) * sum(second);
    const double share = s1 / (s1 + s2);
    scale(first, 1 / sum(first));
    scale(second, 1 / sum(second));
    Plane out = convolve(in, width, height, first, first);
    if (share == 1) return out;
    const Plane other = convolve(in, width, height, second, second);
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = share * out[i] + (1 - share) * other[i];
    return out;
}

/// A Gaussian as wide as an edge is seen, and its first two derivatives, each with its positive taps adding
/// to 1 and its negative ones to −1 (2020, section 4.3).
struct FeatureTaps {
    Taps gaussian, edge, point;
};
FeatureTaps featureTaps(double pixels_per_degree) {
    const double deviation = 0.5 * kFeatureWidthDegrees * pixels_per_degree;
    const int radius = static_cast<int>(std::ceil(3 * deviation));
    FeatureTaps taps;
    for (int i = -radius; i <= radius; ++i) {
        const double g = std::exp(-i * i / (2 * deviation * deviation));
        taps.gaussian.push_back(g);
        taps.edge.push_back(-i * g);
        taps.point.push_back((i * i / (deviation * deviation) - 1) * g);
    }
    scale(taps.gaussian, 1 / sum(taps.gaussian));
    const auto balance = [](Taps& of) {
        double positive = 0, negative = 0;
        for (const double t : of) (t > 0 ? positive : negative) += t;
        for (double& t : of) t /= t > 0 ? positive : -negative;
    };
    balance(taps.edge);
    balance(taps.point);
    return taps;
}

// ----------------------------------------------------------------------------------------------- comparison

/// One image, ready to be compared.
struct Seen {
    std::vector<Lab> lab;    ///< As blurred by the eye.
    Plane edge, point;       ///< Strength of edges and points, of the sharp image.
};

struct Viewing {
    double pixels_per_degree;
    FeatureTaps features;
};

Plane magnitude(const Plane& x, const Plane& y) {
    Plane out(x.size());
    for (std::size_t i = 0; i < x.size(); ++i) out[i] = std::sqrt(x[i] * x[i] + y[i] * y[i]);
    return out;
}

/// `shown` is linear RGB in [0, 1].
Seen see(const std::vector<Color>& shown, std::size_t width, std::size_t height, const Viewing& viewing) {
    Planes opponent;
    for (Plane& plane : opponent) plane.resize(shown.size());
    Plane grey(shown.size());
    for (std::size_t i = 0; i < shown.size(); ++i) {
        const Color c = toYcxcz(shown[i]);
        for (std::size_t k = 0; k < 3; ++k) opponent[k][i] = c[k];
        grey[i] = (c[0] + 16) / 116;
    }
    Seen seen;
    const auto& [gaussian, edge, point] = viewing.features;
    seen.edge = magnitude(convolve(grey, width, height, edge, gaussian),
                          convolve(grey, width, height, gaussian, edge));
    seen.point = magnitude(convolve(grey, width, height, point, gaussian),
                           convolve(grey, width, height, gaussian, point));

    const std::array<ContrastSensitivity, 3> sensitivities{kAchromatic, kRedGreen, kBlueYellow};
    for (std::size_t k = 0; k < 3; ++k)
        opponent[k] = blurAsSeen(opponent[k], width, height, sensitivities[k], viewing.pixels_per_degree);
    seen.lab.resize(shown.size());
    for (std::size_t i = 0; i < shown.size(); ++i) {
        Color rgb = fromYcxcz({opponent[0][i], opponent[1][i], opponent[2][i]});
        for (double& v : rgb) v = std::clamp(v, 0.0, 1.0);
        seen.lab[i] = toHuntLab(rgb);
    }
    return seen;
}

/// [0, largest] → [0, 1]: small differences get nearly all of the range (2020, section 4.2).
double redistribute(double difference, double largest) {
    const double knee = kKneeIn * largest;
    if (difference < knee) return kKneeOut / knee * difference;
    return kKneeOut + (difference - knee) / (largest - knee) * (1 - kKneeOut);
}

/// ΔE = ΔE_color ^ (1 − ΔE_feature)
void compareSeen(const Seen& test, const Seen& reference, std::vector<float>& largest_error) {
    // Of all pairs of screen colours, green and blue are farthest apart.
    static const double farthest =
        std::pow(hyab(toHuntLab({0, 1, 0}), toHuntLab({0, 0, 1})), kColorExponent);
    for (std::size_t i = 0; i < test.lab.size(); ++i) {
        const double color =
            redistribute(std::pow(hyab(test.lab[i], reference.lab[i]), kColorExponent), farthest);
        const double edge = std::abs(test.edge[i] - reference.edge[i]),
                     point = std::abs(test.point[i] - reference.point[i]);
        const double feature = std::pow(std::max(edge, point) / std::numbers::sqrt2, kFeatureExponent);
        largest_error[i] = std::max(largest_error[i], static_cast<float>(std::pow(color, 1 - feature)));
    }
}

void finish(FlipResult& result) {
    result.mean = std::accumulate(result.error.begin(), result.error.end(), 0.0) /
                  static_cast<double>(result.error.size());
}

// ------------------------------------------------------------------------------------------------- exposure

/// (k₀x² + k₁x + k₂) / (k₃x² + k₄x + k₅): Narkowicz' fit to the ACES curve, its input scaled
/// by 0.6 (2021, section 3).
struct ToneCurve {
    std::array<double, 6> k{0.6 * 0.6 * 2.51, 0.6 * 0.03, 0, 0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14};

    double operator()(double x) const {
        return std::clamp((k[0] * x * x + k[1] * x + k[2]) / (k[3] * x * x + k[4] * x + k[5]), 0.0, 1.0);
    }
    /// The x that is shown as `value`.
    double inverse(double value) const {
        const double a = k[0] - value * k[3], b = k[1] - value * k[4], c = k[2] - value * k[5];
        return (-b + std::sqrt(b * b - 4 * a * c)) / (2 * a);
    }
};

/// From the exposure that shows the brightest pixel at 0.85 to the one that shows the median there, in
/// stops. False when nothing is bright.
bool chooseExposures(const RgbView& reference, const ToneCurve& curve, FlipResult& result) {
    constexpr Color kLuminance{
        0.2126, 0.7152, 0.0722};  // To four digits, as Rec. 709 has them and the authors take them here.
    std::vector<double> luminance(reference.values.size() / 3);
    for (std::size_t i = 0; i < luminance.size(); ++i)
        for (std::size_t c = 0; c < 3; ++c) luminance[i] += kLuminance[c] * reference.values[3 * i + c];
    std::sort(luminance.begin(), luminance.end());
    const double median =
        luminance[luminance.size() / 2];  // Of two in the middle, theirs is the brighter one.
    // Of a mostly black image, the authors' program takes one float rounding for the median.
    const double dark = std::max(median, 0x1p-23), bright = luminance.back(), shown = curve.inverse(0.85);
    if (bright <= 0) return false;
    result.start_exposure = std::log2(shown / bright);
    result.stop_exposure = std::max(std::log2(shown / dark), result.start_exposure);
    result.exposures =
        std::max(2, static_cast<int>(std::ceil(result.stop_exposure - result.start_exposure)));
    return true;
}

std::vector<Color> show(const RgbView& image, double gain, const ToneCurve& curve) {
    std::vector<Color> shown(image.values.size() / 3);
    for (std::size_t i = 0; i < shown.size(); ++i)
        for (std::size_t c = 0; c < 3; ++c)
            shown[i][c] = curve(gain * std::max(0.0f, image.values[3 * i + c]));
    return shown;
}

}  // namespace

FlipResult flipLdr(const RgbView& test, const RgbView& reference, double pixels_per_degree) {
    requireSameSize(test, reference);
    FlipResult result;
    result.error.assign(reference.values.size() / 3, 0.0f);
    if (!test.allFinite() || !reference.allFinite()) {
        result.mean = std::numeric_limits<double>::quiet_NaN();
        return result;
    }
    const Viewing viewing{pixels_per_degree, featureTaps(pixels_per_degree)};
    const auto seen = [&](const RgbView& image) {
        std::vector<Color> shown(image.values.size() / 3);
        for (std::size_t i = 0; i < shown.size(); ++i)
            for (std::size_t c = 0; c < 3; ++c)
                shown[i][c] = std::clamp(static_cast<double>(image.values[3 * i + c]), 0.0, 1.0);
        return see(shown, image.width, image.height, viewing);
    };
    compareSeen(seen(test), seen(reference), result.error);
    finish(result);
    return result;
}

FlipResult flipHdr(const RgbView& test, const RgbView& reference, double pixels_per_degree) {
    requireSameSize(test, reference);
    FlipResult result;
    result.error.assign(reference.values.size() / 3, 0.0f);
    const ToneCurve curve;
    if (!test.allFinite() || !reference.allFinite() || !chooseExposures(reference, curve, result)) {
        result.mean = std::numeric_limits<double>::quiet_NaN();
        return result;
    }
    const Viewing viewing{pixels_per_degree, featureTaps(pixels_per_degree)};
    // Exposures are independent of each other, and the largest error is that in any order. A few threads:
    // each holds some 250 bytes a pixel.
    constexpr unsigned kMostThreads = 4;
    const unsigned threads = std::clamp(std::thread::hardware_concurrency(), 1u,
                                        std::min(kMostThreads, static_cast<unsigned>(result.exposures)));
    std::vector<std::future<std::vector<float>>> parts;
    for (unsigned first = 0; first < threads; ++first)
        parts.push_back(std::async(std::launch::async, [&, first] {
            std::vector<float> error(result.error.size(), 0.0f);
            for (int i = static_cast<int>(first); i < result.exposures; i += static_cast<int>(threads)) {
                const double stops =
                    result.start_exposure +
                    i * (result.stop_exposure - result.start_exposure) / (result.exposures - 1);
                const double gain = std::exp2(stops);
                compareSeen(see(show(test, gain, curve), test.width, test.height, viewing),
                            see(show(reference, gain, curve), reference.width, reference.height, viewing),
                            error);
            }
            return error;
        }));
    for (auto& part : parts) {
        const std::vector<float> error = part.get();
        for (std::size_t i = 0; i < error.size(); ++i) result.error[i] = std::max(result.error[i], error[i]);
    }
    finish(result);
    return result;
}

}  // namespace crt::stats
