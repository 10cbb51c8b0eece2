#include "atomic_file.h"
#include "commands.h"
#include "compare_text.h"
#include "image_io.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <optional>

namespace crt {
namespace {

constexpr int kDifferent = 7;

/// Do files of this name hold what a screen shows, and not radiance?
bool isDisplayReferred(const std::string& file) {
    std::string extension = std::filesystem::path(file).extension();
    std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) { return std::tolower(c); });
    return extension != ".exr" && extension != ".pfm" && extension != ".hdr";
}

void writeText(const std::string& file, const std::string& text) {
    AtomicFile out(file);
    out.write(text.data(), text.size());
    out.commit();
}

}  // namespace

int compareFiles(const CompareArguments& arguments) {
    for (const std::string& file : {arguments.difference_file, arguments.map_file, arguments.json_file})
        if (!file.empty() && file != "-") checkWritable(file);
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
    if (reference_image && result.mismatch.empty()) reference = compareWithReference(a, b, *reference_image, options.display_referred);

    const Comparison comparison{&result, noise ? &*noise : nullptr, reference ? &*reference : nullptr};
    if (arguments.json_file == "-") {
        fmt::print("{}\n", comparisonJson(comparison));
    } else {
        fmt::print("{}\n", comparisonText(comparison));
        if (!arguments.json_file.empty()) writeText(arguments.json_file, comparisonJson(comparison) + "\n");
    }
    if (!arguments.difference_file.empty() && result.mismatch.empty()) writeDifference(arguments.difference_file, a, b);
    if (!arguments.map_file.empty()) {
        if (!noise) throw Error(ErrorKind::Usage, "there is no z map of images that differ in size, lack R, G and B, or hold values that are not finite");
        writeZMap(arguments.map_file, *noise, a.width, a.height);
    }
    return result.same ? 0 : kDifferent;
}

}  // namespace crt
