#include "base/standard_output.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <unistd.h>

namespace crt {
namespace {

int g_first_failure = 0;  // errno

void noteFailure(bool failed) {
    if (failed && g_first_failure == 0) g_first_failure = errno != 0 ? errno : EIO;
}

}  // namespace

void printText(std::string_view text) {
    if (g_first_failure != 0) return;
    errno = 0;
    noteFailure(std::fwrite(text.data(), 1, text.size(), stdout) != text.size());
}

void flushStandardOutput() {
    if (g_first_failure != 0) return;
    errno = 0;
    noteFailure(std::fflush(stdout) != 0);
}

std::optional<Error> finishStandardOutput() {
    flushStandardOutput();
    if (g_first_failure == 0 || g_first_failure == EPIPE) return std::nullopt;
    return Error(ErrorKind::Output,
                 fmt::format("cannot write to standard output: {}", std::strerror(g_first_failure)));
}

void openClosedStreams() {
    for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
        if (::fcntl(descriptor, F_GETFD) >= 0 || errno != EBADF) continue;
        // Opened the wrong way round: reading standard input and writing standard output fail, as they did
        // when they were closed.
        const int opened = ::open("/dev/null", descriptor == STDIN_FILENO    ? O_WRONLY
                                               : descriptor == STDOUT_FILENO ? O_RDONLY
                                                                             : O_WRONLY);
        if (opened >= 0 && opened != descriptor) {
            ::dup2(opened, descriptor);
            ::close(opened);
        }
    }
}

}  // namespace crt
