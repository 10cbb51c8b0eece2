/// Sends the image to the viewer tev by its protocol: packets over TCP, little-endian.
#pragma once

#include "view/view_state.h"
#include "view/snapshot.h"

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace crt {

/// Address at which tev listens.
struct TevAddress {
    std::string host, port;
};
/// "localhost:14158"; a host alone has tev's own port. Throws crt::Error(Usage).
TevAddress parseTevAddress(const std::string& text);

/// Makes an image of that name with the channels R, G and B, in place of one of the same name.
std::vector<std::uint8_t> tevCreateImage(const std::string& name, std::uint32_t width, std::uint32_t height);
/// Replaces all its pixels; `rgb` is [height][width][3].
std::vector<std::uint8_t> tevUpdateImage(const std::string& name, std::uint32_t width, std::uint32_t height,
                                         const std::vector<float>& rgb);

/// Sends the newest film on a separate thread, as fast as tev takes it. A tev that is not there is tried
/// again.
class TevSender {
public:
    TevSender(TevAddress address, std::string image_name, ViewState& state);
    ~TevSender();
    TevSender(const TevSender&) = delete;
    TevSender& operator=(const TevSender&) = delete;

    /// Previews are left out: tev's image has one size. [any thread]
    void take(Snapshot snapshot);

private:
    class Connection;

    void run();
    void send(const Snapshot& snapshot);
    void tell(const std::string& what);

    const TevAddress address_;
    const std::string name_;
    ViewState& state_;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::optional<Snapshot> waiting_;
    bool stopping_ = false;

    // Of the thread.
    std::unique_ptr<Connection> connection_;
    std::uint32_t width_ = 0, height_ = 0;  ///< Of the image that tev has; 0: it has none.
    std::string told_;
    std::jthread thread_;  ///< Last: it uses all others.
};

}  // namespace crt
