#include "scene/yaml/scene_schema_composition.h"

#include "scene/yaml/scene_schema_values.h"

namespace crt {

using namespace schema;

void addCompositions(std::vector<SectionSchema>& all) {
    all.push_back({"material/mix",
                   "a mix material",
                   "Two materials, of which each has a share of the surface, too fine to be seen: as in "
                   "pbrt-v4, each sample takes one of them by chance. They may be mixes themselves, up to 8 "
                   "deep.",
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
                 .doc = "Share of the surface that is there, as of leaves cut out by an image. The rest "
                        "is a hole, which light passes unchanged, shadow rays too; that is no scattering "
                        "event. What emits through holes is not sampled as a light. Parts of a mix have "
                        "none, but the mix may."});
}

}  // namespace crt
