#include "base/atomic_file.h"
#include "base/error.h"
#include "base/frame_cache.h"
#include "base/input_file.h"
#include "base/log.h"
#include "base/parallel.h"
#include "base/unit_text.h"
#include "cli/command_line.h"
#include "cli/commands.h"
#include "cli/frames.h"
#include "cli/render_options.h"
#include "cli/shared_options.h"
#include "cli/terminal_watch.h"
#include "render/job.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace crt {
namespace {

constexpr const char* kSequenceNotes = R"(
Each value of --set that has the word 'frame' is computed for each frame: numbers, + - * / ^, comparisons,
a ? b : c, sin cos tan asin acos atan atan2 exp ln sqrt abs min max rint and so on, in radians, and 'pi'.
In quotes the word stays. Outputs get the frame's number in place of '####', or before their extension.
Decoded images, trees of triangles and open devices are kept from one frame to the next.

  crt sequence scene.yaml --frames 0:24 --set 'objects.helmet.transform.0.rotate.angle_deg=15*frame'
  crt sequence street.yaml --frames 5:20 --set environment.clear_sky.time_h=frame -o 'out/hour-##.png'
  crt sequence scene.yaml --frames 0:240 --set sampler.seed=frame \
      --set 'camera.position=[4*cos(frame*pi/120), 2, 4*sin(frame*pi/120)]' \
      -o - | ffmpeg -f image2pipe -framerate 24 -i - turn.mp4

With --resume it leaves out the frames that are done: those whose report is newer than all files that it
read, and asked for the same. A frame that was stopped goes on from its film.
)";

struct Request {
    Job job;
    FrameRange frames;
    bool resume = false;
    ProgressMode progress = ProgressMode::Auto;
};

std::vector<SceneOverride> changesOf(const Request& request, std::int64_t frame) {
    std::vector<SceneOverride> changes;
    for (const SceneOverride& change : request.job.scene.overrides)
        changes.push_back(changeOfFrame(change, frame));
    return changes;
}

/// All that a frame asks for beside the content of files: two frames of the same text are the same image.
std::string textOf(const Job& job) {
    std::string text = job.scene.file;
    for (const SceneOverride& change : job.scene.overrides)
        text += fmt::format("; {}={}", change.path, change.value);
    if (job.scene.seed) text += fmt::format("; seed {}", *job.scene.seed);
    if (job.scene.crop) text += fmt::format("; crop {}", fmt::join(*job.scene.crop, ","));
    if (job.spp) text += fmt::format("; {} samples", *job.spp);
    if (job.samples) text += fmt::format("; samples {}:{}", job.samples->first, job.samples->second);
    if (job.time_limit_seconds > 0) text += fmt::format("; {} s", job.time_limit_seconds);
    if (job.target_error > 0) text += fmt::format("; error {}", job.target_error);
    if (job.expose_automatically) text += "; exposed automatically";
    return text;
}

Job jobOf(const Request& request, std::int64_t frame) {
    Job job = request.job;
    job.scene.overrides = changesOf(request, frame);
    job.output_name = [frame](const std::string& name) { return fileOfFrame(name, frame); };
    job.resume_where_possible = request.resume;
    job.frame = textOf(job);
    return job;
}

/// True if the report at `path` is of a frame that was asked for the same, is done, and is newer than what
/// it read; and if all that it wrote is there. A report that cannot be read is none.
bool isDone(const std::string& path, const std::string& asked) {
    constexpr std::uint64_t kMostReportBytes = std::uint64_t{16} << 20;
    try {
        const auto written = std::filesystem::last_write_time(path);
        const auto report = nlohmann::json::parse(readInput(path, kMostReportBytes));
        if (report.at("crt").value("request", "") != asked || report.at("stop").at("exit_code") != 0)
            return false;
        for (const auto& file : report.at("scene").at("files_read"))
            if (std::filesystem::last_write_time(file.get<std::string>()) > written) return false;
        for (const auto& file : report.at("outputs"))
            if (!std::filesystem::exists(file.get<std::string>())) return false;
        return true;
    } catch (const std::exception&) {
        return false;
    }
}

void checkNames(const Request& request) {
    if (request.job.scene.file == "-")
        throw Error(ErrorKind::Usage,
                    "a sequence reads its scene for each frame, and standard input comes once");
    for (const std::string& output : request.job.outputs)
        if (isStandardOutput(output) && request.resume)
            throw Error(ErrorKind::Usage, "--resume cannot know which frames went to standard output");
    if (request.resume && request.job.report_file && request.job.report_file->empty())
        throw Error(ErrorKind::Usage, "--resume needs the frames' reports, and --report is none");
}

int renderFrames(const Request& request, const std::string& typed) {
    checkNames(request);
    const KeptFrames keeping;
    const auto kept_session = std::make_shared<std::optional<Session>>();
    std::int64_t left_out = 0, number = 0;
    for (std::int64_t frame = request.frames.first; frame < request.frames.end;
         frame += request.frames.step) {
        ++number;
        Job job = jobOf(request, frame);
        job.command = typed;
        job.kept_session = kept_session;
        if (job.report_file) job.report_file = fileOfFrame(*job.report_file, frame);
        if (request.resume &&
            isDone(job.report_file ? *job.report_file : reportOf(job, loadScene(job.scene)), job.frame)) {
            ++left_out;
            continue;
        }
        KeptFrames::nextFrame();
        logInfo("frame {}, {} of {}", frame, number, request.frames.count());
        TerminalWatch watch(request.progress);
        const int code = runJob(job, watch);
        if (code != 0) {
            logInfo("stopped in frame {}; the same command with --resume goes on there", frame);
            return code;
        }
    }
    if (left_out > 0) logInfo("{} of {} frames were done before", left_out, number);
    return 0;
}

}  // namespace

Command sequenceCommand() {
    const auto request = std::make_shared<Request>();
    Job& job = request->job;
    OptionGroup frames{"Frames"};
    frames.options = {
        {.names = "--frames",
         .placeholder = "A:B[:STEP]",
         .help = "render the frames A to B-1",
         .read = [request](const std::string& text) { request->frames = parseFrames(text, "--frames"); },
         .required = true},
        {.names = "--resume",
         .placeholder = {},
         .help = "leave out the frames that are done, and go on with the one that was stopped",
         .read = [request](const std::string&) { request->resume = true; }}};
    OptionGroup files = filesGroup(job);
    // Each frame has its own film.
    std::erase_if(files.options, [](const Option& option) {
        return option.names == "--resume" || option.names.starts_with("--checkpoint");
    });
    return {.name = "sequence",
            .summary = "render a scene frame by frame, with values that change",
            .arguments = {{.name = "SCENE",
                           .help = "scene file (YAML)",
                           .read = [&job](const std::string& text) { job.scene.file = text; },
                           .completion = completeScene()}},
            .groups = {std::move(frames), samplesGroup(job), deviceGroup(job), std::move(files),
                       messagesGroup(request->progress)},
            .notes = kSequenceNotes,
            .run = [request](const std::string& typed) {
                const bool streamed =
                    !request->job.outputs.empty() && isStandardOutput(request->job.outputs.front());
                if (streamed && !request->job.report_file) request->job.report_file = "";
                return resultWithThreads(request->job.integrator.threads,
                                         [&] { return renderFrames(*request, typed); });
            }};
}

}  // namespace crt
