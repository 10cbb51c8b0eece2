#include "scene/yaml/scene_schema_surfaces.h"

#include "scene/yaml/scene_schema_values.h"

namespace crt {

using namespace schema;

void addAnisotropy(std::vector<SectionSchema>& all) {
    for (SectionSchema& section : all) {
        if (section.name != "material/rough_conductor" && section.name != "material/rough_dielectric")
            continue;
        section.keys.push_back(
            {.name = "roughness_anisotropy",
             .kind = Kind::Number,
             .range = {.min = 0, .max = 1},
             .fallback = "0",
             .doc = "How much sharper reflections are across the tangent than along it, as of brushed "
                    "metal. As in OpenPBR Surface 1.1, with a for it and r for `roughness`: GGX's width is "
                    "r² √(2 / (1 + (1 − a)²)) along the tangent and 1 − a times that across, "
                    "here at least 1/50 of it, so that above 0.98 nothing changes. The tangent is the "
                    "direction in which the texture coordinate u grows and v stays. Faces without texture "
                    "coordinates have the horizontal direction, around the axis y, as turned on a lathe; "
                    "where they face along that axis, x. `roughness` must be a number then."});
        section.keys.push_back({.name = "anisotropy_rotation_deg",
                                .kind = Kind::Number,
                                .range = {.min = -360, .max = 360},
                                .unit = "degrees",
                                .fallback = "0",
                                .doc = "Turns the tangent, counter-clockwise seen from the outside."});
    }
}

}  // namespace crt
