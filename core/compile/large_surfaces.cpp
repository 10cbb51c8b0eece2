#include "compile/large_surfaces.h"

#include "kernel/geometry/surface.h"

#include "compile/box.h"
#include "compile/context_of.h"
#include "compile/coplanar.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <map>

namespace crt {
namespace {

using namespace kernel;

constexpr double kLeastError = 1e-3;
constexpr std::size_t kSurfaces = 64, kLights = 4096, kOfAMesh = 8;

Vec3d inDouble(const float* v) {
    return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}
Vec3d inDouble(const vec3& v) {
    return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}

/// A slot, or a triangle of an instance.
struct Surface {
    std::uint32_t slot, instance;  ///< Of the latter 1 + its index; 0: none.
    double clearance;
    bool operator<(const Surface& other) const { return clearance > other.clearance; }
};

/// A light, in the coordinates of the compiled scene: a point, or all that emits of an object.
struct LitFrom {
    Vec3d point;  ///< Its middle.
    std::uint32_t object = CRT_NONE;
    double radius = 0;
    Vec3d front{};  ///< The side to which a flat light shines; 0: it shines to several.
};

class Search {
public:
    explicit Search(const CompiledScene& scene) : context_(contextOf(scene)) {
        triangles_ = CRT_ARRAY(CrtTriangle, context_.blob, context_.scene->triangles);
        primitives_ = CRT_ARRAY(CrtPrimitive, context_.blob, context_.scene->primitives);
        faces_ = CRT_ARRAY(CrtFace, context_.blob, context_.scene->faces);
        shapes_ = CRT_ARRAY(CrtShape, context_.blob, context_.scene->shapes);
    }

    /// Those with the largest clearance.
    std::vector<Surface> surfaces() const {
        std::vector<Surface> found;
        const auto add = [&](const Surface& surface) {
            found.push_back(surface);
            if (found.size() < 2 * kSurfaces) return;
            std::nth_element(found.begin(), found.begin() + kSurfaces, found.end());
            found.resize(kSurfaces);
        };
        const std::map<std::uint32_t, std::vector<std::uint32_t>> meshes = largestOfMeshes();
        for (std::uint32_t slot = 0; slot < context_.scene->triangle_count; ++slot) {
            const std::uint32_t shape = triangles_[slot].shape;
            if (shape < CRT_SLOT_INSTANCE) {
                add({slot, 0, static_cast<double>(faces_[slot].clearance)});
                continue;
            }
            const std::uint32_t instance = shape - CRT_SLOT_INSTANCE;
            const CrtInstance* placed = crt_instance(&context_, instance);
            for (const std::uint32_t of_mesh : meshes.at(placed->first_primitive)) {
                const CrtFace face = crt_placed_face(&context_, triangles_ + of_mesh, instance + 1);
                add({of_mesh, instance + 1, static_cast<double>(face.clearance)});
            }
        }
        std::sort(found.begin(), found.end());
        found.resize(std::min(found.size(), kSurfaces));
        return found;
    }

    /// The emitters of each object together: a lamp that stands on a floor is near to it at one end alone.
    std::vector<LitFrom> emitters() const {
        struct Part {
            Box box;
            Vec3d front{};
            bool begun = false;
        };
        std::map<std::uint32_t, Part> parts;
        const auto* lights = CRT_ARRAY(CrtLight, context_.blob, context_.scene->lights);
        for (std::uint32_t slot = 0; slot < context_.scene->triangle_count; ++slot) {
            const CrtTriangle& triangle = triangles_[slot];
            if (triangle.shape >= CRT_SLOT_INSTANCE || primitives_[triangle.id].light == CRT_NONE) continue;
            Part& part = parts[objectOf(slot)];
            const Corners c = cornersOf(context_.blob, slot);  // Of a shape those of its box.
            for (const Vec3d& corner : c.p) part.box.add(corner, 0);
            const bool one_sided = (lights[primitives_[triangle.id].light].flags & CRT_LIGHT_TWO_SIDED) == 0;
            const Vec3d front = triangle.shape == 0 && one_sided ? c.normal : Vec3d{};
            constexpr double kOnePlane = 0.999;
            if (!part.begun) part.front = front;
            else if (dot(part.front, front) < kOnePlane) part.front = {};
            part.begun = true;
        }
        std::vector<LitFrom> found;
        for (const auto& [object, part] : parts)
            found.push_back({(part.box.lower + part.box.upper) * 0.5, object,
                             length(part.box.upper - part.box.lower) * 0.5, part.front});
        return found;
    }

    /// Of a surface from a light that shines on it from right above; 0: it does not, or lies in it.
    double height(const Surface& surface, const LitFrom& light) const {
        const CrtTriangle& triangle = triangles_[surface.slot];
        if (objectOf(surface.slot) == light.object) return 0;
        if (surface.instance == 0 && triangle.shape != 0)
            return heightOverShape(shapes_[triangle.shape - 1], light.point);
        std::array<Vec3d, 3> p;
        for (std::uint32_t i = 0; i < 3; ++i)
            p[i] = inDouble(crt_corner(&context_, triangles_ + surface.slot, surface.instance, i));
        const Vec3d n = cross(p[1] - p[0], p[2] - p[0]);
        if (!(length(n) > 0)) return 0;
        for (std::size_t i = 0; i < 3; ++i)
            if (dot(n, cross(p[(i + 1) % 3] - p[i], light.point - p[i])) < 0) return 0;
        const double above = dot(light.point - p[0], n) / length(n);
        if (dot(light.front, light.front) > 0 && dot(light.front, n) * above > 0) return 0;
        return std::abs(above);
    }

    /// Of an instance that of its mesh.
    std::uint32_t primitiveOf(std::uint32_t slot) const { return triangles_[slot].id; }

private:
    std::uint32_t objectOf(std::uint32_t slot) const {
        return primitives_[primitiveOf(slot)].object & ~CRT_PRIMITIVE_TOUCHES;
    }

    /// Of each mesh that is instanced, by its first primitive, the slots of its largest triangles.
    std::map<std::uint32_t, std::vector<std::uint32_t>> largestOfMeshes() const {
        const auto* instances = CRT_ARRAY(CrtInstance, context_.blob, context_.scene->instances);
        std::map<std::uint32_t, std::vector<std::uint32_t>> meshes;
        for (std::uint32_t i = 0; i < context_.scene->instances.count; ++i)
            meshes[instances[i].first_primitive];
        if (meshes.empty()) return meshes;
        const std::uint32_t end = context_.scene->triangles.count;
        for (std::uint32_t slot = context_.scene->triangle_count; slot < end; ++slot)
            std::prev(meshes.upper_bound(triangles_[slot].id))->second.push_back(slot);
        const auto size = [this](std::uint32_t slot) {
            const float* p = triangles_[slot].p;  // x of the three corners, then y, then z
            double sum = 0;
            for (std::size_t axis = 0; axis < 3; ++axis)
                for (std::size_t i = 1; i < 3; ++i)
                    sum += std::abs(static_cast<double>(p[3 * axis + i] - p[3 * axis]));
            return sum;
        };
        for (auto& [first, slots] : meshes) {
            const std::size_t kept = std::min(slots.size(), kOfAMesh);
            std::partial_sort(slots.begin(), slots.begin() + static_cast<std::ptrdiff_t>(kept), slots.end(),
                              [&](std::uint32_t a, std::uint32_t b) { return size(a) > size(b); });
            slots.resize(kept);
        }
        return meshes;
    }

    /// A disk has a clearance of its own at each point, which grows with nothing but its distance.
    static double heightOverShape(const CrtShape& shape, const Vec3d& point) {
        if (shape.kind == CRT_SHAPE_DISK) return 0;
        const Vec3d from = point - inDouble(shape.centre);
        const double z = dot(from, inDouble(shape.z));
        if (z < static_cast<double>(shape.from_z) || z > static_cast<double>(shape.to_z)) return 0;
        const double radius = shape.kind == CRT_SHAPE_SPHERE
                                  ? length(from)
                                  : std::hypot(dot(from, inDouble(shape.x)), dot(from, inDouble(shape.y)));
        return std::abs(radius - static_cast<double>(shape.radius));
    }

    const CrtContext context_;
    const CrtTriangle* triangles_;
    const CrtPrimitive* primitives_;
    const CrtFace* faces_;
    const CrtShape* shapes_;
};

}  // namespace

std::optional<LargeSurface> findLargeSurface(const CompiledScene& scene, const std::vector<Vec3d>& lights) {
    const Search search(scene);
    std::vector<LitFrom> all;
    if (scene.emitters > 0) all = search.emitters();
    for (const Vec3d& light : lights)
        all.push_back({(light - scene.centre) * std::ldexp(1.0, scene.scale_exponent)});
    std::vector<LitFrom> from;  // The time is bounded.
    for (std::size_t i = 0; i < all.size(); i += all.size() / kLights + 1) from.push_back(all[i]);
    std::optional<LargeSurface> worst;
    double largest = kLeastError;
    for (const Surface& surface : search.surfaces())
        for (const LitFrom& light : from) {
            const double height = search.height(surface, light);
            const double distance = std::max(height, light.radius);
            if (!(height > 0) || 2 * surface.clearance <= largest * distance) continue;
            largest = 2 * surface.clearance / distance;
            worst = {search.primitiveOf(surface.slot), std::ldexp(surface.clearance, -scene.scale_exponent),
                     std::ldexp(height, -scene.scale_exponent), largest};
        }
    return worst;
}

}  // namespace crt
