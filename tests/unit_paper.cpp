// The programs that bench/run paper measures are right: the processor's sums, boxes and sweeps, and the
// kernels, played by threads of the host (on every GPU the program itself compares its results with those of
// the processor).
#include "catch.h"

#include <algorithm>
#include <memory>
#include <type_traits>

// The kernels' words come last: they are macros with names of CUDA's.
#include "paper_work.h"

#include "block_on_host.h"

#include "paper_kernels.h"

using namespace paper;

namespace {

/// Points in which every bound is met once, by the last but one number of its axis.
std::vector<float> pointsOf(std::size_t count) {
    std::vector<float> points(3 * count);
    for (std::size_t i = 0; i < points.size(); ++i) points[i] = numberAt(static_cast<std::uint32_t>(i));
    for (std::size_t k = 0; k < 3; ++k) {
        points[3 * (count - 1) + k] = -1.0f - static_cast<float>(k);
        points[3 * (count / 2) + k] = 2.0f + static_cast<float>(k);
    }
    return points;
}
const Box kExpected{{-1, -2, -3, 2, 3, 4}};

template <typename Points>
Box boxByBlocks(const std::vector<float>& points, unsigned blocks, unsigned threads) {
    const std::size_t count = points.size() / 3;
    std::vector<float> of_blocks(std::size_t{6} * blocks);
    unsigned arrived = 0;
    Box box = emptyBox();
    for (int again = 0; again < 2; ++again) {
        box = emptyBox();
        runGrid(blocks, threads, [&] {
            boxKernel<Points>(points.data(), count, count, of_blocks.data(), &arrived, box.bounds);
        });
    }
    return box;
}

}  // namespace

TEST_CASE("the processor's sums are within their bound of the exact one", "[paper]") {
    for (const unsigned count_of_threads : {1u, 3u}) {
        Threads threads(count_of_threads);
        for (const std::size_t count : {2u, 15u, 17u, 4096u, 4113u, 100'003u}) {
            const std::vector<float> values = numbers(count, threads);
            const double exact = exactSum(values.data(), count);
            const double sum = sumOnHost(values.data(), count, threads);
            CHECK(std::abs(sum - exact) <= sumBound(exact, kHostAdditions));
            CHECK(exact > 0);
        }
    }
}

TEST_CASE("the processor's boxes are exact in either layout", "[paper]") {
    for (const unsigned count_of_threads : {1u, 3u}) {
        Threads threads(count_of_threads);
        for (const std::size_t count : {5u, 16u, 35u, 10'001u}) {
            const std::vector<float> points = pointsOf(count);
            CHECK(boxOnHost(points.data(), count, false, threads) == kExpected);
            CHECK(boxOnHost(asArrays(points).data(), count, true, threads) == kExpected);
        }
    }
}

TEST_CASE("rays find the nearest triangle of a table in either layout", "[paper]") {
    // Two walls across all rays, the farther one first, and a triangle behind every camera.
    const std::vector<float> corners{-90, -90, 1,  90, -90, 1,  0, 90, 1,   //
                                     -90, -90, -1, 90, -90, -1, 0, 90, -1,  //
                                     -90, -90, -3, 90, -90, -3, 0, 90, -3};
    const std::vector<float> aos = tableOf(corners, 3), soa = tableAsArrays(aos);
    std::vector<std::uint32_t> by_points(500), by_arrays(500), none(500);
    Threads threads(2);
    sweepOnHost(500, 3, TableFetch{aos.data()}, by_points.data(), threads);
    sweepOnHost(500, 3, ArraysFetch{soa.data(), 3}, by_arrays.data(), threads);
    CHECK(by_points == std::vector<std::uint32_t>(500, 1));
    CHECK(by_arrays == by_points);
    const std::vector<float> behind = tableOf({corners.begin() + 18, corners.end()}, 1);
    sweepOnHost(500, 1, TableFetch{behind.data()}, none.data(), threads);
    CHECK(none == std::vector<std::uint32_t>(500, 1));  // As many as there are: no hit.
}

TEST_CASE("the sum's kernel is within its bound, and the same again", "[paper]") {
    Threads makers(1);
    for (const unsigned blocks : {1u, 5u})
        for (const unsigned threads : {32u, 96u})
            for (const std::size_t count : {1u, 3u, 130u, 4099u}) {
                alignas(16) float values[4100] = {};
                const std::vector<float> made = numbers(count, makers);
                std::copy(made.begin(), made.end(), values);
                const double exact = exactSum(values, count);
                std::vector<float> of_blocks(blocks);
                unsigned arrived = 0;
                float sums[2] = {};
                for (float& sum : sums)
                    runGrid(blocks, threads,
                            [&] { sumKernel(values, count, of_blocks.data(), &arrived, &sum); });
                CHECK(std::abs(sums[0] - exact) <= sumBound(exact, sumAdditions(count, blocks, threads)));
                CHECK(sums[1] == sums[0]);
                CHECK(arrived == 0);
            }
}

TEST_CASE("the boxes' kernels are exact", "[paper]") {
    const std::vector<float> points = pointsOf(1000), arrays = asArrays(points);
    for (const unsigned blocks : {1u, 3u}) {
        CHECK(boxByBlocks<PointsAos>(points, blocks, 64) == kExpected);
        CHECK(boxByBlocks<PointsAosWide>(points, blocks, 64) == kExpected);
        CHECK(boxByBlocks<PointsSoa>(arrays, blocks, 64) == kExpected);
        CHECK(boxByBlocks<PointsSoaWide>(arrays, blocks, 64) == kExpected);
    }
}

TEST_CASE("the sweeps' kernels find what the processor finds", "[paper]") {
    std::vector<float> corners(9 * 20);
    for (std::size_t i = 0; i < corners.size(); ++i)
        corners[i] = 2 * numberAt(static_cast<std::uint32_t>(i) + 77) - 1;
    const std::vector<float> aos = tableOf(corners, 20), soa = tableAsArrays(aos);
    std::vector<float4> fours(60);
    std::memcpy(fours.data(), aos.data(), aos.size() * sizeof(float));
    std::copy(fours.begin(), fours.end(), constant_table);
    std::vector<std::uint32_t> expected(200);
    Threads one(1);
    sweepOnHost(200, 20, TableFetch{aos.data()}, expected.data(), one);
    CHECK(std::count(expected.begin(), expected.end(), 20u) < 150);  // Most rays hit something.

    const auto found = [&](const auto& kernel) {
        std::vector<std::uint32_t> nearest(200, 99);
        runGrid(4, 64, [&] { kernel(nearest.data()); });
        return nearest;
    };
    CHECK(found([&](auto* nearest) { sweepKernel(FetchConstant{}, 20, 200, nearest); }) == expected);
    CHECK(found([&](auto* nearest) { sweepKernel(FetchGlobal{fours.data()}, 20, 200, nearest); }) ==
          expected);
    CHECK(found([&](auto* nearest) {
              sweepKernel(FetchGlobalArrays{soa.data(), 20}, 20, 200, nearest);
          }) == expected);
    CHECK(found([&](auto* nearest) { sweepSharedKernel<64>(fours.data(), 20, 200, nearest); }) == expected);
}
