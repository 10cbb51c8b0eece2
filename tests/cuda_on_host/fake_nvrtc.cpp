// A libnvrtc.so.13 for tests: takes CRT_FAKE_NVRTC_SECONDS to compile anything, and gives what the fake
// driver takes for machine code. With "fail" in place of the seconds it refuses at once, with "crash" it
// ends its process.
#include <nvrtc.h>

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <string>
#include <thread>

namespace {

constexpr char kCubin[] =
    "\x7f"
    "ELF of the fake compiler";
constexpr char kLog[] = "fake.cu(1): error: told by the fake compiler\n";

std::string behaviour() {
    const char* value = std::getenv("CRT_FAKE_NVRTC_SECONDS");
    return value != nullptr ? value : "0";
}

}  // namespace

extern "C" {

#define CRT_FAKE __attribute__((visibility("default")))

CRT_FAKE nvrtcResult nvrtcVersion(int* major, int* minor) {
    *major = 13;
    *minor = 0;
    return NVRTC_SUCCESS;
}
CRT_FAKE const char* nvrtcGetErrorString(nvrtcResult) { return "NVRTC_ERROR_OF_THE_FAKE"; }
CRT_FAKE nvrtcResult nvrtcGetNumSupportedArchs(int* count) {
    *count = 1;
    return NVRTC_SUCCESS;
}
CRT_FAKE nvrtcResult nvrtcGetSupportedArchs(int* archs) {
    *archs = 90;
    return NVRTC_SUCCESS;
}
CRT_FAKE nvrtcResult nvrtcCreateProgram(nvrtcProgram* program, const char*, const char*, int,
                                        const char* const*, const char* const*) {
    *program = reinterpret_cast<nvrtcProgram>(new int);
    return NVRTC_SUCCESS;
}
CRT_FAKE nvrtcResult nvrtcDestroyProgram(nvrtcProgram* program) {
    delete reinterpret_cast<int*>(*program);
    *program = nullptr;
    return NVRTC_SUCCESS;
}
CRT_FAKE nvrtcResult nvrtcCompileProgram(nvrtcProgram, int, const char* const*) {
    if (behaviour() == "fail") return NVRTC_ERROR_COMPILATION;
    if (behaviour() == "crash") std::abort();
    std::this_thread::sleep_for(std::chrono::duration<double>(std::atof(behaviour().c_str())));
    return NVRTC_SUCCESS;
}
CRT_FAKE nvrtcResult nvrtcGetProgramLogSize(nvrtcProgram, std::size_t* size) {
    *size = sizeof kLog;
    return NVRTC_SUCCESS;
}
CRT_FAKE nvrtcResult nvrtcGetProgramLog(nvrtcProgram, char* log) {
    std::memcpy(log, kLog, sizeof kLog);
    return NVRTC_SUCCESS;
}
CRT_FAKE nvrtcResult nvrtcGetCUBINSize(nvrtcProgram, std::size_t* size) {
    *size = sizeof kCubin;
    return NVRTC_SUCCESS;
}
CRT_FAKE nvrtcResult nvrtcGetCUBIN(nvrtcProgram, char* cubin) {
    std::memcpy(cubin, kCubin, sizeof kCubin);
    return NVRTC_SUCCESS;
}

}  // extern "C"
