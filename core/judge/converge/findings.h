/// The results of a run in sentences: the first configuration and its lead, any bias, the reliability of
/// stated errors, and missing data.
#pragma once

#include "judge/converge/fits.h"
#include "judge/converge/measurement.h"

#include <string>
#include <vector>

namespace crt::converge {

enum class Tone {
    Good,     ///< As it should be.
    Neutral,  ///< A figure.
    Warning,  ///< Not shown, not measured, or not to be trusted.
    Bad,      ///< Wrong.
};

struct Finding {
    Tone tone = Tone::Neutral;
    std::string text;  ///< One or two sentences, plain text.
};

/// About one scene. The first is the headline.
std::vector<Finding> findingsOfScene(const Run& run, const Analysis& analysis, const std::string& scene);

/// The scenes of a run, in the order of its configurations.
std::vector<std::string> scenesOf(const Run& run);

/// One line for the terminal: the error at the most samples and its slope as far as they are known, and the
/// verdict.
std::string verdictLine(const ConfigurationFit& fit);

/// "embree, sampler=sobol": a configuration within its scene.
std::string labelOf(const Key& key);

}  // namespace crt::converge
