/// The brightness of emission that is an image, by place: what the tiles of an emitter are chosen by
/// (kernel/lights/light.h).
#pragma once

#include "kernel/dialect/layout.h"
#include "scene/scene.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace crt {

/// More tiles, of all emitters together, are not made.
inline constexpr std::size_t kMostTiles = std::size_t{1} << 16;

/// Barycentrics of a tile's corners, of the second and third vertex of the triangle.
using TileCorners = std::array<std::array<double, 2>, 3>;

/// The tiles of a triangle with `rows` of them along each edge, in the order of the light table: as a
/// light's `corner` has them, and where their corners are.
struct Tile {
    std::uint32_t corner = 0;
    TileCorners at{};
};
std::vector<Tile> tilesOf(std::uint32_t rows);

class EmissionImage {
public:
    /// `texture`: an image of spectra whose factor is a radiance. Decodes it.
    explicit EmissionImage(const Texture& texture);

    /// The number of texels that a triangle covers.
    double texelsUnder(const kernel::CrtUvs& uvs) const;

    /// Mean of the image over a tile of a triangle, of which 1 would be everywhere where all texels are
    /// white.
    double mean(const kernel::CrtUvs& uvs, const TileCorners& tile) const;

private:
    struct Level {
        std::uint32_t width = 0, height = 0;
        std::vector<float> brightness;
    };
    std::array<double, 2> placeOf(double u, double v) const;
    double at(const Level& level, const std::array<double, 2>& place) const;

    std::array<double, 6> from_uv_{};
    std::uint32_t wrap_ = 0;
    std::vector<std::vector<Tile>> parts_;  ///< Of a tile, with 1, 2, … rows.
    std::vector<Level> levels_;             ///< The image, and then each of half the one before.
};

}  // namespace crt
