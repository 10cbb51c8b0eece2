#include "verify/shapes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

namespace crt::verify {

Vec3d unit(const Vec3d& a) { return a * (1 / length(a)); }
std::string point(const Vec3d& v) { return fmt::format("[{:.17g}, {:.17g}, {:.17g}]", v[0], v[1], v[2]); }

std::string eyeAt(const Vec3d& position, const char* up) {
    return fmt::format("{{position: {}, target: [0, 0, 0], up: {}, fov: 0.001}}", point(position), up);
}

Vec3d roundToFloat(const Vec3d& a) {
    return {static_cast<float>(a[0]), static_cast<float>(a[1]), static_cast<float>(a[2])};
}

Vec3d Dice::direction() {
    const double z = uniform(-1, 1), phi = uniform(0, 2 * std::numbers::pi), r = std::sqrt(1 - z * z);
    return {r * std::cos(phi), r * std::sin(phi), z};
}

void addTriangle(Mesh& mesh, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), {a, b, c});
    mesh.triangles.push_back({first, first + 1, first + 2});
}

void addQuad(Mesh& mesh, const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), {a, b, c, d});
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangles.push_back({first, first + 2, first + 3});
}

Mesh boxMesh(const Vec3d& lower, const Vec3d& upper, bool inwards) {
    Mesh mesh;
    for (unsigned corner = 0; corner < 8; ++corner)
        mesh.positions.push_back({corner & 1 ? upper[0] : lower[0], corner & 2 ? upper[1] : lower[1],
                                  corner & 4 ? upper[2] : lower[2]});
    constexpr std::uint32_t kFaces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                            {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (const auto& f : kFaces) {
        mesh.triangles.push_back({f[0], f[inwards ? 2 : 1], f[inwards ? 1 : 2]});
        mesh.triangles.push_back({f[0], f[inwards ? 3 : 2], f[inwards ? 2 : 3]});
    }
    return mesh;
}

Mesh icosphere(int level, double radius, const Vec3d& centre) {
    const double g = std::numbers::phi;
    std::vector<Vec3d> points{{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                              {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
    std::vector<std::array<std::uint32_t, 3>> faces{
        {0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
        {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
        {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
    for (Vec3d& p : points) p = unit(p);
    for (; level > 0; --level) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [where, is_new] =
                middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(points.size()));
            if (is_new) points.push_back(unit(points[a] + points[b]));
            return where->second;
        };
        std::vector<std::array<std::uint32_t, 3>> finer;
        for (const auto& [a, b, c] : faces) {
            const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
        }
        faces = std::move(finer);
    }
    Mesh mesh;
    for (const Vec3d& p : points) mesh.positions.push_back(roundToFloat(centre + p * radius));
    mesh.triangles = std::move(faces);
    return mesh;
}

namespace {

Material materialOf(const char* name, MaterialType type) {
    Material m;
    m.name = name;
    m.type = type;
    return m;
}

}  // namespace

Material diffuse(double reflectance) {
    Material m = materialOf("diffuse", MaterialType::Diffuse);
    m.reflectance = constantSpectrum(reflectance);
    return m;
}

Material mirror(double reflectance) {
    Material m = materialOf("mirror", MaterialType::Mirror);
    m.reflectance = constantSpectrum(reflectance);
    return m;
}

Material glass(double index) {
    Material m = materialOf("glass", MaterialType::Dielectric);
    m.eta = constantSpectrum(index);
    return m;
}

std::size_t addObject(Scene& scene, Mesh mesh, Material material, double radiance, bool two_sided) {
    Object object;
    object.mesh = static_cast<std::uint32_t>(scene.meshes.size());
    object.material = static_cast<std::int32_t>(scene.materials.size());
    if (radiance > 0) {
        object.emission = static_cast<std::int32_t>(scene.emissions.size());
        scene.emissions.push_back({constantSpectrum(radiance), two_sided});
    }
    scene.meshes.push_back(std::move(mesh));
    scene.materials.push_back(std::move(material));
    scene.objects.push_back(std::move(object));
    return scene.objects.size() - 1;
}

void addAnchors(Scene& scene, const Vec3d& centre, double half) {
    Mesh mesh;
    for (const double side : {-1.0, 1.0}) {
        const Vec3d corner = centre + Vec3d{side * half, side * half, side * half};
        // Seen as a triangle by the compiler, by rays hardly ever: a share of some 1e-14 of all directions.
        const double size = -side * half * 0x1p-20;
        addTriangle(mesh, corner, corner + Vec3d{size, 0, 0}, corner + Vec3d{0, size, 0});
    }
    addObject(scene, std::move(mesh), diffuse(0));
}

Scene emptyScene(int resolution, std::uint64_t seed, const Vec3d& eye, const Vec3d& target,
                 double tan_half_fov) {
    Scene scene;
    scene.camera.position = eye;
    scene.camera.target = target;
    const Vec3d view = unit(target - eye);
    scene.camera.up = std::abs(view[1]) < 0.9 ? Vec3d{0, 1, 0} : Vec3d{1, 0, 0};
    scene.camera.tan_half_width = scene.camera.tan_half_height = tan_half_fov;
    scene.film.width = scene.film.height = resolution;
    scene.integrator.nee = false;
    scene.integrator.roulette = false;
    scene.integrator.accelerator = Accelerator::Bvh;
    scene.sampler.type = SamplerType::Independent;
    scene.sampler.seed = seed;
    return scene;
}

Scene litRoom(int resolution, std::uint64_t seed) {
    Scene scene = emptyScene(resolution, seed, {0.5, 0.5, -0.875}, {0.5, 0.5, 0.5}, 0.5);
    scene.integrator.nee = true;
    scene.integrator.max_depth = 6;
    Mesh walls = boxMesh({0, 0, 0}, {1, 1, 1}, true);
    walls.triangles.erase(walls.triangles.begin(), walls.triangles.begin() + 2);
    addObject(scene, std::move(walls), diffuse(0.5));
    addObject(scene, boxMesh({0.25, 0, 0.25}, {0.5, 0.375, 0.5}), mirror(0.75));
    addObject(scene, boxMesh({0.625, 0.25, 0.5}, {0.75, 0.5, 0.6875}), diffuse(0.75));
    Mesh lamp;
    addQuad(lamp, {0.375, 0.9375, 0.375}, {0.625, 0.9375, 0.375}, {0.625, 0.9375, 0.625},
            {0.375, 0.9375, 0.625});
    addObject(scene, std::move(lamp), diffuse(0), 8);
    return scene;
}

Scene moved(Scene scene, double scale, const Vec3d& shift) {
    const auto place = [&](const Vec3d& p) { return p * scale + shift; };
    scene.camera.position = place(scene.camera.position);
    scene.camera.target = place(scene.camera.target);
    scene.camera.aperture_radius *= scale;
    scene.camera.focus_distance *= scale;
    for (Mesh& mesh : scene.meshes)
        for (Vec3d& p : mesh.positions) p = place(p);
    for (Object& object : scene.objects)
        for (Matrix4d& m : object.transforms) {
            if (!object.shape) continue;
            for (std::size_t i = 0; i < 12; ++i) m[i] *= scale;
            for (std::size_t r = 0; r < 3; ++r) m[4 * r + 3] += shift[r];
        }
    return scene;
}

}  // namespace crt::verify
