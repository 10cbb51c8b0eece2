#include "opencl_program.h"

#include "opencl_dialect_text.h"

#include "backend/sdk/kernel_cache.h"

#include <algorithm>
#include <cstdio>
#include <future>
#include <memory>
#include <optional>
#include <utility>

namespace crt::opencl {

using plugin::KernelCache;
using plugin::PluginError;

namespace {

/// The output of the compiler, at most `line_count` lines of it.
std::string buildLog(cl_program program, cl_device_id target, int line_count) {
    std::size_t size = 0;
    if (clGetProgramBuildInfo(program, target, CL_PROGRAM_BUILD_LOG, 0, nullptr, &size) != CL_SUCCESS ||
        size < 2)
        return "(no build log)";
    std::string log(size, '\0');
    clGetProgramBuildInfo(program, target, CL_PROGRAM_BUILD_LOG, size, log.data(), nullptr);
    log.resize(log.find_last_not_of(std::string("\0\n\r ", 4)) + 1);
    std::size_t end = 0;
    for (int line = 0; line < line_count && end != std::string::npos; ++line)
        end = log.find('\n', end + (line > 0 ? 1 : 0));
    return end == std::string::npos ? log : log.substr(0, end) + "\n(more lines follow)";
}

std::vector<unsigned char> programBinary(cl_program program) {
    // One device, so one binary.
    std::size_t size = 0;
    check(clGetProgramInfo(program, CL_PROGRAM_BINARY_SIZES, sizeof size, &size, nullptr),
          "querying the size of the compiled kernel");
    std::vector<unsigned char> binary(size);
    unsigned char* pointer = binary.data();
    if (size != 0)
        check(clGetProgramInfo(program, CL_PROGRAM_BINARIES, sizeof pointer, &pointer, nullptr),
              "reading the compiled kernel back");
    return binary;
}

/// A program from a cached binary; empty when the driver does not take it, for whatever reason: then the
/// text is compiled again.
ProgramHandle fromBinary(const Session& session, const std::vector<unsigned char>& binary,
                         const std::string& options) {
    const unsigned char* pointer = binary.data();
    const std::size_t size = binary.size();
    cl_int status = CL_SUCCESS, result = CL_SUCCESS;
    ProgramHandle program(clCreateProgramWithBinary(session.context.get(), 1, &session.target, &size,
                                                    &pointer, &status, &result));
    if (result != CL_SUCCESS || status != CL_SUCCESS) return {};
    if (clBuildProgram(program.get(), 1, &session.target, options.c_str(), nullptr, nullptr) != CL_SUCCESS)
        return {};
    return program;
}

ProgramHandle fromText(const Session& session, const Device& device, const std::string& text,
                       const std::string& options) {
    const char* pointer = text.c_str();
    const std::size_t size = text.size();
    cl_int result = CL_SUCCESS;
    ProgramHandle program(clCreateProgramWithSource(session.context.get(), 1, &pointer, &size, &result));
    check(result, "creating the OpenCL program");
    result = clBuildProgram(program.get(), 1, &session.target, options.c_str(), nullptr, nullptr);
    if (result != CL_SUCCESS)
        throw PluginError(CRT_DEVICE_FAILED, "'" + device.name + "' cannot compile the kernel (" +
                                                 errorName(result) + ", options " + options + "):\n" +
                                                 buildLog(program.get(), session.target, 20));
    return program;
}

/// Groups that shade a queue, a compute unit; they take turns where it is longer.
constexpr std::uint64_t kGroupsPerUnit = 16;

/// A built kernel and what it cost to get it.
struct Built {
    ProgramHandle program;
    Kernel kernel;
    bool from_cache = false;
    double compile_seconds = 0, cache_seconds = 0;
};

/// Compiles a kernel, or takes it from the host's cache.
Built buildKernel(const plugin::Host& host, const Device& device, const Session& session,
                  const gpu::KernelSpec& spec) {
    Built built;
    const std::string options = buildOptions(device, spec);
    const std::string text =
        gpu::kernelText(host.kernelSource("kernel/schedule/wavefront.h"), "opencl_dialect.h", kDialectText);

    const gpu::Stopwatch cache_time;
    const KernelCache cache(host.cacheDirectory());
    const KernelCache::Key key = KernelCache::makeKey({"opencl", text, options, device.name, device.driver});
    std::string refused;
    const std::optional<std::vector<unsigned char>> binary = cache.load(key, &refused);
    if (!refused.empty())
        host.log(CRT_LOG_WARNING, "opencl: a cached kernel is refused, and compiled again: " + refused);
    if (binary) {
        built.program = fromBinary(session, *binary, options);
        built.from_cache = static_cast<bool>(built.program);
        if (!built.from_cache)
            host.log(CRT_LOG_DEBUG, "opencl: the driver refuses the cached kernel; compiling it again");
    }
    built.cache_seconds = cache_time.seconds();

    if (!built.program) {
        const gpu::Stopwatch compile_time;
        built.program = fromText(session, device, text, options);
        // PoCL generates the machine code only at the first launch, 0.7 s that none of crt's times include,
        // and keeps it in a separate cache.
        // Reading the program back makes PoCL generate it for launches of any size, too: a quarter of the
        // whole, only worth it for a kernel that is kept.
        const bool kept = !cache.path(key).empty();
        const std::vector<unsigned char> compiled =
            kept ? programBinary(built.program.get()) : std::vector<unsigned char>{};
        built.compile_seconds = compile_time.seconds();

        const gpu::Stopwatch store_time;
        if (!compiled.empty()) cache.store(key, compiled.data(), compiled.size());
        built.cache_seconds += store_time.seconds();
    }

    cl_int result = CL_SUCCESS;
    const char* name = gpu::entryName(spec.entry);
    built.kernel = Kernel(clCreateKernel(built.program.get(), name, &result));
    check(result, std::string("taking ") + name + " from the compiled program");
    return built;
}

}  // namespace

std::uint32_t blockSide(const Device& device) { return device.is_cpu ? 1 : 8; }

std::string buildOptions(const Device& device, const gpu::KernelSpec& spec) {
    // A GPU's lanes are its work-items: eight-wide vectors only cost it registers.
    const int simd8 = device.is_cpu ? 1 : 0;
    const unsigned side = blockSide(device);
    const int lean = spec.features != CRT_FEATURES_ALL ? 1 : 0;
    char options[256];
    std::snprintf(options, sizeof options,
                  "-cl-std=CL1.2 -DCRT_ENTRIES=%u -DCRT_FEATURES=0x%llxul -DCRT_LEAN=%d -DCRT_SIMD8=%d "
                  "-DCRT_BLOCK_WIDTH=%uu -DCRT_BLOCK_HEIGHT=%uu",
                  static_cast<unsigned>(spec.entry), static_cast<unsigned long long>(spec.features), lean,
                  simd8, side, side);
    return options +
           std::string(device.has_correct_division_option ? " -cl-fp32-correctly-rounded-divide-sqrt" : "");
}

OpenClProgram::OpenClProgram(const plugin::Host& host, const Device& device, const Session& session,
                             const gpu::Specs& wanted, CrtKernelChoice choice)
    : GpuProgram(wanted), host_(host), device_(device), session_(session), choice_(choice) {
    build(wanted_);
}

void OpenClProgram::build(const gpu::Specs& specs) {
    std::vector<std::future<Built>> building;
    for (const gpu::KernelSpec& spec : specs)
        building.push_back(std::async(specs.size() > 1 ? std::launch::async : std::launch::deferred,
                                      [&] { return buildKernel(host_, device_, session_, spec); }));
    std::vector<gpu::GpuKernel> kernels;
    double compile_seconds = 0, cache_seconds = 0;
    bool from_cache = true;
    for (std::size_t i = 0; i < specs.size(); ++i) {
        const auto built = std::make_shared<Built>(building[i].get());
        compile_seconds = std::max(compile_seconds, built->compile_seconds);
        cache_seconds = std::max(cache_seconds, built->cache_seconds);
        from_cache = from_cache && built->from_cache;
        gpu::GpuKernel kernel;
        kernel.spec = specs[i];
        kernel.module = built;
        kernel.entry = built->kernel.get();
        kernel.resident_blocks = kGroupsPerUnit * session_.compute_units;
        kernels.push_back(std::move(kernel));
    }
    kernels_ = std::move(kernels);
    from_cache_ = from_cache;
    compile_seconds_ += compile_seconds;
    cache_seconds_ += cache_seconds;
}

void OpenClProgram::giveUpWaves(const std::string& why) {
    host_.log(CRT_LOG_DEBUG, "opencl: continuing without waves: " + why);
    build({{gpu::Entry::Render, kernels_.front().spec.features}});
}

std::string OpenClProgram::description() const {
    const bool waves = kernels_.front().spec.entry == gpu::Entry::Trace;
    return std::string(choice_ == CRT_KERNEL_FULL ? "full" : "lean") +
           (waves ? " kernels, paths sorted by material, " : " kernel, ") +
           std::to_string(session_.compute_units) + " of " + std::to_string(device_.compute_units) +
           " compute units";
}

}  // namespace crt::opencl
