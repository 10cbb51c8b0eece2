#include "compile/camera_media.h"

#include "base/log.h"
#include "base/vec3d.h"
#include "kernel/materials/medium.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <vector>

namespace crt {
namespace {

using namespace kernel;

/// An intersection of a ray from the camera with a surface that bounds a medium.
struct Crossing {
    double t;
    std::uint32_t medium;
    bool outwards;  ///< The ray comes from inside.
};

/// A ray from the camera. Its direction lies in none of the planes along which scenes are usually built.
struct Probe {
    Vec3d o, d;
    std::vector<Crossing> crossings{};

    void meet(double t, std::uint32_t medium, bool outwards) {
        if (t > 0) crossings.push_back({t, medium, outwards});
    }
};

constexpr std::array<Vec3d, 7> kDirections{{{0.5377, 0.7321, 0.4183},
                                            {-0.6211, 0.3119, 0.7191},
                                            {0.2713, -0.8123, 0.5171},
                                            {-0.3319, -0.4127, -0.8483},
                                            {0.8117, -0.1733, -0.5581},
                                            {-0.8719, 0.4517, -0.1913},
                                            {0.1217, 0.5923, -0.7963}}};

Vec3d vectorOf(const f32* v) { return {double{v[0]}, double{v[1]}, double{v[2]}}; }

bool mayMeet(const Probe& probe, const CrtTriangle& box) {
    double from = 0, to = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < 3; ++k) {
        const f32* p = box.p + 3 * k;
        const double a = (double{std::min({p[0], p[1], p[2]})} - 1e-5 - probe.o[k]) / probe.d[k],
                     b = (double{std::max({p[0], p[1], p[2]})} + 1e-5 - probe.o[k]) / probe.d[k];
        from = std::max(from, std::min(a, b));
        to = std::min(to, std::max(a, b));
    }
    return from <= to;
}

/// `corners` are relative to the origin of the probe. The edge function has the same value, apart from its
/// sign, in both triangles of an edge, so no ray slips between them.
void meetTriangle(Probe& probe, const std::array<Vec3d, 3>& corners, double facing, std::uint32_t medium) {
    const auto& [a, b, c] = corners;
    const Vec3d ab = cross(a, b), bc = cross(b, c), ca = cross(c, a);
    const double x = dot(probe.d, ab), y = dot(probe.d, bc), z = dot(probe.d, ca);
    if (!((x > 0 && y > 0 && z > 0) || (x < 0 && y < 0 && z < 0))) return;
    probe.meet(dot(a, ab + bc + ca) / (x + y + z), medium, (x + y + z) * facing > 0);
}

void meetShape(Probe& probe, const CrtShape& shape, std::uint32_t medium) {
    const Vec3d axis = vectorOf(shape.z), o = probe.o - vectorOf(shape.centre), &d = probe.d;
    const double facing = double{shape.facing}, radius = double{shape.radius};
    const double o_z = dot(o, axis), d_z = dot(d, axis);
    if (shape.kind == CRT_SHAPE_DISK) {
        const double t = -o_z / d_z;
        const Vec3d p = o + d * t;
        const double rim = double{shape.met_to};
        if (dot(p, p) <= rim * rim) probe.meet(t, medium, d_z * facing > 0);
        return;
    }
    // For a cylinder, solve in the plane perpendicular to its axis.
    const bool cylinder = shape.kind == CRT_SHAPE_CYLINDER;
    const Vec3d across_o = cylinder ? o - axis * o_z : o, across_d = cylinder ? d - axis * d_z : d;
    const double a = dot(across_d, across_d), b = dot(across_o, across_d),
                 root = b * b - a * (dot(across_o, across_o) - radius * radius);
    if (!(root > 0)) return;
    for (const double sign : {-1.0, 1.0}) {
        const double t = (sign * std::sqrt(root) - b) / a, z = o_z + d_z * t;
        if (z >= double{shape.met_from} && z <= double{shape.met_to})
            probe.meet(t, medium, sign * facing > 0);
    }
}

/// The surfaces of a blob that bound media, for intersection with rays in double precision.
class Boundaries {
public:
    explicit Boundaries(const unsigned char* blob)
        : blob_(blob),
          scene_(*reinterpret_cast<const CrtScene*>(blob)),
          triangles_(CRT_ARRAY(CrtTriangle, blob, scene_.triangles)) {
        const CrtInstance* instances = CRT_ARRAY(CrtInstance, blob, scene_.instances);
        for (std::uint32_t i = 0; i < scene_.instances.count; ++i)
            mesh_ends_[instances[i].first_primitive] = scene_.primitives.count;
        for (auto mesh = mesh_ends_.begin(); mesh != mesh_ends_.end(); ++mesh)
            if (const auto next = std::next(mesh); next != mesh_ends_.end()) mesh->second = next->first;
        for (std::uint32_t slot = 0; slot < scene_.triangle_count; ++slot)
            if ((triangles_[slot].shape & CRT_SLOT_INSTANCE) != 0 || mediumOf(triangles_[slot]) != 0)
                slots_.push_back(slot);
    }

    void meet(Probe& probe) const {
        for (const std::uint32_t slot : slots_) {
            const CrtTriangle& triangle = triangles_[slot];
            if (!mayMeet(probe, triangle)) continue;
            if ((triangle.shape & CRT_SLOT_INSTANCE) != 0)
                meetInstance(probe, CRT_ARRAY(CrtInstance, blob_,
                                              scene_.instances)[triangle.shape - CRT_SLOT_INSTANCE]);
            else if (triangle.shape != 0)
                meetShape(probe, CRT_ARRAY(CrtShape, blob_, scene_.shapes)[triangle.shape - 1],
                          mediumOf(triangle));
            else
                meetTriangle(probe, cornersOf(triangle, probe.o), 1, mediumOf(triangle));
        }
    }

private:
    std::uint32_t mediumOf(const CrtTriangle& triangle) const {
        const std::uint32_t material =
            CRT_ARRAY(CrtPrimitive, blob_, scene_.primitives)[triangle.id].material;
        return CRT_ARRAY(CrtMaterial, blob_, scene_.materials)[material].medium;
    }

    static std::array<Vec3d, 3> cornersOf(const CrtTriangle& triangle, const Vec3d& o) {
        std::array<Vec3d, 3> corners;
        for (std::size_t v = 0; v < 3; ++v)
            for (std::size_t k = 0; k < 3; ++k) corners[v][k] = double{triangle.p[3 * k + v]} - o[k];
        return corners;
    }

    void meetInstance(Probe& probe, const CrtInstance& instance) const {
        const std::uint32_t first = instance.first_primitive, end = mesh_ends_.at(first);
        // The triangles of instanced meshes follow the slots, in the order of their primitives.
        const CrtTriangle* mesh = triangles_ + scene_.triangle_count + (first - mesh_ends_.begin()->first);
        for (std::uint32_t i = 0; i < end - first; ++i) {
            const std::uint32_t medium = mediumOf(mesh[i]);
            if (medium == 0) continue;
            const std::array<Vec3d, 3> own = cornersOf(mesh[i], {});
            std::array<Vec3d, 3> corners;
            for (std::size_t v = 0; v < 3; ++v)
                for (std::size_t k = 0; k < 3; ++k) {
                    const f32* row = instance.to_world + 4 * k;
                    corners[v][k] = dot(vectorOf(row), own[v]) + double{row[3]} - probe.o[k];
                }
            meetTriangle(probe, corners, double{instance.facing}, medium);
        }
    }

    const unsigned char* blob_;
    const CrtScene& scene_;
    const CrtTriangle* triangles_;
    std::vector<std::uint32_t> slots_;                  ///< Of those that bound media, and of instances.
    std::map<std::uint32_t, std::uint32_t> mesh_ends_;  ///< First primitive of a mesh → behind its last.
};

}  // namespace

void findCameraMedia(unsigned char* blob) {
    CrtScene& scene = *reinterpret_cast<CrtScene*>(blob);
    scene.camera_media = 0;
    if ((scene.features & CRT_FEATURE_MEDIA) == 0) return;
    CrtContext context{};
    context.blob = blob;
    context.scene = &scene;
    const Boundaries boundaries(blob);
    std::map<std::uint32_t, int> votes;
    for (const Vec3d& direction : kDirections) {
        Probe probe{vectorOf(scene.camera.origin), direction};
        boundaries.meet(probe);
        std::sort(probe.crossings.begin(), probe.crossings.end(),
                  [](const Crossing& a, const Crossing& b) { return a.t > b.t; });
        std::uint32_t media = 0;
        for (const Crossing& crossing : probe.crossings)  // from outside to the camera
            media = crossing.outwards ? crt_entered(&context, media, crossing.medium)
                                      : crt_left(&context, media, crossing.medium);
        ++votes[media];
    }
    const auto most = std::max_element(votes.begin(), votes.end(),
                                       [](const auto& a, const auto& b) { return a.second < b.second; });
    scene.camera_media = most->first;
    if (most->second < static_cast<int>(kDirections.size()))
        logWarning(
            "rays in {} of {} directions find different glass bodies around the camera: a "
            "body "
            "is not closed, or several overlap there; the camera may see too much absorbed, or too little",
            static_cast<int>(kDirections.size()) - most->second, kDirections.size());
}

}  // namespace crt
