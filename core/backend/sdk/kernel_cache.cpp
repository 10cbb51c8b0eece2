#include "backend/sdk/kernel_cache.h"

#include "base/code_trust.h"
#include "base/file_cache.h"

#include <stdexcept>

namespace crt::plugin {
namespace {

FileCache filesOf(const std::string& directory, std::uint64_t max_bytes) {
    return {directory, ".crtkernel", max_bytes};
}

}  // namespace

std::string whyNotFolder(const std::string& folder) { return trust::whyNotFolder(folder); }

std::string trustedProgram(const std::string& name) {
    const trust::Judged judged = trust::judge(name);
    if (!judged.why.empty()) throw std::runtime_error("'" + name + "' is refused: " + judged.why);
    return judged.path;
}

KernelCache::KernelCache(const char* directory, std::uint64_t max_bytes)
    : directory_(directory != nullptr ? directory : ""), max_bytes_(max_bytes) {}

KernelCache::Key KernelCache::makeKey(const std::vector<std::string_view>& parts) {
    return FileCache::makeKey(parts);
}

std::string KernelCache::path(const Key& key) const { return filesOf(directory_, max_bytes_).path(key); }

std::optional<std::vector<unsigned char>> KernelCache::load(const Key& key, std::string* refused) const {
    return filesOf(directory_, max_bytes_).load(key, refused);
}

bool KernelCache::store(const Key& key, const void* data, std::size_t size) const {
    const FileCache files = filesOf(directory_, max_bytes_);
    if (!files.store(key, data, size)) return false;
    files.makeRoom();
    return true;
}

}  // namespace crt::plugin
