// A film that no device has room for is rendered in bands and is the same film. Against `fake`, whose memory
// is as small as a test wants (CRT_FAKE_MEMORY).
#include "backend/loader.h"
#include "catch.h"
#include "fake_plugins/fake_pattern.h"
#include "kernel/dialect/layout.h"
#include "render/device_film.h"
#include "render/sampling.h"
#include "render/session.h"
#include "same_film.h"
#include "scene/yaml/scene_yaml.h"

#include <cstdlib>
#include <string>

using namespace crt;
using crt::test::checkSame;

namespace {

constexpr std::uint32_t kWidth = 6, kHeight = 9;

/// A variable of the environment, until this goes.
struct Setting {
    Setting(const char* variable, const std::string& value) : variable_(variable) {
        ::setenv(variable, value.c_str(), 1);
    }
    ~Setting() { ::unsetenv(variable_); }
    const char* variable_;
};

struct Run {
    LoadedBackend backend = loadBackend(CRT_FAKE_PLUGIN_DIR "/crt_backend_fake.so");
    CompiledScene compiled = compileScene(
        parseScene("crt: 1\nfilm: {resolution: [12, 20], crop: [3, 5, 9, 14]}\nenvironment: {radiance: 1}\n",
                   "test", "."),
        kAovPrimitive);
    DeviceGroup group;
    DeviceFilm devices{group, compiled};

    explicit Run(const std::string& device = "")
        : group(backend, {.device = device}, probeDevices(backend)) {}

    /// Memory of the scene and of this number of rows of its film.
    std::string roomFor(std::uint32_t rows) const {
        const std::uint64_t channels = compiled.header().channels;
        return std::to_string(compiled.size_bytes +
                              std::uint64_t{rows} * kWidth * (16 * channels + 8));
    }
    Film empty() const { return Film(filmShapeOf(compiled)); }
    Film film() {
        Film film = empty();
        devices.readFilm(film);
        return film;
    }
};

/// Of a device with room for it, whatever those of the test have.
Film filmOfOne(std::uint64_t samples) {
    const char* const limit = std::getenv("CRT_FAKE_MEMORY");
    const std::string memory = limit != nullptr ? limit : "";
    ::unsetenv("CRT_FAKE_MEMORY");
    Run one;
    one.devices.setScene();
    REQUIRE_FALSE(one.devices.inBands());
    one.devices.render({.sample_count = samples});
    if (limit != nullptr) ::setenv("CRT_FAKE_MEMORY", memory.c_str(), 1);
    return one.film();
}

}  // namespace

// Fails when a band has the pixels, the samples or the rows of another.
TEST_CASE("a film in bands is the film of a device with room for all of it", "[device_film]") {
    const std::string device = GENERATE("", "all");
    const auto [rows, bands] = GENERATE(table<std::uint32_t, std::size_t>({{8, 2}, {5, 2}, {4, 3}, {1, 9}}));
    CAPTURE(device, rows);
    const Film expected = filmOfOne(12), longer = filmOfOne(29);
    Run run(device);
    const Setting memory("CRT_FAKE_MEMORY", run.roomFor(rows));
    run.devices.setScene();
    CHECK(run.devices.bands() == bands);
    double last = 0;
    run.devices.render({.sample_count = 12}, [&](double done) {
        CHECK(done >= last);
        last = done;
    });
    CHECK(last == Approx(1));
    Film film = run.film();
    checkSame(film, expected);
    CHECK(run.group.report().paths == 12 * kWidth * kHeight);

    // Further ranges, one read of two; only what is new is added.
    run.devices.render({.first_sample = 12, .sample_count = 10});
    run.devices.render({.first_sample = 22, .sample_count = 7});
    run.devices.readFilm(film);
    run.devices.readFilm(film);
    checkSame(film, longer);
    CHECK(run.group.report().paths == 29 * kWidth * kHeight);
    std::uint64_t samples = 0;
    for (const DeviceShare& share : run.group.shares()) samples += share.samples;
    // Rounded down for each device, where bands were divided differently.
    CHECK(samples <= 29);
    CHECK(samples + run.group.shares().size() > 29);

    // The scene is whole again, and so is the next film where there is room.
    const kernel::CrtScene& header = run.compiled.header();
    CHECK(header.height == kHeight);
    CHECK(header.crop_y == 5);
    ::unsetenv("CRT_FAKE_MEMORY");
    run.devices.setScene();
    CHECK_FALSE(run.devices.inBands());
    run.devices.render({.sample_count = 12});
    checkSame(run.film(), expected);
}

// Fails when the film is made smaller and smaller for a scene that has no room, or the wrong one is blamed.
TEST_CASE("a scene that has no room is refused with its own numbers", "[device_film]") {
    const std::string device = GENERATE("", "all");
    Run run(device);
    const Setting memory("CRT_FAKE_MEMORY", std::to_string(run.compiled.size_bytes - 1));
    try {
        run.devices.setScene();
        FAIL("no error");
    } catch (const Error& error) {
        CHECK(error.kind() == ErrorKind::Device);
        CHECK(error.lacksMemory());
        CHECK_THAT(error.what(), Contains("the scene needs " + std::to_string(run.compiled.size_bytes)));
    }
    CHECK(run.compiled.header().height == kHeight);
}

TEST_CASE("memory that others take in the middle makes more bands", "[device_film]") {
    const Film expected = filmOfOne(20);
    Run run;
    Setting memory("CRT_FAKE_MEMORY", run.roomFor(5));
    run.devices.setScene();
    run.devices.render({.sample_count = 4});
    CHECK(run.devices.bands() == 2);
    ::setenv("CRT_FAKE_MEMORY", run.roomFor(3).c_str(), 1);
    run.devices.render({.first_sample = 4, .sample_count = 16});
    CHECK(run.devices.bands() == 3);
    checkSame(run.film(), expected);
    ::setenv("CRT_FAKE_MEMORY", "1", 1);
    CHECK_THROWS_WITH(run.devices.render({.first_sample = 20, .sample_count = 1}),
                      Contains("the scene needs"));
}

TEST_CASE("a device with too little memory is left out where another has enough", "[device_film]") {
    const Film expected = filmOfOne(12);
    Run run("all");
    const Setting memory("CRT_FAKE_MEMORY", run.roomFor(kHeight) + "," + run.roomFor(3));
    run.devices.setScene();
    CHECK_FALSE(run.devices.inBands());
    run.devices.render({.sample_count = 12});
    checkSame(run.film(), expected);
    CHECK_THAT(run.group.shares()[1].failure, Contains("the film needs"));
    // The next scene may suit it.
    ::setenv("CRT_FAKE_MEMORY", run.roomFor(kHeight).c_str(), 1);
    run.devices.setScene();
    CHECK(run.group.shares()[1].failure.empty());
}

TEST_CASE("a device that fails in a band is dropped, and the other renders the band again",
          "[device_film]") {
    const std::string broken = GENERATE("0", "1"), fault = GENERATE("device", "oom", "read");
    CAPTURE(broken, fault);
    const Film expected = filmOfOne(20);
    Run run("all");
    const Setting memory("CRT_FAKE_MEMORY", run.roomFor(5));
    run.devices.setScene();
    run.devices.render({.sample_count = 12});
    {
        const Setting only("CRT_FAKE_FAULT_DEVICE", broken), failing("CRT_FAKE_FAULT", fault);
        run.devices.render({.first_sample = 12, .sample_count = 8});
    }
    checkSame(run.film(), expected);
    CHECK_FALSE(run.group.shares()[std::stoul(broken)].failure.empty());
}

// Fails when what was rendered in earlier bands of the range that failed is in the film.
TEST_CASE("in bands, too, the film holds what was whole before the device failed", "[device_film]") {
    Run run;
    const Setting memory("CRT_FAKE_MEMORY", run.roomFor(4));
    run.devices.setScene();
    // As after --resume.
    Film film = filmOfOne(4);
    Watch watch;
    int checkpoints = 0;
    const SamplingPlan plan{
        .ranges = {{4, 40}}, .target = 40, .chunk = 4, .checkpoint_interval_seconds = 1e-9};
    const SamplingResult result = sampleFilm(run.devices, film, plan, watch, [&] {
        checkSame(film, filmOfOne(4 + 4 * static_cast<std::uint64_t>(++checkpoints)));
        if (checkpoints == 3) ::setenv("CRT_FAKE_FAULT", "device", 1);
    });
    ::unsetenv("CRT_FAKE_FAULT");
    CHECK(result.stop == StopReason::Failed);
    CHECK(result.rendered == 12);
    checkSame(film, filmOfOne(16));
}

// Fails when what every band costs is taken for the price of samples: chunks of 1, 4, 16, … samples.
TEST_CASE("in bands, chunks grow until what each costs besides does not count", "[device_film]") {
    Run run;
    const Setting memory("CRT_FAKE_MEMORY", run.roomFor(5));
    run.devices.setScene();
    const Setting slow("CRT_FAKE_SCENE_SECONDS", "0.05");
    Film film = run.empty();
    Watch watch;
    const SamplingResult result =
        sampleFilm(run.devices, film, {.ranges = {{0, 585}}, .target = 585}, watch, [] {});
    CHECK(result.chunks == 4);  // 1 + 8 + 64 + 512
    checkSame(film, filmOfOne(585));
}

TEST_CASE("a film with splats is not rendered in bands", "[device_film]") {
    const LoadedBackend backend = loadBackend(CRT_FAKE_PLUGIN_DIR "/crt_backend_fake.so");
    CompiledScene compiled = compileScene(
        parseScene("crt: 1\nfilm: {resolution: [12, 20]}\nenvironment: {radiance: 1}\n"
                   "integrator: {type: splat_test}\n",
                   "test", "."),
        0);
    DeviceGroup group(backend, {}, probeDevices(backend));
    DeviceFilm devices(group, compiled);
    const Setting memory("CRT_FAKE_MEMORY", std::to_string(compiled.size_bytes + 1000));
    CHECK_THROWS_WITH(devices.setScene(),
                      Contains("the film needs") && Contains("cannot be rendered in bands"));
    CHECK_FALSE(devices.inBands());
}
