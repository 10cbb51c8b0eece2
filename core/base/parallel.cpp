#include "base/parallel.h"

#include "base/listener.h"
#include "base/task_scheduler.h"

#include <algorithm>
#include <atomic>

namespace crt {
namespace {

/// Work as the scheduler calls it: the caller's listener hears each part. ThreadSanitizer does not see how
/// TBB, which is not compiled with it, hands work over; `order_` says the same in a way that it sees: what
/// was before the call is before the parts, and they before its return.
class Work {
public:
    explicit Work(const std::function<void(std::size_t)>& body) : body_(body) {
        order_.store(0, std::memory_order_release);
    }
    ~Work() { (void)order_.load(std::memory_order_acquire); }
    Work(const Work&) = delete;
    Work& operator=(const Work&) = delete;

    static void call(void* context, std::size_t index) {
        Work& work = *static_cast<Work*>(context);
        (void)work.order_.load(std::memory_order_acquire);
        const Done done{work.order_};
        const ListenerScope scope(work.listener_);
        work.body_(index);
    }

private:
    struct Done {
        std::atomic<std::size_t>& order;
        ~Done() { order.fetch_add(1, std::memory_order_acq_rel); }
    };

    const std::function<void(std::size_t)>& body_;
    const ListenerRef listener_ = currentListener();
    std::atomic<std::size_t> order_;
};

}  // namespace

void parallelFor(std::size_t count, std::size_t part,
                 const std::function<void(std::size_t first, std::size_t end)>& body) {
    if (count <= part) {
        if (count > 0) body(0, count);
        return;
    }
    const std::function<void(std::size_t)> each = [&](std::size_t i) {
        body(i * part, std::min(count, (i + 1) * part));
    };
    Work work(each);
    scheduler::forEach(partsOf(count, part), &Work::call, &work);
}

void parallelInvoke(const std::function<void()>& one, const std::function<void()>& other) {
    const std::function<void(std::size_t)> each = [&](std::size_t i) { i == 0 ? one() : other(); };
    Work work(each);
    scheduler::forBoth(&Work::call, &work);
}

void runWithThreads(unsigned threads, const std::function<void()>& work) {
    if (threads == 0) return work();
    const std::function<void(std::size_t)> all = [&](std::size_t) { work(); };
    Work whole(all);
    scheduler::withThreads(threads, &Work::call, &whole);
}

}  // namespace crt
