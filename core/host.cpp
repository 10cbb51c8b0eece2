#include "host.h"

#include "build_info.h"

#include <fmt/format.h>
#include <sys/utsname.h>

#include <cctype>
#include <charconv>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <string_view>

namespace crt {
namespace {

/// The value of "key<spaces><separator> value" in a text file of such lines; empty when it is not there.
std::string valueInFile(const char* path, std::string_view key, char separator) {
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);) {
        if (line.rfind(key, 0) != 0) continue;
        const std::size_t at = line.find(separator);
        if (at == std::string::npos) continue;
        std::size_t first = at + 1, last = line.size();
        const auto trimmed = [](char c) { return std::isspace(static_cast<unsigned char>(c)) != 0 || c == '"'; };
        while (first < last && trimmed(line[first])) ++first;
        while (last > first && trimmed(line[last - 1])) --last;
        return line.substr(first, last - first);
    }
    return {};
}

}  // namespace

std::string processorName() { return valueInFile("/proc/cpuinfo", "model name", ':'); }

std::string operatingSystem() {
    const std::string name = valueInFile("/etc/os-release", "PRETTY_NAME=", '=');
    utsname system{};
    if (uname(&system) != 0) return name;
    const std::string kernel = fmt::format("{} {} {}", system.sysname, system.release, system.machine);
    return name.empty() ? kernel : fmt::format("{} ({})", name, kernel);
}

std::string loadAverages() {
    double load[3] = {};
    if (getloadavg(load, 3) != 3) return {};
    return fmt::format("{:.2f} {:.2f} {:.2f}", load[0], load[1], load[2]);
}

std::string utcNow() {
    const std::time_t now = std::time(nullptr);
    std::tm utc{};
    gmtime_r(&now, &utc);
    char text[sizeof "2000-01-01T00:00:00Z"];
    return {text, std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc)};
}

std::uint64_t peakHostMemory() {
    const std::string text = valueInFile("/proc/self/status", "VmHWM:", ':');  // "12345 kB"
    std::uint64_t kilobytes = 0;
    std::from_chars(text.data(), text.data() + text.size(), kilobytes);
    return kilobytes * 1024;
}

BuildInfo buildInfo() { return {CRT_COMMIT, CRT_COMMIT_DIRTY != 0, CRT_COMPILER, CRT_COMPILER_FLAGS}; }

}  // namespace crt
