#include "judge/converge/svg_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace crt::converge {
namespace {

constexpr double kWidth = 400;
constexpr double kLeft = 54, kRight = 14, kTop = 28, kPlotHeight = 236;
constexpr double kAxisHeight = 40;    ///< Tick labels and the axis' name.
constexpr double kLegendRow = 19;
constexpr double kCharacter = 7.2;  ///< Mean advance of a character at 12 units; fonts differ, and this is
                                    ///< one of the widest, DejaVu Sans.
constexpr unsigned kColours = 7, kMarkers = 4;
constexpr unsigned kFirstPartColour =
    3;  ///< Of stacked bars: not those of the first series, which mean something else.

/// A length in the drawing: a tenth of a unit is finer than any screen shows.
std::string length(double value) {
    std::string text = fmt::format("{:.1f}", value);
    if (text.ends_with(".0")) text.resize(text.size() - 2);
    return text == "-0" ? "0" : text;
}

/// Characters, not bytes, of UTF-8.
double textWidth(const std::string& text) {
    return kCharacter * static_cast<double>(std::count_if(text.begin(), text.end(),
                                                          [](char c) { return (c & 0xc0) != 0x80; }));
}

std::string text(double x, double y, const char* css_class, const std::string& content) {
    return fmt::format("<text x=\"{}\" y=\"{}\" class=\"{}\">{}</text>\n", length(x), length(y), css_class,
                       escapeXml(content));
}

std::string line(double x0, double y0, double x1, double y1, const std::string& css_class) {
    return fmt::format("<line x1=\"{}\" y1=\"{}\" x2=\"{}\" y2=\"{}\" class=\"{}\"/>\n", length(x0),
                       length(y0), length(x1), length(y1), css_class);
}

std::string colourClass(const PlotStyle& style) { return fmt::format("c{}", style.colour % kColours); }
std::string dashClass(const PlotStyle& style) { return fmt::format("d{}", style.marker % kMarkers); }

/// Circle, square, diamond, triangle, of about equal area.
std::string marker(const PlotStyle& style, double x, double y, const std::string& tip = {}) {
    const std::string title = tip.empty() ? std::string() : fmt::format("<title>{}</title>", escapeXml(tip));
    const std::string css_class = fmt::format("m {}", colourClass(style));
    const auto path = [&](const std::string& d) {
        return fmt::format("<path d=\"{}\" class=\"{}\">{}</path>\n", d, css_class, title);
    };
    const std::string at = fmt::format("M{} {}", length(x), length(y));
    switch (style.marker % kMarkers) {
        case 0:
            return fmt::format("<circle cx=\"{}\" cy=\"{}\" r=\"3.6\" class=\"{}\">{}</circle>\n", length(x),
                               length(y), css_class, title);
        case 1: return path(at + "m-3.2 -3.2h6.4v6.4h-6.4z");
        case 2: return path(at + "m0 -4.6l4.6 4.6l-4.6 4.6l-4.6 -4.6z");
        default: return path(at + "m0 -4.4l4.4 7.6h-8.8z");
    }
}

struct Tick {
    double value;
    bool labelled;
};

std::vector<Tick> logTicks(double low, double high) {
    std::vector<Tick> ticks;
    const int first = static_cast<int>(std::floor(std::log10(low))),
              last = static_cast<int>(std::ceil(std::log10(high)));
    const double decades = std::log10(high / low);
    const int every = std::max(1, static_cast<int>(std::ceil(decades / 6)));
    for (int decade = first; decade <= last; ++decade)
        for (int digit = 1; digit < 10; ++digit) {
            const double value = digit * std::pow(10.0, decade);
            if (value < low * (1 - 1e-9) || value > high * (1 + 1e-9)) continue;
            const bool labelled =
                digit == 1 ? (decade - first) % every == 0 : decades < 2.5 && (digit == 2 || digit == 5);
            if (labelled || decades < 5) ticks.push_back({value, labelled});
        }
    return ticks;
}

std::vector<Tick> powerOfTwoTicks(double low, double high) {
    std::vector<Tick> ticks;
    const int first = static_cast<int>(std::ceil(std::log2(low) - 1e-9)),
              last = static_cast<int>(std::floor(std::log2(high) + 1e-9));
    const int every = std::max(1, (last - first + 5) / 6);
    for (int power = first; power <= last; ++power)
        ticks.push_back({std::exp2(power), (power - first) % every == 0});
    return ticks;
}

std::vector<Tick> linearTicks(double low, double high, int about) {
    const double rough = (high - low) / about, unit = std::pow(10.0, std::floor(std::log10(rough)));
    const double step = unit * (rough / unit < 1.5   ? 1
                                : rough / unit < 3.5 ? 2
                                : rough / unit < 7.5 ? 5
                                                     : 10);
    std::vector<Tick> ticks;
    for (double i = std::ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; ++i)
        ticks.push_back({i == 0 ? 0 : i * step, true});
    return ticks;
}

/// From values to positions along one side of the frame.
class Ruler {
public:
    Ruler(AxisScale scale, double low, double high, double from, double to)
        : scale_(scale), low_(low), high_(high), from_(from), to_(to) {}
    double low() const { return low_; }
    double high() const { return high_; }
    bool contains(double value) const {
        return value >= low_ * (1 - 1e-9) - 1e-300 && value <= high_ * (1 + 1e-9);
    }
    /// Cut off at the frame; what is not a number, at its lower end.
    double at(double value) const {
        const double clamped = std::isnan(value) ? low_ : std::clamp(value, low_, high_);
        return from_ + (to_ - from_) * (onScale(clamped) - onScale(low_)) / (onScale(high_) - onScale(low_));
    }
    std::vector<Tick> ticks(int about) const {
        if (scale_ == AxisScale::Log) return logTicks(low_, high_);
        if (scale_ == AxisScale::Log2) return powerOfTwoTicks(low_, high_);
        return linearTicks(low_, high_, about);
    }

private:
    double onScale(double value) const { return scale_ == AxisScale::Linear ? value : std::log(value); }
    AxisScale scale_;
    double low_, high_, from_, to_;
};

bool drawable(const PlotPoint& point, const Plot& plot) {
    return std::isfinite(point.x) && std::isfinite(point.y) &&
           (plot.x.scale == AxisScale::Linear || point.x > 0) &&
           (plot.y.scale == AxisScale::Linear || point.y > 0);
}

/// What an axis has to show, with a margin of `margin` of its length at both ends.
std::pair<double, double> rangeOf(const Axis& axis, const std::vector<double>& values, double margin) {
    if (axis.range) return *axis.range;
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const double value : values) {
        if (!std::isfinite(value) || (axis.scale != AxisScale::Linear && value <= 0)) continue;
        low = std::min(low, value);
        high = std::max(high, value);
    }
    if (!(low <= high)) return axis.scale == AxisScale::Linear ? std::pair{0.0, 1.0} : std::pair{0.1, 1.0};
    if (axis.scale == AxisScale::Linear) {
        const double pad = high > low ? margin * (high - low) : std::max(std::abs(low), 1.0);
        return {low - pad, high + pad};
    }
    const double factor = high > low ? std::pow(high / low, margin) : 2.0;
    return {low / factor, high * factor};
}

std::string opening(double height, const std::string& title, const std::string& description) {
    return fmt::format(
        "<svg class=\"plot\" viewBox=\"0 0 {} {}\" role=\"img\" "
        "aria-label=\"{}\">\n<title>{}</title>\n<desc>{}</desc>\n",
        length(kWidth), length(height), escapeXml(title), escapeXml(title), escapeXml(description));
}

struct LegendEntry {
    std::string label;
    std::string key;  ///< Drawn with its left middle at (0, 0), 22 wide.
};

/// Entries one after another, a new row where one does not fit.
std::string legend(const std::vector<LegendEntry>& entries, double left, double top, double& height) {
    std::string svg;
    double x = left, y = top + 0.6 * kLegendRow;
    for (const LegendEntry& entry : entries) {
        const double width = 28 + textWidth(entry.label) + 12;
        if (x > left && x + width > kWidth) {
            x = left;
            y += kLegendRow;
        }
        svg += fmt::format("<g transform=\"translate({} {})\">{}</g>\n", length(x), length(y), entry.key) +
               text(x + 28, y + 4, "l", entry.label);
        x += width;
    }
    height = y + 0.6 * kLegendRow;
    return svg;
}

std::string gridAndAxes(const Plot& plot, const Ruler& x, const Ruler& y) {
    const double right = kWidth - kRight, bottom = kTop + kPlotHeight;
    std::string svg;
    for (const Tick& tick : x.ticks(6)) {
        const double at = x.at(tick.value);
        svg += line(at, kTop, at, bottom, tick.labelled ? "g" : "g minor");
        if (tick.labelled) svg += text(at, bottom + 16, "t mid", plot.x.tick_text(tick.value));
    }
    for (const Tick& tick : y.ticks(6)) {
        const double at = y.at(tick.value);
        svg += line(kLeft, at, right, at, tick.labelled ? "g" : "g minor");
        if (tick.labelled) svg += text(kLeft - 6, at + 4, "t end", plot.y.tick_text(tick.value));
    }
    svg += fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" class=\"frame\"/>\n",
                       length(kLeft), length(kTop), length(right - kLeft), length(kPlotHeight));
    // The vertical axis' name lies above it, not on its side: it is read without turning the phone.
    svg += text(4, 15, "n", plot.y.label);
    return svg + text(right, bottom + 34, "n end", plot.x.label);
}

std::string slopeGuide(const Plot& plot, const Ruler& x, const Ruler& y) {
    const double slope = *plot.slope_guide;
    double level = 0;  // y·x^−slope of the guide: above all points.
    for (const PlotLine& series : plot.lines)
        for (const PlotPoint& point : series.points)
            if (drawable(point, plot)) level = std::max(level, point.y * std::pow(point.x, -slope));
    level *= 1.3;
    // Where it enters and leaves the frame.
    const double left = std::max(x.low(), std::pow(y.high() / level, 1 / slope)),
                 right = std::min(x.high(), std::pow(y.low() / level, 1 / slope));
    if (!(level > 0) || !(left < right)) return {};
    const auto height = [&](double at) { return level * std::pow(at, slope); };
    std::string svg = line(x.at(left), y.at(height(left)), x.at(right), y.at(height(right)), "guide");
    // Right of the line and above it, where the line leaves room: at 70 % of its length, or further left
    // when the frame is near.
    const std::string label = fmt::format("slope {}", slope == -0.5 ? "−½" : fmt::format("{}", slope));
    const double from = x.at(left), length_x = x.at(right) - from;
    const double share = std::min(0.7, (kWidth - kRight - textWidth(label) - 6 - from) / length_x);
    return svg + text(from + share * length_x + 5, y.at(height(left * std::pow(right / left, share))) - 5,
                      "t halo", label);
}

std::string rules(const Plot& plot, const Ruler& y) {
    std::string svg;
    for (const PlotRule& rule : plot.rules) {
        if (!y.contains(rule.y)) continue;
        const double at = y.at(rule.y);
        svg += line(kLeft, at, kWidth - kRight, at, rule.dashed ? "rule d1" : "rule");
        svg += text(kWidth - kRight - 4, at - 4, "t end halo", rule.label);
    }
    return svg;
}

/// Band, floor, line and markers of one series.
std::string curve(const Plot& plot, const PlotLine& series, const Ruler& x, const Ruler& y) {
    std::string upper, path, markers, svg;
    std::vector<std::string> lower;  // From left to right; the band's outline goes back along it.
    for (const PlotPoint& point : series.points) {
        if (!drawable(point, plot)) continue;
        const double at = x.at(point.x);
        const bool bounded = std::isfinite(point.low) && std::isfinite(point.high);
        upper += fmt::format("{},{} ", length(at), length(y.at(bounded ? point.high : point.y)));
        lower.push_back(fmt::format("{},{} ", length(at), length(y.at(bounded ? point.low : point.y))));
        path += fmt::format("{}{} {}", path.empty() ? "M" : "L", length(at), length(y.at(point.y)));
        markers += marker(series.style, at, y.at(point.y), point.text);
    }
    const std::string colour = colourClass(series.style);
    if (series.floor && *series.floor > 0 && y.contains(*series.floor))
        svg += line(kLeft, y.at(*series.floor), kWidth - kRight, y.at(*series.floor),
                    fmt::format("floor {}", colour));
    if (series.x_mark && x.contains(*series.x_mark))
        svg += line(x.at(*series.x_mark), kTop + kPlotHeight - 9, x.at(*series.x_mark),
                    kTop + kPlotHeight + 3, fmt::format("mark {}", colour));
    if (path.empty()) return svg;
    std::reverse(lower.begin(), lower.end());
    svg +=
        fmt::format("<polygon points=\"{}{}\" class=\"band {}\"/>\n", upper, fmt::join(lower, ""), colour);
    svg += fmt::format("<path d=\"{}\" class=\"s {} {}\"/>\n", path, colour, dashClass(series.style));
    return svg + markers;
}

/// Points with whiskers, moved sideways by `shift` so that series do not hide each other.
std::string whiskers(const Plot& plot, const PlotLine& series, const Ruler& x, const Ruler& y,
                     double shift) {
    std::string svg;
    for (const PlotPoint& point : series.points) {
        if (!drawable(point, plot)) continue;
        const double at = x.at(point.x) + shift;
        if (std::isfinite(point.low) && std::isfinite(point.high))
            svg += line(at, y.at(point.low), at, y.at(point.high),
                        fmt::format("whisker {}", colourClass(series.style)));
        if (y.contains(point.y)) svg += marker(series.style, at, y.at(point.y), point.text);
    }
    return svg;
}

}  // namespace

std::string escapeXml(const std::string& content) {
    std::string escaped;
    for (const char c : content) {
        switch (c) {
            case '&': escaped += "&amp;"; break;
            case '<': escaped += "&lt;"; break;
            case '>': escaped += "&gt;"; break;
            case '"': escaped += "&quot;"; break;
            // XML has no way to write other control characters.
            default: escaped += static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\t' ? ' ' : c;
        }
    }
    return escaped;
}

std::string svgOfPlot(const Plot& plot) {
    std::vector<double> xs, ys;
    for (const PlotLine& series : plot.lines) {
        for (const PlotPoint& point : series.points) {
            if (!drawable(point, plot)) continue;
            xs.push_back(point.x);
            // On logarithmic axes intervals of few replicates may span decades; they do not get to squeeze
            // the points.
            const bool log = plot.y.scale != AxisScale::Linear;
            ys.insert(ys.end(), {point.y, log ? std::max(point.low, point.y / 3) : point.low,
                                 log ? std::min(point.high, point.y * 3) : point.high});
        }
        if (series.x_mark) xs.push_back(*series.x_mark);
    }
    const double side = plot.bands ? 0.04 : 0.07;
    const auto [x_low, x_high] = rangeOf(plot.x, xs, side);
    const auto [y_low, y_high] = rangeOf(plot.y, ys, 0.05);
    const double bottom = kTop + kPlotHeight;
    const Ruler x(plot.x.scale, x_low, x_high, kLeft, kWidth - kRight),
        y(plot.y.scale, y_low, y_high, bottom, kTop);

    std::string body = gridAndAxes(plot, x, y) + rules(plot, y);
    if (plot.slope_guide) body += slopeGuide(plot, x, y);
    std::vector<LegendEntry> entries;
    const double middle = (static_cast<double>(plot.lines.size()) - 1) / 2;
    const double apart = std::min(6.0, 24.0 / std::max(1.0, static_cast<double>(plot.lines.size())));
    for (std::size_t i = 0; i < plot.lines.size(); ++i) {
        const PlotLine& series = plot.lines[i];
        body += plot.bands ? curve(plot, series, x, y)
                           : whiskers(plot, series, x, y, apart * (static_cast<double>(i) - middle));
        const std::string classes = fmt::format("{} {}", colourClass(series.style), dashClass(series.style));
        const std::string stroke =
            plot.bands ? "<path d=\"M0 0H22\" class=\"s " + classes + "\"/>" : std::string();
        entries.push_back({series.label, stroke + marker(series.style, 11, 0)});
    }
    double height = 0;
    body += legend(entries, 8, bottom + kAxisHeight + 2, height);
    return opening(height, plot.title, plot.description) + body + "</svg>\n";
}

std::string svgOfBars(const BarChart& chart) {
    constexpr double left = 8, label_height = 17, bar_height = 15, gap = 11, top = 6;
    double most = 0;
    for (const Bar& bar : chart.bars) {
        double sum = 0;
        for (const double part : bar.parts) sum += std::isfinite(part) ? part : 0;
        most = std::max({most, sum,
                         bar.whisker && std::isfinite(bar.whisker->second)
                             ? std::min(bar.whisker->second, 2 * sum)
                             : 0});
    }
    const Ruler ruler(AxisScale::Linear, 0, most > 0 ? 1.02 * most : 1, left, kWidth - kRight);
    const double bottom = top + static_cast<double>(chart.bars.size()) * (label_height + bar_height + gap);

    std::string grid, bars;
    for (const Tick& tick : ruler.ticks(5)) {
        grid += line(ruler.at(tick.value), top, ruler.at(tick.value), bottom, "g");
        grid += text(ruler.at(tick.value), bottom + 15, tick.value == 0 ? "t" : "t mid",
                     chart.axis.tick_text(tick.value));
    }
    grid += text(kWidth - kRight, bottom + 33, "n end", chart.axis.label);
    for (std::size_t i = 0; i < chart.bars.size(); ++i) {
        const Bar& bar = chart.bars[i];
        const double y = top + static_cast<double>(i) * (label_height + bar_height + gap);
        bars += text(left, y + 13, "l halo", bar.label) +
                text(kWidth - kRight, y + 13, "v end halo", bar.value_text);
        double sum = 0;
        for (std::size_t part = 0; part < bar.parts.size(); ++part) {
            const double from = ruler.at(sum),
                         to = ruler.at(sum += std::isfinite(bar.parts[part]) ? bar.parts[part] : 0);
            const PlotStyle style{
                bar.parts.size() > 1 ? kFirstPartColour + static_cast<unsigned>(part) : bar.style.colour, 0};
            const std::string tip =
                part < chart.part_names.size()
                    ? fmt::format("<title>{}: {}</title>", escapeXml(chart.part_names[part]),
                                  escapeXml(chart.axis.tick_text(bar.parts[part])))
                    : std::string();
            bars += fmt::format(
                "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" class=\"bar {}\">{}</rect>\n",
                length(from), length(y + label_height), length(to - from), length(bar_height),
                colourClass(style), tip);
        }
        if (bar.whisker) {
            const double low = ruler.at(bar.whisker->first), high = ruler.at(bar.whisker->second),
                         middle = y + label_height + bar_height / 2;
            bars += line(low, middle, high, middle, "error") +
                    line(low, middle - 4, low, middle + 4, "error") +
                    line(high, middle - 4, high, middle + 4, "error");
        }
    }
    std::vector<LegendEntry> entries;
    for (std::size_t part = 0; part < chart.part_names.size(); ++part)
        entries.push_back(
            {chart.part_names[part],
             fmt::format("<rect x=\"8\" y=\"-7\" width=\"14\" height=\"14\" class=\"bar {}\"/>",
                         colourClass({kFirstPartColour + static_cast<unsigned>(part), 0}))});
    double height = bottom + kAxisHeight;
    if (!entries.empty()) bars += legend(entries, 0, bottom + kAxisHeight + 2, height);
    return opening(height, chart.title, chart.description) + grid + bars + "</svg>\n";
}

std::string plotCss() {
    // Okabe and Ito's colours (2008), distinct for all common kinds of colour vision; lightened for dark
    // grounds, where blue and black would sink.
    return R"(:root{--paper:#fff;--ink:#1b1b1f;--muted:#5c5f66;--grid:#e3e5e8;--frame:#a9adb4;
--c0:#0072b2;--c1:#d55e00;--c2:#009e73;--c3:#cc79a7;--c4:#e69f00;--c5:#56b4e9;--c6:#3b3b3b}
@media (prefers-color-scheme:dark){:root{--paper:#15171a;--ink:#e8e9eb;--muted:#a3a8b0;--grid:#2b2f35;
--frame:#5d636c;
--c0:#4aa8e8;--c1:#f2803a;--c2:#27c196;--c3:#e39bc4;--c4:#f0c24b;--c5:#9ad4f5;--c6:#c9ccd1}}
@media print{:root{--paper:#fff;--ink:#000;--muted:#444;--grid:#ddd;--frame:#888;
--c0:#0072b2;--c1:#d55e00;--c2:#009e73;--c3:#cc79a7;--c4:#e69f00;--c5:#56b4e9;--c6:#3b3b3b}}
.plot{display:block;width:100%;height:auto;
font:12px/1.2 system-ui,-apple-system,"Segoe UI",Roboto,"Noto Sans","DejaVu Sans",sans-serif;
font-variant-numeric:tabular-nums;fill:var(--ink)}
.plot .g{stroke:var(--grid);stroke-width:1}.plot .minor{opacity:.5}.plot .frame{fill:none;
stroke:var(--frame)}
.plot .t{fill:var(--muted);font-size:11.5px}.plot .n{font-weight:600}.plot .v{font-size:11.5px}
.plot .mid{text-anchor:middle}.plot .end{text-anchor:end}
.plot .halo{paint-order:stroke;stroke:var(--paper);stroke-width:3px;stroke-linejoin:round}
.plot .c0{--c:var(--c0)}.plot .c1{--c:var(--c1)}.plot .c2{--c:var(--c2)}.plot .c3{--c:var(--c3)}
.plot .c4{--c:var(--c4)}.plot .c5{--c:var(--c5)}.plot .c6{--c:var(--c6)}
.plot .s{fill:none;stroke:var(--c);stroke-width:1.8;stroke-linejoin:round}.plot .d1{stroke-dasharray:5 3}
.plot .d2{stroke-dasharray:2 2.5}.plot .d3{stroke-dasharray:8 3 2 3}
.plot .m{fill:var(--c);stroke:var(--paper);stroke-width:1}.plot .band{fill:var(--c);opacity:.17;stroke:none}
.plot .whisker{stroke:var(--c);stroke-width:1.8}.plot .error{stroke:var(--ink);stroke-width:1.3}
.plot .mark{stroke:var(--c);stroke-width:2.5}
.plot .floor{stroke:var(--c);stroke-width:1.4;stroke-dasharray:7 4;opacity:.9}
.plot .rule{stroke:var(--muted);stroke-width:1}
.plot .guide{stroke:var(--muted);stroke-width:1.5;stroke-dasharray:1.5 3;stroke-linecap:round}
.plot .bar{fill:var(--c)}
)";
}

std::string svgFile(const std::string& svg) {
    const std::string tag = "<svg ";
    std::string file = "<svg xmlns=\"http://www.w3.org/2000/svg\" " + svg.substr(tag.size());
    // After the opening tag; a ground of its own, since a dark viewer need not have a dark page behind it.
    const std::size_t body = file.find('>') + 1;
    file.insert(body, "\n<style>\n" + plotCss() +
                          "</style>\n<rect width=\"100%\" height=\"100%\" fill=\"var(--paper)\"/>");
    return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n" + file;
}

}  // namespace crt::converge
