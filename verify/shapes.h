/// Geometry and scenes for the verification cases, made in memory: they must not depend on a file or on a
/// reader.
#pragma once

#include "base/vec3d.h"
#include "scene/scene.h"

#include <cstdint>
#include <random>
#include <string>

namespace crt::verify {

// Named here, so that operators of other types in this namespace do not hide them.
using crt::operator+;
using crt::operator-;
using crt::operator*;
Vec3d unit(const Vec3d& a);
/// "[x, y, z]", as scene files have it; and a camera there that sees the origin through a needle's eye.
std::string point(const Vec3d& v);
std::string eyeAt(const Vec3d& position, const char* up);
/// Each coordinate rounded to float, as the kernel will see it.
Vec3d roundToFloat(const Vec3d& a);

/// Seeded numbers that are the same with every standard library.
class Dice {
public:
    explicit Dice(std::uint64_t seed) : engine_(seed) {}
    std::uint64_t bits() { return engine_(); }
    double uniform() { return (static_cast<double>(engine_() >> 11) + 0.5) * 0x1p-53; }
    double uniform(double lower, double upper) { return lower + (upper - lower) * uniform(); }
    Vec3d inBox(double half) { return {uniform(-half, half), uniform(-half, half), uniform(-half, half)}; }
    /// Uniform on the unit sphere.
    Vec3d direction();

private:
    std::mt19937_64 engine_;
};

void addTriangle(Mesh& mesh, const Vec3d& a, const Vec3d& b, const Vec3d& c);
/// Two triangles, a b c and a c d.
void addQuad(Mesh& mesh, const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d);
/// The twelve triangles of an axis-parallel box, facing outwards, or inwards.
Mesh boxMesh(const Vec3d& lower, const Vec3d& upper, bool inwards = false);
/// A geodesic sphere of 20·4^level triangles, facing outwards; vertices rounded to float.
Mesh icosphere(int level, double radius, const Vec3d& centre);

Material diffuse(double reflectance);
Material mirror(double reflectance);
Material glass(double index);

/// Adds a mesh as a separate object. `radiance` 0: it does not emit. Returns the object's index.
std::size_t addObject(Scene& scene, Mesh mesh, Material material, double radiance = 0,
                      bool two_sided = false);

/// Two triangles, 2⁻²⁰ of it in size, that hold the scene's bounding box at centre ± half on every
/// axis, so that its normalisation is known whatever else is in it. Add them last: they are then the scene's
/// last two primitives.
void addAnchors(Scene& scene, const Vec3d& centre, double half);

/// An empty scene: square film, independent sampler, paths without roulette or light sampling, BVH. The
/// camera is a pinhole at `eye`.
Scene emptyScene(int resolution, std::uint64_t seed, const Vec3d& eye, const Vec3d& target,
                 double tan_half_fov);

/// A room, open towards the camera, with a lamp, a mirror block and a diffuse one: light sampling,
/// scattering and tracing all take part. Coordinates are multiples of 2⁻⁴, and at most 1.
Scene litRoom(int resolution, std::uint64_t seed);

/// The scene times `scale`, then moved by `shift`. Its meshes must be placed without transforms.
Scene moved(Scene scene, double scale, const Vec3d& shift);

}  // namespace crt::verify
