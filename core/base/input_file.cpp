#include "base/input_file.h"

#include "base/host.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace crt {
namespace {

class Descriptor {
public:
    explicit Descriptor(int descriptor) : descriptor_(descriptor) {}
    ~Descriptor() { ::close(descriptor_); }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    int get() const { return descriptor_; }

private:
    int descriptor_;
};

/// "1.5 GiB", "300 bytes".
std::string sizeText(std::uint64_t bytes) {
    constexpr const char* kUnits[] = {"KiB", "MiB", "GiB", "TiB", "PiB", "EiB"};
    if (bytes < 1024) return fmt::format("{} bytes", bytes);
    double size = static_cast<double>(bytes) / 1024;
    std::size_t unit = 0;
    for (; size >= 1024 && unit + 1 < std::size(kUnits); ++unit) size /= 1024;
    return fmt::format("{:.{}f} {}", size, size < 10 && size != static_cast<int>(size) ? 1 : 0,
                       kUnits[unit]);
}

const char* kindOf(mode_t mode) {
    if (S_ISFIFO(mode)) return "a pipe";
    if (S_ISCHR(mode)) return "a character device";
    if (S_ISBLK(mode)) return "a block device";
    return "a socket";
}

std::string readAll(int descriptor, std::uint64_t expected_bytes, std::uint64_t most_bytes) {
    constexpr std::size_t kBlock = std::size_t{1} << 16;
    std::string text;
    text.reserve(expected_bytes);
    for (;;) {
        const std::size_t size = text.size();
        text.resize(
            std::max<std::size_t>(size + kBlock, std::min<std::size_t>(expected_bytes, size + 64 * kBlock)));
        const ssize_t count = ::read(descriptor, text.data() + size, text.size() - size);
        text.resize(size + static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
        if (count < 0 && errno == EINTR) continue;
        if (count < 0)
            throw InputRefused(fmt::format("cannot be read to its end: {}", std::strerror(errno)));
        if (count == 0) return text;
        if (text.size() > most_bytes)
            throw InputRefused(
                fmt::format("has more than {}, the most for a file of this kind", sizeText(most_bytes)));
    }
}

}  // namespace

int openInput(const std::string& path) {
    // Not blocking: open() of a pipe waits for a writer, who may never come.
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
    if (descriptor < 0) throw InputRefused(fmt::format("cannot be opened: {}", std::strerror(errno)));
    struct stat status {};
    const bool known = ::fstat(descriptor, &status) == 0;
    if (known && S_ISREG(status.st_mode)) return descriptor;
    ::close(descriptor);
    if (!known) throw InputRefused(fmt::format("cannot be opened: {}", std::strerror(errno)));
    throw InputRefused(S_ISDIR(status.st_mode)
                           ? "is a directory"
                           : fmt::format("is {}, not a regular file", kindOf(status.st_mode)));
}

void requireInput(const std::string& path) { const Descriptor file(openInput(path)); }

std::string plainPath(const std::filesystem::path& path) {
    const std::filesystem::path plain = path.lexically_normal();
    std::error_code unknown;
    return std::filesystem::equivalent(plain, path, unknown) ? plain.string() : path.string();
}

std::string readInput(const std::string& path, std::uint64_t most_bytes) {
    const Descriptor file(openInput(path));
    struct stat status {};
    if (::fstat(file.get(), &status) != 0)
        throw InputRefused(fmt::format("cannot be read: {}", std::strerror(errno)));
    const auto bytes = static_cast<std::uint64_t>(std::max<off_t>(status.st_size, 0));
    if (bytes > most_bytes)
        throw InputRefused(fmt::format("has {}, and the most for a file of this kind is {}", sizeText(bytes),
                                       sizeText(most_bytes)));
    constexpr std::uint64_t kWorthAsking = std::uint64_t{256} << 20;
    if (bytes > kWorthAsking && bytes > availableHostMemory())
        throw InputRefused(fmt::format("has {}, and only {} of memory is free", sizeText(bytes),
                                       sizeText(availableHostMemory())));
    return readAll(file.get(), bytes, most_bytes);
}

std::string readStandardInput(std::uint64_t most_bytes) { return readAll(STDIN_FILENO, 0, most_bytes); }

}  // namespace crt
