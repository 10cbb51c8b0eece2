/// Cells of a cubic grid over ±1, in which all surfaces of a compiled scene lie.
#pragma once

#include "compile/bvh_build.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace crt {

/// The cells that a box meets: those from `first` to `last`, both included, along each axis.
struct CellRange {
    std::array<std::uint32_t, 3> first, last;
    std::uint64_t cells() const {
        std::uint64_t product = 1;
        for (std::size_t k = 0; k < 3; ++k) product *= last[k] - first[k] + 1;
        return product;
    }
};

/// `side`: cells along an axis.
inline CellRange cellsOf(const TriangleBounds& box, float side) {
    const auto cell = [&](float x) {
        return static_cast<std::uint32_t>(std::clamp((x + 1) * 0.5f * side, 0.0f, side - 1));
    };
    CellRange range{};
    for (std::size_t k = 0; k < 3; ++k) {
        range.first[k] = cell(box.lower[k]);
        range.last[k] = cell(box.upper[k]);
    }
    return range;
}

/// Calls visit(cell) until it returns true, and returns whether it did. Numbers of cells are below 2³⁰,
/// and differ for up to 1024 cells along an axis.
template <class Visit>
bool anyCell(const CellRange& range, const Visit& visit) {
    for (std::uint32_t z = range.first[2]; z <= range.last[2]; ++z)
        for (std::uint32_t y = range.first[1]; y <= range.last[1]; ++y)
            for (std::uint32_t x = range.first[0]; x <= range.last[0]; ++x)
                if (visit(std::uint64_t{z} << 20 | std::uint64_t{y} << 10 | x)) return true;
    return false;
}

/// A cell's place in a table of 2^log_size entries, by Fibonacci hashing.
inline std::uint64_t cellHash(std::uint64_t cell, int log_size) {
    return cell * 0x9e3779b97f4a7c15ull >> (64 - log_size);
}

}  // namespace crt
