// Scene → blob: tables that samples are drawn from, and the channels of the film.
#include "compiled_scenes.h"

#include "base/error.h"
#include "compile/distributions.h"
#include "film/film.h"
#include "render/session.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

using namespace compile_test;

TEST_CASE("shares of 2^32 are proportional, at least one each, and all of it", "[compile]") {
    const auto check = [](const std::vector<double>& weights) {
        const std::vector<std::uint64_t> first = crt::choiceTable(weights);
        REQUIRE(first.size() == weights.size() + 1);
        CHECK(first.front() == 0);
        CHECK(first.back() == std::uint64_t{1} << 32);
        double total = 0, worst = 0;
        for (const double w : weights) total += w;
        std::uint64_t without = 0;
        const double others = static_cast<double>(weights.size());
        for (std::size_t i = 0; i < weights.size(); ++i) {
            without += first[i + 1] <= first[i];
            // One share is given to each before the rest is dealt out, and rounding takes less than another.
            const double wanted = 1 + (0x1p32 - others) * (weights[i] / total);
            worst = std::max(worst, std::abs(static_cast<double>(first[i + 1] - first[i]) - wanted));
        }
        CHECK(without == 0);
        CHECK(worst < 1.01);
    };
    CHECK(crt::choiceTable({}) == std::vector<std::uint64_t>{0});
    CHECK(crt::choiceTable({3}) == std::vector<std::uint64_t>{0, std::uint64_t{1} << 32});
    // Equal ones of a power of two are exactly equal.
    const std::vector<std::uint64_t> eight = crt::choiceTable(std::vector<double>(8, 0.1));
    for (std::uint64_t i = 0; i <= 8; ++i) CHECK(eight[i] == i << 29);
    check({1e20, 1});
    check({1, 1e20});
    check({1e-20, 1, 1e-20});
    check({0.1, 0.2, 0.3, 0.4});
    Random random(44);
    std::vector<double> many(300000);
    for (double& w : many) w = std::pow(10.0, random.uniform(-12, 3));
    check(many);
    // As many faint as strong ones: each faint one's share must come from somewhere.
    std::vector<double> classes(140000, 1e-20);
    for (std::size_t i = 0; i < 65536; ++i) classes[2 * i] = 1;
    check(classes);
}

TEST_CASE("four wavelengths of one path nearly integrate a smooth spectrum by themselves", "[compile]") {
    const std::vector<float> nodes = crt::wavelengthTable(CRT_WAVELENGTH_TABLE);
    const auto& cie = crt::cieObserver();
    const auto at = [](const crt::Spectrum& s, double nm) {
        const auto i =
            std::min(static_cast<std::size_t>(nm - 360), static_cast<std::size_t>(crt::kSpectrumSize - 2));
        return s[i] + (nm - 360 - static_cast<double>(i)) * (s[i + 1] - s[i]);
    };
    // Relative standard deviation, over the comb's position, of X, Y or Z of light whose spectrum rises in a
    // straight line from `blue` to `red`.
    const auto deviation = [&](const crt::Spectrum& observer, double blue, double red) {
        double sum = 0, squares = 0;
        const std::size_t combs = CRT_WAVELENGTH_TABLE / 4;
        for (std::size_t i = 0; i < combs; ++i) {
            double value = 0;
            for (std::size_t tooth = 0; tooth < 4; ++tooth) {
                const std::size_t cell = tooth * combs + i;
                const double width = nodes[cell + 1] - nodes[cell], nm = nodes[cell] + 0.5 * width;
                value += at(observer, nm) * (blue + (red - blue) * (nm - 360) / 470) * width;
            }
            sum += value;
            squares += value * value;
        }
        const double mean = sum / static_cast<double>(combs);
        return std::sqrt(squares / static_cast<double>(combs) - mean * mean) / mean;
    };
    // A density proportional to x̄ + ȳ + z̄ has .107, .159 and .249 of white.
    for (const double red : {0.2, 1.0, 5.0}) {
        CHECK(deviation(cie[0], 1, red) < 0.06);
        CHECK(deviation(cie[1], 1, red) < 0.06);
        CHECK(deviation(cie[2], 1, red) < 0.10);
    }
}

TEST_CASE("wavelength and filter tables are monotone, complete, and distributed as they say", "[compile]") {
    const std::vector<float> wavelengths = crt::wavelengthTable(CRT_WAVELENGTH_TABLE);
    REQUIRE(wavelengths.size() == CRT_WAVELENGTH_TABLE + 1);
    CHECK(wavelengths.front() == 360);
    CHECK(wavelengths.back() == 830);
    for (std::size_t i = 1; i < wavelengths.size(); ++i)
        if (!(wavelengths[i] > wavelengths[i - 1])) FAIL("wavelengths stand still at " << i);
    // Each cell holds the same part of (x̄ + ȳ + z̄)^0.4.
    const auto& cie = crt::cieObserver();
    const auto density = [&](int nm) {
        const auto k = static_cast<std::size_t>(nm - 360);
        return std::pow(cie[0][k] + cie[1][k] + cie[2][k], 0.4);
    };
    const auto cumulative = [&](double nm) {
        double sum = 0;
        for (int i = 360; i < 830; ++i) {
            const double part = std::clamp(nm - i, 0.0, 1.0);
            sum += part * (density(i) + 0.5 * part * (density(i + 1) - density(i)));
        }
        return sum;
    };
    const double all = cumulative(830);
    for (std::size_t i = 0; i <= CRT_WAVELENGTH_TABLE; i += 16)
        CHECK(cumulative(wavelengths[i]) / all ==
              Approx(static_cast<double>(i) / CRT_WAVELENGTH_TABLE).margin(2e-4));

    // Density is constant in a cell: where x̄ falls to half within 10 nm a wide one would be a spike in the
    // integrand.
    for (std::size_t i = 1; i < wavelengths.size(); ++i)
        if (wavelengths[i] < 780 && wavelengths[i] - wavelengths[i - 1] > 12)
            FAIL("a cell of " << wavelengths[i] - wavelengths[i - 1] << " nm at " << wavelengths[i]);
}

namespace {

std::vector<float> filterTable(const crt::FilmSettings& film) {
    return crt::filterTable(film, CRT_FILTER_OCTAVES, CRT_FILTER_STEPS);
}

/// The share of the filter that node i is the distance of.
double shareOf(std::size_t i) {
    const double step = static_cast<double>(i % CRT_FILTER_STEPS) / CRT_FILTER_STEPS;
    const double share = i == CRT_FILTER_TABLE ? 0.5 : 1 - step / 2;
    return std::ldexp(share, -static_cast<int>(i / CRT_FILTER_STEPS));
}

}  // namespace

TEST_CASE("a pixel filter's table has its shares at its nodes", "[compile]") {
    crt::FilmSettings film;
    CHECK(filterTable(film).empty());  // the pixel itself
    film.filter_radius = 1;
    const std::vector<float> box = filterTable(film);
    CHECK(box[CRT_FILTER_STEPS] == Approx(0.5));
    film.filter_radius = 1.5;
    for (const crt::PixelFilter filter : {crt::PixelFilter::Gaussian, crt::PixelFilter::BlackmanHarris}) {
        film.filter = filter;
        const std::vector<float> table = filterTable(film);
        REQUIRE(table.size() == CRT_FILTER_TABLE + 1);
        CHECK(table.front() == 0);
        CHECK(table.back() < 1.5f);
        for (std::size_t i = 1; i < table.size(); ++i)
            if (!(table[i] > table[i - 1])) FAIL("distances stand still at " << i);
        // Midpoint sums of the definition, beyond the nodes.
        const auto value = [&](double x) {
            const double t = 3.14159265358979323846 * (x / 1.5 + 1);
            return filter == crt::PixelFilter::Gaussian
                       ? std::exp(-2 * x * x) - std::exp(-2 * 2.25)
                       : 0.35875 - 0.48829 * std::cos(t) + 0.14128 * std::cos(2 * t) -
                             0.01168 * std::cos(3 * t);
        };
        constexpr int kSteps = 2000;
        const auto mass = [&](double lower, double upper) {
            double sum = 0;
            for (int i = 0; i < kSteps; ++i) sum += value(lower + (upper - lower) * (i + 0.5) / kSteps);
            return sum * (upper - lower) / kSteps;
        };
        const double all_of_it = mass(0, 1.5);
        for (std::size_t i = 0; i < 4 * CRT_FILTER_STEPS; i += 16)
            CHECK(mass(static_cast<double>(table[i]), 1.5) / all_of_it == Approx(shareOf(i)).margin(2e-6));
    }
}

TEST_CASE("a wide Gaussian filter has the Gaussian's tail", "[compile]") {
    crt::FilmSettings film;
    film.filter = crt::PixelFilter::Gaussian;
    film.filter_radius = 8;
    for (const double sigma : {0.5, 1.0}) {
        film.filter_sigma = sigma;
        const std::vector<float> table = filterTable(film);
        for (std::size_t i = 0; i < table.size(); ++i) {
            const double share = std::erfc(static_cast<double>(table[i]) / (sigma * std::numbers::sqrt2));
            if (!(std::abs(share / shareOf(i) - 1) < 1e-4))
                FAIL("beyond node " << i << " is " << share << ", not " << shareOf(i));
        }
        // As the kernel takes it: the moments of evenly spread numbers are those of the Gaussian.
        Scene scene = litFloor();
        scene.film.filter = film.filter;
        scene.film.filter_radius = film.filter_radius;
        scene.film.filter_sigma = sigma;
        const CompiledScene c = compiled(scene);
        const CrtContext ctx = contextOf(c);
        constexpr int kNumbers = 1 << 20;
        double sum = 0, squares = 0, fourths = 0, last = -8;
        for (int i = 0; i < kNumbers; ++i) {
            const auto x = static_cast<double>(
                crt_filter_offset(&ctx, (static_cast<float>(i) + 0.5f) / static_cast<float>(kNumbers)));
            if (x < last) FAIL("the offset falls at " << i);
            last = x;
            sum += x;
            squares += x * x;
            fourths += x * x * x * x;
        }
        CHECK(sum / kNumbers == Approx(0).margin(1e-6));
        CHECK(squares / kNumbers == Approx(sigma * sigma).epsilon(2e-4));
        CHECK(fourths / kNumbers == Approx(3 * std::pow(sigma, 4)).epsilon(5e-4));
        CHECK(last < 6 * sigma);
        // The ends of what a sampler gives.
        CHECK(static_cast<double>(crt_filter_offset(&ctx, 0.0f)) > -6 * sigma);
        CHECK(static_cast<double>(crt_filter_offset(&ctx, 1 - 0x1p-24f)) < 6 * sigma);
        CHECK(crt_filter_offset(&ctx, 0.5f) == 0);
    }
}

TEST_CASE("replicates are as few as give the error of a film a thousand degrees of freedom", "[compile]") {
    const auto replicatesFor = [](int width, int height) {
        Scene scene = litFloor();
        scene.film.width = width;
        scene.film.height = height;
        return crt::replicatesOf(scene);
    };
    CHECK(replicatesFor(1, 1) == 16);
    CHECK(replicatesFor(8, 8) == 16);
    CHECK(replicatesFor(16, 16) == 8);
    CHECK(replicatesFor(20, 20) == 4);
    CHECK(replicatesFor(50, 20) == 2);
    CHECK(replicatesFor(16384, 16384) == 2);
    // The film's and not the crop window's, whose pixels must have the film's bits.
    Scene cropped = litFloor();
    cropped.film.width = cropped.film.height = 64;
    cropped.film.crop = {0, 0, 1, 1};
    CHECK(crt::replicatesOf(cropped) == 2);
    cropped.integrator.type = crt::IntegratorType::Normals;
    CHECK(crt::replicatesOf(cropped) == 1);
}

TEST_CASE("AOVs take channels in order, and only those that are asked for", "[compile]") {
    const auto single = [](std::uint32_t aovs) {
        Scene scene = litFloor();
        scene.sampler.replicates = 1;
        return compiled(scene, aovs);
    };
    // The variance of a film of one sequence is that of its samples; of one with replicates, theirs.
    CHECK(single(0).header().channels == CRT_CHANNELS_BASE + 1);
    CHECK(headerOf(single(0)).square_channel == CRT_CHANNELS_BASE);
    Scene sixteen = litFloor();
    sixteen.sampler.replicates = 16;
    const CompiledScene replicates = compiled(sixteen);
    CHECK(headerOf(replicates).replicate_shift == 4);
    CHECK(headerOf(replicates).square_channel == 0);
    CHECK(headerOf(replicates).replicate_channel == CRT_CHANNELS_BASE);
    CHECK(replicates.header().channels == CRT_CHANNELS_BASE + 15);
    // Each behind the one before it, in the order of the list, which is that of film files.
    const CompiledScene all = compiled(sixteen, ~0u);
    CHECK(headerOf(all).albedo_channel == CRT_CHANNELS_BASE);
    CHECK(headerOf(all).normal_channel == CRT_CHANNELS_BASE + 3);
    CHECK(headerOf(all).depth_channel == CRT_CHANNELS_BASE + 6);
    CHECK(headerOf(all).replicate_channel == CRT_CHANNELS_BASE + 7);
    CHECK(all.header().channels == CRT_CHANNELS_MAX - 1);
    const CompiledScene depth = single(crt::kAovDepth);
    CHECK(headerOf(depth).albedo_channel == 0);
    CHECK(headerOf(depth).depth_channel == CRT_CHANNELS_BASE + 1);
    CHECK(headerOf(depth).replicate_channel == 0);
    CHECK(depth.header().channels == CRT_CHANNELS_BASE + 2);
}

TEST_CASE("bins and responses are the last channels of a film, and leave the others where they were",
          "[compile]") {
    Scene scene = litFloor();
    scene.sampler.replicates = 8;
    const CompiledScene plain = compiled(scene, crt::kAovDepth);
    scene.film.spectral = {{400, 700, 30}, {{"flat", crt::constantSpectrum(2)}}, true};
    const CompiledScene spectral = compiled(scene, crt::kAovDepth);
    CHECK(plain.spectral_channels == 0);
    CHECK(spectral.spectral_channels == 31);
    CHECK(spectral.header().channels == plain.header().channels + 31);
    CHECK(headerOf(spectral).depth_channel == headerOf(plain).depth_channel);
    CHECK(headerOf(spectral).replicate_channel == headerOf(plain).replicate_channel);
    const CrtSpectralFilm film = listOf<CrtSpectralFilm>(spectral, headerOf(spectral).spectral_film).at(0);
    CHECK(film.channel == plain.header().channels);
    CHECK(film.bins == 30);
    CHECK(film.first == 40);
    CHECK(film.per_nm == 0.1f);
    REQUIRE(film.responses.count == 1);
    CHECK(arrayOf<f32>(spectral, film.responses)[100] == static_cast<float>(1.0 / 470));
    const crt::FilmShape shape = crt::filmShapeOf(spectral);
    CHECK(shape.replicates() == 8);
    CHECK(shape.firstSpectral() == film.channel);
    CHECK_NOTHROW(crt::Film(shape));
    crt::FilmShape wrong = shape;
    wrong.spectral = 30;
    CHECK_THROWS_AS(crt::Film(wrong), crt::Error);
}

TEST_CASE("half of the wavelengths of a spectral film are uniform over what it measures", "[compile]") {
    constexpr std::size_t kCells = 1024;
    const std::vector<float> plain = crt::wavelengthTable(kCells);
    CHECK(crt::wavelengthTable(kCells, {}) == plain);
    const crt::SpectralFilm narrow{{600, 610, 10}, {}, true};
    const std::vector<float> table = crt::wavelengthTable(kCells, narrow);
    CHECK(std::is_sorted(table.begin(), table.end()));
    CHECK(table.front() == 360);
    CHECK(table.back() == 830);
    const auto share = [kCells](const std::vector<float>& nodes, float from_nm, float to_nm) {
        const auto at = [&](float nm) { return std::lower_bound(nodes.begin(), nodes.end(), nm); };
        return static_cast<double>(at(to_nm) - at(from_nm)) / kCells;
    };
    // The ends are known to a quarter of a nanometre: a step of the quadrature.
    constexpr double kEnds = 0.5 * 0.25 / 10;
    CHECK(share(table, 600, 610) == Approx(0.5 + 0.5 * share(plain, 600, 610)).margin(kEnds));
    CHECK(share(table, 400, 600) == Approx(0.5 * share(plain, 400, 600)).margin(kEnds));
    // From where a response begins to where it ends.
    crt::Spectrum red;
    for (std::size_t i = 240; i <= 250; ++i) red[i] = 1;
    const std::vector<float> sensor = crt::wavelengthTable(kCells, {{}, {{"red", red}}, true});
    CHECK(share(sensor, 599, 611) == Approx(0.5 + 0.5 * share(plain, 599, 611)).margin(kEnds));
}

TEST_CASE("the bits of AOVs never change: film files hold them", "[compile]") {
    CHECK(crt::kAovAlbedo == 1);
    CHECK(crt::kAovNormal == 2);
    CHECK(crt::kAovDepth == 4);
    CHECK(crt::kAovPrimitive == 8);
    CHECK(crt::kAovVariance == 16);
    CHECK(crt::kAovSamples == 32);
    CHECK(crt::kAovReplicates == 64);
    CHECK(crt::kAovError == 128);
    std::uint32_t seen = 0;
    for (const crt::AovRow& row : crt::kAovRows) {
        CHECK((seen & row.aov) == 0);  // no bit twice
        seen |= row.aov;
    }
    CHECK(crt::kAovSquares == 256);
    CHECK(crt::kAovSplats == 512);
    CHECK(crt::kAovColorError == 1024);
    CHECK(seen == 2047);
    CHECK(crt::kAovsOfFirstHits == 15);
}
