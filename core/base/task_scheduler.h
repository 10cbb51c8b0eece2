/// What parallel.h takes of TBB. Its file alone sees TBB's headers, whose templates hand work to the
/// library's threads in ways that ThreadSanitizer cannot follow: it is compiled without that.
#pragma once

#include <cstddef>
#include <functional>

namespace crt::scheduler {

/// Calls body(0) … body(count - 1), in any order and at the same time. Returns when all are done; an
/// exception of one of them reaches the caller.
void forEach(std::size_t count, const std::function<void(std::size_t index)>& body);

/// Both, at the same time where a thread is free.
void both(const std::function<void()>& one, const std::function<void()>& other);

/// Runs `work`, perhaps on another thread, so that the above take at most so many threads; 1 or more.
void withThreads(unsigned threads, const std::function<void()>& work);

}  // namespace crt::scheduler
