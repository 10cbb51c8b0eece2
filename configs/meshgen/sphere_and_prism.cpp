#include "shapes.h"

#include <cmath>

namespace crt::meshgen {

Mesh sphere(std::uint32_t segments, std::uint32_t rings) {
    Mesh mesh;
    const auto add = [&](Vec n) {
        mesh.normals.push_back(n);
        mesh.positions.push_back(0.5 * n + Vec{0, 0.5, 0});
    };
    add({0, 1, 0});
    for (std::uint32_t ring = 1; ring < rings; ++ring)
        for (std::uint32_t segment = 0; segment < segments; ++segment) {
            const double theta = kPi * ring / rings, phi = 2.0 * kPi * segment / segments;
            add({std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)});
        }
    add({0, -1, 0});

    const auto at = [&](std::uint32_t ring, std::uint32_t segment) {
        return 1 + (ring - 1) * segments + segment % segments;
    };
    const std::uint32_t south = 1 + (rings - 1) * segments;
    for (std::uint32_t s = 0; s < segments; ++s) mesh.triangles.push_back({0, at(1, s + 1), at(1, s)});
    for (std::uint32_t ring = 1; ring + 1 < rings; ++ring)
        for (std::uint32_t s = 0; s < segments; ++s) {
            mesh.triangles.push_back({at(ring, s), at(ring, s + 1), at(ring + 1, s + 1)});
            mesh.triangles.push_back({at(ring, s), at(ring + 1, s + 1), at(ring + 1, s)});
        }
    for (std::uint32_t s = 0; s < segments; ++s)
        mesh.triangles.push_back({south, at(rings - 1, s), at(rings - 1, s + 1)});
    return mesh;
}

Mesh prism() {
    const double half = 1.0 / std::sqrt(3.0);
    Mesh mesh;
    for (const double z : {-1.0, 1.0}) {
        mesh.positions.push_back({-half, 0, z});
        mesh.positions.push_back({half, 0, z});
        mesh.positions.push_back({0, 1, z});
    }
    mesh.triangles = {{0, 2, 1}, {3, 4, 5}, {0, 1, 4}, {0, 4, 3},
                      {1, 2, 5}, {1, 5, 4}, {2, 0, 3}, {2, 3, 5}};
    return mesh;
}

}  // namespace crt::meshgen
