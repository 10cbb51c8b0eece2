/// Chooses and writes the output files of a run: shared by rendering, merging and developing.
#pragma once

#include "film/checkpoint.h"
#include "film/film.h"
#include "scene/scene.h"

#include <cstdint>
#include <string>
#include <vector>

namespace crt {

/// Files to write: images, and films (.crtfilm).
struct OutputPlan {
    std::vector<Output> images;
    std::vector<std::string> films;
    std::string first;  ///< The first of all; checkpoint and report take their names from it.
};

/// The AOVs that a scene's outputs ask for together. They are measured wherever the images go, so that -o
/// never changes what a checkpoint is worth.
std::uint32_t requestedAovs(const Scene& scene);

/// Where `files` (-o) say, else the scene's outputs, else "<scene>.exr" and "<scene>.png" in the working
/// directory. An EXR from -o holds the AOVs that the scene requests. Throws crt::Error(Usage) when an
/// extension says no format or two names are the same.
OutputPlan planOutputs(const std::vector<std::string>& files, const Scene& scene);

/// "out/cornell.exr" → "out/cornell<suffix>".
std::string besideOutput(const std::string& output, const char* suffix);

/// "a.denoised.png" of "a.png": of the PNG and EXR files among `images`. Throws crt::Error(Usage) if there
/// are none.
std::vector<std::string> denoisedNames(const std::vector<std::string>& images);

/// The image that `output` holds: the film developed for its format, with everything that its identity knows
/// as metadata. The identity must have a record. Throws crt::Error(Usage) for an AOV that the film lacks.
Image developedImage(const Output& output, const Film& film, const FilmIdentity& identity);

/// Chooses the exposure by the film (auto_exposure.h), and says which: the record gets it, as if the scene
/// had it. Throws crt::Error(Usage) for a view, whose colours are no light.
void exposeAutomatically(const Film& film, FilmRecord& record);

/// Refuses to develop a film that does not know how: crt::Error(Usage).
void requireRecord(const std::string& path, const FilmIdentity& identity);

/// Film → one image file. Throws as developedImage, and crt::Error(Output).
void writeOutput(const Output& output, const Film& film, const FilmIdentity& identity);

}  // namespace crt
