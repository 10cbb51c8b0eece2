/// Axis-aligned boxes in double precision.
#pragma once

#include "base/vec3d.h"

#include <algorithm>
#include <cstddef>
#include <limits>

namespace crt {

/// Empty until something is added.
struct Box {
    static constexpr double kInf = std::numeric_limits<double>::infinity();
    Vec3d lower{kInf, kInf, kInf}, upper{-kInf, -kInf, -kInf};

    /// A cube of half size `padding` around a point; 0: the point.
    void add(const Vec3d& p, double padding = 0) {
        for (std::size_t k = 0; k < 3; ++k) {
            lower[k] = std::min(lower[k], p[k] - padding);
            upper[k] = std::max(upper[k], p[k] + padding);
        }
    }
    void add(const Box& other) {
        for (std::size_t k = 0; k < 3; ++k) {
            lower[k] = std::min(lower[k], other.lower[k]);
            upper[k] = std::max(upper[k], other.upper[k]);
        }
    }
    /// Bit k of `i` chooses between lower and upper of axis k.
    Vec3d corner(std::size_t i) const {
        Vec3d p;
        for (std::size_t k = 0; k < 3; ++k) p[k] = ((i >> k & 1) != 0 ? upper : lower)[k];
        return p;
    }
    bool meets(const Box& other) const {
        for (std::size_t k = 0; k < 3; ++k)
            if (lower[k] > other.upper[k] || other.lower[k] > upper[k]) return false;
        return true;
    }
};

}  // namespace crt
