/// RGB → smooth spectrum. W. Jakob and J. Hanika, "A Low-Dimensional Function Space for Efficient Spectral
/// Upsampling", Computer Graphics Forum 38(2), 2019: a reflectance is the sigmoid of a quadratic in
/// wavelength, which is smooth and cannot leave (0,1). The paper tabulates the three coefficients over the
/// RGB cube; a scene has a handful of colours, so here they are solved for when the scene is read, to the
/// last digit and without a table to ship.
#include "base/error.h"
#include "spectra/spectra.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace crt {
namespace {

/// ½ + x / (2√(1+x²)), written so that dark colours (x ≪ 0) do not cancel.
double sigmoid(double x) {
    const double h = std::sqrt(1.0 + x * x);
    return x < 0.0 ? 0.5 / (h * (h - x)) : 0.5 + 0.5 * x / h;
}

double sigmoidSlope(double x) {
    const double h2 = 1.0 + x * x;
    return 0.5 / (h2 * std::sqrt(h2));
}

double inverseSigmoid(double y) { return (y - 0.5) / std::sqrt(y * (1.0 - y)); }

/// Wavelength mapped to [-1,1]: the quadratic's coefficients are then of similar size and the normal matrix
/// is well conditioned.
double normalisedWavelength(std::size_t i) {
    return 2.0 * static_cast<double>(i) / (kSpectrumSize - 1) - 1.0;
}

Spectrum sigmoidSpectrum(const Vec3d& c) {
    Spectrum s;
    for (std::size_t i = 0; i < s.values.size(); ++i) {
        const double t = normalisedWavelength(i);
        s[i] = sigmoid(c[0] + t * (c[1] + t * c[2]));
    }
    return s;
}

/// How much each wavelength of a reflectance under D65 adds to linear sRGB. Each channel sums to exactly
/// what white gives, 1, also where the tabulated D65 and the rounded white point of sRGB differ in the
/// fourth digit; so greys are constants and colours close to grey are close to constants.
const std::array<Spectrum, 3>& rgbWeights() {
    static const std::array<Spectrum, 3> weights = [] {
        const Spectrum d65 = *illuminantSpectrum("D65");
        const Matrix3d to_rgb = xyzToRgb(ColorSpace::LinearSrgb);
        std::array<Spectrum, 3> w;
        for (int channel = 0; channel < 3; ++channel) {
            double sum = 0.0;
            for (std::size_t i = 0; i < d65.values.size(); ++i) {
                for (int j = 0; j < 3; ++j)
                    w[channel][i] += to_rgb[channel][j] * cieObserver()[j][i] * d65[i];
                sum += w[channel][i];
            }
            for (double& v : w[channel].values) v /= sum;
        }
        return w;
    }();
    return weights;
}

struct Residual {
    Vec3d difference{};      ///< Linear sRGB of the spectrum minus the colour asked for.
    Matrix3d jacobian{};     ///< By coefficient.
    double norm2 = 0.0;
};

Residual evaluate(const Vec3d& c, const Vec3d& rgb) {
    const std::array<Spectrum, 3>& weights = rgbWeights();
    Residual r;
    for (std::size_t i = 0; i < kSpectrumSize; ++i) {
        const double t = normalisedWavelength(i);
        const double x = c[0] + t * (c[1] + t * c[2]);
        const double value = sigmoid(x), slope = sigmoidSlope(x);
        for (int k = 0; k < 3; ++k) {
            const double w = weights[k][i];
            r.difference[k] += w * value;
            r.jacobian[k][0] += w * slope;
            r.jacobian[k][1] += w * slope * t;
            r.jacobian[k][2] += w * slope * t * t;
        }
    }
    for (int k = 0; k < 3; ++k) {
        r.difference[k] -= rgb[k];
        r.norm2 += r.difference[k] * r.difference[k];
    }
    return r;
}

/// Solves the symmetric positive definite 3×3 system A x = b by Cholesky; false when A is not numerically
/// definite.
bool solve(Matrix3d A, const Vec3d& b, Vec3d& x) {
    for (int j = 0; j < 3; ++j) {
        for (int k = 0; k < j; ++k) A[j][j] -= A[j][k] * A[j][k];
        if (!(A[j][j] > 0.0)) return false;
        A[j][j] = std::sqrt(A[j][j]);
        for (int i = j + 1; i < 3; ++i) {
            for (int k = 0; k < j; ++k) A[i][j] -= A[i][k] * A[j][k];
            A[i][j] /= A[j][j];
        }
    }
    x = b;
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < i; ++k) x[i] -= A[i][k] * x[k];
        x[i] /= A[i][i];
    }
    for (int i = 2; i >= 0; --i) {
        for (int k = i + 1; k < 3; ++k) x[i] -= A[k][i] * x[k];
        x[i] /= A[i][i];
    }
    return true;
}

/// Gauss–Newton from `c`, with Levenberg–Marquardt damping because at the faces of the RGB cube the sigmoid
/// saturates and a bare step would leave for infinity. Returns the squared error reached.
double fit(Vec3d& c, const Vec3d& rgb) {
    constexpr int kMaxSteps = 400;
    const double good_enough = 1e-24 * *std::max_element(rgb.begin(), rgb.end());
    double damping = 1e-3;
    Residual r = evaluate(c, rgb);
    for (int step = 0; step < kMaxSteps && r.norm2 > good_enough; ++step) {
        Matrix3d normal{};
        Vec3d gradient{};
        for (int i = 0; i < 3; ++i)
            for (int k = 0; k < 3; ++k) {
                gradient[i] -= r.jacobian[k][i] * r.difference[k];
                for (int j = 0; j < 3; ++j) normal[i][j] += r.jacobian[k][i] * r.jacobian[k][j];
            }
        for (int i = 0; i < 3; ++i) normal[i][i] *= 1.0 + damping;
        Vec3d change{};
        Residual next;
        bool better = solve(normal, gradient, change);
        if (better) {
            const Vec3d candidate{c[0] + change[0], c[1] + change[1], c[2] + change[2]};
            next = evaluate(candidate, rgb);
            better = next.norm2 < r.norm2;
            if (better) c = candidate;
        }
        if (better) {
            r = next;
            damping = std::max(damping * 0.2, 1e-14);
        } else {
            damping *= 5.0;
            if (damping > 1e14) break;  // A minimum to the last digit.
        }
    }
    return r.norm2;
}

}  // namespace

Spectrum rgbReflectance(const Vec3d& linear_srgb) {
    for (const double v : linear_srgb)
        if (!(v >= 0.0 && v <= 1.0))
            throw Error(ErrorKind::Scene,
                        fmt::format("a reflectance colour must lie in [0, 1], not [{}, {}, {}]",
                                    linear_srgb[0], linear_srgb[1], linear_srgb[2]));
    if (linear_srgb[0] == linear_srgb[1] && linear_srgb[1] == linear_srgb[2])
        return constantSpectrum(linear_srgb[0]);

    // Walk from the grey of the same mean to the colour: every fit starts close to its solution, so that the
    // corners of the cube are reached without falling into the flat regions where all of the spectrum is
    // saturated.
    constexpr int kWalk = 8;
    const double grey =
        std::clamp((linear_srgb[0] + linear_srgb[1] + linear_srgb[2]) / 3.0, 1e-9, 1.0 - 1e-6);
    Vec3d c{inverseSigmoid(grey), 0, 0};
    for (int step = 1; step <= kWalk; ++step) {
        const double along = static_cast<double>(step) / kWalk;
        Vec3d rgb;
        for (int k = 0; k < 3; ++k) rgb[k] = grey + along * (linear_srgb[k] - grey);
        fit(c, rgb);
    }
    return sigmoidSpectrum(c);
}

Spectrum rgbEmission(const Vec3d& linear_srgb) {
    for (const double v : linear_srgb)
        if (!(v >= 0.0) || !std::isfinite(v))
            throw Error(ErrorKind::Scene,
                        fmt::format("an emission colour must be finite and not negative, not [{}, {}, {}]",
                                    linear_srgb[0], linear_srgb[1], linear_srgb[2]));
    // Half of the range: the sigmoid is smoothest there, and a light has no upper bound that would ask for
    // more.
    const double scale = 2.0 * *std::max_element(linear_srgb.begin(), linear_srgb.end());
    if (scale == 0.0) return constantSpectrum(0.0);
    Spectrum s = rgbReflectance({linear_srgb[0] / scale, linear_srgb[1] / scale, linear_srgb[2] / scale});
    const Spectrum d65 = *illuminantSpectrum("D65");
    for (std::size_t i = 0; i < s.values.size(); ++i) s[i] *= scale * d65[i];
    return s;
}

}  // namespace crt
