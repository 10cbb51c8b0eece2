#include "cli/shared_options.h"

#include "base/error.h"
#include "base/log.h"
#include "cli/arguments.h"
#include "scene/yaml/scene_schema.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace crt {

unsigned smallCount(const std::string& text, const char* option, std::uint64_t least) {
    const std::uint64_t n = parseCount(text, option, least);
    if (n > 65536) throw Error(ErrorKind::Usage, fmt::format("{} {} is too large", option, text));
    return static_cast<unsigned>(n);
}

Completion completeSetting(const std::vector<std::string>& sections) {
    std::set<std::string> settings;
    const auto add = [&](const SectionSchema& section, const std::string& before) {
        for (const KeySchema& key : section.keys)
            if (key.kind != ValueKind::Section) settings.insert(before + key.name + "=");
    };
    for (const KeySchema& key : schemaSection("").keys) {
        const bool is_map = key.kind == ValueKind::Section && key.shape == ValueShape::One;
        const bool is_wanted =
            sections.empty() || std::find(sections.begin(), sections.end(), key.name) != sections.end();
        if (!is_map || !is_wanted) continue;
        for (const SectionSchema* const section : schemaVariants(key.section))
            add(*section, key.name + ".");
    }
    return {Completion::Kind::Setting, {settings.begin(), settings.end()}};
}

void addSceneChanges(OptionGroup& group, SceneRequest& scene) {
    group.options.push_back(
        {.names = "--set",
         .placeholder = "KEY=VALUE",
         .help = "change the scene, e.g. film.resolution=[256,256]; repeatable",
         .read = [&scene](const std::string& text) { scene.overrides.push_back(parseOverride(text)); },
         .completion = completeSetting(),
         .repeatable = true});
    group.options.push_back(
        {.names = "--seed",
         .placeholder = "N",
         .help = "seed of the random numbers; a new seed gives statistically equivalent noise",
         .read = [&scene](const std::string& text) { scene.seed = parseCount(text, "--seed", 0); }});
    group.options.push_back(
        {.names = "--crop",
         .placeholder = "X0,Y0,X1,Y1",
         .help = "only these pixels of the film, X1 and Y1 excluded",
         .read = [&scene](const std::string& text) { scene.crop = parseRectangle(text, "--crop"); }});
}

Option backendOption(std::string& backend) {
    return {.names = "-b,--backend",
            .placeholder = "NAME",
            .help =
                "cuda, embree, opencl, another name, a path, or auto: the first of these that runs here, "
                "and in long renders the fastest (CRT_BACKEND)",
            .read = [&backend](const std::string& text) { backend = text; },
            .completion = {Completion::Kind::Backend},
            .environment = "CRT_BACKEND"};
}

Option deviceOption(IntegratorOptions& integrator) {
    return {.names = "-d,--device",
            .placeholder = "NAME",
            .help = "number or part of the name, as in 'crt plugins'; 0,1 or all for several (CRT_DEVICE)",
            .read = [&integrator](const std::string& text) { integrator.device = text; },
            .environment = "CRT_DEVICE"};
}

Option threadsOption(IntegratorOptions& integrator) {
    return {.names = "-t,--threads",
            .placeholder = "N",
            .help = "threads of the processor; 0 for all",
            .read = [&integrator](const std::string& text) {
                integrator.threads = smallCount(text, "--threads", 0);
            }};
}

Option kernelOption(IntegratorOptions& integrator) {
    const std::vector<std::string> words(kKernelWords.begin(), kKernelWords.end());
    return {
        .names = "--kernel",
        .placeholder = "KIND",
        .help =
            "lean: the features of this scene (default); full: all features; lean-only: lean, and wait "
            "until it is compiled",
        .read = [&integrator](const std::string& text) { integrator.kernel = kernelNamed(text).value(); },
        .completion = completeWord(words),
        .choices = words};
}

Option exposeOption(bool& automatically) {
    return {.names = "--expose",
            .placeholder = "auto",
            .help = "auto: choose the exposure so that the log-average of the image becomes 18 % grey",
            .read = [&automatically](const std::string&) { automatically = true; },
            .completion = completeWord({"auto"}),
            .choices = {"auto"}};
}

Option noProgressOption(ProgressMode& progress) {
    return {.names = "-q,--quiet", .placeholder = {}, .help = "no progress",
            .read = [&progress](const std::string&) { progress = ProgressMode::None; }};
}

Option quietOption(const char* help) {
    return {.names = "-q,--quiet", .placeholder = {}, .help = help,
            .read = [](const std::string&) { setLogLevel(LogLevel::Warning); }};
}

Completion completeScene() {
    return completeFile({"yaml", "yml", "glb", "gltf", "obj", "ply", "stl", "xml", "pbrt"});
}
Completion completeImage() { return completeFile({"exr", "png", "jpg", "ppm", "pfm"}); }
Completion completeFilm() { return completeFile({"crtfilm"}); }
Completion completeOutput() { return completeFile({"exr", "png", "jpg", "ppm", "pfm", "crtfilm"}); }

}  // namespace crt
