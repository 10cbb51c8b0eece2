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

/// Opens the module that writes a format (kind Output), or the one that reads it, on first use, and keeps
/// it: threads of its libraries outlive any one image. Throws crt::Error(kind), with the name of the file,
/// when there is none.
const CrtImageModule& imageModule(ModuleFormat format, const std::string& path, ErrorKind kind);

/// Opens it beforehand, where writing such a file needs it: at the end of a render memory may be short.
/// Errors are reported when the file is written. [any thread]
void prepareToWrite(OutputFormat format) noexcept;

}  // namespace crt
