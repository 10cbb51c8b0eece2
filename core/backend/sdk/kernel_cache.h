/// Disk cache of compiled kernels, for backends that compile while they run: base/file_cache.h for plugins.
/// The header uses nothing of the core.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace crt::plugin {

/// Says which other user can write to a folder, or to a folder above it. Empty if the folder may hold code
/// that this process runs. For caches that libraries manage themselves. [any thread]
std::string whyNotFolder(const std::string& folder);

/// The program that a name leads to, to be started in its place. Throws std::runtime_error with a sentence
/// if another user could have written it. [any thread]
std::string trustedProgram(const std::string& name);

class KernelCache {
public:
    using Key = std::array<unsigned char, 16>;

    static constexpr std::uint64_t kDefaultMaxBytes = std::uint64_t{256} << 20;

    /// `directory` as the host gives it: existing and writable, or null for a cache that holds nothing.
    explicit KernelCache(const char* directory, std::uint64_t max_bytes = kDefaultMaxBytes);

    /// Key of a binary that depends on exactly these texts, in this order: kernel text, options, device,
    /// compiler, driver.
    static Key makeKey(const std::vector<std::string_view>& parts);

    /// The binary stored under `key`, and marks it as used now. Entries are executed: an entry that another
    /// user could have written is not loaded, and `refused`, where given, says why. [any thread]
    std::optional<std::vector<unsigned char>> load(const Key& key, std::string* refused = nullptr) const;

    /// Stores a binary, then removes what was used longest ago until all entries fit into max_bytes. Returns
    /// whether it is stored. [any thread]
    bool store(const Key& key, const void* data, std::size_t size) const;

    /// Path of an entry. Empty when the cache is off.
    std::string path(const Key& key) const;

private:
    std::string directory_;
    std::uint64_t max_bytes_;
};

}  // namespace crt::plugin
