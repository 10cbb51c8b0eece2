/// Words as a line for a shell, to be copied from a message.
#pragma once

#include <string>
#include <vector>

namespace crt {

/// The arguments as one line that a POSIX shell reads back as them.
std::string shellLine(const std::vector<std::string>& words);

}  // namespace crt
