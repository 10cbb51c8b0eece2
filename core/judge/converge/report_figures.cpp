#include "film/error_text.h"
#include "judge/converge/report_figures.h"

#include "base/unit_text.h"
#include "judge/converge/findings.h"
#include "judge/converge/quantity_text.h"
#include "judge/converge/report_maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace crt::converge {
namespace {

/// A configuration of the scene that was measured.
struct Subject {
    const Configuration* configuration;
    const ConfigurationFit* fit;
    PlotStyle style;
    std::string label() const { return labelOf(configuration->key); }
};
using Subjects = std::vector<Subject>;

/// "1.5 s", not "1.50 s": a tick is exact.
std::string withoutZeros(std::string text) {
    const std::size_t unit = std::min(text.find(' '), text.size());
    if (text.find('.') >= unit) return text;
    const std::size_t last = text.find_last_not_of('0', unit - 1);
    const std::size_t keep = text[last] == '.' ? last : last + 1;
    return text.erase(keep, unit - keep);
}
std::string percentTick(double value) { return withoutZeros(percentText(value)); }
std::string secondsTick(double value) { return value == 0 ? "0" : withoutZeros(secondsText(value)); }
std::string signedPercentTick(double value) {
    return fmt::format("{}{}", value > 0 ? "+" : "", percentTick(value));
}
std::string numberTick(double value) { return withoutZeros(numberText(value)); }
std::string samplesTick(double value) { return countText(static_cast<std::uint64_t>(std::llround(value))); }

std::string tip(const Subject& subject, const Point& point, const std::string& what) {
    return fmt::format("{}\n{} samples per pixel, {} replicates\n{}", subject.label(),
                       countText(point.samples), point.replicates, what);
}

PlotLine lineOf(const Subject& subject) {
    return {subject.label(), subject.style, {}, std::nullopt, std::nullopt};
}

/// The level that the error will not fall below, where the fit found one.
std::optional<double> floorOf(const Subject& subject) {
    const ConfigurationFit& fit = *subject.fit;
    if (!fit.fitted || !fit.error.flattening) return std::nullopt;
    return std::sqrt(fit.error.floor().value);
}

Plot errorAgainstTime(const Subjects& subjects, const Analysis& analysis, const std::string& scene) {
    Plot plot;
    plot.title = "Error against time, " + scene;
    plot.description =
        "Relative root mean square error over the seconds a user waits, both logarithmic, with 95 % bands.";
    plot.x = {"seconds, start-up included", AxisScale::Log, secondsTick, {}};
    plot.y = {"relative RMSE", AxisScale::Log, percentTick, {}};
    plot.slope_guide = -0.5;
    for (const double target : analysis.options.targets)
        plot.rules.push_back({target, percentTick(target), true});
    for (const Subject& subject : subjects) {
        PlotLine line = lineOf(subject);
        for (const Point& point : subject.fit->points) {
            const Estimate& e = point.relative_rmse;
            if (!(e.value > 0))
                continue;  // Hidden by the reference's own noise: a logarithmic axis has no place for it.
            line.points.push_back(
                {point.seconds.value, e.value, e.low, e.high,
                 tip(subject, point, errorText(e) + " after " + secondsText(point.seconds.value))});
        }
        if (subject.fit->fitted && subject.fit->time.start() > 0) line.x_mark = subject.fit->time.start();
        line.floor = floorOf(subject);
        plot.lines.push_back(std::move(line));
    }
    return plot;
}

Plot errorAgainstSamples(const Subjects& subjects, const std::string& scene) {
    Plot plot;
    plot.title = "Error against samples, " + scene;
    plot.description =
        "Relative root mean square error over samples per pixel, both logarithmic, with 95 % bands.";
    plot.x = {"samples per pixel", AxisScale::Log2, samplesTick, {}};
    plot.y = {"relative RMSE", AxisScale::Log, percentTick, {}};
    plot.slope_guide = -0.5;
    for (const Subject& subject : subjects) {
        PlotLine line = lineOf(subject);
        if (subject.fit->fitted)
            line.label += fmt::format(" ({})", numberText(subject.fit->slope_samples.value, 2));
        for (const Point& point : subject.fit->points) {
            const Estimate& e = point.relative_rmse;
            if (!(e.value > 0)) continue;
            line.points.push_back({static_cast<double>(point.samples), e.value, e.low, e.high,
                                   tip(subject, point, errorText(e))});
        }
        line.floor = floorOf(subject);
        plot.lines.push_back(std::move(line));
    }
    return plot;
}

BarChart efficiencyBars(const Subjects& subjects, const std::string& scene) {
    BarChart chart;
    chart.title = "Efficiency, " + scene;
    chart.description =
        "One over squared error times render seconds, start-up excluded, at the least error that all "
        "reached, with 95 % intervals. More is better.";
    chart.axis = {"efficiency 1/(e²·N·c), 1/s", AxisScale::Linear, numberTick, {}};
    for (const Subject& subject : subjects) {
        if (!subject.fit->fitted || !std::isfinite(subject.fit->efficiency.value)) continue;
        const Estimate& e = subject.fit->efficiency;
        const std::string bound = subject.fit->common.at_first_point ? "≥ " : "";
        chart.bars.push_back({subject.label(),
                              bound + numberText(e) + " /s",
                              subject.style,
                              {e.value},
                              std::pair{e.low, e.high}});
    }
    std::stable_sort(chart.bars.begin(), chart.bars.end(),
                     [](const Bar& a, const Bar& b) { return a.parts[0] > b.parts[0]; });
    return chart;
}

Plot calibration(const Subjects& subjects, const std::string& scene) {
    Plot plot;
    plot.title = "Predicted over actual error, " + scene;
    plot.description =
        "What images say of their own error, divided by what it is, over samples per pixel, with 95 % "
        "intervals. 1 is right.";
    plot.bands = false;
    plot.x = {"samples per pixel", AxisScale::Log2, samplesTick, {}};
    plot.y = {"predicted / actual relative RMSE", AxisScale::Log, numberTick, {}};
    plot.rules.push_back({1, "", false});
    double farthest = std::log(1.25);
    for (const Subject& subject : subjects) {
        PlotLine line = lineOf(subject);
        for (const Point& point : subject.fit->points) {
            if (!point.calibration || !std::isfinite(point.calibration->value)) continue;
            const Estimate& e = *point.calibration;
            line.points.push_back({static_cast<double>(point.samples), e.value, e.low, e.high,
                                   tip(subject, point,
                                       fmt::format("{}; {} of {} intervals hold", numberText(e),
                                                   point.covered, point.predicted))});
            farthest =
                std::max({farthest, std::abs(std::log(e.value)), std::min(std::abs(std::log(e.low)), 1.5),
                          std::min(std::abs(std::log(e.high)), 1.5)});
        }
        if (!line.points.empty()) plot.lines.push_back(std::move(line));
    }
    plot.y.range = std::pair{std::exp(-1.05 * farthest), std::exp(1.05 * farthest)};
    return plot;
}

Plot biasPerSamples(const Subjects& subjects, const Analysis& analysis, const std::string& scene) {
    const double margin = analysis.options.equivalence_margin;
    Plot plot;
    plot.title = "Bias of the image mean, " + scene;
    plot.description =
        "Image mean over that of the reference, minus 1, over samples per pixel, with 95 % intervals. All "
        "intervals should hold 0.";
    plot.bands = false;
    plot.x = {"samples per pixel", AxisScale::Log2, samplesTick, {}};
    plot.y = {"image mean / reference − 1", AxisScale::Linear, signedPercentTick, {}};
    plot.rules = {{0, "", false},
                  {margin, fmt::format("margin {}", signedPercentTick(margin)), true},
                  {-margin, "", true}};
    double extent = 1.6 * margin;
    for (const Subject& subject : subjects) {
        PlotLine line = lineOf(subject);
        for (const Point& point : subject.fit->points) {
            if (!point.mean_bias) continue;
            const Estimate& e = *point.mean_bias;
            line.points.push_back({static_cast<double>(point.samples), e.value, e.low, e.high,
                                   tip(subject, point, percentText(e))});
        }
        if (line.points.empty()) continue;
        // The first looks have intervals so long that nothing else would show; they are cut off.
        const PlotPoint& last = line.points.back();
        extent = std::max({extent, 1.3 * std::abs(last.low), 1.3 * std::abs(last.high)});
        plot.lines.push_back(std::move(line));
    }
    plot.y.range = std::pair{-extent, extent};
    return plot;
}

const std::vector<std::string>& startStages() {
    static const std::vector<std::string> names{"parse",  "build",        "compile",
                                                "upload", "first sample", "write"};
    return names;
}

std::vector<double> startSeconds(const StageSeconds& s) {
    return {s.parse, s.build, s.compile, s.upload, s.first_sample, s.write};
}

double sumOf(const std::vector<double>& values) {
    double sum = 0;
    for (const double value : values) sum += std::isfinite(value) ? value : 0;
    return sum;
}

BarChart timeBudget(const Subjects& subjects, const std::string& scene) {
    BarChart chart;
    chart.title = "Where the time goes, " + scene;
    chart.description = "Wall clock of one replicate to its last sample, stacked.";
    chart.axis = {"seconds, wall clock", AxisScale::Linear, secondsTick, {}};
    const bool any_device = std::any_of(subjects.begin(), subjects.end(), [](const Subject& subject) {
        return subject.configuration->stages.render_device.has_value();
    });
    chart.part_names = {"everything but rendering",
                        any_device ? "rendering, host and waiting" : "rendering"};
    if (any_device) chart.part_names.push_back("rendering on the device");
    for (const Subject& subject : subjects) {
        const StageSeconds& s = subject.configuration->stages;
        const double start = sumOf(startSeconds(s)),
                     device = std::min(s.render_device.value_or(0), s.render_wall);
        std::vector<double> parts{start, s.render_wall - device};
        if (any_device) parts.push_back(device);
        chart.bars.push_back(
            {subject.label(), secondsText(start + s.render_wall), {}, std::move(parts), {}});
    }
    return chart;
}

BarChart startBudget(const Subjects& subjects, const std::string& scene) {
    BarChart chart;
    chart.title = "Everything but rendering, " + scene;
    chart.description = "Wall clock before the first sample is there, and of writing the image, stacked.";
    chart.axis = {"seconds, wall clock", AxisScale::Linear, secondsTick, {}};
    chart.part_names = startStages();
    for (const Subject& subject : subjects) {
        const std::vector<double> parts = startSeconds(subject.configuration->stages);
        chart.bars.push_back({subject.label(), secondsText(sumOf(parts)), {}, parts, {}});
    }
    return chart;
}

bool hasPoints(const Plot& plot) {
    return std::any_of(plot.lines.begin(), plot.lines.end(),
                       [](const PlotLine& line) { return !line.points.empty(); });
}

}  // namespace

PlotStyle styleOf(const Run& run, const Key& key) {
    std::vector<std::string> backends, variants;
    const auto place = [](std::vector<std::string>& names, const std::string& name) {
        const auto found = std::find(names.begin(), names.end(), name);
        if (found == names.end()) names.push_back(name);
    };
    for (const Configuration& configuration : run.configurations) {
        place(backends, configuration.key.backend);
        place(variants, configuration.key.variant);
    }
    const auto index = [](const std::vector<std::string>& names, const std::string& name) {
        return static_cast<unsigned>(std::find(names.begin(), names.end(), name) - names.begin());
    };
    const unsigned backend = index(backends, key.backend), variant = index(variants, key.variant);
    if (backends.size() == 1) return {variant, variant};
    if (variants.size() == 1) return {backend, backend};
    return {backend, variant};
}

std::vector<Figure> figuresOfScene(const Run& run, const Analysis& analysis, const std::string& scene) {
    Subjects subjects;
    for (std::size_t i = 0; i < run.configurations.size(); ++i)
        if (const Configuration& c = run.configurations[i]; c.key.scene == scene && c.omitted.empty())
            subjects.push_back({&c, &analysis.fits.at(i), styleOf(run, c.key)});
    std::vector<Figure> figures;
    const auto add = [&](const char* name, const char* title, const char* caption, const std::string& svg) {
        figures.push_back({slug(scene) + "-" + name + ".svg", title, caption, svg});
    };
    const auto add_plot = [&](const char* name, const char* title, const char* caption, const Plot& plot) {
        if (hasPoints(plot)) add(name, title, caption, svgOfPlot(plot));
    };
    const auto add_bars = [&](const char* name, const char* title, const char* caption,
                              const BarChart& chart) {
        if (!chart.bars.empty()) add(name, title, caption, svgOfBars(chart));
    };

    add_plot("work-precision", "Error against time",
             "Lower and further left is better. Each marker is a power of two of samples; bands hold 95 %. "
             "Ticks on the time axis are start-up times; "
             "a dashed level is a floor that the error will not fall below.",
             errorAgainstTime(subjects, analysis, scene));
    add_plot("samples", "Error against samples",
             "The cost of a sample left out. In brackets the slope; independent samples have −½.",
             errorAgainstSamples(subjects, scene));
    add_bars("efficiency", "Efficiency",
             "Longer is better: twice the efficiency needs half the render time for the same error. e is "
             "the least error that all configurations of the scene "
             "have reached, N the samples that it took, c the seconds of one. Start-up is excluded; "
             "whiskers hold 95 %.",
             efficiencyBars(subjects, scene));
    add_plot("calibration", "Can the image's own error estimate be trusted?",
             "1 is right; below, images understate their error. Whiskers hold 95 %.",
             calibration(subjects, scene));
    add_plot(
        "bias", "Bias of the image mean",
        "95 of 100 whiskers hold 0 when there is no bias. Those of few samples are cut off at the frame.",
        biasPerSamples(subjects, analysis, scene));
    add_bars("time", "Where the time goes", "One replicate, from the scene file to its last sample.",
             timeBudget(subjects, scene));
    add_bars("start-up", "Start-up and writing, enlarged",
             "What is paid once, however many samples are taken.", startBudget(subjects, scene));
    return figures;
}

}  // namespace crt::converge
