/// The frame around main() that crt and the program of `crt verify` have in common.
#pragma once

#include <functional>

namespace crt {

/// Runs `body` and returns its exit code. Messages go to standard error. An exception becomes one message
/// and an exit code; so does standard output that could not be written.
int runMain(const std::function<int()>& body);

}  // namespace crt
