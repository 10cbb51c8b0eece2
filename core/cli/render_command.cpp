#include "base/atomic_file.h"
#include "base/parallel.h"
#include "cli/command_line.h"
#include "cli/commands.h"
#include "cli/denoiser.h"
#include "cli/render_options.h"
#include "cli/shared_options.h"
#include "cli/terminal_watch.h"
#include "render/job.h"

#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace crt {

Command renderCommand() {
    struct State {
        Job job;
        ProgressMode progress = ProgressMode::Auto;
        std::string film;  ///< To be denoised, into these.
        std::vector<std::string> denoised;
    };
    const auto state = std::make_shared<State>();
    Job& job = state->job;
    OptionGroup files = filesGroup(job);
    files.options.push_back(
        {.names = "--denoise",
         .placeholder = {},
         .help = "then guess the image without its noise, into NAME.denoised.png beside it",
         .read = [state](const std::string&) {
             state->job.denoise = [state](const std::string& film,
                                          const std::vector<std::string>& denoised) {
                 state->film = film;
                 state->denoised = denoised;
             };
         }});
    return {.name = "render",
            .summary = "render a scene; the word 'render' is optional",
            .arguments = {{.name = "SCENE",
                           .help = "scene file (YAML), or - for standard input",
                           .read = [&job](const std::string& text) { job.scene.file = text; },
                           .completion = completeScene()}},
            .groups = {samplesGroup(job), deviceGroup(job), std::move(files),
                       messagesGroup(state->progress)},
            .notes = programExamples(),
            .run = [state](const std::string& typed) {
                state->job.command = typed;
                // A pipe needs no report unless it was requested.
                const bool streamed =
                    !state->job.outputs.empty() && isStandardOutput(state->job.outputs.front());
                if (streamed && !state->job.report_file) state->job.report_file = "";
                TerminalWatch watch(state->progress);
                const int code = resultWithThreads(state->job.integrator.threads,
                                                   [&] { return runJob(state->job, watch); });
                if (!state->film.empty()) becomeDenoiser(state->film, state->denoised, false);
                return code;
            }};
}

}  // namespace crt
