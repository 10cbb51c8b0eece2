#include "verify/report.h"

#include "base/unit_text.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cmath>

namespace crt::verify {
namespace {

using Json = nlohmann::ordered_json;

std::string figure(double value) { return fmt::format("{:.9g}", value); }

/// "0.23946 [0.23941, 0.23951]", or nothing.
std::string measuredText(const Outcome& o) {
    if (!o.measured) return "";
    std::string text = figure(*o.measured);
    if (o.interval) text += fmt::format(" [{:.7g}, {:.7g}]", o.interval->lower, o.interval->upper);
    return text;
}

/// The text of a failed outcome, in the two or three lines under its case.
std::string failureText(const Outcome& o) {
    std::string text = fmt::format("       {}: {}", name(o.verdict), o.what);
    if (o.measured && o.expected)
        text += fmt::format(": measured {}, expected {}", measuredText(o), figure(*o.expected));
    text += fmt::format(" ({})\n", o.tolerance);
    if (!o.note.empty()) text += fmt::format("       {}\n", o.note);
    if (!o.physics.empty()) text += fmt::format("       → {}\n", o.physics);
    return text;
}

/// JSON has neither infinity nor NaN.
Json number(const std::optional<double>& value) {
    return value && std::isfinite(*value) ? Json(*value) : Json(nullptr);
}

}  // namespace

std::string caseText(const CaseResult& result, bool colored) {
    const bool bad = failed(result.verdict);
    const char* color =
        !colored ? "" : (bad ? "\033[1;31m" : (result.verdict == Verdict::Pass ? "\033[32m" : "\033[33m"));
    std::string text =
        fmt::format("  {:<4} {:<26} {}{:<22}{} {:>8}\n", result.which->id, result.which->name, color,
                    name(result.verdict), colored ? "\033[0m" : "", durationText(result.seconds));
    for (const Outcome& o : result.outcomes) {
        if (failed(o.verdict)) text += failureText(o);
        if (o.verdict == Verdict::NotApplicable)
            text += fmt::format("       {}: not asked: {}\n", o.what, o.note);
    }
    return text;
}

std::string summaryText(const SuiteResult& suite) {
    std::string text;
    for (const Verdict v :
         {Verdict::Pass, Verdict::NotApplicable, Verdict::Inconclusive, Verdict::Fail})
        if (const std::size_t n = suite.count(v); n > 0)
            text += fmt::format("{}{} {}", text.empty() ? "" : ", ", n, name(v));
    if (suite.cases.size() < suite.asked)
        text += fmt::format("{}{} not run", text.empty() ? "" : ", ", suite.asked - suite.cases.size());
    return fmt::format("{} in {}", text, durationText(suite.seconds));
}

std::string suiteJson(const SuiteResult& suite) {
    Json json;
    json["format"] = "crt verify 1";
    json["crt"] = {{"version", CRT_VERSION}};
    json["backend"] = {{"name", suite.backend},
                       {"version", suite.version},
                       {"build", suite.build},
                       {"device", suite.device}};
    json["level"] = name(suite.level);
    json["seconds"] = suite.seconds;
    json["passed"] = suite.passed();
    json["asked"] = suite.asked;
    json["interrupted"] = suite.request.has_value();
    json["confidence"] = kConfidence;
    Json cases = Json::array();
    for (const CaseResult& c : suite.cases) {
        Json outcomes = Json::array();
        for (const Outcome& o : c.outcomes) {
            Json item{{"what", o.what},
                      {"verdict", name(o.verdict)},
                      {"expected", number(o.expected)},
                      {"measured", number(o.measured)}};
            if (o.interval) item["interval"] = {number(o.interval->lower), number(o.interval->upper)};
            item["tolerance"] = o.tolerance;
            if (!o.note.empty()) item["note"] = o.note;
            if (!o.physics.empty()) item["physics"] = o.physics;
            outcomes.push_back(std::move(item));
        }
        cases.push_back({{"id", c.which->id},
                         {"name", c.which->name},
                         {"group", groupTitle(c.which->group())},
                         {"title", c.which->title},
                         {"expected", c.which->expected},
                         {"source", c.which->source},
                         {"tolerance", c.which->tolerance},
                         {"level", name(c.which->level)},
                         {"verdict", name(c.verdict)},
                         {"seconds", c.seconds},
                         {"outcomes", std::move(outcomes)}});
    }
    json["cases"] = std::move(cases);
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string listText(const std::vector<const Case*>& cases) {
    std::string text;
    char group = 0;
    for (const Case* c : cases) {
        if (c->group() != group) {
            group = c->group();
            text += fmt::format("{}{}  {}\n", text.empty() ? "" : "\n", group, groupTitle(group));
        }
        text += fmt::format("  {:<4} {:<26} {:<8} {}\n", c->id, c->name, name(c->level), c->title);
    }
    return text;
}

}  // namespace crt::verify
