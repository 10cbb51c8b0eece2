/// Other programs: to wait for one, or to become one.
#pragma once

#include <string>
#include <vector>

namespace crt {

/// The exit of a program and its standard error.
struct EndedProgram {
    int error = 0;   ///< Of starting it, as in errno.
    int status = 0;  ///< Of waitpid.
    std::string said;
};

/// Runs it and waits, without input and without its output.
EndedProgram runProgram(std::vector<std::string> words);

/// Puts a program in the place of this process; `words` begins with its path, or with a name that is looked
/// up in PATH. Returns only if it cannot be started, with the number of the error, as in errno.
int becomeProgram(std::vector<std::string> words);

/// The path of a program in the folder of this one; empty if the system does not tell where that is.
std::string programBeside(const std::string& name);

}  // namespace crt
