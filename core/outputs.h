/// Which files a run writes, and writing them: shared by rendering and merging.
#pragma once

#include "film.h"
#include "scene.h"

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace crt {

/// Files to write: images, and films (.crtfilm).
struct OutputPlan {
    std::vector<Output> images;
    std::vector<std::string> films;
    std::string first;  ///< The first of all; checkpoint and report take their names from it.
};

/// The AOVs that a scene's outputs ask for together. They are measured wherever the images go, so that -o never changes what a
/// checkpoint is worth.
std::uint32_t requestedAovs(const Scene& scene);

/// Where `files` (-o) say, else the scene's outputs, else "<scene>.exr" and "<scene>.png" in the working directory. An EXR from -o holds
/// the AOVs that the scene asks for. Throws crt::Error(Usage) when an extension says no format or two names are the same.
OutputPlan planOutputs(const std::vector<std::string>& files, const Scene& scene);

/// "out/cornell.exr" → "out/cornell<suffix>".
std::string besideOutput(const std::string& output, const char* suffix);

/// Names and values for an image file.
using Metadata = std::vector<std::pair<std::string, std::string>>;

/// Film → one image file, with `metadata` added to what the film itself knows. Throws crt::Error(Output).
void writeOutput(const Output& output, const Film& film, const Scene& scene, const Metadata& metadata);

}  // namespace crt
