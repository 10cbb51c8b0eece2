/// The image codec modules (image_module.h), from this side.
#pragma once

#include "base/error.h"
#include "image/image_module.h"
#include "image/output_format.h"

#include <string>

namespace crt {

/// EXR, or any other format that a module knows.
enum class ModuleFormat { Plain, Exr };

/// By the first bytes of a file.
ModuleFormat moduleFormatOf(const std::string& path);

/// Opens the module on first use and keeps it: OpenImageIO's threads outlive any one image. Throws
/// crt::Error(kind), with the name of the file that is to be written (kind Output) or read, when there is
/// none.
const CrtImageModule& imageModule(ModuleFormat format, const std::string& path, ErrorKind kind);

/// Opens it beforehand, where writing such a file needs it: its hundreds of libraries take a fifth of a
/// second. Errors are reported when the file is written. [any thread]
void prepareToWrite(OutputFormat format) noexcept;

}  // namespace crt
