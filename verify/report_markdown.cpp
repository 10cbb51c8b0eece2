// docs/stability.md: the registry as a manual page, so that the page and the tests cannot differ.
#include "verify/report.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace crt::verify {
namespace {

/// {}: the number of cases that level merge adds.
constexpr const char* kPreamble = R"(# Stability: the cases of crt verify

<!-- Generated from the registry in verify/. Change it there, then run
     crt verify --markdown --figures cuda/verify.json --figures embree/verify.json \
         --figures opencl/verify.json > docs/stability.md -->

`crt verify` renders scenes with known answers and reports whether the backend finds them. It takes any
backend, including those that are not part of crt:

    crt verify --backend mine --plugin-path build --level merge -o report

An estimated figure passes if its 99.9 % interval lies within the tolerance and fails if it lies outside. If
the interval is too wide to decide, the case is inconclusive, which counts as failing. Exit code 7 says that
something failed. Level `commit` runs on every commit of crt. Level `merge` adds {} cases and enlarges
others; `nightly` enlarges more.

Deviations are relative to the expected value; where that is 0, they are absolute. A row can have several
answers with different tolerances. Its figure is the largest deviation of any of them, which can exceed the
smallest tolerance. A tolerance may be absolute where the deviation is relative, as in G28 and H13. "–":
not measured at this level. "Not applicable": the machine or program lacks something that the case needs;
`verify.json` has the reason.
)";

std::string cell(const std::string& text) {
    std::string out;
    for (const char c : text) out += c == '|' ? std::string("\\|") : std::string(1, c);
    return out;
}

/// Of the outcome with the largest deviation relative to what was expected: "worst 3.1e-7".
std::string figureOf(const nlohmann::json& result) {
    double deviation = -1;
    for (const nlohmann::json& o : result.at("outcomes")) {
        if (!o.at("expected").is_number() || !o.at("measured").is_number()) continue;
        const double expected = o.at("expected"), measured = o.at("measured");
        const double d = std::abs(measured - expected) / (expected == 0 ? 1 : std::abs(expected));
        deviation = std::max(deviation, d);
    }
    std::string text = result.at("verdict");
    if (deviation == 0) text += ", exact";
    if (deviation > 0) text += fmt::format(", {:.1e} off", deviation);
    return text;
}

}  // namespace

std::string markdownRow(const Case& c) {
    return fmt::format("| {} `{}` | {} | {} | {} | {} | {} |", c.id, c.name, cell(c.title), cell(c.expected),
                       cell(c.source), cell(c.tolerance), name(c.level));
}

std::string registryMarkdown(const std::vector<std::string>& suites) {
    const auto merged = std::count_if(registry().begin(), registry().end(),
                                      [](const Case& c) { return c.level == Level::Merge; });
    std::string text = fmt::format(fmt::runtime(kPreamble), merged);
    std::vector<std::string> backends;
    std::map<std::pair<std::string, std::string>, std::string> figures;
    for (const std::string& suite : suites) {
        const nlohmann::json json = nlohmann::json::parse(suite);
        const std::string backend = json.at("backend").at("name");
        if (std::find(backends.begin(), backends.end(), backend) == backends.end()) {
            backends.push_back(backend);
            text += fmt::format(
                "\nFigures of {}: level {}, {}, crt {}; the largest deviation "
                "of a case's answers from what is expected.\n",
                backend, json.at("level").get<std::string>(),
                json.at("backend").at("device").get<std::string>(),
                json.at("crt").at("version").get<std::string>());
        }
        for (const nlohmann::json& c : json.at("cases")) figures[{backend, c.at("id")}] = figureOf(c);
    }
    char group = 0;
    for (const Case& c : registry()) {
        if (c.group() != group) {
            group = c.group();
            text += fmt::format("\n## {}: {}\n\n| | quantity | expected | source | tolerance | level |",
                                group, groupTitle(group));
            for (const std::string& b : backends) text += fmt::format(" {} |", b);
            text += "\n|---|---|---|---|---|---|";
            for (std::size_t i = 0; i < backends.size(); ++i) text += "---|";
            text += "\n";
        }
        text += markdownRow(c);
        for (const std::string& b : backends)
            text += fmt::format(" {} |", figures.count({b, c.id}) != 0 ? figures[{b, c.id}] : "–");
        text += "\n";
    }
    return text;
}

}  // namespace crt::verify
