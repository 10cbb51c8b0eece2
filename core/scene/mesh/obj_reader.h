/// The text of an OBJ file → what its statements say. Faces may name vertices that follow them, so indices
/// are checked by whoever puts the mesh together.
#pragma once

#include "base/stage.h"
#include "spectra/spectra.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace crt {

/// One corner of a face, counted from 0.
struct ObjCorner {
    std::int64_t position;
    std::int64_t normal;  ///< kNoObjNormal where it names none, kBadObjNormal where that is not to be read.
};
inline constexpr std::int64_t kNoObjNormal = -1;
inline constexpr std::int64_t kBadObjNormal = -2;

/// A polygon: a run of corners, its material, and where it stands in the file.
struct ObjFace {
    std::size_t first_corner;
    std::uint32_t corner_count;
    std::int32_t material;  ///< Index into material_names; −1 none.
    int line;
};

/// Something wrong that costs a part of the file and not the file: how often, and the first of them.
struct ObjLoss {
    std::uint64_t count = 0;
    int line = 0;
    std::string sentence;

    void add(int at_line, const std::string& what) {
        if (count++ == 0) line = at_line, sentence = what;
    }
};

struct ObjContents {
    std::vector<Vec3d> positions;  ///< NaN where they cannot be read.
    std::vector<Vec3d> normals;    ///< As they stand there; NaN where they cannot be read.
    std::vector<ObjCorner> corners;
    std::vector<ObjFace> faces;
    std::vector<std::string> material_names;  ///< Of usemtl, each once.
    struct Library {
        std::string arguments;
        int line;
    };
    std::vector<Library> libraries;  ///< The mtllib statements, each once.

    ObjLoss bad_positions, bad_normals, small_faces;
    std::uint64_t lines = 0, points = 0, free_forms = 0;  ///< Statements l, p, and curves or surfaces.
    bool vertex_colors = false;
};

/// Reads an OBJ and says in `stage` how far it is. Numbers are correctly rounded. Throws crt::Error(Scene)
/// with file:line for a corner of a face that names no vertex.
ObjContents readObj(std::string_view text, const std::string& path, Stage& stage);

}  // namespace crt
