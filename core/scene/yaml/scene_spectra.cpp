#include "scene/yaml/scene_spectra.h"

#include "base/log.h"
#include "base/modules.h"
#include "scene/yaml/scene_hints.h"
#include "spectra/data_catalogue.h"
#include "spectra/spectrum_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace crt {
Spectrum scaled(Spectrum spectrum, double factor) {
    for (double& value : spectrum.values) value *= factor;
    return spectrum;
}

namespace {

/// Limit of the length of a chain of named spectra.
constexpr std::size_t kDeepestSpectrum = 64;

bool takesColors(SpectrumUse use) { return use != SpectrumUse::Index && use != SpectrumUse::Response; }

/// The wavelength where a spectrum is worst: first where it is not finite, else farthest outside `range`.
std::optional<std::size_t> worstWavelength(const Spectrum& spectrum, const ValueRange& range) {
    std::optional<std::size_t> worst;
    double worst_excess = -1;
    for (std::size_t i = 0; i < spectrum.values.size(); ++i) {
        const double v = spectrum[i];
        if (!std::isfinite(v)) return i;
        if (range.contains(v)) continue;
        const double excess = v > range.max ? v - range.max : range.min - v;
        if (excess > worst_excess) worst = i, worst_excess = excess;
    }
    return worst;
}

std::string outsideQuestion(double first_nm, double last_nm) {
    return fmt::format(
        "the data go from {} to {} nm and crt renders {} to {} nm; add 'outside: clamp' or 'outside: zero'",
        first_nm, last_nm, kWavelengthMin_nm, kWavelengthMax_nm);
}

}  // namespace

SpectrumReader::SpectrumReader(Diagnostics& out, SceneFiles& files, const YamlNode* named)
    : out_(out), files_(files), named_(named) {
    if (named_ == nullptr) return;
    for (const YamlEntry& entry : named_->entries) {
        entry_of_.emplace(entry.key, &entry);
        if (looksLikeNumber(entry.key) || entry.key.empty())
            out_.error(entry.key_place,
                       fmt::format("'{}' cannot be the name of a spectrum: it would be read as a number",
                                   entry.key));
    }
}

std::optional<Spectrum> SpectrumReader::read(const SectionReader& section, std::string_view key,
                                             SpectrumUse use) {
    const YamlEntry* entry = section.find(key);
    if (entry == nullptr) return std::nullopt;
    return read(*entry->value, entry->place, fmt::format("'{}' of {}", key, section.subject()),
                section.schema().find(key)->range, use);
}

std::optional<Spectrum> SpectrumReader::read(const YamlNode& node, const YamlPlace& place,
                                             const std::string& what, const ValueRange& range,
                                             SpectrumUse use) {
    std::optional<Spectrum> spectrum = resolve(node, place, what, use);
    if (!spectrum) return std::nullopt;
    const std::optional<std::size_t> worst = worstWavelength(*spectrum, range);
    if (!worst) return spectrum;
    const double value = (*spectrum)[*worst];
    const std::string where = spectrum->isConstant()
                                  ? std::string()
                                  : fmt::format(" at {} nm", kWavelengthMin_nm + static_cast<int>(*worst));
    const std::string extreme = value > range.max && !spectrum->isConstant() ? "reaches" : "is";
    out_.error(place, fmt::format("{} {} {}{}; it must be {}", what, extreme, value, where,
                                         std::isfinite(value) ? range.text() : "finite"));
    return std::nullopt;
}

void SpectrumReader::finish() {
    if (named_ == nullptr) return;
    UnusedNames unused("spectrum", "spectra");
    for (const YamlEntry& entry : named_->entries) {
        if (used_.contains(entry.key)) continue;
        const std::size_t before = out_.count();
        resolve(*entry.value, entry.place, fmt::format("spectrum '{}'", entry.key), SpectrumUse::Emission);
        if (out_.count() == before) unused.add(entry.key, entry.key_place);
    }
    unused.finish();
}

std::map<std::string, Vec3d> SpectrumReader::whites() const {
    std::map<std::string, Vec3d> whites;
    for (const auto& [key, spectrum] : resolved_) {
        if (!spectrum || (key.second != SpectrumUse::Emission && key.second != SpectrumUse::White)) continue;
        const Vec3d xyz = spectrumToXyz(*spectrum);
        if (xyz[1] > 0) whites[key.first] = {xyz[0] / xyz[1], 1, xyz[2] / xyz[1]};
    }
    return whites;
}

std::optional<Spectrum> SpectrumReader::resolve(const YamlNode& node, const YamlPlace& place,
                                                const std::string& what, SpectrumUse use) {
    if (node.kind == YamlKind::Map) {
        const std::optional<SectionReader> form = openVariant(out_, node, place, "spectrum", what);
        if (!form) return std::nullopt;
        double scale = 1;
        form->read("scale", scale);
        std::optional<Spectrum> spectrum = resolveForm(*form, use);
        return spectrum ? scaled(*std::move(spectrum), scale) : spectrum;
    }
    if (node.kind != YamlKind::Scalar) {
        expected(out_, place, "a number, the name of a spectrum or a map", what, node,
                 takesColors(use) ? hintOfColor(node, place) : "");
        return std::nullopt;
    }
    if (!node.quoted && looksLikeNumber(node.text)) {
        double value = 0;
        const KeySchema any{.name = "spectrum", .kind = ValueKind::Number};
        if (!readScalar(out_, node, place, any, what, value)) return std::nullopt;
        const auto [known, fresh] = constants_.try_emplace(value);
        if (fresh) known->second = constantSpectrum(value);
        return known->second;
    }
    return resolveName(node.text, place, use);
}

std::optional<Spectrum> SpectrumReader::resolveName(const std::string& name, const YamlPlace& place,
                                                    SpectrumUse use) {
    const auto found = entry_of_.find(name);
    const YamlEntry* entry = found != entry_of_.end() ? found->second : nullptr;
    if (entry == nullptr) {
        if (use == SpectrumUse::White)
            if (std::optional<Spectrum> illuminant = illuminantSpectrum(name)) return illuminant;
        const bool takes_illuminants = use == SpectrumUse::White;
        std::string suggestion;
        // Asked before they are listed: a list of all names takes longer than an error.
        if (out_.worthSuggesting(entry_of_.size() + (takes_illuminants ? illuminantNames().size() : 0))) {
            std::vector<std::string> known;
            if (named_ != nullptr)
                for (const YamlEntry& e : named_->entries) known.push_back(e.key);
            if (takes_illuminants)
                known.insert(known.end(), illuminantNames().begin(), illuminantNames().end());
            suggestion = didYouMean(name, known);
        }
        if (suggestion.empty() && illuminantSpectrum(name))
            suggestion = fmt::format("write {{illuminant: {}}}", name);
        if (suggestion.empty() && glassIndex(name)) suggestion = fmt::format("write {{glass: {}}}", name);
        if (suggestion.empty() && takesColors(use)) suggestion = hintOfColorName(name);
        out_.error(place, fmt::format("there is no spectrum '{}'", name), suggestion);
        return std::nullopt;
    }
    used_.insert(name);
    if (open_.contains(name)) {
        out_.error(place, fmt::format("spectrum '{}' is defined by itself", name));
        return std::nullopt;
    }
    const auto known = resolved_.find({name, use});
    if (known != resolved_.end()) return known->second;
    if (open_.size() >= kDeepestSpectrum) {
        out_.error(place, fmt::format("spectrum '{}' is the {}th in a chain of references to other spectra: "
                                      "a chain may have {}",
                                      name, kDeepestSpectrum + 1, kDeepestSpectrum));
        return std::nullopt;
    }
    open_.insert(name);
    std::optional<Spectrum> spectrum =
        resolve(*entry->value, entry->place, fmt::format("spectrum '{}'", name), use);
    open_.erase(name);
    return resolved_[{name, use}] = std::move(spectrum);
}

std::optional<Spectrum> SpectrumReader::resolveForm(const SectionReader& form, SpectrumUse use) {
    const std::string word = variantWord(form.schema());
    std::string name;
    try {
        if (word == "table") return table(form);
        if (word == "file") return file(form);
        if (word == "rgb") return rgb(form, use);
        if (word == "sellmeier") return sellmeier(form);
        if (word == "data") return data(form);
        if (word == "blackbody") {
            double temperature_K = 0;
            bool normalise = true;
            form.read("normalise", normalise);
            if (form.read("blackbody", temperature_K)) return blackbodySpectrum(temperature_K, normalise);
        } else if (word == "cauchy") {
            std::vector<double> coefficients;
            if (form.read("cauchy", coefficients)) return cauchyIndex(coefficients);
        } else if (word == "illuminant") {
            if (form.readWord("illuminant", name)) return illuminantSpectrum(name);
        } else if (word == "glass") {
            if (form.readWord("glass", name)) return glassIndex(name);
        } else if (word == "ref") {
            if (form.read("ref", name)) return resolveName(name, form.place("ref"), use);
        }
    } catch (
        const Error& e) {  // Errors of the spectrum's maths, which does not know the place in the scene.
        if (e.kind() == ErrorKind::Internal) throw;
        form.error(word, sentenceWithPlace(e));
    }
    return std::nullopt;
}

std::optional<Spectrum> SpectrumReader::table(const SectionReader& form) {
    const std::optional<SectionReader> columns = form.section("table", "the table");
    Outside outside = Outside::Error;
    const bool said = form.readEnum("outside", outside);
    std::vector<double> nm, value;
    const bool have_nm = columns->read("nm", nm), have_value = columns->read("value", value);
    if (!have_nm || !have_value) return std::nullopt;

    if (nm.size() != value.size()) {
        columns->error("value",
                       fmt::format("the table has {} wavelengths but {} values", nm.size(), value.size()));
        return std::nullopt;
    }
    for (std::size_t i = 1; i < nm.size(); ++i) {
        if (nm[i] > nm[i - 1]) continue;
        out_.error(columns->list("nm")->items[i]->place,
                   fmt::format("wavelengths must increase, but {} nm follows {} nm", nm[i], nm[i - 1]));
        return std::nullopt;
    }
    if (const std::string why = refusalOfUnit(nm.front(), nm.back()); !why.empty()) {
        columns->error("nm", why);
        return std::nullopt;
    }
    const bool covered = nm.front() <= kWavelengthMin_nm && nm.back() >= kWavelengthMax_nm;
    if (outside == Outside::Error && !covered) {
        if (!form.has("outside") || said)
            form.error(said ? "outside" : "table", outsideQuestion(nm.front(), nm.back()));
        return std::nullopt;
    }
    return tableSpectrum(nm, value, outside);
}

std::optional<Spectrum> SpectrumReader::file(const SectionReader& form) {
    std::string name;
    Outside outside = Outside::Error;
    const bool outside_wrong = form.has("outside") && !form.readEnum("outside", outside);
    if (!form.read("file", name)) return std::nullopt;
    const std::optional<std::string> path = files_.locate(name, form.place("file"), out_);
    if (!path) return std::nullopt;
    files_.note(*path);
    if (outside != Outside::Error) return readSpectrumFile(*path, outside);
    // Read first without a requirement beyond the data, which distinguishes a broken file from one that is
    // only too short.
    const Spectrum clamped = readSpectrumFile(*path, Outside::Clamp);
    if (outside_wrong) return clamped;
    try {
        return readSpectrumFile(*path, Outside::Error);
    } catch (const Error& e) {
        form.error(form.has("outside") ? "outside" : "file", sentenceWithPlace(e),
                   "add 'outside: clamp' or 'outside: zero'");
        return std::nullopt;
    }
}

std::optional<Spectrum> SpectrumReader::rgb(const SectionReader& form, SpectrumUse use) {
    Vec3d color{};
    bool linear = false;
    form.readEnum("space", linear);  // The choices are srgb and linear.
    if (!form.read("rgb", color)) return std::nullopt;
    if (use == SpectrumUse::Index) {
        form.error("rgb",
                   "a refractive index is not a colour; give a number, a table, a glass, or cauchy or "
                   "sellmeier coefficients");
        return std::nullopt;
    }
    if (use == SpectrumUse::Response) {
        form.error("rgb", "a sensor's response is not a colour; give a table, a file or named data");
        return std::nullopt;
    }
    const double brightest = *std::max_element(color.begin(), color.end());
    if (brightest > 1 && use == SpectrumUse::Absorption) {
        form.error("rgb", fmt::format("a component of this absorption is {}, beyond 1", brightest),
                   "divide all three, and give the factor as 'scale'");
        return std::nullopt;
    }
    if (brightest > 1 && (!linear || use == SpectrumUse::Reflectance)) {
        form.error("rgb",
                   fmt::format("a component of this colour is {}; {}", brightest,
                               use == SpectrumUse::Reflectance ? "a reflectance must be 0 to 1"
                                                               : "an sRGB-encoded colour must be 0 to 1"),
                   use == SpectrumUse::Reflectance ? "" : "add 'space: linear', or 'scale'");
        return std::nullopt;
    }
    if (!linear)
        for (double& component : color) component = srgbToLinear(component);
    // Found by a fit, a third of a millisecond each; palettes repeat their colours.
    const bool reflects = use == SpectrumUse::Reflectance || use == SpectrumUse::Absorption;
    const auto known = colors_.find({color, reflects});
    if (known != colors_.end()) return known->second;
    return colors_[{color, reflects}] = reflects ? rgbReflectance(color) : rgbEmission(color);
}

std::optional<Spectrum> SpectrumReader::sellmeier(const SectionReader& form) {
    const std::optional<SectionReader> coefficients =
        form.section("sellmeier", "the Sellmeier coefficients");
    Vec3d B{}, C_um2{};
    const bool have_B = coefficients->read("B", B), have_C = coefficients->read("C", C_um2);
    if (!have_B || !have_C) return std::nullopt;
    return sellmeierIndex(B, C_um2);
}

std::optional<Spectrum> SpectrumReader::data(const SectionReader& form) {
    std::string name;
    if (!form.read("data", name)) return std::nullopt;
    if (std::optional<NamedSpectrum> found = dataSpectrum(name)) {
        if (!found->file.empty()) files_.note(found->file);
        return std::move(found->spectrum);
    }
    const std::vector<std::string> known = dataSpectrumNames();
    const bool has_columns = std::find(known.begin(), known.end(), name + "/n") != known.end();
    form.error("data", fmt::format("there is no data set '{}'", name),
               has_columns                             ? fmt::format("write {0}/n or {0}/k", name)
               : out_.worthSuggesting(known.size()) ? didYouMean(name, known)
                                                       : "",
               fmt::format("'crt data' lists all data sets, here and in {}",
                           fmt::join(dataDirectories(), ", ")));
    return std::nullopt;
}

}  // namespace crt
