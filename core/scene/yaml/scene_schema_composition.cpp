#include "scene/yaml/scene_schema_composition.h"

#include "scene/yaml/scene_schema_values.h"

#include <algorithm>
#include <string_view>
#include <utility>

namespace crt {

using namespace schema;

namespace {

const SectionSchema& schemaOf(const std::vector<SectionSchema>& all, std::string_view name) {
    return *std::find_if(all.begin(), all.end(), [&](const SectionSchema& s) { return s.name == name; });
}

}  // namespace

void addCompositions(std::vector<SectionSchema>& all) {
    for (SectionSchema& section : all)
        if (section.name.starts_with("material/"))
            section.keys.push_back({.name = "normal_map",
                                    .kind = Kind::Section,
                                    .section = "normal_map",
                                    .doc = "Normals from an image."});
    all.push_back({"material/mix",
                   "a mix material",
                   "Each of two materials has a share of the surface. As in pbrt-v4, each sample takes one "
                   "of them at random. They may be mixes themselves, up to 8 deep, but have no opacity: "
                   "give it to the whole.",
                   {typeKey("mix", "material"),
                    {.name = "materials",
                     .shape = Shape::List,
                     .count_min = 2,
                     .count_max = 2,
                     .required = true,
                     .doc = "Two names in `materials`."},
                    {.name = "amount",
                     .kind = Kind::Number,
                     .range = {.min = 0, .max = 1},
                     .section = "texture",
                     .fallback = "0.5",
                     .doc = "Share of the second: 0 is the first alone."}}});
    all.push_back({"material/two_sided",
                   "a two_sided material",
                   "A material for each side of a sheet. (Others look the same from both, but for glass, "
                   "which cannot be a side.)",
                   {typeKey("two_sided", "material"),
                    {.name = "front",
                     .required = true,
                     .doc = "A name in `materials`: of the side that normals point to."},
                    {.name = "back", .required = true, .doc = "A name in `materials`: of the other."}}});
    for (SectionSchema& section : all)
        if (section.name.starts_with("material/"))
            section.keys.push_back(
                {.name = "opacity",
                 .kind = Kind::Number,
                 .range = {.min = 0, .max = 1},
                 .section = "texture",
                 .fallback = "1",
                 .doc =
                     "Opacity of the surface, as of leaves cut out by an image. Light passes the rest "
                     "unchanged; shadow rays do too. In a `dielectric` or `rough_dielectric`, light that "
                     "enters through a hole is not in the glass, and leaves without meeting the surface "
                     "from inside. Light in the glass meets no hole."});
    SectionSchema map{
        "normal_map",
        "a normal map",
        "Normals from an image, on a surface with texture coordinates: red, green and blue are their "
        "components along the image's rows to the right, up its columns, and away from the surface, each "
        "from -1 (0) to 1 (the largest number), as OpenGL and glTF have them. They turn what is "
        "seen of the surface, not where it is. Coordinates that are mirrored mirror the relief. Surfaces "
        "that reflect lose no light by it (Schüßler et al. 2017), nor does glass: what would leave to the "
        "wrong side is mirrored by the surface.",
        {{.name = "texture",
          .required = true,
          .doc = "An image in colours: PNG, JPEG, TGA, EXR, Radiance HDR or PFM, or a glTF file or GLB, "
                 "with `image`. Its numbers are taken as they are."},
         {.name = "strength",
          .kind = Kind::Number,
          .range = {.min = 0, .max = 100},
          .fallback = "1",
          .doc = "Factor on the slopes: 0 is the surface's own normal."}}};
    for (const char* name : {"image", "filter", "wrap", "scale", "rotation_deg", "offset"})
        map.keys.push_back(*schemaOf(all, "texture/texture").find(name));
    all.push_back(std::move(map));
}

}  // namespace crt
