/// Arithmetic of vectors in double precision, for everything that happens before the kernel.
#pragma once

#include <array>
#include <cmath>

namespace crt {

using Vec3d = std::array<double, 3>;

inline Vec3d operator+(const Vec3d& a, const Vec3d& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
inline Vec3d operator-(const Vec3d& a, const Vec3d& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Vec3d operator*(const Vec3d& a, double s) { return {a[0] * s, a[1] * s, a[2] * s}; }
inline double dot(const Vec3d& a, const Vec3d& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Vec3d cross(const Vec3d& a, const Vec3d& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
/// Euclidean. Coordinates whose squares overflow or vanish need scaling first.
inline double length(const Vec3d& a) { return std::sqrt(dot(a, a)); }

}  // namespace crt
