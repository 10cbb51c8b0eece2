#include "cuda_compile_process.h"

#include "cuda_lean_kernel.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <stdexcept>
#include <utility>
#include <vector>

namespace crt::cuda {
namespace {

using plugin::KernelCache;

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

/// A message is a row of byte strings, each after its length in 64 bits.
class Message {
public:
    void add(const void* bytes, std::size_t size) {
        const std::uint64_t length = size;
        append(&length, sizeof length);
        append(bytes, size);
    }
    void add(const std::string& text) { add(text.data(), text.size()); }
    template <class Number>
    void addNumber(Number number) {
        add(&number, sizeof number);
    }
    /// Throws std::runtime_error.
    void writeTo(int descriptor) const {
        for (std::size_t done = 0; done < bytes_.size();) {
            const ssize_t n = ::write(descriptor, bytes_.data() + done, bytes_.size() - done);
            if (n < 0 && errno == EINTR) continue;
            if (n <= 0)
                throw std::runtime_error(std::string("cannot write to the compiler process: ") +
                                         std::strerror(errno));
            done += static_cast<std::size_t>(n);
        }
    }

    /// The message that a file holds from its beginning. Throws std::runtime_error.
    static Message readFrom(int descriptor) {
        struct stat status {};
        if (::fstat(descriptor, &status) != 0)
            throw std::runtime_error("the output of the compiler process cannot be read");
        Message message;
        message.bytes_.resize(static_cast<std::size_t>(status.st_size));
        for (std::size_t done = 0; done < message.bytes_.size();) {
            const ssize_t n = ::pread(descriptor, message.bytes_.data() + done, message.bytes_.size() - done,
                                      static_cast<off_t>(done));
            if (n < 0 && errno == EINTR) continue;
            if (n <= 0) throw std::runtime_error("the output of the compiler process cannot be read");
            done += static_cast<std::size_t>(n);
        }
        return message;
    }
    std::vector<unsigned char> next() {
        std::uint64_t length = 0;
        if (bytes_.size() - taken_ < sizeof length)
            throw std::runtime_error("the output of the compiler process is incomplete");
        std::memcpy(&length, bytes_.data() + taken_, sizeof length);
        taken_ += sizeof length;
        if (bytes_.size() - taken_ < length)
            throw std::runtime_error("the output of the compiler process is incomplete");
        const auto begin = bytes_.begin() + static_cast<std::ptrdiff_t>(taken_);
        taken_ += length;
        return {begin, begin + static_cast<std::ptrdiff_t>(length)};
    }
    std::string nextText() {
        const std::vector<unsigned char> bytes = next();
        return {bytes.begin(), bytes.end()};
    }
    template <class Number>
    Number nextNumber() {
        const std::vector<unsigned char> bytes = next();
        Number number{};
        if (bytes.size() != sizeof number)
            throw std::runtime_error("the compiler process has another version");
        std::memcpy(&number, bytes.data(), sizeof number);
        return number;
    }

private:
    void append(const void* bytes, std::size_t size) {
        const auto* first = static_cast<const unsigned char*>(bytes);
        bytes_.insert(bytes_.end(), first, first + size);
    }
    std::vector<unsigned char> bytes_;
    std::size_t taken_ = 0;
};

/// Memory with a descriptor, which two processes share without either waiting for the other.
int sharedMemory(const char* name) {
    const int descriptor = ::memfd_create(name, MFD_CLOEXEC);
    if (descriptor < 0)
        throw std::runtime_error(std::string("no shared memory for the compiler process: ") +
                                 std::strerror(errno));
    return descriptor;
}

/// Processes that were left behind. Those that have ended meanwhile are forgotten by the system when they
/// are asked for.
void leaveBehind(pid_t process) {
    static std::mutex mutex;
    static auto* const left = new std::vector<pid_t>;  // never destroyed: an integrator may be static itself
    const std::lock_guard<std::mutex> lock(mutex);
    if (process >= 0) left->push_back(process);
    left->erase(std::remove_if(left->begin(), left->end(),
                               [](pid_t p) { return ::waitpid(p, nullptr, WNOHANG) != 0; }),
                left->end());
}

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
    // A separate session: Ctrl-C is for the render.
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

}  // namespace

CompileProcess::CompileProcess(const std::string& program, const CompileJob& job)
    : fills_cache_(!job.cache_directory.empty()) {
    Message message;
    message.add(job.nvrtc_path);
    message.add(job.text);
    message.addNumber(job.arch);
    message.addNumber(job.spec.entry);
    message.addNumber(job.spec.features);
    message.add(job.cache_directory);
    message.add(job.key.data(), job.key.size());
    const Descriptor request(sharedMemory("crt kernel text"));
    message.writeTo(request.get());
    ::lseek(request.get(), 0, SEEK_SET);
    Descriptor answer(sharedMemory("crt kernel"));
    process_ = spawn(plugin::trustedProgram(program), request.get(), answer.get());
    answer_ = answer.release();
}

CompileProcess::~CompileProcess() {
    if (answer_ >= 0) ::close(answer_);
    if (process_ < 0) return;
    if (!fills_cache_) ::kill(process_, SIGKILL);
    leaveBehind(process_);
}

std::optional<CompiledKernel> CompileProcess::poll() {
    if (process_ < 0) throw std::runtime_error("the compiler process is already in use");
    int status = 0;
    const pid_t ended = ::waitpid(process_, &status, WNOHANG);
    if (ended == 0) return std::nullopt;
    process_ = -1;
    leaveBehind(-1);
    // A host that ignores SIGCHLD has no status to ask for: then the answer alone tells.
    if (ended > 0 && WIFSIGNALED(status))
        throw std::runtime_error("the compiler process was ended by signal " +
                                 std::to_string(WTERMSIG(status)));
    Message message = Message::readFrom(answer_);
    const std::string failure = message.nextText();
    if (!failure.empty()) throw std::runtime_error(failure);
    CompiledKernel kernel;
    kernel.cubin = message.next();
    kernel.compile_seconds = message.nextNumber<double>();
    kernel.cache_seconds = message.nextNumber<double>();
    return kernel;
}

std::string compileProgram() {
    Dl_info library{};
    if (::dladdr(reinterpret_cast<const void*>(&compileProgram), &library) == 0 ||
        library.dli_fname == nullptr)
        return "crt_nvrtc";
    const std::string path = library.dli_fname;
    const std::size_t slash = path.rfind('/');
    return (slash == std::string::npos ? std::string() : path.substr(0, slash + 1)) + "crt_nvrtc";
}

int runCompileProcess(int job_descriptor, int answer_descriptor) {
    ::alarm(kMostSeconds);
    Message answer;
    int status = 0;
    try {
        Message request = Message::readFrom(job_descriptor);
        CompileJob job;
        job.nvrtc_path = request.nextText();
        job.text = request.nextText();
        job.arch = request.nextNumber<int>();
        job.spec.entry = request.nextNumber<Entry>();
        job.spec.features = request.nextNumber<std::uint64_t>();
        job.cache_directory = request.nextText();
        const std::vector<unsigned char> key = request.next();
        std::copy_n(key.begin(), std::min(key.size(), job.key.size()), job.key.begin());

        const gpu::Stopwatch compiling;
        const Cubin cubin = compileLean(Nvrtc::open({job.nvrtc_path}), job.text, job.arch, job.spec);
        const double compile_seconds = compiling.seconds();
        const gpu::Stopwatch storing;
        KernelCache(job.cache_directory.empty() ? nullptr : job.cache_directory.c_str())
            .store(job.key, cubin.bytes.data(), cubin.bytes.size());
        answer.add(std::string());
        answer.add(cubin.bytes.data(), cubin.bytes.size());
        answer.addNumber(compile_seconds);
        answer.addNumber(storing.seconds());
    } catch (const std::exception& error) {
        answer = Message();
        answer.add(std::string(error.what()));
        status = 1;
    }
    try {
        answer.writeTo(answer_descriptor);
    } catch (const std::exception&) {
        return 2;
    }
    return status;
}

}  // namespace crt::cuda
