#include "spectra/sigmoid.h"

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

/// The place where the sigmoid is `y`.
double inverseSigmoid(double y) { return (y - 0.5) / std::sqrt(y * (1.0 - y)); }

struct Residual {
    Vec3d difference{};   ///< Linear sRGB of the spectrum minus the colour asked for.
    Matrix3d jacobian{};  ///< By coefficient.
    double norm2 = 0.0;
};

Residual evaluate(const Vec3d& c, const Vec3d& rgb, std::span<const SigmoidNode> nodes) {
    Residual r;
    for (const auto& [t, weight] : nodes) {
        const double x = c[0] + t * (c[1] + t * c[2]);
        const double value = sigmoid(x), slope = sigmoidSlope(x);
        for (std::size_t k = 0; k < 3; ++k) {
            const double w = weight[k];
            r.difference[k] += w * value;
            r.jacobian[k][0] += w * slope;
            r.jacobian[k][1] += w * slope * t;
            r.jacobian[k][2] += w * slope * t * t;
        }
    }
    for (std::size_t k = 0; k < 3; ++k) {
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

}  // namespace

double sigmoidWavelength(double nanometres) { return 2.0 * nanometres / (kSpectrumSize - 1) - 1.0; }

Spectrum sigmoidSpectrum(const Vec3d& c) {
    Spectrum s;
    for (std::size_t i = 0; i < s.values.size(); ++i) {
        const double t = sigmoidWavelength(static_cast<double>(i));
        s[i] = sigmoid(c[0] + t * (c[1] + t * c[2]));
    }
    return s;
}

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

/// Gauss–Newton, with Levenberg–Marquardt damping because at the faces of the RGB cube the sigmoid
/// saturates and a bare step would leave for infinity.
void fitSigmoid(Vec3d& c, const Vec3d& rgb, std::span<const SigmoidNode> nodes, double accuracy) {
    constexpr int kMaxSteps = 400;
    const double good_enough = accuracy * accuracy * *std::max_element(rgb.begin(), rgb.end());
    double damping = 1e-3;
    Residual r = evaluate(c, rgb, nodes);
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
            next = evaluate(candidate, rgb, nodes);
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
}

namespace {

std::span<const SigmoidNode> everyNanometre() {
    static const std::vector<SigmoidNode> nodes = [] {
        std::vector<SigmoidNode> all;
        for (std::size_t i = 0; i < kSpectrumSize; ++i)
            all.push_back({sigmoidWavelength(static_cast<double>(i)),
                           {rgbWeights()[0][i], rgbWeights()[1][i], rgbWeights()[2][i]}});
        return all;
    }();
    return nodes;
}

}  // namespace

Vec3d fittedSigmoid(const Vec3d& rgb, std::span<const SigmoidNode> nodes, double accuracy) {
    // Walk from the grey of the same mean to the colour: every fit starts close to its solution, so that the
    // corners of the cube are reached without falling into the flat regions where all of the spectrum is
    // saturated.
    constexpr int kWalk = 8;
    const double grey = std::clamp((rgb[0] + rgb[1] + rgb[2]) / 3.0, 1e-9, 1.0 - 1e-6);
    Vec3d c{inverseSigmoid(grey), 0, 0};
    for (int step = 1; step <= kWalk; ++step) {
        const double along = static_cast<double>(step) / kWalk;
        Vec3d at;
        for (std::size_t k = 0; k < 3; ++k) at[k] = grey + along * (rgb[k] - grey);
        fitSigmoid(c, at, nodes, accuracy);
    }
    return c;
}

Vec3d fittedSigmoid(const Vec3d& rgb) {
    constexpr double kLastDigit = 1e-12;
    return fittedSigmoid(rgb, everyNanometre(), kLastDigit);
}

}  // namespace crt
