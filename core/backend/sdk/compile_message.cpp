#include "backend/sdk/compile_message.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>

namespace crt::plugin {

void CompileMessage::add(const void* bytes, std::size_t size) {
    const std::uint64_t length = size;
    const auto append = [this](const void* from, std::size_t count) {
        const auto* first = static_cast<const unsigned char*>(from);
        bytes_.insert(bytes_.end(), first, first + count);
    };
    append(&length, sizeof length);
    append(bytes, size);
}

std::vector<unsigned char> CompileMessage::next() {
    std::uint64_t length = 0;
    if (bytes_.size() - taken_ < sizeof length)
        throw std::runtime_error("the output of the compiler process is incomplete");
    std::memcpy(&length, bytes_.data() + taken_, sizeof length);
    taken_ += sizeof length;
    if (bytes_.size() - taken_ < length)
        throw std::runtime_error("the output of the compiler process is incomplete");
    const auto begin = bytes_.begin() + static_cast<std::ptrdiff_t>(taken_);
    taken_ += length;
    return {begin, begin + static_cast<std::ptrdiff_t>(length)};
}

std::string CompileMessage::nextText() {
    const std::vector<unsigned char> bytes = next();
    return {bytes.begin(), bytes.end()};
}

void CompileMessage::writeTo(int descriptor) const {
    for (std::size_t done = 0; done < bytes_.size();) {
        const ssize_t n = ::write(descriptor, bytes_.data() + done, bytes_.size() - done);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0)
            throw std::runtime_error(std::string("cannot write to the compiler process: ") +
                                     std::strerror(errno));
        done += static_cast<std::size_t>(n);
    }
}

CompileMessage CompileMessage::readFrom(int descriptor) {
    struct stat status {};
    if (::fstat(descriptor, &status) != 0)
        throw std::runtime_error("the output of the compiler process cannot be read");
    CompileMessage message;
    message.bytes_.resize(static_cast<std::size_t>(status.st_size));
    for (std::size_t done = 0; done < message.bytes_.size();) {
        const ssize_t n = ::pread(descriptor, message.bytes_.data() + done, message.bytes_.size() - done,
                                  static_cast<off_t>(done));
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) throw std::runtime_error("the output of the compiler process cannot be read");
        done += static_cast<std::size_t>(n);
    }
    return message;
}

}  // namespace crt::plugin
