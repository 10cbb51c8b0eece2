#include "image/open_module.h"

#include "base/code_trust.h"
#include "base/log.h"
#include "base/modules.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <dlfcn.h>
#include <filesystem>
#include <system_error>
#include <vector>

namespace crt {

const CrtImageModule& imageModule(const std::string& path, ErrorKind kind) {
    struct Opened {
        const CrtImageModule* table = nullptr;
        std::string reason;
    };
    static const Opened opened = [] {
        Opened o;
        const std::vector<std::string> directories = pluginDirectories();
        for (const std::string& directory : directories) {
            const std::string file = directory + "/" CRT_IMAGE_MODULE_FILE;
            std::error_code ignored;
            if (!std::filesystem::exists(file, ignored)) continue;
            const trust::Judged judged = trust::judge(file);
            if (!judged.why.empty()) {
                o.reason = fmt::format("the image module is refused: {}", judged.why);
                return o;
            }
            void* const library = ::dlopen(judged.path.c_str(), RTLD_NOW | RTLD_LOCAL);
            if (library == nullptr) {
                o.reason = fmt::format("the image module cannot be opened ({})", ::dlerror());
                return o;
            }
            const auto entry =
                reinterpret_cast<CrtImageModuleEntry>(::dlsym(library, CRT_IMAGE_MODULE_ENTRY_NAME));
            const CrtImageModule* const table = entry != nullptr ? entry() : nullptr;
            if (table == nullptr || table->struct_size < sizeof(CrtImageModule)) {
                o.reason = fmt::format("'{}' is not the image module of this version of crt", file);
                return o;
            }
            logDebug("image module: {} ({})", file, table->build);
            o.table = table;
            return o;
        }
        o.reason = fmt::format("the image module " CRT_IMAGE_MODULE_FILE " is not in {}",
                               fmt::join(directories, ", "));
        return o;
    }();
    if (opened.table == nullptr)
        throw Error(kind,
                    fmt::format("cannot {} '{}': {}; .pfm and .ppm work without it",
                                kind == ErrorKind::Output ? "write" : "read", path, opened.reason),
                    {path});
    return *opened.table;
}

void prepareToWrite(OutputFormat format) noexcept {
    if (format != OutputFormat::Exr && format != OutputFormat::Png) return;
    try {
        imageModule("", ErrorKind::Output);
    } catch (...) {
        // A writer tries again.
    }
}

}  // namespace crt
