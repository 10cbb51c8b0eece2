/// Error of a test image against a reference, value by value. Nothing is dropped: one NaN or infinity voids
/// all numbers, and is counted.
#pragma once

#include <cstdint>
#include <span>

namespace crt::stats {

struct NotFinite {
    std::uint64_t nan = 0, infinite = 0;
    std::uint64_t total() const { return nan + infinite; }
};

/// I is the test's value, R the reference's; means run over all values. All numbers are NaN unless valid().
struct ErrorMetrics {
    std::uint64_t values = 0;
    NotFinite test, reference;
    double test_mean, reference_mean;
    double
        mean_ratio;  ///< Of test to reference. NaN when both are black, infinite when only the reference is.
    double mse;            ///< mean (I − R)²
    double rmse;           ///< √mse
    double relative_rmse;  ///< rmse / |mean R|; 0 when both are the same, infinite against black.
    double relmse;         ///< mean (I − R)² / (R² + ε²), ε = mean(R)/100: same at any exposure.
    double smape;          ///< mean 2|I − R| / (|I| + |R|), in [0, 2]
    double mae;            ///< mean |I − R|
    double p99_absolute;   ///< The smallest |I − R| that 99 % of all do not exceed.
    double max_absolute;   ///< max |I − R|

    bool valid() const { return values > 0 && test.total() == 0 && reference.total() == 0; }
};

/// Both of one size, which may be a plane, an image or several of them.
ErrorMetrics errorMetrics(std::span<const float> test, std::span<const float> reference);

}  // namespace crt::stats
