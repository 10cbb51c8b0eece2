#include "cli/python.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <system_error>

extern char** environ;

namespace crt {
namespace {

/// Ends with code 0 where there is a package crt that imports scenes of others: PyPI has another package of
/// the name. Modules in the working directory are not run.
constexpr const char* kPackageIsThere =
    "import importlib.util, os, sys\n"
    "sys.path[:] = [folder for folder in sys.path if folder]\n"
    "found = importlib.util.find_spec('crt')\n"
    "places = found and found.submodule_search_locations or []\n"
    "sys.exit(not any(os.path.isfile(os.path.join(place, 'foreign_scenes.py')) for place in places))\n";

/// python -m crt, but for the working directory.
constexpr const char* kRunPackage =
    "import runpy, sys\n"
    "sys.path[:] = [folder for folder in sys.path if folder]\n"
    "runpy.run_module('crt', run_name='__main__', alter_sys=True)\n";

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

std::string pythonProgram() {
    const char* const named = std::getenv("CRT_PYTHON");
    return named != nullptr ? named : "python3";
}

EndedProgram runProgram(std::vector<std::string> words) {
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    EndedProgram ended;
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

void becomePythonPackage(const std::vector<std::string>& arguments) {
    const std::string python = pythonProgram();
    if (python.empty()) return;
    const EndedProgram looked = runProgram({python, "-c", kPackageIsThere});
    if (looked.error != 0 || looked.status != 0) return;
    std::error_code unknown;
    if (const auto self = std::filesystem::read_symlink("/proc/self/exe", unknown); !unknown)
        ::setenv("CRT_PROGRAM", self.c_str(), 1);
    std::vector<std::string> words{python, "-c", kRunPackage};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    for (const int ignored : {SIGPIPE, SIGXFSZ}) std::signal(ignored, SIG_DFL);
    ::execvp(python.c_str(), pointers.data());
}

}  // namespace crt
