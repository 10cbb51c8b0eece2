#include "base/file_cache.h"

#include "base/code_trust.h"

// Inlined from the header alone: a plugin with this cache needs no further library.
#define XXH_INLINE_ALL
#include <xxhash.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <exception>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace crt {
namespace {

namespace fs = std::filesystem;

constexpr unsigned char kMagic[7] = {'C', 'R', 'T', 'K', 'E', 'P', 'T'};
constexpr unsigned char kVersion = 1;
constexpr const char* kTemporarySuffix = ".crttmp";

/// Before the payload in an entry file. All members are naturally aligned and there is no padding, so it is
/// written as it lies.
struct Header {
    unsigned char magic[7];
    unsigned char version;
    unsigned char key[16];
    std::uint64_t payload_size;
    std::uint64_t checksum;  ///< XXH3-64 of the payload.
};
static_assert(sizeof(Header) == 40);

/// A file descriptor that closes itself.
class File {
public:
    explicit File(int descriptor) : descriptor_(descriptor) {}
    ~File() { close(); }
    File(const File&) = delete;
    File& operator=(const File&) = delete;

    bool isOpen() const { return descriptor_ >= 0; }
    int get() const { return descriptor_; }

    /// False when the file system reports only now that something was not written.
    bool close() {
        const int descriptor = std::exchange(descriptor_, -1);
        return descriptor < 0 || ::close(descriptor) == 0;
    }

    bool read(void* data, std::size_t size) const {
        auto* bytes = static_cast<unsigned char*>(data);
        while (size > 0) {
            const ssize_t n = ::read(descriptor_, bytes, size);
            if (n < 0 && errno == EINTR) continue;
            if (n <= 0) return false;
            bytes += n;
            size -= static_cast<std::size_t>(n);
        }
        return true;
    }

    bool write(const void* data, std::size_t size) const {
        const auto* bytes = static_cast<const unsigned char*>(data);
        while (size > 0) {
            const ssize_t n = ::write(descriptor_, bytes, size);
            if (n < 0 && errno == EINTR) continue;
            if (n <= 0) return false;
            bytes += n;
            size -= static_cast<std::size_t>(n);
        }
        return true;
    }

private:
    int descriptor_;
};

/// Unique among all threads of all processes that share the directory.
std::string temporaryPath(const std::string& entry) {
    static std::atomic<unsigned> counter{0};
    return entry + '.' + std::to_string(::getpid()) + '.' + std::to_string(counter.fetch_add(1)) +
           kTemporarySuffix;
}

}  // namespace

FileCache::FileCache(std::string directory, std::string suffix, std::uint64_t max_bytes)
    : directory_(std::move(directory)), suffix_(std::move(suffix)), max_bytes_(max_bytes) {}

FileCache::Key FileCache::makeKey(const std::vector<std::string_view>& parts) {
    std::string text;
    for (const std::string_view part : parts) {
        // The length first: {"ab", "c"} and {"a", "bc"} are different inputs.
        text += std::to_string(part.size());
        text += ':';
        text += part;
    }
    XXH128_canonical_t canonical;
    XXH128_canonicalFromHash(&canonical, XXH3_128bits(text.data(), text.size()));
    Key key;
    static_assert(sizeof(canonical.digest) == std::tuple_size<Key>::value);
    std::memcpy(key.data(), canonical.digest, key.size());
    return key;
}

std::string FileCache::path(const Key& key) const {
    if (directory_.empty()) return {};
    static constexpr char digits[] = "0123456789abcdef";
    std::string path = directory_ + '/';
    for (const unsigned char byte : key) {
        path += digits[byte >> 4];
        path += digits[byte & 15];
    }
    return path + suffix_;
}

std::optional<std::vector<unsigned char>> FileCache::load(const Key& key, std::string* refused) const {
    if (directory_.empty()) return std::nullopt;
    const std::string name = path(key);
    // Not blocking: a user with write access to the directory could have put a pipe there.
    const File file(::open(name.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOFOLLOW));
    struct stat status;
    if (!file.isOpen() || ::fstat(file.get(), &status) != 0) return std::nullopt;
    const std::string why =
        S_ISREG(status.st_mode) ? trust::whyNot(status, name) : "'" + name + "' is not a regular file";
    if (!why.empty()) {
        if (refused != nullptr) *refused = why;
        return std::nullopt;
    }
    if (static_cast<std::uint64_t>(status.st_size) > max_bytes_) return std::nullopt;

    // A damaged entry is not removed here: meanwhile another process may have put a good one in its place.
    // store() replaces it.
    Header header;
    if (!file.read(&header, sizeof(header)) || std::memcmp(header.magic, kMagic, sizeof(kMagic)) != 0 ||
        header.version != kVersion || std::memcmp(header.key, key.data(), key.size()) != 0 ||
        header.payload_size != static_cast<std::uint64_t>(status.st_size) - sizeof(header)) {
        return std::nullopt;
    }
    std::vector<unsigned char> payload(header.payload_size);
    if (!file.read(payload.data(), payload.size()) ||
        XXH3_64bits(payload.data(), payload.size()) != header.checksum)
        return std::nullopt;

    // The time of modification is the time of last use, which makeRoom() goes by: access times are often
    // switched off. May fail in a directory that is read-only; then the entry only looks older than it is.
    (void)::futimens(file.get(), nullptr);
    return payload;
}

bool FileCache::store(const Key& key, const void* data, std::size_t size) const {
    if (directory_.empty() || sizeof(Header) + size > max_bytes_) return false;

    Header header{};
    std::memcpy(header.magic, kMagic, sizeof(kMagic));
    header.version = kVersion;
    std::memcpy(header.key, key.data(), key.size());
    header.payload_size = size;
    header.checksum = XXH3_64bits(data, size);

    // Written under another name and renamed, so that a reader sees the old entry, none, or the whole new
    // one. Not synced: after a power cut the checksum tells, and the result is made again.
    const std::string entry = path(key);
    const std::string temporary = temporaryPath(entry);
    File file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600));
    if (!file.isOpen()) return false;
    const bool written = file.write(&header, sizeof(header)) && file.write(data, size);
    if (!file.close() || !written || ::rename(temporary.c_str(), entry.c_str()) != 0) {
        ::unlink(temporary.c_str());
        return false;
    }
    return true;
}

void FileCache::makeRoom() const {
    struct Entry {
        fs::file_time_type used;
        std::uint64_t size;
        fs::path path;
    };
    try {
        std::vector<Entry> entries;
        std::uint64_t total = 0;
        const auto now = fs::file_time_type::clock::now();
        for (const fs::directory_entry& file :
             fs::directory_iterator(directory_, fs::directory_options::skip_permission_denied)) {
            // Another process may remove any of these at any time; then there is nothing to count.
            std::error_code gone;
            const fs::file_time_type used = file.last_write_time(gone);
            const std::uint64_t size = gone ? 0 : file.file_size(gone);
            if (gone) continue;
            if (file.path().extension() == kTemporarySuffix) {
                // Of a process that died while writing; no write takes an hour.
                if (now - used > std::chrono::hours(1)) fs::remove(file.path(), gone);
            } else if (file.path().extension() == suffix_) {
                entries.push_back({used, size, file.path()});
                total += size;
            }
        }
        if (total <= max_bytes_) return;
        std::sort(entries.begin(), entries.end(),
                  [](const Entry& a, const Entry& b) { return a.used < b.used; });
        for (const Entry& entry : entries) {
            if (total <= max_bytes_) break;
            std::error_code gone;
            fs::remove(entry.path, gone);
            total -= entry.size;
        }
    } catch (const std::exception&) {
        // The directory cannot be listed: it stays as it is, too large at worst.
    }
}

}  // namespace crt
