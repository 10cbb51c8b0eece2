/// Scenes that many cases share, as YAML, so that a case can be copied out and rendered by hand (`crt verify
/// -o DIR` keeps them).
#pragma once

#include "scene/scene.h"

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace crt::verify {

/// An image of linear red, green and blue, the top row first, for scenes that name it.
void writeRgb(const std::string& path, OutputFormat format, std::uint32_t width, std::uint32_t height,
              const std::vector<float>& rgb);

/// Unit cube seen from inside, each wall a quad facing inwards, all of one reflectance.
struct Cube {
    std::string reflectance = "0.5";          ///< A spectrum.
    std::string emitting = "all";  ///< Wall that emits, or all: floor, ceiling, left, right, back, front.
    std::string radiance = "1";               ///< A spectrum.
    std::string camera = "{position: [0.3, 0.4, 0.2], target: [0.6, 0.5, 0.9], fov: 80}";
    std::string integrator = "{max_depth: 8, roulette: false, nee: false}";
    std::string film = "{resolution: [4, 4]}";
    std::string more;                         ///< Further top-level lines.
};
std::string yaml(const Cube& cube);

/// One scattering event: direct light.
inline constexpr const char* kDirect = "{max_depth: 1, roulette: false}";
/// Of them, light sampling and scattered rays together, and each alone where it can be.
inline constexpr std::pair<const char*, const char*> kDirectTechniques[] = {
    {"MIS", kDirect},
    {"scattered rays", "{max_depth: 1, roulette: false, nee: false}"},
    {"light sampling", "{max_depth: 1, roulette: false, mis: false}"}};

/// A square light of side 1 at height 1 over a large Lambertian floor of reflectance 1, seen through a
/// needle's eye at (x, 0, 0).
std::string squareOverFloor(double x, const std::string& integrator = kDirect, double half_side = 0.5,
                            const std::string& radiance = "1");

using Point = std::array<double, 3>;

/// A scene put together piece by piece, as YAML.
class Stage {
public:
    explicit Stage(const std::string& camera, const std::string& integrator = kDirect);
    /// A further or another top-level key, as "environment", "{radiance: 1}".
    Stage& set(const std::string& key, const std::string& value);
    /// As "glass", "{type: dielectric, ior: 1.5}".
    Stage& material(const std::string& name, const std::string& definition);
    /// Four corners, counter-clockwise seen from the front. `radiance` empty: no light; "…, two_sided:
    /// true" is possible.
    Stage& quad(const std::string& name, const std::string& corners, const std::string& material,
                const std::string& radiance = "");
    Stage& mesh(const std::string& name, const std::string& positions, const std::string& faces,
                const std::string& material, const std::string& radiance = "");
    /// Any object, by its keys: "sphere: {radius: 1}, material: glass".
    Stage& object(const std::string& keys);
    /// Axis-parallel box with outward normals.
    Stage& box(const std::string& name, const Point& lower, const Point& upper, const std::string& material);
    std::string yaml() const;

private:
    std::map<std::string, std::string> top_;
    std::string materials_, objects_;
};

/// Needle's eyes on the cube's walls, for probes at a point.
inline constexpr const char* kFloorCentre = "{position: [0.5, 0.5, 0.1], target: [0.5, 0, 0.5], fov: 0.01}";
inline constexpr const char* kFloorQuarter =
    "{position: [0.5, 0.5, 0.5], target: [0.25, 0, 0.25], fov: 0.01}";
inline constexpr const char* kWallCentre = "{position: [0.5, 0.4, 0.2], target: [0, 0.5, 0.5], fov: 0.01}";
inline constexpr const char* kCeilingCentre =
    "{position: [0.4, 0.2, 0.2], target: [0.5, 1, 0.5], fov: 0.01}";

}  // namespace crt::verify
