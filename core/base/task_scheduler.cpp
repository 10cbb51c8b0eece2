#include "base/task_scheduler.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/task_arena.h>

namespace crt::scheduler {

void forEach(std::size_t count, Call call, void* context) {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, count, 1),
        [=](const tbb::blocked_range<std::size_t>& some) {
            for (std::size_t i = some.begin(); i < some.end(); ++i) call(context, i);
        },
        tbb::simple_partitioner());
}

void forBoth(Call call, void* context) {
    tbb::parallel_invoke([=] { call(context, 0); }, [=] { call(context, 1); });
}

void withThreads(unsigned threads, Call call, void* context) {
    // The arena limits what runs in it; the control lets it have more threads than processors.
    const tbb::global_control most(tbb::global_control::max_allowed_parallelism, threads);
    tbb::task_arena arena(static_cast<int>(threads));
    arena.execute([=] { call(context, 0); });
}

}  // namespace crt::scheduler
