/// A file of one mesh → the text of a scene.
#pragma once

#include "scene/import/scene_text.h"

#include <string>

namespace crt {

/// `file_name` is what the scene calls the file. Throw crt::Error(Scene) as loadObj and loadPly.
std::string objScene(const std::string& path, const std::string& file_name, Losses& losses);
std::string plyScene(const std::string& path, const std::string& file_name, Losses& losses);

}  // namespace crt
