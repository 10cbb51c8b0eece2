#include "base/standard_output.h"
#include "cli/command_line.h"
#include "cli/commands.h"

namespace crt {

Command versionCommand() {
    return {.name = "version",
            .summary = "print the version of crt, as --version does",
            .run = [](const std::string&) {
                printOut("{}\n", versionText());
                return 0;
            }};
}

}  // namespace crt
