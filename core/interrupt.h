/// Ctrl-C, kill and a closing terminal, made gentle: the first signal asks the render to stop after the chunk it is working
/// on, so that image and checkpoint are written; the second leaves at once.
#pragma once

#include <csignal>
#include <string>
#include <vector>

namespace crt {

/// Catches SIGINT, SIGTERM and SIGHUP for as long as it lives; one at a time. Outside it the signals end the process as usual,
/// which is right while there is nothing to save. A signal that the parent had set to be ignored (nohup, a background job of a
/// shell script) stays ignored.
class InterruptGuard {
public:
    InterruptGuard();
    ~InterruptGuard();
    InterruptGuard(const InterruptGuard&) = delete;
    InterruptGuard& operator=(const InterruptGuard&) = delete;

    /// The first signal that came since the guard was made, or 0. [any thread]
    static int signalReceived();

private:
    struct Saved {
        int signal;
        struct sigaction action;
    };
    std::vector<Saved> saved_;
};

/// "SIGINT", "SIGTERM", "SIGHUP".
std::string signalName(int signal);

/// The exit code of a process that a signal ended, as shells have it: 130 for SIGINT, 143 for SIGTERM.
inline int signalExitCode(int signal) { return 128 + signal; }

}  // namespace crt
