/// The cost of the tables of materials, counted before any of them is made, and the most that a scene may
/// have: a few characters of a file each stand for half a second of a processor.
#pragma once

#include "scene/scene.h"

#include <cstddef>

namespace crt {

class TableWork {
public:
    /// One more table, with this number of steps: directions of microfacets, most often.
    void add(double steps, const Material& material);

    /// Throws crt::Error(Scene) where more than kFewTables would take longer than kMostTableSeconds, or any
    /// longer than the environment variable CRT_TABLE_SECONDS allows; crt::Error(Usage) when that is no
    /// number.
    void requireBounded() const;

    double seconds() const { return steps_ * kSecondsPerStep; }

private:
    /// Measured on one core of a server of 2020, without vectors: with AVX2 it is a third.
    static constexpr double kSecondsPerStep = 1.5e-8;

    double steps_ = 0;
    std::size_t tables_ = 0;
    const Material* last_ = nullptr;  ///< Of the first that is too many; of the last one otherwise.
};

/// Of one processor. Scenes of hundreds of materials stay far below it.
inline constexpr double kMostTableSeconds = 6;

/// So many tables are always made: the slowest, of dispersive glass, take a second each.
inline constexpr std::size_t kFewTables = 9;

}  // namespace crt
