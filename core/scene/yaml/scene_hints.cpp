#include "scene/yaml/scene_hints.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace crt {
namespace {

struct ForeignWords {
    std::vector<std::string_view> sections;
    std::vector<std::string_view> words;
    std::string hint;
};

const std::vector<ForeignWords>& foreignWords() {
    static const std::vector<ForeignWords> all{
        {{"sphere", "disk", "cylinder", "rectangle", "box"},
         {"center", "centre", "position", "origin", "translate", "location"},
         "place it by the object's 'transform: [{translate: [x, y, z]}]'"},
        {{"object"},
         {"center", "centre", "position", "origin", "translate", "location"},
         "write transform: [{translate: [x, y, z]}]"},
        {{"object"},
         {"rotate", "rotation", "orientation"},
         "write transform: [{rotate: {axis: [0, 1, 0], angle_deg: 90}}]"},
        {{"object"}, {"scale", "size"}, "write transform: [{scale: 2}]"},
        {{"material/diffuse", "material/mirror", "material/plastic"},
         {"color", "colour", "albedo", "base_color", "diffuse", "kd", "Kd"},
         "its colour is 'reflectance'"},
        {{"material/conductor"}, {"roughness"}, "a smooth metal has none: write type: rough_conductor"},
        {{"material/dielectric"}, {"roughness"}, "smooth glass has none: write type: rough_dielectric"},
        {{"emission"},
         {"luminous_flux", "lumens", "lm", "luminance", "nits", "power", "watts"},
         "its brightness is 'luminous_flux_lm', 'luminance_cd_m2' or 'power_w'"},
        {{"emission"},
         {"color", "colour", "intensity", "strength"},
         "'radiance' sets its brightness and colour"},
        {{"camera"}, {"look_at", "lookat", "lookAt", "to"}, "'target' is the point it looks at"},
        {{"camera"}, {"from", "eye", "origin", "location"}, "'position' is the point it looks from"},
        {{"film"}, {"width", "height", "size"}, "write resolution: [width, height]"},
        {{"film"}, {"exposure", "ev"}, "did you mean 'exposure_ev'?"},
        {{"sampler"}, {"spp", "count", "sample_count"}, "did you mean 'samples'?"},
        {{"material"}, {"glass", "water"}, "did you mean 'dielectric'?"},
        {{"material"}, {"rough_glass", "frosted_glass"}, "did you mean 'rough_dielectric'?"},
        {{"material"}, {"metal"}, "did you mean 'conductor' or 'rough_conductor'?"},
        {{"material"}, {"lambert", "lambertian", "matte"}, "did you mean 'diffuse'?"},
        {{"material"}, {"principled", "disney", "pbr", "standard"}, "did you mean 'openpbr'?"},
        {{"material"}, {"glossy", "coated", "ceramic"}, "did you mean 'plastic'?"},
        {{"material"}, {"pane", "window", "thin_glass"}, "did you mean 'thin_dielectric'?"},
        {{"material"},
         {"emissive", "emission", "emitter", "light"},
         "objects shine by their 'emission', whatever their material"},
        {{"light"},
         {"area", "mesh", "rectangle", "quad", "sphere"},
         "a light with a surface is an object with an 'emission'"},
        {{"light"}, {"distant", "parallel"}, "did you mean 'directional'?"},
        {{"light"},
         {"environment", "envmap", "infinite", "hdri", "dome", "sky"},
         "light from all around is the scene's 'environment'"},
        {{"light"}, {"eulumdat", "ldt", "photometric"}, "type 'ies' reads EULUMDAT files, too"},
        {{"environment"},
         {"sun_sky", "sunsky", "hosek_wilkie", "preetham", "nishita", "daylight", "turbidity"},
         "a clear sky and its sun are 'clear_sky'"},
        {{"sky"}, {"turbidity"}, "a sky by its turbidity is 'clear_sky' of the environment"},
        {{"clear_sky"}, {"albedo"}, "did you mean 'ground_albedo'?"},
        {{"object", "emission", "environment", "light/point", "light/spot", "light/ies", "light/beam",
          "light/directional", "light/sun"},
         {"light_linking", "shadow_linking", "linked_lights", "include_lights", "exclude_lights",
          "include_objects", "exclude_objects"},
         "crt has no light linking: every light reaches every surface that it sees"},
    };
    return all;
}

/// The colours of CSS 2.1, section 4.3.6, sRGB-encoded.
struct NamedColor {
    std::string_view name;
    std::uint32_t rgb;
};
constexpr std::array<NamedColor, 18> kColors{{{"maroon", 0x800000},
                                              {"red", 0xff0000},
                                              {"orange", 0xffa500},
                                              {"yellow", 0xffff00},
                                              {"olive", 0x808000},
                                              {"purple", 0x800080},
                                              {"fuchsia", 0xff00ff},
                                              {"white", 0xffffff},
                                              {"lime", 0x00ff00},
                                              {"green", 0x008000},
                                              {"navy", 0x000080},
                                              {"blue", 0x0000ff},
                                              {"aqua", 0x00ffff},
                                              {"teal", 0x008080},
                                              {"black", 0x000000},
                                              {"silver", 0xc0c0c0},
                                              {"gray", 0x808080},
                                              {"grey", 0x808080}}};

std::string rgbMap(std::uint32_t rgb) {
    const auto component = [rgb](unsigned shift) { return ((rgb >> shift) & 0xffu) / 255.0; };
    return fmt::format("{{rgb: [{:.3g}, {:.3g}, {:.3g}]}}", component(16), component(8), component(0));
}

/// "#f00" and "#ff0000".
std::optional<std::uint32_t> hexColor(std::string_view text) {
    if (!text.starts_with('#') || (text.size() != 4 && text.size() != 7)) return std::nullopt;
    text.remove_prefix(1);
    std::uint32_t value = 0;
    const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
    if (problem != std::errc() || end != text.data() + text.size()) return std::nullopt;
    if (text.size() == 6) return value;
    const std::uint32_t r = value >> 8, g = (value >> 4) & 0xfu, b = value & 0xfu;
    return 0x11u * (r << 16 | g << 8 | b);
}

bool isNumber(const YamlNode& node) {
    return node.kind == YamlKind::Scalar && !node.quoted && looksLikeNumber(node.text);
}

bool isThreeNumbers(const YamlNode& node) {
    return node.kind == YamlKind::List && node.items.size() == 3 &&
           std::all_of(node.items.begin(), node.items.end(),
                       [](const YamlNodePtr& item) { return isNumber(*item); });
}

/// As it stands in the file, of single values and short lists of them.
std::string textOf(const YamlNode& node) {
    if (node.kind == YamlKind::Scalar) return node.quoted ? fmt::format("\"{}\"", node.text) : node.text;
    std::vector<std::string> items;
    for (const YamlNodePtr& item : node.items) items.push_back(item->text);
    return fmt::format("[{}]", fmt::join(items, ", "));
}

std::string rgbMap(const YamlNode& numbers) {
    const bool encoded =
        std::all_of(numbers.items.begin(), numbers.items.end(),
                    [](const YamlNodePtr& item) { return parseNumber(item->text).value.value_or(0) <= 1; });
    return fmt::format("{{rgb: {}{}}}", textOf(numbers), encoded ? "" : ", space: linear");
}

/// YAML takes what follows '#' for a comment: "reflectance: #ff0000" is nothing.
std::optional<std::uint32_t> colorInComment(const YamlPlace& place) {
    if (place.source == nullptr || place.line <= 0) return std::nullopt;
    const auto row = static_cast<std::size_t>(place.line) - 1;
    if (row >= place.source->lines.size()) return std::nullopt;
    const std::string& line = place.source->lines[row];
    const std::size_t mark = line.find('#', static_cast<std::size_t>(std::max(place.column - 1, 0)));
    if (mark == std::string::npos) return std::nullopt;
    const std::size_t end = std::min(line.find_first_of(" \t,}", mark), line.size());
    return hexColor(std::string_view(line).substr(mark, end - mark));
}

/// True if the value is valid for the key.
bool takes(const KeySchema& key, const YamlNode& node) {
    if (node.kind == YamlKind::List)
        return key.kind == ValueKind::Number && key.shape == ValueShape::List &&
               static_cast<std::size_t>(key.count_min) == node.items.size() &&
               std::all_of(node.items.begin(), node.items.end(),
                           [](const YamlNodePtr& item) { return isNumber(*item); });
    if (node.kind != YamlKind::Scalar || key.shape != ValueShape::One) return false;
    if (isNumber(node)) return key.kind == ValueKind::Number || key.kind == ValueKind::Spectrum;
    return key.kind == ValueKind::Text || key.kind == ValueKind::Spectrum;
}

/// The keys that one may have meant to leave out: the only one that is required, or those of which one is.
std::vector<const KeySchema*> mainKeys(const SectionSchema& section) {
    std::vector<const KeySchema*> keys;
    for (const KeySchema& key : section.keys)
        if (key.required) keys.push_back(&key);
    if (keys.size() == 1) return keys;
    if (!keys.empty()) return {};
    for (const KeyRule& rule : section.rules) {
        if (rule.kind != KeyRule::Kind::ExactlyOne) continue;
        for (const std::string& key : rule.keys) keys.push_back(section.find(key));
        break;
    }
    return keys;
}

}  // namespace

std::string hintOfForeignWord(std::string_view section_or_family, std::string_view word) {
    for (const ForeignWords& row : foreignWords())
        if (std::find(row.sections.begin(), row.sections.end(), section_or_family) != row.sections.end() &&
            std::find(row.words.begin(), row.words.end(), word) != row.words.end())
            return row.hint;
    return {};
}

std::string hintOfMissingMap(const SectionSchema& section, const YamlNode& node) {
    const std::vector<const KeySchema*> keys = mainKeys(section);
    // A path is text, and a name of a spectrum has no dot: the image of an environment before its radiance.
    const bool is_path = node.kind == YamlKind::Scalar && node.text.find('.') != std::string::npos;
    for (const bool text_alone : {is_path, false})
        for (const KeySchema* key : keys) {
            if (text_alone && key->kind != ValueKind::Text) continue;
            if (takes(*key, node)) return fmt::format("write {{{}: {}}}", key->name, textOf(node));
            if (key->kind == ValueKind::Spectrum && isThreeNumbers(node))
                return fmt::format("write {{{}: {}}}", key->name, rgbMap(node));
        }
    return {};
}

std::string hintOfColor(const YamlNode& node, const YamlPlace& place) {
    if (isThreeNumbers(node)) return fmt::format("write {}", rgbMap(node));
    if (node.kind != YamlKind::Null) return {};
    const std::optional<std::uint32_t> color = colorInComment(place);
    return color ? fmt::format("'#' begins a comment; write {}", rgbMap(*color)) : std::string();
}

std::string hintOfColorName(std::string_view name) {
    if (const std::optional<std::uint32_t> color = hexColor(name))
        return fmt::format("write {}", rgbMap(*color));
    for (const NamedColor& color : kColors)
        if (color.name == name) return fmt::format("write {}", rgbMap(color.rgb));
    return {};
}

}  // namespace crt
