#include "base/log.h"
#include "base/parallel.h"
#include "base/words.h"
#include "cli/arguments.h"
#include "cli/commands.h"
#include "cli/process/report_page.h"
#include "cli/shared_options.h"
#include "cli/terminal_watch.h"
#include "judge/converge/engine.h"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace crt {
namespace {

struct State {
    converge::ConvergeRequest request;
    SceneRequest changes;            ///< Of every scene.
    std::vector<std::string> files;
    ProgressMode progress = ProgressMode::Auto;
};

OptionGroup what(State& state) {
    converge::ConvergeRequest& request = state.request;
    OptionGroup group{"Measurement"};
    group.options = {
        {.names = "--backends",
         .placeholder = "X,Y",
         .help = "backends to measure; those that cannot run are left out and reported (embree,opencl,cuda)",
         .read = [&request](const std::string& text) { request.backends = parseList(text, "--backends"); },
         .completion = {Completion::Kind::Backend}},
        {.names = "--vary",
         .placeholder = "KEY=A,B",
         .help = "measure the scene with each value of KEY; several --vary give all combinations. KEY is "
                 "sampler, replicates, nee, roulette, depth, accelerator, filter or any key of the scene",
         .read = [&request](const std::string& text) { request.vary.push_back(converge::parseVary(text)); },
         .repeatable = true},
        {.names = "--reference",
         .placeholder = "FILE",
         .help = "file from 'crt reference' for its scene, or a number: the luminance of every pixel; "
                 "repeatable",
         .read = [&request](const std::string& text) { request.references.push_back(text); },
         .completion = completeFile({"exr"}),
         .repeatable = true},
        {.names = "--time",
         .placeholder = "DURATION",
         .help = "total time (60s)",
         .read = [&request](const std::string& text) { request.seconds = parseDuration(text, "--time"); }},
        {.names = "--replicates",
         .placeholder = "R",
         .help = "minimum number of seeds per configuration (16); more if there is time",
         .read = [&request](const std::string& text) {
             request.replicates = smallCount(text, "--replicates", 2);
         }},
        {.names = "--max-spp",
         .placeholder = "N",
         .help = "maximum number of samples per pixel",
         .read = [&request](const std::string& text) {
             request.max_samples = parseCount(text, "--max-spp", 1);
         }},
        {.names = "--resolution",
         .placeholder = "N",
         .help = "longer side in pixels (128); 0: as in the scene; --set film.resolution overrides it",
         .read = [&request](const std::string& text) {
             request.resolution = static_cast<int>(smallCount(text, "--resolution", 0));
         }},
    };
    addSceneChanges(group, state.changes);
    return group;
}

OptionGroup where(State& state) {
    converge::ConvergeRequest& request = state.request;
    return {"Device and output",
            {deviceOption(request.integrator), threadsOption(request.integrator),
             {.names = "-o,--output",
              .placeholder = "DIR",
              .help = "folder for results, maps and their page, report.html (converge)",
              .read = [&request](const std::string& text) { request.output = text; },
              .completion = {Completion::Kind::Folder}},
             {.names = "--resume",
              .placeholder = {},
              .help = "continue the run in that folder, with the same experiment",
              .read = [&request](const std::string&) { request.resume = true; }},
             noProgressOption(state.progress)}};
}

constexpr const char* kConvergeNotes =
            "\nRenders every scene with every backend and variant, repeatedly with different seeds, "
            "measures the error at 1, 2, 4 ... samples, and writes\n"
            "one page: error against seconds with its interval, efficiency, bias, reliability of the "
            "images' own error estimates, and time by stage.\n"
            "Without --reference, a quarter of --time is spent on making one.\n"
            "docs/error.md explains the terms. Python makes the page, with jinja2 and matplotlib; "
            "'python -m crt report DIR' does it later.\n"
            "\nExamples:\n"
            "  crt converge configs/cornell_box.yaml --backends embree,opencl --time 60s -o converge_box\n"
            "  crt converge scene.yaml --vary sampler=sobol,independent --vary nee=true,false --reference "
            "ref.exr\n"
            "  crt converge configs/analytic/direct_light.yaml --reference 0.2394564705\n"
            "  crt converge a.yaml b.yaml c.yaml --time 10m -o night       "
            "then, cut short: the same with --resume\n";

int run(State& state, const std::string& typed) {
    for (const std::string& file : state.files) {
        SceneRequest scene = state.changes;
        scene.file = file;
        state.request.scenes.push_back(std::move(scene));
    }
    state.request.command = typed;
    TerminalWatch watch(state.progress, TerminalWatch::Signals::Always);
    const int code = converge::converge(state.request, watch);
    const std::filesystem::path folder(state.request.output);
    if (std::filesystem::exists(folder / "summary.json")) {
        if (const std::optional<std::string> missing = makeReportPage(state.request.output))
            logWarning("{}", *missing);
        else
            logInfo("wrote {}", (folder / "report.html").string());
    }
    return code;
}

}  // namespace

Command convergeCommand() {
    const auto state = std::make_shared<State>();
    return {.name = "converge",
            .summary = "measure error against run time; exit code 7 when a backend is wrong",
            .arguments = {{.name = "SCENE",
                           .help = "scene files (YAML)",
                           .read = [state](const std::string& text) { state->files.push_back(text); },
                           .completion = completeScene(),
                           .repeatable = true}},
            .groups = {what(*state), where(*state)},
            .notes = kConvergeNotes,
            .run = [state](const std::string& typed) {
                return resultWithThreads(state->request.integrator.threads,
                                         [&] { return run(*state, typed); });
            }};
}

}  // namespace crt
