/// Integrals over directions, and over the random numbers of a sample, by fixed places and weights.
#pragma once

#include "kernel_test.h"

#include <boost/math/quadrature/gauss.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace bsdf_test {

using namespace kernel_test;
using crt::Vec3d;

constexpr double kPi = 3.14159265358979323846;

inline Vec3d spherical(double cosine, double phi) {
    const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
    return {sine * std::cos(phi), sine * std::sin(phi), cosine};
}

/// Integrals over cells of the sphere, equal in solid angle: cosine by azimuth.
constexpr std::size_t kRows = 32, kColumns = 32, kCells = kRows * kColumns;
/// Places in [0,1] and their weights, which add up to 1.
using Rule = std::vector<std::pair<double, double>>;
/// Gauss and Legendre's, of an even number of places.
template <unsigned kCount>
Rule gauss() {
    using Halves = boost::math::quadrature::gauss<double, kCount>;  // Of [-1,1]: the places above 0.
    Rule rule;
    for (std::size_t i = 0; i < kCount / 2; ++i)
        for (const double side : {-1.0, 1.0})
            rule.emplace_back((1 + side * Halves::abscissa()[i]) / 2, Halves::weights()[i] / 2);
    return rule;
}
inline Rule middles(std::size_t count) {
    Rule rule;
    for (std::size_t i = 0; i < count; ++i)
        rule.emplace_back((static_cast<double>(i) + 0.5) / static_cast<double>(count),
                          1 / static_cast<double>(count));
    return rule;
}
/// Directions in each cell, cell by cell, and their weights: most of the quadrature's time would be their
/// sines.
struct CellRule {
    std::vector<Vec3d> directions;
    std::vector<double> weights;
    explicit CellRule(const Rule& rule) {
        for (const auto& [x, a] : rule)
            for (const auto& [y, b] : rule) weights.push_back(a * b * 4 * kPi / kCells);
        for (std::size_t cell = 0; cell < kCells; ++cell)
            for (const auto& [x, a] : rule)
                for (const auto& [y, b] : rule)
                    directions.push_back(
                        spherical(-1 + 2 * (static_cast<double>(cell / kColumns) + x) / kRows,
                                  -kPi + 2 * kPi * (static_cast<double>(cell % kColumns) + y) / kColumns));
    }
    template <class F>
    double over(std::size_t cell, const F& f) const {
        const Vec3d* direction = directions.data() + cell * weights.size();
        double sum = 0;
        for (std::size_t i = 0; i < weights.size(); ++i) sum += weights[i] * f(direction[i]);
        return sum;
    }
};
/// Where f is smooth in a cell, two of Gauss's rules agree. Elsewhere, as at an edge of a lobe, many steps
/// bound the error by their size.
template <class F>
std::array<double, kCells> overCells(const F& f) {
    static const CellRule coarse(gauss<4>()), fine(gauss<6>()), steps(middles(24));
    constexpr double kAgree = 1e-4, kNothing = 1e-9;
    std::array<double, kCells> cells{};
    for (std::size_t cell = 0; cell < kCells; ++cell) {
        const double there = coarse.over(cell, f);
        cells[cell] = fine.over(cell, f);
        if (!(std::abs(there - cells[cell]) <= kAgree * std::abs(cells[cell]) + kNothing))
            cells[cell] = steps.over(cell, f);
    }
    return cells;
}
inline std::size_t cellOf(const Vec3d& w) {
    const auto at = [](double share, std::size_t n) {
        return std::min(n - 1, static_cast<std::size_t>(std::max(0.0, share) * static_cast<double>(n)));
    };
    return at((w[2] + 1) / 2, kRows) * kColumns + at((std::atan2(w[1], w[0]) + kPi) / (2 * kPi), kColumns);
}
inline double total(const std::array<double, kCells>& cells) {
    double sum = 0;
    for (const double c : cells) sum += c;
    return sum;
}

/// Over both pairs of random numbers, by the sequence R₄ (Roberts 2018).
template <class F>
void overNumbers(F&& f) {
    constexpr u32 kCount = 1u << 16;
    constexpr std::array<double, 4> kSteps{0.8566748838545029, 0.7338918566271260, 0.6287067210378087,
                                           0.5385972572236101};
    for (u32 i = 0; i < kCount; ++i) {
        const auto at = [&](std::size_t k) {
            const double x = 0.5 + (i + 1) * kSteps[k];
            return static_cast<f32>(std::min(x - std::floor(x), 1 - 0x1p-24));
        };
        f(CrtRandom2{at(0), at(1)}, CrtRandom2{at(2), at(3)}, 1.0 / kCount);
    }
}

}  // namespace bsdf_test
