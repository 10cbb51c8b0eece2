#include "base/cache_folder.h"

#include "base/code_trust.h"
#include "base/log.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <set>
#include <system_error>

namespace crt {
namespace {

namespace fs = std::filesystem;

std::string variable(const char* name) {
    const char* value = std::getenv(name);
    return value != nullptr ? value : "";
}

std::string chosenFolder() {
    if (std::string own = variable("CRT_CACHE_DIR"); !own.empty()) return own;
    // The XDG standard has relative paths ignored.
    if (const std::string base = variable("XDG_CACHE_HOME"); !base.empty() && base.front() == '/')
        return base + "/crt";
    if (const std::string home = variable("HOME"); !home.empty()) return home + "/.cache/crt";
    return {};
}

/// Warns once of each reason: cacheFolder() is called for scenes and for each backend.
void warnOnce(const std::string& why) {
    static std::mutex mutex;
    static std::set<std::string> warned;
    const std::lock_guard lock(mutex);
    if (warned.insert(why).second)
        logWarning("crt keeps no kernels and no tables of materials, so every process makes its own: {}",
                   why);
}

}  // namespace

std::string cacheFolder() {
    std::string folder = chosenFolder();
    if (folder.empty()) {
        logDebug("no cache: none of CRT_CACHE_DIR, XDG_CACHE_HOME and HOME is set");
        return {};
    }
    std::error_code failed;
    if (fs::create_directories(folder, failed)) {
        // Cached kernels are executed, so no other user may have write access there.
        fs::permissions(folder, fs::perms::owner_all, failed);
    }
    if (::access(folder.c_str(), R_OK | W_OK | X_OK) != 0 || !fs::is_directory(folder, failed)) {
        logDebug("no cache: {} is not a directory that can be written to", folder);
        return {};
    }
    struct stat status {};
    if (::stat(folder.c_str(), &status) != 0) return {};
    if (const std::string why = trust::whyNot(status, folder); !why.empty()) {
        warnOnce(why);
        return {};
    }
    return folder;
}

}  // namespace crt
