#include "base/parallel.h"
#include "base/standard_output.h"
#include "cli/commands.h"
#include "cli/shared_options.h"
#include "render/outputs.h"
#include "render/session.h"

#include <fmt/format.h>

#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace crt {
namespace {

struct State {
    std::vector<std::string> files;
    SceneRequest changes;  ///< In each of them.
    std::string backend = "auto";
    IntegratorOptions integrator{};
};

/// Origin of the backend's kernels.
std::string kernelText(const CrtBackendReport& report) {
    if (report.kernel_from_cache != 0) return "from the cache";
    if (report.compile_seconds > 0) return fmt::format("compiled in {:.1f} s", report.compile_seconds);
    return "nothing to compile";
}

/// One sample of one pixel: what is compiled for it serves the scene in every size.
std::string warm(const State& state, const std::string& file) {
    SceneRequest request = state.changes;
    request.file = file;
    Scene scene = loadScene(request);
    scene.film.crop = {0, 0, 1, 1};
    Session session(state.backend, state.integrator);
    (void)renderFilm(session, scene, {.samples = 1, .aovs = requestedAovs(scene)});
    const CrtBackendReport report = session.report();
    return fmt::format("{}: {} on {}: {}, {}\n", file, session.backend().name,
                       arrayText(report.device), arrayText(report.kernel), kernelText(report));
}

/// All of them, several at a time: compilers take one processor each.
int warmAll(const State& state) {
    std::mutex printing;
    runWithThreads(state.integrator.threads, [&] {
        parallelFor(state.files.size(), 1, [&](std::size_t first, std::size_t end) {
            for (std::size_t i = first; i < end; ++i) {
                const std::string said = warm(state, state.files[i]);
                const std::lock_guard lock(printing);
                printText(said);
                flushStandardOutput();
            }
        });
    });
    return 0;
}

OptionGroup options(State& state) {
    OptionGroup group{"Options"};
    group.options = {backendOption(state.backend), deviceOption(state.integrator),
                     threadsOption(state.integrator)};
    addSceneChanges(group, state.changes);
    std::erase_if(group.options, [](const Option& option) { return option.names == "--crop"; });
    return group;
}

constexpr const char* kWarmNotes =
            "\nA backend compiles a kernel for the features of a scene, and keeps it on disk: in "
            "CRT_CACHE_DIR, or in the folder crt of XDG_CACHE_HOME or of ~/.cache. The first render with "
            "new features waits for the compiler, or begins with a slower kernel. This command compiles "
            "now, so that no render has to wait: after an installation, or before a job that many machines "
            "begin at the same time.\n"
            "Kernels depend on the features of a scene, on its AOVs and on the device, and neither on "
            "values nor on the size of the image.\n"
            "\nExamples:\n"
            "  crt warm scene.yaml\n"
            "  crt warm -b opencl configs/*.yaml\n";

}  // namespace

Command warmCommand() {
    const auto state = std::make_shared<State>();
    state->integrator.kernel = CRT_KERNEL_LEAN_ONLY;
    return {.name = "warm",
            .summary = "compile the kernels of scenes before they are rendered",
            .arguments = {{.name = "SCENE",
                           .help = "scene files (YAML), or models",
                           .read = [state](const std::string& text) { state->files.push_back(text); },
                           .completion = completeScene(),
                           .repeatable = true}},
            .groups = {options(*state)},
            .notes = kWarmNotes,
            .run = [state](const std::string&) { return warmAll(*state); }};
}

}  // namespace crt
