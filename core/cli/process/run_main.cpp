#include "cli/process/run_main.h"

#include "base/error.h"
#include "base/listener.h"
#include "base/log.h"
#include "base/standard_output.h"
#include "cli/process/interrupt.h"

#include <fmt/format.h>

#include <exception>
#include <new>
#include <optional>
#include <string>

namespace crt {

int runMain(const std::function<int()>& body) {
    openClosedStreams();
    ignoreWriteSignals();
    const Listener listener(standardErrorSink());
    const ListenerScope scope(listener);
    // One place turns everything that can be thrown into one line and an exit code.
    try {
        const int code = body();
        if (const std::optional<Error> lost = finishStandardOutput()) throw *lost;
        return code;
    } catch (const Error& error) {
        const std::string text = error.what();
        // Errors in a scene already contain their places, which editors find only at the start of a line.
        const bool has_places = text.find(": error: ") != std::string::npos;
        logMessage(LogLevel::Error, (has_places ? "crt cannot use the scene:\n" : "") + text);
        return error.exitCode();
    } catch (const std::bad_alloc&) {
        logMessage(LogLevel::Error, "out of memory on the host");
        return static_cast<int>(ErrorKind::Device);
    } catch (const std::exception& error) {
        logMessage(LogLevel::Error, fmt::format("internal error: {}", error.what()));
        return static_cast<int>(ErrorKind::Internal);
    }
}

}  // namespace crt
