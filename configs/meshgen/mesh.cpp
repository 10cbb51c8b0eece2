#include "mesh.h"

#include <algorithm>
#include <cstdio>
#include <stdexcept>

namespace crt::meshgen {

Vec areaVector(const std::array<Vec, 3>& corner) {
    return cross(corner[1] - corner[0], corner[2] - corner[0]);
}
Vec areaVector(const Mesh& mesh, const std::array<std::uint32_t, 3>& t) {
    return areaVector({mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]});
}

void normalise(Mesh& mesh) {
    Vec low = mesh.positions.front(), high = low;
    for (const Vec& p : mesh.positions) {
        low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
        high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
    const double scale = 1.0 / (high.y - low.y);
    const Vec foot{0.5 * (low.x + high.x), low.y, 0.5 * (low.z + high.z)};
    for (Vec& p : mesh.positions) p = scale * (p - foot);
}

void addNormals(Mesh& mesh) {
    mesh.normals.assign(mesh.positions.size(), Vec{});
    for (const auto& t : mesh.triangles)
        for (const std::uint32_t v : t) mesh.normals[v] = mesh.normals[v] + areaVector(mesh, t);
    for (Vec& n : mesh.normals) n = unit(n);
}

/// Fixed text form: nine digits are enough to tell two floats apart, and the same everywhere.
void writeObj(const Mesh& mesh, const std::filesystem::path& path, const char* title) {
    std::FILE* file = std::fopen(path.c_str(), "wb");
    if (file == nullptr) throw std::runtime_error("cannot write " + path.string());
    std::fprintf(file, "# %s, %zu triangles. Written by crt-meshgen.\n", title, mesh.triangles.size());
    // Adding zero turns −0 into 0: which of the two a sum gives is unspecified.
    for (const Vec& p : mesh.positions)
        std::fprintf(file, "v %.9g %.9g %.9g\n", p.x + 0.0, p.y + 0.0, p.z + 0.0);
    for (const Vec& n : mesh.normals)
        std::fprintf(file, "vn %.9g %.9g %.9g\n", n.x + 0.0, n.y + 0.0, n.z + 0.0);
    for (const auto& t : mesh.triangles) {
        if (mesh.normals.empty())
            std::fprintf(file, "f %u %u %u\n", t[0] + 1, t[1] + 1, t[2] + 1);
        else
            std::fprintf(file, "f %u//%u %u//%u %u//%u\n", t[0] + 1, t[0] + 1, t[1] + 1, t[1] + 1, t[2] + 1,
                         t[2] + 1);
    }
    const bool failed = std::ferror(file) != 0;
    if (std::fclose(file) != 0 || failed) throw std::runtime_error("cannot write " + path.string());
}

}  // namespace crt::meshgen
