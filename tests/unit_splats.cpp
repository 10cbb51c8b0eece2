// Splats: sums of 128 bits that threads add to in any order, and films that hold them.
#include "film/checkpoint.h"
#include "film/error_estimate.h"
#include "kernel_test.h"

#include "base/temporary_folder.h"
#include "file_bytes.h"
#include "kernel/film/splat.h"
#include "same_film.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <thread>
#include <vector>

using namespace crt;
using namespace kernel_test;
using crt::test::checkSame;

namespace {

using Sum = std::array<u64, 2>;

double valueOf(const Sum& sum) {
    return static_cast<double>(static_cast<__int128>(static_cast<unsigned __int128>(sum[1]) << 64 | sum[0]));
}

/// The view that crt_splat() has of a film, in the middle of a sample.
struct Kernel {
    CrtScene scene{};
    CrtContext context{};
    CrtFilmPixel pixel{};

    Kernel(Film& film, u64 sample) {
        const FilmShape& shape = film.shape();
        scene.width = shape.width;
        scene.height = shape.height;
        scene.film_width = scene.film_height = 100;
        scene.crop_x = 10;
        scene.crop_y = 20;
        scene.replicate_shift = shape.replicates() == 4 ? 2 : 0;
        scene.splat_scale = shape.splat_scale;
        context.scene = &scene;
        pixel.first_sample = sample;
        pixel.splats = reinterpret_cast<u64*>(film.splats.data());
    }
    void splat(u32 x, u32 y, f32 v) const {
        crt_splat(&context, &pixel, x, y, make_vec4(v, 2 * v, 3 * v, 0));
    }
};

constexpr double kScale = 1ull << 32;
const FilmShape kPlain{3, 2, 4, kAovSquares | kAovSplats, 0, kScale};
const FilmShape kReplicated{3, 2, 6, kAovReplicates | kAovSplats, 0, kScale};

/// Every pixel has `valid` samples, all of them 0, and no splats.
Film filmWith(const FilmShape& shape, SampleRange asked, std::uint64_t valid) {
    Film film(shape);
    film.samples.add(asked);
    for (std::uint64_t& count : film.counts) count = valid;
    return film;
}

}  // namespace

TEST_CASE("a sum of splats carries from its low word to its high one", "[splats]") {
    Sum sum{};
    for (int i = 0; i < 3; ++i) crt_splat_add(sum.data(), std::ldexp(1.0, 62));
    CHECK(sum == Sum{u64{3} << 62, 0});
    crt_splat_add(sum.data(), std::ldexp(1.0, 62));
    CHECK(sum == Sum{0, 1});
    crt_splat_add(sum.data(), -1);
    CHECK(sum == Sum{~u64{0}, 0});
    crt_splat_add(sum.data(), 1.5);  // Rounded to the nearest unit.
    CHECK(sum == Sum{1, 1});
}

TEST_CASE("a sum of splats may be below 0", "[splats]") {
    Sum sum{};
    crt_splat_add(sum.data(), -0.4);
    CHECK(sum == Sum{0, 0});
    crt_splat_add(sum.data(), -3);
    CHECK(valueOf(sum) == -3);
    crt_splat_add(sum.data(), -std::ldexp(1.0, 62));
    crt_splat_add(sum.data(), 3);
    CHECK(valueOf(sum) == -std::ldexp(1.0, 62));
    crt_splat_add(sum.data(), std::ldexp(1.0, 62));
    CHECK(sum == Sum{0, 0});
}

TEST_CASE("splats of many threads have one sum, in whatever order they come", "[splats]") {
    constexpr int kThreads = 8, kEach = 20000;
    std::vector<double> values(kThreads * kEach);
    std::mt19937_64 generator(5);
    std::uniform_real_distribution<double> exponent(0, 62.9), sign(-0.2, 1);
    __int128 expected = 0;
    for (double& value : values) {
        value = std::copysign(static_cast<double>(static_cast<float>(std::exp2(exponent(generator)))),
                              sign(generator));
        expected += static_cast<__int128>(value < 0 ? -std::floor(0.5 - value) : std::floor(value + 0.5));
    }
    for (int round = 0; round < 4; ++round) {
        std::shuffle(values.begin(), values.end(), generator);
        Sum sum{};
        std::vector<std::thread> threads;
        for (int t = 0; t < kThreads; ++t)
            threads.emplace_back([&, t] {
                for (int i = 0; i < kEach; ++i) crt_splat_add(sum.data(), values[t * kEach + i]);
            });
        for (std::thread& thread : threads) thread.join();
        CHECK(sum[0] == static_cast<u64>(expected));
        CHECK(sum[1] == static_cast<u64>(static_cast<unsigned __int128>(expected) >> 64));
    }
}

TEST_CASE("a splat goes to its pixel, within the crop window alone", "[splats]") {
    Film film = filmWith(kPlain, {0, 4}, 4);
    const Kernel kernel(film, 0);
    kernel.splat(11, 21, 0.5f);
    kernel.splat(12, 20, 0.25f);
    kernel.splat(12, 20, 0.25f);
    const std::vector<std::uint64_t> before = film.splats;
    for (const auto& [x, y] : {std::pair{9u, 20u}, {13u, 20u}, {10u, 19u}, {10u, 22u}, {0u, 0u}})
        kernel.splat(x, y, 1);
    CHECK(film.splats == before);
    for (std::uint32_t c = 0; c < 3; ++c) {
        CHECK(film.splatSum(1, 1, c) == 0.5 * (c + 1));
        CHECK(film.splatSum(2, 0, c) == 0.5 * (c + 1));
        CHECK(film.splatSum(0, 0, c) == 0);
        CHECK(film.mean(1, 1, c) == 0.5 * (c + 1) / 4);
    }
    CHECK(film.splatSum(1, 1, 3) == 0);
    CHECK(film.droppedSplats() == 0);
}

TEST_CASE("splats that are not finite or do not fit are left out and counted", "[splats]") {
    Film film = filmWith(kPlain, {0, 1}, 1);
    const Kernel kernel(film, 0);
    const auto most = static_cast<f32>(std::ldexp(1.0, 31));
    std::uint64_t dropped = 0;
    for (const f32 bad : {std::numeric_limits<f32>::infinity(), -std::numeric_limits<f32>::infinity(),
                          std::numeric_limits<f32>::quiet_NaN(), most, -most, most / 2 /* Y and Z */}) {
        kernel.splat(10, 20, bad);
        CHECK(film.droppedSplats() == ++dropped);
    }
    for (std::uint32_t c = 0; c < 3; ++c) CHECK(film.splatSum(0, 0, c) == 0);
    kernel.splat(10, 20, most / 4);
    CHECK(film.splatSum(0, 0, 2) == 3 * std::ldexp(1.0, 29));
    CHECK(film.droppedSplats() == dropped);
}

TEST_CASE("a splat belongs to the replicate of its sample", "[splats]") {
    Film film = filmWith(kReplicated, {0, 8}, 8);
    for (u64 sample = 0; sample < 8; ++sample)
        Kernel(film, sample).splat(10, 20, static_cast<f32>(sample + 1));
    for (std::uint32_t r = 0; r < 4; ++r) CHECK(film.replicateSum(0, 0, r) == 2.0 * (r + 1 + r + 5));
    CHECK(film.splatSum(0, 0, 0) == 36);
    CHECK(film.splatSum(0, 0, 1) == 72);
    CHECK(film.splatSum(0, 0, 2) == 108);
}

TEST_CASE("splats are divided by the samples of the film, not by the valid ones of the pixel", "[splats]") {
    Film film = filmWith(kPlain, {0, 8}, 8);
    film.counts[0] = 5;
    film.counts[1] = 0;
    film.sums[0] = 10;  // X of the first pixel.
    const Kernel kernel(film, 0);
    kernel.splat(10, 20, 4);
    kernel.splat(11, 20, 4);
    CHECK(film.mean(0, 0, 0) == 10.0 / 5 + 4.0 / 8);
    CHECK(film.mean(0, 0, 1) == 8.0 / 8);
    CHECK(film.mean(1, 0, 2) == 12.0 / 8);
}

TEST_CASE("films with splats add up in any order", "[splats]") {
    std::vector<Film> parts;
    for (std::uint64_t i = 0; i < 3; ++i) {
        parts.push_back(filmWith(kReplicated, {4 * i, 4 * i + 4}, 4));
        for (u64 sample = 4 * i; sample < 4 * i + 4; ++sample)
            for (int n = 0; n < 40; ++n)
                Kernel(parts.back(), sample).splat(10, 20, static_cast<f32>(std::ldexp(1.0, 28 - n)));
        Kernel(parts.back(), 0).splat(12, 21, std::numeric_limits<f32>::quiet_NaN());
    }
    Film forwards(kReplicated), backwards(kReplicated);
    for (int i = 0; i < 3; ++i) {
        forwards.add(parts[static_cast<std::size_t>(i)]);
        backwards.add(parts[static_cast<std::size_t>(2 - i)]);
    }
    checkSame(forwards, backwards);
    CHECK(forwards.splatSum(0, 0, 0) == 3 * parts[0].splatSum(0, 0, 0));
    CHECK(forwards.splats[1] != 0);  // It has carried.
    CHECK(forwards.droppedSplats() == 3);
    CHECK_THROWS_AS(forwards.add(Film({3, 2, 6, kAovReplicates})), Error);
    FilmShape other = kReplicated;
    other.splat_scale *= 2;
    CHECK_THROWS_AS(forwards.add(Film(other)), Error);
}

TEST_CASE("a film has splats where it has their scale, a power of two", "[splats]") {
    for (const double scale : {0.0, 3.0, -2.0, std::numeric_limits<double>::infinity(),
                               std::numeric_limits<double>::quiet_NaN(), 5e-324})
        CHECK_THROWS_AS(Film({3, 2, 4, kAovSquares | kAovSplats, 0, scale}), Error);
    CHECK_THROWS_AS(Film({3, 2, 4, kAovSquares, 0, 2.0}), Error);
    CHECK(Film({3, 2, 4, kAovSquares}).splats.empty());
    CHECK(Film(kPlain).splats.size() == 6 * 7);
    CHECK(Film(kReplicated).splats.size() == 6 * 13);
}

TEST_CASE("replicates tell the error of splats, and without them it is unknown", "[splats]") {
    Film film = filmWith(kReplicated, {0, 64}, 64), plain = filmWith(kPlain, {0, 64}, 64);
    std::mt19937 generator(9);
    std::normal_distribution<float> noise(10, 1);
    for (u64 sample = 0; sample < 64; ++sample)
        for (u32 y = 0; y < 2; ++y)
            for (u32 x = 0; x < 3; ++x) {
                const float v = noise(generator);
                Kernel(film, sample).splat(10 + x, 20 + y, v);
                Kernel(plain, sample).splat(10 + x, 20 + y, v);
            }
    const std::optional<ErrorEstimate> error = estimateError(film);
    REQUIRE(error);
    CHECK(error->mean_luminance == Approx(20).epsilon(0.05));
    CHECK(error->relative_rmse == Approx(0.1 / 8).epsilon(0.5));
    CHECK_FALSE(estimateError(plain));

    // A pixel that lost a splat is not known.
    Kernel(film, 0).splat(10, 20, std::numeric_limits<f32>::infinity());
    const LuminanceVariance variance(film);
    CHECK(std::isinf(variance(0, 0)));
    CHECK(std::isfinite(variance(1, 0)));
}

TEST_CASE("the error of the mean of pixels that share samples comes from the replicates", "[splats]") {
    // A sample splats the same onto all pixels.
    Film film = filmWith(kReplicated, {0, 64}, 64);
    std::mt19937 generator(11);
    std::normal_distribution<float> noise(10, 1);
    for (u64 sample = 0; sample < 64; ++sample) {
        const float v = noise(generator);
        for (u32 y = 0; y < 2; ++y)
            for (u32 x = 0; x < 3; ++x) Kernel(film, sample).splat(10 + x, 20 + y, v);
    }
    const std::optional<ErrorEstimate> error = estimateError(film);
    REQUIRE(error);
    CHECK(error->mean_standard_error == Approx(error->relative_rmse * error->mean_luminance));
    CHECK(error->mean_degrees_of_freedom == 3);
}

TEST_CASE("a checkpoint keeps splats, and films without any have the format that they had", "[splats]") {
    const TemporaryFolder directory;
    const std::string path = directory / "film.crtfilm";
    const FilmIdentity identity{"0123456789abcdef0123456789abcdef", "0.1.0"};
    Film film = filmWith(kReplicated, {3, 9}, 6);
    for (u64 sample = 3; sample < 9; ++sample)
        for (u32 x = 10; x < 13; ++x)
            Kernel(film, sample).splat(x, 21, -1.0f / static_cast<f32>(x + sample));
    Kernel(film, 3).splat(10, 20, std::numeric_limits<f32>::quiet_NaN());
    writeCheckpoint(path, film, identity);
    CHECK(slurp(path)[8] == static_cast<char>(kCheckpointVersionSplats));
    const Film back = readCheckpoint(path).first;
    CHECK(back.shape() == film.shape());
    checkSame(back, film);
    CHECK(back.droppedSplats() == 1);

    // Its parts, merged.
    const std::string other = directory / "other.crtfilm";
    Film later = filmWith(kReplicated, {9, 12}, 3);
    Kernel(later, 9).splat(10, 20, 1);
    writeCheckpoint(other, later, identity);
    film.add(later);
    checkSame(mergeCheckpoints({other, path}).first, film);

    writeCheckpoint(path, filmWith({3, 2, 4, kAovSquares}, {0, 1}, 1), identity);
    CHECK(slurp(path)[8] == static_cast<char>(kCheckpointVersion));
    CHECK(readCheckpoint(path).first.splats.empty());
}
