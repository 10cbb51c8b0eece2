/// Results that are kept from one frame of a sequence to the next: decoded images, trees of triangles. Other
/// renders keep nothing of the kind, as it would lie beside the scene that is made of it.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <utility>

namespace crt {

class FrameCacheBase;

/// While one lives, caches keep what is made. One at a time. [owner thread, with no work under way]
class KeptFrames {
public:
    KeptFrames();
    ~KeptFrames();
    KeptFrames(const KeptFrames&) = delete;
    KeptFrames& operator=(const KeptFrames&) = delete;

    /// A frame begins: what the last one did not use is dropped.
    static void nextFrame();
    static bool wanted();
};

class FrameCacheBase {
public:
    FrameCacheBase();
    virtual ~FrameCacheBase() = default;
    FrameCacheBase(const FrameCacheBase&) = delete;
    FrameCacheBase& operator=(const FrameCacheBase&) = delete;

    virtual void nextFrame() = 0;
    virtual void forget() = 0;
};

/// Results of a pure function by their keys. Lives as long as the process. [any thread]
template <class Key, class Value>
class FrameCache : public FrameCacheBase {
public:
    /// The result for key(), or, where none is kept, make(), which is kept. Where none are to be kept,
    /// make().
    template <class MakeKey, class Make>
    std::shared_ptr<const Value> of(const MakeKey& key, const Make& make) {
        if (!KeptFrames::wanted()) return std::make_shared<const Value>(make());
        const Key wanted = key();
        {
            const std::lock_guard lock(mutex_);
            if (const auto found = kept_.find(wanted); found != kept_.end()) {
                found->second.used = true;
                return found->second.value;
            }
        }
        auto made = std::make_shared<const Value>(make());
        const std::lock_guard lock(mutex_);
        return kept_.try_emplace(wanted, Entry{std::move(made), true}).first->second.value;
    }

    void nextFrame() override {
        const std::lock_guard lock(mutex_);
        std::erase_if(kept_, [](const auto& entry) { return !entry.second.used; });
        for (auto& entry : kept_) entry.second.used = false;
    }
    void forget() override {
        const std::lock_guard lock(mutex_);
        kept_.clear();
    }

private:
    struct Entry {
        std::shared_ptr<const Value> value;
        bool used = false;
    };
    std::mutex mutex_;
    std::map<Key, Entry> kept_;
};

}  // namespace crt
