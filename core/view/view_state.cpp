#include "view/view_state.h"

namespace crt {

void ViewState::update(const std::function<void(Status&)>& change) {
    {
        const std::lock_guard lock(mutex_);
        change(status_);
        ++version_;
    }
    news_.notify_all();
}

void ViewState::show(Picture picture) {
    {
        const std::lock_guard lock(mutex_);
        picture.number = ++pictures_;
        picture_ = std::make_shared<const Picture>(std::move(picture));
        ++version_;
    }
    news_.notify_all();
}

void ViewState::close() {
    {
        const std::lock_guard lock(mutex_);
        closed_ = true;
    }
    news_.notify_all();
}

ViewState::Copy ViewState::waitBeyond(std::uint64_t version, std::chrono::milliseconds longest) {
    std::unique_lock lock(mutex_);
    looked_at_ = std::chrono::steady_clock::now();
    // A version from before a restart of the program is not valid.
    news_.wait_for(lock, longest, [&] { return closed_ || version_ != version; });
    looked_at_ = std::chrono::steady_clock::now();
    return {version_, status_, picture_, closed_};
}

bool ViewState::isWatched() {
    constexpr std::chrono::seconds kLooks{30};
    const std::lock_guard lock(mutex_);
    return std::chrono::steady_clock::now() - looked_at_ < kLooks;
}

}  // namespace crt
