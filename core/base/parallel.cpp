#include "base/parallel.h"

#include "base/listener.h"
#include "base/task_scheduler.h"

#include <algorithm>
#include <atomic>

namespace crt {
namespace {

/// ThreadSanitizer does not see how TBB, which is not compiled with it, hands work over. These are the same
/// orders in atomics that it sees: what was before the call is before the parts, and they before its return.
class HandOver {
public:
    HandOver() { order_.store(0, std::memory_order_release); }
    ~HandOver() { (void)order_.load(std::memory_order_acquire); }
    HandOver(const HandOver&) = delete;
    HandOver& operator=(const HandOver&) = delete;

    /// Lives while a part is worked on, on whichever thread; the listener of the caller hears it.
    class Part {
    public:
        Part(HandOver& all, const ListenerRef& listener) : all_(all), scope_(received(all, listener)) {}
        ~Part() { all_.order_.fetch_add(1, std::memory_order_acq_rel); }
        Part(const Part&) = delete;
        Part& operator=(const Part&) = delete;

    private:
        static const ListenerRef& received(HandOver& all, const ListenerRef& listener) {
            (void)all.order_.load(std::memory_order_acquire);
            return listener;
        }
        HandOver& all_;
        ListenerScope scope_;
    };

private:
    std::atomic<std::size_t> order_;
};

}  // namespace

void parallelFor(std::size_t count, std::size_t part,
                 const std::function<void(std::size_t first, std::size_t end)>& body) {
    if (count <= part) {
        if (count > 0) body(0, count);
        return;
    }
    HandOver order;
    const ListenerRef listener = currentListener();
    scheduler::forEach(partsOf(count, part), [&](std::size_t i) {
        const HandOver::Part here(order, listener);
        body(i * part, std::min(count, (i + 1) * part));
    });
}

void parallelInvoke(const std::function<void()>& one, const std::function<void()>& other) {
    HandOver order;
    const ListenerRef listener = currentListener();
    const auto ordered = [&](const std::function<void()>& work) {
        const HandOver::Part here(order, listener);
        work();
    };
    scheduler::both([&] { ordered(one); }, [&] { ordered(other); });
}

void runWithThreads(unsigned threads, const std::function<void()>& work) {
    if (threads == 0) return work();
    HandOver order;
    const ListenerRef listener = currentListener();
    scheduler::withThreads(threads, [&] {
        const HandOver::Part here(order, listener);
        work();
    });
}

}  // namespace crt
