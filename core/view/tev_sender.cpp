#include "view/tev_sender.h"

#include "base/error.h"
#include "base/listener.h"
#include "base/log.h"
#include "film/resolve.h"

#include <fmt/format.h>

#include <netdb.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace crt {
namespace {

// Kinds of packets, of tev 1.29 and later.
constexpr std::uint8_t kCreateImage = 4, kUpdateImageV3 = 6;
constexpr const char* kChannels[] = {"R", "G", "B"};
constexpr std::int32_t kChannelCount = 3;

/// A packet begins with its length, these four bytes included.
class Packet {
public:
    explicit Packet(std::uint8_t kind) : bytes_(4) { bytes_.push_back(kind); }

    void addByte(std::uint8_t value) { bytes_.push_back(value); }
    void addText(const std::string& text) {
        bytes_.insert(bytes_.end(), text.begin(), text.end());
        bytes_.push_back(0);
    }
    template <class T>
    void add(T value) {
        static_assert(std::endian::native == std::endian::little, "packets are little-endian");
        const auto* const first = reinterpret_cast<const std::uint8_t*>(&value);
        bytes_.insert(bytes_.end(), first, first + sizeof value);
    }
    void addFloats(const std::vector<float>& values) {
        const auto* const first = reinterpret_cast<const std::uint8_t*>(values.data());
        bytes_.insert(bytes_.end(), first, first + values.size() * sizeof(float));
    }
    std::vector<std::uint8_t> finish() && {
        const auto length = static_cast<std::uint32_t>(bytes_.size());
        std::memcpy(bytes_.data(), &length, sizeof length);
        return std::move(bytes_);
    }

private:
    std::vector<std::uint8_t> bytes_;
};

constexpr std::uint8_t kKeepFocus = 0;

}  // namespace

TevAddress parseTevAddress(const std::string& text) {
    constexpr const char* kPort = "14158";
    const std::size_t colon = text.rfind(':');
    TevAddress address{text.substr(0, colon), colon == std::string::npos ? kPort : text.substr(colon + 1)};
    const bool is_port = !address.port.empty() && address.port.size() <= 5 &&
                         address.port.find_first_not_of("0123456789") == std::string::npos &&
                         std::stoi(address.port) > 0 && std::stoi(address.port) <= 65535;
    if (address.host.empty() || !is_port)
        throw Error(ErrorKind::Usage,
                    fmt::format("--tev takes HOST:PORT, such as localhost:{}, not '{}'", kPort, text));
    return address;
}

std::vector<std::uint8_t> tevCreateImage(const std::string& name, std::uint32_t width,
                                         std::uint32_t height) {
    Packet packet(kCreateImage);
    packet.addByte(kKeepFocus);
    packet.addText(name);
    packet.add(static_cast<std::int32_t>(width));
    packet.add(static_cast<std::int32_t>(height));
    packet.add(kChannelCount);
    for (const char* channel : kChannels) packet.addText(channel);
    return std::move(packet).finish();
}

std::vector<std::uint8_t> tevUpdateImage(const std::string& name, std::uint32_t width, std::uint32_t height,
                                         const std::vector<float>& rgb) {
    Packet packet(kUpdateImageV3);
    packet.addByte(kKeepFocus);
    packet.addText(name);
    packet.add(kChannelCount);
    for (const char* channel : kChannels) packet.addText(channel);
    packet.add(std::int32_t{0});
    packet.add(std::int32_t{0});
    packet.add(static_cast<std::int32_t>(width));
    packet.add(static_cast<std::int32_t>(height));
    for (std::int64_t offset = 0; offset < kChannelCount; ++offset) packet.add(offset);
    for (std::int32_t c = 0; c < kChannelCount; ++c) packet.add(std::int64_t{kChannelCount});
    packet.addFloats(rgb);
    return std::move(packet).finish();
}

class TevSender::Connection {
public:
    /// Throws std::runtime_error.
    explicit Connection(const TevAddress& address) {
        addrinfo wanted{};
        wanted.ai_socktype = SOCK_STREAM;
        addrinfo* found = nullptr;
        const int unknown = ::getaddrinfo(address.host.c_str(), address.port.c_str(), &wanted, &found);
        if (unknown != 0) throw std::runtime_error(::gai_strerror(unknown));
        int why = 0;
        for (const addrinfo* one = found; one != nullptr && socket_ < 0; one = one->ai_next) {
            socket_ = ::socket(one->ai_family, one->ai_socktype | SOCK_CLOEXEC, one->ai_protocol);
            if (socket_ >= 0 && ::connect(socket_, one->ai_addr, one->ai_addrlen) == 0) break;
            why = errno;
            close();
        }
        ::freeaddrinfo(found);
        if (socket_ < 0) throw std::runtime_error(std::strerror(why));
        // A tev that hangs shall not hang this thread.
        const timeval longest{.tv_sec = 2, .tv_usec = 0};
        ::setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &longest, sizeof longest);
    }
    ~Connection() { close(); }
    Connection(const Connection&) = delete;
    Connection& operator=(const Connection&) = delete;

    void send(const std::vector<std::uint8_t>& packet) {
        for (std::size_t sent = 0; sent < packet.size();) {
            const ssize_t part = ::send(socket_, packet.data() + sent, packet.size() - sent, MSG_NOSIGNAL);
            if (part > 0)
                sent += static_cast<std::size_t>(part);
            else if (errno != EINTR)
                throw std::runtime_error(std::strerror(errno));
        }
    }

private:
    void close() {
        if (socket_ >= 0) ::close(std::exchange(socket_, -1));
    }
    int socket_ = -1;
};

TevSender::TevSender(TevAddress address, std::string image_name, ViewState& state)
    : address_(std::move(address)),
      name_(std::move(image_name)),
      state_(state),
      thread_([this, listener = currentListener()] {
          const ListenerScope scope(listener);
          run();
      }) {}

TevSender::~TevSender() {
    {
        const std::lock_guard lock(mutex_);
        stopping_ = true;
    }
    changed_.notify_all();
}

void TevSender::take(Snapshot snapshot) {
    if (snapshot.divisor != 1) return;
    {
        const std::lock_guard lock(mutex_);
        waiting_ = std::move(snapshot);
    }
    changed_.notify_all();
}

void TevSender::run() {
    constexpr std::chrono::seconds kBetweenTries{1};
    std::unique_lock lock(mutex_);
    while (true) {
        changed_.wait(lock, [&] { return stopping_ || waiting_; });
        if (stopping_) return;
        Snapshot snapshot = *std::exchange(waiting_, std::nullopt);
        lock.unlock();
        std::string failure;
        try {
            send(snapshot);
            tell(fmt::format("tev at {}:{} shows '{}'", address_.host, address_.port, name_));
        } catch (const std::exception& error) {
            failure = error.what();
            connection_.reset();
            width_ = height_ = 0;
            tell(fmt::format("tev at {}:{} cannot be reached: {}", address_.host, address_.port, failure));
        }
        lock.lock();
        if (failure.empty()) continue;
        // The last film of a render is sent as well, as soon as tev is there.
        if (!waiting_) waiting_ = std::move(snapshot);
        changed_.wait_for(lock, kBetweenTries, [&] { return stopping_; });
    }
}

void TevSender::send(const Snapshot& snapshot) {
    const Scene& scene = *snapshot.seen->read;
    const Image image = resolveImage(*snapshot.film, developmentOf(scene).forFloats(), 0);
    if (!connection_) connection_ = std::make_unique<Connection>(address_);
    if (image.width != width_ || image.height != height_)
        connection_->send(tevCreateImage(name_, image.width, image.height));
    width_ = image.width;
    height_ = image.height;
    connection_->send(tevUpdateImage(name_, width_, height_, image.pixels));
}

void TevSender::tell(const std::string& what) {
    if (std::exchange(told_, what) == what) return;
    logInfo("{}", what);
    state_.update([&](Status& status) { status.tev = what; });
}

}  // namespace crt
