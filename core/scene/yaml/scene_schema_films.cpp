#include "scene/yaml/scene_schema_films.h"

#include "scene/yaml/scene_schema_values.h"

namespace crt {

using namespace schema;

KeySchema thinFilmKey() {
    return {.name = "thin_film",
            .kind = Kind::Section,
            .section = "thin_film",
            .doc = "A film on the outside. The reflections from its two sides interfere."};
}

void addThinFilm(std::vector<SectionSchema>& all) {
    all.push_back(
        {"thin_film",
         "a thin film",
         "Oil on a puddle, oxide on anodised metal, a soap bubble: Airy's sum of all rounds within the "
         "film, for both polarisations and at each wavelength. It absorbs nothing. A soap bubble is a "
         "`thin_dielectric` of `ior: 1` with a film: air, water, air.",
         {{.name = "thickness_nm",
           .kind = Kind::Number,
           .range = {.min = 0, .max = 20000},
           .unit = "nm",
           .required = true,
           .doc = "Thickness; 0: no film."},
          {.name = "relative_thickness",
           .kind = Kind::Number,
           .range = {.min = 0, .max = 1},
           .section = "texture",
           .fallback = "1",
           .doc = "Factor on `thickness_nm`. Not a texture on `rough_dielectric`."},
          {.name = "ior",
           .kind = Kind::Spectrum,
           .range = {.min = 0.1, .max = 10},
           .required = true,
           .doc = "Refractive index of the film relative to the outside."}}});
}

}  // namespace crt
