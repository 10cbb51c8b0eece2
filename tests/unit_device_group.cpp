// Several devices at one scene, against the two of the test double `fake`: the film is that of one device,
// whatever fails.
#include "backend/device_group.h"
#include "backend/loader.h"
#include "base/listener.h"
#include "catch.h"
#include "fake_plugins/fake_pattern.h"
#include "render/render.h"
#include "render/sampling.h"
#include "render/session.h"
#include "same_film.h"
#include "scene/yaml/scene_yaml.h"

#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

using namespace crt;
using crt::test::checkSame;

namespace {

using Names = std::vector<std::string>;

LoadedBackend openFake() {
    return loadBackend(CRT_FAKE_PLUGIN_DIR "/crt_backend_fake.so");
}

CompiledScene smallScene() {
    return compileScene(
        parseScene("crt: 1\nfilm: {resolution: [6, 4]}\nenvironment: {radiance: 1}\n", "test", "."),
        kAovPrimitive);
}

/// A fault of one of the devices, or of all.
struct DeviceFault {
    explicit DeviceFault(const char* fault, const char* device = nullptr) {
        ::setenv("CRT_FAKE_FAULT", fault, 1);
        if (device != nullptr) ::setenv("CRT_FAKE_FAULT_DEVICE", device, 1);
    }
    ~DeviceFault() {
        ::unsetenv("CRT_FAKE_FAULT");
        ::unsetenv("CRT_FAKE_FAULT_DEVICE");
    }
};

struct Group {
    LoadedBackend backend = openFake();
    CompiledScene compiled = smallScene();
    DeviceGroup devices;

    explicit Group(const std::string& device) : devices(backend, {.device = device}, probeDevices(backend)) {
        devices.setScene(compiled);
    }
    Film film() {
        Film film(filmShapeOf(compiled));
        devices.readFilm(film);
        return film;
    }
};

Film filmOfOne(std::uint64_t samples) {
    Group one("");
    one.devices.render({.sample_count = samples});
    return one.film();
}

}  // namespace

TEST_CASE("a device by its name, several by their indices, or all", "[device_group]") {
    const std::vector<CrtDevice> devices = probeDevices(openFake());
    CHECK(devicesNamed("", devices) == Names{""});
    CHECK(devicesNamed("second", devices) == Names{"second"});
    CHECK(devicesNamed("1", devices) == Names{"1"});
    CHECK(devicesNamed("1,0", devices) == Names{"1", "0"});
    CHECK(devicesNamed("all", devices) == Names{"0", "1"});
    CHECK(devicesNamed("Xeon, 8 cores", devices) == Names{"Xeon, 8 cores"});
    CHECK_THROWS_WITH(devicesNamed("0,2", devices),
                      Contains("there is no device '2'; there is 0 'pattern', 1 'second pattern'"));
    CHECK_THROWS_WITH(devicesNamed("0,0", devices), Contains("device 0 is named twice"));
    CHECK_THROWS_WITH(devicesNamed("0,", devices), Contains("there is no device ''"));
}

// Fails when ranges overlap or leave gaps, or when a device's film is added twice or not at all.
TEST_CASE("several devices give the film of one", "[device_group]") {
    const std::uint64_t count = GENERATE(1, 2, 3, 30);
    Group group("all");
    group.devices.render({.sample_count = count});
    checkSame(group.film(), filmOfOne(count));
    // Onwards, after the film was read.
    group.devices.render({.first_sample = count, .sample_count = 17});
    checkSame(group.film(), filmOfOne(count + 17));
    CHECK(group.devices.report().paths == (count + 17) * 24);
    CHECK(std::string(group.devices.report().device) == "pattern + second pattern");
}

// `fake` scores its devices 1 and 0.5, which is all that is known before the first range.
TEST_CASE("a device gets as much as it is fast", "[device_group]") {
    Group group("all");
    group.devices.render({.sample_count = 30});
    const std::vector<DeviceShare> shares = group.devices.shares();
    REQUIRE(shares.size() == 2);
    CHECK(shares[0].samples == 20);
    CHECK(shares[1].samples == 10);
}

TEST_CASE("the devices of a group report their progress together", "[device_group]") {
    Group group("0,1");
    std::vector<double> seen;
    group.devices.render({.sample_count = 9}, [&](double done) { seen.push_back(done); });
    REQUIRE_FALSE(seen.empty());
    CHECK(std::is_sorted(seen.begin(), seen.end()));
    CHECK(seen.back() == Approx(1));
}

// Fails when what only the failed device had is not rendered again, or what was read of it before twice.
TEST_CASE("a device that fails is dropped, and the others render what it had", "[device_group]") {
    const char* const broken = GENERATE("0", "1");
    const bool read_before = GENERATE(false, true);
    const char* const fault = GENERATE("device", "oom", "read");
    CAPTURE(broken, read_before, fault);
    const Film expected = filmOfOne(30);
    Group group("all");
    group.devices.render({.sample_count = 12});
    if (read_before) group.film();
    group.devices.render({.first_sample = 12, .sample_count = 8});
    {
        const DeviceFault failing(fault, broken);
        group.devices.render({.first_sample = 20, .sample_count = 10});
        checkSame(group.film(), expected);
    }
    const std::vector<DeviceShare> shares = group.devices.shares();
    const std::size_t failed = std::strtoul(broken, nullptr, 10);
    CHECK_FALSE(shares[failed].failure.empty());
    CHECK(shares[1 - failed].failure.empty());
    CHECK(shares[0].samples + shares[1].samples == 30);
    CHECK((shares[failed].samples > 0) == read_before);
    // The other one goes on alone, also with the next scene.
    group.devices.render({.first_sample = 30, .sample_count = 3});
    checkSame(group.film(), filmOfOne(33));
    group.devices.setScene(group.compiled);
    group.devices.render({.sample_count = 5});
    checkSame(group.film(), filmOfOne(5));
}

TEST_CASE("a device for which the scene is too large is left out", "[device_group]") {
    const LoadedBackend backend = openFake();
    DeviceGroup devices(backend, {.device = "all"}, probeDevices(backend));
    const CompiledScene compiled = smallScene();
    const Film expected = filmOfOne(6);
    const DeviceFault failing("scene_oom", "0");
    devices.setScene(compiled);
    devices.render({.sample_count = 6});
    Film film(filmShapeOf(compiled));
    devices.readFilm(film);
    checkSame(film, expected);
    CHECK_THAT(devices.shares()[0].failure, Contains("12 bytes more than there are"));
}

TEST_CASE("when every device has failed, the film holds what was read before", "[device_group]") {
    Group group("all");
    Film film(filmShapeOf(group.compiled));
    Watch watch;
    int checkpoints = 0;
    const SamplingPlan plan{
        .ranges = {{0, 40}}, .target = 40, .chunk = 4, .checkpoint_interval_seconds = 1e-9};
    std::optional<DeviceFault> fault;
    DeviceFilm devices(group.devices, group.compiled);
    const SamplingResult result = sampleFilm(devices, film, plan, watch, [&] {
        if (++checkpoints == 3) fault.emplace("device");
    });
    fault.reset();
    CHECK(result.stop == StopReason::Failed);
    REQUIRE(result.failure);
    CHECK(result.failure->kind() == ErrorKind::Device);
    CHECK(result.rendered == 12);
    checkSame(film, filmOfOne(12));
}

TEST_CASE("a device that failed is opened again by the next render of a scene", "[device_group]") {
    const Scene scene =
        parseScene("crt: 1\nfilm: {resolution: [6, 4]}\nenvironment: {radiance: 1}\n", "test", ".");
    const RenderOptions options{
        .backend = CRT_FAKE_PLUGIN_DIR "/crt_backend_fake.so", .spp = 12, .chunk = 4};
    int opens = 0;
    const Listener listener([](LogLevel, std::string_view) {}, LogLevel::Error,
                            [&](const std::string& stage) { opens += stage == "opening the backend"; });
    const ListenerScope scope(listener);
    SceneRenderer on_devices(scene, options);
    const SamplingPlan plan = planSamples(options, scene, {});
    Watch watch;
    const Rendered first = on_devices.render(plan, std::nullopt, watch);
    {
        const DeviceFault fault("device");
        const Rendered failed = on_devices.render(plan, std::nullopt, watch);
        REQUIRE(failed.failure);
        CHECK(failed.film.samples.count() == 0);
    }
    const Rendered after_failure = on_devices.render(plan, std::nullopt, watch);
    checkSame(after_failure.film, first.film);
    CHECK(opens == 2);
    {
        const DeviceFault fault("scene_oom");
        CHECK_THROWS_AS(on_devices.render(plan, std::nullopt, watch), Error);
    }
    const Rendered again = on_devices.render(plan, std::nullopt, watch);
    CHECK_FALSE(again.failure);
    CHECK(opens == 3);
    checkSame(again.film, first.film);
    CHECK(first.film.samples.count() == 12);
    CHECK(again.facts.rendered_samples == 12);
}
