/// Results of long computations in files: compiled kernels, tables of materials. Content-addressed: the key
/// is a hash of everything that decides a result, so an entry is never stale and nothing has to be
/// invalidated.
///
/// A cache must never make anything fail: a damaged, foreign or unreadable entry is an absent one, and an
/// entry that cannot be written is not written. Any number of processes and threads may share one directory.
/// Uses nothing of the core but code_trust.h: it is part of crt::kernel_cache too.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace crt {

class FileCache {
public:
    using Key = std::array<unsigned char, 16>;

    /// `directory`: existing and writable, or empty for a cache that holds nothing. `suffix`: of the names
    /// of entries, with its dot. Caches of several suffixes may share a directory; each has `max_bytes`.
    FileCache(std::string directory, std::string suffix, std::uint64_t max_bytes);

    /// Key of a result that depends on exactly these texts, in this order.
    static Key makeKey(const std::vector<std::string_view>& parts);

    /// The result stored under `key`, and marks it as used now. An entry that another user could have
    /// written is not loaded, and `refused`, where given, says why. [any thread]
    std::optional<std::vector<unsigned char>> load(const Key& key, std::string* refused = nullptr) const;

    /// Stores a result. Returns whether it is stored. [any thread]
    bool store(const Key& key, const void* data, std::size_t size) const;

    /// Removes what was used longest ago until all entries fit into max_bytes, and what processes that died
    /// while they wrote have left. Reads the folder: once after several entries. [any thread]
    void makeRoom() const;

    /// Path of an entry. Empty when the cache is off.
    std::string path(const Key& key) const;

private:
    std::string directory_, suffix_;
    std::uint64_t max_bytes_;
};

}  // namespace crt
