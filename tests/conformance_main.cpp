// crt_conformance --backend NAME [--against NAME] [--lean-kernels] [--no-cache] [Catch2 options]: the border
// and the bits of every backend.
// crt_conformance verify OPTIONS: scenes whose answer is known, for `crt verify` (verify/program.h).
//
// Exit code 77 and one sentence when the backend cannot run here, so that a machine without a GPU skips
// visibly.
#include "conformance.h"

#include "base/error.h"
#include "base/listener.h"
#include "catch_runner.h"
#include "cli/process/run_main.h"
#include "render/session.h"
#include "verify/program.h"

#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <string_view>

namespace conformance {
namespace {

std::string backend_name = "embree";
std::string reference_name;
bool lean_kernels = false;
bool no_cache = false;
std::string lean_stride = "1";
constexpr int kSkipped = 77;

/// The backend of that name, where it is another than the one under test and runs here.
std::optional<crt::LoadedBackend> other(const char* name) {
    try {
        crt::LoadedBackend loaded = crt::loadBackend(name);
        if (loaded.name == backend().name) return std::nullopt;
        crt::probeDevices(loaded);
        return loaded;
    } catch (const crt::Error&) {
        return std::nullopt;  // Perhaps the next.
    }
}

crt::LoadedBackend chooseReference() {
    for (const char* name : {"example", "embree", "opencl", "cuda"})
        if (std::optional<crt::LoadedBackend> found = other(name)) {
            std::printf("bits are compared with those of '%s'; --against names another\n",
                        found->name.c_str());
            return *found;
        }
    throw crt::Error(crt::ErrorKind::Backend,
                     "no other backend can run here, to compare bits with; name one with --against");
}

}  // namespace

const crt::LoadedBackend& backend() {
    static const crt::LoadedBackend loaded = crt::loadBackend(backend_name);
    return loaded;
}

const crt::LoadedBackend& reference() {
    static const crt::LoadedBackend loaded =
        reference_name.empty() ? chooseReference() : crt::loadBackend(reference_name);
    return loaded;
}

crt::Scene sceneFrom(const std::string& yaml, const std::vector<crt::SceneOverride>& overrides) {
    return crt::parseScene(yaml, "conformance.yaml", ".", overrides);
}

bool leanKernels() { return lean_kernels; }

std::size_t leanStride() { return std::max(std::stoul(lean_stride), 1ul); }

crt::Film render(const crt::LoadedBackend& with, const crt::Scene& scene, const Run& run,
                 CrtBackendReport* report) {
    crt::IntegratorOptions options = run.options;
    options.use_cache = options.use_cache && !no_cache;
    crt::Session session(with, options);
    crt::Film film = crt::renderFilm(
        session, scene, {.samples = run.samples, .first_sample = run.first_sample, .aovs = run.aovs});
    if (report != nullptr) *report = session.report();
    return film;
}

std::uint64_t differingPixels(const crt::Film& a, const crt::Film& b, bool all) {
    REQUIRE(a.shape() == b.shape());
    std::uint64_t differing = 0;
    const std::uint32_t channels = all ? a.shape().channels : 3;
    for (std::uint32_t y = 0; y < a.shape().height; ++y)
        for (std::uint32_t x = 0; x < a.shape().width; ++x) {
            const std::size_t pixel = static_cast<std::size_t>(y) * a.shape().width + x;
            bool same = a.counts[pixel] == b.counts[pixel] &&
                        (a.primitives.empty() || a.primitives[pixel] == b.primitives[pixel]);
            for (std::uint32_t c = 0; c < channels; ++c)
                same = same && static_cast<float>(a.mean(x, y, c)) == static_cast<float>(b.mean(x, y, c));
            for (std::size_t w = 0, words = a.shape().splatWords(); w < words; ++w)
                same = same && a.splats[pixel * words + w] == b.splats[pixel * words + w];
            differing += same ? 0 : 1;
        }
    return differing;
}

double imageMean(const crt::Film& film) {
    double sum = 0;
    for (std::uint32_t y = 0; y < film.shape().height; ++y)
        for (std::uint32_t x = 0; x < film.shape().width; ++x) sum += film.mean(x, y, 1);
    return sum / (static_cast<double>(film.shape().width) * film.shape().height);
}

}  // namespace conformance

int main(int argc, char** argv) {
    if (argc > 1 && std::string_view(argv[1]) == "verify")
        return crt::runMain([&] { return crt::verify::runSuite({argv + 2, argv + argc}); });
    const crt::Listener listener(crt::standardErrorSink(), crt::LogLevel::Error);
    const crt::ListenerScope scope(listener);
    const auto probe = [] {
        try {
            crt::probeDevices(conformance::backend());
            return 0;
        } catch (const crt::Error& error) {
            std::printf("SKIPPED: backend '%s' cannot run here: %s\n", conformance::backend_name.c_str(),
                        error.what());
            return conformance::kSkipped;
        }
    };
    return runTests(
        argc, argv,
        {{"--backend", "backend under test, or a path to its .so", &conformance::backend_name},
         {"--against", "backend to compare bits with", &conformance::reference_name},
         {"--lean-kernels", "the backend must have lean kernels", nullptr, &conformance::lean_kernels},
         {"--lean-stride", "compare the lean kernel of every N-th scene alone", &conformance::lean_stride},
         {"--no-cache", "do not keep compiled kernels on disk", nullptr, &conformance::no_cache}},
        probe);
}
