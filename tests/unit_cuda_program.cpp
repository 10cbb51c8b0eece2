// The host's side of the CUDA backend, which needs neither GPU nor driver: where NVRTC is looked for, the
// options and the cache key, and what is read from the assembler's log.
#ifdef CRT_HAVE_CUDA_PROGRAM  // nothing to test in a build without CUDA

#include "catch.h"
#include "cuda_nvrtc.h"
#include "cuda_precompiled.h"
#include "cuda_program.h"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <set>
#include <stdexcept>

using namespace crt::cuda;

TEST_CASE("the precompiled kernel is the one that nvcc has made in this build", "[cuda]") {
    std::ifstream file(CRT_BUILD_DIR "/plugins/cuda/kernels.fatbin", std::ios::binary);
    const std::string made((std::istreambuf_iterator<char>(file)), {});
    REQUIRE(made.size() > 10000);
    CHECK(std::memcmp(kPrecompiledKernels, made.data(), made.size()) == 0);
}

TEST_CASE("NVRTC is looked for by name, in CUDA_HOME, then in the usual place", "[cuda]") {
    const std::vector<std::string> plain = nvrtcCandidates(nullptr);
    CHECK(plain == std::vector<std::string>{"libnvrtc.so.13", "libnvrtc.so.12", "libnvrtc.so",
                                            "/usr/local/cuda/lib64/libnvrtc.so.13",
                                            "/usr/local/cuda/lib64/libnvrtc.so.12",
                                            "/usr/local/cuda/lib64/libnvrtc.so"});
    CHECK(nvrtcCandidates("") == plain);
    CHECK(nvrtcCandidates("/usr/local/cuda") == plain);
    const std::vector<std::string> named = nvrtcCandidates("/opt/cuda");
    CHECK(named.size() == plain.size() + 3);
    CHECK(named[3] == "/opt/cuda/lib64/libnvrtc.so.13");
    CHECK(named[6] == plain[3]);
}

TEST_CASE("a machine without NVRTC gets one sentence", "[cuda]") {
    CHECK_THROWS_WITH(
        Nvrtc::open({"/nowhere/libnvrtc.so.13", "/nowhere/libnvrtc.so"}),
        Catch::Matchers::StartsWith("NVRTC is not installed (") && Contains("/nowhere/libnvrtc.so.13"));
    // A library that is there, but is none.
    CHECK_THROWS_WITH(Nvrtc::open({"libm.so.6"}), Contains("libm.so.6"));
}

TEST_CASE("no option relaxes arithmetic", "[cuda]") {
    const std::vector<std::string> options = nvrtcOptions(90, {Entry::Render, 0x1851}, 4);
    const auto has = [&](const char* option) {
        return std::find(options.begin(), options.end(), option) != options.end();
    };
    CHECK(has("--gpu-architecture=sm_90"));
    CHECK(has("--fmad=false"));
    CHECK(has("--prec-div=true"));
    CHECK(has("--prec-sqrt=true"));
    CHECK(has("--ftz=false"));
    CHECK(has("-DCRT_FEATURES=0x1851ul"));
    CHECK(has("-DCRT_LEAN=1"));
    for (const std::string& option : options) CHECK(option.find("fast") == std::string::npos);
}

TEST_CASE("the cache key changes with whatever decides the machine code", "[cuda]") {
    const auto key = cacheKey("text", 90, {Entry::Render, 0x51}, "NVRTC 13.0", "580.1, CUDA 13.0");
    CHECK(key == cacheKey("text", 90, {Entry::Render, 0x51}, "NVRTC 13.0", "580.1, CUDA 13.0"));
    const std::set<crt::plugin::KernelCache::Key> others = {
        key,
        cacheKey("text ", 90, {Entry::Render, 0x51}, "NVRTC 13.0", "580.1, CUDA 13.0"),
        cacheKey("text", 89, {Entry::Render, 0x51}, "NVRTC 13.0", "580.1, CUDA 13.0"),
        cacheKey("text", 90, {Entry::Render, 0x50}, "NVRTC 13.0", "580.1, CUDA 13.0"),
        cacheKey("text", 90, {Entry::Trace, 0x51}, "NVRTC 13.0", "580.1, CUDA 13.0"),
        cacheKey("text", 90, {Entry::Render, 0x51}, "NVRTC 13.1", "580.1, CUDA 13.0"),
        cacheKey("text", 90, {Entry::Render, 0x51}, "NVRTC 13.0", "580.2, CUDA 13.0"),
    };
    CHECK(others.size() == 7);
}

TEST_CASE("resources are read from the assembler's log, each kernel's own", "[cuda]") {
    const std::string log =
        "ptxas info    : 0 bytes gmem\n"
        "ptxas info    : Compiling entry function 'crt_add_slices' for 'sm_90'\n"
        "ptxas info    : Function properties for crt_add_slices\n"
        "    0 bytes stack frame, 0 bytes spill stores, 0 bytes spill loads\n"
        "ptxas info    : Used 32 registers, used 0 barriers\n"
        "ptxas info    : Compile time = 12.0 ms\n"
        "ptxas info    : Compiling entry function 'crt_render' for 'sm_90'\n"
        "ptxas info    : Function properties for crt_render\n"
        "    896 bytes stack frame, 228 bytes spill stores, 204 bytes spill loads\n"
        "ptxas info    : Used 128 registers, used 0 barriers, 896 bytes cumulative stack size\n";
    const ResourceUse render = resourceUse(log, "crt_render");
    CHECK(render.registers == 128);
    CHECK(render.stack_bytes == 896);
    CHECK(render.spill_bytes == 228 + 204);
    const ResourceUse add = resourceUse(log, "crt_add_slices");
    CHECK(add.registers == 32);
    CHECK(add.spill_bytes == 0);
    CHECK(resourceUse(log, "crt_other").registers == 0);
    CHECK(resourceUse("", "crt_render").registers == 0);
}

TEST_CASE("the text that is compiled ends with the entry points", "[cuda]") {
    const std::string text = kernelText("#define CRT_WAVEFRONT_H\n");
    CHECK(text.rfind("#define CRT_WAVEFRONT_H\n", 0) == 0);
    CHECK(text.find("crt_render(") != std::string::npos);
    CHECK(text.find("crt_add_slices(") != std::string::npos);
    for (const Entry entry : {Entry::Render, Entry::Trace, Entry::Shade, Entry::Choose})
        CHECK(text.find(std::string(entryName(entry)) + "(") != std::string::npos);
}

TEST_CASE("what NVRTC refuses is quoted", "[cuda]") {
    std::vector<Nvrtc> found;
    try {
        found.push_back(Nvrtc::open(nvrtcCandidates(std::getenv("CUDA_HOME"))));
    } catch (const std::runtime_error& error) {
        WARN("not tested: " << error.what());
        return;
    }
    const Nvrtc& nvrtc = found.front();
    CHECK(nvrtc.major() >= 12);
    CHECK_FALSE(nvrtc.supports(1));
    CHECK_THROWS_WITH(
        nvrtc.compile("extern \"C\" __global__ void f() { g(); }", "wrong.cu", {"--gpu-architecture=sm_90"}),
        Contains("wrong.cu(1)") && Contains("\"g\" is undefined"));
    const Cubin cubin = nvrtc.compile("extern \"C\" __global__ void f(float *x) { *x = 1.0f; }", "right.cu",
                                      {"--gpu-architecture=sm_90", "--ptxas-options=-v"});
    REQUIRE(cubin.bytes.size() > 4);
    CHECK(cubin.bytes[1] == 'E');  // ELF
    CHECK(resourceUse(cubin.log, "f").registers > 0);
}

#endif
