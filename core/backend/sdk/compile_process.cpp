#include "backend/sdk/compile_process.h"

#include "base/temporary_pattern.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <spawn.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <sstream>
#include <utility>

namespace crt::plugin {
namespace {

/// A compiler that takes longer than this hangs. There may be no process left to end it.
constexpr unsigned kMostSeconds = 120;

/// A descriptor that closes itself.
class Descriptor {
public:
    explicit Descriptor(int number) : number_(number) {}
    ~Descriptor() {
        if (number_ >= 0) ::close(number_);
    }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    int get() const { return number_; }
    int release() { return std::exchange(number_, -1); }

private:
    int number_;
};

/// Memory with a descriptor, which two processes share without either waiting for the other.
int sharedMemory(const char* name) {
    const int descriptor = ::memfd_create(name, MFD_CLOEXEC);
    if (descriptor < 0)
        throw std::runtime_error(std::string("no shared memory for the compiler process: ") +
                                 std::strerror(errno));
    return descriptor;
}

/// Processes that were left behind and may still run.
class LeftBehind {
public:
    struct Process {
        pid_t pid = -1;
        int answer = -1;
        std::string directory;
        KernelCache::Key key{};
    };

    /// Never destroyed: an integrator may be static itself.
    static LeftBehind& list() {
        static auto* const all = new LeftBehind;
        return *all;
    }
    void add(Process process) {
        const std::lock_guard<std::mutex> lock(mutex_);
        processes_.push_back(std::move(process));
        forgetEnded();
    }
    void forget() {
        const std::lock_guard<std::mutex> lock(mutex_);
        forgetEnded();
    }
    /// Takes the process that compiles the kernel of this place.
    std::optional<Process> take(const CompilePlace& place) {
        const std::lock_guard<std::mutex> lock(mutex_);
        forgetEnded();
        const auto found = find(place);
        if (found == processes_.end()) return std::nullopt;
        Process process = std::move(*found);
        processes_.erase(found);
        return process;
    }
    bool mayStart(const CompilePlace& place, std::size_t most) {
        const std::lock_guard<std::mutex> lock(mutex_);
        forgetEnded();
        return processes_.size() < most || find(place) != processes_.end();
    }

private:
    std::vector<Process>::iterator find(const CompilePlace& place) {
        return std::find_if(processes_.begin(), processes_.end(), [&](const Process& process) {
            return process.key == place.key && process.directory == place.cache_directory;
        });
    }
    /// The system forgets a process that has ended when it is asked for.
    void forgetEnded() {
        const auto ended = [](const Process& process) {
            if (::waitpid(process.pid, nullptr, WNOHANG) == 0) return false;
            if (process.answer >= 0) ::close(process.answer);
            return true;
        };
        processes_.erase(std::remove_if(processes_.begin(), processes_.end(), ended), processes_.end());
    }

    std::mutex mutex_;
    std::vector<Process> processes_;
};

/// Held by one process of all that share a cache: the others wait for the kernel that it compiles. Without
/// a cache, or where its folder takes no file, nothing is held.
class CompileLock {
public:
    explicit CompileLock(const std::string& entry) {
        if (entry.empty()) return;
        path_ = entry + ".lock.crttmp";
        descriptor_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0600);
        if (descriptor_ < 0 || ::flock(descriptor_, LOCK_EX | LOCK_NB) == 0) return;
        waited_ = true;
        while (::flock(descriptor_, LOCK_EX) != 0 && errno == EINTR) {}
    }
    /// True if another process held it before.
    bool waited() const { return waited_; }
    ~CompileLock() {
        if (descriptor_ < 0) return;
        // A process that waits for this file finds the kernel, and so does one that makes another file.
        ::unlink(path_.c_str());
        ::close(descriptor_);
    }
    CompileLock(const CompileLock&) = delete;
    CompileLock& operator=(const CompileLock&) = delete;

private:
    std::string path_;
    int descriptor_ = -1;
    bool waited_ = false;
};

/// posix_spawn's settings, given back at the end.
struct SpawnSettings {
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    SpawnSettings() {
        posix_spawn_file_actions_init(&actions);
        posix_spawnattr_init(&attributes);
    }
    ~SpawnSettings() {
        posix_spawn_file_actions_destroy(&actions);
        posix_spawnattr_destroy(&attributes);
    }
    SpawnSettings(const SpawnSettings&) = delete;
    SpawnSettings& operator=(const SpawnSettings&) = delete;
};

pid_t spawn(const std::string& program, int job, int answer) {
    SpawnSettings settings;
    // It keeps no descriptor of the caller open: a reader of the caller's output shall see its end when the
    // caller ends.
    posix_spawn_file_actions_adddup2(&settings.actions, job, STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&settings.actions, answer, STDOUT_FILENO);
    posix_spawn_file_actions_addopen(&settings.actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
#if __GLIBC_PREREQ(2, 34)
    posix_spawn_file_actions_addclosefrom_np(&settings.actions, STDERR_FILENO + 1);
#endif
    // A separate session: Ctrl-C is for the render. It is a group, too, that can be ended as one.
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    posix_spawnattr_setsigmask(&settings.attributes, &none);
    posix_spawnattr_setsigdefault(&settings.attributes, &all);
    posix_spawnattr_setflags(&settings.attributes,
                             POSIX_SPAWN_SETSID | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    char* const arguments[] = {const_cast<char*>(program.c_str()), nullptr};
    pid_t process = -1;
    const int error = ::posix_spawn(&process, program.c_str(), &settings.actions, &settings.attributes,
                                    arguments, environ);
    if (error != 0) throw std::runtime_error("cannot start '" + program + "': " + std::strerror(error));
    return process;
}

/// A folder that is removed with all that is in it.
class WorkFolder {
public:
    WorkFolder() {
        std::string pattern = temporaryPattern(std::filesystem::temp_directory_path());
        if (::mkdtemp(pattern.data()) == nullptr)
            throw std::runtime_error("no folder '" + pattern +
                                     "' for the compiler: " + std::strerror(errno));
        path_ = pattern;
    }
    ~WorkFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    WorkFolder(const WorkFolder&) = delete;
    WorkFolder& operator=(const WorkFolder&) = delete;
    std::string operator/(const char* name) const { return path_ + '/' + name; }

private:
    std::string path_;
};

/// The first line that says an error, or the first line.
std::string firstError(const std::string& log_path) {
    std::ifstream log(log_path);
    std::string first;
    for (std::string line; std::getline(log, line);) {
        if (line.find("error") != std::string::npos) return line.substr(0, 300);
        if (first.empty()) first = line.substr(0, 300);
    }
    return first.empty() ? "it said nothing" : first;
}

std::vector<unsigned char> bytesOf(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    std::ostringstream bytes;
    bytes << file.rdbuf();
    const std::string text = bytes.str();
    return {text.begin(), text.end()};
}

/// Runs a program to its end, with both outputs in a file. Returns its exit status, or −1 times the signal
/// that ended it. Throws std::runtime_error where it cannot be started.
int runProgram(const std::vector<std::string>& command, const std::string& output_file) {
    SpawnSettings settings;
    posix_spawn_file_actions_addopen(&settings.actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&settings.actions, STDOUT_FILENO, output_file.c_str(),
                                     O_WRONLY | O_CREAT | O_TRUNC, 0600);
    posix_spawn_file_actions_adddup2(&settings.actions, STDOUT_FILENO, STDERR_FILENO);
    std::vector<char*> arguments;
    for (const std::string& argument : command) arguments.push_back(const_cast<char*>(argument.c_str()));
    arguments.push_back(nullptr);
    pid_t process = -1;
    const int error = ::posix_spawn(&process, arguments[0], &settings.actions, &settings.attributes,
                                    arguments.data(), environ);
    if (error != 0) throw std::runtime_error("cannot start '" + command[0] + "': " + std::strerror(error));
    int status = 0;
    while (::waitpid(process, &status, 0) < 0)
        if (errno != EINTR) throw std::runtime_error(std::string("waitpid: ") + std::strerror(errno));
    return WIFSIGNALED(status) ? -WTERMSIG(status) : WEXITSTATUS(status);
}

/// Ends this process, and every process that it has started where it leads a group.
void endGroup(int) {
    if (::getpgrp() == ::getpid()) ::kill(0, SIGKILL);
    ::_exit(3);
}

/// Seconds since the first call.
double seconds() {
    using Clock = std::chrono::steady_clock;
    static const Clock::time_point start = Clock::now();
    return std::chrono::duration<double>(Clock::now() - start).count();
}

}  // namespace

CompileProcess::CompileProcess(const std::string& program, const CompilePlace& place,
                               const CompileMessage& job)
    : place_(place) {
    if (fillsCache()) {
        if (const auto left = LeftBehind::list().take(place)) {
            process_ = left->pid;
            answer_ = left->answer;
            return;
        }
    }
    CompileMessage where;
    where.add(place.cache_directory);
    where.add(place.key.data(), place.key.size());
    where.addNumber(place.replaces);
    const Descriptor request(sharedMemory("crt kernel text"));
    where.writeTo(request.get());
    job.writeTo(request.get());
    ::lseek(request.get(), 0, SEEK_SET);
    Descriptor answer(sharedMemory("crt kernel"));
    process_ = spawn(trustedProgram(program), request.get(), answer.get());
    answer_ = answer.release();
}

CompileProcess::~CompileProcess() {
    if (process_ < 0) {
        if (answer_ >= 0) ::close(answer_);
        return;
    }
    if (!fillsCache()) ::kill(-process_, SIGKILL);
    LeftBehind::list().add({process_, answer_, place_.cache_directory, place_.key});
}

bool CompileProcess::mayStart(const CompilePlace& place, std::size_t most) {
    return LeftBehind::list().mayStart(place, most);
}

std::optional<CompiledCode> CompileProcess::poll() {
    if (process_ < 0) throw std::runtime_error("the compiler process is already in use");
    int status = 0;
    const pid_t ended = ::waitpid(process_, &status, WNOHANG);
    if (ended == 0) return std::nullopt;
    process_ = -1;
    LeftBehind::list().forget();
    // A host that ignores SIGCHLD has no status to ask for: then the answer alone tells.
    if (ended > 0 && WIFSIGNALED(status))
        throw std::runtime_error("the compiler process was ended by signal " +
                                 std::to_string(WTERMSIG(status)));
    CompileMessage message = CompileMessage::readFrom(answer_);
    const std::string failure = message.nextText();
    if (!failure.empty()) throw std::runtime_error(failure);
    CompiledCode compiled;
    compiled.code = message.next();
    compiled.compile_seconds = message.nextNumber<double>();
    compiled.cache_seconds = message.nextNumber<double>();
    return compiled;
}

std::vector<unsigned char> runCompiler(const std::vector<std::string>& command, const std::string& text) {
    const WorkFolder folder;
    const std::string source = folder / "kernel.cpp", library = folder / "kernel.so", log = folder / "log";
    std::ofstream(source) << text;
    std::vector<std::string> whole = command;
    whole.insert(whole.end(), {source, "-o", library});
    const int status = runProgram(whole, log);
    const std::string failed = command[0] + " cannot compile the kernel: ";
    if (status != 0)
        throw std::runtime_error(failed +
                                 (status < 0 ? "signal " + std::to_string(-status) : firstError(log)));
    std::vector<unsigned char> code = bytesOf(library);
    if (code.empty()) throw std::runtime_error(failed + "it has made no library");
    return code;
}

std::string programBeside(const void* symbol, const char* name) {
    Dl_info library{};
    if (::dladdr(symbol, &library) == 0 || library.dli_fname == nullptr) return name;
    const std::string path = library.dli_fname;
    const std::size_t slash = path.rfind('/');
    return (slash == std::string::npos ? std::string() : path.substr(0, slash + 1)) + name;
}

int runCompileProcess(const char* name,
                      const std::function<std::vector<unsigned char>(CompileMessage& job)>& compile) {
    if (::isatty(STDIN_FILENO) != 0 || ::isatty(STDOUT_FILENO) != 0) {
        std::fprintf(stderr,
                     "%s compiles kernels for a backend of crt, which starts it when needed; do not "
                     "run it by hand\n",
                     name);
        return 2;
    }
    std::signal(SIGALRM, endGroup);
    ::alarm(kMostSeconds);
    CompileMessage answer;
    int status = 0;
    try {
        CompileMessage job = CompileMessage::readFrom(STDIN_FILENO);
        CompilePlace place;
        place.cache_directory = job.nextText();
        const std::vector<unsigned char> key = job.next();
        std::copy_n(key.begin(), std::min(key.size(), place.key.size()), place.key.begin());
        place.replaces = job.nextNumber<bool>();

        const KernelCache cache(place.cache_directory.empty() ? nullptr : place.cache_directory.c_str());
        const CompileLock lock(cache.path(place.key));
        double compile_seconds = 0, began = seconds();
        // Another process may have stored the kernel since the backend looked for it.
        std::optional<std::vector<unsigned char>> code;
        if (!place.replaces || lock.waited()) code = cache.load(place.key);
        if (!code) {
            began = seconds();
            code = compile(job);
            compile_seconds = seconds() - began;
            began = seconds();
            cache.store(place.key, code->data(), code->size());
        }
        answer.add(std::string());
        answer.add(code->data(), code->size());
        answer.addNumber(compile_seconds);
        answer.addNumber(seconds() - began);
    } catch (const std::exception& error) {
        answer = CompileMessage();
        answer.add(std::string(error.what()));
        status = 1;
    }
    try {
        answer.writeTo(STDOUT_FILENO);
    } catch (const std::exception&) {
        return 2;
    }
    return status;
}

}  // namespace crt::plugin
