#include "scene/yaml/scene_schema_gltf.h"

#include "scene/yaml/scene_schema_values.h"

#include <algorithm>
#include <iterator>

namespace crt {

using namespace schema;

void addGltf(std::vector<SectionSchema>& all) {
    constexpr ValueRange kIndex{0, 1e9, false, false};
    const auto object =
        std::find_if(all.begin(), all.end(), [](const SectionSchema& s) { return s.name == "object"; });
    all.insert(
        std::next(object),
        {"gltf",
         "a gltf",
         "The triangles of a primitive of a glTF 2.0 file or GLB: positions, normals, texture coordinates "
         "and colours of vertices. Placement and material are the object's.",
         {{.name = "file",
           .required = true,
           .doc = "A glTF file or GLB; looked up in the scene's folder, then in CRT_MESH_PATH."},
          {.name = "mesh",
           .kind = Kind::Integer,
           .range = kIndex,
           .required = true,
           .doc = "Its number in the file, from 0."},
          {.name = "primitive",
           .kind = Kind::Integer,
           .range = kIndex,
           .fallback = "0",
           .doc = "The number of the mesh's primitive, from 0."},
          {.name = "uv_set",
           .kind = Kind::Integer,
           .range = {0, 7, false, false},
           .fallback = "0",
           .doc = "Number of the texture coordinates: TEXCOORD_0, TEXCOORD_1, …"},
          {.name = "color_factor",
           .kind = Kind::Number,
           .shape = Shape::List,
           .count_min = 3,
           .count_max = 3,
           .range = {0, 1, false, false},
           .fallback = "[1, 1, 1]",
           .doc = "Factor on the colours of vertices, linear [r, g, b]."},
          {.name = "vertex_opacity",
           .kind = Kind::Boolean,
           .fallback = "false",
           .doc = "The alpha of the colours of vertices is there for `{attribute: opacity}`, in place of "
                  "texture coordinates."},
          {.name = "allow_outside",
           .kind = Kind::Boolean,
           .fallback = "false",
           .doc = "The file's buffers may lie outside its folder; else they are refused."}}});
}

}  // namespace crt
