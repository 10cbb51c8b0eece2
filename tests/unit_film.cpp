// Film: sums that do not show their order, ranges that never count twice, and what they resolve to.
#include "base/statistics.h"
#include "catch.h"
#include "film/error_estimate.h"
#include "film/film.h"
#include "film/luminance_error.h"
#include "film/resolve.h"
#include "image/image_io.h"
#include "image/image_metadata.h"
#include "scene/scene.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

using namespace crt;

namespace {

constexpr FilmShape kOnePixel{1, 1, 4, kAovSquares};

/// A film of one pixel that holds one sample.
Film oneSample(std::uint64_t index, float x, float y, float z) {
    Film film(kOnePixel);
    const double values[4] = {x, y, z, static_cast<double>(y) * y};
    for (int c = 0; c < 4; ++c) film.sums[2 * c] = values[c];
    film.counts[0] = 1;
    film.samples.add({index, index + 1});
    return film;
}

/// The values of a path tracer: mostly small, now and then a firefly; the Pareto tail has no finite mean.
std::vector<float> heavyTailed(std::size_t count, std::uint32_t seed) {
    std::mt19937 generator(seed);
    std::uniform_real_distribution<double> uniform(1e-12, 1.0);
    std::vector<float> values(count);
    for (float& v : values) v = static_cast<float>(1e-3 * std::pow(uniform(generator), -3.0));
    return values;
}

std::uint64_t bits(double v) {
    std::uint64_t b;
    std::memcpy(&b, &v, sizeof b);
    return b;
}

Scene sceneIn(ColorSpace space) {
    Scene scene;
    scene.film.color_space = space;
    return scene;
}

/// One pixel with the given XYZ from one sample.
Film filmOf(const Vec3d& xyz) {
    Film film(kOnePixel);
    for (int c = 0; c < 3; ++c) film.sums[2 * c] = xyz[c];
    film.sums[6] = xyz[1] * xyz[1];
    film.counts[0] = 1;
    film.samples.add({0, 1});
    return film;
}

}  // namespace

TEST_CASE("sample ranges stay sorted, merged and disjoint", "[film]") {
    SampleRanges ranges;
    ranges.add({2048, 3072});
    ranges.add({0, 1024});
    CHECK(ranges.text() == "0-1024;2048-3072");
    CHECK(ranges.count() == 2048);
    ranges.add({1024, 2048});
    CHECK(ranges.text() == "0-3072");
    CHECK(ranges.ranges().size() == 1);
    ranges.add({5, 5});  // Nothing, and nothing to overlap.
    CHECK(ranges.count() == 3072);

    CHECK(SampleRanges().text().empty());
    CHECK(SampleRanges({{4, 8}, {0, 4}, {8, 9}}).text() == "0-9");
}

TEST_CASE("overlapping sample ranges are refused and change nothing", "[film]") {
    SampleRanges ranges({{10, 20}, {30, 40}});
    for (const SampleRange& bad :
         {SampleRange{19, 21}, SampleRange{0, 11}, SampleRange{12, 13}, SampleRange{0, 100},
          SampleRange{20, 31}, SampleRange{10, 20}, SampleRange{39, 45}}) {
        INFO(bad.first << " " << bad.second);
        CHECK_THROWS_AS(ranges.add(bad), Error);
        CHECK(ranges.text() == "10-20;30-40");
    }
    CHECK_THROWS_WITH(ranges.add({15, 16}), Contains("15-16") && Contains("10-20"));
    CHECK_THROWS_AS(ranges.add({9, 3}), Error);
    ranges.add({20, 30});
    CHECK(ranges.text() == "10-40");
}

TEST_CASE("any order and any split of samples resolves to the same bits", "[film]") {
    constexpr std::size_t kSamples = 10000;
    const std::vector<float> values = heavyTailed(kSamples, 1);

    const auto add_in_order = [&](const std::vector<std::size_t>& order, std::size_t parts) {
        // `parts` films are filled one after the other, as threads or machines would, and then added.
        Film total(kOnePixel);
        for (std::size_t p = 0; p < parts; ++p) {
            Film part(kOnePixel);
            for (std::size_t i = p * order.size() / parts; i < (p + 1) * order.size() / parts; ++i) {
                const float v = values[order[i]];
                part.add(oneSample(order[i], 0.7f * v, v, 1.3f * v));
            }
            total.add(part);
        }
        return total;
    };

    std::vector<std::size_t> order(kSamples);
    std::iota(order.begin(), order.end(), 0);
    const Film reference = add_in_order(order, 1);
    CHECK(reference.samples.text() == "0-10000");
    CHECK(reference.counts[0] == kSamples);
    const double plain_reference = std::accumulate(values.begin(), values.end(), 0.0);

    int plain_differs = 0;
    std::mt19937 generator(2);
    for (const std::size_t parts : {1u, 2u, 7u, 64u, 1000u}) {
        std::shuffle(order.begin(), order.end(), generator);
        const Film film = add_in_order(order, parts);
        for (std::uint32_t c = 0; c < 4; ++c) {
            INFO("parts " << parts << " channel " << c);
            CHECK(bits(film.sum(0, 0, c)) == bits(reference.sum(0, 0, c)));
        }
        CHECK(film.samples.text() == "0-10000");
        double plain = 0;
        for (const std::size_t i : order) plain += values[i];
        plain_differs += bits(plain) != bits(plain_reference);
    }
    // The same samples in plain doubles do show their order; otherwise the checks above would prove nothing.
    CHECK(plain_differs > 0);
}

TEST_CASE("a sum keeps what one double would lose", "[film]") {
    Film film(kOnePixel);
    film.add(oneSample(0, 1e30f, 1e30f, 1e30f));
    film.add(oneSample(1, 1.0f, 1.0f, 1.0f));
    film.add(oneSample(2, -1e30f, -1e30f, -1e30f));
    CHECK(film.sum(0, 0, 0) == 1.0);
    // Pairs that a backend did not normalise are as good as any other.
    Film loose(kOnePixel);
    loose.sums[0] = 1.0;
    loose.sums[1] = 1e20;
    loose.samples.add({3, 4});
    film.add(loose);
    CHECK(film.sums[0] == 1e20);
    CHECK(film.sums[1] == 2.0);
}

TEST_CASE("films of overlapping ranges or other shapes are refused and change nothing", "[film]") {
    Film film = oneSample(7, 1, 2, 3);
    CHECK_THROWS_WITH(film.add(oneSample(7, 1, 1, 1)), Contains("7-8"));
    CHECK_THROWS_AS(film.add(Film({2, 1, 4, kAovSquares})), Error);
    CHECK_THROWS_AS(film.add(Film({1, 1, 5, kAovDepth})), Error);
    CHECK(film.sum(0, 0, 0) == 1.0);
    CHECK(film.counts[0] == 1);
    CHECK(film.samples.text() == "7-8");
    try {
        film.add(film);
        FAIL("a film was added to itself");
    } catch (const Error& error) {
        CHECK(error.kind() == ErrorKind::Usage);
    }
}

TEST_CASE("a film refuses a channel count that its AOVs do not explain", "[film]") {
    CHECK_NOTHROW(Film({3, 2, 11, kAovSquares | kAovAlbedo | kAovNormal | kAovDepth | kAovPrimitive}));
    CHECK_THROWS_AS(Film({3, 2, 4, kAovSquares | kAovAlbedo}), Error);
    CHECK_THROWS_AS(Film({3, 2, 0, 0}), Error);
    const Film film({3, 2, 4, kAovSquares | kAovPrimitive});
    CHECK(film.primitives == std::vector<std::uint32_t>(6, 0xffffffffu));
    CHECK(Film({3, 2, 4, kAovSquares}).primitives.empty());
}

TEST_CASE("primitive ids come from the film with the lower first sample, whoever is added to whom",
          "[film]") {
    const FilmShape shape{1, 1, 4, kAovSquares | kAovPrimitive};
    Film early(shape), late(shape);
    early.primitives[0] = 11;
    early.samples.add({0, 4});
    late.primitives[0] = 22;
    late.samples.add({4, 8});
    Film a = early, b = late, c(shape);
    a.add(late);
    b.add(early);
    c.add(late);
    CHECK(a.primitives[0] == 11);
    CHECK(b.primitives[0] == 11);
    CHECK(c.primitives[0] == 22);
}

TEST_CASE("counts beyond 2^32 samples are kept", "[film]") {
    constexpr std::uint64_t kHalf = 3'000'000'000u;  // Beyond an int, and twice it beyond 32 bits.
    Film film({1, 1, 4, kAovSquares}), more({1, 1, 4, kAovSquares});
    film.counts[0] = more.counts[0] = kHalf;
    film.sums[2] = more.sums[2] = 0.25 * kHalf;
    film.samples.add({0, kHalf});
    more.samples.add({kHalf, 2 * kHalf});
    film.add(more);
    CHECK(film.counts[0] == 2 * kHalf);
    CHECK(film.samples.count() == 2 * kHalf);
    CHECK(film.mean(0, 0, 1) == 0.25);
    CHECK(film.invalidSamples() == 0);
}

TEST_CASE("dropped samples are counted", "[film]") {
    Film film({2, 2, 4, kAovSquares});
    film.samples.add({0, 100});
    film.counts = {100, 97, 100, 0};
    CHECK(film.invalidSamples() == 103);
    CHECK(film.mean(1, 1, 1) == 0.0);  // No valid sample: black, not NaN.
}

TEST_CASE("the variance of the mean is the textbook one", "[film]") {
    const std::vector<float> values = heavyTailed(500, 3);
    Film film(kOnePixel);
    for (std::size_t i = 0; i < values.size(); ++i) film.add(oneSample(i, 0, values[i], 0));
    const double n = static_cast<double>(values.size());
    long double mean = 0, squares = 0;
    for (const float v : values) mean += v;
    mean /= n;
    for (const float v : values) squares += (v - mean) * (v - mean);
    const double expected = static_cast<double>(squares / (n - 1) / n);
    CHECK(LuminanceVariance(film)(0, 0) == Approx(expected).epsilon(1e-9));
    CHECK(estimateError(film)->relative_rmse ==
          Approx(std::sqrt(expected) / static_cast<double>(mean)).epsilon(1e-9));
}

TEST_CASE("nothing is claimed about an error that is not known", "[film]") {
    CHECK_FALSE(estimateError(Film(kOnePixel)));
    const Film one = oneSample(0, 1, 1, 1);
    CHECK(std::isinf(LuminanceVariance(one)(0, 0)));
    Film black(kOnePixel);
    black.add(oneSample(0, 0, 0, 0));
    black.add(oneSample(1, 0, 0, 0));
    CHECK(LuminanceVariance(black)(0, 0) == 0.0);
    CHECK_FALSE(estimateError(black));  // No light found yet is not the same as no error.
    Film constant(kOnePixel);
    for (std::uint64_t i = 0; i < 9; ++i) constant.add(oneSample(i, 0.1f, 0.1f, 0.1f));
    CHECK(LuminanceVariance(constant)(0, 0) >= 0.0);
    CHECK(estimateError(constant)->relative_rmse < 1e-8);
}

TEST_CASE("D65 white resolves to (1,1,1) in the RGB spaces and to itself in XYZ", "[film]") {
    const Vec3d white = d65WhiteXyz();
    for (const ColorSpace space : {ColorSpace::LinearSrgb, ColorSpace::AcesCg}) {
        const Image image = resolveImage(filmOf(white), developmentOf(sceneIn(space)), 0);
        REQUIRE(image.channels == std::vector<std::string>{"R", "G", "B"});
        for (int c = 0; c < 3; ++c) CHECK(image.pixels[c] == Approx(1.0).margin(2e-7));
        REQUIRE(image.chromaticities);
        CHECK(*image.chromaticities == chromaticities(space));
    }
    const Image xyz = resolveImage(filmOf(white), developmentOf(sceneIn(ColorSpace::Xyz)), 0);
    for (int c = 0; c < 3; ++c) CHECK(xyz.pixels[c] == static_cast<float>(white[c]));
}

TEST_CASE("white balance maps the illuminant to white and exposure scales", "[film]") {
    Scene scene = sceneIn(ColorSpace::LinearSrgb);
    const Spectrum lamp = *illuminantSpectrum("A");
    const Film film = filmOf(spectrumToXyz(lamp));
    const Image orange = resolveImage(film, developmentOf(scene), 0);
    CHECK(orange.pixels[0] > 2 * orange.pixels[2]);

    scene.film.white_balance = lamp;
    scene.film.exposure_ev = -3;
    for (const ColorSpace space : {ColorSpace::LinearSrgb, ColorSpace::AcesCg}) {
        scene.film.color_space = space;
        const Image balanced = resolveImage(film, developmentOf(scene), 0);
        for (int c = 0; c < 3; ++c) CHECK(balanced.pixels[c] == Approx(0.125).epsilon(1e-6));
    }
    // In XYZ the balanced white is D65's, so that the standard matrix still gives the sRGB image.
    scene.film.color_space = ColorSpace::Xyz;
    const Image xyz = resolveImage(film, developmentOf(scene), 0);
    for (int c = 0; c < 3; ++c) CHECK(xyz.pixels[c] == Approx(0.125 * d65WhiteXyz()[c]).epsilon(1e-6));

    scene.film.white_balance = constantSpectrum(0.0);
    CHECK_THROWS_AS(resolveImage(film, developmentOf(scene), 0), Error);
}

TEST_CASE(
    "StdError.Y is the standard error of the luminance that the image has, after exposure and white balance",
    "[film]") {
    // Sixteen samples of one colour and different brightness: what is noise of brightness alone follows the
    // colour's own luminance.
    const Vec3d color{1.4, 1.0, 0.25};
    const std::vector<double> brightness{0.2, 1.1, 0.7, 2.0, 0.4, 0.9, 1.6, 0.3,
                                         1.2, 0.8, 0.1, 2.2, 0.6, 1.3, 0.5, 1.0};
    Film film(kOnePixel);
    for (std::size_t i = 0; i < brightness.size(); ++i)
        film.add(oneSample(i, static_cast<float>(color[0] * brightness[i]),
                           static_cast<float>(color[1] * brightness[i]),
                           static_cast<float>(color[2] * brightness[i])));
    Scene scene = sceneIn(ColorSpace::LinearSrgb);
    scene.film.exposure_ev = 1;
    for (const ColorSpace space : {ColorSpace::LinearSrgb, ColorSpace::AcesCg, ColorSpace::Xyz})
        for (const char* light : {"", "A", "F11"}) {
            INFO(light << " in space " << static_cast<int>(space));
            scene.film.color_space = space;
            scene.film.white_balance = *light != 0 ? illuminantSpectrum(light) : std::nullopt;
            const stats::Rgb weights = stats::luminanceWeights(space);
            // The same by resolving every sample as a separate image.
            std::vector<double> luminances;
            for (const double b : brightness) {
                const Image one = resolveImage(filmOf({color[0] * b, color[1] * b, color[2] * b}),
                                               developmentOf(scene), 0);
                luminances.push_back(
                    stats::luminance({one.pixels[0], one.pixels[1], one.pixels[2]}, weights));
            }
            const double expected = stats::summarize(luminances).standardError();
            const Image image = resolveImage(film, developmentOf(scene), kAovVariance | kAovError);
            REQUIRE(image.channels[4] == "StdError.Y");
            CHECK(image.pixels[4] == Approx(expected).epsilon(1e-4));
            CHECK(image.pixels[3] == Approx(expected * expected).epsilon(1e-4));
            REQUIRE(image.channels[5] == "HalfWidth95.Y");
            CHECK(image.pixels[5] == Approx(stats::studentQuantile(0.975, 15.0) * expected).epsilon(1e-4));
            REQUIRE(image.channels[6] == "OwnVariance.Y");
            CHECK(image.pixels[6] == image.pixels[3]);  // One pixel has no neighbours.
        }
    // The white balance of A moves this colour's luminance by much more than the tolerance above.
    scene.film.color_space = ColorSpace::LinearSrgb;
    scene.film.white_balance = illuminantSpectrum("A");
    const double balanced = resolveImage(film, developmentOf(scene), kAovError).pixels[3];
    scene.film.white_balance.reset();
    CHECK(std::abs(balanced / resolveImage(film, developmentOf(scene), kAovError).pixels[3] - 1) > 0.03);
}

TEST_CASE("an image says under which conditions its values came about, and how surely its error is known",
          "[film]") {
    Film film(kOnePixel);
    for (std::uint64_t i = 0; i < 9; ++i) film.add(oneSample(i, 1, static_cast<float>(i), 1));
    Scene scene = sceneIn(ColorSpace::AcesCg);
    scene.film.exposure_ev = -1.5;
    const Image plain = resolveImage(film, developmentOf(scene), 0);
    CHECK(metadataValue(plain, kExposureKey) == "-1.5");
    CHECK(metadataValue(plain, kWhiteBalanceKey) == "none");
    CHECK(metadataValue(plain, kErrorDofKey).empty());  // It states no error.
    scene.film.white_balance = illuminantSpectrum("A");
    const Image with_error = resolveImage(film, developmentOf(scene), kAovError);
    // CIE 15: illuminant A has x = 0.44758, y = 0.40745; the sums here go to 830 nm in steps of 1 nm.
    CHECK_THAT(metadataValue(with_error, kWhiteBalanceKey), Contains("0.4475") && Contains(",0.4074"));
    CHECK(errorDegreesOfFreedom(with_error) == LuminanceVariance(film).degreesOfFreedom());
    CHECK(errorDegreesOfFreedom(resolveImage(film, developmentOf(scene), kAovVariance)) ==
          LuminanceVariance(film).degreesOfFreedom());
    CHECK_FALSE(errorDegreesOfFreedom(
        resolveImage(oneSample(0, 1, 1, 1), developmentOf(scene), kAovError)));  // One sample knows nothing.
}

TEST_CASE("AOV planes carry their names, types and values", "[film]") {
    const std::uint32_t in_film = kAovSquares | kAovAlbedo | kAovNormal | kAovDepth | kAovPrimitive;
    Film film({1, 1, 11, in_film});
    const double means[11] = {0.4, 0.5, 0.6, 0.3, 1.0, 1.0, 1.0, 0.0, 0.6, -0.8, 42.5};
    for (int c = 0; c < 11; ++c) film.sums[2 * c] = 4 * means[c];
    film.counts[0] = 4;
    film.samples.add({0, 5});
    film.primitives[0] = 17;
    Scene scene = sceneIn(ColorSpace::LinearSrgb);
    scene.film.exposure_ev = 1;

    const Image image = resolveImage(film, developmentOf(scene), in_film | kAovVariance | kAovSamples);
    REQUIRE(image.channels == std::vector<std::string>{"R", "G", "B", "Albedo.R", "Albedo.G", "Albedo.B",
                                                       "Ns.X", "Ns.Y", "Ns.Z", "Z", "Variance.Y",
                                                       "OwnVariance.Y"});
    REQUIRE(image.integer_channels == std::vector<std::string>{"id.primitive", "sampleCount"});
    // A perfect white has albedo 1 whatever the exposure; the rest is as it lies in the film.
    for (int c = 3; c < 6; ++c) CHECK(image.pixels[c] == Approx(1.0).margin(2e-7));
    CHECK(image.pixels[6] == 0.0f);
    CHECK(image.pixels[7] == 0.6f);
    CHECK(image.pixels[8] == -0.8f);
    CHECK(image.pixels[9] == 42.5f);
    CHECK(image.pixels[10] == Approx(4 * (0.3 - 0.25) / 3));  // Exposure 2 scales the variance by 4.
    CHECK(image.integers == std::vector<std::uint32_t>{17, 4});

    const auto value = [&](const std::string& key) {
        for (const auto& [name, text] : image.metadata)
            if (name == key) return text;
        return std::string("(none)");
    };
    CHECK(value("crt/spp") == "5");
    CHECK(value("crt/sampleRanges") == "0-5");
    CHECK(value("crt/invalidSamples") == "1");

    // A subset leaves out exactly what was not asked for, wherever it lies in the film.
    const Image depth = resolveImage(film, developmentOf(scene), kAovDepth);
    CHECK(depth.channels == std::vector<std::string>{"R", "G", "B", "Z"});
    CHECK(depth.pixels[3] == 42.5f);
    CHECK(depth.integers.empty());
    CHECK_THROWS_WITH(resolveImage(Film(kOnePixel), developmentOf(scene), kAovNormal), Contains("normal"));
}
