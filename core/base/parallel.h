/// Work of the host on all processors (TBB). Results must not depend on the number of threads: parts are cut
/// by the amount of work, and their results are combined in their order.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <type_traits>
#include <utility>

namespace crt {

/// Calls body(first, end) for [0, part), [part, 2 part), … of [0, count), in any order and at the same
/// time. Returns when all are done. An exception of one of them reaches the caller; which of several, is
/// left to chance.
void parallelFor(std::size_t count, std::size_t part,
                 const std::function<void(std::size_t first, std::size_t end)>& body);

/// The number of calls that parallelFor makes.
inline std::size_t partsOf(std::size_t count, std::size_t part) { return (count + part - 1) / part; }

/// Both, at the same time where a thread is free.
void parallelInvoke(const std::function<void()>& one, const std::function<void()>& other);

/// Runs `work` so that it, and what it calls of the above, uses at most this number of threads; 0: one per
/// processor. More than there are processors are allowed.
void runWithThreads(unsigned threads, const std::function<void()>& work);

/// The same for work that returns something.
template <typename Work>
std::invoke_result_t<Work&> resultWithThreads(unsigned threads, Work&& work) {
    std::optional<std::invoke_result_t<Work&>> result;
    runWithThreads(threads, [&] { result.emplace(work()); });
    return *std::move(result);
}

}  // namespace crt
