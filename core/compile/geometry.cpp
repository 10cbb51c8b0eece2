#include "compile/geometry.h"

#include "base/parallel.h"
#include "base/vec3d.h"
#include "kernel/geometry/surface.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

namespace crt {
namespace {

constexpr std::size_t kFacesAtATime = std::size_t{1} << 14;  // of what a thread takes at a time

/// The largest coordinate of a triangle, and the largest extent of its two edges along an axis: what
/// rounding depends on.
struct Extent {
    double coordinate = 0, size = 0;
};

Extent extentOf(const FlatScene& flat, std::size_t id) {
    const Vec3d o = vertexOf(flat, id, 0), a = vertexOf(flat, id, 1) - o, b = vertexOf(flat, id, 2) - o;
    Extent e;
    for (std::size_t k = 0; k < 3; ++k) {
        e.coordinate =
            std::max({e.coordinate, std::abs(o[k]), std::abs(o[k] + a[k]), std::abs(o[k] + b[k])});
        e.size = std::max(e.size, std::abs(a[k]) + std::abs(b[k]));
    }
    return e;
}

kernel::CrtFace faceOf(const FlatScene& flat, std::size_t id) {
    kernel::CrtFace face{};
    if (id >= flat.firstInstance()) return face;
    if (id >= flat.firstShape()) {
        face.clearance = flat.shapes[id - flat.firstShape()].clearance;
        face.margin = flat.shapes[id - flat.firstShape()].margin;
        return face;
    }
    const Vec3d o = vertexOf(flat, id, 0), a = vertexOf(flat, id, 1) - o, b = vertexOf(flat, id, 2) - o;
    const Vec3d n = cross(a, b);
    const double twice_area = std::sqrt(dot(n, n));
    const auto [coordinate, size] = extentOf(flat, id);
    for (std::size_t k = 0; k < 3; ++k)
        face.normal[k] = twice_area > 0 ? static_cast<float>(n[k] / twice_area) : 0.0f;
    face.clearance = kernel::crt_clearance(static_cast<float>(coordinate), static_cast<float>(size));
    face.margin = kernel::crt_edge_margin(static_cast<float>(coordinate), static_cast<float>(size),
                                          static_cast<float>(twice_area));
    return face;
}

/// Unit normal by the order of the vertices; zero for a triangle without area.
Vec3d planeNormal(const FlatScene& flat, std::size_t id) {
    const Vec3d o = vertexOf(flat, id, 0);
    const Vec3d n = cross(vertexOf(flat, id, 1) - o, vertexOf(flat, id, 2) - o);
    const double length = std::sqrt(dot(n, n));
    return length > 0 ? n * (1 / length) : Vec3d{};
}

/// The affine function that grows along `direction` and vanishes at `origin`.
void setRow(kernel::CrtTriangle8& block, std::size_t row, std::size_t lane, const Vec3d& direction,
            const Vec3d& origin) {
    for (std::size_t k = 0; k < 3; ++k) block.row[row][k][lane] = static_cast<float>(direction[k]);
    block.row[row][3][lane] = static_cast<float>(-dot(direction, origin));
}

/// Of a patch: the strip along `edge` of the plane with unit normal n that holds all of `points`. Fills the
/// row of the distance from its middle; returns half its width.
double setStrip(float (&row)[4], const Vec3d& n, const Vec3d& edge, std::span<const Vec3d> points) {
    const double length = std::sqrt(dot(edge, edge));
    const Vec3d across = length > 0 ? cross(n, edge) * (1 / length) : Vec3d{};
    double least = std::numeric_limits<double>::infinity(), most = -least;
    for (const Vec3d& p : points) {
        least = std::min(least, dot(across, p));
        most = std::max(most, dot(across, p));
    }
    for (std::size_t k = 0; k < 3; ++k) row[k] = static_cast<float>(across[k]);
    row[3] = static_cast<float>(-0.5 * (least + most));
    return 0.5 * (most - least);
}

/// The corner of triangle `id` across from its longest edge.
std::size_t cornerAcross(const FlatScene& flat, std::size_t id) {
    std::size_t corner = 0;
    double longest = -1;
    for (std::size_t v = 0; v < 3; ++v) {
        const Vec3d edge = vertexOf(flat, id, (v + 1) % 3) - vertexOf(flat, id, (v + 2) % 3);
        if (dot(edge, edge) > longest) {
            longest = dot(edge, edge);
            corner = v;
        }
    }
    return corner;
}

/// The corner of triangle `id` across from an edge that `other` has, too.
std::optional<std::size_t> cornerAcrossCommonEdge(const FlatScene& flat, std::size_t id, std::size_t other) {
    const auto has = [&](const Vec3d& p) {
        return vertexOf(flat, other, 0) == p || vertexOf(flat, other, 1) == p ||
               vertexOf(flat, other, 2) == p;
    };
    for (std::size_t v = 0; v < 3; ++v)
        if (has(vertexOf(flat, id, (v + 1) % 3)) && has(vertexOf(flat, id, (v + 2) % 3))) return v;
    return std::nullopt;
}

constexpr double kPatchHeight = 4 * 0x1p-24;  ///< Triangles in one plane: crt_patch_slack has room for them.
constexpr double kPatchArea = 1.25;           ///< Of the parallelogram, over that of its two triangles.

/// A patch of triangle `id`, and of `other` unless it is CRT_NONE. Nothing where they do not make one.
std::optional<kernel::CrtPatch> patchOf(const FlatScene& flat, std::uint32_t id, std::uint32_t other) {
    const bool pair = other != CRT_NONE;
    const Vec3d n = planeNormal(flat, id);
    std::vector<Vec3d> points{vertexOf(flat, id, 0), vertexOf(flat, id, 1), vertexOf(flat, id, 2)};
    Extent extent = extentOf(flat, id);
    std::size_t corner = cornerAcross(flat, id);
    if (pair) {
        const auto common = cornerAcrossCommonEdge(flat, id, other);
        if (!common || areaOf(flat, id) == 0 || areaOf(flat, other) == 0) return std::nullopt;
        corner = *common;
        for (std::size_t v = 0; v < 3; ++v) {
            points.push_back(vertexOf(flat, other, v));
            if (std::abs(dot(n, points.back() - points[0])) > kPatchHeight) return std::nullopt;
        }
        const Extent e = extentOf(flat, other);
        extent = {std::max(extent.coordinate, e.coordinate), std::max(extent.size, e.size)};
    }
    const Vec3d o = points[corner], a = points[(corner + 1) % 3] - o, b = points[(corner + 2) % 3] - o;

    kernel::CrtPatch patch{};
    for (std::size_t k = 0; k < 3; ++k) patch.plane[k] = static_cast<float>(n[k]);
    patch.plane[3] = static_cast<float>(-dot(n, o));
    const double first = setStrip(patch.first, n, a, points), second = setStrip(patch.second, n, b, points);
    if (pair) {
        // The angle between the strips widens the parallelogram of their widths.
        const Vec3d turned = cross(a, b);
        const double sine = std::sqrt(dot(turned, turned) / (dot(a, a) * dot(b, b)));
        if (4 * first * second > kPatchArea * sine * (areaOf(flat, id) + areaOf(flat, other)))
            return std::nullopt;
    }
    patch.sizes[0] = std::nextafter(static_cast<float>(first), 2.0f);
    patch.sizes[1] = std::nextafter(static_cast<float>(second), 2.0f);
    patch.sizes[2] =
        kernel::crt_height_slack(static_cast<float>(extent.coordinate), static_cast<float>(extent.size)) /
        CRT_HEIGHT_SCALE;
    patch.sizes[3] = pair ? 0.0f : 1.0f;
    const Vec3d edge = b - a;
    const double length = std::sqrt(dot(edge, edge));
    const Vec3d inwards = length > 0 ? cross(n, edge) * (1 / length) : Vec3d{};
    for (std::size_t k = 0; k < 3; ++k) patch.third[k] = static_cast<float>(inwards[k]);
    patch.third[3] = static_cast<float>(-dot(inwards, o + a));
    patch.slot[0] = id;
    patch.slot[1] = other;
    return patch;
}

/// True if a triangle can come between two points of the scene: not if the whole scene lies on one side of
/// its plane, as it does for the walls of a convex room.
bool canOcclude(const FlatScene& flat, std::size_t id) {
    const Vec3d o = vertexOf(flat, id, 0);
    const Vec3d n = cross(vertexOf(flat, id, 1) - o, vertexOf(flat, id, 2) - o);
    bool above = false, below = false;
    const auto meet = [&](const Vec3d& p) {
        const double d = dot(n, p - o);
        above = above || d > 0;
        below = below || d < 0;
    };
    for (std::size_t j = 0; j < flat.firstShape() && !(above && below); ++j)
        for (std::size_t v = 0; v < 3; ++v) meet(vertexOf(flat, j, v));
    for (std::size_t j = flat.firstShape(); j < flat.positions.size(); ++j)
        for (std::size_t corner = 0; corner < 8; ++corner) {
            Vec3d p;
            for (std::size_t k = 0; k < 3; ++k) p[k] = vertexOf(flat, j, corner >> k & 1)[k];
            meet(p);
        }
    return above && below;
}

}  // namespace

Vec3d vertexOf(const FlatScene& flat, std::size_t id, std::size_t vertex) {
    const auto& p = flat.positions[id];
    return {p[vertex], p[3 + vertex], p[6 + vertex]};
}

double areaOf(const FlatScene& flat, std::size_t id) {
    const Vec3d o = vertexOf(flat, id, 0);
    const Vec3d n = cross(vertexOf(flat, id, 1) - o, vertexOf(flat, id, 2) - o);
    return 0.5 * std::sqrt(dot(n, n));
}

Corners cornersOf(const FlatScene& flat, std::size_t triangle) {
    const kernel::CrtFace face = faceOf(flat, triangle);
    Corners c;
    for (std::size_t v = 0; v < 3; ++v) c.p[v] = vertexOf(flat, triangle, v);
    c.normal = {face.normal[0], face.normal[1], face.normal[2]};
    c.clearance = static_cast<double>(face.clearance);
    return c;
}

void compileTriangles(const FlatScene& flat, const AcceleratorPart& accelerator,
                      std::span<kernel::CrtTriangle> triangles) {
    parallelFor(triangles.size(), kFacesAtATime, [&](std::size_t first, std::size_t end) {
        for (std::size_t slot = first; slot < end; ++slot) {
            const std::uint32_t id = accelerator.id_of_slot[slot];
            std::copy(flat.positions[id].begin(), flat.positions[id].end(), triangles[slot].p);
            triangles[slot].id = id;
            if (id >= flat.firstInstance())
                triangles[slot].shape =
                    CRT_SLOT_INSTANCE + static_cast<std::uint32_t>(id - flat.firstInstance());
            else if (id >= flat.firstShape())
                triangles[slot].shape = static_cast<std::uint32_t>(id - flat.firstShape()) + 1;
        }
    });
}

void compileFaces(const FlatScene& flat, const AcceleratorPart& accelerator,
                  std::span<kernel::CrtFace> faces) {
    parallelFor(faces.size(), kFacesAtATime, [&](std::size_t first, std::size_t end) {
        for (std::size_t slot = first; slot < end; ++slot)
            faces[slot] = faceOf(flat, accelerator.id_of_slot[slot]);
    });
}

std::vector<kernel::CrtTriangle8> compileTriangles8(const FlatScene& flat,
                                                    const std::vector<std::uint32_t>& ids) {
    std::vector<kernel::CrtTriangle8> blocks((ids.size() + 7) / 8);
    for (kernel::CrtTriangle8& block : blocks) {
        std::fill(std::begin(block.slot), std::end(block.slot), CRT_NONE);
        std::fill(std::begin(block.row[0][3]), std::end(block.row[0][3]), CRT_UNUSED_HEIGHT);
    }
    for (std::size_t i = 0; i < ids.size(); ++i) {
        kernel::CrtTriangle8& block = blocks[i / 8];
        block.slot[i % 8] = ids[i];
        const Extent extent = extentOf(flat, ids[i]);
        block.height_slack[i % 8] =
            kernel::crt_height_slack(static_cast<float>(extent.coordinate), static_cast<float>(extent.size));
        const Vec3d n = planeNormal(flat, ids[i]);
        setRow(block, 0, i % 8, n, vertexOf(flat, ids[i], 0));
        for (std::size_t v = 0; v < 3; ++v) {
            const Vec3d from = vertexOf(flat, ids[i], v);
            const Vec3d edge = vertexOf(flat, ids[i], (v + 1) % 3) - from;
            const double length = std::sqrt(dot(edge, edge));
            setRow(block, v + 1, i % 8, length > 0 ? cross(n, edge) * (1 / length) : Vec3d{}, from);
        }
    }
    return blocks;
}

std::vector<kernel::CrtPatch> compilePatches(const FlatScene& flat, const std::vector<std::uint32_t>& ids) {
    std::vector<kernel::CrtPatch> patches;
    for (std::size_t i = 0; i < ids.size(); ++i) {
        auto patch = i + 1 < ids.size() ? patchOf(flat, ids[i], ids[i + 1]) : std::nullopt;
        if (patch)
            ++i;
        else
            patch = patchOf(flat, ids[i], CRT_NONE);
        patches.push_back(*patch);
    }
    return patches;
}

std::vector<std::uint32_t> trianglesOf(const FlatScene& flat) {
    std::vector<std::uint32_t> ids(flat.firstShape());
    std::iota(ids.begin(), ids.end(), 0u);
    return ids;
}

std::vector<std::uint32_t> occludersOf(const FlatScene& flat) {
    const std::size_t count = flat.positions.size();
    std::vector<std::uint32_t> ids;
    for (std::uint32_t id = 0; id < flat.firstShape(); ++id)
        if (count > kBruteForceTriangles || canOcclude(flat, id))  // asking takes quadratic time
            ids.push_back(id);
    return ids;
}

std::vector<kernel::CrtObject> compileObjects(const FlatScene& flat) {
    std::vector<kernel::CrtObject> objects;
    for (std::size_t i = 0; i < flat.triangles.size(); ++i) {
        const TriangleBounds b = boundsOf(flat, i);
        if (i == 0 || flat.triangles[i].object != flat.triangles[i - 1].object) {
            kernel::CrtObject object{};
            for (std::size_t k = 0; k < 3; ++k) {
                object.lower[k] = std::numeric_limits<float>::infinity();
                object.upper[k] = -std::numeric_limits<float>::infinity();
            }
            object.first = static_cast<std::uint32_t>(i);
            objects.push_back(object);
        }
        kernel::CrtObject& object = objects.back();
        ++object.count;
        for (std::size_t k = 0; k < 3; ++k) {
            object.lower[k] = std::min(object.lower[k], b.lower[k] - CRT_BOX_PADDING);
            object.upper[k] = std::max(object.upper[k], b.upper[k] + CRT_BOX_PADDING);
        }
    }
    return objects;
}

}  // namespace crt
