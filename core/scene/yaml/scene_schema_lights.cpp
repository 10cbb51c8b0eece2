// The part of the table of keys about lights without a surface.
#include "scene/yaml/scene_schema_lights.h"

#include "scene/cie_sky.h"
#include "scene/clear_sky.h"
#include "scene/scene.h"
#include "scene/scene_limits.h"
#include "scene/yaml/scene_schema_values.h"

#include <fmt/format.h>

#include <utility>

namespace crt {
namespace {

using namespace schema;

KeySchema nameKey() { return {.name = "name", .doc = "For messages and reports."}; }

KeySchema lightType(std::string word) { return schema::typeKey(std::move(word), "light"); }

KeySchema vectorKey(std::string name, std::string doc, std::string unit = {}, bool required = false) {
    return {.name = std::move(name),
            .kind = Kind::Number,
            .shape = Shape::List,
            .count_min = 3,
            .count_max = 3,
            .unit = std::move(unit),
            .required = required,
            .doc = std::move(doc)};
}

KeySchema positionKey() { return vectorKey("position", "Position.", "scene units", true); }

KeySchema spectrumKey() {
    return {.name = "spectrum",
            .kind = Kind::Spectrum,
            .range = kRadiance,
            .fallback = "{illuminant: D65}",
            .doc =
                "Its colour, scaled so that the light has the value in lumens, watts and so on of the other "
                "key."};
}

/// In absolute terms, by wavelength.
KeySchema spectralKey(std::string name, std::string unit, std::string doc) {
    return {.name = std::move(name),
            .kind = Kind::Spectrum,
            .range = kRadiance,
            .unit = std::move(unit),
            .doc = std::move(doc)};
}

KeySchema amountKey(std::string name, std::string unit, std::string doc) {
    return {.name = std::move(name),
            .kind = Kind::Number,
            .range = kNotNegative,
            .unit = std::move(unit),
            .doc = std::move(doc)};
}

KeySchema degreesKey(std::string name, ValueRange range, double fallback, std::string doc) {
    return {.name = std::move(name),
            .kind = Kind::Number,
            .range = range,
            .unit = "degrees",
            .fallback = fmt::format("{}", fallback),
            .doc = std::move(doc)};
}

/// Emission from a point, and for `beam` the meaning of an intensity.
std::vector<KeySchema> intensityKeys(const std::string& beam) {
    return {spectralKey("radiant_intensity", "W·sr⁻¹·nm⁻¹", "Radiant intensity" + beam + "."),
            amountKey("power_w", "W", "Radiant flux in all directions, from 360 to 830 nm."),
            amountKey("luminous_flux_lm", "lm", "Luminous flux in all directions."),
            amountKey("luminous_intensity_cd", "cd", "Luminous intensity" + beam + "."), spectrumKey()};
}

const std::vector<std::string> kIntensities{"radiant_intensity", "power_w", "luminous_flux_lm",
                                            "luminous_intensity_cd"};

KeyRule noSpectrumBeside(std::string key) {
    return {KeyRule::Kind::AtMostOne, {"spectrum", std::move(key)}};
}

template <class Row>
void add(std::vector<Row>& rows, const Row& row) {
    rows.push_back(row);
}
template <class Row>
void add(std::vector<Row>& rows, const std::vector<Row>& more) {
    rows.insert(rows.end(), more.begin(), more.end());
}
/// Rows, and lists of them, one after the other.
template <class Row, class... More>
std::vector<Row> joined(std::vector<Row> rows, const More&... more) {
    (add(rows, more), ...);
    return rows;
}

}  // namespace

void addLights(std::vector<SectionSchema>& all) {
    const PointLight d;
    all.push_back({"light/point",
                   "a point light",
                   "The same intensity in all directions.",
                   joined(std::vector{nameKey(), lightType("point"), positionKey()}, intensityKeys("")),
                   {{KeyRule::Kind::ExactlyOne, kIntensities}, noSpectrumBeside("radiant_intensity")}});
    all.push_back(
        {"light/spot",
         "a spot light",
         "A cone of light. The intensity is constant inside the cone and falls to 0 across the penumbra "
         "as Hermite's cubic of the cosine, as in pbrt-v4.",
         joined(
             std::vector{nameKey(), lightType("spot"), positionKey(),
                         vectorKey("direction",
                                   "The direction in which the light travels along its axis; any "
                                   "length but 0."),
                         vectorKey("target", "Alternatively, a point on its axis.", "scene units"),
                         degreesKey("cone_angle_deg", {0.01, 180, false, false}, d.cone_angle_deg,
                                    "From the axis to where the light ends."),
                         degreesKey("penumbra_deg", {0, 180, false, false}, d.penumbra_deg,
                                    "The outer part of that angle, in which the light falls to 0. At most "
                                    "`cone_angle_deg`; the default is smaller where the cone is.")},
             intensityKeys(" on the axis")),
         {{KeyRule::Kind::ExactlyOne, {"direction", "target"}},
          {KeyRule::Kind::ExactlyOne, kIntensities},
          noSpectrumBeside("radiant_intensity")}});
    all.push_back(
        {"light/ies",
         "an IES light",
         "A measured light: a point whose intensity in each direction comes from an IES file (LM-63 of "
         "1986 to 2019, type C photometry, TILT=NONE or INCLUDE; crt does not apply the tilt), with "
         "linear interpolation in both angles. The candelas are those of the file times its multiplier "
         "and ballast factors.",
         {nameKey(),
          lightType("ies"),
          positionKey(),
          {.name = "file",
           .required = true,
           .doc = "The IES file, or a EULUMDAT file (.ldt); looked up in the scene's folder, then in "
                  "CRT_MESH_PATH. C0 of EULUMDAT is the horizontal angle 0."},
          vectorKey("direction",
                    "Direction of the vertical angle 0: down, for a lamp that hangs as measured; "
                    "any length but 0. `[0, -1, 0]` when left out."),
          vectorKey("target", "Or a point there.", "scene units"),
          vectorKey("c0",
                    "Direction of the horizontal angle 0; only its part across the axis counts. Larger "
                    "angles go counter-clockwise as seen from behind the lamp. `[1, 0, 0]`, or `[0, 0, 1]` "
                    "where that is the direction, when left out."),
          amountKey("scale", "", "Times the candelas of the file; 1 when left out."),
          amountKey("luminous_flux_lm", "lm", "Or the total luminous flux."),
          amountKey("power_w", "W", "Or its radiant flux, from 360 to 830 nm."),
          spectrumKey()},
         {{KeyRule::Kind::AtMostOne, {"direction", "target"}},
          {KeyRule::Kind::AtMostOne, {"scale", "luminous_flux_lm"}},
          {KeyRule::Kind::AtMostOne, {"scale", "power_w"}},
          {KeyRule::Kind::AtMostOne, {"luminous_flux_lm", "power_w"}}}});
    all.push_back(
        {"light/beam",
         "a beam",
         "Collimated light: parallel rays from a disk or a slit, with the same irradiance across it. "
         "Nothing behind the disk or slit receives light.",
         {nameKey(),
          lightType("beam"),
          vectorKey("position", "The centre of the disk or slit.", "scene units", true),
          vectorKey("direction", "The direction in which the light travels; any length but 0."),
          vectorKey("target", "Alternatively, a point on its axis.", "scene units"),
          {.name = "radius",
           .kind = Kind::Number,
           .range = kPositive,
           .unit = "scene units",
           .doc = "Of a disk."},
          {.name = "size",
           .kind = Kind::Number,
           .shape = Shape::List,
           .count_min = 2,
           .count_max = 2,
           .range = kPositive,
           .unit = "scene units",
           .doc = "Width and height of a slit."},
          vectorKey("up",
                    "Direction of a slit's height; only its part across the light's direction counts. `[0, "
                    "1, 0]`, or `[0, 0, 1]` where that is the direction, when left out."),
          spectralKey("irradiance", "W·m⁻²·nm⁻¹", "Irradiance of a plane across it."),
          amountKey("illuminance_lx", "lx", "Illuminance of a plane across it."),
          amountKey("power_w", "W", "Radiant flux through it, from 360 to 830 nm."),
          amountKey("luminous_flux_lm", "lm", "Luminous flux through it."),
          spectrumKey()},
         {{KeyRule::Kind::ExactlyOne, {"direction", "target"}},
          {KeyRule::Kind::ExactlyOne, {"radius", "size"}},
          {KeyRule::Kind::ExactlyOne, {"irradiance", "illuminance_lx", "power_w", "luminous_flux_lm"}},
          noSpectrumBeside("irradiance")}});
    all.push_back(
        {"light/directional",
         "a directional light",
         "Parallel light from infinitely far away.",
         {nameKey(), lightType("directional"),
          vectorKey("direction", "The direction in which the light travels; any length but 0.", "", true),
          spectralKey("irradiance", "W·m⁻²·nm⁻¹", "Irradiance of a plane that faces the light."),
          amountKey("illuminance_lx", "lx", "Illuminance of a plane that faces the light."), spectrumKey()},
         {{KeyRule::Kind::ExactlyOne, {"irradiance", "illuminance_lx"}}, noSpectrumBeside("irradiance")}});
    all.push_back(
        {"light/sun", "a sun",
         "A disk in the sky, infinitely far away and uniformly bright. Cameras and mirrors see it. Its "
         "place follows from `direction`, or from a time and a place on Earth (to 0.01 degrees, without "
         "atmospheric refraction).",
         joined(std::vector{nameKey(), lightType("sun")}, sunKeys(),
                degreesKey("angular_diameter_deg", {0.001, 90, false, false}, d.angular_diameter_deg,
                           "The angular diameter of the disk."),
                spectralKey("radiance", "W·m⁻²·sr⁻¹·nm⁻¹", "Radiance of the disk."),
                amountKey("illuminance_lx", "lx", "Illuminance of a plane that faces the sun."),
                spectrumKey()),
         joined(sunRules(), KeyRule{KeyRule::Kind::AtMostOne, {"direction", "up"}},
                KeyRule{KeyRule::Kind::ExactlyOne, {"radiance", "illuminance_lx"}},
                noSpectrumBeside("radiance"))});
}

void addSkies(std::vector<SectionSchema>& all) {
    const auto rows = [](int fallback) {
        return KeySchema{.name = "rows",
                         .kind = Kind::Integer,
                         .range = {2, 4096, false, false},
                         .fallback = fmt::format("{}", fallback),
                         .doc = "Of the image that the sky becomes at load, twice as wide; an even number."};
    };
    all.push_back(
        {"sky", "a sky",
         "A CIE standard general sky (ISO 15469:2004, CIE S 011). It gives the luminance in each "
         "direction, relative to the position of the sun. It does not contain the sun itself (add a light "
         "of type `sun`) and is black below the horizon.",
         joined(
             std::vector<KeySchema>{{.name = "type",
                                     .kind = Kind::Integer,
                                     .range = {1, kCieSkyTypes, false, false},
                                     .required = true,
                                     .doc = "Of the standard's table: 1 overcast, 5 uniform, 7 partly "
                                            "cloudy, 12 clear, 13 clear and polluted, 15 hazy."},
                                    amountKey("zenith_luminance_cd_m2", "cd/m²",
                                              "Luminance of the zenith."),
                                    amountKey("horizontal_illuminance_lx", "lx",
                                              "Illuminance of level ground under the whole sky.")},
             sunKeys(), spectrumKey(), rows(CieSky{}.rows)),
         joined(sunRules(), KeyRule{KeyRule::Kind::ExactlyOne,
                                    {"zenith_luminance_cd_m2", "horizontal_illuminance_lx"}})});
    const auto number = [](const char* name, ValueRange range, const char* unit, double fallback,
                           const char* doc) {
        return KeySchema{.name = name,
                         .kind = Kind::Number,
                         .range = range,
                         .unit = unit,
                         .fallback = fmt::format("{}", fallback),
                         .doc = doc};
    };
    const ClearSky d;
    all.push_back(
        {"clear_sky", "a clear sky",
         "The clear sky of Hosek and Wilkie (2012, 2013) with its sun: spectral radiance in "
         "W·m⁻²·sr⁻¹·nm⁻¹, "
         "in absolute terms, by the place of the sun, the haze and the ground. The sun is darker towards "
         "its "
         "limb. The model has no night, no clouds and nothing below the horizon; its data end at 720 nm, "
         "and "
         "crt holds their last value. Each direction has the luminance of the model; its spectrum is "
         "fitted, "
         "to 3 % on average.",
         joined(
             std::vector<KeySchema>{
                 number("turbidity", {kLeastTurbidity, kMostTurbidity, false, false}, "", d.turbidity,
                        "Haze: 2 is a very clear sky, 3 clear, 6 a warm and moist day, 10 hazy."),
                 {.name = "ground_albedo",
                  .kind = Kind::Spectrum,
                  .range = {0, 1, false, false},
                  .fallback = fmt::format("{}", kUsualGroundAlbedo),
                  .doc = "The reflectance of the ground all around, which brightens the sky."},
                 number("scale", kNotNegative, "", d.scale, "Times the radiance of the sky."),
                 number("sun_scale", kNotNegative, "", 1,
                        "Times the radiance of the sun; 0 leaves the sun out."),
                 number("sun_diameter_deg", {0.001, 90, false, false}, "degrees", kSkySunDiameter_deg,
                        "The angular diameter of the sun, whose irradiance stays the same.")},
             sunKeys(), rows(d.rows)),
         sunRules()});
}

std::vector<KeySchema> sunKeys() {
    KeySchema latitude{.name = "latitude_deg",
                       .kind = Kind::Number,
                       .range = {-90, 90, false, false},
                       .unit = "degrees",
                       .doc = "North is positive."},
        longitude{.name = "longitude_deg",
                  .kind = Kind::Number,
                  .range = {-180, 180, false, false},
                  .unit = "degrees",
                  .doc = "East is positive."},
        offset{.name = "utc_offset",
               .kind = Kind::Number,
               .range = {-12, 14, false, false},
               .unit = "hours",
               .fallback = "0",
               .doc = "Of `time` from Universal Time: 1 in Berlin in winter, 2 in summer."};
    KeySchema north = vectorKey("north", "The direction of north; crt ignores its upward part."),
              up = vectorKey("up", "The direction of the zenith.");
    north.fallback = "[0, 0, -1]";
    up.fallback = "[0, 1, 0]";
    return {
        vectorKey("direction",
                  "The direction in which light from the centre of the sun travels; any "
                  "length but 0."),
        {.name = "date", .doc = "As `2026-06-21`, from 1950 to 2050. A sun below the horizon is refused."},
        {.name = "time", .doc = "As `'14:30'` or `'14:30:00'`, in quotes."},
        {.name = "time_h",
         .kind = Kind::Number,
         .range = {0, 24, false, true},
         .unit = "hours",
         .doc = "Or as a number: 14.5 is half past two in the afternoon."},
        offset,
        latitude,
        longitude,
        north,
        up};
}

std::vector<KeyRule> sunRules() {
    using Rule = KeyRule::Kind;
    return {{Rule::ExactlyOne, {"direction", "date"}},
            {Rule::Together, {"date", "latitude_deg", "longitude_deg"}},
            {Rule::AtMostOne, {"time", "time_h"}},
            {Rule::AtMostOne, {"direction", "time"}},
            {Rule::AtMostOne, {"direction", "time_h"}},
            {Rule::AtMostOne, {"direction", "utc_offset"}},
            {Rule::AtMostOne, {"direction", "north"}}};
}

}  // namespace crt
