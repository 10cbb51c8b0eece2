/// Completion of crt's command line by the shells bash, zsh and fish, from the table of commands.
#pragma once

#include "cli/command.h"

#include <string>
#include <vector>

namespace crt {

/// Scripts that the shell reads; one for each.
std::string bashCompletion(const std::vector<Command>& commands);
std::string zshCompletion(const std::vector<Command>& commands);
std::string fishCompletion(const std::vector<Command>& commands);

}  // namespace crt
