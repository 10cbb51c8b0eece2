/// A compiler in a separate process, for backends that compile kernels while they run.
///
/// A compiler may take long, may hang, and as a library cannot be told to stop. A separate process is left
/// behind where its kernel comes too late: it puts the kernel into the cache, for the next run, and ends
/// (docs/decisions/0011-compiler-process.md). The plugin starts a small program beside it; both sides are
/// here.
#pragma once

#include "backend/sdk/compile_message.h"
#include "backend/sdk/kernel_cache.h"

#include <sys/types.h>

#include <cstdint>
#include <cstring>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace crt::plugin {

/// The place that the process keeps the kernel in.
struct CompilePlace {
    std::string cache_directory;  ///< Empty: none; then only the process that waits could use the kernel.
    KernelCache::Key key{};
    bool replaces = false;  ///< The backend refuses the kernel that is there.
};

struct CompiledCode {
    std::vector<unsigned char> code;
    double compile_seconds = 0, cache_seconds = 0;
};

class CompileProcess {
public:
    /// Starts `program`, which reads `job`, or takes over the process that an earlier object has left behind
    /// with the same kernel. Throws std::runtime_error with one sentence.
    CompileProcess(const std::string& program, const CompilePlace& place, const CompileMessage& job);
    /// Leaves the process alone when it has a cache to fill, and ends it otherwise. Waits for nothing.
    ~CompileProcess();
    CompileProcess(const CompileProcess&) = delete;
    CompileProcess& operator=(const CompileProcess&) = delete;

    /// The kernel, once; nothing while it is compiled. Throws std::runtime_error when it cannot be.
    std::optional<CompiledCode> poll();

    /// True if fewer than `most` processes were left behind and still run, or if one of them compiles this
    /// kernel. [any thread]
    static bool mayStart(const CompilePlace& place, std::size_t most);

private:
    bool fillsCache() const { return !place_.cache_directory.empty(); }

    CompilePlace place_;
    pid_t process_ = -1;  ///< −1: it has ended.
    int answer_ = -1;
};

/// The shared library that a command-line compiler makes of `text`: runs `command`, followed by the source,
/// "-o" and the library. Throws std::runtime_error with the compiler's first error.
std::vector<unsigned char> runCompiler(const std::vector<std::string>& command, const std::string& text);

/// The program `name` in the folder of the library or program that `symbol` is part of.
std::string programBeside(const void* symbol, const char* name);

/// The main function of such a program, named `name`: reads the job from standard input, compiles, stores,
/// and writes the answer to standard output. Returns the exit status.
int runCompileProcess(const char* name,
                      const std::function<std::vector<unsigned char>(CompileMessage& job)>& compile);

}  // namespace crt::plugin
