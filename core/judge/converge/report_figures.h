/// The figures of a scene: which curve goes where, and the sentence that says how to read it.
#pragma once

#include "judge/converge/fits.h"
#include "judge/converge/measurement.h"
#include "judge/converge/svg_plot.h"

#include <string>
#include <vector>

namespace crt::converge {

struct Figure {
    std::string file;      ///< "<scene>-work-precision.svg"
    std::string title;
    std::string caption;
    std::string svg;       ///< Without namespace, as it stands in HTML.
};

/// In the order of the report; those without data are not there.
std::vector<Figure> figuresOfScene(const Run& run, const Analysis& analysis, const std::string& scene);

/// The same for the same configuration in every figure: colour says backend, marker and dashes say variant;
/// of one backend, both say variant.
PlotStyle styleOf(const Run& run, const Key& key);

}  // namespace crt::converge
