#include "cli/process/interrupt.h"

#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <ctime>
#include <string_view>

namespace crt {
namespace {

std::atomic<int> g_signal{0};
std::atomic<std::int64_t> g_first_at{0};
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<std::int64_t>::is_always_lock_free,
              "a signal handler may touch nothing that takes a lock");

// timeout(1) signals its child and then the child's process group, so one wish to stop arrives twice within
// microseconds. No person presses Ctrl-C twice this fast.
constexpr std::int64_t kOneWishNanoseconds = 200'000'000;

std::int64_t monotonicNanoseconds() {
    timespec t{};
    clock_gettime(CLOCK_MONOTONIC, &t);
    return static_cast<std::int64_t>(t.tv_sec) * 1'000'000'000 + t.tv_nsec;
}

// Only what POSIX lists as safe in a handler: atomics, clock_gettime(), write() and _exit().
extern "C" void onSignal(int signal) {
    const int saved_errno = errno;
    if (g_signal != 0) {
        // The system repeats SIGXCPU every second until the hard limit: no wish to leave at once.
        if (signal == SIGXCPU) return;
        if (monotonicNanoseconds() - g_first_at >= kOneWishNanoseconds) _exit(signalExitCode(signal));
        errno = saved_errno;
        return;
    }
    // The time first: a second signal on another thread must never see a signal without its time.
    g_first_at = monotonicNanoseconds();
    g_signal = signal;
    constexpr std::string_view text = "\ncrt: finishing the current chunk; press Ctrl-C again to stop "
                                      "immediately\n";
    // A terminal has just shown ^C on the line of the bar, so a person there gets an answer; a log file gets
    // the report.
    if (signal == SIGINT && isatty(STDERR_FILENO) != 0 &&
        ::write(STDERR_FILENO, text.data(), text.size()) < 0) {
        // Nothing can be done about it here.
    }
    errno = saved_errno;
}

}  // namespace

InterruptGuard::InterruptGuard() {
    g_signal = 0;
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGXCPU}) {
        struct sigaction before {};
        sigaction(signal, nullptr, &before);
        if (before.sa_handler == SIG_IGN) continue;
        struct sigaction action {};
        action.sa_handler = onSignal;
        action.sa_flags = SA_RESTART;  // A write() of an image goes on as if nothing had happened.
        sigemptyset(&action.sa_mask);
        sigaction(signal, &action, nullptr);
        saved_.push_back({signal, before});
    }
}

InterruptGuard::~InterruptGuard() {
    for (const Saved& s : saved_) sigaction(s.signal, &s.action, nullptr);
    // The system sends the next SIGXCPU a second after the first, perhaps while the process ends.
    if (g_signal == SIGXCPU) std::signal(SIGXCPU, SIG_IGN);
}

void ignoreWriteSignals() {
    for (const int signal : {SIGPIPE, SIGXFSZ}) std::signal(signal, SIG_IGN);
}

int InterruptGuard::signalReceived() { return g_signal.load(std::memory_order_relaxed); }

std::string signalName(int signal) {
    switch (signal) {
        case SIGINT: return "SIGINT";
        case SIGTERM: return "SIGTERM";
        case SIGHUP: return "SIGHUP";
        case SIGXCPU: return "SIGXCPU (the limit on processor time)";
        default: return "signal " + std::to_string(signal);
    }
}

}  // namespace crt
