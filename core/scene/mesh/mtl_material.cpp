#include "scene/mesh/mtl_material.h"

#include "base/error.h"
#include "scene/mesh/obj_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <utility>
#include <vector>

namespace crt {
namespace {

constexpr double kMaxIndex = 1e3;    // As `ior` of a scene file.
constexpr double kUnstatedKd = 0.6;  // As tinyobjloader and assimp assume.
constexpr double kVisibleRoughness = 0.05;
constexpr std::size_t kAlpha = 3;

/// The channel of `-imfchan`.
std::size_t channelOf(std::string_view name) {
    return name == "g" ? 1 : name == "b" ? 2 : name == "m" ? kAlpha : 0;
}

double brightest(const Vec3d& c) { return std::max({c[0], c[1], c[2]}); }
bool isGrey(const Vec3d& c, double level) { return c == Vec3d{level, level, level}; }

/// Beyond 1, where an exporter multiplied a colour by a strength, the colour is decoded and the strength
/// stays linear.
Vec3d srgbDecoded(const Vec3d& encoded) {
    const double strength = std::max(1.0, brightest(encoded));
    Vec3d rgb;
    for (std::size_t i = 0; i < 3; ++i) rgb[i] = strength * srgbToLinear(encoded[i] / strength);
    return rgb;
}

/// The file of this name: as it stands, with '/' for '\\', without its folders, or in another case; beside
/// the MTL.
std::optional<std::string> findMap(const std::string& name, const std::string& mtl_file) {
    namespace fs = std::filesystem;
    std::string slashed = name;
    std::replace(slashed.begin(), slashed.end(), '\\', '/');
    const fs::path folder = fs::path(mtl_file).parent_path(), path(slashed);
    std::error_code ignored;
    for (const fs::path& candidate : {folder / name, folder / path, folder / path.filename()})
        if (path.has_filename() && fs::is_regular_file(candidate, ignored)) return candidate.string();
    const auto lower = [](std::string text) {
        for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
        return text;
    };
    const std::string wanted = lower(path.filename().string());
    std::vector<std::string> like;  // Of several, the first in the order of the alphabet.
    for (const fs::path& where : {folder / path.parent_path(), folder}) {
        for (fs::directory_iterator entry(where.empty() ? fs::path(".") : where, ignored), end;
             !ignored && entry != end; entry.increment(ignored))
            if (lower(entry->path().filename().string()) == wanted) like.push_back(entry->path().string());
        if (!like.empty()) return *std::min_element(like.begin(), like.end());
    }
    return std::nullopt;
}

/// Maps one material.
class MaterialMapper {
public:
    MaterialMapper(const MtlText& mtl, MtlColor color, MtlSummary& summary)
        : mtl_(mtl), color_(color), summary_(summary) {
        kd_ = colour("Kd");
        ks_ = colour("Ks");
        ke_ = colour("Ke");
        tf_ = colour("Tf");
        ni_ = number("Ni");
        pm_ = number("Pm");
        opacity_ = number("d");
        if (const std::optional<double> transparency = number("Tr"); transparency && !opacity_)
            opacity_ = 1.0 - *transparency;
        illum_ = number("illum");
    }

    MtlMaterial map() {
        MtlMaterial mapped;
        Material& m = mapped.material;
        m.name = mtl_.name;
        m.place = {mtl_.file, mtl_.line};
        const bool metallic = pm_.value_or(0.0) >= 0.5;
        if (has("map_Kd") && !has("crt_reflectance")) map_kd_ = map("map_Kd");
        if (has("map_d")) map_d_ = map("map_d");
        const bool polished = illumIs({3, 5}) && brightest(kd_.value_or(Vec3d{})) <= 0.1 &&
                              brightest(ks_.value_or(Vec3d{})) > 0.0;
        if (lightPasses() && refracts())
            glass(m);
        else if (metallic || polished)
            mirror(m, metallic);
        else
            diffuse(m);
        if (reflects_kd_) mapped.map_kd = map_kd_;
        if (!glass_) {
            mapped.map_d = map_d_;
            if (has("norm")) mapped.norm = map("norm");
        }
        if (emits()) {
            mapped.emission = Emission{rgbEmission(linear(*ke_)), false};
            summary_.became("emitting");
        }
        mapped.spectrum_file = spectrum_file_;
        dropRest();
        return mapped;
    }

private:
    // ---- Statements ----

    /// Nothing where the keyword is absent or no number follows it; the latter is noted.
    std::optional<double> number(const char* keyword) const {
        const MtlStatement* s = mtl_.find(keyword);
        if (s == nullptr) return std::nullopt;
        std::string_view rest = s->arguments;
        std::string_view field = nextField(rest);
        if (field == "-halo") {  // d -halo factor: opacity that depends on the angle.
            summary_.notApplied(mtl_, fmt::format("{} -halo", keyword));
            field = nextField(rest);
        }
        const std::optional<double> value = numberOf(field);
        if (value && std::isfinite(*value)) return value;
        summary_.unreadable(mtl_, keyword);
        return std::nullopt;
    }

    /// Three numbers that are not negative, or one for all three.
    std::optional<Vec3d> colour(const char* keyword) const {
        const MtlStatement* s = mtl_.find(keyword);
        if (s == nullptr) return std::nullopt;
        std::string_view rest = s->arguments;
        std::vector<double> values;
        for (std::string_view field = nextField(rest); !field.empty() && values.size() < 3;
             field = nextField(rest)) {
            const std::optional<double> value = numberOf(field);
            if (!value || !std::isfinite(*value)) {
                const bool form = values.empty() && (field == "spectral" || field == "xyz");
                summary_.unreadable(mtl_, form ? fmt::format("{} {}", keyword, field) : keyword);
                return std::nullopt;
            }
            values.push_back(std::max(*value, 0.0));
        }
        if (values.size() == 1) values.resize(3, values[0]);
        if (values.size() == 3) return Vec3d{values[0], values[1], values[2]};
        summary_.unreadable(mtl_, keyword);
        return std::nullopt;
    }

    bool illumIs(const std::set<double>& models) const { return illum_ && models.contains(*illum_); }
    bool has(const char* keyword) const { return mtl_.find(keyword) != nullptr; }

    /// 3ds Max and Maya state a white Tf for everything, others a black one.
    bool filters() const { return tf_ && !isGrey(*tf_, 0.0) && !isGrey(*tf_, 1.0); }
    /// Maya writes illum 4 and a white Tf for everything. Its Ni is the shader's: 1.5 in a model that came
    /// from 3ds Max.
    bool fromMaya() const { return illumIs({4}) && tf_ && isGrey(*tf_, 1.0); }
    /// A material with images is a surface: leaves and decals, for which exporters also write an Ni.
    bool hasImages() const { return has("map_Kd") || has("map_d"); }
    bool lightPasses() const {
        return (opacity_.value_or(1.0) < 1.0 && !hasImages()) || filters() ||
               (illumIs({4, 6, 7, 9}) && !fromMaya());
    }
    bool refracts() const { return ni_.value_or(1.0) > 1.0 && *ni_ <= kMaxIndex; }
    bool emits() const { return ke_ && brightest(*ke_) > 0.0; }

    // ---- Kinds ----

    void glass(Material& m) {
        summary_.became("glass");
        glass_ = true;
        m.type = MaterialType::Dielectric;
        m.eta = constantSpectrum(*ni_);
        if (opacity_ && *opacity_ > 0.0 && *opacity_ < 1.0)
            summary_.decided("d between 0 and 1 with Ni above 1 read as clear glass");
        if (filters()) summary_.dropped("Tf");
        if (has("crt_reflectance")) summary_.dropped("crt_reflectance");
        smooth();
    }

    void mirror(Material& m, bool metallic) {
        summary_.became("mirror");
        m.type = MaterialType::Mirror;
        reflects_kd_ = metallic;
        m.reflectance = metallic ? reflectance(kdOrGrey(), "Kd") : reflectance(*ks_, "Ks");
        if (metallic && *pm_ < 1.0) summary_.decided("Pm from 0.5 to 1 read as 1");
        cutOut(m);
        smooth();
    }

    void diffuse(Material& m) {
        summary_.became("diffuse");
        m.type = MaterialType::Diffuse;
        reflects_kd_ = true;
        m.reflectance = reflectance(kdOrGrey(), "Kd");
        if (pm_.value_or(0.0) > 0.0) summary_.decided("Pm below 0.5 read as 0");
        cutOut(m);
        // illum 0 and 1 say that there is no highlight, whatever Ks holds.
        if (illumIs({0, 1}) || brightest(ks_.value_or(Vec3d{})) == 0.0) return;
        summary_.dropped("Ks");
        for (const char* roughness : {"Ns", "Pr"})
            if (has(roughness)) summary_.dropped(roughness);
    }

    /// The share of the surface that is there; and what says that light passes, where it does not.
    void cutOut(Material& m) {
        const double opacity = opacity_.value_or(1.0);
        if (map_d_ && map_kd_ && map_d_->file == map_kd_->file) {
            summary_.decided("the alpha of the map_Kd read for the map_d, which is the same image");
            map_d_->channel = kAlpha;
        }
        if (opacity > 0.0 && opacity < 1.0)
            m.opacity = opacity;
        else if (opacity <= 0.0 && !map_d_)
            summary_.decided(fmt::format("{}{} read as opaque", has("d") ? "d 0" : "Tr 1",
                                         refracts() ? " of a surface with images" : " without Ni above 1"));
        else if (illumIs({4, 6, 7, 9}) && !map_d_)
            summary_.decided(fmt::format("illum {} {} read as opaque", *illum_,
                                         refracts() ? "with a white Tf" : "without Ni above 1"));
        if (filters()) summary_.dropped("Tf");
    }

    /// Pr, or what Blender's exporter makes of roughness in Ns = 1000 (1 − roughness)².
    void smooth() {
        const std::optional<double> pr = number("Pr"), ns = number("Ns");
        if (pr && *pr > kVisibleRoughness)
            summary_.dropped("Pr");
        else if (!pr && ns && 1.0 - std::sqrt(std::clamp(*ns / 1000.0, 0.0, 1.0)) > kVisibleRoughness)
            summary_.dropped("Ns");
    }

    // ---- Colours ----

    Vec3d linear(const Vec3d& stated) const {
        return color_ == MtlColor::Srgb ? srgbDecoded(stated) : stated;
    }

    /// Exporters write a black Kd where a texture takes its place.
    Vec3d kdOrGrey() const {
        const bool replaced = kd_ && brightest(*kd_) == 0.0 && has("map_Kd");
        if (kd_ && !replaced) return *kd_;
        if (map_kd_) return {kUnstatedKd, kUnstatedKd, kUnstatedKd};  // unless the image cannot be read
        if (emits() || has("crt_reflectance")) return {};
        summary_.decided(
            fmt::format("{} read as grey {}", replaced ? "a black Kd together with "
                                                         "map_Kd" : "no Kd", kUnstatedKd));
        return {kUnstatedKd, kUnstatedKd, kUnstatedKd};
    }

    Spectrum reflectance(const Vec3d& stated, const char* keyword) {
        if (const MtlStatement* s = mtl_.find("crt_reflectance")) {
            spectrum_file_ = (std::filesystem::path(mtl_.file).parent_path() / s->arguments).string();
            const Spectrum measured = readSpectrumFile(spectrum_file_, Outside::Clamp);
            if (measured.min() < 0.0 || measured.max() > 1.0)
                throw Error(ErrorKind::Scene, "a reflectance must lie in [0, 1]", {spectrum_file_});
            return measured;
        }
        if (brightest(stated) > 1.0) summary_.decided(fmt::format("{} above 1 clamped", keyword));
        return rgbReflectance(
            linear({std::min(stated[0], 1.0), std::min(stated[1], 1.0), std::min(stated[2], 1.0)}));
    }

    // ---- Images ----

    /// Takes the numbers that follow an option off the front, and returns those that the option does not
    /// give.
    static std::vector<double> takeNumbers(std::string_view& rest, std::vector<double> defaults) {
        for (double& number : defaults) {
            std::string_view behind = rest;
            const std::optional<double> value = numberOf(nextField(behind));
            if (!value) break;
            number = *value;
            rest = behind;
        }
        return defaults;
    }

    /// An option of an image's statement, whose arguments are taken off the front. False if it would change
    /// the picture and is not applied.
    static bool option(std::string_view keyword, std::string_view name, std::string_view& rest,
                       MtlMap& map) {
        if (name == "-s" || name == "-o") {
            constexpr double kMost = 1e6;
            const double normal = name == "-s" ? 1 : 0;
            bool applied = true;
            const std::vector<double> values = takeNumbers(rest, {normal, normal, normal});
            for (std::size_t k = 0; k < 2; ++k) {  // Images have no third coordinate.
                const bool usable = std::abs(values[k]) <= kMost;
                if (usable) map.transform[name == "-s" ? 4 * k : 2 + 3 * k] = values[k];
                applied = applied && usable;
            }
            return applied;
        }
        if (name == "-t") return takeNumbers(rest, {0, 0, 0}) == std::vector<double>{0, 0, 0};
        if (name == "-mm") return takeNumbers(rest, {0, 1}) == std::vector<double>{0, 1};
        if (name == "-boost") return takeNumbers(rest, {0}) == std::vector<double>{0};
        // The strength of bumps, which colours do not have.
        if (name == "-bm") return takeNumbers(rest, {1}) == std::vector<double>{1} || keyword != "norm";
        const std::string_view value = nextField(rest);
        if (name == "-clamp") map.clamp = value == "on";
        if (name == "-imfchan" && keyword == "map_d") {
            map.channel = channelOf(value);
            return value == "r" || value == "g" || value == "b" || value == "m";
        }
        if (name == "-blendu" || name == "-blendv") return value == "on";
        return name == "-clamp" || (name == "-cc" && value == "off");
    }

    /// Options and the name of a file, which may have blanks. Nothing, and noted, where it is not there.
    std::optional<MtlMap> map(const char* keyword) const {
        const MtlStatement& statement = *mtl_.find(keyword);
        MtlMap map;
        map.place = {mtl_.file, statement.line};
        std::string_view rest = statement.arguments;
        for (;;) {
            std::string_view after = rest;
            const std::string_view name = nextField(after);
            if (name.empty() || name[0] != '-') break;
            if (!option(keyword, name, after, map))
                summary_.notApplied(mtl_, fmt::format("{} {}", keyword, name.substr(0, 40)));
            rest = after;
        }
        std::string name(trimmed(rest));
        if (name.size() >= 2 && name.front() == '"' && name.back() == '"')
            name = name.substr(1, name.size() - 2);
        const std::optional<std::string> file = findMap(name, mtl_.file);
        if (!file) {
            if (name.empty()) {
                if (!statement.arguments.empty()) summary_.unreadable(mtl_, keyword);
            } else {
                summary_.dropped(keyword);
                summary_.notThere(name);
            }
            return std::nullopt;
        }
        map.file = *file;
        return map;
    }

    // ---- The rest ----

    /// Keywords that no rule above reads: textures, and numbers that are not 0.
    void dropRest() const {
        static const std::set<std::string, std::less<>> read_above{
            "Kd", "Ke", "Ks", "Ni", "d", "Tr", "Tf", "illum", "Pm", "crt_reflectance", "Ns", "Pr"};
        static const std::set<std::string, std::less<>> ignored{"Ka", "map_Ka", "sharpness", "map_aat"};
        for (const auto& [keyword, statement] : mtl_.statements) {
            if (read_above.contains(keyword) || ignored.contains(keyword) || statement.arguments.empty())
                continue;
            std::string_view rest = statement.arguments;
            // Told above where they are not there.
            if (keyword == "map_Kd" && !has("crt_reflectance") && reflects_kd_) continue;
            if ((keyword == "map_d" || keyword == "norm") && !glass_) continue;
            if (findMtlKey(keyword) == nullptr)
                summary_.unknown(keyword);
            else if (numberOf(nextField(rest)) != 0.0)
                summary_.dropped(keyword);
        }
    }

    const MtlText& mtl_;
    MtlColor color_;
    MtlSummary& summary_;
    std::optional<Vec3d> kd_, ks_, ke_, tf_;
    std::optional<double> ni_, pm_, opacity_, illum_;
    std::string spectrum_file_;
    std::optional<MtlMap> map_kd_, map_d_;
    bool reflects_kd_ = false, glass_ = false;
};

}  // namespace

void MtlSummary::note(const MtlText& material, const std::string& what, Places& to) {
    const MtlStatement* statement = material.find(what.substr(0, what.find(' ')));
    Noted& noted = to[what];
    if (++noted.count == 1)
        noted.first =
            fmt::format("{}:{}", std::filesystem::path(material.file).filename().string(), statement->line);
}

std::string MtlSummary::list(const Places& places) {
    std::vector<std::string> words;
    for (const auto& [what, noted] : places)
        words.push_back(fmt::format("{} ({}, first at {})", what, noted.count, noted.first));
    return fmt::format("{}", fmt::join(words, " "));
}

/// The most frequent first: "Ks (20), map_Kd (18)".
std::string MtlSummary::list(const Counts& counts) {
    constexpr std::size_t kMostNamed = 12;  // Hostile files have any number of keywords.
    std::vector<std::pair<std::string, int>> sorted(counts.begin(), counts.end());
    std::stable_sort(sorted.begin(), sorted.end(),
                     [](const auto& a, const auto& b) { return a.second > b.second; });
    std::vector<std::string> words;
    for (const auto& [what, n] : sorted) {
        if (words.size() == kMostNamed) break;
        words.push_back(fmt::format("{} ({})", what, n));
    }
    const std::size_t more = sorted.size() - words.size();
    return fmt::format("{}{}", fmt::join(words, ", "), more > 0 ? fmt::format(" and {} more", more) : "");
}

std::string MtlSummary::text() const {
    int materials = 0;
    std::vector<std::string> kinds;
    for (const char* kind : {"diffuse", "mirror", "glass"}) {
        const auto found = kinds_.find(kind);
        if (found == kinds_.end()) continue;
        materials += found->second;
        kinds.push_back(fmt::format("{} {}", found->second, kind));
    }
    std::string text =
        fmt::format("{} material{}: {}", materials, materials == 1 ? "" : "s", fmt::join(kinds, ", "));
    if (const auto emitting = kinds_.find("emitting"); emitting != kinds_.end())
        text += fmt::format(", {} of them emitting", emitting->second);
    if (!decisions_.empty()) text += "; " + list(decisions_);
    if (!dropped_.empty()) text += "; dropped: " + list(dropped_);
    if (not_there_.size() == 1)
        text += fmt::format("; the image {} does not exist", inQuotes(*not_there_.begin()));
    if (not_there_.size() > 1)
        text += fmt::format("; {} images do not exist, such as {}", not_there_.size(),
                            inQuotes(*not_there_.begin()));
    if (!unknown_.empty()) text += "; unknown: " + list(unknown_);
    if (!not_applied_.empty()) text += "; not applied: " + list(not_applied_);
    if (!unreadable_.empty()) text += "; not understood: " + list(unreadable_);
    return text;
}

MtlMaterial mapMtlMaterial(const MtlText& mtl, MtlColor color, MtlSummary& summary) {
    return MaterialMapper(mtl, color, summary).map();
}

}  // namespace crt
