#include "cli/process/run_program.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>
#include <cerrno>
#include <csignal>
#include <filesystem>
#include <system_error>

extern char** environ;

namespace crt {
namespace {

/// Arguments for exec; they live as long as `words`.
std::vector<char*> pointersTo(std::vector<std::string>& words) {
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    return pointers;
}

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

}  // namespace

EndedProgram runProgram(std::vector<std::string> words) {
    EndedProgram ended;
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) {
        ended.error = errno;
        return ended;
    }
    const pid_t process = spawn(words.front(), pointersTo(words).data(), ends[1], ended.error);
    ::close(ends[1]);
    if (ended.error == 0) {
        ended.said = readToEnd(ends[0]);
        while (::waitpid(process, &ended.status, 0) < 0 && errno == EINTR) {}
    }
    ::close(ends[0]);
    return ended;
}

int becomeProgram(std::vector<std::string> words) {
    ::execvp(words.front().c_str(), pointersTo(words).data());
    return errno;
}

std::string programBeside(const std::string& name) {
    std::error_code unknown;
    const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", unknown);
    return unknown ? std::string() : (self.parent_path() / name).string();
}

}  // namespace crt
