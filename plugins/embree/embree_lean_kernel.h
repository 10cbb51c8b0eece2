/// The lean kernel for one scene, compiled by the machine's C++ compiler: compiler, text, options, the key
/// under which it is cached, and machine code that can be called.
#pragma once

#include "tile_job.h"

#include "backend/sdk/compile_process.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace crt::embree {

struct Compiler {
    std::string path;
    std::string identity;  ///< The file behind the path, its size and its time: another one after an update.
};

/// `wanted`, a name or a path, else the first of c++, g++ and clang++ that is in a folder of `search_path`.
/// Either may be null. Throws std::runtime_error with a sentence.
Compiler findCompiler(const char* wanted, const char* search_path);

/// The whole text that is compiled: kernels.h with its includes in their places. `pixel_text` is the host's
/// text of kernel/schedule/pixel.h.
std::string kernelText(const std::string& pixel_text);

/// True for x86-64-v4: the same operations with twice the registers, and comparisons into masks.
bool processorHasAvx512();

/// Arithmetic stays IEEE. The instruction set is that of the kernels that are compiled ahead, or AVX-512
/// where this processor has it.
std::vector<std::string> compilerOptions(const Compiler& compiler, std::uint64_t features);

/// Key of the machine code: everything that decides it.
plugin::KernelCache::Key cacheKey(const std::string& text, const Compiler& compiler, std::uint64_t features);

/// crt_cxx in the folder of the library that this code is part of.
std::string compileProgram();

/// For plugin::CompileProcess.
plugin::CompileMessage messageOf(const std::string& text, const Compiler& compiler, std::uint64_t features);

/// The work of crt_cxx: a shared library. Throws std::runtime_error with the compiler's first error.
std::vector<unsigned char> compileJob(plugin::CompileMessage& message);

/// A shared library in memory, loaded.
class LeanKernel {
public:
    /// Throws std::runtime_error where the bytes are no such library.
    explicit LeanKernel(const std::vector<unsigned char>& code);

    RenderTile render() const { return render_; }
    /// "g++ 12.2.0"
    const std::string& compiler() const { return compiler_; }

private:
    std::shared_ptr<void> library_;
    RenderTile render_ = nullptr;
    std::string compiler_;
};

}  // namespace crt::embree
