#include "scene/mesh/vertex_normals.h"

#include "base/error.h"
#include "base/parallel.h"
#include "base/vec3d.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <span>
#include <tuple>
#include <utility>

namespace crt {
namespace {

constexpr std::size_t kPart = std::size_t{1} << 14;  // of what a thread takes at a time

std::uint64_t hashOf(const Vec3d& p) {
    std::uint64_t hash = 0;
    for (const double x : p) {
        hash ^= std::bit_cast<std::uint64_t>(x + 0.0);  // -0 is 0.
        hash *= 0x9e3779b97f4a7c15u;
        hash ^= hash >> 32;
    }
    return hash * 0x9e3779b97f4a7c15u;
}

/// The corners of triangles around each vertex: of triangle t 3 t, 3 t + 1, 3 t + 2.
struct CornersOfVertices {
    std::vector<std::uint32_t> first;  ///< By vertex, and one more.
    std::vector<std::uint32_t> corners;
};

CornersOfVertices cornersOfVertices(const Mesh& mesh, const std::vector<std::uint32_t>& place) {
    CornersOfVertices out;
    out.first.resize(place.size() + 1);
    const auto counter = [&](std::uint32_t vertex) {
        return std::atomic_ref<std::uint32_t>(out.first[place[vertex]]);
    };
    parallelFor(mesh.triangles.size(), kPart, [&](std::size_t first, std::size_t end) {
        for (std::size_t t = first; t < end; ++t)
            for (const std::uint32_t vertex : mesh.triangles[t])
                counter(vertex).fetch_add(1, std::memory_order_relaxed);
    });
    std::uint32_t before = 0;
    for (std::uint32_t& count : out.first) before += std::exchange(count, before);
    // Each vertex's first moves to that of the next while its corners are put in, in any order.
    out.corners.resize(3 * mesh.triangles.size());
    parallelFor(mesh.triangles.size(), kPart, [&](std::size_t first, std::size_t end) {
        for (std::size_t t = first; t < end; ++t)
            for (std::size_t k = 0; k < 3; ++k)
                out.corners[counter(mesh.triangles[t][k]).fetch_add(1, std::memory_order_relaxed)] =
                    static_cast<std::uint32_t>(3 * t + k);
    });
    std::copy_backward(out.first.begin(), out.first.end() - 1, out.first.end());
    out.first.front() = 0;
    return out;
}

/// A triangle where it meets a vertex.
struct Corner {
    std::uint32_t corner;
    Vec3d normal;  ///< Of the triangle, unit.
    double angle;
    std::array<std::uint32_t, 2> neighbours;  ///< The vertices that follow and precede this one.
};

/// The normals around a vertex. Keeps its memory from one vertex to the next.
class VertexFan {
public:
    VertexFan(const Mesh& mesh, const std::vector<std::uint32_t>& place, double crease_angle_deg)
        : mesh_(mesh), place_(place), least_cosine_(leastCosine(crease_angle_deg)) {}

    /// Calls set(corner, number) for those that get a normal, which then stands in normals[number].
    template <class Set>
    void makeNormals(std::span<std::uint32_t> corners, std::vector<Vec3d>& normals, const Set& set) {
        std::sort(corners.begin(), corners.end());
        take(corners);
        joinAcrossEdges();
        // Sums in the order of the triangles, whatever the order in which they were joined.
        sums_.assign(fan_.size(), Vec3d{});
        for (std::uint32_t i = 0; i < fan_.size(); ++i) {
            Vec3d& sum = sums_[rootOf(i)];
            sum = sum + fan_[i].normal * fan_[i].angle;
        }
        number_.assign(fan_.size(), kNoNormal);
        for (std::uint32_t i = 0; i < fan_.size(); ++i) {
            const std::uint32_t root = rootOf(i);
            const double norm = length(sums_[root]);
            constexpr double kNothing = 1e-9;
            if (!(norm > kNothing)) continue;
            if (number_[root] == kNoNormal) {
                number_[root] = static_cast<std::uint32_t>(normals.size());
                normals.push_back(sums_[root] * (1 / norm));
            }
            set(fan_[i].corner, number_[root]);
        }
    }

private:
    struct Edge {
        std::uint32_t other;  ///< The vertex at its other end.
        std::uint32_t side;   ///< 0: the triangle runs away from the vertex; 1: towards it.
        std::uint32_t fan;    ///< Number of the triangle in fan_.

        auto operator<=>(const Edge&) const = default;
    };

    /// Rounding must not make creases of angles that are exactly as large as allowed.
    static double leastCosine(double angle_deg) {
        return std::cos(angle_deg * (std::numbers::pi / 180)) - 1e-9;
    }

    void take(std::span<const std::uint32_t> corners) {
        fan_.clear();
        parent_.clear();
        edges_.clear();
        for (const std::uint32_t corner : corners) {
            const auto& triangle = mesh_.triangles[corner / 3];
            const std::uint32_t k = corner % 3, next = triangle[(k + 1) % 3], last = triangle[(k + 2) % 3];
            const Vec3d& p = mesh_.positions[triangle[k]];
            Vec3d a = mesh_.positions[next] - p, b = mesh_.positions[last] - p;
            a = a * (1 / largest(a));
            b = b * (1 / largest(b));
            const Vec3d n = cross(a, b);
            const double norm = length(n);
            if (!(norm > 0) || !std::isfinite(norm)) continue;  // without area
            const auto number = static_cast<std::uint32_t>(fan_.size());
            fan_.push_back(
                {corner, n * (1 / norm), std::atan2(norm, dot(a, b)), {place_[next], place_[last]}});
            parent_.push_back(number);
            for (std::uint32_t side = 0; side < 2; ++side)
                edges_.push_back({fan_.back().neighbours[side], side, number});
        }
    }

    static double largest(const Vec3d& v) {
        return std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])});
    }

    void joinAcrossEdges() {
        std::sort(edges_.begin(), edges_.end());
        for (std::size_t first = 0; first < edges_.size();) {
            std::size_t towards = first;
            while (towards < edges_.size() && edges_[towards].other == edges_[first].other &&
                   edges_[towards].side == 0)
                ++towards;
            std::size_t end = towards;
            while (end < edges_.size() && edges_[end].other == edges_[first].other) ++end;
            // Sheets that are written twice, once for each side, have four triangles at an edge. With many
            // of them, their pairing is ambiguous.
            constexpr std::size_t kMostAtAnEdge = 8;
            if (end - first <= kMostAtAnEdge)
                for (std::size_t i = first; i < towards; ++i)
                    for (std::size_t j = towards; j < end; ++j) join(edges_[i].fan, edges_[j].fan);
            first = end;
        }
    }

    void join(std::uint32_t a, std::uint32_t b) {
        if (dot(fan_[a].normal, fan_[b].normal) < least_cosine_) return;
        const std::uint32_t i = rootOf(a), j = rootOf(b);
        parent_[std::max(i, j)] = std::min(i, j);
    }

    /// The lowest of those that were joined.
    std::uint32_t rootOf(std::uint32_t i) {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }

    const Mesh& mesh_;
    const std::vector<std::uint32_t>& place_;
    double least_cosine_;
    std::vector<Corner> fan_;
    std::vector<std::uint32_t> parent_, number_;
    std::vector<Edge> edges_;
    std::vector<Vec3d> sums_;
};

}  // namespace

std::vector<std::uint32_t> verticesAtOnePlace(const std::vector<Vec3d>& positions) {
    // Into buckets by hash, each of which is sorted by itself.
    struct Entry {
        std::uint32_t hash, vertex;
    };
    constexpr unsigned kBits = 12;
    constexpr std::size_t kBuckets = std::size_t{1} << kBits;
    const auto bucketOf = [](std::uint64_t hash) { return static_cast<std::size_t>(hash >> (64 - kBits)); };
    std::vector<std::uint32_t> first(kBuckets + 1);
    const auto counter = [&](std::size_t bucket) { return std::atomic_ref<std::uint32_t>(first[bucket]); };
    parallelFor(positions.size(), kPart, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v)
            counter(bucketOf(hashOf(positions[v]))).fetch_add(1, std::memory_order_relaxed);
    });
    std::uint32_t before = 0;
    for (std::uint32_t& count : first) before += std::exchange(count, before);
    std::vector<Entry> entries(positions.size());
    parallelFor(positions.size(), kPart, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) {
            const std::uint64_t hash = hashOf(positions[v]);
            entries[counter(bucketOf(hash)).fetch_add(1, std::memory_order_relaxed)] = {
                static_cast<std::uint32_t>(hash), static_cast<std::uint32_t>(v)};
        }
    });
    // Now first[b] is where bucket b ends.
    std::vector<std::uint32_t> place(positions.size());
    parallelFor(kBuckets, 1, [&](std::size_t bucket, std::size_t) {
        const auto at = [&](std::size_t i) { return entries.begin() + static_cast<std::ptrdiff_t>(i); };
        const auto begin = at(bucket == 0 ? 0 : first[bucket - 1]), end = at(first[bucket]);
        std::sort(begin, end, [&](const Entry& a, const Entry& b) {
            return std::tie(a.hash, positions[a.vertex], a.vertex) <
                   std::tie(b.hash, positions[b.vertex], b.vertex);
        });
        for (auto entry = begin; entry != end; ++entry)
            place[entry->vertex] =
                entry != begin && positions[std::prev(entry)->vertex] == positions[entry->vertex]
                    ? place[std::prev(entry)->vertex]
                    : entry->vertex;
    });
    return place;
}

void makeSmoothNormals(Mesh& mesh, double crease_angle_deg) {
    if (mesh.triangles.size() > std::numeric_limits<std::uint32_t>::max() / 3)
        throw Error(ErrorKind::Scene, "a mesh of more than 1.4 thousand million triangles gets no normals");
    mesh.normals = {};
    mesh.normal_index.assign(mesh.triangles.size(), {kNoNormal, kNoNormal, kNoNormal});
    const std::vector<std::uint32_t> place = verticesAtOnePlace(mesh.positions);
    CornersOfVertices around = cornersOfVertices(mesh, place);
    std::vector<std::vector<Vec3d>> parts(partsOf(place.size(), kPart));
    parallelFor(place.size(), kPart, [&](std::size_t first, std::size_t end) {
        VertexFan fan(mesh, place, crease_angle_deg);
        std::vector<Vec3d>& normals = parts[first / kPart];
        for (std::size_t v = first; v < end; ++v)
            fan.makeNormals(
                std::span(around.corners).subspan(around.first[v], around.first[v + 1] - around.first[v]),
                normals, [&](std::uint32_t corner, std::uint32_t number) {
                    mesh.normal_index[corner / 3][corner % 3] = number;
                });
    });
    around = {};
    std::vector<std::size_t> before(parts.size());
    std::size_t count = 0;
    for (std::size_t i = 0; i < parts.size(); ++i) before[i] = std::exchange(count, count + parts[i].size());
    if (count >= kNoNormal)
        throw Error(ErrorKind::Scene, "a mesh with more than 4 thousand million normals");
    mesh.normals.resize(count);
    parallelFor(parts.size(), 1, [&](std::size_t i, std::size_t) {
        const std::vector<Vec3d> part = std::exchange(parts[i], {});
        std::copy(part.begin(), part.end(), mesh.normals.begin() + static_cast<std::ptrdiff_t>(before[i]));
    });
    // Numbers within parts → in the mesh; a triangle with a corner that has none is flat.
    parallelFor(mesh.triangles.size(), kPart, [&](std::size_t first, std::size_t end) {
        for (std::size_t t = first; t < end; ++t) {
            auto& index = mesh.normal_index[t];
            const bool flat = std::find(index.begin(), index.end(), kNoNormal) != index.end();
            for (std::size_t k = 0; k < 3; ++k)
                index[k] =
                    flat
                        ? kNoNormal
                        : static_cast<std::uint32_t>(index[k] + before[place[mesh.triangles[t][k]] / kPart]);
        }
    });
}

}  // namespace crt
