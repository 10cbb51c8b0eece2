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
             .doc = "Anisotropy: reflections are sharper across the tangent than along it, as for brushed "
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
        "light is spectral. A metal is a `rough_conductor` that follows the F82-tint curve, clamped at 0 "
        "where a dark tint would make it negative. A glossy base is a `plastic` in the reciprocal form of "
        "the specification, which gives `base_color` to what comes out of the gloss; a clear one is a "
        "`rough_dielectric`, its `specular_weight` an index. Rough surfaces compensate the energy loss of "
        "microfacets, as elsewhere in crt. Subsurface in bodies is refused where it would be visible, and "
        "so are features that crt's own material lacks; the message says what to write "
        "instead. Other keys of the specification are unknown.",
        {typeKey("openpbr", "material"),
         weight("base_weight", "1", "Factor on `base_color`."),
         color("base_color", "0.8",
               "For metals the reflectance at normal incidence, for other materials the colour of the base.",
               true),
         weight("base_diffuse_roughness", "0",
                "As `roughness` of `diffuse`, of what comes out of the gloss, whose roughness and whose "
                "coat's must be numbers then."),
         weight("base_metalness", "0", "Share of the surface that is metal.", true),
         amount("specular_weight", kNotNegative, "1",
                "Factor on what is reflected straight on: of dielectrics by another index, of metals at all "
                "angles."),
         color("specular_color", "1",
               "Of metals the share of Schlick's reflectance that is left at 82°, which is no texture. Of "
               "the gloss on an opaque base a factor on what is mirrored. Must be 1 for clear ones.",
               true),
         weight("specular_roughness", "0.3", "As `roughness` of `rough_conductor`.", true),
         weight("specular_roughness_anisotropy", "0", "As `roughness_anisotropy` of `rough_conductor`."),
         amount("anisotropy_rotation_deg", {.min = -360, .max = 360}, "0",
                "Turns the tangent, counter-clockwise seen from the outside. Not part of the specification, "
                "which does not define the tangent.",
                "degrees"),
         amount("specular_ior", {.min = 1e-3, .max = 1e3}, "1.5",
                "Refractive index of the inside relative to the outside, at 587.6 nm."),
         weight("transmission_weight", "0", "Share of the dielectric that is clear.", true),
         color("transmission_color", "1", "Transmittance over `transmission_depth`."),
         amount("transmission_depth", kNotNegative, "0", "Distance of that transmittance.", "scene units"),
         weight("transmission_dispersion_scale", "0",
                "0: the index is the same at all wavelengths; 1: Abbe's number is the next key."),
         amount("transmission_dispersion_abbe_number", kPositive, "20",
                "Over the scale it is Abbe's number; the index follows Cauchy's two terms."),
         weight("thin_film_weight", "0", "Share of the surface that has a film."),
         amount("thin_film_thickness", {.min = 0, .max = 20}, "0.5", "Thickness of the film.", "µm"),
         amount("thin_film_ior", {.min = 0.1, .max = 10}, "1.4", "Its index relative to the outside."),
         weight("subsurface_weight", "0",
                "Share of the base that lets light through. Above 0 it is refused without "
                "`geometry_thin_walled`: crt has no subsurface scattering in bodies. In a thin wall it is "
                "diffuse reflection and transmission, below the gloss of both sides.",
                true),
         color("subsurface_color", "0.8", "Their colour, reflection and transmission together.", true),
         amount("subsurface_scatter_anisotropy", {.min = -1, .max = 1}, "0",
                "g: the share (1 + g) / 2 is transmitted, the rest reflected."),
         weight("coat_weight", "0",
                "Share of the surface that a coat lies on: a clear or tinted dielectric, like lacquer. Its "
                "reflection is white; the layers below get the rest. A dielectric base has the index "
                "`specular_ior` relative to the coat's (or the inverse, where that is above 1). crt "
                "evaluates a metal under the coat at the angle in air, not at the smaller angle inside the "
                "coat. A clear base has no coat.",
                true),
         color("coat_color", "1",
               "Transmittance of the coat at normal incidence, in and out. At grazing angles the path is "
               "longer and the colour deeper."),
         weight("coat_roughness", "0",
                "As `roughness` of `plastic`. Layers below a rough coat look rougher: "
                "(`specular_roughness`⁴ + 2 `coat_roughness`⁴)^¼, at most 1.",
                true),
         weight("coat_roughness_anisotropy", "0", "Above 0 it is refused where the coat is rough."),
         amount("coat_ior", {.min = 1e-3, .max = 1e3}, "1.6",
                "Its index relative to the outside. Below 1 and above 10 it is refused."),
         weight("coat_darkening", "1",
                "1: the base gets darker and more saturated under the coat, which sends light back to it; "
                "0: it keeps its colour."),
         weight("fuzz_weight", "0",
                "Share of the surface that is covered by fibres, like velvet or dust: bright at grazing "
                "angles (Zeltner, Burley and Chiang 2022). The layers below lose all the light that the "
                "fibres intercept, whatever their colour. They are invisible from inside a clear body."),
         color("fuzz_color", "1", "Reflectance of the fibres."),
         weight("fuzz_roughness", "0.5",
                "Spread of the fibres: 0 is a thin rim, 1 dust. Below 0.01 it is 0.01."),
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
                "Opacity of the surface; light passes the rest unchanged, shadow rays too.", true),
         {.name = "geometry_thin_walled",
          .kind = Kind::Boolean,
          .fallback = "false",
          .doc = "The surface is a thin sheet instead of a body's: what is clear is a `thin_dielectric`, "
                 "smooth and in the tint of `transmission_color`; subsurface is as in `translucent`."}}};
    section.keys.push_back(*diffuse->find("normal_map"));
    all.insert(place, std::move(section));
}

}  // namespace crt
