#include "embree_lean_kernel.h"

#include "kernels_text.h"
#include "tile_job_text.h"
#include "traversal_text.h"

#include <dlfcn.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <sstream>
#include <stdexcept>

namespace crt::embree {

using plugin::CompileMessage;
using plugin::KernelCache;

namespace {

constexpr const char* kEntry = "crt_embree_render";
constexpr const char* kCompilerName = "crt_embree_compiler";

std::vector<std::string> split(const std::string& text, char separator) {
    std::vector<std::string> parts;
    std::istringstream stream(text);
    for (std::string part; std::getline(stream, part, separator);)
        if (!part.empty()) parts.push_back(part);
    return parts;
}

/// The path of a program that may be run, or nothing.
std::string programAt(const std::string& path) {
    struct stat status {};
    const bool runs =
        ::stat(path.c_str(), &status) == 0 && S_ISREG(status.st_mode) && ::access(path.c_str(), X_OK) == 0;
    return runs ? path : std::string();
}

std::string inFolders(const std::string& name, const char* search_path) {
    for (const std::string& folder : split(search_path != nullptr ? search_path : "", ':'))
        if (folder[0] == '/')
            if (const std::string path = programAt(folder + '/' + name); !path.empty()) return path;
    return {};
}

Compiler compilerAt(const std::string& path) {
    const std::filesystem::path file = std::filesystem::canonical(path);
    struct stat status {};
    if (::stat(file.c_str(), &status) != 0) throw std::runtime_error(path + ": " + std::strerror(errno));
    return {path, file.string() + ' ' + std::to_string(status.st_size) + ' ' +
                      std::to_string(status.st_mtim.tv_sec) + '.' + std::to_string(status.st_mtim.tv_nsec)};
}

}  // namespace

bool processorHasAvx512() {
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
           __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512vl");
}

Compiler findCompiler(const char* wanted, const char* search_path) {
    if (wanted != nullptr && *wanted != '\0') {
        const std::string name = wanted;
        const std::string path =
            name.find('/') != std::string::npos ? programAt(name) : inFolders(name, search_path);
        if (path.empty()) throw std::runtime_error("there is no compiler '" + name + "' (CRT_CXX)");
        return compilerAt(path);
    }
    for (const char* const name : {"c++", "g++", "clang++"})
        if (const std::string path = inFolders(name, search_path); !path.empty()) return compilerAt(path);
    throw std::runtime_error("there is no C++ compiler (c++, g++ or clang++) in PATH");
}

std::string kernelText(const std::string& pixel_text) {
    const struct {
        const char* name;
        const std::string text;
    } parts[] = {{"#include \"traversal.h\"\n", kTraversalText},
                 {"#include \"tile_job.h\"\n", kTileJobText},
                 {"#include \"kernel/schedule/pixel.h\"\n", pixel_text}};
    std::string text = kKernelsText;
    for (const auto& [name, part] : parts) {
        // traversal.h includes tile_job.h, too: of two includes the first counts.
        text.replace(text.find(name), std::strlen(name), part);
        for (std::size_t at = 0; (at = text.find(name, at)) != std::string::npos;)
            text.erase(at, std::strlen(name));
    }
    return text;
}

std::vector<std::string> compilerOptions(const Compiler& compiler, std::uint64_t features) {
    std::vector<std::string> options = split(CRT_EMBREE_KERNEL_FLAGS, ' ');
    if (processorHasAvx512())  // The last of two -march counts.
        for (const char* const option : {"-march=x86-64-v4", "-mprefer-vector-width=256"})
            options.emplace_back(option);
    if (compiler.identity.find("clang") == std::string::npos)
        for (const std::string& option : split(CRT_EMBREE_GCC_FLAGS, ' ')) options.push_back(option);
    char mask[48];
    std::snprintf(mask, sizeof mask, "-DCRT_FEATURES=0x%llxul", static_cast<unsigned long long>(features));
    for (const char* const option :
         {static_cast<const char*>(mask), "-DCRT_EMBREE_LEAN", "-DCRT_EMBREE_ENTRY=crt_embree_render",
          "-std=c++20", "-w", "-fPIC", "-fvisibility=hidden", "-shared", "-x", "c++"})
        options.emplace_back(option);
    return options;
}

KernelCache::Key cacheKey(const std::string& text, const Compiler& compiler, std::uint64_t features) {
    std::string options;
    for (const std::string& option : compilerOptions(compiler, features)) options += option + ' ';
    return KernelCache::makeKey({"embree", text, options, compiler.identity});
}

std::string compileProgram() {
    return plugin::programBeside(reinterpret_cast<const void*>(&compileProgram), "crt_cxx");
}

CompileMessage messageOf(const std::string& text, const Compiler& compiler, std::uint64_t features) {
    CompileMessage message;
    message.add(text);
    message.add(compiler.path);
    const std::vector<std::string> options = compilerOptions(compiler, features);
    message.addNumber(options.size());
    for (const std::string& option : options) message.add(option);
    return message;
}

std::vector<unsigned char> compileJob(CompileMessage& message) {
    const std::string text = message.nextText(), path = message.nextText();
    std::vector<std::string> command{plugin::trustedProgram(path)};
    for (auto left = message.nextNumber<std::size_t>(); left > 0; --left)
        command.push_back(message.nextText());
    return plugin::runCompiler(command, text);
}

LeanKernel::LeanKernel(const std::vector<unsigned char>& code) {
    // Through memory: what was checked is what is loaded.
    const int descriptor = ::memfd_create("crt embree kernel", MFD_CLOEXEC);
    const bool written = descriptor >= 0 &&
                         ::write(descriptor, code.data(), code.size()) == static_cast<ssize_t>(code.size());
    const std::string name = "/proc/self/fd/" + std::to_string(descriptor);
    void* const library = written ? ::dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL) : nullptr;
    if (library == nullptr) {
        const char* const why = written ? ::dlerror() : std::strerror(errno);
        const std::string sentence = std::string("the compiled kernel cannot be loaded: ") + why;
        if (descriptor >= 0) ::close(descriptor);
        throw std::runtime_error(sentence);
    }
    // The dynamic linker knows libraries by their names, so the number must not be another's meanwhile.
    library_ = std::shared_ptr<void>(library, [descriptor](void* loaded) {
        ::dlclose(loaded);
        ::close(descriptor);
    });
    render_ = reinterpret_cast<RenderTile>(::dlsym(library, kEntry));
    const auto* const compiler = static_cast<const char*>(::dlsym(library, kCompilerName));
    if (render_ == nullptr || compiler == nullptr)
        throw std::runtime_error("the compiled kernel has no entry");
    compiler_ = compiler;
}

}  // namespace crt::embree
