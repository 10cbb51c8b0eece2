#include "shapes.h"

#include <cmath>

namespace crt::meshgen {

Mesh grid(std::uint32_t cells, bool with_normals) {
    Mesh mesh;
    const std::uint32_t side = cells + 1;
    mesh.positions.reserve(std::size_t{side} * side);
    mesh.triangles.reserve(std::size_t{2} * cells * cells);
    for (std::uint32_t i = 0; i < side; ++i)
        for (std::uint32_t j = 0; j < side; ++j) {
            const double x = static_cast<double>(j) / cells - .5, z = static_cast<double>(i) / cells - .5;
            const double a = 40 * x, b = 57 * z, height = .02 * std::sin(a) * std::cos(b);
            mesh.positions.push_back({x, height, z});
            if (with_normals)
                mesh.normals.push_back(
                    unit({-.02 * 40 * std::cos(a) * std::cos(b), 1, .02 * 57 * std::sin(a) * std::sin(b)}));
        }
    for (std::uint32_t i = 0; i < cells; ++i)
        for (std::uint32_t j = 0; j < cells; ++j) {
            const std::uint32_t v = i * side + j;
            mesh.triangles.push_back({v, v + side, v + 1});
            mesh.triangles.push_back({v + 1, v + side, v + side + 1});
        }
    return mesh;
}

}  // namespace crt::meshgen
