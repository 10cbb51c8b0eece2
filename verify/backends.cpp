// Group L: floating point environment and backends. A backend must give the bits of crt's own portable
// build of the kernel, which is stricter than any tolerance.
#include "verify/context.h"
#include "verify/shapes.h"
#include "verify/variants.h"

#include "kernel/dialect/features.h"

#include <fmt/format.h>

#include <cfenv>
#include <utility>
#if defined(__SSE__)
#include <xmmintrin.h>
#endif

namespace crt::verify {
namespace {

constexpr const char* kRounds =
    "the backend rounds otherwise: contraction, a fast-math flag, its own division or square root, flushed "
    "subnormals, or another triangle test";

void shippedFlags(Context& context) {
    forEachVariant(context, 24, [](Context& c, const Variant& v) {
        c.sameBits(v.name, portableFilm(v.scene, {.samples = 4, .aovs = kAllAovs}),
                   c.render(v.scene, {.samples = 4, .aovs = kAllAovs}), kRounds);
    });
}

void randomNumbers(Context& context) {
    // A slanted plane at the far end of the view: the distance tells the two numbers that placed the sample.
    for (const auto& [what, type] : {std::pair{"Sobol", SamplerType::Sobol},
                                     {"independent", SamplerType::Independent},
                                     {"xorshift", SamplerType::XorShift}}) {
        const int resolution = context.atLeast(Level::Merge) ? 1000 : 100;
        Scene scene = emptyScene(resolution, 0x123456789abcdef0, {0, 0, 0}, {0, 0, 1}, 0.5);
        scene.sampler.type = type;
        scene.integrator.max_depth = 0;
        Mesh plane;
        addTriangle(plane, {-4, -4, 0.25}, {4, -3, 2}, {0, 5, 1});
        addObject(scene, std::move(plane), diffuse(0.5));
        const Render how{.samples = 1, .first_sample = 5, .aovs = kAovDepth};
        context.sameBits(fmt::format("{}: {} pixels", what, resolution * resolution),
                         portableFilm(scene, how), context.render(scene, how),
                         "the sampler's integer words differ");
    }
}

void firstHits(Context& context) {
    Scene scene =
        emptyScene(context.atLeast(Level::Merge) ? 1000 : 150, 1, {0.2, 0.3, -2.5}, {0, 0, 0}, 0.45);
    scene.integrator.max_depth = 0;
    addObject(scene, icosphere(4, 0.9, {0, 0, 0}), diffuse(0.5));
    addObject(scene, boxMesh({-0.95, -0.95, -0.9}, {-0.4, -0.5, 0.9}), diffuse(0.5));
    const Render how{.samples = 1, .aovs = kAovNormal | kAovDepth | kAovPrimitive};
    context.sameBits("primitive, normal and distance", portableFilm(scene, how), context.render(scene, how),
                     kRounds);
}

void radiances(Context& context) {
    forEachVariant(context, context.atLeast(Level::Merge) ? 48 : 16, [](Context& c, const Variant& v) {
        const Render how{.samples = c.atLeast(Level::Merge) ? 64u : 16u};
        c.sameBits(v.name, portableFilm(v.scene, how), c.render(v.scene, how), kRounds);
    });
}

void runToRun(Context& context) {
    const Scene scene = litRoom(64, 1);
    const Film first = context.render(scene, {.samples = 32});
    for (int i = 0; i < 4; ++i)
        context.sameBits(fmt::format("run {}", i + 2), first, context.render(scene, {.samples = 32}),
                         "sums depend on the order of the threads");
}

void lostDevices(Context& context) {
    const Scene scene = litRoom(32, 1);
    const CompiledScene compiled = compileScene(scene, 0);
    const Film expected = context.render(scene, {.samples = 8});
    const auto filmOf = [&](Integrator& integrator) {
        Film film(filmShapeOf(compiled));
        integrator.readFilm(film);
        return film;
    };

    std::string sentence = "none";
    ErrorKind kind = ErrorKind::Internal;
    try {
        IntegratorOptions options;
        options.device = "a device that is not here";
        const Integrator integrator(context.backend(), options);
    } catch (const Error& error) {
        sentence = error.what();
        kind = error.kind();
    }
    context.holds(
        "a device that is not there",
        kind == ErrorKind::Backend && sentence.find("a device that is not here") != std::string::npos,
        "an error of the backend that names it",
        "the wish for a device is dropped, or the failure is not passed on", sentence);

    // Out of time: a render ends when the host requests it, and leaves nothing behind for the next one.
    Integrator integrator(context.backend(), {});
    integrator.setScene(compiled);
    int calls = 0;
    const bool finished =
        integrator.render({.sample_count = 4096}, [&](double) { return ++calls > 0; });
    context.holds("a host that asks for the end", !finished, "the render ends before its time",
                  "the answer of progress() is dropped", fmt::format("progress was called {} times", calls));
    integrator.setScene(compiled);
    integrator.render({.sample_count = 8});
    context.sameBits("the same integrator afterwards", expected, filmOf(integrator),
                     "what was cancelled is still in the film");

    context.notApplicable("a device lost, out of memory, out of time",
                          "asked of the host with a plugin that fails on demand: 'a device that fails in "
                          "the middle costs little' (tests/unit_running.cpp), tests/cli, and CUDA's own "
                          "failures against a simulated driver (tests/unit_cuda_program.cpp)");
}

/// The calling thread's rounding mode and treatment of subnormals, put back at the end.
class OddEnvironment {
public:
    OddEnvironment(int rounding, bool flush) {
        std::fegetenv(&before_);
        std::fesetround(rounding);
#if defined(__SSE__)
        if (flush) _mm_setcsr(_mm_getcsr() | 0x8040);  // FTZ and DAZ
#else
        (void)flush;
#endif
    }
    ~OddEnvironment() { std::fesetenv(&before_); }
    OddEnvironment(const OddEnvironment&) = delete;
    OddEnvironment& operator=(const OddEnvironment&) = delete;

private:
    std::fenv_t before_{};
};

void hostsEnvironment(Context& context) {
    const Scene scene = litRoom(32, 1);
    const CompiledScene compiled = compileScene(scene, 0);
    const auto render = [&](unsigned threads) {
        IntegratorOptions options;
        options.threads = threads;
        Integrator integrator(context.backend(), options);
        integrator.setScene(compiled);
        integrator.render({.sample_count = 8});
        Film film(filmShapeOf(compiled));
        integrator.readFilm(film);
        return film;
    };
    const Film expected = render(0);
    const auto ask = [&](const char* what, int rounding, bool flush, unsigned threads) {
        const Film film = [&] {
            const OddEnvironment odd(rounding, flush);
            return render(threads);
        }();
        context.sameBits(what, expected, film,
                         "the backend computes in the rounding mode of the thread that called it");
    };
    ask("the host rounds upwards", FE_UPWARD, false, 0);
    ask("the host rounds to zero, on one thread", FE_TOWARDZERO, false, 1);
    ask("the host flushes subnormals, on one thread", FE_TONEAREST, true, 1);
}

}  // namespace

std::vector<Case> backendCases() {
    const auto sameBits = [](const char* id, const char* case_name, const char* title, const char* expected,
                             const char* source, std::uint64_t needs, void (*run)(Context&)) {
        return row(id, case_name, title, expected, source, "same bits", Level::Commit, needs, run);
    };
    constexpr const char* kPortable = "crt's own portable build of the kernel";
    return {
        sameBits("L01", "shipped-flags", "Every feature, under the flags that the backend ships with",
                 "the portable build's image, with all AOVs", kPortable, 0, shippedFlags),
        sameBits("L02", "random-numbers", "10^6 numbers of each sampler (10^4 on commits)",
                 "the portable build's", kPortable, CRT_FEATURE_AOV, randomNumbers),
        sameBits("L03", "first-hits", "10^6 first hits on a sphere and a box: primitive, normal, distance",
                 "the portable build's", kPortable, CRT_FEATURE_BVH | CRT_FEATURE_AOV, firstHits),
        sameBits("L04", "radiances", "Every feature, the same seed", "the portable build's radiances",
                 kPortable, 0, radiances),
        sameBits("L05", "run-to-run", "The same render five times", "the same image",
                 "docs/architecture.md, Same bits", CRT_FEATURE_BVH | CRT_FEATURE_NEE, runToRun),
        sameBits("L06", "lost-devices", "A device that is lost, or out of memory or time",
                 "a clean error, and what there was is kept", "docs/architecture.md, Exit codes", 0,
                 lostDevices),
        sameBits("L07", "hosts-environment", "A host that rounds upwards, to zero, or flushes subnormals",
                 "the same image", "the backend sets what it needs", CRT_FEATURE_BVH | CRT_FEATURE_NEE,
                 hostsEnvironment),
    };
}

}  // namespace crt::verify
