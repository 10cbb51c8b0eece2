#include "cli/render_options.h"

#include "base/log.h"
#include "cli/arguments.h"
#include "cli/shared_options.h"

namespace crt {

OptionGroup samplesGroup(Job& job) {
    OptionGroup group{"Samples and scene"};
    group.options = {
        {.names = "--spp",
         .placeholder = "N",
         .help = "samples per pixel, instead of the scene's",
         .read = [&job](const std::string& text) { job.spp = parseCount(text, "--spp", 1); }},
        {.names = "--time",
         .placeholder = "DURATION",
         .help = "stop after 90s, 30m, 2h, 1h30m; with --spp, whichever comes first",
         .read =
             [&job](const std::string& text) { job.time_limit_seconds = parseDuration(text, "--time"); }},
        {.names = "--target-error",
         .placeholder = "PERCENT",
         .help = "stop when the error is below PERCENT, e.g. 1%, with 95 % confidence",
         .read =
             [&job](const std::string& text) { job.target_error = parseFraction(text, "--target-error"); }},
        {.names = "--samples",
         .placeholder = "A:B",
         .help = "render exactly the samples A to B-1, to merge with other parts later",
         .read = [&job](const std::string& text) { job.samples = parseSampleRange(text, "--samples"); },
         .excludes = {"--spp"}},
    };
    addSceneChanges(group, job.scene);
    return group;
}

OptionGroup deviceGroup(Job& job) {
    return {
        "Device",
        {backendOption(job.backend), deviceOption(job.integrator), threadsOption(job.integrator),
         kernelOption(job.integrator),
         {.names = "--tile",
          .placeholder = "N",
          .help = "pixels along the side of a tile; never changes the image",
          .read = [&job](const std::string& text) {
              job.integrator.tile_size = smallCount(text, "--tile", 1);
          }},
         {.names = "--chunk",
          .placeholder = "N",
          .help = "samples per pixel between checks of the clock and of signals",
          .read = [&job](const std::string& text) { job.chunk = parseCount(text, "--chunk", 1); }},
         {.names = "--no-cache",
          .placeholder = {},
          .help = "do not keep compiled kernels on disk",
          .read = [&job](const std::string&) { job.integrator.use_cache = false; }}}};
}

OptionGroup filesGroup(Job& job) {
    return {"Files",
            {{.names = "-o,--output",
              .placeholder = "FILE",
              .help = ".exr .png .jpg .ppm .pfm .crtfilm, not the scene's; -.png for a pipe; repeatable",
              .read = [&job](const std::string& text) { job.outputs.push_back(text); },
              .completion = completeOutput(),
              .repeatable = true},
             exposeOption(job.expose_automatically),
             {.names = "--checkpoint",
              .placeholder = "FILE",
              .help = "save the samples regularly and at the end, for --resume; or off",
              .read = [&job](const std::string& text) { job.checkpoint_file = text == "off" ? "" : text; },
              .completion = completeFilm()},
             {.names = "--checkpoint-every",
              .placeholder = "DURATION",
              .help = "interval between checkpoints (10m)",
              .read = [&job](const std::string& text) {
                  job.checkpoint_interval_seconds = parseDuration(text, "--checkpoint-every");
              }},
             {.names = "--resume",
              .placeholder = "[FILE]",
              .help = "continue from a checkpoint (FILE.crtfilm, or the first output's), and keep it",
              .read = [&job](const std::string& text) {
                  job.resume = true;
                  job.resume_file = text == "auto" ? "" : text;
              },
              .completion = completeFilm()},
             {.names = "--overwrite",
              .placeholder = {},
              .help = "replace a film even if it holds more samples than this run makes",
              .read = [&job](const std::string&) { job.overwrite = true; }},
             {.names = "--report",
              .placeholder = "FILE",
              .help = "write a JSON report of the run (default: first output with .report.json); or none",
              .read = [&job](const std::string& text) { job.report_file = text == "none" ? "" : text; },
              .completion = completeFile({"json"})}}};
}

OptionGroup messagesGroup(ProgressMode& progress) {
    return {"Messages",
            {{.names = "-v,--verbose",
              .placeholder = {},
              .help = "print more details",
              .read = [](const std::string&) { setLogLevel(LogLevel::Debug); }},
             {.names = "-q,--quiet",
              .placeholder = {},
              .help = "only warnings and errors, no progress",
              .read = [&progress](const std::string&) {
                  setLogLevel(LogLevel::Warning);
                  progress = ProgressMode::None;
              }}}};
}

}  // namespace crt
