#include "scene/mesh/mesh_rules.h"

#include "base/error.h"
#include "base/parallel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <limits>

namespace crt {
namespace {

double maxAbs(const Vec3d& v) { return std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])}); }

}  // namespace

bool isDegenerate(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    const double scale = std::max(maxAbs(b - a), maxAbs(c - a));
    if (!(scale > 0.0)) return true;
    // Edges of size one, so that neither a mesh in metres nor one in parsecs overflows.
    const auto edge = [&](const Vec3d& to) {
        Vec3d e = to - a;
        for (double& x : e) x /= scale;
        return e;
    };
    const double coordinate = std::max({maxAbs(a), maxAbs(b), maxAbs(c)}) / scale;
    return length(cross(edge(b), edge(c))) <=
           4.0 * std::numeric_limits<double>::epsilon() * (1.0 + coordinate);
}

Vec3d somePosition(const Mesh& mesh) {
    return mesh.triangles.empty() ? Vec3d{} : mesh.positions[mesh.triangles.front()[0]];
}

void normaliseNormals(std::vector<Vec3d>& normals) {
    constexpr std::size_t kNormals = std::size_t{1} << 14;
    parallelFor(normals.size(), kNormals, [&](std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i) {
            Vec3d& n = normals[i];
            // First to size one: squares of very long or short normals would not fit.
            const double scale = maxAbs(n);
            for (double& x : n) x /= scale;
            const double unit = length(n);
            for (double& x : n) x /= unit;
            if (isNumber(n) && std::isfinite(unit)) continue;
            n.fill(std::numeric_limits<double>::quiet_NaN());
        }
    });
}

void failMesh(const std::string& sentence, const std::string& file, int line) {
    throw Error(ErrorKind::Scene, sentence, {file, line});
}

std::string counted(std::uint64_t count, const char* what) {
    return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

}  // namespace crt
