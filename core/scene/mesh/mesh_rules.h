/// Rules that all readers of meshes share: groups of faces, triangles to leave out, normals, and the
/// counting of losses.
#pragma once

#include "base/vec3d.h"
#include "scene/scene.h"

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

namespace crt {

/// Something wrong that costs a part of the file and not the file: how often, and the first of them.
struct MeshLoss {
    std::uint64_t count = 0;
    int line = 0;
    std::string sentence;

    void add(int at_line, const std::string& what) {
        if (count++ == 0) line = at_line, sentence = what;
    }
    /// The results after it, in lines counted from `first_line`.
    void add(const MeshLoss& behind, int first_line = 0) {
        if (count == 0 && behind.count > 0) line = behind.line + first_line, sentence = behind.sentence;
        count += behind.count;
    }
};

/// The names that the statements g and o give to faces; empty: none of them.
struct MeshPart {
    std::string group, object;
    bool operator==(const MeshPart&) const = default;
};

inline constexpr double kMostMeshUv = 1e6;  ///< Beyond it nothing is left of the texel.

/// Vertices and normals that cannot be read are NaN while a mesh is put together.
inline bool isNumber(const Vec3d& v) { return !std::isnan(v[0]); }

/// Throws crt::Error(Scene) at a line of the file; 0: at none.
[[noreturn]] void failMesh(const std::string& sentence, const std::string& file, int line = 0);

/// No area beyond what rounding the coordinates to double can make up: collinear points seldom give exactly
/// zero.
bool isDegenerate(const Vec3d& a, const Vec3d& b, const Vec3d& c);

/// A position that triangles have; the origin where there are none.
Vec3d somePosition(const Mesh& mesh);

/// To unit length; those without a direction become NaN.
void normaliseNormals(std::vector<Vec3d>& normals);

/// "1 face", "2 faces"
std::string counted(std::uint64_t count, const char* what);

}  // namespace crt
