#include "outputs.h"

#include "checkpoint.h"
#include "image_io.h"

#include <fmt/format.h>

#include <filesystem>
#include <set>

namespace crt {

std::uint32_t requestedAovs(const Scene& scene) {
    std::uint32_t aovs = 0;
    for (const Output& output : scene.outputs) aovs |= output.aovs;
    return aovs;
}

OutputPlan planOutputs(const std::vector<std::string>& files, const Scene& scene) {
    OutputPlan plan;
    std::vector<std::string> names = files;
    if (names.empty() && scene.outputs.empty()) {
        const std::string stem = std::filesystem::path(scene.file).stem().string();
        names = {stem + ".exr", stem + ".png"};
    }
    if (names.empty()) {
        plan.images = scene.outputs;
        for (const Output& output : scene.outputs) names.push_back(output.file);
    } else {
        for (const std::string& file : names) {
            if (std::filesystem::path(file).extension() == kCheckpointExtension) {
                plan.films.push_back(file);
            } else if (const auto format = formatOfFile(file)) {
                const std::uint32_t aovs = *format == OutputFormat::Exr ? requestedAovs(scene) : 0;
                plan.images.push_back({.file = file, .format = *format, .aovs = aovs, .place = {}});
            } else {
                throw Error(ErrorKind::Usage, fmt::format("the name of the output '{}' ends in none of .exr, .png, .ppm, .pfm and .crtfilm", file));
            }
        }
    }
    plan.first = names.front();
    std::set<std::string> seen;
    for (const std::string& name : names)
        if (!seen.insert(std::filesystem::path(name).lexically_normal().string()).second)
            throw Error(ErrorKind::Usage, fmt::format("two outputs have the same name '{}'", name));
    return plan;
}

std::string besideOutput(const std::string& output, const char* suffix) {
    return std::filesystem::path(output).replace_extension().string() + suffix;
}

void writeOutput(const Output& output, const Film& film, const Scene& scene, const Metadata& metadata) {
    Image image = resolveImage(film, scene, output.aovs);
    image.metadata.insert(image.metadata.end(), metadata.begin(), metadata.end());
    writeImage(output.file, output.format, image);
}

}  // namespace crt
