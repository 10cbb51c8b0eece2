#include "base/standard_output.h"
#include "cli/command_line.h"
#include "cli/commands.h"
#include "cli/manual_page.h"

#include <memory>
#include <string>

namespace crt {

Command helpCommand(const CommandLine& all) {
    struct State {
        std::string command;
        bool man = false;
    };
    const auto state = std::make_shared<State>();
    return {.name = "help",
            .summary = "explain a command, as its --help does",
            .arguments = {{.name = "COMMAND",
                           .help = "command to explain; by default crt itself",
                           .read = [state](const std::string& text) { state->command = text; },
                           .completion = {Completion::Kind::Command},
                           .required = false}},
            .groups = {{"Options",
                        {{.names = "--man",
                          .placeholder = {},
                          .help = "print the manual page crt(1), in roff",
                          .read = [state](const std::string&) { state->man = true; }}}}},
            .run = [state, &all](const std::string&) {
                printOut("{}", state->man ? manualPage(all.commands()) : all.help(state->command));
                return 0;
            }};
}

}  // namespace crt
