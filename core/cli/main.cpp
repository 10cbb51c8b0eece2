/// The command line: arguments → one of commands.h → exit code. `--help` and `--version` open no backend
/// and no library.
#include "cli/command_line.h"
#include "cli/commands.h"
#include "cli/process/run_main.h"

#include <cstdlib>

namespace {

/// A CUDA context opens queues for eight streams, which takes half of its time; the backend has one stream.
/// Said here, while there is one thread: the environment is everybody's.
void askForOneQueue() { ::setenv("CUDA_DEVICE_MAX_CONNECTIONS", "1", 0); }

}  // namespace

int main(int argc, char** argv) {
    askForOneQueue();
    return crt::runMain([&] {
        crt::CommandLine line;
        for (crt::Command (*command)() :
             {crt::renderCommand, crt::sequenceCommand, crt::viewCommand, crt::infoCommand,
              crt::importCommand, crt::compareCommand, crt::mergeCommand, crt::developCommand,
              crt::denoiseCommand, crt::convergeCommand, crt::referenceCommand, crt::verifyCommand,
              crt::pluginsCommand, crt::warmCommand, crt::dataCommand, crt::schemaCommand,
              crt::versionCommand})
            line.add(command());
        line.add(crt::helpCommand(line));
        line.add(crt::completionCommand(line));
        return line.run({argv, argv + argc});
    });
}
