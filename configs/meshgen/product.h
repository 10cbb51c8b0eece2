/// A flask of brushed steel with a painted label, a lacquered cap with a glass ball on it, on a round of
/// wood: as glTF has such things, with textures.
#pragma once

#include <filesystem>

namespace crt::meshgen {

/// Writes a GLB. Throws std::runtime_error where the file cannot be written.
void writeProduct(const std::filesystem::path& path);

}  // namespace crt::meshgen
