#include "image/open_module.h"

#include "base/code_trust.h"
#include "base/log.h"
#include "base/modules.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <dlfcn.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>
#include <vector>

namespace crt {

namespace {

struct Opened {
    const CrtImageModule* table = nullptr;
    std::string reason;  ///< Of there being no table.
};

Opened open(const char* name) {
    Opened opened;
    const std::vector<std::string> directories = pluginDirectories();
    for (const std::string& directory : directories) {
        const std::string file = directory + "/" + name;
        std::error_code ignored;
        if (!std::filesystem::exists(file, ignored)) continue;
        const trust::Judged judged = trust::judge(file);
        if (!judged.why.empty()) {
            opened.reason = fmt::format("the image module is refused: {}", judged.why);
            return opened;
        }
        void* const library = ::dlopen(judged.path.c_str(), RTLD_NOW | RTLD_LOCAL);
        if (library == nullptr) {
            opened.reason = fmt::format("the image module cannot be opened ({})", ::dlerror());
            return opened;
        }
        const auto entry =
            reinterpret_cast<CrtImageModuleEntry>(::dlsym(library, CRT_IMAGE_MODULE_ENTRY_NAME));
        const CrtImageModule* const table = entry != nullptr ? entry() : nullptr;
        if (table == nullptr || table->struct_size < sizeof(CrtImageModule)) {
            opened.reason = fmt::format("'{}' is not the image module of this version of crt", file);
            return opened;
        }
        logDebug("image module: {} ({})", file, table->build);
        opened.table = table;
        return opened;
    }
    opened.reason = fmt::format("the image module {} is not in {}", name, fmt::join(directories, ", "));
    return opened;
}

}  // namespace

ModuleFormat moduleFormatOf(const std::string& path) {
    constexpr std::string_view kExrMark("\x76\x2f\x31\x01", 4);
    std::array<char, kExrMark.size()> mark{};
    std::ifstream file(path, std::ios::binary);
    file.read(mark.data(), mark.size());
    return file && std::string_view(mark.data(), mark.size()) == kExrMark ? ModuleFormat::Exr
                                                                          : ModuleFormat::Plain;
}

const CrtImageModule& imageModule(ModuleFormat format, const std::string& path, ErrorKind kind) {
    const auto require = [&](const Opened& opened, const char* others) -> const CrtImageModule& {
        if (opened.table == nullptr)
            throw Error(
                kind,
                fmt::format("cannot {} '{}': {}; {} work without it",
                            kind == ErrorKind::Output ? "write" : "read", path, opened.reason, others),
                {path});
        return *opened.table;
    };
    if (format == ModuleFormat::Exr) {
        constexpr const char* kOthers = ".png, .jpg, .pfm and .ppm";
        if (kind == ErrorKind::Output) {
            static const Opened writer = open(CRT_IMAGE_EXR_WRITER_FILE);
            return require(writer, kOthers);
        }
        static const Opened reader = open(CRT_IMAGE_EXR_READER_FILE);
        return require(reader, kOthers);
    }
    static const Opened plain = open(CRT_IMAGE_PLAIN_FILE);
    return require(plain, ".exr, .pfm and .ppm");
}

void prepareToWrite(OutputFormat format) noexcept {
    if (format != OutputFormat::Exr) return;
    try {
        imageModule(ModuleFormat::Exr, "", ErrorKind::Output);
    } catch (...) {
        // A writer tries again.
    }
}

}  // namespace crt
