#include "base/atomic_file.h"
#include "base/error.h"
#include "base/standard_output.h"
#include "cli/commands.h"
#include "cli/terminal_watch.h"
#include "image/image_io.h"
#include "judge/compare/compare_backends.h"
#include "judge/compare/compare_text.h"
#include "render/output_guard.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <optional>
#include <tuple>

namespace crt {
namespace {

constexpr int kDifferent = 7;

/// Do files of this name hold what a screen shows, and not radiance?
bool isDisplayReferred(const std::string& file) {
    std::string extension = std::filesystem::path(file).extension();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return std::tolower(c); });
    return extension != ".exr" && extension != ".pfm" && extension != ".hdr";
}

void writeText(const std::string& file, const std::string& text) {
    AtomicFile out(file);
    out.write(text.data(), text.size());
    out.commit();
}

/// Text to stdout and JSON to its file, or JSON to stdout.
void print(const CompareArguments& arguments, const std::string& text, const std::string& json) {
    printOut("{}\n", arguments.json_file == "-" ? json : text);
    if (!arguments.json_file.empty() && arguments.json_file != "-")
        writeText(arguments.json_file, json + "\n");
}

/// Of images that do not match there is nothing but that to say. Throws crt::Error(Usage) when more was
/// asked for.
void requireNothingMore(const CompareArguments& arguments, const std::string& mismatch) {
    for (const auto& [option, file, what] :
         {std::tuple{"--reference", &arguments.reference, "errors against a reference"},
          {"--diff", &arguments.difference_file, "a difference image"},
          {"--map", &arguments.map_file, "a z map"}})
        if (!file->empty())
            throw Error(ErrorKind::Usage,
                        fmt::format("{}: there is no {}, because {}", option, what, mismatch));
}

std::vector<std::string> named(const std::vector<std::string>& files) {
    std::vector<std::string> names;
    for (const std::string& file : files)
        if (!file.empty() && file != "-") names.push_back(file);
    return names;
}
std::vector<std::string> inputs(const CompareArguments& arguments) {
    return named({arguments.first, arguments.second, arguments.reference});
}
std::vector<std::string> outputs(const CompareArguments& arguments) {
    return named({arguments.difference_file, arguments.map_file, arguments.json_file});
}

int compareFiles(const CompareArguments& arguments) {
    if (arguments.second.empty())
        throw Error(
            ErrorKind::Usage,
            fmt::format(
                "there is nothing to compare '{}' with; name a second image, or backends with --backends",
                arguments.first));
    if (arguments.scene.seed || arguments.scene.crop || !arguments.scene.overrides.empty())
        throw Error(ErrorKind::Usage, "--set, --seed and --crop change a scene, and need --backends");
    refuseOverInputs(inputs(arguments), outputs(arguments));
    const Image a = readImage(arguments.first), b = readImage(arguments.second);
    std::optional<Image> reference_image;
    if (!arguments.reference.empty()) reference_image = readImage(arguments.reference);

    CompareOptions options = arguments.options;
    options.display_referred = isDisplayReferred(arguments.first) || isDisplayReferred(arguments.second);
    const CompareResult result = compareImages(a, b, options);
    const bool comparable = result.mismatch.empty() && result.metrics_valid && hasColor(a) && hasColor(b);

    std::optional<NoiseComparison> noise;
    if (comparable) noise = compareNoise(a, b);
    std::optional<ReferenceComparison> reference;
    if (reference_image && result.mismatch.empty())
        reference = compareWithReference(a, b, *reference_image, options.display_referred);

    const Comparison comparison{&result, noise ? &*noise : nullptr, reference ? &*reference : nullptr};
    print(arguments, comparisonText(comparison), comparisonJson(comparison));
    // What was asked for and cannot be is an error, and not an answer that leaves it out.
    if (!result.mismatch.empty()) requireNothingMore(arguments, result.mismatch);
    if (!arguments.difference_file.empty()) writeDifference(arguments.difference_file, a, b);
    if (!arguments.map_file.empty()) {
        if (!noise)
            throw Error(
                ErrorKind::Usage,
                "there is no z map of images that lack R, G and B or hold values that are not finite");
        writeZMap(arguments.map_file, *noise, a.width, a.height);
    }
    return result.same ? 0 : kDifferent;
}

int compareBackends(const CompareArguments& arguments) {
    if (!arguments.second.empty())
        throw Error(ErrorKind::Usage,
                    fmt::format("--backends takes one scene: '{}' is one too many", arguments.second));
    SceneRequest request = arguments.scene;
    request.file = arguments.first;
    const Scene scene = loadScene(request);
    refuseOverInputs(scene.files_read, outputs(arguments));
    TerminalWatch watch(arguments.progress, TerminalWatch::Signals::Never);
    const BackendComparison comparison = compareBackends(scene, arguments.backends, watch);
    print(arguments, backendComparisonText(comparison), backendComparisonJson(comparison));
    return comparison.passes() ? 0 : kDifferent;
}

}  // namespace

int compare(const CompareArguments& arguments) {
    for (const std::string& file : {arguments.difference_file, arguments.map_file, arguments.json_file})
        if (!file.empty() && file != "-") checkWritable(file);
    return arguments.backends.backends.empty() ? compareFiles(arguments) : compareBackends(arguments);
}

}  // namespace crt
