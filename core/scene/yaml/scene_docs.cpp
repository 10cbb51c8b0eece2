/// The schema told to people (docs/scene.md) and to editors (JSON Schema). Nothing here knows a key: it all
/// comes from the table.
#include "scene/mesh/mtl_file.h"
#include "scene/yaml/scene_schema.h"
#include "scene/yaml/scene_yaml.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <set>

namespace crt {
namespace {

using Json = nlohmann::ordered_json;

bool isFamily(std::string_view family) { return schemaVariants(family).size() > 1; }
std::string familyOf(const SectionSchema& section) { return section.name.substr(0, section.name.find('/')); }

// ---- JSON Schema ----------------------------------------------------------------------------------------

/// Definitions are named without '/', which JSON pointers would have to escape.
std::string definitionName(const SectionSchema& section) {
    std::string name = section.name;
    for (char& c : name)
        if (c == '/') c = '-';
    return name;
}

Json reference(const std::string& definition) { return {{"$ref", "#/definitions/" + definition}}; }

/// Whole bounds are written without a decimal point.
Json jsonNumber(double value) {
    constexpr double kExact = 9007199254740992.0;
    if (value == std::floor(value) && std::abs(value) <= kExact) return static_cast<std::int64_t>(value);
    return value;
}

void addRange(Json& schema, const ValueRange& range) {
    if (std::isfinite(range.min))
        schema[range.min_open ? "exclusiveMinimum" : "minimum"] = jsonNumber(range.min);
    if (std::isfinite(range.max))
        schema[range.max_open ? "exclusiveMaximum" : "maximum"] = jsonNumber(range.max);
}

Json familySchema(const std::string& family) {
    Json any = Json::array();
    for (const SectionSchema* variant : schemaVariants(family))
        any.push_back(reference(definitionName(*variant)));
    if (any.size() == 1) return any.front();
    return {{"oneOf", std::move(any)}};
}

/// One value, without regard to its shape.
Json valueSchema(const KeySchema& key) {
    Json schema;
    switch (key.kind) {
        case ValueKind::Integer:
        case ValueKind::Number:
            schema["type"] = key.kind == ValueKind::Integer ? "integer" : "number";
            addRange(schema, key.range);
            break;
        case ValueKind::Boolean: return {{"type", "boolean"}};
        case ValueKind::Text: return {{"type", "string"}, {"minLength", 1}};
        case ValueKind::Choice:
            schema["enum"] = key.choices;
            break;
        case ValueKind::Spectrum:
            schema["type"] = "number";
            addRange(schema, key.range);
            schema = {{"anyOf", Json::array({std::move(schema), reference("spectrum")})}};
            break;
        case ValueKind::Section: return familySchema(key.section);
    }
    if (key.section.empty()) return schema;
    return {{"anyOf", Json::array({std::move(schema), familySchema(key.section)})}};
}

Json listSchema(Json items, int count_min, int count_max) {
    Json schema{{"type", "array"}, {"items", std::move(items)}};
    if (count_min > 0) schema["minItems"] = count_min;
    if (count_max != kUnbounded) schema["maxItems"] = count_max;
    return schema;
}

Json shapedSchema(const KeySchema& key) {
    Json one = valueSchema(key);
    switch (key.shape) {
        case ValueShape::One: return one;
        case ValueShape::List: return listSchema(std::move(one), key.count_min, key.count_max);
        case ValueShape::OneOrList: {
            Json list = listSchema(one, key.count_min, key.count_max);
            return {{"anyOf", Json::array({std::move(one), std::move(list)})}};
        }
        case ValueShape::Lists:
            return listSchema(listSchema(std::move(one), key.count_min, key.count_max), 1, kUnbounded);
        case ValueShape::Map: {
            Json schema{{"type", "object"}, {"additionalProperties", std::move(one)}};
            // A name that reads as a number would be one where it is used. Names in an MTL are never used
            // that way.
            if (key.kind != ValueKind::Text)
                schema["propertyNames"] = {
                    {"minLength", 1},
                    {"not", {{"pattern", R"(^[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?$)"}}}};
            return schema;
        }
    }
    return one;
}

Json keySchema(const KeySchema& key) {
    Json schema = shapedSchema(key);
    if (key.nullable) schema = {{"anyOf", Json::array({{{"type", "null"}}, std::move(schema)})}};
    std::string description = key.doc;
    if (!key.unit.empty()) description += fmt::format(" [{}]", key.unit);
    // Draft-07 ignores everything beside a $ref, so the description needs a schema around it.
    if (schema.contains("$ref")) schema = {{"allOf", Json::array({std::move(schema)})}};
    schema["description"] = std::move(description);
    if (!key.fallback.empty()) {
        const Json value = Json::parse(key.fallback, nullptr, false);
        schema["default"] = value.is_discarded() ? Json(key.fallback) : value;
    }
    return schema;
}

Json required(const std::string& key) { return {{"required", Json::array({key})}}; }

Json ruleSchema(const KeyRule& rule) {
    Json schema = Json::object();
    switch (rule.kind) {
        case KeyRule::Kind::ExactlyOne:
            for (const std::string& key : rule.keys) schema["oneOf"].push_back(required(key));
            break;
        case KeyRule::Kind::AtMostOne: schema["not"] = {{"required", rule.keys}}; break;
        case KeyRule::Kind::Together:
            for (const std::string& key : rule.keys)
                for (const std::string& other : rule.keys)
                    if (other != key) schema["dependencies"][key].push_back(other);
            break;
    }
    return schema;
}

Json sectionSchema(const SectionSchema& section) {
    Json schema{{"type", "object"}};
    if (!section.doc.empty()) schema["description"] = section.doc;
    Json properties = Json::object(), needed = Json::array();
    for (const KeySchema& key : section.keys) {
        properties[key.name] = keySchema(key);
        if (key.required) needed.push_back(key.name);
    }
    schema["properties"] = std::move(properties);
    if (!needed.empty()) schema["required"] = std::move(needed);
    schema["additionalProperties"] = false;
    for (const KeyRule& rule : section.rules) schema["allOf"].push_back(ruleSchema(rule));
    return schema;
}

// ---- Markdown -------------------------------------------------------------------------------------------

/// The text before the sections of the manual.
constexpr std::string_view kIntroduction = R"(# Scene files

<!-- Generated from the table in core/scene/yaml/scene_schema.cpp. Change it there, then run
     CRT_UPDATE_DOCS=1 unit_tests "docs/scene.md is what the schema says" -->

A scene is one YAML file. The smallest contains only `crt: 1`; this one shows a floor under a light:

```yaml
crt: 1
title: A lamp over a floor
camera: {position: [0, 1, -4], target: [0, 0.5, 0], fov: 40}
film: {resolution: [320, 240]}
spectra:
  paint: {rgb: [0.8, 0.7, 0.6]}
materials:
  floor: {type: diffuse, reflectance: paint}
  black: {type: diffuse, reflectance: 0}
objects:
  - name: floor
    mesh: {positions: [[-2, 0, -2], [-2, 0, 2], [2, 0, 2], [2, 0, -2]], faces: [[0, 1, 2, 3]]}
    material: floor
  - name: lamp
    mesh: {positions: [[-1, 2, -1], [1, 2, -1], [1, 2, 1], [-1, 2, 1]], faces: [[0, 1, 2, 3]]}
    material: black
    emission: {radiance: {blackbody: 4000, scale: 5}}
outputs:
  - {file: lamp.exr, aovs: [normal, depth]}
  - {file: lamp.png}
```

## Rules

- `crt: 1` comes first. Keys that are not in this manual are errors, and so are keys given twice.
- Numbers are decimal: `0.5`, `1e3`, `-2`. Whole numbers may be written `1e3` or `3.0`. Leading zeros,
  hexadecimal, NaN and infinity are refused. The only booleans are `true` and `false`. Text that looks like
  a number needs quotes.
- Anchors and aliases work. Merge keys (`<<`), tags (`!!float`), cycles and several documents in one file
  are refused.
- Relative file names are looked up in the scene's folder, then in the directories of `CRT_MESH_PATH`
  (separated by `:`), or, if that is not set, in the meshes installed with crt. Names of outputs are relative
  to the working directory.
- All errors of a file are reported at once, each with its line, and crt ends with code 3. Spectra and
  materials that nothing uses are warnings.
- `--set film.resolution=[128,128]` or `--set objects.ball.material=red` changes a value before the scene is
  checked. Items of lists go by index, from 0, or by `name`. A key that is set replaces the keys that exclude
  it: `--set camera.fov=50` replaces a `focal_length` with its `sensor`. `null` removes an optional key:
  `--set objects.1.emission=null` switches a light off.
- Editors that know JSON Schema check scenes while you type: save `crt schema` as `crt-scene-1.schema.json`
  and begin the scene with `# yaml-language-server: $schema=crt-scene-1.schema.json`.

## Shared parts

`include` names scene files, one or a list, relative to the file that contains it. Each of them begins with
`crt: 1` and may leave out everything that a scene may leave out. They are merged into the scene:

- `camera`, `film`, `integrator`, `sampler`, `environment`, `spectra` and `materials` are merged key by key.
  Where two files give the same key, the including file wins over what it includes, and of a list of files
  the later one wins over the earlier. A value is replaced as a whole: crt takes a material from one file
  only. A value also removes included keys that exclude it: a `fov` removes a `focal_length` with its
  `sensor`.
- `objects` and `lights` are concatenated: those of the included files come first, in the order of the list.
- `title`, `unit` and `outputs` come from the file that wins. All files of a scene have one unit: it is
  enough that one file gives it, and two different units are an error.
- `key: null` removes an included value if `null` is a valid value of the key, such as `environment: null`.
- A file that several files include counts once. A file that includes itself, directly or through others, is
  an error. Files may be included 16 deep.
- Relative names of meshes and spectra are looked up in the folder of the file that names them.
- `--set` changes the merged scene, including the values of included files.
- Unused spectra and materials of included files cause no warning.

```yaml
crt: 1
include: shared/cornell_room.yaml
film: {exposure_ev: 1}
objects:
  - {name: sphere, obj: sphere.obj, material: white, transform: [{scale: 280}, {translate: [278, 0, 290]}]}
```

## Units of the numbers in an image

EXR and PFM files hold radiance. A pixel's luminance is 72,983 cd/m² times its Y; in sRGB, Y =
0.2126 R + 0.7152 G + 0.0722 B. XYZ are ∫ L (x̄, ȳ, z̄) dλ / ∫ ȳ dλ, with L in
W·m⁻²·sr⁻¹·nm⁻¹, and RGB follow from XYZ by the colour space of the film. So a pixel with Y =
1, such as RGB (1, 1, 1), has the luminance 683.002 lm/W · 106.857 nm = 72,983 cd/m². EXR
files store this number as OpenEXR's attribute `whiteLuminance` (`crt info a.exr` prints it);
where `apply_to_float` multiplies the values by 2^ev, crt divides it by 2^ev. Spectral bins
are radiance, in W·m⁻²·sr⁻¹·nm⁻¹. The illuminance of a matt surface of reflectance ρ is π / ρ
times its luminance. PNG and PPM are for screens: exposed, balanced, sRGB-encoded and clipped,
so they do not hold radiance. The report (`NAME.report.json`) gives the mean luminance in both
units.

`crt SCENE --expose auto` chooses `exposure_ev` so that the geometric mean of the luminance becomes
18 % grey, and prints it.

## Named data

`{data: NAME}` is a measured spectrum that comes with crt, usable as any spectrum. `crt data` lists them
with their sources, `crt data NAME` prints one. The families are

- `cornell/…`: paints and lamp of the Cornell box;
- `paints/…`: the 24 paints of the ColorChecker chart;
- `illuminants/…`, `glasses/…`, `metals/…`: what `illuminant`, `glass` and `metal` name. The parts of a
  metal's index are two spectra, `metals/Au/n` and `metals/Au/k`.

You can add families: folders of CSV files (`FAMILY/NAME.csv`, with the header that `crt data NAME` prints).
`CRT_DATA_PATH` lists the folders that hold them, separated by `:`. crt searches these before its own.
)";

/// The text before the variants of a family.
std::string_view familyIntroduction(std::string_view family) {
    if (family == "spectrum")
        return "A function of wavelength, from 360 to 830 nm. A key that needs a spectrum takes\n\n"
               "- a number: the same at every wavelength;\n"
               "- text: the name of an entry of `spectra` (for `white_balance` also of an illuminant);\n"
               "- a map of one of the forms below.\n";
    if (family == "texture")
        return "A value that depends on the place: where a key takes a texture, it takes a map of one of "
               "these forms, too. An alias (`&wood`, `*wood`) uses one several times; a file is read once "
               "however often it is named.\n";
    if (family == "material") return "The scattering of light at a surface. `type` selects one of these.\n";
    if (family == "light")
        return "A light without a surface: `lights` lists them, and `type` picks one of these. One key sets "
               "the brightness, and its name gives the unit: a spectrum in absolute terms, or an amount to "
               "which `spectrum` is scaled. A scene unit is a metre unless [unit](#top-level) names another "
               "length.\n\n"
               "All but suns have no size and are found by light sampling alone. They need "
               "`integrator.nee`, and they shine through panes. Their light is missing where it comes by "
               "way of smooth glass, mirrors, smooth metals and coats, or is mirrored by a pane: "
               "crt warns of this, and no stated error includes it (`missing_light` in the report, "
               "`crt/missingLight` in images). Paths find a small emitting sphere in these places. "
               "`integrator.mis: false` does not change these lights.\n";
    if (family == "transform")
        return "A placement is a list of steps, each a map with one key, applied in order: `[{scale: 2}, "
               "{rotate: {axis: [0, 1, 0], angle_deg: 90}}, {translate: [0, 1, 0]}]`.\n";
    return {};
}

std::string headingOf(const SectionSchema& section) {
    const std::string family = familyOf(section);
    return section.name == family ? family : fmt::format("{}: {}", family, variantWord(section));
}

std::string linkTo(const std::string& family) { return fmt::format("[{0}](#{0})", family); }

std::string kindText(const KeySchema& key) {
    const std::string or_map =
        key.section.empty() ? std::string() : fmt::format(", or a {} map", linkTo(key.section));
    switch (key.kind) {
        case ValueKind::Integer: return "whole number";
        case ValueKind::Number: return "number" + or_map;
        case ValueKind::Boolean: return "true or false";
        case ValueKind::Text: return "text";
        case ValueKind::Choice: return fmt::format("`{}`{}", fmt::join(key.choices, "`, `"), or_map);
        case ValueKind::Spectrum: return linkTo("spectrum") + or_map;
        case ValueKind::Section: return fmt::format("{} map", linkTo(key.section));
    }
    return {};
}

std::string countText(const KeySchema& key) {
    if (key.count_max == kUnbounded)
        return key.count_min > 0 ? fmt::format("{} or more", key.count_min) : std::string();
    return key.count_min == key.count_max ? fmt::format("{}", key.count_min)
                                          : fmt::format("{} to {}", key.count_min, key.count_max);
}

std::string typeText(const KeySchema& key) {
    const std::string one = kindText(key), count = countText(key);
    const std::string list =
        count.empty() ? fmt::format("list of: {}", one) : fmt::format("list of {}: {}", count, one);
    switch (key.shape) {
        case ValueShape::One: return one;
        case ValueShape::List: return list;
        case ValueShape::OneOrList: return fmt::format("{}, or {}", one, list);
        case ValueShape::Lists: return fmt::format("list of: {}", list);
        case ValueShape::Map: return fmt::format("map of names: {}", one);
    }
    return one;
}

std::string keyTable(const SectionSchema& section) {
    std::string text = "| Key | Value | Unit | Range | Default | |\n|---|---|---|---|---|---|\n";
    for (const KeySchema& key : section.keys) {
        const std::string range = key.range.text();
        const std::string fallback = key.required           ? "required"
                                     : key.fallback.empty() ? "–"
                                                            : fmt::format("`{}`", key.fallback);
        text += fmt::format("| `{}` | {} | {} | {} | {} | {} |\n", key.name, typeText(key), key.unit,
                            range == "any" ? "" : range, fallback, key.doc);
    }
    return text;
}

/// The meaning of each keyword of an MTL, from the table that its reader uses.
std::string mtlTable() {
    std::string text =
        "\nMaterials of an OBJ come from the files that its `mtllib` names: all of them are read, and the "
        "first definition of a name counts. `\\` in a name is read as `/`; letters of another case, folders "
        "that are not there, and an MTL that was renamed together with its OBJ are accepted, each with a "
        "warning. If a file is missing, the mesh loses its materials, and `material` is used instead. A "
        "material is, by the first rule that applies,\n\n"
        "1. glass (dielectric, smooth and clear), if `Ni` is above 1 and the material lets light pass: `d` "
        "below 1, `Tr` above 0 without `d`, a `Tf` that is neither black nor white, `illum` 6, 7 or 9, or "
        "`illum` 4 without a white `Tf`;\n"
        "2. a mirror, if `Pm` is 0.5 or more, or `illum` is 3 or 5 with Kd ≤ 0.1 and a Ks;\n"
        "3. diffuse.\n\n"
        "One line per file reports the resulting materials, the statements that were left out, and the "
        "keywords that are not in this table. A statement with invalid numbers counts as left out.\n\n"
        "| MTL | Arguments | Meaning in crt |\n|---|---|---|\n";
    for (const MtlKey& key : mtlKeys()) {
        std::string words = fmt::format("`{}`", key.keyword);
        for (const std::string& alias : key.aliases) words += fmt::format(", `{}`", alias);
        text += fmt::format("| {} | {} | {} |\n", words, key.arguments, key.doc);
    }
    return text;
}

std::string ruleText(const KeyRule& rule) {
    switch (rule.kind) {
        case KeyRule::Kind::ExactlyOne:
            return fmt::format("Exactly one of `{}` is required.", fmt::join(rule.keys, "`, `"));
        case KeyRule::Kind::AtMostOne:
            return fmt::format("`{}` exclude each other.", fmt::join(rule.keys, "` and `"));
        case KeyRule::Kind::Together:
            return fmt::format("`{}` go together.", fmt::join(rule.keys, "` and `"));
    }
    return {};
}

}  // namespace

std::string sceneJsonSchema() {
    const std::vector<SectionSchema>& sections = sceneSchema();
    Json root{{"$schema", "http://json-schema.org/draft-07/schema#"}, {"title", "crt scene, format 1"}};
    root.update(sectionSchema(sections.front()));

    Json definitions = Json::object();
    Json spectrum = familySchema("spectrum");
    spectrum["oneOf"].insert(spectrum["oneOf"].begin(), Json{{"type", "string"}, {"minLength", 1}});
    spectrum["description"] = "The name of an entry of spectra, or one of the forms of a spectrum.";
    definitions["spectrum"] = std::move(spectrum);
    for (std::size_t i = 1; i < sections.size(); ++i)
        definitions[definitionName(sections[i])] = sectionSchema(sections[i]);
    root["definitions"] = std::move(definitions);
    return root.dump(2) + "\n";
}

std::string sceneReferenceMarkdown() {
    std::string text(kIntroduction);
    std::set<std::string> families_seen;
    const SectionSchema& top = sceneSchema().front();
    for (const SectionSchema& section : sceneSchema()) {
        const std::string family = familyOf(section);
        if (isFamily(family) && families_seen.insert(family).second)
            text += fmt::format("\n## {}\n\n{}", family, familyIntroduction(family));
        const bool chapter = section.name.empty() || top.find(section.name) != nullptr ||
                             section.name == "object" || section.name == "output";
        text += fmt::format("\n{} {}\n\n", chapter ? "##" : "###",
                            section.name.empty() ? "Top level" : headingOf(section));
        if (!section.doc.empty()) text += section.doc + "\n\n";
        text += keyTable(section);
        for (const KeyRule& rule : section.rules) text += fmt::format("\n{}\n", ruleText(rule));
        if (section.name == "mtl") text += mtlTable();
    }
    return text;
}

}  // namespace crt
