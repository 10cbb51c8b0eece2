/// Ctrl-C, kill and a closing terminal, handled in two steps: the first signal asks the render to stop after
/// the chunk it is working on, so that image and checkpoint are written; the second leaves at once.
#pragma once

#include <csignal>
#include <string>
#include <vector>

namespace crt {

/// Catches SIGINT, SIGTERM, SIGHUP and SIGXCPU (the soft limit on processor time: the hard one, which
/// follows, kills) for as long as it lives; one at a time. Outside it the signals end the process as usual,
/// which is right while there is nothing to save. A signal that the parent had set to be ignored (nohup, a
/// background job of a shell script) stays ignored. SIGXCPU is ignored from the end of a guard that has
/// received it: the system repeats it every second, and a process that ends must keep its exit code.
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

/// From now on, writing to a pipe without a reader (`crt … -v 2>&1 | head -1`) or beyond the limit on file
/// sizes (ulimit -f) fails as writing to a full disk does, and no longer ends the process before its image
/// is written.
void ignoreWriteSignals();

/// "SIGINT", "SIGTERM", "SIGHUP".
std::string signalName(int signal);

/// The exit code of a process that a signal ended, as shells have it: 130 for SIGINT, 143 for SIGTERM, 152
/// for SIGXCPU.
inline int signalExitCode(int signal) { return 128 + signal; }

}  // namespace crt
