// Over 450 lines: one table, of which documents, messages and readers are made.
#include "scene/yaml/scene_schema.h"

#include "base/error.h"
#include "scene/length_unit.h"
#include "scene/scene.h"
#include "scene/scene_limits.h"
#include "scene/yaml/scene_schema_composition.h"
#include "scene/yaml/scene_schema_films.h"
#include "scene/yaml/scene_schema_gltf.h"
#include "scene/yaml/scene_schema_lights.h"
#include "scene/yaml/scene_schema_surfaces.h"
#include "scene/yaml/scene_schema_textures.h"
#include "scene/yaml/scene_schema_values.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace crt {
namespace {

using namespace schema;

std::string trimmed(double degrees) { return fmt::format("{:.13g}", degrees); }

/// Keys that a spectrum may have whatever its form.
KeySchema scaleKey() {
    return {.name = "scale",
            .kind = Kind::Number,
            .range = kNotNegative,
            .fallback = "1",
            .doc = "Multiplies all values."};
}

KeySchema outsideKey() {
    return {.name = "outside",
            .kind = Kind::Choice,
            .choices = {"clamp", "zero", "error"},
            .doc = "Beyond the first and last wavelength: the end value, zero, or an error. Required unless "
                   "the data cover 360 to 830 nm. With `zero` the table keeps its integral: where "
                   "its end is not 0, the step is spread over the nanometres that it touches, and one "
                   "wavelength alone is refused, because it has no width."};
}

/// Light sources of a scene: emitters and the environment.
KeySchema radianceKey(std::string doc) {
    return {.name = "radiance",
            .kind = Kind::Spectrum,
            .range = kRadiance,
            .unit = "W·m⁻²·sr⁻¹·nm⁻¹",
            .required = true,
            .doc = std::move(doc)};
}

KeySchema materialType(std::string word) { return schema::typeKey(std::move(word), "material"); }

SectionSchema topLevel() {
    return {
        "",
        "the scene",
        "A scene file is one YAML map. Every key but `crt` may be left out.",
        {
            {.name = "crt",
             .kind = Kind::Integer,
             .range = {1, 1, false, false},
             .required = true,
             .doc = "Version of the scene format, 1. Must be the first key."},
            {.name = "include",
             .shape = Shape::OneOrList,
             .count_min = 1,
             .doc = "Scene files whose contents are added here; see [Shared "
                    "parts](#shared-parts)."},
            {.name = "title",
             .doc = "The title of the scene. crt writes it into image metadata and the "
                    "report."},
            {.name = "unit",
             .kind = Kind::Choice,
             .choices = lengthUnitNames(),
             .fallback = "m",
             .doc = "The length of one scene unit, which holds for the camera, meshes and their files, "
                    "transforms, and `absorption`. These numbers stay as they are written. "
                    "The unit matters to lights without a surface, whose watts, lumens and candelas "
                    "spread over square metres, and to watts and lumens of surfaces: with `mm`, a light at "
                    "distance 2000 is 2 m away. "
                    "Radiance, irradiance, luminance and illuminance do not depend on it. An included "
                    "file that gives another unit is an error."},
            {.name = "camera", .kind = Kind::Section, .section = "camera", .doc = "The viewpoint."},
            {.name = "film",
             .kind = Kind::Section,
             .section = "film",
             .doc = "The image: size, "
                    "filter, colour."},
            {.name = "integrator",
             .kind = Kind::Section,
             .section = "integrator",
             .doc = "The algorithm that computes light."},
            {.name = "sampler",
             .kind = Kind::Section,
             .section = "sampler",
             .doc = "Random numbers, and how many samples."},
            {.name = "spectra",
             .kind = Kind::Spectrum,
             .shape = Shape::Map,
             .doc = "Named spectra. A name may be used wherever a spectrum is expected."},
            {.name = "materials",
             .kind = Kind::Section,
             .shape = Shape::Map,
             .section = "material",
             .doc = "Named materials, used by objects."},
            {.name = "objects",
             .kind = Kind::Section,
             .shape = Shape::List,
             .section = "object",
             .fallback = "[]",
             .doc = "The geometry."},
            {.name = "lights",
             .kind = Kind::Section,
             .shape = Shape::List,
             .section = "light",
             .fallback = "[]",
             .doc = "Lights without a surface. Objects shine by their `emission`."},
            {.name = "environment",
             .kind = Kind::Section,
             .section = "environment",
             .fallback = "null",
             .nullable = true,
             .doc = "Light from infinitely far away; `null` is darkness."},
            {.name = "outputs",
             .kind = Kind::Section,
             .shape = Shape::List,
             .section = "output",
             .fallback = "[]",
             .doc = "Files to write."},
        }};
}

SectionSchema camera() {
    const Camera d;
    return {
        "camera",
        "camera",
        "A perspective camera in a right-handed world: image right is "
        "(target − position) × up. Give `fov`, "
        "or `focal_length` with `sensor`, not both.",
        {
            {.name = "position",
             .kind = Kind::Number,
             .shape = Shape::List,
             .count_min = 3,
             .count_max = 3,
             .unit = "scene units",
             .fallback = yaml(d.position),
             .doc = "Centre of the lens."},
            {.name = "target",
             .kind = Kind::Number,
             .shape = Shape::List,
             .count_min = 3,
             .count_max = 3,
             .unit = "scene units",
             .fallback = yaml(d.target),
             .doc = "The point in the middle of the image."},
            {.name = "up",
             .kind = Kind::Number,
             .shape = Shape::List,
             .count_min = 3,
             .count_max = 3,
             .fallback = yaml(d.up),
             .doc = "Direction that is up in the image; need not be perpendicular to the view."},
            {.name = "fov",
             .kind = Kind::Number,
             .range = {0, 180, true, true},
             .unit = "degrees",
             .fallback = trimmed(2 * std::atan(d.tan_half_height) * 180 / std::numbers::pi),
             .doc = "Full angle across the shorter side of the image."},
            {.name = "focal_length",
             .kind = Kind::Number,
             .range = kPositive,
             .unit = "as sensor",
             .doc = "Distance from lens to sensor."},
            {.name = "sensor",
             .kind = Kind::Number,
             .shape = Shape::List,
             .count_min = 2,
             .count_max = 2,
             .range = kPositive,
             .unit = "as focal_length",
             .doc = "Width and height of the sensor."},
            {.name = "aperture_radius",
             .kind = Kind::Number,
             .range = kNotNegative,
             .unit = "scene units",
             .fallback = yaml(d.aperture_radius),
             .doc = "Radius of the thin lens; 0 is a pinhole."},
            {.name = "focus_distance",
             .kind = Kind::Number,
             .range = kNotNegative,
             .unit = "scene units",
             .fallback = yaml(d.focus_distance),
             .doc = "Distance along the view axis at which a lens is sharp; 0 is the distance to `target`."},
        },
        {{KeyRule::Kind::AtMostOne, {"fov", "focal_length"}},
         {KeyRule::Kind::Together, {"focal_length", "sensor"}}}};
}

const std::vector<std::string> kFilters{"box", "gaussian", "blackman-harris"};

SectionSchema film() {
    const FilmSettings d;
    const std::vector<std::string> spaces{"srgb", "acescg", "xyz"};
    const std::vector<std::string> views(kViewTransformNames.begin(), kViewTransformNames.end());
    return {"film",
            "film",
            "The image and how samples become its pixels.",
            {
                {.name = "resolution",
                 .kind = Kind::Integer,
                 .shape = Shape::List,
                 .count_min = 2,
                 .count_max = 2,
                 .range = {1, 65535, false, false},
                 .unit = "pixels",
                 .fallback = fmt::format("[{}, {}]", d.width, d.height),
                 .doc = "Width and height; together at most 2^31 pixels."},
                {.name = "crop",
                 .kind = Kind::Integer,
                 .shape = Shape::List,
                 .count_min = 4,
                 .count_max = 4,
                 .range = {0, 65535, false, false},
                 .unit = "pixels",
                 .fallback = "null",
                 .nullable = true,
                 .doc = "Render only [x0, y0, x1, y1), x to the right, y down; `null` is the whole film."},
                {.name = "filter",
                 .kind = Kind::Choice,
                 .choices = kFilters,
                 .section = "filter",
                 .fallback = yaml(kFilters, d.filter),
                 .doc = "Reconstruction filter, by name or with its parameters."},
                {.name = "color_space",
                 .kind = Kind::Choice,
                 .choices = spaces,
                 .fallback = yaml(spaces, d.color_space),
                 .doc = "Meaning of the three channels: linear sRGB (Rec. 709), ACEScg (AP1), or CIE XYZ."},
                {.name = "white_balance",
                 .kind = Kind::Spectrum,
                 .fallback = "null",
                 .nullable = true,
                 .doc = "Adapts this illuminant's white to the white of the colour space. The name of an "
                        "illuminant or a spectrum. For PNG and PPM; for EXR and "
                        "PFM see `apply_to_float`."},
                {.name = "exposure_ev",
                 .kind = Kind::Number,
                 .range = {-100, 100, false, false},
                 .unit = "stops",
                 .fallback = yaml(d.exposure_ev),
                 .doc = "The image is multiplied by 2 to this power. For PNG and PPM; for EXR and PFM see "
                        "`apply_to_float`."},
                {.name = "apply_to_float",
                 .kind = Kind::Boolean,
                 .fallback = yaml(d.apply_to_float),
                 .doc = "EXR and PFM get `white_balance` and `exposure_ev` too. Without it they hold the "
                        "radiance of the scene, in `color_space`."},
                {.name = "view",
                 .kind = Kind::Choice,
                 .choices = views,
                 .fallback = yaml(views, d.view),
                 .doc = "The curve by which PNG, JPEG and PPM show what is brighter than white. "
                        "`none` clips it. `filmic` is the curve of Narkowicz (2015), for each of red, "
                        "green and blue. `agx` is AgX of Sobotka (2022) in the form of Wrensch (2023): "
                        "bright colours turn white. EXR and PFM are never changed."},
                {.name = "spectral",
                 .kind = Kind::Section,
                 .section = "spectral_film",
                 .fallback = "null",
                 .nullable = true,
                 .doc = "Bins of wavelengths, which EXR files have in addition to the image."},
                {.name = "responses",
                 .kind = Kind::Spectrum,
                 .shape = Shape::Map,
                 .range = kRadiance,
                 .doc = fmt::format(
                     "The channels of a camera or an instrument: what its sensor answers to each "
                     "wavelength. EXR files have `Response.NAME` in addition to the image: ∫ L r dλ / "
                     "∫ r dλ, so that radiance 1 at all wavelengths gives 1, as it does for Y. Up to {}; "
                     "names are letters, digits, `_` and `-`.",
                     kMostSensorResponses)},
                {.name = "normalise_responses",
                 .kind = Kind::Boolean,
                 .fallback = yaml(d.spectral.normalise),
                 .doc = "Without it a response is ∫ L r dλ, in W·m⁻²·sr⁻¹ times its unit."},
            }};
}

SectionSchema spectralFilm() {
    const ValueRange wavelength{kWavelengthMin_nm, kWavelengthMax_nm, false, false};
    return {"spectral_film",
            "a spectral film",
            "The spectrum of each pixel, in equal bins: mean radiance in W·m⁻²·sr⁻¹·nm⁻¹. "
            "EXR files have a channel per bin, named by its middle as Fichet et al. (2021) and pbrt-v4 do "
            "(`S0.550,000000nm`), in addition to the image and its error. Exposure, white balance and "
            "colour space do not change them. A bin takes 16 bytes of memory per pixel.",
            {
                {.name = "from_nm",
                 .kind = Kind::Number,
                 .range = wavelength,
                 .unit = "nm",
                 .required = true,
                 .doc = "Start of the first bin."},
                {.name = "to_nm",
                 .kind = Kind::Number,
                 .range = wavelength,
                 .unit = "nm",
                 .required = true,
                 .doc = "End of the last bin."},
                {.name = "bins",
                 .kind = Kind::Integer,
                 .range = {1, kMostSpectralBins, false, false},
                 .required = true,
                 .doc = fmt::format("Their number. Each is at least {} nm wide.", kNarrowestBin_nm)},
            }};
}

SectionSchema filter() {
    const FilmSettings d;
    return {"filter",
            "a filter",
            "",
            {
                {.name = "type",
                 .kind = Kind::Choice,
                 .choices = kFilters,
                 .required = true,
                 .doc = "Shape of the filter."},
                {.name = "radius",
                 .kind = Kind::Number,
                 .range = {0, 16, true, false},
                 .unit = "pixels",
                 .doc = "Half of its width. The default is 0.5 for a box and 1.5 for the others."},
                {.name = "sigma",
                 .kind = Kind::Number,
                 .range = {0, 16, true, false},
                 .unit = "pixels",
                 .fallback = yaml(d.filter_sigma),
                 .doc = "Standard deviation; gaussian only. The filter is the Gaussian less its value at "
                        "the radius, so that it ends at 0."},
            }};
}

SectionSchema integrator() {
    const IntegratorSettings d;
    const std::vector<std::string> types = integratorWords();
    const std::vector<std::string> accelerators{"auto", "bvh", "aabb", "none"};
    return {"integrator",
            "integrator",
            "",
            {
                {.name = "type",
                 .kind = Kind::Choice,
                 .choices = types,
                 .fallback = yaml(types, d.type),
                 .doc = "Path tracing, or an image of shading normals or bounding boxes for debugging. "
                        "`splat_test` is a test of films: it throws samples onto random pixels, and its "
                        "image is a ramp of colours."},
                {.name = "max_depth",
                 .kind = Kind::Integer,
                 .range = {0, 1e9, false, false},
                 .unit = "scattering events",
                 .fallback = yaml(d.max_depth),
                 .doc = "Longest path; 0 shows emitters only, 1 is direct light. To pass a "
                        "pane or a hole does not count; to cross a body of glass is 2. crt warns where "
                        "the camera looks through more glass than this allows. No path has more than "
                        "67108863 events."},
                {.name = "roulette_depth",
                 .kind = Kind::Integer,
                 .range = {0, 1e9, false, false},
                 .unit = "scattering events",
                 .fallback = yaml(d.roulette_depth),
                 .doc = "First event after which Russian roulette may end a path. Here, panes that the path "
                        "has passed (up to 7) count as events."},
                {.name = "roulette",
                 .kind = Kind::Boolean,
                 .fallback = yaml(d.roulette),
                 .doc = "Russian roulette ends some paths early: shorter paths, the same mean, more noise "
                        "per sample."},
                {.name = "nee",
                 .kind = Kind::Boolean,
                 .fallback = yaml(d.nee),
                 .doc = "Next event estimation: every vertex that scatters into many directions samples a "
                        "light. Without it, only scattered rays find light."},
                {.name = "mis",
                 .kind = Kind::Boolean,
                 .fallback = yaml(d.mis),
                 .doc = "Multiple importance sampling combines light sampling with scattered rays that "
                        "hit lights. Without it, direct light comes from light sampling alone wherever "
                        "that covers a light (the same mean, more noise: for tests)."},
                {.name = "accelerator",
                 .kind = Kind::Choice,
                 .choices = accelerators,
                 .fallback = yaml(accelerators, d.accelerator),
                 .doc = "The acceleration structure: `auto` chooses by scene size between a BVH, a box per "
                        "object, and a plain loop."},
            }};
}

SectionSchema sampler() {
    const SamplerSettings d;
    const std::vector<std::string> types{"sobol", "independent", "xorshift"};
    return {"sampler",
            "sampler",
            "",
            {
                {.name = "type",
                 .kind = Kind::Choice,
                 .choices = types,
                 .fallback = yaml(types, d.type),
                 .doc = "Owen-scrambled Sobol points, independent random numbers, or a xorshift generator."},
                {.name = "seed",
                 .kind = Kind::Integer,
                 .range = kNotNegative,
                 .fallback = yaml(d.seed),
                 .doc = "A different seed gives statistically equivalent noise."},
                {.name = "samples",
                 .kind = Kind::Integer,
                 .range = {1, 9007199254740992.0, false, false},
                 .unit = "per pixel",
                 .fallback = yaml(d.samples),
                 .doc = "Used unless `--spp`, `--time`, `--samples` or `--target-error` is given."},
                {.name = "replicates",
                 .kind = Kind::Integer,
                 .range = {1, 16, false, false},
                 .doc = "Samples take turns between 2, 4, 8 or 16 independent sequences, whose spread gives "
                        "the error of the image. More sequences make the error of a single pixel more "
                        "certain and, with sobol, the image noisier. 1: one "
                        "sequence, whose error is only bounded. "
                        "By default 2 for films of 1000 pixels and more, up to 16 for smaller ones."},
            }};
}

void addSpectra(std::vector<SectionSchema>& all) {
    all.push_back({"spectrum/table",
                   "a tabulated spectrum",
                   "Measured values, with linear interpolation.",
                   {{.name = "table",
                     .kind = Kind::Section,
                     .section = "table",
                     .required = true,
                     .doc = "The two columns."},
                    outsideKey(),
                    scaleKey()}});
    all.push_back({"table",
                   "a table",
                   "",
                   {{.name = "nm",
                     .kind = Kind::Number,
                     .shape = Shape::List,
                     .count_min = 1,
                     .range = kPositive,
                     .unit = "nm",
                     .required = true,
                     .doc = "Wavelengths, strictly increasing."},
                    {.name = "value",
                     .kind = Kind::Number,
                     .shape = Shape::List,
                     .count_min = 1,
                     .required = true,
                     .doc = "One value per wavelength."}}});
    all.push_back({"spectrum/file",
                   "a spectrum from a file",
                   "",
                   {{.name = "file",
                     .required = true,
                     .doc = "A .spd or .csv of two columns, wavelength in nm and value; looked up in the "
                            "scene's folder, then in CRT_MESH_PATH."},
                    outsideKey(),
                    scaleKey()}});
    all.push_back(
        {"spectrum/rgb",
         "an rgb spectrum",
         "A smooth spectrum of the colour (Jakob and Hanika 2019): below 1 as a reflectance, times D65 as "
         "an emission. Not for refractive indices.",
         {{.name = "rgb",
           .kind = Kind::Number,
           .shape = Shape::List,
           .count_min = 3,
           .count_max = 3,
           .range = kNotNegative,
           .required = true,
           .doc = "Red, green and blue with sRGB primaries."},
          {.name = "space",
           .kind = Kind::Choice,
           .choices = {"srgb", "linear"},
           .fallback = "srgb",
           .doc = "Are the components sRGB-encoded (as colour pickers show them, 0 to 1) or linear?"},
          scaleKey()}});
    all.push_back({"spectrum/blackbody",
                   "a black body",
                   "Planck's law.",
                   {{.name = "blackbody",
                     .kind = Kind::Number,
                     .range = {100, 1e7, false, false},
                     .unit = "K",
                     .required = true,
                     .doc = "Temperature."},
                    {.name = "normalise",
                     .kind = Kind::Boolean,
                     .fallback = "true",
                     .doc = "Scale the maximum within 360 to 830 nm to 1; false leaves "
                             "W·m⁻²·sr⁻¹·nm⁻¹."},
                    scaleKey()}});
    all.push_back({"spectrum/illuminant",
                   "an illuminant",
                   "A CIE standard illuminant, scaled to luminance 1.",
                   {{.name = "illuminant",
                     .kind = Kind::Choice,
                     .choices = illuminantNames(),
                     .required = true,
                     .doc = "Its name."},
                    scaleKey()}});
    all.push_back({"spectrum/sellmeier",
                   "a Sellmeier index",
                   "n² = 1 + Σ Bᵢλ² / (λ² − Cᵢ), λ in µm.",
                   {{.name = "sellmeier",
                     .kind = Kind::Section,
                     .section = "sellmeier",
                     .required = true,
                     .doc = "The coefficients."},
                    scaleKey()}});
    all.push_back({"sellmeier",
                   "Sellmeier coefficients",
                   "",
                   {{.name = "B",
                     .kind = Kind::Number,
                     .shape = Shape::List,
                     .count_min = 3,
                     .count_max = 3,
                     .required = true,
                     .doc = "B₁, B₂, B₃."},
                    {.name = "C",
                     .kind = Kind::Number,
                     .shape = Shape::List,
                     .count_min = 3,
                     .count_max = 3,
                     .unit = "µm²",
                     .required = true,
                     .doc = "C₁, C₂, C₃."}}});
    all.push_back({"spectrum/cauchy",
                   "a Cauchy index",
                   "n = A + B/λ² + C/λ⁴ + …, λ in µm.",
                   {{.name = "cauchy",
                     .kind = Kind::Number,
                     .shape = Shape::List,
                     .count_min = 1,
                     .count_max = 8,
                     .unit = "1, µm², µm⁴, …",
                     .required = true,
                     .doc = "A, B, C, …"},
                    scaleKey()}});
    all.push_back({"spectrum/glass",
                   "a glass",
                   "Refractive index of a catalogue glass.",
                   {{.name = "glass",
                     .kind = Kind::Choice,
                     .choices = glassNames(),
                     .required = true,
                     .doc = "Its name."},
                    scaleKey()}});
    all.push_back(
        {"spectrum/data",
         "named data",
         "Measured data that come with crt, by name: `cornell/white`, `paints/foliage`, `metals/Au/n`, "
         "`glasses/SF10`, `illuminants/D65`. `crt data` lists them with their sources; see [Named "
         "data](#named-data).",
         {{.name = "data", .required = true, .doc = "Its name."}, scaleKey()}});
    all.push_back({"spectrum/ref",
                   "a reference",
                   "A named spectrum; the form to use when it should be scaled.",
                   {{.name = "ref", .required = true, .doc = "A name in `spectra`."}, scaleKey()}});
}

/// `fallback` empty: it must be given.
KeySchema roughnessKey(const char* smooth, const char* fallback = "") {
    return {.name = "roughness",
            .kind = Kind::Number,
            .range = {.min = 0, .max = 1},
            .fallback = fallback,
            .required = *fallback == '\0',
            .doc = fmt::format("0 is {}, 1 the roughest. The square root of GGX's width α; below 0.03 it "
                               "is taken for 0.",
                               smooth)};
}

/// The same, where an image may stand, too.
KeySchema textured(KeySchema key) {
    key.section = "texture";
    return key;
}

/// Of metals, gloss and panes.
KeySchema tintKey(const char* what) {
    return {.name = "tint",
            .kind = Kind::Spectrum,
            .range = {.min = 0, .max = 1},
            .section = "texture",
            .fallback = "1",
            .doc = what};
}

void addDielectrics(std::vector<SectionSchema>& all) {
    const auto index = [](const char* doc) {
        return KeySchema{.name = "ior",
                         .kind = Kind::Spectrum,
                         .range = {.min = 1e-3, .max = 1e3},
                         .required = true,
                         .doc = doc};
    };
    const KeySchema ior = index(
        "Refractive index of the inside relative to the outside; inside is where normals point away from.");
    const KeySchema absorption{
        .name = "absorption",
        .kind = Kind::Spectrum,
        .range = {.min = 0, .max = kMostRadiance},
        .unit = "1/scene unit",
        .doc =
            "Absorption coefficient of the inside, by the Beer–Lambert law: over a distance d the "
            "share exp(−absorption · d) is left. The mesh must be closed. Of nested bodies the "
            "innermost absorbs, even if it is clear; behind it the outer one absorbs again. Where "
            "bodies overlap, the one that light entered last absorbs. Cameras (the middle of their "
            "lens) and lights may be inside bodies. Bodies may touch. Overlap them a little where "
            "other surfaces are inside two bodies that share a face, or where the faces that touch are "
            "curved or belong to instances: rounding decides which of two coinciding surfaces light "
            "meets. The number of nested bodies depends on the number of kinds of glass that absorb "
            "differently: 32 bodies of 1 kind, 16 of up to 3, 8 of up to 15, 4 of up to 255, 2 of "
            "more; clear glass is a kind. Beyond that crt forgets the outermost body. Nothing outside "
            "of bodies absorbs. The default is 0."};
    all.push_back({"material/dielectric",
                   "a dielectric material",
                   "Smooth glass or water. It reflects and refracts, and may absorb.",
                   {materialType("dielectric"), ior, absorption, thinFilmKey()}});
    all.push_back(
        {"material/rough_dielectric",
         "a rough_dielectric material",
         "Frosted glass: microfacets as in `rough_conductor`, each of which reflects and "
         "refracts. Clear glass is invisible under uniform light, at any roughness. The division of light "
         "that meets several microfacets into reflection and transmission is an approximation that loses no "
         "energy: from inside, the roughest glass reflects more straight on, "
         "and less at grazing angles, than a random walk on Smith's surface. Where the glass "
         "would blur what is seen through it by less than 10⁻⁴ radians (α·|ior − 1|), crt treats it "
         "as smooth.",
         {materialType("rough_dielectric"), ior, textured(roughnessKey("smooth")), absorption,
          thinFilmKey()}});
    all.push_back(
        {"material/thin_dielectric",
         "a thin_dielectric material",
         "A window pane made of one sheet of faces: two parallel surfaces, between which light is "
         "reflected back and forth, each polarisation by itself. Transmitted light is not bent, "
         "and a passage is not a scattering event. Light of every kind passes up to 4096 panes "
         "and holes in a row. A normal map affects the mirrored light only. AOVs of first hits "
         "describe the surface that stops a ray: mostly the one behind the pane, and the "
         "pane itself in the share that it mirrors. A film is on one of the two surfaces.",
         {materialType("thin_dielectric"),
          index("Refractive index of the pane relative to its surroundings."),
          tintKey("Share of the transmitted light that is left, at every wavelength and the same at "
                  "all angles: coloured glass. The mirrored light has no tint."),
          thinFilmKey()}});
}

/// Of thin sheets.
KeySchema transmittanceKey(const char* what) {
    return {.name = "transmittance",
            .kind = Kind::Spectrum,
            .range = {.min = 0, .max = 1},
            .section = "texture",
            .doc = what};
}

void addMaterials(std::vector<SectionSchema>& all) {
    const KeySchema reflectance{.name = "reflectance",
                                .kind = Kind::Spectrum,
                                .range = {0, 1, false, false},
                                .section = "texture",
                                .required = true,
                                .doc =
                                    "The fraction of light that the surface reflects, at every "
                                    "wavelength."};
    all.push_back(
        {"material/diffuse",
         "a diffuse material",
         "Lambertian reflection, or EON where it is rough.",
         {materialType("diffuse"),
          reflectance,
          {.name = "roughness",
           .kind = Kind::Number,
           .range = {.min = 0, .max = 1},
           .fallback = "0",
           .doc = "0: Lambert's law. Above, EON (Portsmouth, Kutz and Hill 2025), as "
                  "`base_diffuse_roughness` of OpenPBR Surface 1.1: like clay or the full moon, as bright "
                  "towards the light's edges as in the middle. No light is lost: 1 is white in a white "
                  "room; other colours get deeper, since light is reflected more than once."}}});
    KeySchema transmittance = transmittanceKey(
        "The fraction that it lets through, scattered to all sides. With the reflectance at most 1 at every "
        "wavelength; where an image makes it more, the transmittance is less.");
    transmittance.required = true;
    all.push_back({"material/translucent",
                   "a translucent material",
                   "A thin sheet that scatters light to both of its sides by Lambert's law: paper, a "
                   "curtain, a lampshade, a leaf. Seen from either side it is the same. `plastic` with a "
                   "`transmittance` has a gloss besides.",
                   {materialType("translucent"), reflectance, transmittance}});
    all.push_back({"material/mirror",
                   "a mirror material",
                   "Perfect reflection.",
                   {materialType("mirror"), reflectance}});
    const KeySchema metal{
        .name = "metal", .kind = Kind::Choice, .choices = metalNames(), .doc = "A measured metal."};
    const KeySchema eta{.name = "eta",
                        .kind = Kind::Spectrum,
                        .range = kPositive,
                        .doc = "Real part n of the refractive index."};
    const KeySchema k{.name = "k",
                      .kind = Kind::Spectrum,
                      .range = kNotNegative,
                      .doc = "Its imaginary part, the extinction."};
    const KeySchema metal_tint = tintKey(
        "Factor on each reflection, at every wavelength: a colour that Fresnel's equations do not give.");
    const std::vector<KeyRule> metal_or_index{{KeyRule::Kind::ExactlyOne, {"metal", "eta"}},
                                              {KeyRule::Kind::Together, {"eta", "k"}}};
    all.push_back({"material/conductor",
                   "a conductor material",
                   "A smooth metal: Fresnel's equations with a complex index. Give "
                   "`metal`, or `eta` with `k`.",
                   {materialType("conductor"), metal, eta, k, metal_tint, thinFilmKey()},
                   metal_or_index});
    all.push_back(
        {"material/rough_conductor",
         "a rough_conductor material",
         "A rough metal: GGX microfacets with Smith's shadowing. Light that meets several "
         "microfacets, up to two thirds of it on the roughest metal, comes back diffusely and in "
         "deeper colours. This lobe has the form of Kulla and Conty (2017); its strength is fitted to "
         "random walks on Smith's surface, from which albedos differ by at most 0.03 "
         "(decision 0021). Give `metal`, or `eta` with `k`.",
         {materialType("rough_conductor"), metal, eta, k, textured(roughnessKey("a mirror")), metal_tint,
          thinFilmKey()},
         metal_or_index});
    addDielectrics(all);
    all.push_back(
        {"material/plastic",
         "a plastic material",
         "A diffuse base under a clear coat, as in plastics, varnished wood and glazed tiles. Light "
         "that the coat transmits scatters below it; light that the coat reflects back down "
         "scatters again, which makes colours deeper. A white base returns all light. With a "
         "smooth coat the model is that of Mitsuba's `roughplastic` with `nonlinear`. With a rough "
         "coat Mitsuba's model loses energy and is darker; this one doesn't.",
         {materialType("plastic"),
          reflectance,
          textured(roughnessKey("a polished coat", "0")),
          tintKey(
              "Factor on what the coat mirrors, at every wavelength. The coat absorbs the rest; the base "
              "keeps its colour."),
          transmittanceKey(
              "The fraction of light within that the base scatters to its other side. It is a thin sheet "
              "then, with the coat on both sides: a leaf. With `reflectance` at most 1; by default 0."),
          {.name = "ior",
           .kind = Kind::Number,
           .range = {.min = 1, .max = 10},
           .fallback = "1.5",
           .doc = "Refractive index of the coat. 1: none, Lambert's law."}}});
}

void addShapes(std::vector<SectionSchema>& all) {
    const KeySchema radius{.name = "radius",
                           .kind = Kind::Number,
                           .range = kPositive,
                           .unit = "scene units",
                           .required = true,
                           .doc = "Its radius."};
    const auto end = [](const char* name, const char* doc, bool required) {
        return KeySchema{.name = name,
                         .kind = Kind::Number,
                         .unit = "scene units",
                         .required = required,
                         .doc = doc};
    };
    const KeySchema inward{.name = "inward",
                           .kind = Kind::Boolean,
                           .fallback = "false",
                           .doc = "Normals point to the inside, and the body is on the outside: the hollow "
                                  "side of a lens."};
    const auto size = [](int count, const char* doc) {
        return KeySchema{.name = "size",
                         .kind = Kind::Number,
                         .shape = Shape::List,
                         .count_min = count,
                         .count_max = count,
                         .range = kPositive,
                         .unit = "scene units",
                         .required = true,
                         .doc = doc};
    };
    all.push_back({"sphere",
                   "a sphere",
                   "A sphere around the origin, without triangles. A transform may rotate, move and scale "
                   "spheres, disks and cylinders, but not stretch them. u goes once around the z axis, from "
                   "x; v goes from the lower pole up.",
                   {radius, end("from_z", "The part below is left out; by default nothing is.", false),
                    end("to_z", "The part above is left out.", false), inward}});
    all.push_back({"disk",
                   "a disk",
                   "A disk around the origin, seen from z: that is its normal. Textures cover the square "
                   "around it.",
                   {radius}});
    all.push_back({"cylinder",
                   "a cylinder",
                   "A cylinder around the axis z, without ends. Of textures u goes once around it, from x, "
                   "and v from end to end.",
                   {radius, end("from_z", "Start.",
                                          true), end("to_z", "End.", true),
                    inward}});
    all.push_back({"rectangle",
                   "a rectangle",
                   "Two triangles around the origin, seen from z. Textures cover it once.",
                   {size(2, "Along x and along y.")}});
    all.push_back({"box",
                   "a box",
                   "Six rectangles around the origin, seen from outside. Textures cover each.",
                   {size(3, "Along x, y and z.")}});
}

void addObjects(std::vector<SectionSchema>& all) {
    all.push_back(
        {"object",
         "an object",
         "A mesh or a shape, placed once or many times. Give one of `obj`, `ply`, `stl`, `gltf`, `mesh`, "
         "`sphere`, `disk`, `cylinder`, `rectangle` and `box`; `transform` or `transforms`.",
         {
             {.name = "name", .doc = "For messages and reports."},
             {.name = "obj",
              .doc = "A Wavefront OBJ file, looked up in the scene's folder, then in "
                     "CRT_MESH_PATH."},
             {.name = "gltf",
              .kind = Kind::Section,
              .section = "gltf",
              .doc = "Or a primitive of a glTF file or GLB; `crt import` writes scenes of them."},
             {.name = "ply",
              .doc = "Or a PLY file, ascii or binary, looked up in the same places: positions and "
                     "faces; normals (`nx`, `ny`, `nz`), texture coordinates (`u`, `v`; `s`, `t`; "
                     "`texture_u`, `texture_v`; or `texcoord` of faces) and colours (`red`, "
                     "`green`, `blue`) where it has them. One line says what was left out."},
             {.name = "stl",
              .doc = "Or an STL file, ascii or binary, looked up in the same places: triangles "
                     "alone. With `normals: smooth` and a `crease_angle_deg` curved parts are "
                     "smooth."},
             {.name = "mesh",
              .kind = Kind::Section,
              .section = "mesh",
              .doc = "Or the geometry written out."},
             {.name = "sphere",
              .kind = Kind::Section,
              .section = "sphere",
              .doc = "Or a sphere, or a part of one: a lens is made of two and a cylinder."},
             {.name = "disk", .kind = Kind::Section, .section = "disk", .doc = "Or a disk."},
             {.name = "cylinder", .kind = Kind::Section, .section = "cylinder", .doc = "Or a cylinder."},
             {.name = "rectangle", .kind = Kind::Section, .section = "rectangle", .doc = "Or a rectangle."},
             {.name = "box", .kind = Kind::Section, .section = "box", .doc = "Or a box."},
             {.name = "material",
              .doc = "A name in `materials`. An OBJ's faces get it where its own materials "
                     "(usemtl, MTL) give them none; left "
                     "out, or `from_mtl`, each face must have its own."},
             {.name = "override",
              .kind = Kind::Boolean,
              .fallback = "false",
              .doc = "Use `material` for all faces of the OBJ; its own materials are not read."},
             {.name = "parts",
              .kind = Kind::Section,
              .shape = Shape::Map,
              .section = "part",
              .doc = "Materials and emission for parts of the OBJ, by the names that it gives to "
                     "faces: groups (`g`), objects (`o`) and materials (`usemtl`, also those that "
                     "no MTL defines). In a name `*` stands for any letters and `?` for one. If "
                     "several parts match a face, its material comes from the last of them that "
                     "has one, and so does its emission: write the general part before the "
                     "special one. A name that matches no face is an error."},
             {.name = "mtl",
              .kind = Kind::Section,
              .section = "mtl",
              .doc = "Options for reading the MTL of the OBJ."},
             {.name = "vertex_colors",
              .kind = Kind::Choice,
              .choices = {"srgb", "linear"},
              .doc = "Encoding of the colours in the PLY, for `{attribute: colors}`. By default "
                     "integers are sRGB-encoded and floats linear."},
             {.name = "normals",
              .kind = Kind::Choice,
              .choices = {"file", "smooth", "flat"},
              .fallback = "file",
              .doc = "For shading. `file`: those of the file or mesh; faces without normals are "
                     "flat. `smooth`: computed, at each vertex the mean of the faces around it, "
                     "weighted by their angles there (Thürmer and Wüthrich 1998); vertices at "
                     "the same place count as one. `flat`: none."},
             {.name = "crease_angle_deg",
              .kind = Kind::Number,
              .range = {.min = 0, .max = 180},
              .unit = "degrees",
              .fallback = "60",
              .doc = "For `normals: smooth`: the largest angle between two faces at their common "
                     "edge that are shaded as one surface. An edge beyond which the surface is "
                     "inside out is a crease, too."},
             {.name = "transform",
              .kind = Kind::Section,
              .shape = Shape::List,
              .section = "transform",
              .fallback = "[]",
              .doc = "One placement: steps applied in order, the first one first."},
             {.name = "share",
              .kind = Kind::Choice,
              .choices = {"auto", "always", "never"},
              .fallback = "auto",
              .doc = "`always`: all placements share one copy of the mesh. This saves memory and "
                     "makes rays slower. `auto`: they share it if the object would otherwise have "
                     "more than 4 million triangles. `never`: each placement has its own copy. "
                     "Surfaces that emit, and places that flatten the mesh, never share."},
             {.name = "transforms",
              .kind = Kind::Section,
              .shape = Shape::Lists,
              .section = "transform",
              .doc = "Several placements; the mesh is stored once."},
             {.name = "emission",
              .kind = Kind::Section,
              .section = "emission",
              .doc = "Makes the surface a light."},
         },
         {{KeyRule::Kind::ExactlyOne,
           {"obj", "ply", "stl", "gltf", "mesh", "sphere", "disk", "cylinder", "rectangle", "box"}},
          {KeyRule::Kind::AtMostOne, {"transform", "transforms"}}}});
    all.push_back({"part",
                   "a part",
                   "",
                   {{.name = "material",
                     .doc = "A name in `materials`, instead of the file's material and its emission (Ke)."},
                    {.name = "emission",
                     .kind = Kind::Section,
                     .section = "emission",
                     .doc = "Makes the part a light."},
                    {.name = "by",
                     .kind = Kind::Choice,
                     .choices = {"any", "group", "object", "material"},
                     .fallback = "any",
                     .doc = "Kind of the name."}}});
    all.push_back({"mtl",
                   "an mtl",
                   "",
                   {{.name = "color",
                     .kind = Kind::Choice,
                     .choices = {"linear", "srgb"},
                     .fallback = "linear",
                     .doc = "Encoding of Kd, Ks and Ke: linear, as Mitsuba, pbrt and Blender read them, or "
                            "sRGB. For an encoded Ke above 1 the colour is decoded and the strength "
                            "stays."}}});
    all.push_back({"mesh",
                   "a mesh",
                   "",
                   {
                       {.name = "positions",
                        .kind = Kind::Number,
                        .shape = Shape::Lists,
                        .count_min = 3,
                        .count_max = 3,
                        .unit = "object units",
                        .required = true,
                        .doc = "Vertices [x, y, z]. crt accepts all finite coordinates."},
                       {.name = "faces",
                        .kind = Kind::Integer,
                        .shape = Shape::Lists,
                        .count_min = 3,
                        .range = {0, 4294967294.0, false, false},
                        .required = true,
                        .doc = "Convex polygons, as indices into `positions` from 0. Counter-clockwise seen "
                               "from the front."},
                       {.name = "normals",
                        .kind = Kind::Number,
                        .shape = Shape::Lists,
                        .count_min = 3,
                        .count_max = 3,
                        .doc = "One per vertex, for smooth shading. No surface loses light where the "
                               "normals lean away from the faces. A triangle with a normal that is zero or "
                               "not finite is flat; crt normalises all others and turns them to the front "
                               "of their triangle."},
                       {.name = "uvs",
                        .kind = Kind::Number,
                        .shape = Shape::Lists,
                        .count_min = 2,
                        .count_max = 2,
                        .range = {-kMostUv, kMostUv, false, false},
                        .doc = "Texture coordinates [u, v], one per vertex: (0, 0) is the lower left corner "
                               "of an image, (1, 1) the upper right."},
                       {.name = "colors",
                        .kind = Kind::Number,
                        .shape = Shape::Lists,
                        .count_min = 3,
                        .count_max = 3,
                        .range = {0, 1, false, false},
                        .doc = "Reflectances [r, g, b] with sRGB primaries, one per vertex, for "
                               "`{attribute: colors}`."},
                       {.name = "color_space",
                        .kind = Kind::Choice,
                        .choices = {"srgb", "linear"},
                        .fallback = "srgb",
                        .doc = "Are `colors` sRGB-encoded or linear?"},
                   }});
    all.push_back({"transform/translate",
                   "a translation",
                   "",
                   {{.name = "translate",
                     .kind = Kind::Number,
                     .shape = Shape::List,
                     .count_min = 3,
                     .count_max = 3,
                     .required = true,
                     .doc = "Adds [x, y, z]."}}});
    all.push_back({"transform/scale",
                   "a scaling",
                   "",
                   {{.name = "scale",
                     .kind = Kind::Number,
                     .shape = Shape::OneOrList,
                     .count_min = 3,
                     .count_max = 3,
                     .required = true,
                     .doc = "One factor or [x, y, z]; none of them 0, negative mirrors."}}});
    all.push_back({"transform/rotate", "a rotation", "",
                   {{.name = "rotate", .kind = Kind::Section, .section = "rotate", .required = true,
                     .doc = "Turns about an axis through the origin."}}});
    all.push_back({"rotate",
                   "a rotation",
                   "",
                   {{.name = "axis",
                     .kind = Kind::Number,
                     .shape = Shape::List,
                     .count_min = 3,
                     .count_max = 3,
                     .required = true,
                     .doc = "Any length but 0."},
                    {.name = "angle_deg",
                     .kind = Kind::Number,
                     .unit = "degrees",
                     .required = true,
                     .doc = "Counter-clockwise when the axis points at the viewer."}}});
    all.push_back(
        {"transform/matrix",
         "a matrix",
         "",
         {{.name = "matrix",
           .kind = Kind::Number,
           .shape = Shape::List,
           .count_min = 16,
           .count_max = 16,
           .required = true,
           .doc = "Four rows of four, points as columns, last row 0 0 0 1; must be invertible."}}});
    KeySchema radiance = radianceKey(
        "Emitted equally in all directions. The brightest light of a scene must "
        "reach 1e-25: below that, paths would lose it to rounding. A light must not "
        "lie in the plane of another surface that it overlaps: rounding decides "
        "which of them is seen, and crt warns.");
    radiance.required = false;
    const auto amount = [](const char* name, const char* unit, const char* doc) {
        return KeySchema{
            .name = name, .kind = Kind::Number, .range = kNotNegative, .unit = unit, .doc = doc};
    };
    all.push_back(
        {"emission",
         "an emission",
         "",
         {radiance,
          amount("luminance_cd_m2", "cd/m²", "Or its luminance."),
          amount("luminous_flux_lm", "lm",
                 "Or the luminous flux of the whole object, all its placements and both sides "
                 "together. Not of a part."),
          amount("power_w", "W", "Or its radiant flux, from 360 to 830 nm. Not of a part."),
          {.name = "spectrum",
           .kind = Kind::Spectrum,
           .range = kRadiance,
           .fallback = "{illuminant: D65}",
           .doc = "The colour, where one of these amounts says how bright it is."},
          {.name = "color",
           .kind = Kind::Spectrum,
           .range = {.min = 0, .max = 1},
           .section = "texture",
           .fallback = "1",
           .doc = "Factor on the radiance, at every wavelength: a filter, or an image on a mesh, as on a "
                  "screen. Bright parts of an image are found as lamps are. `radiance` or "
                  "`luminance_cd_m2` is then that of white texels, and a flux cannot be given."},
          {.name = "two_sided",
           .kind = Kind::Boolean,
           .fallback = yaml(Emission{}.two_sided),
           .doc = "True if the back side emits too."}},
         {{KeyRule::Kind::ExactlyOne, {"radiance", "luminance_cd_m2", "luminous_flux_lm", "power_w"}},
          {KeyRule::Kind::AtMostOne, {"spectrum", "radiance"}}}});
}

void addOutside(std::vector<SectionSchema>& all) {
    KeySchema constant = radianceKey("The same from every direction.");
    constant.required = false;
    all.push_back(
        {"environment",
         "environment",
         "Light from infinitely far away. The radiance of an image or a sky is constant within each of "
         "its pixels.",
         {constant,
          {.name = "image",
           .doc = "An EXR, HDR or PFM file of longitudes by latitudes, twice as wide as high, the zenith at "
                  "the top; each pixel as a light of that `rgb`. Looked up in the scene's folder."},
          {.name = "scale",
           .kind = Kind::Number,
           .range = kNotNegative,
           .fallback = "1",
           .doc = "Factor on the radiance of `image`."},
          {.name = "rotation_deg",
           .kind = Kind::Number,
           .unit = "degrees",
           .fallback = "0",
           .doc = "Turns `image` about `up`, counter-clockwise seen from above."},
          {.name = "up",
           .kind = Kind::Number,
           .shape = Shape::List,
           .count_min = 3,
           .count_max = 3,
           .fallback = "[0, 1, 0]",
           .doc = "The direction of the top of `image`. Its middle is towards −z, or +y where z is "
                  "up."},
          {.name = "sky", .kind = Kind::Section, .section = "sky", .doc = "A CIE standard general sky."},
          {.name = "clear_sky",
           .kind = Kind::Section,
           .section = "clear_sky",
           .doc = "A clear sky with the colours of its light, and its sun."},
          {.name = "light_sampling",
           .kind = Kind::Boolean,
           .doc = "Sample directions of the environment where surfaces scatter, too. This pays where "
                  "most directions are blocked, as in a room with a window (0.7 of the time to equal "
                  "error). Under an open sky it takes two to three times as long. crt chooses directions "
                  "of an image or a sky by brightness. The default is `true` with `image` or `sky`, else "
                  "`false`."}},
         {{KeyRule::Kind::ExactlyOne, {"radiance", "image", "sky", "clear_sky"}},
          {KeyRule::Kind::AtMostOne, {"radiance", "scale"}},
          {KeyRule::Kind::AtMostOne, {"radiance", "rotation_deg"}},
          {KeyRule::Kind::AtMostOne, {"radiance", "up"}},
          {KeyRule::Kind::AtMostOne, {"sky", "scale"}},
          {KeyRule::Kind::AtMostOne, {"sky", "rotation_deg"}},
          {KeyRule::Kind::AtMostOne, {"sky", "up"}},
          {KeyRule::Kind::AtMostOne, {"clear_sky", "scale"}},
          {KeyRule::Kind::AtMostOne, {"clear_sky", "rotation_deg"}},
          {KeyRule::Kind::AtMostOne, {"clear_sky", "up"}}}});
    addSkies(all);
    all.push_back({"output",
                   "an output",
                   "",
                   {{.name = "file",
                     .required = true,
                     .doc = "The name of the file, relative to the working directory. It lies below that "
                            "folder or the scene's own, is not hidden and ends as images do, because scenes "
                            "may come from untrusted sources. An existing file that is not an image by crt "
                            "is replaced only with `--overwrite`. `-o` names any file."},
                    {.name = "format",
                     .kind = Kind::Choice,
                     .choices = {"exr", "png", "jpeg", "ppm", "pfm"},
                     .doc = "The default follows from the extension of `file`."},
                    {.name = "aovs",
                     .kind = Kind::Choice,
                     .shape = Shape::List,
                     .choices = aovNames(),
                     .fallback = "[]",
                     .doc = "Additional channels, in EXR files only. `color_error`, the standard errors of "
                            "R, G and B, makes the film larger: by 44 % with two replicates."}}});
}

}  // namespace

std::string ValueRange::text() const {
    const bool low = std::isfinite(min), high = std::isfinite(max);
    if (!low && !high) return "any";
    if (!high) return min_open ? fmt::format("above {}", min) : fmt::format("{} or more", min);
    if (!low) return max_open ? fmt::format("below {}", max) : fmt::format("{} or less", max);
    if (min == max) return fmt::format("{}", min);
    if (min_open && max_open) return fmt::format("between {} and {}, both excluded", min, max);
    if (min_open) return fmt::format("above {}, at most {}", min, max);
    return fmt::format("{} to {}{}", min, max, max_open ? ", excluded" : "");
}

const KeySchema* SectionSchema::find(std::string_view key) const {
    for (const KeySchema& k : keys)
        if (k.name == key) return &k;
    return nullptr;
}

std::vector<std::string> SectionSchema::keyNames() const {
    std::vector<std::string> names;
    for (const KeySchema& k : keys) names.push_back(k.name);
    return names;
}

const std::vector<SectionSchema>& sceneSchema() {
    static const std::vector<SectionSchema> schema = [] {
        std::vector<SectionSchema> all{topLevel(), camera(),     film(),   spectralFilm(),
                                       filter(),   integrator(), sampler()};
        addSpectra(all);
        addTextures(all);
        addMaterials(all);
        addCompositions(all);
        addThinFilm(all);
        addAnisotropy(all);
        addOpenPbr(all);
        addShapes(all);
        addObjects(all);
        addGltf(all);
        addLights(all);
        addOutside(all);
        return all;
    }();
    return schema;
}

const SectionSchema& schemaSection(std::string_view name) {
    for (const SectionSchema& section : sceneSchema())
        if (section.name == name) return section;
    throw Error(ErrorKind::Internal, fmt::format("the scene schema has no section '{}'", name));
}

std::vector<const SectionSchema*> schemaVariants(std::string_view family) {
    std::vector<const SectionSchema*> variants;
    const std::string prefix = fmt::format("{}/", family);
    for (const SectionSchema& section : sceneSchema())
        if (section.name == family || section.name.starts_with(prefix)) variants.push_back(&section);
    return variants;
}

bool variantByType(const SectionSchema& variant) { return variant.find("type") != nullptr; }

std::string variantWord(const SectionSchema& variant) {
    return variant.name.substr(variant.name.find('/') + 1);
}

std::vector<std::string> sectionsWithKey(std::string_view key, std::string_view not_here) {
    std::vector<std::string> names;
    for (const SectionSchema& section : sceneSchema())
        if (section.name != not_here && section.find(key) != nullptr) names.push_back(section.title);
    return names;
}

}  // namespace crt
