/// The text of an OBJ file → what its statements say. Blocks of lines are read at the same time, and give
/// what one reader from the first line to the last would give.
#pragma once

#include "base/stage.h"
#include "scene/mesh/mesh_rules.h"
#include "spectra/spectra.h"

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace crt {

/// One corner of a face, counted from 0. All positions are there.
struct ObjCorner {
    std::uint32_t position;
    std::uint32_t normal;  ///< kNoObjNormal where it names none, kBadObjNormal where that is not there.
    std::uint32_t uv = 0xffffffffu;  ///< kNoObjUv where it names none, kBadObjUv where that is not there.
    bool operator==(const ObjCorner&) const = default;
};
inline constexpr std::uint32_t kNoObjNormal = 0xffffffffu;
inline constexpr std::uint32_t kBadObjNormal = 0xfffffffeu;
inline constexpr std::uint32_t kNoObjUv = 0xffffffffu;
inline constexpr std::uint32_t kBadObjUv = 0xfffffffeu;

/// A polygon: a run of corners, and where it stands in the file.
struct ObjFace {
    std::uint32_t first_corner;  ///< In its block.
    std::uint32_t corner_count;
    int line;
    bool operator==(const ObjFace&) const = default;
};

/// Names of a face and of those after it, up to the next run.
struct ObjRun {
    std::uint32_t first_face;  ///< In its block.
    std::int32_t material;     ///< Index into material_names; −1 none.
    std::int32_t part;         ///< Index into parts; −1 none.
    bool operator==(const ObjRun&) const = default;
};

/// The faces of some lines.
struct ObjBlock {
    std::vector<ObjCorner> corners;
    std::vector<ObjFace> faces;
    std::vector<ObjRun> runs;  ///< The first begins with the first face.
};

struct ObjContents {
    std::vector<Vec3d> positions;             ///< NaN where they cannot be read.
    std::vector<Vec3d> normals;               ///< As they stand there; NaN where they cannot be read.
    std::vector<std::array<double, 2>> uvs;   ///< Texture coordinates; 0 where they cannot be read.
    std::vector<ObjBlock> blocks;             ///< In the order of the file.
    std::vector<std::string> material_names;  ///< Of usemtl, each once.
    std::vector<MeshPart> parts;              ///< Of g and o, each once; none where there are no such lines.
    struct Library {
        std::string arguments;
        int line;
    };
    std::vector<Library> libraries;  ///< The mtllib statements, each once.

    MeshLoss bad_positions, bad_normals, bad_uvs, small_faces;
    std::uint64_t lines = 0, points = 0, free_forms = 0;  ///< Statements l, p, and curves or surfaces.
    bool vertex_colors = false;
};

inline constexpr std::size_t kObjBlockBytes = std::size_t{1} << 20;

/// Reads an OBJ and says in `stage` how far it is. Numbers are correctly rounded. Throws crt::Error(Scene)
/// with file:line for a corner of a face that names no vertex. `block_bytes` changes nothing but what a
/// thread reads at a time.
ObjContents readObj(std::string_view text, const std::string& path, Stage& stage,
                    std::size_t block_bytes = kObjBlockBytes);

}  // namespace crt
