/// The machine and the build, as reports name them.
#pragma once

#include <cstdint>
#include <string>

namespace crt {

/// "Intel(R) Xeon(R) Platinum 8480C"; empty when the system does not tell.
std::string processorName();
/// "Debian GNU/Linux 12 (bookworm) (Linux 6.1.0 x86_64)"
std::string operatingSystem();
/// "0.42 0.37 0.30": runnable processes, averaged over 1, 5 and 15 minutes.
std::string loadAverages();
/// Now, UTC, ISO 8601: "2026-01-31T12:00:00Z".
std::string utcNow();
/// The most memory this process ever held, in bytes (VmHWM); 0 when the system does not tell.
std::uint64_t peakHostMemory();

/// The memory in bytes that this process may still allocate before the system ends it: the least of the
/// machine's free memory, the cgroup's (a container's) and the limit on address space (ulimit -v).
std::uint64_t availableHostMemory();

/// Versions and options with which this program was built.
struct BuildInfo {
    const char* commit;    ///< "a1b2c3d4e5f6"; "unknown" outside a git checkout.
    bool dirty;            ///< Files differed from the commit.
    const char* compiler;  ///< "GNU 12.2.0"
    const char* flags;
};
BuildInfo buildInfo();

}  // namespace crt
