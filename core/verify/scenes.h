/// Scenes that many cases share, as YAML, so that a case can be copied out and rendered by hand (`crt verify -o DIR` keeps them).
#pragma once

#include <string>

namespace crt::verify {

/// Unit cube seen from inside, each wall a quad facing inwards, all of one reflectance.
struct Cube {
    std::string reflectance = "0.5";          ///< A spectrum.
    std::string emitting = "all";             ///< Wall that emits, or all: floor, ceiling, left, right, back, front.
    std::string radiance = "1";               ///< A spectrum.
    std::string camera = "{position: [0.3, 0.4, 0.2], target: [0.6, 0.5, 0.9], fov: 80}";
    std::string integrator = "{max_depth: 8, roulette: false, nee: false}";
    std::string film = "{resolution: [4, 4]}";
    std::string more;                         ///< Further top-level lines.
};
std::string yaml(const Cube& cube);

/// A square light of side 1 at height 1 over a large Lambertian floor of reflectance 1, seen through a needle's eye at (x, 0, 0).
std::string squareOverFloor(double x, const std::string& integrator = "{max_depth: 1, roulette: false}", double half_side = 0.5,
                            const std::string& radiance = "1");

/// Needle's eyes on the cube's walls, for probes at a point.
inline constexpr const char* kFloorCentre = "{position: [0.5, 0.5, 0.1], target: [0.5, 0, 0.5], fov: 0.01}";
inline constexpr const char* kFloorQuarter = "{position: [0.5, 0.5, 0.5], target: [0.25, 0, 0.25], fov: 0.01}";
inline constexpr const char* kWallCentre = "{position: [0.5, 0.4, 0.2], target: [0, 0.5, 0.5], fov: 0.01}";
inline constexpr const char* kCeilingCentre = "{position: [0.4, 0.2, 0.2], target: [0.5, 1, 0.5], fov: 0.01}";

}  // namespace crt::verify
