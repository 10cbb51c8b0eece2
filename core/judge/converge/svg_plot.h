/// Plots as SVG: curves with bands on logarithmic axes, intervals, bars. Drawn 400 units wide with text of
/// 12, so that they stay legible on a phone; colours are CSS custom properties (plotCss), so that they
/// follow light, dark and print.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace crt::converge {

/// How a series is told from others, also without colour: 7 colours of Okabe and Ito, 4 markers and dash
/// patterns. Taken modulo those.
struct PlotStyle {
    unsigned colour = 0;
    unsigned marker = 0;
};

struct PlotPoint {
    double x = 0, y = 0;
    double low = 0, high = 0;  ///< Of y; not finite when unknown, and cut off at the frame.
    std::string text;          ///< Shown when pointed at.
};

struct PlotLine {
    std::string label;
    PlotStyle style;
    std::vector<PlotPoint> points;
    std::optional<double> floor;   ///< A dashed level in the line's colour: what it will not fall below.
    std::optional<double> x_mark;  ///< A tick in the line's colour on the x axis.
};

enum class AxisScale {
    Log,     ///< Labels at decades, or 1, 2, 5.
    Log2,    ///< Labels at powers of two.
    Linear,
};

struct Axis {
    std::string label;  ///< With its unit.
    AxisScale scale = AxisScale::Log;
    std::function<std::string(double)> tick_text;
    std::optional<std::pair<double, double>> range;  ///< Otherwise what points need.
};

/// A horizontal line across the plot.
struct PlotRule {
    double y = 0;
    std::string label;
    bool dashed = true;
};

struct Plot {
    std::string title, description;  ///< For those who hear it, and of the file.
    Axis x, y;
    std::vector<PlotLine> lines;
    bool bands =
        true;  ///< Intervals as bands along a line; otherwise as whiskers, series side by side, no line.
    std::vector<PlotRule> rules;     ///< Left out where they lie outside the range.
    std::optional<double>
        slope_guide;  ///< On logarithmic axes: a dotted line of this slope, above the points.
};

/// An <svg> element without namespace, as it stands in HTML.
std::string svgOfPlot(const Plot& plot);

struct Bar {
    std::string label, value_text;
    PlotStyle style;                 ///< Of a bar that is not stacked.
    std::vector<double> parts;       ///< Stacked from 0; one for a simple bar.
    std::optional<std::pair<double, double>> whisker;
};

struct BarChart {
    std::string title, description;
    Axis axis;                            ///< Linear, from 0.
    std::vector<std::string> part_names;  ///< Legend of stacked bars; empty for simple ones.
    std::vector<Bar> bars;
};

std::string svgOfBars(const BarChart& chart);

/// Custom properties and rules that plots need, for a page's <style>.
std::string plotCss();
/// The element as a file of its own.
std::string svgFile(const std::string& svg);

/// For text in XML and HTML, in quotes or out.
std::string escapeXml(const std::string& text);

}  // namespace crt::converge
