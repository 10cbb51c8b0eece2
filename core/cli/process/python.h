/// The Python that runs the parts of crt that are written in it: pages of reports, scenes of other
/// renderers, denoising.
#pragma once

#include <string>
#include <vector>

namespace crt {

/// The Python of CRT_PYTHON, else python3. Empty if CRT_PYTHON is empty, which means: use no Python.
std::string pythonProgram();

/// Puts `python -m crt ARGUMENTS` in the place of this process; does not return then. Returns where that
/// Python has no package that takes them. Of a scene of another renderer the package runs this very program
/// in turn.
void becomePythonPackage(const std::vector<std::string>& arguments);

}  // namespace crt
