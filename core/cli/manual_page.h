/// The manual page crt(1), from the table of commands.
#pragma once

#include "cli/command.h"

#include <string>
#include <vector>

namespace crt {

/// In roff, for `man`.
std::string manualPage(const std::vector<Command>& commands);

}  // namespace crt
