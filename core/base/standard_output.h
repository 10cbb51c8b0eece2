/// Prints the results of commands on standard output. Printing does not throw: a full disk is reported once,
/// at the end, and a reader that has had enough (`crt schema | head -1`) is no fault.
#pragma once

#include <fmt/format.h>

#include <optional>
#include <string_view>
#include <utility>

#include "base/error.h"

namespace crt {

void printText(std::string_view text);

template <class... Args>
void printOut(fmt::format_string<Args...> format, Args&&... args) {
    printText(fmt::format(format, std::forward<Args>(args)...));
}

/// Sends on what has been printed so far.
void flushStandardOutput();

/// The same at the end of the program: crt::Error(Output) when something was lost, other than to a closed
/// pipe.
std::optional<Error> finishStandardOutput();

/// Opens standard streams that were closed when crt started on /dev/null, so that no output file gets their
/// number and their text.
void openClosedStreams();

}  // namespace crt
