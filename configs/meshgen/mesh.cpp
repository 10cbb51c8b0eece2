#include "mesh.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string>

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

namespace {

/// Least significant byte first.
template <class T>
void append(std::string& bytes, T value) {
    std::array<char, sizeof value> raw;
    std::memcpy(raw.data(), &value, sizeof value);
    if (std::endian::native == std::endian::big) std::reverse(raw.begin(), raw.end());
    bytes.append(raw.data(), raw.size());
}

void append(std::string& bytes, const Vec& v) {
    for (const double x : {v.x, v.y, v.z}) append(bytes, static_cast<float>(x));
}

}  // namespace

void writePly(const Mesh& mesh, const std::filesystem::path& path) {
    std::string bytes =
        "ply\nformat binary_little_endian 1.0\ncomment written by crt-meshgen\nelement vertex " +
        std::to_string(mesh.positions.size()) + "\nproperty float x\nproperty float y\nproperty float z\n";
    if (!mesh.normals.empty()) bytes += "property float nx\nproperty float ny\nproperty float nz\n";
    if (!mesh.colors.empty()) bytes += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    bytes += "element face " + std::to_string(mesh.triangles.size()) +
             "\nproperty list uchar int vertex_indices\nend_header\n";
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
        append(bytes, mesh.positions[i]);
        if (!mesh.normals.empty()) append(bytes, mesh.normals[i]);
        if (!mesh.colors.empty())
            for (const std::uint8_t c : mesh.colors[i]) append(bytes, c);
    }
    for (const auto& triangle : mesh.triangles) {
        append(bytes, std::uint8_t{3});
        for (const std::uint32_t v : triangle) append(bytes, static_cast<std::int32_t>(v));
    }
    std::ofstream file(path, std::ios::binary);
    file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    file.close();
    if (!file) throw std::runtime_error("cannot write " + path.string());
}

}  // namespace crt::meshgen
