/// The part of TBB that parallel.h uses. Its file alone sees TBB's headers, whose templates hand work to the
/// library's threads in ways that ThreadSanitizer cannot follow: it is compiled without that. Work is a
/// function and a pointer, so that the callee can establish the memory order before it reads.
#pragma once

#include <cstddef>

namespace crt::scheduler {

using Call = void (*)(void* context, std::size_t index);

/// Calls call(context, 0) … call(context, count - 1), in any order and at the same time. Returns when all
/// are done; an exception of one of them reaches the caller.
void forEach(std::size_t count, Call call, void* context);

/// Calls call(context, 0) and call(context, 1), at the same time where a thread is free.
void forBoth(Call call, void* context);

/// Calls call(context, 0), perhaps on another thread, so that the above use at most this number of threads;
/// 1 or more.
void withThreads(unsigned threads, Call call, void* context);

}  // namespace crt::scheduler
