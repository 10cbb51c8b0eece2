#include "polygonise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <unordered_map>
#include <vector>

namespace crt::meshgen {

Mesh polygonise(const Field& field, Vec low, Vec high, double step) {
    constexpr int kBlock = 8;
    const auto blocks = [&](double extent) { return static_cast<int>(std::ceil(extent / (step * kBlock))); };
    const int bx = blocks(high.x - low.x), by = blocks(high.y - low.y), bz = blocks(high.z - low.z);
    const int nx = bx * kBlock, ny = by * kBlock, nz = bz * kBlock;  // Grid points.
    const auto pointAt = [&](int i, int j, int k) {
        return Vec{low.x + i * step, low.y + j * step, low.z + k * step};
    };
    const auto gridIndex = [&](int i, int j, int k) {
        return (static_cast<std::size_t>(k) * ny + j) * nx + i;
    };
    const auto blockIndex = [&](int i, int j, int k) {
        return (static_cast<std::size_t>(k / kBlock) * by + j / kBlock) * bx + i / kBlock;
    };

    // The field is a distance, near enough: a block whose centre is farther from the surface than its
    // corners holds none.
    std::vector<float> value(static_cast<std::size_t>(nx) * ny * nz);
    std::vector<std::vector<std::uint32_t>> near(static_cast<std::size_t>(bx) * by * bz);
    const double radius = 0.5 * std::sqrt(3.0) * kBlock * step;
    for (int k0 = 0; k0 < nz; k0 += kBlock)
        for (int j0 = 0; j0 < ny; j0 += kBlock)
            for (int i0 = 0; i0 < nx; i0 += kBlock) {
                const Vec centre = pointAt(i0, j0, k0) + 0.5 * kBlock * Vec{step, step, step};
                std::vector<std::uint32_t>& parts = near[blockIndex(i0, j0, k0)];
                parts = field.partsNear(centre, radius);
                const double at_centre = field(centre, parts);
                const bool empty = std::abs(at_centre) > 2.0 * radius;
                for (int k = k0; k < k0 + kBlock; ++k)
                    for (int j = j0; j < j0 + kBlock; ++j)
                        for (int i = i0; i < i0 + kBlock; ++i)
                            value[gridIndex(i, j, k)] =
                                static_cast<float>(empty ? at_centre : field(pointAt(i, j, k), parts));
            }

    Mesh mesh;
    std::unordered_map<std::uint64_t, std::uint32_t> vertex_on_edge;
    const auto vertexBetween = [&](std::array<int, 3> a, std::array<int, 3> b) {
        if (gridIndex(a[0], a[1], a[2]) > gridIndex(b[0], b[1], b[2])) std::swap(a, b);
        const int direction = (b[0] - a[0]) + 2 * (b[1] - a[1]) + 4 * (b[2] - a[2]);
        const std::uint64_t key = gridIndex(a[0], a[1], a[2]) * 8 + static_cast<unsigned>(direction);
        const auto [found, is_new] =
            vertex_on_edge.try_emplace(key, static_cast<std::uint32_t>(mesh.positions.size()));
        if (is_new) {
            const std::vector<std::uint32_t>& parts = near[blockIndex(a[0], a[1], a[2])];
            const Vec pa = pointAt(a[0], a[1], a[2]), pb = pointAt(b[0], b[1], b[2]);
            double ta = 0.0, tb = 1.0;
            double fa = value[gridIndex(a[0], a[1], a[2])], fb = value[gridIndex(b[0], b[1], b[2])];
            double t = fa / (fa - fb);
            for (int i = 0; i < 3;
                 ++i) {  // False position; three steps put the vertex on the surface to 1e-4 of the grid.
                const double f = field(mix(pa, pb, t), parts);
                if ((f < 0.0) == (fa < 0.0))
                    ta = t, fa = f;
                else
                    tb = t, fb = f;
                if (fa == fb) break;
                t = ta + (tb - ta) * fa / (fa - fb);
            }
            // Not onto the grid point itself, where the vertices of many edges would meet in triangles of no
            // area.
            mesh.positions.push_back(mix(pa, pb, std::clamp(t, 0.02, 0.98)));
        }
        return found->second;
    };

    // Corners of the six tetrahedra, as bits x, y, z: the paths from corner 0 to corner 7 along three axes.
    constexpr int kTetrahedra[6][4] = {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7},
                                       {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}};
    for (int k = 0; k + 1 < nz; ++k)
        for (int j = 0; j + 1 < ny; ++j)
            for (int i = 0; i + 1 < nx; ++i) {
                const auto corner = [&](int c) {
                    return std::array<int, 3>{i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)};
                };
                unsigned inside = 0;
                for (int c = 0; c < 8; ++c) {
                    const auto [x, y, z] = corner(c);
                    inside |= static_cast<unsigned>(value[gridIndex(x, y, z)] < 0.0f) << c;
                }
                if (inside == 0 || inside == 255) continue;
                for (const auto& tetrahedron : kTetrahedra) {
                    // Corners in the order inside first; an odd permutation turns the tetrahedron inside
                    // out.
                    std::array<int, 4> c{tetrahedron[0], tetrahedron[1], tetrahedron[2], tetrahedron[3]};
                    int count = 0;
                    bool flipped = false;
                    for (int a = 0; a < 4; ++a)
                        if (inside >> c[a] & 1u) {
                            for (int b = a; b > count; --b) {
                                std::swap(c[b], c[b - 1]);
                                flipped = !flipped;
                            }
                            ++count;
                        }
                    const auto between = [&](int a, int b) {
                        return vertexBetween(corner(c[a]), corner(c[b]));
                    };
                    const auto triangle = [&](std::uint32_t p, std::uint32_t q, std::uint32_t r) {
                        if (flipped) std::swap(q, r);
                        mesh.triangles.push_back({p, q, r});
                    };
                    if (count == 1) {
                        triangle(between(0, 1), between(0, 2), between(0, 3));
                    } else if (count == 3) {
                        triangle(between(0, 3), between(1, 3), between(2, 3));
                    } else if (count == 2) {
                        const std::uint32_t p = between(0, 2), q = between(0, 3), r = between(1, 3),
                                            s = between(1, 2);
                        triangle(p, q, r);
                        triangle(p, r, s);
                    }
                }
            }
    return mesh;
}

Mesh withoutCrumbs(Mesh mesh) {
    std::vector<std::uint32_t> parent(mesh.positions.size());
    std::iota(parent.begin(), parent.end(), 0u);
    const auto root = [&](std::uint32_t v) {
        while (parent[v] != v) v = parent[v] = parent[parent[v]];
        return v;
    };
    for (const auto& t : mesh.triangles)
        for (const std::uint32_t v : {t[1], t[2]}) parent[root(v)] = root(t[0]);
    std::vector<std::uint32_t> faces(mesh.positions.size(), 0);
    for (const auto& t : mesh.triangles) ++faces[root(t[0])];
    const auto largest =
        static_cast<std::uint32_t>(std::max_element(faces.begin(), faces.end()) - faces.begin());
    std::erase_if(mesh.triangles, [&](const auto& t) { return root(t[0]) != largest; });
    return mesh;
}

}  // namespace crt::meshgen
