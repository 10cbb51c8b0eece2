#include "base/atomic_file.h"
#include "base/error.h"
#include "base/standard_output.h"
#include "base/words.h"
#include "cli/arguments.h"
#include "cli/commands.h"
#include "cli/shared_options.h"
#include "cli/terminal_watch.h"
#include "image/image_io.h"
#include "judge/compare/compare.h"
#include "judge/compare/compare_backends.h"
#include "judge/compare/compare_text.h"
#include "render/output_guard.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

namespace crt {
namespace {

constexpr int kDifferent = 7;

constexpr const char* kCompareHelp = R"(
Prints whether the bits are the same and, if not, the first difference, with both values and the number of
floats between them (ulp); errors over all values of R, G and B; and the perceived difference (FLIP, Delta
E). If an image states its noise (output AOV 'variance' or 'error', or a reference of 'crt reference') and
the seeds differ, it also prints whether the difference is noise or bias: the bias of each channel with its
99.9 % interval, and the number of tiles and, in small films, of pixels that differ by more than noise (at a
level of 0.1 %). A single NaN or infinity makes the whole comparison void; no value is dropped.

With --backends, every backend renders the scene with the same seed, for which crt's own backends give the
same bits, and with different seeds for a verdict: PASS if the 99.9 % interval of the difference of the
means lies within +-delta and no tile and no pixel differs by more than noise, FAIL if one does for
certain, INCONCLUSIVE if more samples are needed or one value carries too much of the error. The exit code
is 7 unless all PASS.

Examples:
  crt compare cuda.exr embree.exr                        are they the same bits?
  crt compare --tolerance 0.01 --diff d.png a.exr b.exr  is the RMS difference below 1 % of b's mean?
  crt compare a.exr b.exr --map z.png                    where is the difference more than noise?
  crt compare a.exr b.exr --reference r.exr              which is nearer to r, and by how much?
  crt compare --backends cuda,embree scene.yaml          do both render the same?
)";

/// Exit code 7 when the images differ (compare.h says what that means), or, with backends, when the verdict
/// is not PASS.
struct CompareArguments {
    std::string first, second;    ///< With backends, the first is the scene and there is no second.
    CompareOptions options;
    std::string reference;        ///< An image that both are measured against; empty: none.
    std::string json_file;        ///< "-" for stdout, then instead of the text; empty: none.
    std::string difference_file;  ///< Empty: none.
    std::string map_file;         ///< Of z; empty: none.
    SceneRequest scene;           ///< How to change the scene; its name is in `first`.
    BackendComparisonOptions backends;
    ProgressMode progress = ProgressMode::Auto;
};

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
                        fmt::format("{}: cannot make {}: {}", option, what, mismatch));
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
                "'{}' needs a second image to compare with, or backends (--backends)",
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
    // An output that was requested and cannot be made is an error; crt does not silently leave it out.
    if (!result.mismatch.empty()) requireNothingMore(arguments, result.mismatch);
    if (!arguments.difference_file.empty()) writeDifference(arguments.difference_file, a, b);
    if (!arguments.map_file.empty()) {
        if (!noise)
            throw Error(
                ErrorKind::Usage,
                "a z map needs finite values in the channels R, G and B");
        writeZMap(arguments.map_file, *noise, a.width, a.height);
    }
    return result.same ? 0 : kDifferent;
}

int compareBackends(const CompareArguments& arguments) {
    if (!arguments.second.empty())
        throw Error(ErrorKind::Usage,
                    fmt::format("--backends takes one scene: remove '{}'", arguments.second));
    SceneRequest request = arguments.scene;
    request.file = arguments.first;
    const Scene scene = loadScene(request);
    refuseOverInputs(scene.files_read, outputs(arguments));
    TerminalWatch watch(arguments.progress, TerminalWatch::Signals::Never);
    const BackendComparison comparison = compareBackends(scene, arguments.backends, watch);
    print(arguments, backendComparisonText(comparison), backendComparisonJson(comparison));
    return comparison.passes() ? 0 : kDifferent;
}

int compare(const CompareArguments& arguments) {
    for (const std::string& file : {arguments.difference_file, arguments.map_file})
        if (isStandardOutput(file))
            throw Error(ErrorKind::Usage,
                        fmt::format("'{}': the figures of the comparison go to standard output", file));
    for (const std::string& file : {arguments.difference_file, arguments.map_file, arguments.json_file})
        if (!file.empty() && file != "-") checkWritable(file);
    return arguments.backends.backends.empty() ? compareFiles(arguments) : compareBackends(arguments);
}

OptionGroup sameOrNot(CompareArguments& to) {
    return {"Equality (exit code)",
            {{.names = "--tolerance",
              .placeholder = "X",
              .help = "RMS difference, as a share of B's mean, below which the images count as equal (0: "
                      "same bits)",
              .read = [&to](const std::string& text) {
                  to.options.tolerance = parseTolerance(text, "--tolerance");
              }},
             {.names = "--all-channels",
              .placeholder = {},
              .help = "compare every channel, not only R, G and B",
              .read = [&to](const std::string&) { to.options.all_channels = true; }}}};
}

OptionGroup moreToSee(CompareArguments& to) {
    return {"More output",
            {{.names = "--reference",
              .placeholder = "FILE",
              .help = "compare the errors of A and of B against this image",
              .read = [&to](const std::string& text) { to.reference = text; },
              .completion = completeImage()},
             {.names = "--diff",
              .placeholder = "FILE",
              .help = "write the difference: values to .exr or .pfm, colours to .png, .jpg or .ppm",
              .read = [&to](const std::string& text) { to.difference_file = text; },
              .completion = completeImage()},
             {.names = "--map",
              .placeholder = "FILE",
              .help = "write z, the difference in standard errors: values to .exr or .pfm, else colours",
              .read = [&to](const std::string& text) { to.map_file = text; },
              .completion = completeImage()},
             {.names = "--json",
              .placeholder = "[FILE]",
              .help = "write all numbers as JSON: to FILE.json, or instead of the text",
              .read = [&to](const std::string& text) { to.json_file = text; },
              .completion = completeFile({"json"})}}};
}

OptionGroup backendsInstead(CompareArguments& to) {
    BackendComparisonOptions& options = to.backends;
    OptionGroup group{"Backends instead of images"};
    group.options = {
        {.names = "--backends",
         .placeholder = "X,Y",
         .help = "render scene A with each backend; the last is the reference",
         .read = [&options](const std::string& text) { options.backends = parseList(text, "--backends"); },
         .completion = {Completion::Kind::Backend}},
        {.names = "--spp",
         .placeholder = "N",
         .help = "samples per pixel of each render (by default the replicates together have the scene's)",
         .read = [&options](const std::string& text) { options.samples = parseCount(text, "--spp", 1); },
         .needs = {"--backends"}},
        {.names = "--replicates",
         .placeholder = "R",
         .help = "renders per backend, each with a different seed (16)",
         .read = [&options](const std::string& text) {
             options.replicates = smallCount(text, "--replicates", 2);
         },
         .needs = {"--backends"}},
        {.names = "--delta",
         .placeholder = "PERCENT",
         .help = "relative difference of means that counts as equivalent (1%)",
         .read = [&options](const std::string& text) {
             options.gate.delta = parseFraction(text, "--delta");
         },
         .needs = {"--backends"}},
    };
    addSceneChanges(group, to.scene);
    group.options.push_back(noProgressOption(to.progress));
    return group;
}

}  // namespace

Command compareCommand() {
    const auto to = std::make_shared<CompareArguments>();
    return {.name = "compare",
            .summary = "compare two images, or backends; exit code 7 when they differ",
            .arguments = {{.name = "A",
                           .help = "image, or a scene with --backends",
                           .read = [to](const std::string& text) { to->first = text; },
                           .completion = completeFile({"exr", "png", "ppm", "pfm", "yaml"})},
                          {.name = "B",
                           .help = "image that relative numbers refer to",
                           .read = [to](const std::string& text) { to->second = text; },
                           .completion = completeImage(),
                           .required = false}},
            .groups = {sameOrNot(*to), moreToSee(*to), backendsInstead(*to)},
            .notes = kCompareHelp,
            .run = [to](const std::string&) { return compare(*to); }};
}

}  // namespace crt
