#include "spectra/sigmoid.h"

#include "base/for_avx2.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace crt {
namespace {

/// ½ + x / (2√(1+x²)), where h is √(1+x²). Written so that dark colours (x ≪ 0) do not cancel.
double sigmoid(double x, double h) {
    const double dark = 0.5 / (h * (h - x)), bright = 0.5 + 0.5 * x / h;
    return x < 0.0 ? dark : bright;
}

/// The place where the sigmoid is `y`.
double inverseSigmoid(double y) { return (y - 0.5) / std::sqrt(y * (1.0 - y)); }

struct Residual {
    Vec3d difference{};   ///< Linear sRGB of the spectrum minus the colour asked for.
    Matrix3d jacobian{};  ///< By coefficient.
    double norm2 = 0.0;
};

using Lanes = double __attribute__((vector_size(32)));

/// Sums over nodes, of the channels in the last three lanes: of the weights times the sigmoid, times its
/// slope, and times the slope and t and t².
struct Sums {
    Lanes value{}, slope{}, slope_t{}, slope_tt{};
};

/// Several nodes are computed at a time, then the channels of each: every sum keeps its order, and so its
/// bits. Not returned: how vectors are, depends on the processor.
CRT_FOR_AVX2_TOO void sumOverNodes(const Vec3d& c, std::span<const SigmoidNode> nodes, Sums& sums) {
    constexpr std::size_t kBlock = 64;
    double values[kBlock], slopes[kBlock];
    Sums s;
    for (std::size_t first = 0; first < nodes.size(); first += kBlock) {
        const std::size_t count = std::min(kBlock, nodes.size() - first);
        const SigmoidNode* const block = nodes.data() + first;
        for (std::size_t i = 0; i < count; ++i) {
            const double t = block[i].t, x = c[0] + t * (c[1] + t * c[2]);
            const double h2 = 1.0 + x * x, h = std::sqrt(h2);
            values[i] = sigmoid(x, h);
            slopes[i] = 0.5 / (h2 * h);
        }
        for (std::size_t i = 0; i < count; ++i) {
            static_assert(sizeof(SigmoidNode) == sizeof(Lanes));
            Lanes weights;  // The first lane is t.
            std::memcpy(&weights, &block[i], sizeof weights);
            const Lanes slope = weights * slopes[i], slope_t = slope * block[i].t;
            s.value += weights * values[i];
            s.slope += slope;
            s.slope_t += slope_t;
            s.slope_tt += slope_t * block[i].t;
        }
    }
    sums = s;
}

Residual evaluate(const Vec3d& c, const Vec3d& rgb, std::span<const SigmoidNode> nodes) {
    Sums sums;
    sumOverNodes(c, nodes, sums);
    Residual r;
    for (std::size_t k = 0; k < 3; ++k) {
        r.difference[k] = sums.value[k + 1] - rgb[k];
        r.jacobian[k] = {sums.slope[k + 1], sums.slope_t[k + 1], sums.slope_tt[k + 1]};
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
        const double x = c[0] + t * (c[1] + t * c[2]);
        s[i] = sigmoid(x, std::sqrt(1.0 + x * x));
    }
    return s;
}

double sigmoidAt(const Vec3d& c, double t) {
    const double x = c[0] + t * (c[1] + t * c[2]);
    return sigmoid(x, std::sqrt(1.0 + x * x));
}

Vec3d nearestSigmoid(std::span<const SigmoidTarget> targets) {
    // Begins with the quadratic that is nearest before the sigmoid bends it, and improves that.
    constexpr int kSteps = 4;
    Vec3d c{};
    for (int step = 0; step <= kSteps; ++step) {
        Matrix3d normal{}, of_colour{};
        Vec3d gradient{}, colour{};
        for (const SigmoidTarget& target : targets) {
            const double value = std::clamp(target.value, 1e-6, 1 - 1e-6);
            const double x = step == 0 ? inverseSigmoid(value) : c[0] + target.t * (c[1] + target.t * c[2]);
            const double root = std::sqrt(1 + x * x), slope = 0.5 / (root * root * root);
            const double off = step == 0 ? slope * x : value - sigmoid(x, root);
            const Vec3d row{slope, slope * target.t, slope * target.t * target.t};
            for (std::size_t i = 0; i < 3; ++i) {
                gradient[i] += target.weight * row[i] * off;
                for (std::size_t j = 0; j < 3; ++j) {
                    normal[i][j] += target.weight * row[i] * row[j];
                    of_colour[i][j] += target.colour[i] * row[j];
                }
                colour[i] += target.colour[i] * off;
            }
        }
        if (step > 0)
            for (std::size_t i = 0; i < 3; ++i)
                for (std::size_t k = 0; k < 3; ++k) {
                    gradient[i] += of_colour[k][i] * colour[k];
                    for (std::size_t j = 0; j < 3; ++j) normal[i][j] += of_colour[k][i] * of_colour[k][j];
                }
        Vec3d change{};
        if (!solve(normal, gradient, change)) break;
        c = c + change;
    }
    return c;
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
