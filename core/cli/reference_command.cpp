#include "cli/arguments.h"
#include "cli/commands.h"
#include "cli/shared_options.h"
#include "cli/terminal_watch.h"
#include "judge/converge/reference.h"

#include <memory>
#include <string>

namespace crt {
namespace {

struct State {
    converge::ReferenceRequest request;
    ProgressMode progress = ProgressMode::Auto;
};

OptionGroup options(State& state) {
    converge::ReferenceRequest& request = state.request;
    OptionGroup group{"Options"};
    group.options = {
        {.names = "-o,--output",
         .placeholder = "FILE",
         .help = ".exr",
         .read = [&request](const std::string& text) { request.output = text; },
         .completion = completeFile({"exr"}),
         .required = true},
        {.names = "--spp",
         .placeholder = "N",
         .help = "samples per pixel, instead of --time",
         .read = [&request](const std::string& text) { request.samples = parseCount(text, "--spp", 8); }},
        {.names = "--time",
         .placeholder = "DURATION",
         .help = "approximate time (60s)",
         .read = [&request](const std::string& text) { request.seconds = parseDuration(text, "--time"); }},
        {.names = "--same-estimator",
         .placeholder = {},
         .help = "keep integrator.nee as it is: much less noise in scenes with small lights",
         .read = [&request](const std::string&) { request.same_estimator = true; }},
        backendOption(request.backend),
    };
    addSceneChanges(group, request.scene);
    group.options.push_back(noProgressOption(state.progress));
    return group;
}

constexpr const char* kReferenceNotes =
    "\nA reference has as little as possible in common with the images that are measured against it: it "
    "uses a different seed, independent\n"
    "samples, no roulette, and light sampling switched on or off. Light sampling stays on in scenes with "
    "lights that only it finds:\n"
    "point, spot, ies, beam and directional. The file holds the mean and eight independent parts of it, "
    "which give its own error.\n"
    "\nExamples:\n"
    "  crt reference scene.yaml -o ref.exr --time 10m\n"
    "  crt reference scene.yaml -o ref.exr --spp 65536 --same-estimator --set "
    "film.resolution=[128,128]\n";

}  // namespace

Command referenceCommand() {
    const auto state = std::make_shared<State>();
    return {.name = "reference",
            .summary = "render an independent reference for 'crt converge' and 'crt compare'",
            .arguments = {{.name = "SCENE",
                           .help = "scene file (YAML)",
                           .read = [state](const std::string& text) { state->request.scene.file = text; },
                           .completion = completeScene()}},
            .groups = {options(*state)},
            .notes = kReferenceNotes,
            .run = [state](const std::string&) {
                TerminalWatch watch(state->progress, TerminalWatch::Signals::Always);
                return converge::makeReference(state->request, watch);
            }};
}

}  // namespace crt
