// verify.html: the table of cases with what each asked and measured. One file, no script, readable on a
// phone and in dark mode.
#include "base/unit_text.h"
#include "judge/verify/report.h"

#include <fmt/format.h>

namespace crt::verify {
namespace {

constexpr const char* kHead = R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width,
initial-scale=1">
<title>{0}</title>
<style>
:root {{ color-scheme: light dark; --line: #d5d9df; --soft: #5b6470; --back: #ffffff; --ink: #16191d;
--band: #f4f6f8;
  --pass: #1a7f37; --fail: #c62828; --other: #8a6100; }}
@media (prefers-color-scheme: dark) {{ :root {{ --line: #343a42; --soft: #9aa4b0; --back: #14171a;
--ink: #e6e9ec; --band: #1d2126;
  --pass: #56c271; --fail: #ff7b72; --other: #e0b040; }} }}
body {{ font: 15px/1.5 system-ui, sans-serif; margin: 0 auto; padding: 1.5rem 1rem 4rem; max-width: 72rem;
background: var(--back); color: var(--ink); }}
h1 {{ font-size: 1.4rem; margin: 0 0 .3rem; }} h2 {{ font-size: 1.05rem; margin: 2rem 0 .4rem; }}
p.facts {{ color: var(--soft); margin: 0 0 1rem; }}
details {{ border-top: 1px solid var(--line); }}
details:last-of-type {{ border-bottom: 1px solid var(--line); }}
summary {{ display: grid; grid-template-columns: 3rem 1fr auto 5rem; gap: .75rem; padding: .45rem .25rem;
cursor: pointer; align-items: baseline; }}
summary:hover {{ background: var(--band); }} summary .t {{ text-align: right; color: var(--soft);
font-variant-numeric: tabular-nums; }}
.pass {{ color: var(--pass); }} .fail {{ color: var(--fail); font-weight: 600; }}
.other {{ color: var(--other); }}
.body {{ padding: .25rem .25rem 1rem 3.75rem; }} .body p {{ margin: .2rem 0; }}
.scroll {{ overflow-x: auto; }} table {{ border-collapse: collapse; width: 100%; margin-top: .6rem;
font-variant-numeric: tabular-nums; }}
th, td {{ text-align: left; padding: .3rem .6rem .3rem 0; vertical-align: top;
border-top: 1px solid var(--line); }} th {{ color: var(--soft); font-weight: 500; }}
.physics {{ color: var(--fail); }} .soft {{ color: var(--soft); }}
@media (max-width: 40rem) {{ summary {{ grid-template-columns: 2.6rem 1fr auto; }}
summary .t {{ display: none; }} .body {{ padding-left: .25rem; }} }}
</style></head><body>
)";

std::string escaped(const std::string& text) {
    std::string out;
    for (const char c : text) {
        switch (c) {
            case '&': out += "&amp;"; break;
            case '<': out += "&lt;"; break;
            case '>': out += "&gt;"; break;
            case '"': out += "&quot;"; break;
            default: out += c;
        }
    }
    return out;
}

const char* styleOf(Verdict verdict) {
    if (failed(verdict)) return "fail";
    return verdict == Verdict::Pass || verdict == Verdict::Refused ? "pass" : "other";
}

std::string outcomeRow(const Outcome& o) {
    std::string remark = escaped(o.note);
    if (!o.physics.empty())
        remark += fmt::format("{}<span class=\"physics\">{}</span>", remark.empty() ? "" : "<br>",
                              escaped(o.physics));
    return fmt::format(
        "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td class=\"{}\">{}</td><td>{}</td></tr>\n",
        escaped(o.what), o.expected ? fmt::format("{:.9g}", *o.expected) : "", measuredText(o),
        escaped(o.tolerance), styleOf(o.verdict), name(o.verdict), remark);
}

std::string caseHtml(const CaseResult& c) {
    std::string text = fmt::format(
        "<details{}><summary><b>{}</b><span>{} <span class=\"soft\">{}</span></span><span "
        "class=\"{}\">{}</span><span class=\"t\">{}</span></summary>\n",
        failed(c.verdict) ? " open" : "", c.which->id, escaped(c.which->title), c.which->name,
        styleOf(c.verdict), name(c.verdict), durationText(c.seconds));
    text += fmt::format(
        "<div class=\"body\"><p>Expected: {}</p><p class=\"soft\">Source: "
        "{}. Tolerance: {}. Level: {}.</p>\n",
        escaped(c.which->expected), escaped(c.which->source), escaped(c.which->tolerance),
        name(c.which->level));
    text +=
        "<div class=\"scroll\"><table><tr><th>Asked</th><th>Expected</th><th>Measured [99.9 "
        "%]</th><th>Tolerance</th><th>Verdict</th><th></th></tr>\n";
    for (const Outcome& o : c.outcomes) text += outcomeRow(o);
    return text + "</table></div></div></details>\n";
}

}  // namespace

std::string suiteHtml(const SuiteResult& suite) {
    const std::string title =
        fmt::format("crt verify: {} on {}, level {}", suite.passed() ? "passed" : "FAILED", suite.backend,
                    name(suite.level));
    std::string text = fmt::format(fmt::runtime(kHead), escaped(title));
    text += fmt::format(
        "<h1>{}</h1>\n<p class=\"facts\">{}. Device: {}. Backend {} {}, built with {}. crt {}.</p>\n",
        escaped(title), summaryText(suite), escaped(suite.device), escaped(suite.backend),
        escaped(suite.version), escaped(suite.build), CRT_VERSION);
    char group = 0;
    for (const CaseResult& c : suite.cases) {
        if (c.which->group() != group) {
            group = c.which->group();
            text += fmt::format("<h2>{} · {}</h2>\n", group, groupTitle(group));
        }
        text += caseHtml(c);
    }
    return text + "</body></html>\n";
}

}  // namespace crt::verify
