// The code between the command line and the film: words to values, missing samples, the texts of progress,
// and a device that fails in the middle.
#include "backend/loader.h"
#include "base/unit_text.h"
#include "catch.h"
#include "cli/arguments.h"
#include "cli/process/interrupt.h"
#include "cli/process/shell_line.h"
#include "cli/progress.h"
#include "cli/terminal_watch.h"
#include "render/outputs.h"
#include "render/sampling.h"
#include "scene/yaml/scene_yaml.h"

#include <csignal>
#include <cstdlib>

using namespace crt;
using Ranges = std::vector<SampleRange>;

TEST_CASE("durations") {
    CHECK(parseDuration("90", "--time") == 90);
    CHECK(parseDuration("90s", "--time") == 90);
    CHECK(parseDuration("1.5m", "--time") == 90);
    CHECK(parseDuration("2h", "--time") == 7200);
    CHECK(parseDuration("1h30m", "--time") == 5400);
    CHECK(parseDuration("1h0m5s", "--time") == 3605);
    CHECK(parseDuration("250ms", "--time") == Approx(0.25));
    // "1h30" could mean minutes or seconds, "30m1h" is a slip.
    for (const char* text :
         {"", "s", "-5s", "0", "1h30", "30m1h", "5 s", "1e3", "5days", "nan", "inf", "1h1h"})
        CHECK_THROWS_AS(parseDuration(text, "--time"), Error);
}

TEST_CASE("sample ranges, rectangles and counts from text") {
    CHECK(parseSampleRange("0:512", "--samples") == SampleRange{0, 512});
    for (const char* text : {"", ":", "5", "5:5", "6:5", "a:b", "0:1:2", "-1:4"})
        CHECK_THROWS_AS(parseSampleRange(text, "--samples"), Error);
    CHECK(parseRectangle("1,2,30,40", "--crop") == std::array<int, 4>{1, 2, 30, 40});
    for (const char* text : {"", "1,2,3", "1,2,3,4,5", "1,2,3,x", "1,2,3,99999999999"})
        CHECK_THROWS_AS(parseRectangle(text, "--crop"), Error);
    CHECK(parseCount("1e3", "--spp", 1) == 1000);
    CHECK_THROWS_AS(parseCount("0", "--spp", 1), Error);
    CHECK_THROWS_AS(parseCount("1.5", "--spp", 1), Error);
}

TEST_CASE("abbreviated command lines are written out") {
    using Words = std::vector<std::string>;
    const Words commands{"render", "compare", "info"};
    CHECK(writtenOut({"a.yaml"}, commands) == Words{"render", "a.yaml"});
    CHECK(writtenOut({"--backend", "cuda", "a.yaml"}, commands) ==
          Words{"render", "--backend", "cuda", "a.yaml"});
    CHECK(writtenOut({"info", "a.yaml"}, commands) == Words{"info", "a.yaml"});
    CHECK(writtenOut({"--help"}, commands) == Words{"--help"});
    CHECK(writtenOut({"--resume", "a.yaml"}, commands) == Words{"render", "--resume=auto", "a.yaml"});
    CHECK(writtenOut({"a.yaml", "--resume", "b.crtfilm"}, commands) ==
          Words{"render", "a.yaml", "--resume=b.crtfilm"});
    CHECK_THROWS_WITH(writtenOut({"rendr", "a.yaml"}, commands), Contains("did you mean 'render'?"));
}

TEST_CASE("a command line survives the shell") {
    CHECK(shellLine({"crt", "a b.yaml", "--set", "film.resolution=[1,2]", "it's", ""}) ==
          "crt 'a b.yaml' --set 'film.resolution=[1,2]' 'it'\\''s' ''");
}

TEST_CASE("the samples that a film lacks") {
    CHECK(missingSamples({0, 8}, SampleRanges()) == Ranges{{0, 8}});
    CHECK(missingSamples({0, 8}, SampleRanges({{0, 8}})).empty());
    CHECK(missingSamples({0, 8}, SampleRanges({{0, 20}})).empty());
    CHECK(missingSamples({0, 32}, SampleRanges({{4, 8}, {16, 24}})) == Ranges{{0, 4}, {8, 16}, {24, 32}});
    CHECK(missingSamples({6, 18}, SampleRanges({{4, 8}, {16, 24}})) == Ranges{{8, 16}});
}

TEST_CASE("outputs by extension, and the names that follow from them") {
    Scene scene;
    scene.file = "scenes/box.yaml";
    OutputPlan plan = planOutputs({}, scene);
    REQUIRE(plan.images.size() == 2);
    CHECK(plan.images[0].file == "box.exr");
    CHECK(plan.images[1].file == "box.png");
    CHECK(besideOutput(plan.first, ".report.json") == "box.report.json");

    scene.outputs = {{.file = "a.exr", .format = OutputFormat::Exr, .aovs = kAovDepth, .place = {}}};
    plan = planOutputs({"out/b.crtfilm", "out/b.exr", "out/b.PNG"}, scene);
    CHECK(plan.films == std::vector<std::string>{"out/b.crtfilm"});
    REQUIRE(plan.images.size() == 2);
    CHECK(plan.images[0].aovs == kAovDepth);
    CHECK(plan.images[1].aovs == 0);
    CHECK(besideOutput(plan.first, ".crtfilm") == "out/b.crtfilm");
    CHECK_THROWS_AS(planOutputs({"b.tif"}, scene), Error);
    CHECK_THROWS_AS(planOutputs({"b.exr", "./b.exr"}, scene), Error);
}

TEST_CASE("progress: numbers and texts") {
    ProgressState state;
    state.samples = 30;
    state.start_samples = 10;
    state.target = 50;
    state.elapsed_seconds = 20;
    state.pixels = 1'000'000;
    CHECK(state.pathsPerSecond() == Approx(1e6));
    CHECK(state.fraction() == Approx(0.6));
    CHECK(state.secondsLeft() == Approx(20));
    ErrorEstimate error;
    error.relative_rmse = error.half_width_95 = 0.02;
    error.relative_rmse_95 = {0.0196, 0.0204};
    error.knowledge = ErrorKnowledge::Known;
    state.error = error;
    // A fourth of the samples that 1 % takes at 1/sqrt N are there, one a second, and half of those that it
    // takes at 1/N.
    CHECK(progressText(state) ==
          " 60 %  30/50 spp  1.00 Mpaths/s  0:20 left  error 2.00 "
          "% (1.96-2.04)  1 % at 59-130 spp, in 0:29-1:35");
    // A bound forecasts nothing.
    state.error->knowledge = ErrorKnowledge::Bound;
    CHECK(progressText(state) == " 60 %  30/50 spp  1.00 Mpaths/s  0:20 left  error below 2.0 %");
    state.error->knowledge = ErrorKnowledge::NotYet;
    CHECK(progressText(state) == " 60 %  30/50 spp  1.00 Mpaths/s  0:20 left  error not yet known");
    state.error = error;
    state.target_error = 0.02;
    CHECK(progressText(state) == " 60 %  30/50 spp  1.00 Mpaths/s  0:20 left  error 2.00 % (1.96-2.04)");

    SECTION("time can end it first") {
        state.time_limit_seconds = 25;
        CHECK(state.fraction() == Approx(0.8));
        CHECK(state.secondsLeft() == Approx(5));
        state.target = 0;
        CHECK(progressText(state) == " 80 %  30 spp  1.00 Mpaths/s  0:05 left  error 2.00 % (1.96-2.04)");
    }
    SECTION("nothing is claimed at the start") {
        state = {};
        state.target = 64;
        CHECK(progressText(state) == "  0 %  0/64 spp");
    }
    SECTION("the bar fits") {
        for (int columns = 1; columns < 200; ++columns)
            CHECK(static_cast<int>(progressBar(state, columns).size()) < columns);
        CHECK(progressBar(state, 120).substr(0, 42) == "[========================>               ]");
    }
    CHECK(clockText(59.6) == "1:00");
    CHECK(clockText(3 * 3600 + 7 * 60 + 15) == "3:07:15");
    CHECK(rateText(12.34e6, "paths/s") == "12.3 Mpaths/s");
    CHECK(rateText(9.996e6, "paths/s") == "10.0 Mpaths/s");
    CHECK(rateText(870, "paths/s") == "870 paths/s");
    CHECK(durationText(0.85) == "850 ms");
    CHECK(durationText(250) == "4 min 10 s");
    CHECK(percentText(0.0004) == "0.040 %");
}

TEST_CASE("progress of a stage: how far it is, or for how long it has gone on") {
    ProgressState state;
    state.label = "reading bunny.obj";
    state.elapsed_seconds = 63;
    CHECK(progressText(state) == "reading bunny.obj  1:03");
    CHECK(progressBar(state, 120) == "reading bunny.obj  1:03");
    state.target = 1000;
    CHECK(progressText(state) == "  0 %  reading bunny.obj");  // Nothing can be told from nothing.
    state.samples = 250;
    CHECK(progressText(state) == " 25 %  reading bunny.obj  3:09 left");
    CHECK(progressLine(state) == "25 %  reading bunny.obj  3:09 left");
    for (int columns = 1; columns < 200; ++columns)
        CHECK(static_cast<int>(progressBar(state, columns).size()) < columns);
}

TEST_CASE("the first signal is remembered, and the handlers go with the guard") {
    struct sigaction before {};
    sigaction(SIGTERM, nullptr, &before);
    {
        const InterruptGuard guard;
        CHECK(InterruptGuard::signalReceived() == 0);
        std::raise(SIGTERM);
        CHECK(InterruptGuard::signalReceived() == SIGTERM);
        std::raise(SIGTERM);  // At once: still the same wish.
        CHECK(signalExitCode(InterruptGuard::signalReceived()) == 143);
    }
    struct sigaction after {};
    sigaction(SIGTERM, nullptr, &after);
    CHECK(after.sa_handler == before.sa_handler);
}

TEST_CASE("the limit on processor time is exceeded again and again, also while the process ends") {
    struct sigaction before {};
    sigaction(SIGXCPU, nullptr, &before);
    { const InterruptGuard guard; }
    struct sigaction unsent {};
    sigaction(SIGXCPU, nullptr, &unsent);
    CHECK(unsent.sa_handler == before.sa_handler);
    {
        const InterruptGuard guard;
        std::raise(SIGXCPU);
        std::raise(SIGXCPU);
        CHECK(InterruptGuard::signalReceived() == SIGXCPU);
    }
    struct sigaction ignored {};
    sigaction(SIGXCPU, nullptr, &ignored);
    CHECK(ignored.sa_handler == SIG_IGN);
    sigaction(SIGXCPU, &before, nullptr);
}

namespace {

/// The fake backend with a small scene.
struct FakeRun {
    CompiledScene compiled = compileScene(
        parseScene("crt: 1\nfilm: {resolution: [6, 4]}\nenvironment: {radiance: 1}\n", "test", "."), 0);
    LoadedBackend backend = loadBackend(std::string(CRT_FAKE_PLUGIN_DIR) + "/crt_backend_fake.so");
    DeviceGroup group{backend, {}, probeDevices(backend)};
    DeviceFilm devices{group, compiled};
    TerminalWatch watch{ProgressMode::None, TerminalWatch::Signals::Always};

    FakeRun() { devices.setScene(); }
    Film emptyFilm() const {
        return Film(filmShapeOf(compiled));
    }
};

}  // namespace

TEST_CASE("a device that fails in the middle costs little") {
    unsetenv("CRT_FAKE_FAULT");
    FakeRun whole;
    Film reference = whole.emptyFilm();
    CHECK(sampleFilm(whole.devices, reference, {.ranges = {{0, 20}}, .target = 20}, whole.watch, [] {
          }).rendered == 20);

    FakeRun failing;
    Film film = failing.emptyFilm();
    int checkpoints = 0;
    SamplingPlan plan{.ranges = {{0, 20}}, .target = 20, .chunk = 2, .checkpoint_interval_seconds = 1e-9};
    const SamplingResult result = sampleFilm(failing.devices, film, plan, failing.watch, [&] {
        if (++checkpoints == 3) setenv("CRT_FAKE_FAULT", "device", 1);
    });
    unsetenv("CRT_FAKE_FAULT");
    CHECK(result.stop == StopReason::Failed);
    REQUIRE(result.failure);
    CHECK(result.failure->kind() == ErrorKind::Device);
    CHECK(result.rendered == 6);
    CHECK(film.samples.text() == "0-6");

    // Going on from there gives what the undisturbed run gives.
    FakeRun second;
    plan = {.ranges = missingSamples({0, 20}, film.samples), .target = 20};
    CHECK(sampleFilm(second.devices, film, plan, second.watch, [] {}).stop == StopReason::Samples);
    CHECK(film.samples.text() == reference.samples.text());
    for (std::uint32_t y = 0; y < 4; ++y)
        for (std::uint32_t x = 0; x < 6; ++x) CHECK(film.sum(x, y, 1) == reference.sum(x, y, 1));
}

TEST_CASE("a signal stops between chunks") {
    FakeRun run;
    Film film = run.emptyFilm();
    const SamplingPlan plan{
        .ranges = {{0, 20}}, .target = 20, .chunk = 3, .checkpoint_interval_seconds = 1e-9};
    const SamplingResult result =
        sampleFilm(run.devices, film, plan, run.watch, [] { std::raise(SIGINT); });
    CHECK(result.stop == StopReason::Interrupted);
    CHECK(result.request.cause == "SIGINT");
    CHECK(result.request.exit_code == 130);
    CHECK(film.samples.text() == "0-3");
}
