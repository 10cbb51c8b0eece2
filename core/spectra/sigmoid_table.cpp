#include "base/parallel.h"
#include "base/table_store.h"
#include "spectra/sigmoid.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

namespace crt {
namespace {

/// Of the largest component z, and of each other one relative to it.
constexpr std::size_t kLevels = 24, kRatios = 48;
constexpr float kDarkest = 1e-7f, kBrightest = 1.0f - 1.1920929e-7f;

/// x as sin²(πw/2), w in [0, 1]: nodes lie close where coefficients grow, at both ends.
double warped(std::size_t i, std::size_t count) {
    const double sine =
        std::sin(std::numbers::pi / 2 * static_cast<double>(i) / static_cast<double>(count - 1));
    return i + 1 == count ? 1.0 : sine * sine;
}
double levelAt(std::size_t i) { return std::max(warped(i, kLevels), double{kDarkest}); }
double ratioAt(std::size_t i) { return warped(i, kRatios); }

/// w of x in [0, 1], to 5·10⁻⁵: the arc sine's series, up to ½ and from there on.
float unwarped(float x) {
    const bool upper = x > 0.5f;
    const float s = upper ? 1 - x : x;
    const float arc =
        std::sqrt(s) *
        (1 + s * (1 / 6.0f + s * (3 / 40.0f + s * (15 / 336.0f + s * (105 / 3456.0f + s * (945 / 42240.0f +
                                                                                           s * 0.0174f))))));
    const float w = arc * (2 / std::numbers::pi_v<float>);
    return upper ? 1 - w : w;
}

/// The weights of every nanometre on every tenth: exact for what is a cubic between nodes (Lagrange).
std::vector<SigmoidNode> coarseNodes() {
    constexpr std::size_t kStep = 10, kCount = (kSpectrumSize - 1) / kStep + 1;
    static_assert((kCount - 1) * kStep == kSpectrumSize - 1);
    std::vector<SigmoidNode> nodes(kCount);
    for (std::size_t n = 0; n < kCount; ++n)
        nodes[n] = {sigmoidWavelength(static_cast<double>(n * kStep)), {}};
    for (std::size_t i = 0; i < kSpectrumSize; ++i) {
        const std::size_t cell = std::min(i / kStep, kCount - 2);
        const std::size_t first = std::clamp<std::size_t>(cell, 1, kCount - 3) - 1;
        const double x = static_cast<double>(i) / kStep - static_cast<double>(first);  // of nodes 0, 1, 2, 3
        for (std::size_t n = 0; n < 4; ++n) {
            double share = 1;
            for (std::size_t m = 0; m < 4; ++m)
                if (m != n)
                    share *=
                        (x - static_cast<double>(m)) / (static_cast<double>(n) - static_cast<double>(m));
            for (std::size_t k = 0; k < 3; ++k) nodes[first + n].weight[k] += share * rgbWeights()[k][i];
        }
    }
    return nodes;
}

constexpr double kNodeAccuracy = 1e-7;

Vec3d colour(std::size_t channel, double z, double a, double b) {
    Vec3d rgb;
    rgb[channel] = z;
    rgb[(channel + 1) % 3] = a * z;
    rgb[(channel + 2) % 3] = b * z;
    return rgb;
}

}  // namespace

std::size_t SigmoidTable::index(std::size_t channel, std::size_t level, std::size_t a, std::size_t b) {
    return ((channel * kLevels + level) * kRatios + a) * kRatios + b;
}

/// It depends on nothing but the build.
SigmoidTable::SigmoidTable() : nodes_(3 * kLevels * kRatios * kRatios) {
    TableStore().loadOrMake("sigmoids", {{{}, std::as_writable_bytes(std::span(nodes_))}},
                            [this](const std::vector<std::size_t>&) { make(); });
}

void SigmoidTable::make() {
    const std::vector<SigmoidNode> weights = coarseNodes();
    // Each fit starts from that of a neighbour: from equal components down to saturated ones, and there from
    // the middle to dark and bright.
    parallelFor(3 * kRatios, 1, [&](std::size_t row, std::size_t) {
        const std::size_t channel = row / kRatios, a = row % kRatios;
        constexpr std::size_t kMiddle = kLevels / 2;
        Vec3d middle =
            fittedSigmoid(colour(channel, levelAt(kMiddle), ratioAt(a), 1), weights, kNodeAccuracy);
        for (std::size_t b = kRatios; b-- > 0;) {
            const auto fit = [&](Vec3d& c, std::size_t level) {
                if (a + 1 == kRatios && b + 1 == kRatios) return;  // greys: nothing beyond what all have
                const Vec3d rgb = colour(channel, levelAt(level), ratioAt(a), ratioAt(b));
                const double y = (rgb[0] + rgb[1] + rgb[2]) / 3, scale = std::sqrt(y * (1 - y));
                fitSigmoid(c, rgb, weights, kNodeAccuracy);
                nodes_[index(channel, level, a, b)] = {{static_cast<float>(c[0] * scale - (y - 0.5)),
                                                        static_cast<float>(c[1] * scale),
                                                        static_cast<float>(c[2] * scale), 0}};
            };
            fit(middle, kMiddle);
            Vec3d c = middle;
            for (std::size_t level = kMiddle; level-- > 0;) fit(c, level);
            c = middle;
            for (std::size_t level = kMiddle + 1; level < kLevels; ++level) fit(c, level);
        }
    });
}

const SigmoidTable& SigmoidTable::get() {
    static const SigmoidTable table;
    return table;
}

SigmoidTable::Level SigmoidTable::level(float largest) {
    const float z = largest >= kDarkest ? std::min(largest, 1.0f) : kDarkest;
    return {z, 1 / z, unwarped(z) * static_cast<float>(kLevels - 1)};
}

SigmoidCoefficients SigmoidTable::coefficients(const std::array<float, 3>& linear_srgb, std::size_t channel,
                                               const Level& level) const {
    struct Cell {
        std::size_t index;
        float f;
    };
    const auto cellOf = [](float x, std::size_t count) {
        const auto i = std::min(static_cast<std::size_t>(x), count - 2);
        return Cell{i, x - static_cast<float>(i)};
    };
    const auto ratio = [&](std::size_t k) {
        const float r = linear_srgb[(channel + k) % 3] * level.inverse;
        return r > 0 ? std::min(r, 1.0f) : 0.0f;
    };
    const float ratio_a = ratio(1), ratio_b = ratio(2);
    const Cell w = cellOf(level.position, kLevels),
               a = cellOf(unwarped(ratio_a) * static_cast<float>(kRatios - 1), kRatios),
               b = cellOf(unwarped(ratio_b) * static_cast<float>(kRatios - 1), kRatios);
    // Linear between ratios, cubic between levels (Lagrange), but for the brightest, where white is a corner
    // that no cubic goes around.
    constexpr std::size_t kCubic = kLevels - 3;
    const std::size_t first_level =
        w.index < kCubic ? std::clamp<std::size_t>(w.index, 1, kLevels - 3) - 1 : w.index - 2;
    const float x = static_cast<float>(w.index - first_level) + w.f;
    float share[4] = {(x - 1) * (x - 2) * (x - 3) * (-1 / 6.0f), x * (x - 2) * (x - 3) * 0.5f,
                      x * (x - 1) * (x - 3) * -0.5f, x * (x - 1) * (x - 2) * (1 / 6.0f)};
    if (w.index >= kCubic) {
        share[0] = share[1] = 0;
        share[2] = 1 - w.f;
        share[3] = w.f;
    }
    const float corner[4] = {(1 - a.f) * (1 - b.f), (1 - a.f) * b.f, a.f * (1 - b.f), a.f * b.f};
    float c[4] = {};
    for (std::size_t l = 0; l < 4; ++l) {
        const Node* const node = &nodes_[index(channel, first_level + l, a.index, b.index)];
        for (std::size_t k = 0; k < 4; ++k)
            c[k] += share[l] * (corner[0] * node[0].c[k] + corner[1] * node[1].c[k] +
                                corner[2] * node[kRatios].c[k] + corner[3] * node[kRatios + 1].c[k]);
    }
    const float y = std::clamp(level.value * (1 + ratio_a + ratio_b) * (1.0f / 3), kDarkest, kBrightest);
    const float scale = 1 / std::sqrt(y * (1 - y));
    return {(c[0] + (y - 0.5f)) * scale, c[1] * scale, c[2] * scale};
}

SigmoidCoefficients sigmoidCoefficients(const std::array<float, 3>& linear_srgb) {
    std::size_t channel = 0;
    for (std::size_t k = 1; k < 3; ++k)
        if (!(linear_srgb[channel] >= linear_srgb[k])) channel = k;
    return SigmoidTable::get().coefficients(linear_srgb, channel, SigmoidTable::level(linear_srgb[channel]));
}

}  // namespace crt
