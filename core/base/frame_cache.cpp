#include "base/frame_cache.h"

#include <atomic>
#include <vector>

namespace crt {
namespace {

std::atomic<bool> is_wanted{false};

struct Caches {
    std::mutex mutex;
    std::vector<FrameCacheBase*> all;  // They live as long as the process.
};
Caches& caches() {
    static Caches all;
    return all;
}

template <class Act>
void forEachCache(const Act& act) {
    const std::lock_guard lock(caches().mutex);
    for (FrameCacheBase* cache : caches().all) act(*cache);
}

}  // namespace

KeptFrames::KeptFrames() { is_wanted = true; }

KeptFrames::~KeptFrames() {
    is_wanted = false;
    forEachCache([](FrameCacheBase& cache) { cache.forget(); });
}

void KeptFrames::nextFrame() {
    forEachCache([](FrameCacheBase& cache) { cache.nextFrame(); });
}

bool KeptFrames::wanted() { return is_wanted; }

FrameCacheBase::FrameCacheBase() {
    const std::lock_guard lock(caches().mutex);
    caches().all.push_back(this);
}

}  // namespace crt
