#include "base/task_scheduler.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <cstddef>
#include <stdexcept>
#include <vector>

namespace crt::scheduler {
namespace {

/// Calls of which each is made once. TBB starts its threads late. If the system refuses a thread, TBB throws
/// and leaves out calls; this thread then makes them.
class Calls {
public:
    Calls(std::size_t count, Call call, void* context) : call_(call), context_(context), is_made_(count) {}

    void make(std::size_t i) {
        try {
            call_(context_, i);
        } catch (...) {
            failed_ = true;
            throw;
        }
        is_made_[i] = 1;
    }

    template <class Parallel>
    void makeAll(const Parallel& parallel) {
        try {
            parallel();
        } catch (const std::runtime_error&) {
            if (failed_) throw;  // A call's own exception.
            for (std::size_t i = 0; i < is_made_.size(); ++i)
                if (is_made_[i] == 0) make(i);
        }
    }

private:
    Call call_;
    void* context_;
    std::vector<char> is_made_;  ///< Not bool: threads write to neighbours.
    std::atomic<bool> failed_ = false;
};

}  // namespace

void forEach(std::size_t count, Call call, void* context) {
    Calls calls(count, call, context);
    calls.makeAll([&] {
        tbb::parallel_for(
            tbb::blocked_range<std::size_t>(0, count, 1),
            [&](const tbb::blocked_range<std::size_t>& some) {
                for (std::size_t i = some.begin(); i < some.end(); ++i) calls.make(i);
            },
            tbb::simple_partitioner());
    });
}

void forBoth(Call call, void* context) {
    Calls calls(2, call, context);
    calls.makeAll([&] { tbb::parallel_invoke([&] { calls.make(0); }, [&] { calls.make(1); }); });
}

void withThreads(unsigned threads, Call call, void* context) {
    // The arena limits what runs in it; the control lets it have more threads than processors.
    const tbb::global_control most(tbb::global_control::max_allowed_parallelism, threads);
    tbb::task_arena arena(static_cast<int>(threads));
    arena.execute([=] { call(context, 0); });
}

}  // namespace crt::scheduler
