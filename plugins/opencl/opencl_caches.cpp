#include "opencl_caches.h"

#include "backend/sdk/kernel_cache.h"

#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <string>
#include <system_error>
#include <utility>

namespace crt::opencl {
namespace fs = std::filesystem;
namespace {

/// The cache folder that PoCL uses by default; empty if that is /tmp/pocl.
fs::path folderOfPocl() {
    for (const auto& [variable, below] : {std::pair{"XDG_CACHE_HOME", "pocl/kcache"},
                                          std::pair{"HOME", ".cache/pocl/kcache"}})
        if (const char* value = std::getenv(variable); value != nullptr && *value != '\0')
            return fs::path(value) / below;
    return {};
}

/// True if no other user can write to the folder, which is made if it does not exist, nor to those above it.
bool isOurs(const fs::path& folder) {
    std::error_code error;
    fs::create_directories(folder, error);
    return !error && plugin::whyNotFolder(folder.string()).empty();
}

/// Is removed at the end of the process.
struct PrivateFolder {
    std::string path = (fs::temp_directory_path() / ("crt-pocl-" + std::string(6, 'X'))).string();
    PrivateFolder() {
        if (::mkdtemp(path.data()) != nullptr) ::setenv("POCL_CACHE_DIR", path.c_str(), 1);
    }
    ~PrivateFolder() {
        std::error_code ignored;
        fs::remove_all(path, ignored);
    }
};

}  // namespace

void keepKernelsFromOthers() {
    static std::once_flag once;
    std::call_once(once, [] {
        if (std::getenv("POCL_CACHE_DIR") != nullptr) return;
        const fs::path folder = folderOfPocl();
        if (!folder.empty() && isOurs(folder)) return;
        static const PrivateFolder private_folder;
    });
}

}  // namespace crt::opencl
