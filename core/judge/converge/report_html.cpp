// Over 450 lines: the parts of one page, in the order in which they are read.
#include "film/error_text.h"
#include "judge/converge/report_html.h"

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/log.h"
#include "base/unit_text.h"
#include "film/luminance_error.h"
#include "judge/converge/files.h"
#include "judge/converge/findings.h"
#include "judge/converge/quantity_text.h"
#include "judge/converge/report_figures.h"
#include "judge/converge/report_maps.h"
#include "judge/converge/report_style.h"
#include "judge/converge/svg_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

namespace crt::converge {
namespace {

std::string h(const std::string& text) { return escapeXml(text); }

/// A finding's text without breaks between a number and its unit, or within an interval.
std::string sentence(const std::string& text) {
    std::string html = h(text);
    for (std::size_t at = html.find("–"); at != std::string::npos; at = html.find("–", at + 9))
        html.replace(at, 3, "\u2060–\u2060");
    for (const char* unit : {" %", " s", " ms", " µs", " min"})
        for (std::size_t at = html.find(unit); at != std::string::npos; at = html.find(unit, at + 1))
            if (at > 0 && html[at - 1] >= '0' && html[at - 1] <= '9') html.replace(at, 1, "\u00a0");
    return html;
}

const char* toneClass(Tone tone) {
    switch (tone) {
        case Tone::Good: return "good";
        case Tone::Warning: return "warning";
        case Tone::Bad: return "bad";
        case Tone::Neutral: break;
    }
    return "neutral";
}

// --------------------------------------------------------------------------------------------------- tables

/// The value, and under it its interval.
std::string withInterval(const std::string& text) {
    const std::size_t bracket = text.find(" (");
    if (bracket == std::string::npos) return h(text);
    return h(text.substr(0, bracket)) + "<span class=\"ci\">" +
           h(text.substr(bracket + 2, text.size() - bracket - 3)) + "</span>";
}

/// A cell that says its column's name when the table is shown as cards.
std::string cell(const std::string& label, const std::string& html, const char* css_class = "num") {
    return fmt::format("<td class=\"{}\" data-label=\"{}\"><span>{}</span></td>", css_class, h(label), html);
}

std::string tableOf(const std::vector<std::pair<std::string, const char*>>& columns,
                    const std::string& rows) {
    std::string head;
    for (const auto& [name, css_class] : columns)
        head += fmt::format("<th scope=\"col\" class=\"{}\">{}</th>", css_class, h(name));
    return "<div class=\"tablebox\"><table class=\"cards\"><thead><tr>" + head + "</tr></thead>\n<tbody>\n" +
           rows + "</tbody></table></div>\n";
}

std::string rowHead(const Run& run, const Key& key) {
    return fmt::format(
        "<th scope=\"row\" class=\"plot-key\"><span class=\"key\" style=\"--c:var(--c{})\"></span>{}</th>",
        styleOf(run, key).colour % 7, h(labelOf(key)));
}

std::string targetText(const Target& target) {
    if (!target.seconds) return h("not reached");
    const Estimate& seconds = *target.seconds;
    if (!target.reached)
        return "not reached<span class=\"ci\">≈ " + h(secondsText(seconds.value, 2)) + " expected</span>";
    return (target.at_first_point ? "≤ " : "") + withInterval(secondsText(seconds)) +
           "<span class=\"ci\">" + h(numberText(target.samples->value)) + " spp</span>";
}

/// √ of b², signed: what a reader can compare with the error.
std::string floorText(const ErrorFit& error) {
    const Estimate& floor = error.floor();
    if (!std::isfinite(floor.value)) return "–";
    const auto root = [](double value) { return std::sqrt(std::max(value, 0.0)); };
    if (error.flattening)
        return h(percentText(root(floor.value), 2)) + "<span class=\"ci\">" +
               h(percentText(root(floor.low), 2) + " – " + percentText(root(floor.high), 2)) + "</span>";
    // Without a reference the floor is where the line v/N + b² meets the axis, which is below 0 for errors
    // that fall faster.
    if (!error.bias_squared && error.faster_than_inverse)
        return "none seen<span class=\"ci\">falls faster than 1/√N</span>";
    if (!(floor.high > 0)) return "none seen";
    return "none seen<span class=\"ci\">below " + h(percentText(root(floor.high), 2)) + "</span>";
}

std::string timeText(const TimeFit& time) {
    return h(secondsText(time.start())) + "<span class=\"ci\">+ " + h(secondsText(time.per_sample.value)) +
           " · N</span>";
}

std::string resultRow(const Run& run, const Analysis& analysis, const Configuration& configuration,
                      const ConfigurationFit& fit) {
    std::string html = "<tr>" + rowHead(run, fit.key);
    if (!configuration.omitted.empty())
        return html + fmt::format(
                          "<td class=\"wide\" colspan=\"7\" data-label=\"not "
                          "measured\"><span>{}</span></td></tr>\n",
                          h(configuration.omitted));
    const char* verdict = stats::verdictName(fit.judgement.verdict);
    html += fmt::format(
        "<td class=\"wide\" data-label=\"verdict\"><span><span class=\"verdict {}\">{}</span><span "
        "class=\"ci\">{}</span></span></td>",
        verdict, verdict, sentence(fit.judgement.reason));
    for (std::size_t i = 0; i < analysis.options.targets.size(); ++i)
        html += cell("time to " + percentText(analysis.options.targets[i], 1),
                     fit.fitted ? targetText(fit.targets[i]) : "–");
    html += cell("slope", fit.fitted ? withInterval(numberText(fit.slope_samples)) : "–");
    html += cell("efficiency, 1/s", fit.fitted ? withInterval(numberText(fit.efficiency)) : "–");
    html += cell("time t₀ + c·N", fit.fitted ? timeText(fit.time) : "–");
    html += cell("error floor", fit.fitted ? floorText(fit.error) : "–");
    return html + "</tr>\n";
}

std::string resultTable(const Run& run, const Analysis& analysis, const std::string& scene) {
    std::vector<std::pair<std::string, const char*>> columns{{"configuration", ""}, {"verdict", ""}};
    for (const double target : analysis.options.targets)
        columns.emplace_back("time to " + percentText(target, 1), "num");
    for (const char* name : {"slope", "efficiency, 1/s", "time t₀ + c·N", "error floor"})
        columns.emplace_back(name, "num");
    std::string rows;
    for (std::size_t i = 0; i < run.configurations.size(); ++i)
        if (run.configurations[i].key.scene == scene)
            rows += resultRow(run, analysis, run.configurations[i], analysis.fits.at(i));
    return tableOf(columns, rows);
}

/// Error and other measures at the most samples; measures that no configuration has are left out.
std::string metricTable(const Run& run, const Analysis& analysis, const std::string& scene) {
    const std::pair<const char*, std::optional<double> Point::*> measures[] = {
        {"relMSE", &Point::relmse},
        {"SMAPE", &Point::smape},
        {"MAE", &Point::mae},
        {"FLIP", &Point::flip_mean},
        {"ΔE2000", &Point::delta_e2000_mean}};
    std::vector<const ConfigurationFit*> fits;
    for (const ConfigurationFit& fit : analysis.fits)
        if (fit.key.scene == scene && !fit.points.empty()) fits.push_back(&fit);
    if (fits.empty()) return {};
    std::vector<std::pair<std::string, const char*>> columns{{"configuration", ""}};
    for (const char* name : {"samples per pixel", "replicates", "seconds", "relative RMSE"})
        columns.emplace_back(name, "num");
    std::vector<std::string> rows;
    for (const ConfigurationFit* fit : fits) {
        const Point& p = fit->points.back();
        rows.push_back(rowHead(run, fit->key) + cell("samples per pixel", h(countText(p.samples))) +
                       cell("replicates", std::to_string(p.replicates)) +
                       cell("seconds", withInterval(secondsText(p.seconds))) +
                       cell("relative RMSE", withInterval(errorText(p.relative_rmse))));
    }
    for (const auto& [name, measure] : measures) {
        if (std::none_of(fits.begin(), fits.end(), [m = measure](const ConfigurationFit* fit) {
                return (fit->points.back().*m).has_value();
            }))
            continue;
        columns.emplace_back(name, "num");
        for (std::size_t i = 0; i < fits.size(); ++i) {
            const std::optional<double>& value = fits[i]->points.back().*measure;
            rows[i] += cell(name, value ? h(numberText(*value)) : "–");
        }
    }
    std::string body;
    for (const std::string& row : rows) body += "<tr>" + row + "</tr>\n";
    return "<h3>At the most samples</h3>\n" + tableOf(columns, body);
}

/// What pixels say, where somebody asked them.
std::string testTable(const Run& run, const std::string& scene) {
    std::string rows;
    const auto known = [](const std::optional<double>& value) {
        return value ? h(numberText(*value, 2)) : std::string("–");
    };
    for (const Configuration& c : run.configurations) {
        const ImageTests& t = c.tests;
        if (c.key.scene != scene || !(t.smallest_tile_p || t.smallest_pixel_p || t.largest_share)) continue;
        rows += "<tr>" + rowHead(run, c.key) + cell("smallest p of tiles", known(t.smallest_tile_p)) +
                cell("smallest p of pixels", known(t.smallest_pixel_p)) +
                cell("tiles’ p uniform", known(t.tile_p_uniformity)) +
                cell("largest share", t.largest_share ? h(percentText(*t.largest_share, 2)) : "–") +
                "</tr>\n";
    }
    if (rows.empty()) return {};
    return "<h3>Tests against the reference</h3>\n<p>Smallest p-values are adjusted for how many tiles and "
           "pixels there are: below 0.001, one differs. The largest share is "
           "the part of all squared error that a single value carries.</p>\n" +
           tableOf({{"configuration", ""},
                    {"smallest p of tiles", "num"},
                    {"smallest p of pixels", "num"},
                    {"tiles’ p uniform", "num"},
                    {"largest share", "num"}},
                   rows);
}

std::string voidTable(const Run& run, const std::string& scene) {
    std::string rows;
    for (const Row& row : run.rows) {
        if (row.key.scene != scene || !row.isVoid()) continue;
        rows += "<tr>" + rowHead(run, row.key) + cell("replicate", std::to_string(row.replicate)) +
                cell("samples per pixel", h(countText(row.samples))) +
                cell("invalid samples",
                     row.invalid_samples > 0 ? h(countText(row.invalid_samples)) : "error is not a number") +
                "</tr>\n";
    }
    if (rows.empty()) return {};
    return "<h3>Void rows</h3>\n<p>Samples that are NaN or infinite make a row void. It is in no fit and no "
           "figure, and its configuration fails.</p>\n" +
           tableOf({{"configuration", ""},
                    {"replicate", "num"},
                    {"samples per pixel", "num"},
                    {"invalid samples", "num"}},
                   rows);
}

/// Configurations that keep and leave out the same share a row.
std::string featureTable(const Run& run, const std::string& scene) {
    struct Group {
        std::string configurations;
        const Configuration* first;
    };
    const auto same = [](const std::vector<Feature>& a, const std::vector<Feature>& b) {
        return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Feature& x, const Feature& y) {
            return x.name == y.name && x.reason == y.reason;
        });
    };
    std::vector<Group> groups;
    for (const Configuration& c : run.configurations) {
        if (c.key.scene != scene || !c.omitted.empty() || (c.kept.empty() && c.left_out.empty())) continue;
        const auto found = std::find_if(groups.begin(), groups.end(), [&](const Group& g) {
            return same(g.first->kept, c.kept) && same(g.first->left_out, c.left_out);
        });
        if (found == groups.end())
            groups.push_back({labelOf(c.key), &c});
        else
            found->configurations += "; " + labelOf(c.key);
    }
    if (groups.empty()) return {};
    std::string html = "<h3>Kept and left out</h3>\n";
    for (const Group& group : groups) {
        std::string rows;
        const auto add = [&](const std::vector<Feature>& features, const char* state) {
            for (const Feature& feature : features)
                rows += fmt::format("<tr><th scope=\"row\">{}</th>{}{}</tr>\n", h(feature.name),
                                    cell("", state, "state"), cell("why", h(feature.reason), "wide"));
        };
        add(group.first->kept, "kept");
        add(group.first->left_out, "left out");
        if (groups.size() > 1) html += "<p class=\"sub\">" + h(group.configurations) + "</p>\n";
        html += tableOf({{"part", ""}, {"", ""}, {"why", ""}}, rows);
    }
    return html;
}

std::string stageTable(const Run& run, const std::string& scene) {
    std::string rows;
    for (const Configuration& c : run.configurations) {
        if (c.key.scene != scene || !c.omitted.empty()) continue;
        const StageSeconds& s = c.stages;
        rows += "<tr>" + rowHead(run, c.key);
        const std::pair<const char*, double> stages[] = {{"parse", s.parse},
                                                         {"build", s.build},
                                                         {"compile", s.compile},
                                                         {"upload", s.upload},
                                                         {"first sample", s.first_sample},
                                                         {"render, wall", s.render_wall}};
        for (const auto& [name, seconds] : stages) rows += cell(name, h(secondsText(seconds)));
        rows += cell("render, device", s.render_device ? h(secondsText(*s.render_device)) : "–") +
                cell("write", h(secondsText(s.write))) + "</tr>\n";
    }
    std::vector<std::pair<std::string, const char*>> columns{{"seconds of one replicate", ""}};
    for (const char* name :
         {"parse", "build", "compile", "upload", "first sample", "render, wall", "render, device", "write"})
        columns.emplace_back(name, "num");
    return tableOf(columns, rows);
}

// ------------------------------------------------------------------------------------------------- sections

std::string findingsList(const std::vector<Finding>& findings) {
    std::string html = "<ul class=\"findings\">\n";
    for (const Finding& finding : findings)
        html += fmt::format("<li class=\"{}\">{}</li>\n", toneClass(finding.tone), sentence(finding.text));
    return html + "</ul>\n";
}

/// Of every scene the first finding, and how its configurations were judged.
std::string overview(const Run& run, const Analysis& analysis, const std::vector<std::string>& scenes) {
    std::string html = "<ul class=\"findings\">\n";
    for (const std::string& scene : scenes) {
        int pass = 0, fail = 0, inconclusive = 0;
        for (std::size_t i = 0; i < analysis.fits.size(); ++i) {
            if (analysis.fits[i].key.scene != scene || !run.configurations[i].omitted.empty()) continue;
            const stats::Verdict verdict = analysis.fits[i].judgement.verdict;
            ++(verdict == stats::Verdict::Pass   ? pass
               : verdict == stats::Verdict::Fail ? fail
                                                 : inconclusive);
        }
        std::string verdicts;
        const auto add = [&](int count, const char* name) {
            if (count > 0)
                verdicts += fmt::format(" <span class=\"verdict {}\">{} {}</span>", name, count, name);
        };
        add(pass, "PASS");
        add(fail, "FAIL");
        add(inconclusive, "INCONCLUSIVE");
        const std::vector<Finding> findings = findingsOfScene(run, analysis, scene);
        html +=
            fmt::format("<li class=\"{}\"><a href=\"#scene-{}\">{}</a>: {}{}</li>\n",
                        fail > 0           ? "bad"
                        : inconclusive > 0 ? "warning"
                                           : "good",
                        slug(scene), h(scene), findings.empty() ? "" : sentence(findings[0].text), verdicts);
    }
    for (const std::string& note : run.notes) html += "<li class=\"warning\">" + sentence(note) + "</li>\n";
    return html + "</ul>\n";
}

std::string referenceSentence(const Run& run, const std::string& scene) {
    const ReferenceInfo* r = findReference(run, scene);
    if (!r || r->kind == ReferenceKind::None)
        return "Reference: none. Errors are the spread between replicates, which is right for the variance "
               "and blind to bias.";
    std::string text;
    switch (r->kind) {
        case ReferenceKind::Analytic: text = "Reference: a closed form"; break;
        case ReferenceKind::Quadrature: text = "Reference: deterministic quadrature"; break;
        default: text = "Reference: an independent render";
    }
    if (!r->estimator.empty()) text += ", " + r->estimator;
    if (r->samples > 0) text += fmt::format(", {} samples per pixel", countText(r->samples));
    if (!r->file.empty()) text += " (" + r->file + ")";
    text += ".";
    if (r->mean_variance > 0)
        text += fmt::format(
            " Its own relative error is {}; it is subtracted, and part of every interval of what is "
            "measured against it.",
            percentText(stats::relativeRmse(r->mean_variance, r->mean_luminance), 2));
    return text;
}

std::string mapsSection(const MapSet& set) {
    if (set.configurations.empty()) return {};
    std::string html = "<h3>Maps</h3>\n";
    for (const MapSet::OfConfiguration& of : set.configurations) {
        html += fmt::format("<p class=\"sub\">{}, {} samples per pixel</p>\n<div class=\"maps\">\n",
                            h(labelOf(of.key)), h(countText(of.samples)));
        for (const Picture& picture : of.pictures)
            html += fmt::format(
                "<figure><img src=\"{}\" width=\"{}\" height=\"{}\" "
                "alt=\"{}\"/><figcaption>{}</figcaption></figure>\n",
                picture.uri, picture.width, picture.height, h(picture.title + " of " + labelOf(of.key)),
                h(picture.title));
        html += "</div>\n";
    }
    html += "<div class=\"scales\">\n";
    for (const ColourKey& key : set.keys)
        html += fmt::format(
            "<div class=\"scale\">{}<div class=\"ramp\" style=\"background:{}\"></div><div "
            "class=\"ends\"><span>{}</span><span>{}</span></div></div>\n",
            h(key.title), key.css_gradient, h(key.low), h(key.high));
    return html + "</div>\n";
}

std::string figuresSection(const std::vector<Figure>& figures) {
    std::string html = "<div class=\"figures\">\n";
    for (const Figure& figure : figures)
        html += fmt::format("<figure><h3>{}</h3>\n{}<figcaption>{}</figcaption></figure>\n", h(figure.title),
                            figure.svg, h(figure.caption));
    return html + "</div>\n";
}

std::string definition(const std::string& term, const std::string& html) {
    return html.empty() ? std::string() : "<dt>" + h(term) + "</dt><dd>" + html + "</dd>\n";
}

std::string environmentSection(const Run& run) {
    const Environment& e = run.environment;
    std::string html = "<section id=\"environment\"><h2>How it was measured</h2>\n";
    for (const std::string& command : e.commands) html += "<pre>" + h(command) + "</pre>\n";
    html += "<dl>\n";
    html += definition("in folder", h(e.working_directory));
    html += definition("crt",
                       h(fmt::format("{}{}{}", e.crt_version, e.commit.empty() ? "" : ", commit " + e.commit,
                                     e.dirty ? ", with uncommitted changes" : "")));
    html += definition("compiler", h(e.compiler));
    html += definition("flags", h(e.build_flags).empty() ? "" : "<code>" + h(e.build_flags) + "</code>");
    html +=
        definition("processor", h(e.cpu + (e.threads > 0 ? fmt::format(", {} threads", e.threads) : "")));
    html += definition("system", h(e.operating_system));
    html += definition(
        "load, 1, 5 and 15 min",
        h(e.load_start + (e.load_end.empty() ? "" : " at the start, " + e.load_end + " at the end")));
    const std::string finished = e.finished.empty() ? "" : " – " + e.finished;
    html += definition("begun and finished", h(e.started + finished));
    html += definition("time",
                       h(secondsText(e.spent_seconds) +
                         (e.budget_seconds > 0 ? " of a budget of " + secondsText(e.budget_seconds) : "")));
    html += "</dl>\n";

    std::string rows;
    for (const Configuration& c : run.configurations) {
        if (!c.omitted.empty()) continue;
        rows += fmt::format("<tr><th scope=\"row\">{}</th>", h(c.key.scene + ": " + labelOf(c.key))) +
                cell("device", h(c.device + (c.threads > 0 ? fmt::format(", {} threads", c.threads) : "")),
                     "wide") +
                cell("driver", h(c.driver), "wide") + cell("kernel", h(c.kernel), "wide") +
                cell("image", fmt::format("{} × {}", c.width, c.height)) +
                cell("scene file and hash",
                     h(c.scene_file) + "<span class=\"ci\"><code>" + h(c.scene_hash) + "</code></span>",
                     "wide") +
                "</tr>\n";
    }
    html += tableOf({{"configuration", ""},
                     {"device", ""},
                     {"driver", ""},
                     {"kernel", ""},
                     {"image", "num"},
                     {"scene file and hash", ""}},
                    rows);
    return html + "</section>\n";
}

std::string methodSection(const Analysis& analysis) {
    const FitOptions& o = analysis.options;
    return fmt::format(
        "<section id=\"method\"><h2>What the figures mean</h2>\n"
        "<p><b>Relative RMSE</b> is the root mean square of image minus reference, of luminance, over all "
        "pixels, divided by the reference's mean luminance. The "
        "reference's own variance is subtracted; where that leaves nothing, the error is below what the "
        "interval reaches.</p>\n"
        "<p><b>Intervals</b> hold the truth in {0:.3g} of 100 repeats. They come from the spread between "
        "replicates, renders with seeds of their own, and from that "
        "between the eighths of the reference, by the jackknife with Student’s t. Points along one curve "
        "belong to the same renders: they are not independent of "
        "each other. Configurations that render the same bits share errors, slope and verdict.</p>\n"
        "<p><b>Slope</b> is that of error over samples, both logarithmic. <b>Time to a target</b> includes "
        "start-up. <b>Efficiency</b> is 1/(e²·N·c): "
        "e the least error that all configurations of the scene have reached, N the samples it took, c the "
        "seconds per sample, from t = t₀ + c·N. Who is first is "
        "said of errors that were measured, never of those that were not reached; intervals of such "
        "comparisons allow for all pairs.</p>\n"
        "<p><b>Error floor</b> is b, what would be left after infinitely many samples: with a reference, "
        "mean squared error minus the variance between "
        "replicates. It is called seen when its {1:.4g} % interval lies above 0.</p>\n"
        "<p><b>Verdict</b>: PASS when the {1:.4g} % interval of the image "
        "mean’s bias lies within ±{2:.3g} "
        "% for every colour (of its own mean, or of "
        "mean luminance where that is larger), and no tile or pixel differs from the reference; FAIL when "
        "all of it lies outside, the error floor lies above that margin and above the reference's own "
        "error, a tile differs, or a sample was NaN or infinite; else INCONCLUSIVE: more samples, or a "
        "reference, are needed.</p>\n"
        "<p>All rows are in <code>results.jsonl</code> and <code>results.csv</code>, all fits in "
        "<code>summary.json</code>, hashes in <code>manifest.json</code>.</p>\n"
        "</section>\n",
        100 * o.confidence, 100 * o.verdict_confidence, 100 * o.equivalence_margin);
}

std::string headerSection(const Run& run, const std::vector<std::string>& scenes) {
    std::uint32_t replicates = 0;
    for (const Row& row : run.rows) replicates = std::max(replicates, row.replicate + 1);
    const auto plural = [](std::size_t count, const char* what) {
        return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
    };
    std::string html =
        "<header><h1>Error against run time</h1>\n<p class=\"sub\">" +
        h(fmt::format("{}, {}, {} at most. {}. crt {}{}{}.", plural(scenes.size(), "scene"),
                      plural(run.configurations.size(), "configuration"), plural(replicates, "replicate"),
                      run.environment.cpu, run.environment.crt_version,
                      run.environment.commit.empty() ? "" : " at " + run.environment.commit.substr(0, 12),
                      run.environment.finished.empty() ? "" : ", " + run.environment.finished)) +
        "</p>\n<nav>";
    return html +
           "<a href=\"#environment\">how it was measured</a> <a href=\"#method\">what the figures "
           "mean</a></nav></header>\n";
}

void writeText(const std::string& folder, const std::string& name, const std::string& text,
               std::vector<std::string>& written) {
    AtomicFile file((std::filesystem::path(folder) / name).string());
    file.write(text.data(), text.size());
    file.commit();
    written.push_back(name);
}

/// Hours of measuring must not be lost to a missing codec, so its absence is a sentence on the page.
std::string sceneMaps(const std::string& folder, const Run& run, const std::string& scene,
                      std::vector<std::string>& written) {
    try {
        const MapSet set = writeMaps(folder, run, scene);
        for (const MapSet::OfConfiguration& of : set.configurations)
            for (const Picture& picture : of.pictures) written.push_back(picture.file);
        return mapsSection(set);
    } catch (const Error& error) {
        logWarning("the report has no maps of '{}': {}", scene, error.what());
        return "<h3>Maps</h3>\n<p>Left out: " + h(error.what()) + "</p>\n";
    }
}

std::string sceneSection(const std::string& folder, const Run& run, const Analysis& analysis,
                         const std::string& scene, std::vector<std::string>& written) {
    const std::vector<Figure> figures = figuresOfScene(run, analysis, scene);
    for (const Figure& figure : figures) writeText(folder, figure.file, svgFile(figure.svg), written);
    return fmt::format("<section id=\"scene-{}\"><h2>{}</h2>\n", slug(scene), h(scene)) +
           findingsList(findingsOfScene(run, analysis, scene)) + "<p class=\"sub\">" +
           sentence(referenceSentence(run, scene)) + "</p>\n" + resultTable(run, analysis, scene) +
           figuresSection(figures) + metricTable(run, analysis, scene) + testTable(run, scene) +
           voidTable(run, scene) + sceneMaps(folder, run, scene, written) + "<h3>Seconds by stage</h3>\n" +
           stageTable(run, scene) + featureTable(run, scene) + "</section>\n";
}

}  // namespace

std::vector<std::string> writeReport(const std::string& folder, const Run& run, const Analysis& analysis) {
    std::vector<std::string> written;
    const std::vector<std::string> scenes = scenesOf(run);
    std::string body = headerSection(run, scenes) + "<main>\n";
    body += overview(run, analysis, scenes);
    for (const std::string& scene : scenes) body += sceneSection(folder, run, analysis, scene, written);
    body += environmentSection(run) + methodSection(analysis) + "</main>\n";
    const std::string head =
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
        "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\"/>\n<title>Error against run "
        "time</title>\n<style>\n";
    writeText(folder, "report.html",
              head + plotCss() + pageCss() + "</style>\n</head>\n<body>\n" + body + "</body>\n</html>\n",
              written);
    return written;
}

}  // namespace crt::converge
