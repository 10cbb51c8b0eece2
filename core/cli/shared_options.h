/// Options that several commands have: one definition, so that they are called and behave the same
/// everywhere.
#pragma once

#include "backend/integrator.h"
#include "cli/command.h"
#include "cli/progress.h"
#include "render/job.h"

#include <cstdint>
#include <string>
#include <vector>

namespace crt {

/// A count that no use has above 65,536. Throws crt::Error(Usage).
unsigned smallCount(const std::string& text, const char* option, std::uint64_t least);

/// The keys of these sections of a scene, or of all its sections, as --set takes them.
Completion completeSetting(const std::vector<std::string>& sections = {});

/// --set, --seed and --crop. The references, here and below, must live as long as the command.
void addSceneChanges(OptionGroup& group, SceneRequest& scene);

/// -b of one backend.
Option backendOption(std::string& backend);

Option deviceOption(IntegratorOptions& integrator);
Option threadsOption(IntegratorOptions& integrator);
Option kernelOption(IntegratorOptions& integrator);

/// --expose auto.
Option exposeOption(bool& automatically);

/// -q of commands that print no other messages than progress.
Option noProgressOption(ProgressMode& progress);

/// -q: warnings and errors alone.
Option quietOption(const char* help);

/// Extensions of files of scenes, images and films.
Completion completeScene();
Completion completeImage();
Completion completeFilm();
Completion completeOutput();  ///< Images and films.

}  // namespace crt
