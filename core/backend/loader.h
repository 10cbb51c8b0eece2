/// Finds, opens and checks backend plugins. Every refusal is its own sentence.
#pragma once

#include "backend/crt_backend.h"

#include <cstddef>
#include <cstring>
#include <string>
#include <vector>

namespace crt {

/// A plugin that passed every check. The library stays open for the life of the process: its threads and
/// atexit handlers may outlive any integrator, and unloading buys nothing.
struct LoadedBackend {
    std::string name;
    std::string path;
    const CrtBackend* table = nullptr;
};

/// CrtBackend::accelerator_reach of a backend with its own acceleration structure, else 0.
double acceleratorReach(const LoadedBackend& backend);

/// Opens exactly crt_backend_<name>.so, or `name` itself when it holds a '/'. Throws crt::Error(Backend)
/// with one sentence: absent (where it was looked for), cannot be opened (dlerror()), not a crt backend,
/// table too small, ABI or layout differs (both builds named), or could have been written by others
/// (code_trust.h), which is found before anything of it is run.
LoadedBackend loadBackend(const std::string& name);

/// Devices of a backend, best score first. Throws crt::Error(Backend) with the plugin's reason when there is
/// none.
std::vector<CrtDevice> probeDevices(const LoadedBackend& backend);

/// One line of `crt plugins`.
struct BackendStatus {
    std::string name;
    std::string path;
    std::string version;
    std::string build;
    std::vector<CrtDevice> devices;
    std::string reason;  ///< Reason why it cannot run; empty if it can.
    bool refused = false;  ///< It was not even opened: others could have written it (code_trust.h).
};

/// The backends of crt, in the order in which `auto` prefers them.
std::vector<std::string> knownBackends();

/// Every known backend, and every other one found in the directories, usable or not. Opens each.
std::vector<BackendStatus> listBackends();

struct PassedOver {
    std::string reason;
    bool is_absent = false;  ///< Not installed, or for hardware of which nothing is there: as expected.
};

/// Picks a backend for `auto`: the first of knownBackends() with a device. `reasons` gets
/// those passed over.
LoadedBackend chooseBackend(std::vector<PassedOver>& reasons);

/// The backend that --backend selects: the one of that name, or for "auto" what chooseBackend picks, with a
/// line in the log for each one passed over (only with -v for what is absent).
LoadedBackend openBackend(const std::string& name);

/// Text of a fixed array that a plugin filled, not necessarily up to a terminator.
template <std::size_t N>
std::string arrayText(const char (&text)[N]) {
    return {text, strnlen(text, N)};
}

/// The host table given to every plugin: log, kernel sources, cache directory ($CRT_CACHE_DIR,
/// $XDG_CACHE_HOME/crt, ~/.cache/crt). `use_cache` false leaves cache_directory null. Its functions report
/// to the listener of the thread that calls them.
CrtHost makeHost(bool use_cache);

}  // namespace crt
