/// Plants: wood as closed tubes, and leaves of two triangles that are folded along the midrib.
///
/// They are made by sums, products, quotients and square roots alone, which IEEE 754 rounds the same
/// everywhere, and written to five decimals: a seed gives the same bytes on every machine.
#pragma once

#include "vectors.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <utility>
#include <vector>

namespace crt::meshgen {

/// splitmix64 (Steele, Lea and Flood 2014). One number an expression: in which order the calls of one are
/// made is the compiler's choice.
class Random {
public:
    explicit Random(std::uint64_t seed) : state_(seed) {}
    double number();  ///< From 0 to 1, which is excluded.
    double between(double low, double high) { return low + (high - low) * number(); }
    Vec direction();  ///< Even over the sphere.
    Vec heading();    ///< Level, even over the circle.

private:
    std::uint64_t state_;
};

/// Cosine and sine of an angle, as x and z: by Taylor's series, since those of C libraries differ in their
/// last bits.
Vec onCircle(double degrees);

/// A level direction, turned about the vertical.
Vec turned(Vec heading, double degrees);

/// Perpendicular to a unit vector, of length 1.
Vec anyNormal(Vec axis);

class Plant {
public:
    struct Corner {
        std::uint32_t position, uv;
    };
    using Triangle = std::array<Corner, 3>;

    /// A closed tube along the points, which ends in a point; its beginning is flat. u goes once around it,
    /// v from end to end. All limbs come before the first leaf.
    void addLimb(std::span<const Vec> points, std::span<const double> radii, unsigned sides);
    /// A rhombus from `base` along the unit vector `axis`, `fold` of its width above or below flat. `upper`
    /// is where its upper side looks, roughly. v goes along it.
    void addLeaf(Vec base, Vec axis, Vec upper, double length, double width, double fold);

    std::size_t triangles() const { return bark_.size() + leaves_.size(); }
    /// Height 1. The foot of the trunk stays at the origin.
    void normalise();
    /// The groups are `bark`, which has normals, and `leaves`. Throws std::runtime_error where the file
    /// cannot be written.
    void writeObj(const std::filesystem::path& path, const char* title) const;

private:
    Corner corner(std::size_t position, double u, double v);

    std::vector<Vec> positions_, normals_;
    std::vector<std::pair<int, int>> uvs_;  // in thousandths
    std::map<std::pair<int, int>, std::uint32_t> uv_index_;
    std::vector<Triangle> bark_, leaves_;
};

/// A tree with a bare trunk below a round crown. Branches grow towards points in the crown that no other is
/// near (space colonisation: Runions, Lane and Prusinkiewicz 2007); cross-sections are those of all branches
/// beyond together. As many leaves as make up `triangles`, an even number. Throws std::runtime_error where
/// that is less than the wood alone has.
Plant broadleaf(std::uint64_t seed, std::size_t triangles);

/// Whorls of drooping branches around a straight trunk, with needles. As above.
Plant conifer(std::uint64_t seed, std::size_t triangles);

/// A rosette of fronds. Its bark is their stems.
Plant fern(std::uint64_t seed);

/// A round patch of blades, six times as wide as high, without bark.
Plant grass(std::uint64_t seed);

}  // namespace crt::meshgen
