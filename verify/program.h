/// The program behind `crt verify`: `crt_conformance verify OPTIONS`.
#pragma once

#include <string>
#include <vector>

namespace crt::verify {

/// Reads the options of `crt verify`, in their long form with each value as a separate word, and runs the
/// cases. Returns the exit code: 0 when every case passes or does not apply; 7 when one fails or is
/// inconclusive; 128 + signal when interrupted. Throws crt::Error.
int runSuite(const std::vector<std::string>& words);

}  // namespace crt::verify
