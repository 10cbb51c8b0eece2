// The whole way, in this process: render() and Session, and two renders at once, which share nothing.
#include "base/listener.h"
#include "base/log.h"
#include "base/stage.h"
#include "catch.h"
#include "render/render.h"
#include "render/session.h"
#include "scene/yaml/scene_yaml.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <future>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

using namespace crt;

namespace {

/// A square: with an emission, one that faces down the y axis; without, one of a wall that faces the camera.
std::string quad(const std::string& name, double x, double y, double z, double side, const char* more) {
    return fmt::format(
        "  - {{name: {0}, mesh: {{positions: [[{1}, {2}, {3}], [{4}, {2}, {3}], [{4}, {5}, {6}], [{1}, {5}, "
        "{6}]], faces: [[0, 1, 2, 3]]}}, material: grey{7}}}\n",
        name, x, y, z, x + side, *more != '\0' ? y : y + side, *more != '\0' ? z + side : z, more);
}

/// A lamp above a wall of `side`² quads, so that the scene has a BVH; and one lamp that lights nothing,
/// named so that its warning can be told from that of another scene.
std::string roomYaml(const std::string& idle, int side, int width, const std::string& seed) {
    std::string text = fmt::format(
        "crt: 1\nfilm: {{resolution: [{}, 32]}}\nsampler: {{seed: {}}}\n"
        "camera: {{position: [0, 0, 4], target: [0, 0, 0], fov: 50}}\n"
        "materials:\n  grey: {{type: diffuse, reflectance: 0.6}}\n"
        "objects:\n",
        width, seed);
    // Counter-clockwise seen from below: the lamps face down.
    text += quad("lamp", -1, 2, -1, 2, ", emission: {radiance: 5}");
    text += quad(idle, -90, -50, -90, 1, ", emission: {radiance: 1}");
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x)
            text += quad(fmt::format("tile_{}_{}", x, y), 0.5 * x - 0.25 * side, 0.5 * y - 0.25 * side,
                         -0.01 * ((x + y) % 2), 0.5, "");
    return text;
}

/// Hears one render, on any of its threads.
struct Heard : Watch {
    std::mutex mutex;
    std::vector<std::string> messages, stages;
    int warnings = 0;
    std::vector<std::pair<std::uint64_t, std::uint64_t>> progress_of;  ///< Pixels, samples to reach.

    void progress(const ProgressState& state) override {
        const std::lock_guard lock(mutex);
        progress_of.emplace_back(state.pixels, state.target);
    }
    int count(const std::string& part) const {
        return static_cast<int>(std::count_if(messages.begin(), messages.end(), [&](const std::string& m) {
            return m.find(part) != std::string::npos;
        }));
    }
};

/// Renders with a listener of its own.
Film renderHeard(const std::string& yaml, const std::string& name, Heard& heard) {
    const Listener listener(
        [&heard](LogLevel, std::string_view message) { heard.messages.emplace_back(message); },
        LogLevel::Debug, [&heard](const std::string& stage) { heard.stages.push_back(stage); });
    const ListenerScope scope(listener);
    const Scene scene = parseScene(yaml, name, ".");
    const RenderOptions options{.backend = CRT_TEST_BACKEND, .spp = 40, .chunk = 1};
    Rendered rendered = render(scene, options, planSamples(options, scene, {}), std::nullopt, heard);
    if (rendered.failure) throw *rendered.failure;
    heard.warnings = listener.warnings();
    return std::move(rendered.film);
}

bool sameFilm(const Film& a, const Film& b) {
    return a.shape() == b.shape() && a.sums == b.sums && a.counts == b.counts &&
           a.primitives == b.primitives;
}

}  // namespace

TEST_CASE("two renders at once give the bits of each alone, and each hears its own", "[render]") {
    const std::string left_yaml = roomYaml("idle_left", 12, 48, "1"),
                      right_yaml = roomYaml("idle_right", 9, 40, "2");
    Heard left_alone, right_alone;
    const Film left = renderHeard(left_yaml, "left.yaml", left_alone),
               right = renderHeard(right_yaml, "right.yaml", right_alone);
    REQUIRE(left.mean(24, 16, 1) > 0);
    REQUIRE(right.mean(20, 16, 1) > 0);

    for (int round = 0; round < 5; ++round) {
        Heard left_heard, right_heard;
        std::future<Film> other = std::async(
            std::launch::async, [&] { return renderHeard(right_yaml, "right.yaml", right_heard); });
        const Film left_again = renderHeard(left_yaml, "left.yaml", left_heard);
        const Film right_again = other.get();
        CHECK(sameFilm(left_again, left));
        CHECK(sameFilm(right_again, right));

        const auto heardItsOwn = [](const Heard& heard, const Heard& alone, const std::string& mine,
                                    const std::string& its) {
            CHECK(heard.count(mine) == 1);
            CHECK(heard.count(its) == 0);
            CHECK(heard.warnings == 1);
            CHECK(heard.messages.size() == alone.messages.size());
            CHECK(heard.stages == alone.stages);
            CHECK(!heard.progress_of.empty());
            for (const auto& state : heard.progress_of) CHECK(state == alone.progress_of.front());
        };
        heardItsOwn(left_heard, left_alone, "idle_left", "idle_right");
        heardItsOwn(right_heard, right_alone, "idle_right", "idle_left");
    }
}

TEST_CASE("a listener hears the threads that were given it, and no other", "[listener]") {
    std::vector<std::string> heard;
    Listener listener([&](LogLevel, std::string_view message) { heard.emplace_back(message); });
    const ListenerScope scope(listener);
    logInfo("here");
    std::thread([carried = currentListener()] {
        CHECK(!currentListener());
        const ListenerScope inner(carried);
        logInfo("carried");
    }).join();
    CHECK(heard == std::vector<std::string>{"here", "carried"});

    {
        std::vector<std::string> inner_heard;
        const Listener inner([&](LogLevel, std::string_view m) { inner_heard.emplace_back(m); });
        const ListenerScope nested(inner);
        logWarning("inside");
        CHECK(inner_heard.size() == 1);
        CHECK(warningCount() == 1);
        const Stage stage("an inner stage");
        CHECK(innermostStage()->what == "an inner stage");
        std::thread([carried = currentListener()] {
            CHECK(!innermostStage());
            const ListenerScope of_thread(carried);
            CHECK(innermostStage());
        }).join();
    }
    CHECK(warningCount() == 0);
    CHECK(!innermostStage());
    CHECK(heard.size() == 2);
}

TEST_CASE("what is said after a listener has ended reaches nothing of it", "[listener]") {
    ListenerRef left;
    std::vector<std::string> heard;
    {
        const Listener listener([&](LogLevel, std::string_view m) { heard.emplace_back(m); });
        left = listener.ref();
    }
    const ListenerScope scope(left);
    logInfo("too late");
    const Stage stage("too late");
    CHECK(heard.empty());
    CHECK(innermostStage());
}

TEST_CASE("a session renders one scene after another", "[render]") {
    Session session(std::string(CRT_TEST_BACKEND));
    CHECK_THROWS_WITH(session.report(), Contains("not open"));
    const Scene first = parseScene(roomYaml("idle", 4, 24, "1"), "first.yaml", "."),
                second = parseScene(roomYaml("idle", 3, 16, "1"), "second.yaml", ".");
    const Film whole = renderFilm(session, first, {.samples = 6});
    CHECK(renderFilm(session, second, {.samples = 2}).shape().width == 16);
    // In two parts, on the device that has rendered another scene meanwhile.
    DeviceGroup& devices = session.group();
    devices.setScene(session.compile(first));
    devices.render({.first_sample = 4, .sample_count = 2});
    double done = 0;
    devices.render({.first_sample = 0, .sample_count = 4},
                   [&](double part) { done = std::max(done, part); });
    Film parts(whole.shape());
    devices.readFilm(parts);
    CHECK(parts.samples.text() == "0-6");
    CHECK(done == 1);
    for (std::uint32_t x = 0; x < 24; ++x) CHECK(parts.mean(x, 16, 1) == whole.mean(x, 16, 1));
}

TEST_CASE("a render goes on from an earlier film, and opens no backend where nothing is missing",
          "[render]") {
    const Scene scene = parseScene(roomYaml("idle", 4, 24, "1"), "scene.yaml", ".");
    const auto upTo = [&](std::uint64_t spp, std::optional<EarlierFilm> earlier, const char* backend) {
        const RenderOptions options{.backend = backend, .spp = spp};
        const SamplingPlan plan =
            planSamples(options, scene, earlier ? earlier->film.samples : SampleRanges());
        Watch watch;
        return render(scene, options, plan, std::move(earlier), watch);
    };
    const Rendered whole = upTo(12, std::nullopt, CRT_TEST_BACKEND);
    Rendered begun = upTo(5, std::nullopt, CRT_TEST_BACKEND);
    const Rendered finished =
        upTo(12, EarlierFilm{"begun", std::move(begun.film), begun.identity}, CRT_TEST_BACKEND);
    CHECK(finished.facts.resumed_samples == 5);
    CHECK(finished.facts.rendered_samples == 7);
    for (std::uint32_t x = 0; x < 24; ++x) CHECK(finished.film.mean(x, 16, 1) == whole.film.mean(x, 16, 1));
    CHECK(
        upTo(12, EarlierFilm{"whole", whole.film, whole.identity}, "no such backend").film.samples.text() ==
        "0-12");

    const Scene other = parseScene(roomYaml("idle", 3, 24, "1"), "other.yaml", ".");
    const RenderOptions options{.backend = CRT_TEST_BACKEND, .spp = 12};
    Watch watch;
    CHECK_THROWS_WITH(render(other, options, planSamples(options, other, begun.facts.samples),
                             EarlierFilm{"begun", whole.film, begun.identity}, watch),
                      Contains("begun"));
}

TEST_CASE("a render asks its scene for the brightest paths, and does not know its error before it met them",
          "[render]") {
    // A chrome ball over a floor: floor, ball, point light.
    const Scene scene = parseScene(
        "crt: 1\nfilm: {resolution: [40, 32]}\n"
        "camera: {position: [0, 1.2, 3.2], target: [0, 0.3, 0], fov: 45}\n"
        "materials:\n  floor: {type: diffuse, reflectance: 0.5}\n"
        "  chrome: {type: rough_conductor, metal: Al, roughness: 0.1}\n"
        "lights: [{type: point, position: [1.2, 2.5, 1], luminous_intensity_cd: 1000}]\nobjects:\n"
        "  - {rectangle: {size: [6, 6]}, material: floor, transform: [{rotate: {axis: [1, 0, 0], "
        "angle_deg: -90}}]}\n"
        "  - {sphere: {radius: 0.5}, material: chrome, transform: [{translate: [0, 0.501, 0]}]}\n",
        "scene.yaml", ".");
    const RenderOptions options{.backend = CRT_TEST_BACKEND, .spp = 16};
    Watch watch;
    Rendered run = render(scene, options, planSamples(options, scene, {}), std::nullopt, watch);
    const BrightestPath brightest = run.identity.record->paths.brightest;
    CHECK(brightest.rare);
    judgeError(run);
    CHECK(run.facts.error->knowledge == ErrorKnowledge::NotYet);
    CHECK(run.facts.error->rare_paths * run.facts.error->mean_luminance == Approx(brightest.luminance));
    CHECK(run.facts.error->rare_paths > 1000);
    CHECK(readRecord(recordText(*run.identity.record)).paths.brightest == brightest);
}
