/// One self-contained page: findings, tables, figures, maps, environment. No script, no request to anywhere;
/// reads on a phone, in the dark, and printed.
#pragma once

#include "judge/converge/fits.h"
#include "judge/converge/measurement.h"

#include <string>
#include <vector>

namespace crt::converge {

/// Writes report.html into `folder`, and beside it its figures as SVG and its maps as PNG. Returns the names
/// of all files written. Where maps cannot be written (no image codec), the page says so. Throws
/// crt::Error(Output).
std::vector<std::string> writeReport(const std::string& folder, const Run& run, const Analysis& analysis);

}  // namespace crt::converge
