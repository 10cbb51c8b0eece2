// A long render goes over to a backend that is faster, and loses, repeats and changes no sample.
#include "base/listener.h"
#include "catch.h"
#include "render/render.h"
#include "same_film.h"
#include "scene/yaml/scene_yaml.h"

#include <string>
#include <vector>

using namespace crt;
using crt::test::checkSame;

namespace {

std::string plugin(const std::string& name) {
    return CRT_FAKE_PLUGIN_DIR "/crt_backend_" + name + ".so";
}

struct Search {
    Rendered run;
    std::string log;
};

/// A render on `first`, which looks at the others as soon as it can.
Search searched(const std::string& first, const std::vector<std::string>& others, std::uint64_t samples) {
    const Scene scene =
        parseScene("crt: 1\nfilm: {resolution: [6, 4]}\nenvironment: {radiance: 1}\n", "test", ".");
    RenderOptions options{.backend = plugin(first), .spp = samples, .chunk = 64};
    for (const std::string& name : others) options.search.backends.push_back(plugin(name));
    options.search.after_seconds = 0.02;
    options.search.least_seconds_left = 0.02;
    std::string log;
    const Listener listener([&](LogLevel, std::string_view line) { log += std::string(line) + "\n"; });
    const ListenerScope scope(listener);
    SceneRenderer renderer(scene, options);
    Watch watch;
    Rendered run = renderer.render(planSamples(options, scene, {}), std::nullopt, watch);
    return {std::move(run), log};
}

Film filmOf(std::uint64_t samples) {
    return searched("fake", {}, samples).run.film;
}

bool contains(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("a render goes over to a backend that is faster", "[faster_backend]") {
    // In the trial of the first one there are samples left; the second one renders all that are.
    const std::string other = GENERATE("fake_1_ms", "fake");
    CAPTURE(other);
    const Search search = searched("fake_20_ms", {other}, 600);
    CHECK_FALSE(search.run.failure);
    CHECK(search.run.facts.stop == StopReason::Samples);
    CHECK(search.run.facts.backend_name == other);
    CHECK(search.run.facts.rendered_samples == 600);
    CHECK(search.run.film.samples.count() == 600);
    checkSame(search.run.film, filmOf(600));
    CHECK(contains(search.log, other + " renders "));
    CHECK(contains(search.log, other + " goes on"));
    // The file of the film names both.
    CHECK(contains(search.run.identity.record->backend, "fake_20_ms"));
    CHECK(contains(search.run.identity.record->backend, other + " "));
}

TEST_CASE("a render stays with the fastest backend, whatever the others do", "[faster_backend]") {
    const std::vector<std::string> others{"fake_20_ms", "throws_in_render", "throws_in_create", "no_device",
                                          "absent"};
    const Search search = searched("fake_1_ms", others, 200);
    CHECK_FALSE(search.run.failure);
    CHECK(search.run.facts.backend_name == "fake_1_ms");
    CHECK(search.run.facts.rendered_samples == 200);
    checkSame(search.run.film, filmOf(200));
    CHECK(contains(search.log, "fake_20_ms renders "));
    CHECK_FALSE(contains(search.log, "goes on"));
    CHECK_FALSE(contains(search.run.identity.record->backend, "fake_20_ms"));
}

TEST_CASE("of several backends the fastest goes on", "[faster_backend]") {
    const Search search = searched("fake_20_ms", {"fake_1_ms", "fake"}, 2000);
    CHECK(search.run.facts.backend_name == "fake");
    checkSame(search.run.film, filmOf(2000));
}
