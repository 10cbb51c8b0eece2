#include "base/error.h"
#include "base/standard_output.h"
#include "base/words.h"
#include "cli/commands.h"
#include "spectra/data_catalogue.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <memory>
#include <string>
#include <vector>

namespace crt {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kDataNotes = R"(
In a scene, in place of any spectrum:
  reflectance: {data: cornell/white}
  ior: {data: glasses/SF10}
  radiance: {data: illuminants/D65, scale: 10}
  {type: conductor, eta: {data: metals/Au/n}, k: {data: metals/Au/k}}

Further families are folders of CSV files with the same header, in a folder of CRT_DATA_PATH:
  crt data paints/foliage > mine/paints/meadow.csv          and then edit it
  CRT_DATA_PATH=mine crt scene.yaml                         with {data: paints/meadow}
)";

NamedData rowOf(const std::string& name) {
    if (std::optional<NamedData> row = findData(name)) return *std::move(row);
    const std::vector<std::string> names = dataNames();
    const std::string hint = didYouMean(name, names);
    throw Error(ErrorKind::Usage,
                fmt::format("there is no data set '{}'; {}", name,
                            hint.empty() ? "'crt data' lists all data sets" : hint));
}

std::string rangeText(const NamedData& row) {
    return fmt::format("{:.0f} to {:.0f} nm", row.wavelength_nm.front(), row.wavelength_nm.back());
}

Json jsonOf(const NamedData& row, bool with_table) {
    Json json{{"name", row.name},
              {"title", row.title},
              {"quantity", row.quantity},
              {"source", row.source},
              {"outside", row.outside},
              {"formula", row.formula.empty() ? Json() : Json(row.formula)},
              {"file", row.file.empty() ? Json() : Json(row.file)},
              {"columns", row.columns},
              {"first_nm", row.wavelength_nm.front()},
              {"last_nm", row.wavelength_nm.back()}};
    if (!with_table) return json;
    json["wavelength_nm"] = row.wavelength_nm;
    for (std::size_t column = 0; column < row.columns.size(); ++column)
        json["values"][row.columns[column]] = row.values[column];
    return json;
}

void printJson(const Json& json) {
    printOut("{}\n", json.dump(2, ' ', false, Json::error_handler_t::replace));
}

/// By families; a source that several rows have stands once, below the last of them.
void list() {
    std::string family, source;
    const auto endGroup = [&source] {
        if (!source.empty()) printOut("      source: {}\n", source);
        source.clear();
    };
    for (const std::string& name : dataNames()) {
        const NamedData row = rowOf(name);
        if (row.source != source) endGroup();
        if (const std::string of = name.substr(0, name.find('/')); of != family) {
            endGroup();
            printOut("{}{}\n", family.empty() ? "" : "\n", of);
            family = of;
        }
        source = row.source;
        printOut("  {:<24} {}, {}: {}\n", name, row.quantity, rangeText(row), row.title);
    }
    endGroup();
}

Json listJson() {
    Json rows = Json::array();
    for (const std::string& name : dataNames()) rows.push_back(jsonOf(rowOf(name), false));
    return {{"data", std::move(rows)}};
}

/// As a file that crt reads, where there is one column.
void print(const NamedData& row) {
    printOut("# {}\n# source: {}\n# quantity: {}\n# outside: {}\n", row.title, row.source, row.quantity,
             row.outside);
    if (!row.formula.empty()) printOut("# formula: {}\n", row.formula);
    printOut("wavelength_nm,{}\n", fmt::join(row.columns, ","));
    for (std::size_t i = 0; i < row.wavelength_nm.size(); ++i) {
        std::string line = fmt::format("{}", row.wavelength_nm[i]);
        for (const std::vector<double>& column : row.values) line += fmt::format(",{}", column[i]);
        printOut("{}\n", line);
    }
}

int show(const std::string& name, bool json) {
    if (name.empty()) {
        if (json)
            printJson(listJson());
        else
            list();
    } else if (json) {
        printJson(jsonOf(rowOf(name), true));
    } else {
        print(rowOf(name));
    }
    return 0;
}

}  // namespace

Command dataCommand() {
    struct State {
        std::string name;
        bool json = false;
    };
    const auto state = std::make_shared<State>();
    return {.name = "data",
            .summary = "list the measured spectra that come with crt, or print one",
            .arguments = {{.name = "NAME",
                           .help = "name of a spectrum, such as cornell/white",
                           .read = [state](const std::string& text) { state->name = text; },
                           .completion = {Completion::Kind::Data},
                           .required = false}},
            .groups = {{"Options",
                        {{.names = "--json",
                          .placeholder = {},
                          .help = "the same as JSON",
                          .read = [state](const std::string&) { state->json = true; }}}}},
            .notes = kDataNotes,
            .run = [state](const std::string&) { return show(state->name, state->json); }};
}

}  // namespace crt
