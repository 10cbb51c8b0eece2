#include "base/modules.h"

#include <dlfcn.h>
#include <link.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string_view>
#include <system_error>

namespace crt {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> foldersOf(const char* variable) {
    std::vector<std::string> folders;
    const char* const value = std::getenv(variable);
    for (std::string_view rest = value != nullptr ? value : ""; !rest.empty();) {
        const std::size_t length = std::min(rest.find(':'), rest.size());
        if (length > 0) folders.emplace_back(rest.substr(0, length));
        rest.remove_prefix(std::min(length + 1, rest.size()));
    }
    return folders;
}

/// The file that holds this code; empty when the system does not tell.
fs::path thisModule() {
    Dl_info info{};
    link_map* map = nullptr;
    std::error_code unknown;
    if (dladdr1(reinterpret_cast<void*>(&thisModule), &info, reinterpret_cast<void**>(&map),
                RTLD_DL_LINKMAP) != 0 &&
        map != nullptr && map->l_name != nullptr && *map->l_name != '\0')
        return fs::canonical(map->l_name, unknown);
    return fs::read_symlink("/proc/self/exe", unknown);  // The program has no name in the list of libraries.
}

/// Programs lie in bin/ and libraries in lib/ of the tree.
fs::path installedTree() {
    const fs::path module = thisModule();
    return module.empty() ? module : module.parent_path().parent_path();
}

}  // namespace

std::vector<std::string> pluginDirectories() {
    std::vector<std::string> folders = foldersOf("CRT_BACKEND_PATH");
    if (const fs::path tree = installedTree(); !tree.empty())
        folders.push_back((tree / "lib" / "crt").string());
    return folders;
}

std::vector<std::string> meshDirectories() {
    if (std::vector<std::string> folders = foldersOf("CRT_MESH_PATH"); !folders.empty()) return folders;
    const fs::path tree = installedTree();
    if (tree.empty()) return {};
    return {(tree / "share" / "crt" / "meshes").string()};
}

std::vector<std::string> dataDirectories() {
    std::vector<std::string> folders = foldersOf("CRT_DATA_PATH");
    if (const fs::path tree = installedTree(); !tree.empty())
        folders.push_back((tree / "share" / "crt" / "data").string());
    return folders;
}

std::string reportProgram() {
    const fs::path tree = installedTree();
    const fs::path folder = tree / "share" / "crt" / "report";
    std::error_code unknown;
    return !tree.empty() && fs::exists(folder / "__main__.py", unknown) ? folder.string() : std::string();
}

}  // namespace crt
