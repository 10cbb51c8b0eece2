#include "scene/yaml/scene_schema_textures.h"

#include "scene/yaml/scene_schema_values.h"

#include <string>
#include <utility>

namespace crt {
namespace {

using namespace schema;

constexpr ValueRange kTurns{-kMostUv, kMostUv, false, false};

/// Transforms of texture coordinates, for all textures.
std::vector<KeySchema> transformKeys() {
    return {{.name = "scale",
             .kind = Kind::Number,
             .shape = Shape::OneOrList,
             .count_min = 2,
             .count_max = 2,
             .range = kTurns,
             .fallback = "1",
             .doc = "Factor on u and v, one for both or [for u, for v], applied first: 4 repeats an image "
                    "four times, -1 mirrors it."},
            {.name = "rotation_deg",
             .kind = Kind::Number,
             .range = kTurns,
             .unit = "degrees",
             .fallback = "0",
             .doc = "Then (u, v) is turned counter-clockwise about (0, 0), which turns the image "
                    "clockwise."},
            {.name = "offset",
             .kind = Kind::Number,
             .shape = Shape::List,
             .count_min = 2,
             .count_max = 2,
             .range = kTurns,
             .fallback = "[0, 0]",
             .doc = "Then [u, v] is added."}};
}

SectionSchema with(SectionSchema section, const std::vector<KeySchema>& keys) {
    section.keys.insert(section.keys.end(), keys.begin(), keys.end());
    return section;
}

/// A pattern (CRT_PATTERN_LIST) by its word and its numbers, each with a range and a default.
SectionSchema pattern(const std::string& word, std::string title, std::string doc, std::string values,
                      const std::vector<KeySchema>& numbers = {}) {
    SectionSchema section{"texture/" + word,
                          std::move(title),
                          std::move(doc),
                          {{.name = word,
                            .kind = Kind::Spectrum,
                            .shape = Shape::List,
                            .count_min = 2,
                            .count_max = 2,
                            .section = "texture",
                            .required = true,
                            .doc = std::move(values) + " Each may be a texture."}}};
    return with(with(std::move(section), numbers), transformKeys());
}

}  // namespace

std::span<const KeySchema> numbersOfPattern(const SectionSchema& section) {
    return std::span(section.keys).subspan(1, section.keys.size() - 1 - transformKeys().size());
}

void addTextures(std::vector<SectionSchema>& all) {
    all.push_back(with(
        {"texture/texture",
         "a texture",
         "An image on a surface with texture coordinates (`uvs` of a mesh, `vt` of an OBJ): (0, 0) is the "
         "lower left corner of the image, (1, 1) the upper right. Colours become spectra as `rgb` does; "
         "alpha is used only with `channel: alpha`.",
         {{.name = "texture",
           .required = true,
           .doc = "A PNG, JPEG, TGA, EXR, Radiance HDR or PFM, by content; looked up in the scene's folder, "
                  "then in CRT_MESH_PATH. Or a glTF file or GLB, with `image`. Colours of an EXR with "
                  "alpha, which are multiplied by it, are divided by it. The primaries of an EXR and of an "
                  "HDR are converted to those of sRGB. Ignored, with a warning where they would change the "
                  "image: EXPOSURE and COLORCORR of an HDR, gAMA, cHRM and cICP of a PNG, ICC profiles "
                  "and the EXIF orientation of PNG and JPEG."},
          {.name = "image",
           .kind = Kind::Integer,
           .range = {0, 1e9, false, false},
           .doc = "Number of the image in a glTF file or GLB, from 0."},
          {.name = "color_space",
           .kind = Kind::Choice,
           .choices = {"auto", "srgb", "linear", "raw"},
           .fallback = "auto",
           .doc = "Encoding of the numbers: sRGB, linear, or unchanged (`raw`, for data other than "
                  "colours). `auto` is srgb for 8 and 16 bits, linear for floats, raw where the key wants a "
                  "number. Reflectances above 1 are clamped, with a warning."},
          {.name = "channel",
           .kind = Kind::Choice,
           .choices = {"red", "green", "blue", "alpha"},
           .fallback = "red",
           .doc = "Of an image in colours, where the key wants a number. `alpha` is 1 where an image has "
                  "none."},
          {.name = "factor",
           .kind = Kind::Number,
           .shape = Shape::OneOrList,
           .count_min = 3,
           .count_max = 3,
           .range = {0, 1, false, false},
           .fallback = "1",
           .doc = "Factor on the texels: of colours on linear red, green and blue, one for all or "
                  "[r, g, b]."},
          {.name = "vertex_colors",
           .kind = Kind::Boolean,
           .fallback = "false",
           .doc = "True: colours are multiplied by those of the mesh's vertices, which it must have."},
          {.name = "cutoff",
           .kind = Kind::Number,
           .range = {0, 1, false, false},
           .doc = "Where the key wants a number: texels below it are 0, those from it on are 1, "
                  "before `factor`."},
          {.name = "filter",
           .kind = Kind::Choice,
           .choices = {"bilinear", "nearest"},
           .fallback = "bilinear",
           .doc = "Between texels: linear in reflectance, at every wavelength; or the texel itself."},
          {.name = "wrap",
           .kind = Kind::Choice,
           .choices = {"repeat", "mirror", "clamp"},
           .fallback = "repeat",
           .doc = "Beyond the image: the image again, the image mirrored, or its edge."}}},
        transformKeys()));
    all.push_back(pattern("checker", "a checker",
                          "A checkerboard of two values with squares of side 1 in u and v, on a surface "
                          "with texture coordinates.",
                          "The value of the square from (0, 0) to (1, 1), and of its neighbours."));
    all.push_back({"texture/attribute",
                   "an attribute",
                   "Values at the vertices of a mesh, with linear interpolation at every wavelength.",
                   {{.name = "attribute",
                     .kind = Kind::Choice,
                     .choices = {"colors", "opacity"},
                     .required = true,
                     .doc = "`colors` of a mesh that is written out, of a PLY or of a gltf; for a number "
                            "`opacity`, of a gltf with `vertex_opacity`."},
                    {.name = "factor",
                     .kind = Kind::Number,
                     .range = {0, 1, false, false},
                     .fallback = "1",
                     .doc = "Factor on opacities."},
                    {.name = "cutoff",
                     .kind = Kind::Number,
                     .range = {0, 1, false, false},
                     .doc = "Opacities below it are 0, those from it on are 1, before `factor`."}}});
}

}  // namespace crt
