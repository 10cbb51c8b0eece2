// libcrt as a program sees it: this file includes none of the rooms' headers, and links libcrt.so alone.
#include "catch.h"
#include "catch_runner.h"

#include <crt/crt.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <future>
#include <limits>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

namespace {

/// A lamp that lights a floor; and one that lights nothing, of which crt warns by name.
std::string lampYaml(const std::string& idle, const char* more = "") {
    return "crt: 1\n"
           "film: {resolution: [24, 16]}\n"
           "camera: {position: [0, 1, 3], target: [0, 0, 0], fov: 60}\n"
           "materials: {grey: {type: diffuse, reflectance: 0.5}}\n"
           "objects:\n"
           "  - {name: floor, material: grey, mesh: {positions: [[-5, 0, 5], [5, 0, 5], [5, 0, -5], [-5, 0, "
           "-5]], "
           "faces: [[0, 1, 2, 3]]}}\n"
           "  - {name: lamp, material: grey, emission: {radiance: 5}, mesh: {positions: [[-1, 2, 0], [-1, "
           "2, 1], [1, 2, 1], [1, 2, 0]], faces: [[3, 2, 1, 0]]}}\n"
           "  - {name: " +
           idle +
           ", material: grey, emission: {radiance: 5}, mesh: {positions: "
           "[[-1, -9, 0], [-1, -9, 1], [1, -9, 1], "
           "[1, -9, 0]], faces: [[3, 2, 1, 0]]}}\n" +
           more;
}

crt::RenderOptions withSamples(std::uint64_t samples) {
    crt::RenderOptions options;
    options.backend = CRT_TEST_BACKEND;
    options.samples = samples;
    return options;
}

/// Lets two threads go on when both have come, or after two seconds.
struct Together {
    std::atomic<int> arrived{0};
    void wait() {
        ++arrived;
        const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(2);
        while (arrived < 2 && std::chrono::steady_clock::now() < end) std::this_thread::yield();
    }
};

struct Heard : crt::Watch {
    Together* together = nullptr;  ///< Waited for at the first stage.
    std::vector<std::string> warnings, stages;
    double most_samples = 0, samples_wanted = 0;
    int stop_after = std::numeric_limits<int>::max();

    void progress(const crt::Progress& now) override {
        most_samples = std::max(most_samples, now.samples);
        samples_wanted = static_cast<double>(now.samples_wanted);
    }
    bool stop() override { return --stop_after < 0; }
    void stage(std::string_view what) override {
        stages.emplace_back(what);
        if (together != nullptr) std::exchange(together, nullptr)->wait();
    }
    void message(crt::MessageLevel level, std::string_view text) override {
        if (level == crt::MessageLevel::Warning) warnings.emplace_back(text);
    }
};

bool sameMeans(const crt::Film& a, const crt::Film& b) {
    if (a.width() != b.width() || a.height() != b.height()) return false;
    for (std::uint32_t y = 0; y < a.height(); ++y)
        for (std::uint32_t x = 0; x < a.width(); ++x)
            if (a.mean(x, y) != b.mean(x, y) || a.count(x, y) != b.count(x, y)) return false;
    return true;
}

/// The kind of the error that `body` ends with; 0 without one.
template <class Body>
int kindOf(Body&& body) {
    try {
        body();
    } catch (const crt::Error& error) {
        CHECK(error.what()[0] != '\0');
        return static_cast<int>(error.kind());
    }
    return 0;
}

/// A folder of this process, removed at the end.
struct Folder {
    std::filesystem::path path;
    Folder() {
        // mkdtemp replaces the last six letters.
        std::string name =
            (std::filesystem::temp_directory_path() / ("libcrt-" + std::string(6, 'X'))).string();
        REQUIRE(mkdtemp(name.data()) != nullptr);
        path = name;
    }
    ~Folder() { std::filesystem::remove_all(path); }
    std::string operator/(const char* name) const { return (path / name).string(); }
};

}  // namespace

TEST_CASE("a scene in memory becomes an image") {
    Heard heard;
    const crt::Scene scene =
        crt::Scene::fromText(lampYaml("idle"), {{"film.resolution", "[32, 20]"}}, &heard);
    CHECK(scene.width() == 32);
    CHECK(scene.height() == 20);
    const crt::Rendered rendered = crt::render(scene, withSamples(32), &heard);
    CHECK(rendered.stop == crt::StopReason::Samples);
    CHECK(rendered.film.samples() == 32);
    CHECK(rendered.report_json.find("\"per_pixel\": 32") != std::string::npos);
    CHECK(rendered.report_json.find("\"error\": null") == std::string::npos);
    crt::RenderOptions without = withSamples(32);
    without.estimate_error = false;
    Heard other;
    const crt::Rendered part = crt::render(scene, without, &other);
    CHECK(part.report_json.find("\"error\": null") != std::string::npos);
    CHECK(part.film.error().has_value());
    CHECK(heard.most_samples == 32);
    CHECK(heard.samples_wanted == 32);
    REQUIRE(heard.warnings.size() == 1);
    CHECK(heard.warnings[0].find("idle") != std::string::npos);
    CHECK(heard.stages.front() == "reading scene");
    CHECK(heard.stages.size() > 2);
    REQUIRE(rendered.film.error());
    CHECK(rendered.film.error()->relative_rmse > 0);

    const crt::Image image = rendered.film.develop();
    CHECK(image.channels() == std::vector<std::string>{"R", "G", "B"});
    CHECK(image.pixels().size() == 32 * 20 * 3);
    CHECK(image.plane("G")[32 * 15 + 16] == image.pixels()[3 * (32 * 15 + 16) + 1]);
    CHECK(image.plane("G")[32 * 15 + 16] > 0);
    CHECK(kindOf([&] { image.plane("Z"); }) == 2);
    crt::DevelopOptions brighter;
    brighter.exposure_ev = 1;
    CHECK(rendered.film.develop(brighter).plane("G")[500] == Approx(2 * image.plane("G")[500]));

    const Folder folder;
    rendered.film.saveImage(folder / "image.pfm");
    CHECK(crt::Image::load(folder / "image.pfm").pixels() == image.pixels());
    image.save(folder / "copy.pfm");
    CHECK(crt::Image::load(folder / "copy.pfm").pixels() == image.pixels());
    // Through the codec module, which libcrt finds beside itself.
    rendered.film.saveImage(folder / "image.png");
    CHECK(crt::Image::load(folder / "image.png").width() == 32);
}

TEST_CASE("integer planes of an image have values of their own") {
    Heard quiet;
    const crt::Scene scene =
        crt::Scene::fromText(lampYaml("idle", "outputs: [{file: a.exr, aovs: [samples, depth]}]\n"));
    const crt::Film film = crt::render(scene, withSamples(3), &quiet).film;
    crt::DevelopOptions with_aovs;
    with_aovs.aovs = {"samples", "depth"};
    const crt::Image image = film.develop(with_aovs);
    CHECK(image.channels() == std::vector<std::string>{"R", "G", "B", "Z"});
    REQUIRE(image.integerChannels().size() == 1);
    CHECK(image.integers() == std::vector<std::uint32_t>(24 * 16, 3));
    CHECK(film.develop().integers().empty());
}

TEST_CASE("a composed scene is the same scene, wherever it is read") {
    const Folder folder;
    std::filesystem::create_directories(folder / "parts");
    std::ofstream(folder / "parts/room.yaml") << lampYaml("idle");
    std::ofstream(folder / "parts/square.obj") << "v -1 0 0\nv 1 0 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n";
    std::ofstream(folder / "parts/more.yaml")
        << "crt: 1\nobjects: [{name: board, material: grey, obj: square.obj}]\n";
    std::ofstream(folder / "user.yaml") << "crt: 1\ninclude: [parts/room.yaml, parts/more.yaml]\n"
                                           "title: '1\"2'\ncamera: {fov: +5.e1, aperture_radius: .125}\n"
                                           "materials: {blue: &blue {type: diffuse, reflectance: 1E-1}}\n"
                                           "integrator: {nee: true}\n";
    const std::vector<crt::SceneOverride> overrides = {
        {"film.resolution", "[12, 8]"}, {"materials.grey", "{type: diffuse, reflectance: 0.25}"}};
    Heard quiet;
    const std::string text = crt::Scene::composeFile(folder / "user.yaml", overrides, &quiet);
    for (const std::string part : {"\"fov\": 50,", "\"aperture_radius\": 0.125", "\"title\": \"1\\\"2\"",
                                   "\"reflectance\": 1E-1", "\"nee\": true", "\"resolution\": [12, 8]"}) {
        CAPTURE(text, part);
        CHECK(text.find(part) != std::string::npos);
    }
    CHECK(text.find("\"obj\": \"" + (folder / "parts/square.obj") + "\"") != std::string::npos);
    CHECK(text.find("include") == std::string::npos);
    const crt::Scene scene = crt::Scene::fromFile(folder / "user.yaml", overrides, &quiet);
    const crt::Scene again = crt::Scene::fromText(text, {}, &quiet, "scene", "/");
    CHECK(again.title() == scene.title());
    CHECK(sameMeans(crt::render(again, withSamples(4), &quiet).film,
                    crt::render(scene, withSamples(4), &quiet).film));
    CHECK(crt::Scene::composeText(text, {}, &quiet) == text);
    CHECK(kindOf([&] { crt::Scene::composeFile(folder / "none.yaml"); }) == 3);
    CHECK(kindOf([&] { crt::Scene::composeText("crt: 1\nfilm: 3\n"); }) == 3);
}

TEST_CASE("parts of a film make the whole") {
    const crt::Scene scene = crt::Scene::fromText(lampYaml("idle"));
    Heard quiet;
    const crt::Film whole = crt::render(scene, withSamples(20), &quiet).film;
    const auto part = [&](std::uint64_t first, std::uint64_t end) {
        crt::RenderOptions options = withSamples(0);
        options.sample_range = {{first, end}};
        return crt::render(scene, options, &quiet).film;
    };
    crt::Film sum = part(8, 20);
    const Folder folder;
    sum.save(folder / "part.crtfilm");
    CHECK(sameMeans(crt::Film::load(folder / "part.crtfilm"), sum));
    CHECK(!sameMeans(sum, whole));
    const crt::Film copy = sum;
    sum.merge(part(0, 8));
    CHECK(sum.sampleRanges() == std::vector<std::pair<std::uint64_t, std::uint64_t>>{{0, 20}});
    CHECK(sameMeans(sum, whole));
    CHECK(copy.samples() == 12);
    CHECK(kindOf([&] { sum.merge(part(5, 6)); }) == 2);
    CHECK(sameMeans(sum, whole));
    CHECK(kindOf([&] {
              sum.merge(crt::render(crt::Scene::fromText(lampYaml("idle", "sampler: {seed: 5}\n")),
                                    withSamples(2), &quiet)
                            .film);
          }) == 2);

    // And from a film on.
    const crt::Rendered finished = crt::render(scene, copy, withSamples(20), &quiet);
    CHECK(sameMeans(finished.film, whole));
    CHECK(kindOf([&] { sum.mean(24, 0); }) == 1);
}

TEST_CASE("renders of a session open and compile once, and give the bits of renders alone") {
    const crt::Scene scene =
        crt::Scene::fromText(lampYaml("idle", "sampler: {type: independent, replicates: 1}\n"));
    Heard quiet;
    const crt::Film whole = crt::render(scene, withSamples(20), &quiet).film;
    crt::Session session(scene);
    const auto part = [&](std::uint64_t first, std::uint64_t end, crt::Watch* watch) {
        crt::RenderOptions options = withSamples(0);
        options.sample_range = {{first, end}};
        return session.render(options, watch).film;
    };
    const auto opens = [](const Heard& heard) {
        return std::count(heard.stages.begin(), heard.stages.end(), "opening the backend");
    };
    Heard first, second, other, again, thrown_after;
    crt::Film sum = part(8, 20, &first);
    CHECK(opens(first) == 1);
    CHECK(first.warnings.size() == 1);
    sum.merge(part(0, 8, &second));
    CHECK(opens(second) == 0);
    CHECK(second.warnings.empty());  // The idle lamp is named once.
    CHECK(sameMeans(sum, whole));

    // A target error needs replicates, which this scene leaves out, and so another scene.
    crt::RenderOptions target = withSamples(20);
    target.target_error = 1e-6;
    session.render(target, &other);
    CHECK(sameMeans(session.render(withSamples(20), &again).film, whole));
    CHECK(opens(other) == 1);
    CHECK(opens(again) == 1);

    struct Thrower : Heard {
        void progress(const crt::Progress&) override { throw std::string("mine"); }
    } thrower;
    CHECK_THROWS_AS(session.render(withSamples(4), &thrower), std::string);
    CHECK(sameMeans(session.render(withSamples(20), &thrown_after).film, whole));
    CHECK(sameMeans(session.render(crt::Film(sum), withSamples(20), &quiet).film, whole));
    CHECK(kindOf([&] {
              crt::RenderOptions nowhere = withSamples(4);
              nowhere.backend = "nowhere";
              session.render(nowhere, &quiet);
          }) != 0);
    CHECK(sameMeans(session.render(withSamples(20), &quiet).film, whole));
}

TEST_CASE("a watch stops a render, which keeps what it has") {
    const crt::Scene scene = crt::Scene::fromText(lampYaml("idle"));
    Heard heard;
    heard.stop_after = 1;
    const crt::Rendered rendered = crt::render(scene, withSamples(1'000'000), &heard);
    CHECK(rendered.stop == crt::StopReason::Watch);
    CHECK(rendered.film.samples() > 0);
    CHECK(rendered.film.samples() < 1'000'000);

    struct Thrower : Heard {
        void progress(const crt::Progress&) override { throw std::string("mine"); }
    } thrower;
    CHECK_THROWS_AS(crt::render(scene, withSamples(4), &thrower), std::string);
}

TEST_CASE("two renders at once hear their own watch and give their own bits") {
    const crt::Scene left = crt::Scene::fromText(lampYaml("idle_left")),
                     right = crt::Scene::fromText(lampYaml("idle_right", "sampler: {seed: 7}\n"));
    Heard left_alone, right_alone;
    const crt::Film left_film = crt::render(left, withSamples(100), &left_alone).film,
                    right_film = crt::render(right, withSamples(150), &right_alone).film;
    CHECK(!sameMeans(left_film, right_film));
    for (int round = 0; round < 5; ++round) {
        Together together;
        Heard left_heard, right_heard;
        left_heard.together = right_heard.together = &together;
        auto other = std::async(std::launch::async,
                                [&] { return crt::render(right, withSamples(150), &right_heard).film; });
        const crt::Film left_again = crt::render(left, withSamples(100), &left_heard).film;
        CHECK(sameMeans(other.get(), right_film));
        CHECK(sameMeans(left_again, left_film));
        CHECK(left_heard.most_samples == 100);
        CHECK(right_heard.most_samples == 150);
        CHECK(left_heard.warnings == left_alone.warnings);
        CHECK(right_heard.warnings == right_alone.warnings);
        CHECK(left_heard.stages == left_alone.stages);
    }
    REQUIRE(left_alone.warnings.size() == 1);
    CHECK(left_alone.warnings != right_alone.warnings);
}

TEST_CASE("errors have a kind and a place") {
    try {
        crt::Scene::fromText("crt: 1\nfilm: {resolutoin: [4, 4]}\n", {}, nullptr, "mine.yaml");
        FAIL("accepted");
    } catch (const crt::Error& error) {
        CHECK(error.kind() == crt::ErrorKind::Scene);
        CHECK_THAT(error.what(), Contains("mine.yaml:2:8: error:") && Contains("resolution"));
        CHECK(error.place().file == "mine.yaml");
        CHECK(error.place().line == 2);
        CHECK(error.place().column == 8);
    }
    CHECK(kindOf([] { crt::Scene::fromFile("/no_such_folder/scene.yaml"); }) == 3);
    CHECK(kindOf([] { crt::Film::load("/no_such_folder/film.crtfilm"); }) == 2);
    const crt::Scene scene = crt::Scene::fromText(lampYaml("idle"));
    Heard quiet;
    crt::RenderOptions options = withSamples(4);
    options.backend = "no_such_backend";
    CHECK(kindOf([&] { crt::render(scene, options, &quiet); }) == 4);
    options = withSamples(4);
    options.sample_range = {{0, 4}};
    CHECK(kindOf([&] { crt::render(scene, options, &quiet); }) == 2);
    for (const double wrong : {-1.0, std::nan("")}) {
        options = withSamples(4);
        options.time_limit_seconds = wrong;
        CHECK(kindOf([&] { crt::render(scene, options, &quiet); }) == 2);
        options = withSamples(4);
        options.target_error = wrong;
        CHECK(kindOf([&] { crt::render(scene, options, &quiet); }) == 2);
    }
    const crt::Film film = crt::render(scene, withSamples(2), &quiet).film;
    CHECK(kindOf([&] { film.saveImage("/no_such_folder/image.png"); }) == 6);
    CHECK(kindOf([&] { film.saveImage("image.gif"); }) == 2);
    CHECK(kindOf([&] { film.save("/no_such_folder/film.crtfilm"); }) == 6);
}

TEST_CASE("a device that fails leaves the film of what was rendered") {
    const crt::Scene scene =
        crt::Scene::fromText("crt: 1\nfilm: {resolution: [6, 4]}\nenvironment: {radiance: 1}\n");
    crt::RenderOptions options = withSamples(1'000'000);
    options.backend = CRT_FAKE_PLUGIN_DIR "/crt_backend_fake.so";
    struct Failing : Heard {
        bool stop() override {
            if (most_samples > 10) setenv("CRT_FAKE_FAULT", "device", 1);
            return false;
        }
    } failing;
    try {
        crt::render(scene, options, &failing);
        FAIL("the fake device did not fail");
    } catch (const crt::RenderFailed& failed) {
        CHECK(failed.kind() == crt::ErrorKind::Device);
        CHECK(failed.film().width() == 6);
    }
    unsetenv("CRT_FAKE_FAULT");
}

TEST_CASE("plugins are listed, with why one cannot run") {
    bool has_cuda = false;
    for (const crt::Plugin& plugin : crt::listPlugins()) {
        has_cuda |= plugin.name == "cuda";
        CHECK((plugin.devices.empty() != plugin.reason.empty()));
    }
    CHECK(has_cuda);
    CHECK(std::string(crt::version()).find('.') != std::string::npos);
    CHECK(crt::bitsVersion() > 0);
}

int main(int argc, char** argv) {
    return runTests(argc, argv);
}
