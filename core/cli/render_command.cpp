#include "base/atomic_file.h"
#include "base/parallel.h"
#include "cli/command_line.h"
#include "cli/commands.h"
#include "cli/render_options.h"
#include "cli/shared_options.h"
#include "cli/terminal_watch.h"
#include "render/job.h"

#include <memory>

namespace crt {

Command renderCommand() {
    struct State {
        Job job;
        ProgressMode progress = ProgressMode::Auto;
    };
    const auto state = std::make_shared<State>();
    Job& job = state->job;
    return {.name = "render",
            .summary = "render a scene; the word 'render' is optional",
            .arguments = {{.name = "SCENE",
                           .help = "scene file (YAML), or - for standard input",
                           .read = [&job](const std::string& text) { job.scene.file = text; },
                           .completion = completeScene()}},
            .groups = {samplesGroup(job), deviceGroup(job), filesGroup(job), messagesGroup(state->progress)},
            .notes = programExamples(),
            .run = [state](const std::string& typed) {
                state->job.command = typed;
                // A pipe needs no report unless it was requested.
                const bool streamed =
                    !state->job.outputs.empty() && isStandardOutput(state->job.outputs.front());
                if (streamed && !state->job.report_file) state->job.report_file = "";
                TerminalWatch watch(state->progress);
                return resultWithThreads(state->job.integrator.threads,
                                         [&] { return runJob(state->job, watch); });
            }};
}

}  // namespace crt
