/// The wishes of an author for an import.
#pragma once

#include <string>

namespace crt {

struct ImportOptions {
    std::string folder;          ///< Of the scene: names of files are relative to it. Empty: the file's own.
    bool allow_outside = false;  ///< Buffers and images may lie outside the file's folder.
    /// Name of one of the file's variants (KHR_materials_variants), whose materials the scene gets; empty:
    /// the materials that a reader without variants sees.
    std::string variant;
};

}  // namespace crt
