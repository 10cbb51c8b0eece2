#include "cli/report_page.h"

#include "base/code_trust.h"
#include "base/modules.h"
#include "cli/arguments.h"

#include <fmt/format.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

extern char** environ;

namespace crt {
namespace {

/// How a program ended, and what it said on stderr.
struct Ended {
    int error = 0;   ///< Of starting it, as in errno.
    int status = 0;  ///< Of waitpid.
    std::string said;
};

std::string readToEnd(int descriptor) {
    std::string text;
    char buffer[4096];
    for (ssize_t count = 0; (count = ::read(descriptor, buffer, sizeof buffer)) != 0;) {
        if (count < 0 && errno != EINTR) break;
        if (count > 0) text.append(buffer, static_cast<std::size_t>(count));
    }
    return text;
}

/// Ctrl-C ends it as it ends any program, whatever this one does about it.
pid_t spawn(const std::string& program, char* const* arguments, int error_output, int& error) {
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    posix_spawn_file_actions_init(&actions);
    posix_spawnattr_init(&attributes);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, error_output, STDERR_FILENO);
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &all);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    pid_t process = -1;
    error = ::posix_spawnp(&process, program.c_str(), &actions, &attributes, arguments, environ);
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
    return process;
}

Ended runProgram(std::vector<std::string> words) {
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    Ended ended;
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) {
        ended.error = errno;
        return ended;
    }
    const pid_t process = spawn(words.front(), arguments.data(), ends[1], ended.error);
    ::close(ends[1]);
    if (ended.error == 0) {
        ended.said = readToEnd(ends[0]);
        while (::waitpid(process, &ended.status, 0) < 0 && errno == EINTR) {}
    }
    ::close(ends[0]);
    return ended;
}

/// The last line, which is the sentence of an error in Python, too, without the name of who says it.
std::string lastLine(std::string text) {
    while (!text.empty() && text.back() == '\n') text.pop_back();
    const std::size_t line = text.rfind('\n');
    if (line != std::string::npos) text.erase(0, line + 1);
    const std::string prefix = "crt: error: ";
    return text.starts_with(prefix) ? text.substr(prefix.size()) : text;
}

std::string whyNot(const std::string& python, const Ended& ended) {
    if (ended.error != 0) return fmt::format("cannot start '{}': {}", python, std::strerror(ended.error));
    if (WIFSIGNALED(ended.status))
        return fmt::format("'{}' was ended by signal {}", python, WTERMSIG(ended.status));
    const std::string said = lastLine(ended.said);
    return said.empty() ? fmt::format("'{}' ended with code {}", python, WEXITSTATUS(ended.status)) : said;
}

}  // namespace

std::optional<std::string> makeReportPage(const std::string& folder) {
    const char* named = std::getenv("CRT_PYTHON");
    const std::string python = named != nullptr ? named : "python3", program = reportProgram();
    const std::string command =
        program.empty() ? shellLine({"python", "-m", "crt", "report", folder})
                        : shellLine({python.empty() ? "python3" : python, program, folder});
    if (python.empty())
        return fmt::format("there is no page, as CRT_PYTHON asks; this makes it: {}", command);
    if (program.empty())
        return fmt::format("there is no page: its program is not installed; this makes it: {}", command);
    const trust::Judged judged = trust::judgeTree(program);
    if (!judged.why.empty())
        return fmt::format("there is no page: its program is refused: {}; then this makes it: {}",
                           judged.why, command);
    // -B: nothing is written where the program is installed.
    const Ended ended = runProgram({python, "-B", judged.path, std::filesystem::absolute(folder).string()});
    if (ended.error == 0 && ended.status == 0) return std::nullopt;
    return fmt::format("there is no page: {}; this makes it: {}", whyNot(python, ended), command);
}

}  // namespace crt
