#include "spectra/data_catalogue.h"

#include "base/error.h"
#include "base/input_file.h"
#include "base/modules.h"
#include "spectra/spectra_data.h"
#include "spectra/spectrum_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <system_error>

namespace crt {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kExtension = ".csv";

/// "cornell/white" → {"cornell", "white"}; empty when a part would lead out of its folder or is none.
std::vector<std::string> partsOf(std::string_view name) {
    std::vector<std::string> parts;
    for (std::string_view rest = name; parts.size() < 4;) {
        const std::size_t length = std::min(rest.find('/'), rest.size());
        const std::string_view part = rest.substr(0, length);
        const auto fits = [](char c) {
            return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
                   c == '-' || c == '.';
        };
        if (part.empty() || part.front() == '.' || !std::all_of(part.begin(), part.end(), fits)) return {};
        parts.emplace_back(part);
        if (length == rest.size()) return parts;
        rest.remove_prefix(length + 1);
    }
    return {};
}

// ---- Built-in data

NamedData illuminant(const data::Illuminant& lamp) {
    NamedData row{.name = fmt::format("illuminants/{}", lamp.name),
                  .title = fmt::format("CIE illuminant {}; in a scene its luminance is 1", lamp.name),
                  .quantity = "relative spectral power",
                  .source = std::string(data::kIlluminantSource),
                  .outside = "zero",
                  .columns = {"power"},
                  .values = {{lamp.power.begin(), lamp.power.end()}}};
    for (std::size_t i = 0; i < lamp.power.size(); ++i)
        row.wavelength_nm.push_back(lamp.first_nm + static_cast<double>(i) * lamp.step_nm);
    return row;
}

NamedData glass(const data::Glass& glass) {
    constexpr int kShownStep_nm = 10;
    NamedData row{.name = fmt::format("glasses/{}", glass.name),
                  .title = std::string(glass.name),
                  .quantity = "refractive index",
                  .source = std::string(glass.source),
                  .outside = "formula",
                  .formula = fmt::format("n^2 = 1 + sum of B L^2 / (L^2 - C), L in um, B {}, C {} um^2",
                                         fmt::join(glass.B, ", "), fmt::join(glass.C_um2, ", ")),
                  .columns = {"n"},
                  .values = {{}}};
    const Spectrum n = sellmeierIndex(glass.B, glass.C_um2);
    for (int nm = kWavelengthMin_nm; nm <= kWavelengthMax_nm; nm += kShownStep_nm) {
        row.wavelength_nm.push_back(nm);
        row.values[0].push_back(n[static_cast<std::size_t>(nm - kWavelengthMin_nm)]);
    }
    return row;
}

std::vector<double> listOf(std::span<const double> values) { return {values.begin(), values.end()}; }

NamedData metal(const data::Metal& metal) {
    return {.name = fmt::format("metals/{}", metal.symbol),
            .title = fmt::format("{}; n + ik", metal.name),
            .quantity = "complex refractive index",
            .source = std::string(metal.source),
            .outside = "clamp",
            .wavelength_nm = listOf(metal.wavelength_nm),
            .columns = {"n", "k"},
            .values = {listOf(metal.n), listOf(metal.k)}};
}

std::optional<NamedData> builtIn(const std::string& family, const std::string& name) {
    if (family == "illuminants")
        for (const data::Illuminant& lamp : data::kIlluminants)
            if (lamp.name == name) return illuminant(lamp);
    if (family == "glasses")
        for (const data::Glass& row : data::kGlasses)
            if (row.name == name) return glass(row);
    if (family == "metals")
        for (const data::Metal& row : data::kMetals)
            if (row.symbol == name || row.name == name) return metal(row);
    return std::nullopt;
}

bool isBuiltInFamily(const std::string& family) {
    return family == "illuminants" || family == "glasses" || family == "metals";
}

std::vector<std::string> builtInNames() {
    std::vector<std::string> names;
    for (const data::Illuminant& lamp : data::kIlluminants)
        names.push_back(fmt::format("illuminants/{}", lamp.name));
    for (const data::Glass& glass : data::kGlasses) names.push_back(fmt::format("glasses/{}", glass.name));
    for (const data::Metal& metal : data::kMetals) names.push_back(fmt::format("metals/{}", metal.symbol));
    return names;
}

// ---- Data in files

/// Of the first folder that has it; empty when none has.
std::string fileOf(const std::string& family, const std::string& name) {
    std::error_code unknown;
    for (const std::string& folder : dataDirectories()) {
        const fs::path path = fs::path(folder) / family / (name + std::string(kExtension));
        if (fs::exists(path, unknown)) return plainPath(path);
    }
    return {};
}

std::vector<std::string> namesInFiles() {
    constexpr std::size_t kMost =
        100'000;  // A folder that is no folder of data must not be walked for ever.
    std::vector<std::string> names;
    std::error_code unknown;
    for (const std::string& folder : dataDirectories())
        for (fs::directory_iterator family(folder, unknown), end; !unknown && family != end;
             family.increment(unknown)) {
            std::error_code inner;
            for (fs::directory_iterator file(family->path(), inner), last; !inner && file != last;
                 file.increment(inner)) {
                if (file->path().extension() != kExtension || names.size() >= kMost) continue;
                std::string name =
                    family->path().filename().string() + "/" + file->path().stem().string();
                if (partsOf(name).size() == 2 && !isBuiltInFamily(family->path().filename().string()))
                    names.push_back(std::move(name));
            }
        }
    return names;
}

/// The comment lines at the beginning, each without its '#' and the blanks around it. A line that begins
/// with two blanks or more continues the one before it.
std::vector<std::string> headerLines(std::string_view text) {
    std::vector<std::string> lines;
    while (text.starts_with('#')) {
        const std::size_t length = std::min(text.find('\n'), text.size());
        std::string_view line = text.substr(1, length - 1);
        const bool continues = line.starts_with("  ") && !lines.empty();
        while (line.starts_with(' ')) line.remove_prefix(1);
        while (line.ends_with('\r') || line.ends_with(' ')) line.remove_suffix(1);
        if (continues)
            lines.back().append(" ").append(line);
        else
            lines.emplace_back(line);
        text.remove_prefix(std::min(length + 1, text.size()));
    }
    return lines;
}

/// The value in "key: value"; empty where no line has it.
std::string headerValue(const std::vector<std::string>& lines, std::string_view key) {
    for (const std::string_view line : lines)
        if (line.starts_with(key) && line.substr(key.size()).starts_with(": "))
            return std::string(line.substr(key.size() + 2));
    return {};
}

NamedData readData(const std::string& name, const std::string& file) {
    std::string text;
    try {
        text = readInput(file, kMostSpectrumBytes);
    } catch (const InputRefused& refused) {
        throw Error(ErrorKind::Scene, fmt::format("the data file '{}' {}", file, refused.what()), {file});
    }
    const std::vector<std::string> header = headerLines(text);
    NamedData row{.name = name,
                  .title = header.empty() ? "" : header.front(),
                  .quantity = headerValue(header, "quantity"),
                  .source = headerValue(header, "source"),
                  .outside = headerValue(header, "outside"),
                  .file = file};
    for (const auto& [key, value] : {std::pair{"source", &row.source}, {"quantity", &row.quantity}})
        if (value->empty())
            throw Error(ErrorKind::Scene,
                        fmt::format("the data file '{}' has no line '# {}: …' at its beginning", file,
                                     key),
                        {file});
    if (row.outside != "clamp" && row.outside != "zero")
        throw Error(
            ErrorKind::Scene,
            fmt::format("the data file '{}' has no line '# outside: clamp' "
                        "or '# outside: zero' at its beginning",
                        file),
            {file});
    SampledSpectrum table = readSpectrumTable(file);
    row.wavelength_nm = std::move(table.wavelength_nm);
    row.columns = {row.quantity};
    row.values = {std::move(table.value)};
    return row;
}

}  // namespace

std::vector<std::string> dataNames() {
    std::set<std::string> names;
    for (std::string& name : builtInNames()) names.insert(std::move(name));
    for (std::string& name : namesInFiles()) names.insert(std::move(name));
    return {names.begin(), names.end()};
}

std::vector<std::string> dataSpectrumNames() {
    std::vector<std::string> names;
    for (const std::string& name : dataNames()) {
        if (name.starts_with("metals/")) {
            names.push_back(name + "/n");
            names.push_back(name + "/k");
        } else {
            names.push_back(name);
        }
    }
    return names;
}

std::optional<NamedData> findData(std::string_view name) {
    const std::vector<std::string> parts = partsOf(name);
    if (parts.size() != 2) return std::nullopt;
    if (isBuiltInFamily(parts[0])) return builtIn(parts[0], parts[1]);
    const std::string file = fileOf(parts[0], parts[1]);
    if (file.empty()) return std::nullopt;
    return readData(std::string(name), file);
}

std::optional<NamedSpectrum> dataSpectrum(std::string_view name) {
    const std::vector<std::string> parts = partsOf(name);
    if (parts.size() == 3 && parts[0] == "metals" && (parts[2] == "n" || parts[2] == "k")) {
        const auto index = metalIndex(parts[1]);
        if (!index) return std::nullopt;
        return NamedSpectrum{parts[2] == "n" ? index->first : index->second, {}};
    }
    if (parts.size() != 2) return std::nullopt;
    std::optional<Spectrum> spectrum;
    if (parts[0] == "illuminants") spectrum = illuminantSpectrum(parts[1]);
    if (parts[0] == "glasses") spectrum = glassIndex(parts[1]);
    if (spectrum) return NamedSpectrum{*std::move(spectrum), {}};
    if (isBuiltInFamily(parts[0])) return std::nullopt;
    const std::optional<NamedData> row = findData(name);
    if (!row) return std::nullopt;
    const Outside outside = row->outside == "zero" ? Outside::Zero : Outside::Clamp;
    return NamedSpectrum{readSpectrumFile(row->file, outside), row->file};
}

}  // namespace crt
