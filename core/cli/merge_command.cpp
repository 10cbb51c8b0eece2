#include "base/atomic_file.h"
#include "base/log.h"
#include "cli/commands.h"
#include "cli/row.h"
#include "cli/shared_options.h"
#include "compile/compile.h"
#include "film/checkpoint.h"
#include "render/brightest_path.h"
#include "render/job.h"
#include "render/output_guard.h"
#include "render/outputs.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace crt {
namespace {

/// Disjoint partial films into one film, or into images.
struct MergeArguments {
    std::vector<std::string> parts;
    std::vector<std::string> outputs;
    bool overwrite = false;  ///< Also over a film of more samples.
    /// As rendered, for films that do not say themselves how to develop them; an empty name means none.
    SceneRequest scene;
};

int mergeFilms(const MergeArguments& arguments) {
    // Everything that can be refused is refused before the parts, which may be large, are read.
    const bool has_scene = !arguments.scene.file.empty();
    Scene scene;
    if (has_scene) scene = loadScene(arguments.scene);
    OutputPlan plan = planOutputs(arguments.outputs, scene);
    if (arguments.outputs.empty()) refuseForeignPlaces(plan.images, scene.file, arguments.overwrite);
    std::vector<std::string> inputs = arguments.parts, images;
    inputs.insert(inputs.end(), scene.files_read.begin(), scene.files_read.end());
    for (const Output& image : plan.images) images.push_back(image.file);
    refuseOverInputs(inputs, images, plan.films);
    FilmGuard films;
    for (const std::string& film : plan.films) films.look(film, true, arguments.overwrite);
    for (const Output& image : plan.images) checkWritable(image.file);
    for (const std::string& film : plan.films) checkWritable(film);

    auto [film, identity] = mergeCheckpoints(arguments.parts);
    films.requireRoom(film.samples.count());
    if (has_scene) {
        FilmRecord record = recordOf(scene);
        const CompiledScene compiled = compileScene(scene, requestedAovs(scene));
        record.paths.brightest = brightestPathOf(compiled);
        requireSameScene(arguments.parts.front(), identity,
                         {.scene_hash = compiled.hash, .version = CRT_VERSION, .record = record});
        if (identity.record) record.addRun(*identity.record);
        identity.record = std::move(record);
    }
    if (!plan.images.empty()) requireRecord(arguments.parts.front(), identity);

    for (const std::string& name : plan.films) writeCheckpoint(name, film, identity);
    for (Output& output : plan.images) {
        if (output.format == OutputFormat::Exr) output.aovs = identity.record->aovs;
        writeOutput(output, film, identity);
    }
    logInfo("{} samples per pixel from {} to {}", film.samples.count(),
            counted(arguments.parts.size(), "part", "parts"), fmt::join(arguments.outputs, ", "));
    return 0;
}

constexpr const char* kMergeNotes =
            "\nExamples:\n"
            "  crt merge -o all.crtfilm a.crtfilm b.crtfilm\n"
            "  crt merge -o scene.exr -o scene.png a.crtfilm b.crtfilm\n"
            "  crt merge --scene scene.yaml -o scene.exr a.crtfilm b.crtfilm      films of an earlier crt, "
            "which need it\n";

}  // namespace

Command mergeCommand() {
    const auto to = std::make_shared<MergeArguments>();
    OptionGroup scene{"The scene, changed as it was for rendering"};
    addSceneChanges(scene, to->scene);
    return {
        .name = "merge",
        .summary = "add partial renders of disjoint samples",
        .arguments = {{.name = "PART",
                       .help = "films (.crtfilm) of one scene",
                       .read = [to](const std::string& text) { to->parts.push_back(text); },
                       .completion = completeFilm(),
                       .repeatable = true}},
        .groups = {{"Options",
                    {{.names = "-o,--output",
                      .placeholder = "FILE",
                      .help = ".crtfilm or an image: .exr .png .jpg .ppm .pfm; -.png for a pipe; repeatable",
                      .read = [to](const std::string& text) { to->outputs.push_back(text); },
                      .completion = completeOutput(),
                      .repeatable = true,
                      .required = true},
                     {.names = "--scene",
                      .placeholder = "SCENE",
                      .help = "scene of the films; only for films without development settings",
                      .read = [to](const std::string& text) { to->scene.file = text; },
                      .completion = completeScene()},
                     {.names = "--overwrite",
                      .placeholder = {},
                      .help = "replace a film even if it holds more samples",
                      .read = [to](const std::string&) { to->overwrite = true; }},
                     quietOption("only warnings and errors")}},
                   std::move(scene)},
        .notes = kMergeNotes,
        .run = [to](const std::string&) { return mergeFilms(*to); }};
}

}  // namespace crt
