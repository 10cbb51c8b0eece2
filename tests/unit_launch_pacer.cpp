// Launch pacing: whatever the budget does, every sample of every pixel is launched exactly once.
#include "backend/sdk/launch_pacer.h"
#include "catch.h"
#include "gpu/film_slices.h"
#include "render_range.h"

#include <cmath>
#include <random>
#include <vector>

using crt::Launch;
using crt::LaunchPacer;

TEST_CASE("launches cover a range exactly once, with any tile, at any speed", "[launch_pacer]") {
    std::mt19937 random(1);
    const auto below = [&](std::uint32_t n) {
        return std::uniform_int_distribution<std::uint32_t>(0, n - 1)(random);
    };
    for (int trial = 0; trial < 300; ++trial) {
        const std::uint32_t width = 1 + below(40), height = 1 + below(40), x0 = below(5), y0 = below(5);
        const std::uint64_t first = below(100), samples = 1 + below(70);
        const std::uint32_t tile = below(2) ? 0 : 1 + below(50);
        LaunchPacer pacer(0.01, 1 + below(5000), 1 + below(8), 1 + below(3000));
        // The same pacer twice: what it has learnt must not show.
        for (int repeat = 0; repeat < 2; ++repeat) {
            std::vector<std::vector<int>> seen(std::size_t{width} * height, std::vector<int>(samples));
            pacer.begin(renderRange(x0, y0, x0 + width, y0 + height, first, samples), tile);
            CHECK(pacer.done() == 0);
            double done = 0;
            for (Launch launch; pacer.next(launch);) {
                REQUIRE(launch.sample_count > 0);
                REQUIRE(launch.pixels() > 0);
                if (tile != 0) REQUIRE((launch.x1 - launch.x0 <= tile && launch.y1 - launch.y0 <= tile));
                for (std::uint32_t y = launch.y0; y < launch.y1; ++y)
                    for (std::uint32_t x = launch.x0; x < launch.x1; ++x)
                        for (std::uint64_t s = 0; s < launch.sample_count; ++s)
                            ++seen.at(std::size_t{y - y0} * width + (x - x0))
                                  .at(launch.first_sample - first + s);
                pacer.finished(launch, 1e-6 * (1 + below(100000)));
                REQUIRE(pacer.done() > done);
                done = pacer.done();
            }
            CHECK(done == 1);
            bool once = true;
            for (const std::vector<int>& pixel : seen)
                for (const int n : pixel) once = once && n == 1;
            CHECK(once);
        }
    }
}

TEST_CASE("launches come to take the wanted time", "[launch_pacer]") {
    LaunchPacer pacer(0.02, 1000);
    const double paths_per_second = 3e6;
    pacer.begin(renderRange(0, 0, 400, 300, 0, 1000), 0);
    std::vector<double> seconds;
    for (Launch launch; seconds.size() < 60 && pacer.next(launch);) {
        seconds.push_back(static_cast<double>(launch.paths()) / paths_per_second);
        pacer.finished(launch, seconds.back());
    }
    REQUIRE(seconds.size() == 60);
    CHECK(seconds.front() < 0.001);
    for (std::size_t i = 20; i < 60; ++i) CHECK(seconds[i] == Approx(0.02).epsilon(0.6));
}

TEST_CASE("a launch is at most as many times longer as it may grow", "[launch_pacer]") {
    for (const double growth : {4.0, 16.0}) {
        LaunchPacer pacer(1.0, 1 << 14, 1, 1, growth);
        pacer.begin(renderRange(0, 0, 16, 1 << 20, 0, 100), 0);
        std::vector<double> paths;
        for (Launch launch; paths.size() < 3 && pacer.next(launch);) {
            paths.push_back(static_cast<double>(launch.paths()));
            pacer.finished(launch, 1e-9 * paths.back());
        }
        REQUIRE(paths.size() == 3);
        // Up to the division of the rows that are left into equal parts.
        for (std::size_t i = 1; i < paths.size(); ++i)
            CHECK(paths[i] / paths[i - 1] == Approx(growth).epsilon(0.02));
    }
}

TEST_CASE("a device whose clock says nothing does not make launches grow", "[launch_pacer]") {
    // Start and end the same, in the wrong order, a tick apart, or far apart; the host waited all the same.
    using crt::launchSeconds;
    CHECK(launchSeconds(1000, 1000, 0.25) == 0.25);
    CHECK(launchSeconds(2000, 1000, 0.25) == 0.25);
    CHECK(launchSeconds(1000, 1001, 0.16) == 0.01);
    CHECK(launchSeconds(0, std::uint64_t{1} << 62, 0.25) == 0.25);
    CHECK(launchSeconds(0, 20'000'000, 0.021) == 0.02);

    constexpr double kWanted = 0.02, kPathsPerSecond = 1e6;
    for (const std::uint64_t ticks : {0u, 1u}) {
        LaunchPacer pacer(kWanted, 1000);
        pacer.begin(renderRange(0, 0, 4000, 3000, 0, 100000), 0);
        Launch launch;
        for (int i = 0; i < 200; ++i) {
            REQUIRE(pacer.next(launch));
            const double waited = static_cast<double>(launch.paths()) / kPathsPerSecond;
            CHECK(waited < 17 * kWanted);
            pacer.finished(launch, launchSeconds(5, 5 + ticks, waited));
        }
    }
    // And who passes on a time of nothing learns nothing.
    LaunchPacer pacer(kWanted, 1000);
    pacer.begin(renderRange(0, 0, 4000, 3000, 0, 100000), 0);
    Launch launch;
    for (int i = 0; i < 100; ++i) {
        REQUIRE(pacer.next(launch));
        CHECK(launch.paths() <= 4000);  // One row.
        pacer.finished(launch, i % 2 == 0 ? 0.0 : std::nan(""));
    }
}

TEST_CASE("launches that take as long as one long path do not shrink to single paths", "[launch_pacer]") {
    // A device of 1000 lanes and a path a lane: fifty times the wanted time, however few paths there are.
    constexpr std::uint64_t kLanes = 1000, kSamples = 16384;
    // Six films of 4 * 16384 paths, so that all of it is learnt before the last.
    LaunchPacer pacer(0.02, 1 << 18, 4, kLanes);
    for (int repeat = 0; repeat < 6; ++repeat) {
        pacer.begin(renderRange(0, 0, 2, 2, 0, kSamples), 0);
        std::uint64_t launches = 0;
        for (Launch launch; pacer.next(launch); ++launches) pacer.finished(launch, 1.0);
        CHECK(launches <= 4 * kSamples / kLanes + 2);
    }
}

TEST_CASE("an empty range has no launches and is done", "[launch_pacer]") {
    LaunchPacer pacer(0.02, 1000);
    Launch launch;
    for (const CrtRenderRange& empty :
         {renderRange(0, 0, 10, 10, 5, 0), renderRange(3, 3, 3, 9, 0, 4), renderRange(0, 7, 9, 7, 0, 4)}) {
        pacer.begin(empty, 0);
        CHECK_FALSE(pacer.next(launch));
        CHECK(pacer.done() == 1);
    }
}

TEST_CASE("a huge range neither overflows nor is cut into nothing", "[launch_pacer]") {
    LaunchPacer pacer(0.02, 1u << 20);
    pacer.begin(renderRange(0, 0, 65535, 32767, 0, std::uint64_t{1} << 53), 0);
    Launch launch;
    REQUIRE(pacer.next(launch));
    CHECK(launch.x1 == 65535);
    CHECK(launch.paths() <= (1u << 20));
    CHECK(launch.sample_count >= 1);
}

TEST_CASE("slices fill a device with few pixels, and cost no more memory than allowed", "[launch_pacer]") {
    // 1000 blocks at once, filled 16 times.
    const auto chooseSlices = [](auto blocks, auto resident, auto samples, auto most) {
        return crt::gpu::chooseSlices(blocks, resident, 16, samples, most);
    };
    CHECK(chooseSlices(16'000, 1000, 1 << 20, 1000) == 1);
    CHECK(chooseSlices(1000, 1000, 1 << 20, 1000) == 16);
    CHECK(chooseSlices(10, 1000, 1 << 20, 1000) == 1000);  // as many as memory allows, of 1600
    CHECK(chooseSlices(10, 1000, 64, 1000) == 64);         // a sample each, or the device stays empty
    CHECK(chooseSlices(1000, 1000, 64, 1000) == 8);        // eight samples each, where it is full anyway
    CHECK(chooseSlices(1, 1 << 20, 1u << 31, ~std::uint64_t{0}) == 65535);  // rows of a grid
    CHECK(chooseSlices(10, 1000, 1, 0) == 1);

    using crt::gpu::sliceBudget;
    constexpr std::uint64_t GiB = std::uint64_t{1} << 30;
    CHECK(sliceBudget(80 * GiB, 80 * GiB) == GiB / 2);
    CHECK(sliceBudget(4 * GiB, 4 * GiB) == GiB / 4);
    CHECK(sliceBudget(80 * GiB, GiB / 2) == GiB / 4);
    CHECK(sliceBudget(80 * GiB, 0) == 0);
}
