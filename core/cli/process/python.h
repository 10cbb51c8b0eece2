/// The Python that runs what crt has written in it: pages of reports, and scenes of other renderers.
#pragma once

#include <string>
#include <vector>

namespace crt {

/// The Python of CRT_PYTHON, else python3. Empty if CRT_PYTHON is empty, which means: use no Python.
std::string pythonProgram();

/// Puts `python -m crt ARGUMENTS`, a command and a scene of another renderer, in the place of this process;
/// does not return then. Returns where that Python has no package that takes them. The package imports the
/// scene and runs this very program in turn.
void becomePythonPackage(const std::vector<std::string>& arguments);

}  // namespace crt
