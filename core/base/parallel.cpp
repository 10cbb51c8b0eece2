#include "base/parallel.h"

#include "base/listener.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>

namespace crt {
namespace {

/// ThreadSanitizer does not see how TBB, which is not compiled with it, hands work over. These are the same
/// orders in atomics that it sees: what was before the call is before the parts, and they before its return.
class HandOver {
public:
    HandOver() { order_.store(0, std::memory_order_release); }
    void partBegins() const { (void)order_.load(std::memory_order_acquire); }
    void partEnds() { order_.fetch_add(1, std::memory_order_acq_rel); }
    ~HandOver() { (void)order_.load(std::memory_order_acquire); }
    HandOver(const HandOver&) = delete;
    HandOver& operator=(const HandOver&) = delete;

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
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, partsOf(count, part), 1),
        [&](const tbb::blocked_range<std::size_t>& parts) {
            order.partBegins();
            const ListenerScope scope(listener);
            for (std::size_t i = parts.begin(); i < parts.end(); ++i)
                body(i * part, std::min(count, (i + 1) * part));
            order.partEnds();
        },
        tbb::simple_partitioner());
}

void parallelInvoke(const std::function<void()>& one, const std::function<void()>& other) {
    HandOver order;
    const auto ordered = [&order, listener = currentListener()](const std::function<void()>& work) {
        order.partBegins();
        const ListenerScope scope(listener);
        work();
        order.partEnds();
    };
    tbb::parallel_invoke([&] { ordered(one); }, [&] { ordered(other); });
}

void runWithThreads(unsigned threads, const std::function<void()>& work) {
    if (threads == 0) return work();
    // The arena limits what runs in it; the control lets it have more threads than processors.
    const tbb::global_control most(tbb::global_control::max_allowed_parallelism, threads);
    tbb::task_arena arena(static_cast<int>(threads));
    // It may run on a thread of the arena.
    arena.execute([&work, listener = currentListener()] {
        const ListenerScope scope(listener);
        work();
    });
}

}  // namespace crt
