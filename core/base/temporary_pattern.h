/// Names for temporary files and folders. Uses nothing of the core, so that plugins have it, too.
#pragma once

#include <filesystem>
#include <string>

namespace crt {

/// A pattern for mkstemp and mkdtemp, which replace its last six letters.
inline std::string temporaryPattern(const std::filesystem::path& parent) {
    return (parent / ("crt-" + std::string(6, 'X'))).string();
}

}  // namespace crt
