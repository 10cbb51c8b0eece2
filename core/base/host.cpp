#include "base/host.h"

#include "build_info.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/utsname.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <limits>
#include <string_view>
#include <utility>

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
        const auto trimmed = [](char c) {
            return std::isspace(static_cast<unsigned char>(c)) != 0 || c == '"';
        };
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

std::uint64_t availableHostMemory() {
    const auto kilobytesIn = [](const char* path, std::string_view key) {
        const std::string text = valueInFile(path, key, ':');
        std::uint64_t kilobytes = 0;
        std::from_chars(text.data(), text.data() + text.size(), kilobytes);
        return kilobytes;
    };
    const auto numberIn = [](const char* path) {
        std::ifstream file(path);
        std::uint64_t number = std::numeric_limits<std::uint64_t>::max();  // Also where the file says "max".
        file >> number;
        return file ? number : std::numeric_limits<std::uint64_t>::max();
    };
    const auto left = [](std::uint64_t limit, std::uint64_t used) {
        return limit > used ? limit - used : 0;
    };

    std::uint64_t bytes = std::numeric_limits<std::uint64_t>::max();
    if (const std::uint64_t kilobytes = kilobytesIn("/proc/meminfo", "MemAvailable:"); kilobytes > 0)
        bytes = kilobytes * 1024;
    // Inside a container its own group is the root of what it sees. Version 2, then version 1.
    for (const auto& [limit, used] :
         {std::pair{"/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current"},
          std::pair{"/sys/fs/cgroup/memory/memory.limit_in_bytes",
                    "/sys/fs/cgroup/memory/memory.usage_in_bytes"}})
        if (const std::uint64_t most = numberIn(limit); most != std::numeric_limits<std::uint64_t>::max())
            bytes = std::min(bytes, left(most, numberIn(used)));
    rlimit address_space{};
    if (getrlimit(RLIMIT_AS, &address_space) == 0 && address_space.rlim_cur != RLIM_INFINITY)
        bytes = std::min<std::uint64_t>(
            bytes, left(address_space.rlim_cur, kilobytesIn("/proc/self/status", "VmSize:") * 1024));
    return bytes;
}

BuildInfo buildInfo() { return {CRT_COMMIT, CRT_COMMIT_DIRTY != 0, CRT_COMPILER, CRT_COMPILER_FLAGS}; }

}  // namespace crt
