#include "view/serve.h"

#include "base/log.h"
#include "base/standard_output.h"
#include "base/temporary_folder.h"
#include "view/http_server.h"
#include "view/pages.h"

#include <fmt/format.h>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>

extern char** environ;

namespace crt {
namespace {

/// Signals that end the view, held back from all threads that are started while it lives.
class EndSignals {
public:
    EndSignals() {
        sigemptyset(&ends_);
        for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
            struct sigaction now {};
            sigaction(signal, nullptr, &now);
            if (now.sa_handler != SIG_IGN) sigaddset(&ends_, signal);  // As nohup wants it.
        }
        pthread_sigmask(SIG_BLOCK, &ends_, &before_);
    }
    ~EndSignals() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
    EndSignals(const EndSignals&) = delete;
    EndSignals& operator=(const EndSignals&) = delete;

    void wait() const {
        int signal = 0;
        while (sigwait(&ends_, &signal) != 0) {}
    }
    const sigset_t& before() const { return before_; }

private:
    sigset_t ends_{}, before_{};
};

bool hasDesktop() {
    const auto is_set = [](const char* name) {
        const char* const value = std::getenv(name);
        return value != nullptr && *value != '\0';
    };
    return is_set("DISPLAY") || is_set("WAYLAND_DISPLAY");
}

/// False: there is no xdg-open. The messages of a browser about itself do not belong in the terminal.
bool openInBrowser(const std::string& address, const sigset_t& signals) {
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        posix_spawn_file_actions_addopen(&files, stream, "/dev/null", O_RDWR, 0);
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setsigmask(&attributes, &signals);
    posix_spawnattr_setpgroup(&attributes, 0);  // Ctrl-C is not for it.
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETPGROUP);
    std::string program = "xdg-open", argument = address;
    char* const arguments[] = {program.data(), argument.data(), nullptr};
    pid_t child = 0;
    const bool started = posix_spawnp(&child, program.c_str(), &files, &attributes, arguments, environ) == 0;
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&files);
    if (started) std::thread([child] { ::waitpid(child, nullptr, 0); }).detach();
    return started;
}

/// An HTML page that forwards to `address`. All users can read command lines, and the address contains the
/// token.
std::string pageThatLeadsTo(const std::string& address) {
    return fmt::format(
        "<!doctype html><meta charset=\"utf-8\"><meta name=\"referrer\" content=\"no-referrer\">"
        "<title>crt view</title><meta http-equiv=\"refresh\" content=\"0;url={0}\">"
        "<a href=\"{0}\">crt view</a>\n",
        address);
}

/// Parent of a private folder: $XDG_RUNTIME_DIR, or the folder for temporary files.
std::filesystem::path privateParent() {
    const char* const runtime = std::getenv("XDG_RUNTIME_DIR");
    std::error_code none;
    if (runtime != nullptr && std::filesystem::is_directory(runtime, none)) return runtime;
    return std::filesystem::temp_directory_path();
}

/// Reading a large scene cannot be cancelled, and there is nothing to save: a thread that still works then
/// is left.
void leaveSoon() {
    std::thread([] {
        constexpr std::chrono::milliseconds kPatience{600};
        std::this_thread::sleep_for(kPatience);
        std::_Exit(EXIT_SUCCESS);
    }).detach();
}

}  // namespace

void serveView(const ViewOptions& view, const ServeOptions& serve) {
    const EndSignals signals;
    const std::string token = serve.token.empty() ? randomToken() : serve.token;
    Viewer viewer(view);
    const HttpServer server(serve.port, token,
                            [&](const HttpRequest& request) { return answerPage(viewer, request); });
    const std::string address = fmt::format("http://127.0.0.1:{}/?token={}", server.port(), token);
    printOut("{}\n", address);
    flushStandardOutput();
    std::optional<TemporaryFolder> folder;  // Mode 0700.
    bool opened = false;
    if (serve.open_browser && hasDesktop()) {
        folder.emplace(privateParent());
        opened = openInBrowser("file://" + folder->write("view.html", pageThatLeadsTo(address)),
                               signals.before());
    }
    logInfo("{}; press Ctrl-C to stop",
            opened ? "the view is in the browser" : "open the address above in a browser");
    signals.wait();
    leaveSoon();
    viewer.stop();
}

}  // namespace crt
