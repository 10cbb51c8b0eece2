/// Measures processor time, for work that takes minutes if it is quadratic.
#pragma once

#include <ctime>

namespace crt::test {

// Of all processors together. Work under a sanitizer takes several times as long as it should.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr double kSecondsAllowed = 40;
#else
constexpr double kSecondsAllowed = 4;
#endif

/// Time of this process on processors: what else the machine does has no part in it.
template <class Work>
double secondsOf(const Work& work) {
    const std::clock_t start = std::clock();
    work();
    return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

}  // namespace crt::test
