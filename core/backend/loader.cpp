#include "backend/loader.h"

#include "backend/crt_layout_hash.h"
#include "backend/kernel_source.h"
#include "base/cache_folder.h"
#include "base/code_trust.h"
#include "base/error.h"
#include "base/log.h"
#include "base/modules.h"
#include "base/words.h"
#include "kernel/dialect/bits_version.h"

#include <dlfcn.h>
#include <elf.h>
#include <fmt/ranges.h>
#include <link.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <optional>
#include <set>
#include <string_view>
#include <system_error>

namespace crt {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFilePrefix = "crt_backend_";
constexpr const char* kFileSuffix = ".so";

/// In the order in which `auto` prefers them.
constexpr const char* kKnownBackends[] = {"cuda", "embree", "opencl"};

#if defined(__clang__)
constexpr const char* kHostBuild = "crt " CRT_HEADERS_VERSION ", " __VERSION__;
#else
constexpr const char* kHostBuild = "crt " CRT_HEADERS_VERSION ", g++ " __VERSION__;
#endif

[[noreturn]] void refuse(const std::string& sentence) { throw Error(ErrorKind::Backend, sentence); }

/// Calls into a plugin. An exception that comes out of one is a bug there, to be named and survived.
template <class Call>
auto acrossBorder(const std::string& name, const char* function, Call&& call) {
    try {
        return call();
    } catch (const std::exception& error) {
        refuse(fmt::format("backend '{}' broke the contract: an exception crossed the border from {} ({})",
                           name, function, error.what()));
    } catch (...) {
        refuse(fmt::format("backend '{}' broke the contract: an exception crossed the border from {}", name,
                           function));
    }
}

const char* orUnknown(const char* text) { return text != nullptr && *text != '\0' ? text : "unknown"; }

/// Names that have a plugin file in any of the directories, sorted.
std::set<std::string> installedBackends() {
    std::set<std::string> names;
    for (const std::string& directory : pluginDirectories()) {
        std::error_code unreadable;  // an absent directory holds no plugins
        for (const fs::directory_entry& file : fs::directory_iterator(directory, unreadable)) {
            const std::string stem = file.path().stem().string();
            if (file.path().extension() == kFileSuffix && stem.rfind(kFilePrefix, 0) == 0)
                names.insert(stem.substr(std::string_view(kFilePrefix).size()));
        }
    }
    return names;
}

/// The first directory that has the plugin wins, as in $PATH.
std::optional<std::string> findPlugin(const std::string& name) {
    for (const std::string& directory : pluginDirectories()) {
        const fs::path path = fs::path(directory) / (kFilePrefix + name + kFileSuffix);
        std::error_code unreadable;
        // A link to nowhere exists too: dlopen then says what is wrong with it.
        if (fs::exists(path, unreadable) || fs::is_symlink(path, unreadable)) return path.string();
    }
    return std::nullopt;
}

[[noreturn]] void refuseAbsent(const std::string& name) {
    std::string searched;
    for (const std::string& directory : pluginDirectories())
        searched += (searched.empty() ? "" : ", ") + directory;

    std::set<std::string> candidates = installedBackends();
    const bool known =
        std::find(std::begin(kKnownBackends), std::end(kKnownBackends), name) != std::end(kKnownBackends);
    candidates.insert(std::begin(kKnownBackends), std::end(kKnownBackends));
    std::string hint = known ? "" : didYouMean(name, {candidates.begin(), candidates.end()});
    if (!known && hint.empty()) hint = fmt::format("backends are {}", fmt::join(candidates, ", "));
    refuse(fmt::format("backend '{}' is {}: no {}{}{} in {}{}", name, known ? "not installed" : "unknown",
                       kFilePrefix, name, kFileSuffix, searched, hint.empty() ? "" : "; " + hint));
}

/// Of a table that is large enough for version 1.0, which had no such member.
std::uint32_t bitsVersionOf(const CrtBackend& table) {
    constexpr std::size_t needed = offsetof(CrtBackend, bits_version) + sizeof(CrtBackend::bits_version);
    return table.struct_size >= needed ? table.bits_version : 1;
}

/// Of a table of version 1.2 or newer; older ones bring nothing.
bool hasBrings(const CrtBackend& table) {
    return table.struct_size >=
           offsetof(CrtBackend, accelerator_reach) + sizeof(CrtBackend::accelerator_reach);
}

/// True if a driver for a GPU runs here: then a backend without a device is worth a message.
bool hasGpuDriver() {
    std::error_code unreadable;
    return fs::exists("/dev/nvidiactl", unreadable) || fs::exists("/dev/dxg", unreadable) ||
           fs::exists("/dev/kfd", unreadable);
}

/// The checks between dlsym and the first use of the table. `name` is what the user asked for.
void checkTable(const std::string& name, const std::string& path, const CrtBackend* table) {
    if (table == nullptr)
        refuse(fmt::format("backend '{}' ({}) broke the contract: {} returned no table", name, path,
                           CRT_BACKEND_ENTRY_NAME));

    // The first eight bytes are the same in every version; nothing beyond may be read before the sizes are
    // known to agree.
    constexpr std::size_t version_size = offsetof(CrtBackend, abi_minor) + sizeof(CrtBackend::abi_minor);
    constexpr std::size_t first_size = offsetof(CrtBackend, create) + sizeof(CrtBackend::create);
    if (table->struct_size >= version_size && table->abi_major != CRT_ABI_MAJOR) {
        refuse(
            fmt::format("backend '{}' ({}) has version {}.{} of the plugin interface and this crt has "
                        "{}.{}: rebuild the plugin",
                        name, path, table->abi_major, table->abi_minor, CRT_ABI_MAJOR, CRT_ABI_MINOR));
    }
    if (table->struct_size < first_size) {
        refuse(fmt::format(
            "backend '{}' ({}) broke the contract: its table has {} bytes where version {} needs {}", name,
            path, table->struct_size, CRT_ABI_MAJOR, first_size));
    }
    if (table->layout_hash != CRT_LAYOUT_HASH) {
        refuse(
            fmt::format("backend '{}' ({}) was built for another scene layout, {:016x} ({}), and this crt "
                        "has {:016x} ({}): rebuild the plugin",
                        name, path, table->layout_hash, orUnknown(table->build),
                        std::uint64_t{CRT_LAYOUT_HASH}, kHostBuild));
    }
    if (bitsVersionOf(*table) != CRT_BITS_VERSION) {
        refuse(fmt::format(
            "backend '{}' ({}) renders bits version {} ({}), and this crt has bits version {} ({}): its "
            "samples would differ; rebuild the plugin",
            name, path, bitsVersionOf(*table), orUnknown(table->build), CRT_BITS_VERSION, kHostBuild));
    }
    // Not a number is no reach either.
    if (hasBrings(*table) && (table->brings & CRT_BRINGS_ACCELERATOR) != 0 &&
        !(table->accelerator_reach >= 1)) {
        refuse(
            fmt::format("backend '{}' ({}) broke the contract: its acceleration structure reaches {}, and "
                        "scenes reach 1",
                        name, path, table->accelerator_reach));
    }
    if (table->name == nullptr || table->probe == nullptr || table->create == nullptr) {
        refuse(fmt::format("backend '{}' ({}) broke the contract: its table lacks {}", name, path,
                           table->name == nullptr    ? "a name"
                           : table->probe == nullptr ? "probe"
                                                     : "create"));
    }
}

/// True if a library has all the bytes of its segments. dlopen maps them unasked, and the first touch of one
/// behind the end of the file is a SIGBUS.
bool isCut(const std::string& file) {
    std::ifstream in(file, std::ios::binary);
    ElfW(Ehdr) header{};
    std::error_code unknown;
    const std::uintmax_t bytes = fs::file_size(file, unknown);
    if (!in.read(reinterpret_cast<char*>(&header), sizeof header) || unknown ||
        std::memcmp(header.e_ident, ELFMAG, SELFMAG) != 0)
        return false;  // dlopen knows.
    for (unsigned i = 0; i < header.e_phnum; ++i) {
        ElfW(Phdr) segment{};
        in.seekg(static_cast<std::streamoff>(header.e_phoff + std::uint64_t{i} * sizeof segment));
        if (!in.read(reinterpret_cast<char*>(&segment), sizeof segment)) return true;
        if (segment.p_type == PT_LOAD &&
            (segment.p_offset > bytes || segment.p_filesz > bytes - segment.p_offset))
            return true;
    }
    return false;
}

/// The file to open for `path`. Throws where other users could have written it.
std::string trustedFile(const std::string& name, const std::string& path) {
    const trust::Judged judged = trust::judge(path);
    if (!judged.why.empty()) refuse(fmt::format("backend '{}' ({}) is refused: {}", name, path, judged.why));
    return judged.path;
}

/// The text at an address that stays valid: a host table may be copied and outlive its maker.
const char* keep(const std::string& text) {
    static std::mutex mutex;
    static auto* const texts = new std::set<std::string>;
    const std::lock_guard lock(mutex);
    return texts->insert(text).first->c_str();
}

// The host's side of the border: nothing may be thrown into a plugin, which may be written in C.

void hostLog(void*, CrtLogLevel level, const char* message) noexcept {
    try {
        const auto known =
            static_cast<CrtLogLevel>(std::clamp<CrtLogLevel>(level, CRT_LOG_DEBUG, CRT_LOG_ERROR));
        logMessage(static_cast<LogLevel>(known), message != nullptr ? message : "(null)");
    } catch (...) {
        // A message that cannot be written is lost; there is no further place to say so.
    }
}

std::int32_t hostProgress(void*, double) noexcept { return 0; }

const char* hostKernelSource(void*, const char* name) noexcept {
    try {
        return name != nullptr ? kernelSource(name) : nullptr;
    } catch (const std::exception& error) {
        hostLog(nullptr, CRT_LOG_ERROR, error.what());
        return nullptr;
    }
}

static_assert(static_cast<int>(LogLevel::Debug) == CRT_LOG_DEBUG &&
              static_cast<int>(LogLevel::Info) == CRT_LOG_INFO &&
              static_cast<int>(LogLevel::Warning) == CRT_LOG_WARNING &&
              static_cast<int>(LogLevel::Error) == CRT_LOG_ERROR);

}  // namespace

double acceleratorReach(const LoadedBackend& backend) {
    const CrtBackend& table = *backend.table;
    return hasBrings(table) && (table.brings & CRT_BRINGS_ACCELERATOR) != 0 ? table.accelerator_reach : 0;
}

LoadedBackend loadBackend(const std::string& name) {
    if (name.empty()) refuse("the backend has no name");
    std::string path = name;
    if (name.find('/') == std::string::npos) {
        const std::optional<std::string> found = findPlugin(name);
        if (!found) refuseAbsent(name);
        path = *found;
    } else if (std::error_code unreadable; !fs::exists(name, unreadable)) {
        refuse(fmt::format("there is no backend file {}", name));
    }

    const std::string file = trustedFile(name, path);
    if (isCut(file))
        refuse(fmt::format("backend '{}' ({}) cannot be opened: the file is cut short", name, path));
    // NOW: a missing symbol is reported here and not in the middle of a render. LOCAL: the libraries of one
    // plugin are not those of another.
    void* library = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (library == nullptr) {
        const char* reason = ::dlerror();
        refuse(fmt::format("backend '{}' ({}) cannot be opened: {}", name, path, orUnknown(reason)));
    }
    // Never closed, not even when it is refused: its static objects may have started threads.
    void* const symbol = ::dlsym(library, CRT_BACKEND_ENTRY_NAME);
    if (symbol == nullptr) {
        const char* reason = ::dlerror();
        refuse(fmt::format("backend '{}' ({}) is not a crt backend, or built for another major version: {}",
                           name, path, orUnknown(reason)));
    }
    const auto entry = reinterpret_cast<CrtBackendEntry>(symbol);
    const CrtBackend* table = acrossBorder(name, CRT_BACKEND_ENTRY_NAME, [&] { return entry(); });
    checkTable(name, path, table);
    logDebug("opened backend '{}' {} ({}), built with {}", table->name, orUnknown(table->version), path,
             orUnknown(table->build));
    return {table->name, path, table};
}

std::vector<CrtDevice> probeDevices(const LoadedBackend& backend) {
    const CrtHost host = makeHost(false);
    std::vector<CrtDevice> devices(16);
    for (;;) {
        for (CrtDevice& device : devices) {
            device = CrtDevice{};
            device.struct_size = sizeof(CrtDevice);
        }
        std::uint32_t count = 0;
        char reason[512] = "";
        const CrtStatus status = acrossBorder(backend.name, "probe", [&] {
            return backend.table->probe(&host, devices.data(), static_cast<std::uint32_t>(devices.size()),
                                        &count, reason, sizeof(reason));
        });
        reason[sizeof(reason) - 1] = '\0';
        if (status != CRT_OK || count == 0) {
            refuse(fmt::format("backend '{}' has no usable device: {}", backend.name,
                               *reason != '\0' ? reason : "it gives no reason"));
        }
        if (count <= devices.size()) {
            devices.resize(count);
            break;
        }
        if (count > 4096)
            refuse(
                fmt::format("backend '{}' broke the contract: it claims {} devices", backend.name, count));
        devices.resize(count);  // more than there was room for: ask again
    }
    for (CrtDevice& device : devices) {
        device.name[sizeof(device.name) - 1] = '\0';
        device.driver[sizeof(device.driver) - 1] = '\0';
    }
    std::stable_sort(devices.begin(), devices.end(),
                     [](const CrtDevice& a, const CrtDevice& b) { return a.score > b.score; });
    return devices;
}

std::vector<std::string> knownBackends() { return {std::begin(kKnownBackends), std::end(kKnownBackends)}; }

std::vector<BackendStatus> listBackends() {
    // Known ones first, in the order of preference, then whatever else lies in the directories.
    std::vector<std::string> names = knownBackends();
    for (const std::string& name : installedBackends()) {
        if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    }
    std::vector<BackendStatus> list;
    for (const std::string& name : names) {
        BackendStatus status;
        status.name = name;
        status.path = findPlugin(name).value_or("");
        try {
            status.refused =
                !status.path.empty() && fs::exists(status.path) && !trust::judge(status.path).why.empty();
            const LoadedBackend backend = loadBackend(name);
            status.version = orUnknown(backend.table->version);
            status.build = orUnknown(backend.table->build);
            status.devices = probeDevices(backend);
        } catch (const Error& error) {
            status.reason = error.what();
        }
        list.push_back(std::move(status));
    }
    return list;
}

LoadedBackend chooseBackend(std::vector<PassedOver>& reasons) {
    for (const char* name : kKnownBackends) {
        bool absent = !findPlugin(name);
        try {
            LoadedBackend backend = loadBackend(name);
            absent = !hasGpuDriver();
            probeDevices(backend);
            return backend;
        } catch (const Error& error) {
            reasons.push_back({error.what(), absent});
        }
    }
    std::string all;
    for (const PassedOver& passed : reasons) all += "\n  " + passed.reason;
    refuse("no backend can run here:" + all);
}

LoadedBackend openBackend(const std::string& name) {
    if (name != "auto") return loadBackend(name);
    std::vector<PassedOver> passed_over;
    LoadedBackend backend = chooseBackend(passed_over);
    for (const PassedOver& passed : passed_over)
        logMessage(passed.is_absent ? LogLevel::Debug : LogLevel::Info, passed.reason);
    return backend;
}

CrtHost makeHost(bool use_cache) {
    CrtHost host{};
    host.struct_size = sizeof(CrtHost);
    host.abi_major = CRT_ABI_MAJOR;
    host.abi_minor = CRT_ABI_MINOR;
    host.log = hostLog;
    host.progress = hostProgress;
    host.kernel_source = hostKernelSource;
    if (use_cache) {
        const std::string directory = cacheFolder();
        if (!directory.empty()) host.cache_directory = keep(directory);
    }
    return host;
}

}  // namespace crt
