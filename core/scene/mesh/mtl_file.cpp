#include "scene/mesh/mtl_file.h"

#include "base/log.h"
#include "scene/mesh/obj_text.h"

#include <algorithm>
#include <cctype>

namespace crt {
namespace {

bool sameWord(std::string_view a, std::string_view b) {
    const auto lower = [](char c) { return std::tolower(static_cast<unsigned char>(c)); };
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [&](char x, char y) { return lower(x) == lower(y); });
}

}  // namespace

const std::vector<MtlKey>& mtlKeys() {
    static const std::vector<MtlKey> keys{
        {"Kd",
         {},
         "r g b, or one number for grey",
         "Reflectance of a diffuse surface, and of a mirror by `Pm`. 0.6 where it is left out, 0 if the "
         "material emits. Clamped to [0, 1], with a warning. `Kd spectral` and `Kd xyz` are not read, with "
         "a warning."},
        {"Ke",
         {},
         "r g b, or one number",
         "Radiance, emitted on the front side: 1 1 1 is the spectrum of D65 with luminance 1. Black is no "
         "light."},
        {"Ks",
         {},
         "r g b, or one number",
         "Reflectance of a mirror by `illum` 3 or 5. Elsewhere a highlight, which is left out: "
         "`illum` 0 and 1 say that there is none, other values bring a warning."},
        {"Ka", {}, "r g b", "Ignored: ambient light has no place in light transport."},
        {"Ni",
         {},
         "n",
         "Refractive index. Glass needs one above 1 (at most 1000); alone it makes none, because Blender "
         "and 3ds Max write it for everything."},
        {"d",
         {},
         "opacity",
         "Below 1, and with `Ni` above 1: clear glass, unless there is a `map_Kd` or `map_d`. Otherwise the "
         "opacity; 0 is taken for 1, with a warning: a Sponza in circulation has it everywhere."},
        {"Tr",
         {},
         "1 − opacity",
         "As `d`, which takes precedence if both are present. MeshLab, vcglib and OpenMVS write `Tr 1` for "
         "opaque surfaces, without `Ni`."},
        {"Tf",
         {"Kt"},
         "r g b, or one number",
         "Means that light passes, and with `Ni` above 1 makes clear glass, unless it is black or white: "
         "3ds Max and Maya write `Tf 1 1 1` for everything. Its colour is left out, with a warning."},
        {"illum",
         {},
         "0 to 10",
         "4, 6, 7 and 9 with `Ni` above 1: glass. 3 and 5 with Kd ≤ 0.1 and a Ks: mirror. Maya writes "
         "`illum 4` and `Tf 1 1 1` for opaque surfaces, with any `Ni`: together they make no glass."},
        {"Pm",
         {},
         "metalness",
         "0.5 and more: a mirror with reflectance Kd, else diffuse. Values between 0 and 1 bring a "
         "warning."},
        {"crt_reflectance",
         {},
         "file",
         "A measured spectrum (`.spd`, `.csv`) in place of Kd or Ks, looked up in the folder of the MTL; "
         "clamped beyond its ends. Known to crt only."},
        {"Ns",
         {},
         "exponent",
         "Left out, because crt leaves out highlights, and mirrors and glass are smooth. A warning if Ns or "
         "Pr make them visibly rough."},
        {"Pr", {}, "roughness", "As `Ns`."},
        {"Ps", {}, "sheen", "Left out, with a warning if not 0."},
        {"Pc", {}, "coat thickness", "Left out, with a warning if not 0."},
        {"Pcr", {}, "coat roughness", "Left out, with a warning if not 0."},
        {"aniso", {}, "anisotropy", "Left out, with a warning if not 0."},
        {"anisor", {}, "its angle", "Left out, with a warning if not 0."},
        {"map_Kd",
         {},
         "image",
         "A texture that replaces `Kd`, on faces with `vt`: sRGB for 8 and 16 bits. "
         "Looked up in the folder of the MTL, with `/` for `\\`, without its folders, and in another letter "
         "case. `-s`, `-o` and `-clamp` are read; other options that change the picture, such as `-mm`, "
         "bring a "
         "warning. If the file cannot be read, crt warns and uses `Kd`; a "
         "black `Kd`, which exporters write together with a texture, counts as grey 0.6."},
        {"map_Ka", {}, "image", "Ignored, as `Ka`."},
        {"map_Ks", {}, "image", "Left out, with a warning."},
        {"map_Ns", {}, "image", "Left out, with a warning."},
        {"map_Ke", {}, "image", "Left out, with a warning."},
        {"map_d",
         {"map_Tr", "map_opacity"},
         "image",
         "Replaces `d`, as `map_Kd` replaces `Kd`: white is opaque, black is a hole. Coloured images give "
         "red, or the channel of `-imfchan` (`r`, `g`, `b`, `m` for alpha); alpha if it is the image of "
         "`map_Kd`. Left out, with a warning, for glass and if the file does not exist."},
        {"map_Pr", {}, "image", "Left out, with a warning."},
        {"map_Pm", {}, "image", "Left out, with a warning."},
        {"map_Ps", {}, "image", "Left out, with a warning."},
        {"map_refl", {"refl"}, "image", "Left out, with a warning."},
        {"map_bump", {"bump"}, "image", "Left out, with a warning."},
        {"disp", {"map_disp"}, "image", "Left out, with a warning."},
        {"decal", {"map_decal"}, "image", "Left out, with a warning."},
        {"norm",
         {"map_Kn", "map_norm"},
         "image",
         "A normal map, as `normal_map` of materials. Left out, with a warning, for glass and if the file "
         "does not exist."},
        {"sharpness", {}, "number", "Ignored: it belongs to reflection maps."},
        {"map_aat", {}, "on or off", "Ignored: it belongs to textures."},
    };
    return keys;
}

const MtlKey* findMtlKey(std::string_view keyword) {
    for (const MtlKey& key : mtlKeys())
        if (sameWord(key.keyword, keyword) ||
            std::any_of(key.aliases.begin(), key.aliases.end(),
                        [&](const std::string& a) { return sameWord(a, keyword); }))
            return &key;
    return nullptr;
}

const MtlStatement* MtlText::find(std::string_view keyword) const {
    const auto found = statements.find(keyword);
    return found == statements.end() ? nullptr : &found->second;
}

std::vector<MtlText> readMtl(std::string_view text, const std::string& path) {
    std::vector<MtlText> materials;
    int lost = 0, first_lost = 0;
    TextLines lines(text);
    while (lines.next()) {
        if (sameWord(lines.keyword(), "newmtl")) {
            materials.push_back({std::string(lines.arguments()), path, lines.number(), {}});
            continue;
        }
        if (materials.empty()) {
            if (++lost == 1) first_lost = lines.number();
            continue;
        }
        const MtlKey* key = findMtlKey(lines.keyword());
        materials.back().statements[std::string(key != nullptr ? key->keyword : lines.keyword())] = {
            std::string(lines.arguments()), lines.number()};
    }
    if (lost > 0 && !materials.empty())
        logWarning("{}:{}: {} statement{} before the first newmtl left out", path, first_lost, lost,
                   lost == 1 ? "" : "s");
    return materials;
}

}  // namespace crt
