// The C++ face of a backend, against the test double `fake`: what was rendered is what is read, and whatever
// goes wrong in a plugin arrives as an error of the right kind.
#include "backend/integrator.h"
#include "base/error.h"
#include "base/listener.h"
#include "catch.h"
#include "fake_plugins/fake_pattern.h"
#include "kernel/layout.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

using namespace crt;

namespace {

constexpr std::uint64_t kSeed = 0x1234567890ull;

LoadedBackend openFake(const std::string& name) {
    return loadBackend(std::string(CRT_FAKE_PLUGIN_DIR "/crt_backend_") + name + ".so");
}

struct ScopedFault {
    explicit ScopedFault(const char* fault) { ::setenv("CRT_FAKE_FAULT", fault, 1); }
    ~ScopedFault() { ::unsetenv("CRT_FAKE_FAULT"); }
};

/// Only what `fake` reads: a header without a scene behind it.
CompiledScene makeScene(std::uint32_t width, std::uint32_t height, std::uint32_t aovs = 0) {
    const std::uint32_t channels = CRT_CHANNELS_BASE + ((aovs & kAovDepth) != 0 ? 1 : 0);
    kernel::CrtScene header{};
    header.magic = CRT_SCENE_MAGIC;
    header.width = header.film_width = width;
    header.height = header.film_height = height;
    header.channels = channels;
    header.aovs = aovs;
    header.seed.low = static_cast<std::uint32_t>(kSeed);
    header.seed.high = static_cast<std::uint32_t>(kSeed >> 32);

    CompiledScene scene;
    scene.blob.resize((sizeof(header) + 63) / 64);
    scene.size_bytes = sizeof(header);
    std::memcpy(scene.blob.data(), &header, sizeof(header));
    return scene;
}

Film filmOf(const CompiledScene& scene) { return Film(filmShapeOf(scene)); }

double expected(std::uint32_t x, std::uint32_t y, std::uint32_t channel, std::uint64_t first,
                std::uint64_t count) {
    double sum = 0;  // exact: multiples of 2^-24
    for (std::uint64_t s = first; s < first + count; ++s) sum += fake::sampleValue(kSeed, x, y, s, channel);
    return sum;
}

ErrorKind kindOfFailure(const std::function<void()>& action, const std::string& part) {
    try {
        action();
    } catch (const Error& error) {
        CHECK_THAT(error.what(), Contains(part));
        return error.kind();
    }
    FAIL("nothing was thrown; expected: " << part);
    return ErrorKind::Internal;
}

}  // namespace

TEST_CASE("what a backend renders arrives in the film", "[integrator]") {
    const CompiledScene scene = makeScene(7, 5, kAovDepth | kAovPrimitive);
    Integrator integrator(openFake("fake"), {});
    integrator.setScene(scene);
    CHECK(integrator.render({0, 16}));
    CHECK(integrator.render({32, 8}));
    Film film = filmOf(scene);
    integrator.readFilm(film);

    CHECK(film.samples.text() == "0-16;32-40");
    for (std::uint32_t y = 0; y < 5; ++y) {
        for (std::uint32_t x = 0; x < 7; ++x) {
            CHECK(film.counts[y * 7 + x] == 24);
            CHECK(film.primitives[y * 7 + x] == fake::primitiveAt(x, y));
            for (std::uint32_t c : {0u, 1u, 2u, 3u})
                CHECK(film.sum(x, y, c) == expected(x, y, c, 0, 16) + expected(x, y, c, 32, 8));
        }
    }
    CHECK(film.invalidSamples() == 0);

    const CrtBackendReport report = integrator.report();
    CHECK(std::string(report.device) == "pattern");
    CHECK(report.paths == 24 * 35);
}

TEST_CASE("any split of ranges gives the same film", "[integrator]") {
    const CompiledScene scene = makeScene(8, 6);
    Integrator integrator(openFake("fake"), {});
    integrator.setScene(scene);
    integrator.render({0, 10});
    Film whole = filmOf(scene);
    integrator.readFilm(whole);

    integrator.setScene(scene);  // clears the film
    integrator.render({4, 6});
    CHECK(kindOfFailure([&] { integrator.render({3, 2}); }, "overlap") == ErrorKind::Usage);
    integrator.render({0, 4});
    Film split = filmOf(scene);
    integrator.readFilm(split);

    CHECK(split.sums == whole.sums);
    CHECK(split.counts == whole.counts);
    CHECK(split.samples.text() == "0-10");
}

TEST_CASE("readFilm adds", "[integrator]") {
    const CompiledScene scene = makeScene(4, 4);
    Integrator first(openFake("fake"), {});
    first.setScene(scene);
    first.render({0, 3});
    Film film = filmOf(scene);
    first.readFilm(film);

    Integrator second(openFake("fake"), {});
    second.setScene(scene);
    second.render({3, 5});
    second.readFilm(film);
    CHECK(film.samples.text() == "0-8");
    CHECK(film.sum(2, 1, fake::kY) == expected(2, 1, fake::kY, 0, 8));

    CHECK(kindOfFailure([&] { second.readFilm(film); }, "overlap") == ErrorKind::Usage);
    Film other = filmOf(makeScene(4, 5));
    CHECK(kindOfFailure([&] { first.readFilm(other); }, "another shape") == ErrorKind::Internal);
}

TEST_CASE("a cancelled render leaves nothing that could be read", "[integrator]") {
    const CompiledScene scene = makeScene(4, 8);
    Integrator integrator(openFake("fake"), {});
    integrator.setScene(scene);
    std::vector<double> seen;
    CHECK_FALSE(integrator.render({0, 4}, [&](double done) {
        seen.push_back(done);
        return done >= 0.5;
    }));
    CHECK(seen.back() == 0.5);
    CHECK(std::is_sorted(seen.begin(), seen.end()));

    Film film = filmOf(scene);
    CHECK(kindOfFailure([&] { integrator.readFilm(film); }, "part of a cancelled or failed range") ==
          ErrorKind::Internal);
    CHECK(kindOfFailure([&] { integrator.render({0, 4}); }, "without setScene") == ErrorKind::Internal);
    integrator.setScene(scene);
    CHECK(integrator.render({0, 4}));
    integrator.readFilm(film);
    CHECK(film.sum(1, 1, fake::kX) == expected(1, 1, fake::kX, 0, 4));

    // Too late to stop: the range is complete, so it counts.
    integrator.setScene(scene);
    CHECK(integrator.render({0, 4}, [](double done) { return done == 1.0; }));
}

TEST_CASE("an exception of the caller's own passes around the plugin", "[integrator]") {
    Integrator integrator(openFake("fake"), {});
    integrator.setScene(makeScene(4, 4));
    CHECK_THROWS_AS(integrator.render({0, 1}, [](double) -> bool { throw std::out_of_range("mine"); }),
                    std::out_of_range);
}

TEST_CASE("what goes wrong in a backend arrives as an error of its kind", "[integrator]") {
    const CompiledScene scene = makeScene(4, 4);
    Integrator integrator(openFake("fake"), {});
    CHECK(kindOfFailure([&] { integrator.render({0, 1}); }, "before setScene") == ErrorKind::Internal);
    integrator.setScene(scene);
    {
        const ScopedFault fault("oom");
        CHECK(kindOfFailure(
                  [&] {
                      integrator.render({0, 1});
                  },
                  "backend 'fake': the device has no memory left") == ErrorKind::Device);
    }
    integrator.setScene(scene);
    {
        const ScopedFault fault("device");
        CHECK(kindOfFailure(
                  [&] {
                      integrator.render({0, 1});
                  },
                  "backend 'fake': the device fell off the bus") == ErrorKind::Device);
    }
    integrator.setScene(scene);
    CHECK(kindOfFailure(
              [&] {
                  integrator.render({~std::uint64_t{0}, 2});
              },
              "exceed 64 bits") == ErrorKind::Usage);
    CHECK(integrator.render({0, 0}));
    CHECK(integrator.render({0, 1}));

    CompiledScene wrong = makeScene(4, 4);
    wrong.blob[0].bytes[0] ^= 1;
    CHECK(kindOfFailure([&] { integrator.setScene(wrong); }, "does not begin with a scene") ==
          ErrorKind::Internal);
}

TEST_CASE("samples that are not a number are dropped and counted", "[integrator]") {
    const CompiledScene scene = makeScene(5, 3);
    Integrator integrator(openFake("fake"), {});
    integrator.setScene(scene);
    const ScopedFault fault("nan");
    integrator.render({0, 14});
    Film film = filmOf(scene);
    integrator.readFilm(film);
    CHECK(film.invalidSamples() == 2 * 15);
    CHECK(film.counts[0] == 12);
}

TEST_CASE("a film that no sound backend hands over is refused, and what was there before is kept",
          "[integrator]") {
    const CompiledScene scene = makeScene(5, 3);
    Integrator integrator(openFake("fake"), {});
    integrator.setScene(scene);
    integrator.render({0, 14});
    Film film = filmOf(scene);
    for (const auto& [fault, words] :
         {std::pair{"nan_film", "broke the contract: pixel 2,1 of its film is not a number"},
          {"count_film", "pixel 0,0 of its film has 15 samples and 14 were asked for"}}) {
        const ScopedFault scoped(fault);
        CHECK(kindOfFailure([&] { integrator.readFilm(film); }, words) == ErrorKind::Internal);
        CHECK(film.samples.count() == 0);
        CHECK(film.sums == filmOf(scene).sums);
    }
    integrator.readFilm(film);
    CHECK(film.samples.count() == 14);
}

TEST_CASE("devices are chosen by number or by name", "[integrator]") {
    const auto device = [](const std::string& wanted) {
        IntegratorOptions options;
        options.device = wanted;
        return std::string(Integrator(openFake("fake"), options).report().device);
    };
    CHECK(device("") == "pattern");
    CHECK(device("1") == "second pattern");
    CHECK(device("SECOND") == "second pattern");
    CHECK(kindOfFailure([&] { device("third"); },
                        "no device matches 'third'; there is 0 'pattern', 1 'second pattern'") ==
          ErrorKind::Backend);
}

TEST_CASE("a scene without a BVH is for backends that bring one", "[integrator]") {
    CompiledScene without = makeScene(4, 3);
    without.without_nodes = true;
    CHECK(compileOptionsFor(openFake("fake")).accelerator_reach == 0);
    Integrator fake(openFake("fake"), {});
    CHECK(kindOfFailure([&] { fake.setScene(without); },
                        "backend 'fake' needs the BVH that was left out of this scene") ==
          ErrorKind::Internal);
    fake.setScene(makeScene(4, 3));
    CHECK(compileOptionsFor(openFake("many_devices")).accelerator_reach == 2);
    Integrator brings(openFake("many_devices"), {});
    brings.setScene(without);
}

TEST_CASE("a backend tells how far set_scene is", "[integrator]") {
    setenv("CRT_FAKE_SCENE_SECONDS", "0.01", 1);
    Integrator fake(openFake("fake"), {});
    std::vector<double> told;
    fake.setScene(makeScene(4, 3), [&](double done) { told.push_back(done); });
    unsetenv("CRT_FAKE_SCENE_SECONDS");
    REQUIRE(told.size() == 100);
    CHECK(told[0] == 0);
    CHECK(told[50] == 0.5);
}

TEST_CASE("a plugin that throws at its host is named", "[integrator]") {
    CHECK(kindOfFailure(
              [] { Integrator(openFake("throws_in_create"), {}); },
              "broke the contract: an exception crossed the border from create (create fell over)") ==
          ErrorKind::Internal);
    Integrator integrator(openFake("throws_in_render"), {});
    integrator.setScene(makeScene(4, 4));
    CHECK(
        kindOfFailure(
            [&] {
                integrator.render({0, 1});
            },
            "backend 'throws_in_render' broke the contract: an exception crossed the border from render") ==
        ErrorKind::Internal);
    // A plugin that fails without a word.
    CHECK(kindOfFailure([&] { integrator.report(); }, "backend 'throws_in_render': internal error") ==
          ErrorKind::Internal);
}

TEST_CASE("what a plugin's own threads say goes to who made the call", "[integrator]") {
    Integrator integrator(openFake("fake"), {});
    integrator.setScene(makeScene(4, 4));
    ::setenv("CRT_FAKE_FAULT", "talk", 1);
    for (std::uint64_t sample = 0; sample < 2; ++sample) {
        std::vector<std::string> heard;
        const Listener listener([&](LogLevel, std::string_view text) { heard.emplace_back(text); });
        const ListenerScope scope(listener);
        CHECK(integrator.render({sample, 1}));
        CHECK(heard == std::vector<std::string>{"a thread of the fake"});
        CHECK(listener.warnings() == 1);
    }
    ::unsetenv("CRT_FAKE_FAULT");
}

TEST_CASE("integrators move", "[integrator]") {
    const CompiledScene scene = makeScene(4, 4);
    Integrator a(openFake("fake"), {});
    a.setScene(scene);
    Integrator b = std::move(a);
    int calls = 0;
    // The plugin holds the host table's address, which must not have moved.
    CHECK(b.render({0, 1}, [&](double) { return ++calls < 0; }));
    CHECK(calls == 5);
    a = std::move(b);
    CHECK(a.render({1, 1}));
}
