/// Points and directions of the meshes that crt-meshgen makes.
#pragma once

#include <cmath>

namespace crt::meshgen {

inline constexpr double kPi = 3.14159265358979323846;

struct Vec {
    double x = 0, y = 0, z = 0;
};
inline Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec operator*(double s, Vec a) { return {s * a.x, s * a.y, s * a.z}; }
inline double dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec cross(Vec a, Vec b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(Vec a) { return std::sqrt(dot(a, a)); }
inline Vec unit(Vec a) { return (1.0 / length(a)) * a; }
inline Vec mix(Vec a, Vec b, double t) { return (1.0 - t) * a + t * b; }
inline Vec mirrorX(Vec a) { return {-a.x, a.y, a.z}; }
inline Vec mirrorZ(Vec a) { return {a.x, a.y, -a.z}; }

}  // namespace crt::meshgen
