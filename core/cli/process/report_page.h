/// Pages of what a run has written, made by Python (python/crt/report): its libraries draw and lay out, and
/// a run without them has its figures all the same.
#pragma once

#include <optional>
#include <string>

namespace crt {

/// Makes the page of a folder with the Python that CRT_PYTHON names, else with python3, and waits for it.
/// Returns nothing where it is there, else a sentence: why it is not, and the command that makes it. An
/// empty CRT_PYTHON asks for none.
std::optional<std::string> makeReportPage(const std::string& folder);

}  // namespace crt
