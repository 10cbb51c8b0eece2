/// The command line: arguments → one of commands.h → exit code. `--help` and `--version` open no backend
/// and no library.
#include "base/error.h"
#include "base/listener.h"
#include "base/log.h"
#include "base/parallel.h"
#include "base/standard_output.h"
#include "cli/command_line.h"
#include "cli/commands.h"
#include "cli/interrupt.h"

#include <fmt/format.h>

#include <cstdlib>
#include <exception>
#include <new>
#include <optional>
#include <string>

namespace {

/// A CUDA context opens queues for eight streams, which takes half of its time; the backend has one stream.
/// Said here, while there is one thread: the environment is everybody's.
void askForOneQueue() { ::setenv("CUDA_DEVICE_MAX_CONNECTIONS", "1", 0); }

}  // namespace

int main(int argc, char** argv) {
    askForOneQueue();
    crt::openClosedStreams();
    crt::ignoreWriteSignals();
    const crt::Listener listener(crt::standardErrorSink());
    const crt::ListenerScope scope(listener);
    // One place turns everything that can be thrown into one line and an exit code.
    try {
        crt::CommandLine line;
        for (crt::Command (*command)() :
             {crt::renderCommand, crt::viewCommand, crt::infoCommand, crt::importCommand,
              crt::compareCommand, crt::mergeCommand, crt::developCommand, crt::convergeCommand,
              crt::referenceCommand, crt::verifyCommand, crt::pluginsCommand, crt::warmCommand,
              crt::dataCommand, crt::schemaCommand, crt::versionCommand})
            line.add(command());
        line.add(crt::helpCommand(line));
        line.add(crt::completionCommand(line));
        const int code = line.run({argv, argv + argc});
        if (const std::optional<crt::Error> lost = crt::finishStandardOutput()) throw *lost;
        return code;
    } catch (const crt::Error& error) {
        const std::string text = error.what();
        // Errors in a scene already contain their places, which editors find only at the start of a line.
        const bool has_places = text.find(": error: ") != std::string::npos;
        crt::logMessage(crt::LogLevel::Error,
                        (has_places ? "the scene cannot be rendered as it is:\n" : "") + text);
        return error.exitCode();
    } catch (const std::bad_alloc&) {
        crt::logMessage(crt::LogLevel::Error, "out of memory on the host");
        return static_cast<int>(crt::ErrorKind::Device);
    } catch (const std::exception& error) {
        crt::logMessage(crt::LogLevel::Error, fmt::format("internal error: {}", error.what()));
        return static_cast<int>(crt::ErrorKind::Internal);
    }
}
