#include "scene/yaml/scene_schema_surfaces.h"

#include "scene/yaml/scene_schema_values.h"

#include <algorithm>
#include <utility>

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

namespace {

/// A number from 0 to 1.
KeySchema weight(std::string name, std::string fallback, std::string doc, bool textured = false) {
    return {.name = std::move(name),
            .kind = Kind::Number,
            .range = {.min = 0, .max = 1},
            .section = textured ? "texture" : "",
            .fallback = std::move(fallback),
            .doc = std::move(doc)};
}

KeySchema color(std::string name, std::string fallback, std::string doc, bool textured = false) {
    return {.name = std::move(name),
            .kind = Kind::Spectrum,
            .range = {.min = 0, .max = 1},
            .section = textured ? "texture" : "",
            .fallback = std::move(fallback),
            .doc = std::move(doc)};
}

KeySchema amount(std::string name, ValueRange range, std::string fallback, std::string doc,
                 std::string unit = "") {
    return {.name = std::move(name),
            .kind = Kind::Number,
            .range = range,
            .unit = std::move(unit),
            .fallback = std::move(fallback),
            .doc = std::move(doc)};
}

KeySchema refused(std::string name, const char* what) {
    return amount(std::move(name), kNotNegative, "0", std::string("Above 0 it is refused: ") + what);
}

}  // namespace

void addOpenPbr(std::vector<SectionSchema>& all) {
    const auto place = std::find_if(all.begin(), all.end(),
                                    [](const SectionSchema& s) { return s.name == "material/mix"; });
    const auto diffuse = std::find_if(all.begin(), all.end(),
                                      [](const SectionSchema& s) { return s.name == "material/diffuse"; });
    SectionSchema section{
        "material/openpbr",
        "an openpbr material",
        "A part of [OpenPBR Surface 1.1](https://academysoftwarefoundation.github.io/OpenPBR/), by its "
        "names: base, specular, transmission, coat, thin film, fuzz, emission and opacity. It becomes "
        "materials of crt, mixed by `base_metalness`, `transmission_weight` and `coat_weight`, and all "
        "light is spectral. A metal is a `rough_conductor` that reflects F82-tint's curve (below 0 beside "
        "the dip of a dark tint: 0). A glossy base is a `plastic` in the reciprocal form of the "
        "specification, which gives `base_color` to what comes out of the gloss; a clear one is a "
        "`rough_dielectric`, its `specular_weight` an index. Rough surfaces give back what microfacets "
        "lose, as elsewhere in crt. Subsurface and thin walls are refused where they would be seen, and so "
        "is what the material that it becomes has not; the message says what to write instead. Keys of the "
        "specification that are not in this table are unknown.",
        {typeKey("openpbr", "material"), weight("base_weight", "1", "Factor on `base_color`."),
         color("base_color", "0.8",
               "Of metals what they reflect straight on, of others what comes out of the base.", true),
         weight("base_diffuse_roughness", "0",
                "As `roughness` of `diffuse`, of what comes out of the gloss."),
         weight("base_metalness", "0", "Share of the surface that is metal.", true),
         amount("specular_weight", kNotNegative, "1",
                "Factor on what is reflected straight on: of dielectrics by another index, of metals at all "
                "angles."),
         color("specular_color", "1",
               "Of metals the share of Schlick's reflectance that is left at 82°. Must be 1 for others."),
         weight("specular_roughness", "0.3", "As `roughness` of `rough_conductor`.", true),
         weight("specular_roughness_anisotropy", "0", "As `roughness_anisotropy` of `rough_conductor`."),
         amount("anisotropy_rotation_deg", {.min = -360, .max = 360}, "0",
                "Turns the tangent, counter-clockwise seen from the outside. Not of the specification, "
                "which leaves the tangent to others.",
                "degrees"),
         amount("specular_ior", {.min = 1e-3, .max = 1e3}, "1.5",
                "Refractive index of the inside relative to the outside, at 587.6 nm."),
         weight("transmission_weight", "0", "Share of the dielectric that is clear.", true),
         color("transmission_color", "1", "What is left of white light after `transmission_depth`."),
         amount("transmission_depth", kNotNegative, "0", "How far light goes until then.", "scene units"),
         weight("transmission_dispersion_scale", "0",
                "0: the index is the same at all wavelengths; 1: Abbe's number is the next key."),
         amount("transmission_dispersion_abbe_number", kPositive, "20",
                "Over the scale it is Abbe's number; the index follows Cauchy's two terms."),
         weight("thin_film_weight", "0", "Share of the surface that has a film."),
         amount("thin_film_thickness", {.min = 0, .max = 20}, "0.5", "How thick the film is.", "µm"),
         amount("thin_film_ior", {.min = 0.1, .max = 10}, "1.4", "Its index relative to the outside."),
         refused("subsurface_weight", "no light wanders below surfaces."),
         weight("coat_weight", "0",
                "Share of the surface that a coat lies on: a clear or tinted dielectric, like lacquer. It "
                "mirrors white; what lies below gets the rest, and has the index `specular_ior` relative to "
                "the coat's (or the inverse, where that is above 1). A clear base has no coat.",
                true),
         color("coat_color", "1",
               "What is left of white light that crosses the coat straight on, in and out. Along the "
               "surface its way is longer, and the colour deeper."),
         weight("coat_roughness", "0",
                "As `roughness` of `plastic`. What is seen through a rough coat is rougher: "
                "(`specular_roughness`⁴ + 2 `coat_roughness`⁴)^¼, at most 1."),
         weight("coat_roughness_anisotropy", "0", "Above 0 it is refused where the coat is rough."),
         amount("coat_ior", {.min = 1e-3, .max = 1e3}, "1.6",
                "Its index relative to the outside. Below 1 and above 10 it is refused."),
         weight("coat_darkening", "1",
                "1: the base gets darker and more saturated under the coat, which sends light back to it; "
                "0: it keeps its colour."),
         weight("fuzz_weight", "0",
                "Share of the surface that fibres stand on, like velvet or dust: bright along the surface "
                "(Zeltner, Burley and Chiang 2022). What they take of light towards the viewer, whatever "
                "their colour, is missing from what lies below. Seen from inside a clear body there are "
                "none."),
         color("fuzz_color", "1", "Of what the fibres take, the share that they send on."),
         weight("fuzz_roughness", "0.5",
                "How much the fibres lean apart: 0 is a thin rim, 1 dust. Below 0.01 it is 0.01."),
         amount("emission_luminance", kNotNegative, "0",
                "Light that the front side emits, equally in all directions, on top of what it scatters. "
                "`geometry_opacity` takes its share. An object of this material has no `emission` then, and "
                "the material no fuzz and no coat.",
                "cd/m²"),
         {.name = "emission_color",
          .kind = Kind::Spectrum,
          .range = kNotNegative,
          .fallback = "{rgb: [1, 1, 1]}",
          .doc = "Its spectrum, times that. An `rgb` of 1 is D65 of luminance 1; a darker or brighter "
                 "colour makes a darker or brighter light."},
         weight("geometry_opacity", "1",
                "Share of the surface that is there; light passes the rest unchanged, shadow rays too.",
                true),
         {.name = "geometry_thin_walled",
          .kind = Kind::Boolean,
          .fallback = "false",
          .doc = "`true` is refused: `thin_dielectric` is a pane."}}};
    section.keys.push_back(*diffuse->find("normal_map"));
    all.insert(place, std::move(section));
}

}  // namespace crt
