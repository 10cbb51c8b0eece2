#include "compile/flatten.h"

#include "base/error.h"
#include "base/log.h"
#include "base/parallel.h"
#include "base/stage.h"
#include "base/vec3d.h"
#include "compile/box.h"
#include "compile/divide.h"
#include "compile/instances.h"
#include "compile/placements.h"
#include "compile/rims.h"
#include "scene/scene_limits.h"
#include "spectra/sigmoid.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <utility>

namespace crt {
namespace {

constexpr std::size_t kMostTriangles = std::size_t{1} << 28;
bool isFinite(const Vec3d& v) { return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]); }

constexpr std::size_t kTrianglesAPart = std::size_t{1} << 14;  // of what a thread takes at a time

bool hasTexture(const Scene& scene, bool of_vertices) {
    return std::any_of(scene.textures.begin(), scene.textures.end(), [&](const Texture& t) {
        return (t.kind == Texture::Kind::VertexColors) == of_vertices;
    });
}

/// True if texture coordinates determine the direction of a surface's anisotropy.
bool hasTangents(const Scene& scene) {
    return std::any_of(scene.materials.begin(), scene.materials.end(),
                       [](const Material& m) { return m.anisotropy > 0; });
}

/// Sets centre and scale. The centre is the focus, or the middle of the scene if there is no focus.
void measure(FlatScene& flat, const Box& bounds) {
    const std::optional<Focus>& focus = flat.focus;
    flat.centre = focus ? focus->centre : Vec3d{};
    flat.scale_exponent = 0;
    double half_extent = 0;
    const auto& [lower, upper] = bounds;
    for (std::size_t k = 0; k < 3 && lower[k] <= upper[k]; ++k) {
        if (!focus) flat.centre[k] = lower[k] + (upper[k] - lower[k]) / 2;
        half_extent = focus ? std::max({half_extent, upper[k] - flat.centre[k], flat.centre[k] - lower[k]})
                            : std::max(half_extent, (upper[k] - lower[k]) / 2);
    }
    if (half_extent > 0) {
        int exponent = 0;
        std::frexp(half_extent, &exponent);
        flat.scale_exponent = -exponent;  // half_extent · 2^-exponent is in [½, 1)
    }
}

/// Coordinates within ±1. Higher over its edges than rounding in double makes three points of a line.
bool hasArea(const std::array<Vec3d, 3>& p) {
    const Vec3d a = p[1] - p[0], b = p[2] - p[0], n = cross(a, b);
    return dot(n, n) > 1e-30 * std::max(dot(a, a), dot(b, b));
}

/// Triangles of the scene, a part of them at a time. Each pass computes corners in double again instead of
/// storing them: they would be half of the memory that a scene takes.
class Flattener {
public:
    Flattener(const Scene& scene, std::optional<std::size_t> only)
        : scene_(scene),
          shapes_(only ? std::vector<PlacedShape>() : placedShapes(scene)),
          placements_(dividedPlacements(only)),
          instances_(only ? std::vector<PlacedMesh>() : placeMeshes()),
          parts_(partsOf(trianglesOfPlacements(), kTrianglesAPart)),
          stage_("placing triangles", 2 * static_cast<double>(trianglesOfPlacements())) {
        const std::size_t count = trianglesOfPlacements(), all = count + shapes_.size();
        flat_.object = only;
        flat_.triangles.resize(count);
        flat_.positions.resize(count);
        if (hasTexture(scene, false) || hasTangents(scene)) flat_.uvs.resize(all);
        if (hasTexture(scene, true)) flat_.colors.resize(all);
        for (const Object& object : scene.objects)
            flat_.placements += static_cast<std::uint32_t>(object.transforms.size());
    }

    FlatScene flatten() {
        placeTriangles();
        placeShapes();
        placeInstances();
        closeRims(flat_, shapes_);
        return std::move(flat_);
    }

private:
    struct Part {
        std::size_t first = 0, end = 0;
        Box bounds;  ///< In the author's units, of the triangles that have area as far as is known.
        std::size_t smooth = 0;
        std::uint64_t without_area = 0;
        const Placement* infinite = nullptr;  ///< The first that moves a vertex to infinity.
        std::vector<bool> seen;               ///< Empty: all are.
    };

    std::vector<Placement> dividedPlacements(std::optional<std::size_t> only) {
        std::vector<Placement> whole = placementsOf(scene_, only);
        if (!only) flat_.focus = focusOf(scene_, whole, shapes_);
        if (!flat_.focus) return whole;
        flat_.divided = dividedMeshes(scene_, whole, *flat_.focus);
        return placementsOf(scene_, only, flat_.divided);
    }

    void placeTriangles() {
        forEachPart([this](Part& part) { describe(part); });
        for (const Part& part : parts_)
            if (part.infinite)
                throw Error(ErrorKind::Scene, "a transform moves a vertex beyond the range of single "
                                              "precision",
                            part.infinite->object->place);
        measure(flat_, boundsOfParts());
        for (const Part& part : parts_) flat_.smooth_triangles += part.smooth;
        forEachPart([this](Part& part) { normalise(part); });
        std::uint64_t without_area = 0;
        for (const Part& part : parts_) without_area += part.without_area;
        if (without_area == 0) return;
        // They are invisible: they do not affect centre and scale.
        logWarning("{} triangle{} no area and will not be seen", without_area,
                   without_area == 1 ? " has" : "s have");
        if (without_area < flat_.triangles.size() || !shapes_.empty() || !instances_.empty())
            measure(flat_, boundsOfParts());
        forEachPart([this](Part& part) { normaliseSeen(part); });
    }

    void placeShapes() {
        for (const PlacedShape& shape : shapes_) {
            FlatTriangle t;
            t.object = shape.placement;
            t.material = shape.object->material;
            t.emission = emissionIndexOf(scene_, *shape.object, 0);
            flat_.triangles.push_back(t);
            flat_.shapes.push_back(flatShape(shape, flat_.centre, flat_.scale_exponent));
            flat_.positions.push_back(flat_.shapes.back().box);
        }
    }

    /// The meshes that are instanced, flattened each by itself, and where they stand.
    std::vector<PlacedMesh> placeMeshes() {
        std::vector<PlacedMesh> placed;
        std::uint32_t number = 0;
        for (std::size_t i = 0; i < scene_.objects.size(); ++i) {
            const Object& object = scene_.objects[i];
            const std::size_t first = placed.size(), mesh = flat_.meshes.size();
            const bool shared = sharesMesh(scene_, object);
            for (const Matrix4d& transform : object.transforms) {
                if (shared && canInstance(transform)) {
                    if (placed.size() == first)
                        flat_.meshes.push_back(instancedMesh(Flattener(scene_, i).flatten()));
                    placed.push_back(placedMesh(object, transform, flat_.meshes.back(), mesh, number));
                }
                ++number;
            }
        }
        return placed;
    }

    void placeInstances() {
        for (const PlacedMesh& placed : instances_) {
            FlatTriangle t;
            t.object = placed.number;
            flat_.triangles.push_back(t);
            flat_.instances.push_back(
                flatInstance(placed, flat_.meshes[placed.mesh], flat_.centre, flat_.scale_exponent));
            flat_.positions.push_back(flat_.instances.back().box);
        }
    }

    std::size_t trianglesOfPlacements() const {
        return placements_.empty() ? 0
                                   : placements_.back().first + placements_.back().mesh->triangles.size();
    }

    void forEachPart(const std::function<void(Part&)>& work) {
        parallelFor(flat_.triangles.size(), kTrianglesAPart, [&](std::size_t first, std::size_t end) {
            Part& part = parts_[first / kTrianglesAPart];
            part.first = first;
            part.end = end;
            work(part);
            stage_.at(static_cast<double>(done_ += end - first));
        });
    }

    Box boundsOfParts() const {
        Box all;
        for (const Part& part : parts_) all.add(part.bounds);
        for (const PlacedShape& shape : shapes_) {
            all.add(shape.lower);
            all.add(shape.upper);
        }
        for (const PlacedMesh& placed : instances_) {
            all.add(placed.lower);
            all.add(placed.upper);
        }
        return all;
    }

    void describe(Part& part) {
        forEachTriangle(placements_, part.first, part.end,
                        [&](std::size_t i, const Placement& placement, std::size_t triangle) {
                            const Mesh& mesh = *placement.mesh;
                            const Object& object = *placement.object;
                            FlatTriangle& t = flat_.triangles[i];
                            t.object = placement.number;
                            t.material = !mesh.material.empty() && mesh.material[triangle] >= 0
                                             ? mesh.material[triangle]
                                             : object.material;
                            t.emission = emissionIndexOf(scene_, object, mesh, triangle);
                            for (const Vec3d& p : placement.corners(triangle)) {
                                if (!isFinite(p) && !part.infinite) part.infinite = &placement;
                                part.bounds.add(p);
                            }
                            if (!flat_.uvs.empty()) setUvs(placement, triangle, flat_.uvs[i]);
                            if (!flat_.colors.empty()) setColors(placement, triangle, flat_.colors[i]);
                            t.smooth = placement.hasNormals(triangle);
                            part.smooth += t.smooth;
                        });
    }

    static void setUvs(const Placement& placement, std::size_t triangle, kernel::CrtUvs& uvs) {
        const Mesh& mesh = *placement.mesh;
        if (mesh.uv_index.empty()) return;
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t index = mesh.uv_index[triangle][placement.from(k)];
            if (index == kNoUv) continue;
            uvs.uv[k] = static_cast<float>(mesh.uvs[index][0]);
            uvs.uv[3 + k] = static_cast<float>(mesh.uvs[index][1]);
        }
    }

    static void setColors(const Placement& placement, std::size_t triangle,
                          kernel::CrtVertexColors& colors) {
        const Mesh& mesh = *placement.mesh;
        if (mesh.colors.empty()) return;
        for (std::size_t k = 0; k < 3; ++k) {
            const SigmoidCoefficients c =
                sigmoidCoefficients(mesh.colors[mesh.triangles[triangle][placement.from(k)]]);
            std::copy(c.begin(), c.end(), &colors.c[3 * k]);
        }
    }

    /// Corners of a triangle, centred and scaled.
    std::array<Vec3d, 3> normalised(const std::array<Vec3d, 3>& corners) const {
        const double scale = std::ldexp(1.0, flat_.scale_exponent);
        std::array<Vec3d, 3> p;
        for (std::size_t v = 0; v < 3; ++v) p[v] = (corners[v] - flat_.centre) * scale;
        return p;
    }

    void setPositions(std::size_t i, const std::array<Vec3d, 3>& p) {
        for (std::size_t v = 0; v < 3; ++v)
            for (std::size_t k = 0; k < 3; ++k) flat_.positions[i][3 * k + v] = static_cast<float>(p[v][k]);
    }

    /// Positions; and which triangles have area.
    void normalise(Part& part) {
        Box seen;
        forEachTriangle(placements_, part.first, part.end,
                        [&](std::size_t i, const Placement& placement, std::size_t triangle) {
                            const std::array<Vec3d, 3> corners = placement.corners(triangle);
                            const std::array<Vec3d, 3> p = normalised(corners);
                            setPositions(i, p);
                            if (hasArea(p)) {
                                for (const Vec3d& corner : corners) seen.add(corner);
                            } else {
                                if (part.seen.empty()) part.seen.assign(part.end - part.first, true);
                                part.seen[i - part.first] = false;
                                ++part.without_area;
                            }
                        });
        part.bounds = seen;
    }

    void normaliseSeen(const Part& part) {
        forEachTriangle(placements_, part.first, part.end,
                        [&](std::size_t i, const Placement& placement, std::size_t triangle) {
                            const bool seen = part.seen.empty() || part.seen[i - part.first];
                            // Rounded to float, three points of one line make a sliver that can be hit; one
                            // point cannot.
                            setPositions(
                                i, seen ? normalised(placement.corners(triangle)) : std::array<Vec3d, 3>{});
                        });
    }

    const Scene& scene_;
    FlatScene flat_;
    const std::vector<PlacedShape> shapes_;
    const std::vector<Placement> placements_;
    const std::vector<PlacedMesh> instances_;
    std::vector<Part> parts_;
    Stage stage_;
    std::atomic<std::size_t> done_{0};
};

}  // namespace

FlatScene flattenScene(const Scene& scene) {
    // Before anything is written out.
    std::uint64_t count = 0, ids = 0;
    for (const Object& object : scene.objects) {
        const std::uint64_t places = object.transforms.size();
        const std::uint64_t instances =
            sharesMesh(scene, object) ? static_cast<std::uint64_t>(std::count_if(
                                            object.transforms.begin(), object.transforms.end(), canInstance))
                                      : 0;
        const std::uint64_t copies = places - instances + (instances > 0 ? 1 : 0);
        count += copies * scene.meshes[object.mesh].triangles.size() + instances;
        ids += trianglesOf(scene, object) + places;
        if (object.sharing == Sharing::Always && places > 1 && emits(scene, object))
            logWarning("{}: emitting surfaces cannot share a mesh; it is duplicated {} times",
                       object.name, places);
    }
    if (ids >= std::numeric_limits<std::uint32_t>::max())
        throw Error(ErrorKind::Scene,
                    fmt::format("the scene has {} triangles; crt supports up to 4295 million", ids));
    if (count >= kMostTriangles)
        throw Error(
            ErrorKind::Scene,
            fmt::format("expanded, the scene has {} triangles; crt renders up to 268 million", count));
    if (scene.input_bytes > 0)
        if (const std::string why =
                ExpansionLimit(scene.input_bytes).refusal(count, "triangles", kBytesPerTriangle);
            !why.empty())
            throw Error(ErrorKind::Scene, fmt::format("{}: error: {}", scene.file, why), {scene.file});

    return Flattener(scene, std::nullopt).flatten();
}

void flattenNormals(const Scene& scene, const FlatScene& flat, std::span<kernel::CrtNormals> normals) {
    const std::size_t count = flat.firstShape();
    std::vector<std::size_t> first_normal(partsOf(count, kTrianglesAPart));
    parallelFor(count, kTrianglesAPart, [&](std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i)
            first_normal[first / kTrianglesAPart] += flat.triangles[i].smooth;
    });
    std::size_t before = 0;
    for (std::size_t& smooth : first_normal) before += std::exchange(smooth, before);
    const std::vector<Placement> placements = placementsOf(scene, flat.object, flat.divided);
    parallelFor(count, kTrianglesAPart, [&](std::size_t first, std::size_t end) {
        std::size_t normal = first_normal[first / kTrianglesAPart];
        forEachTriangle(placements, first, end,
                        [&](std::size_t i, const Placement& placement, std::size_t triangle) {
                            if (!flat.triangles[i].smooth) return;
                            const std::array<Vec3d, 3> corners = *placement.normals(triangle);
                            kernel::CrtNormals& n = normals[normal++];
                            for (std::size_t v = 0; v < 3; ++v)
                                for (std::size_t k = 0; k < 3; ++k)
                                    n.n[3 * k + v] = static_cast<float>(corners[v][k]);
                        });
    });
}

}  // namespace crt
