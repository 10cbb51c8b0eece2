/// Images to files and back. PFM and PPM are written here; EXR, PNG and JPEG go through the codec modules
/// (image_module.h), which are opened when the first such file is read or written and not before.
///
/// Values. EXR and PFM hold linear floats as they are, whatever the colour space. PNG, JPEG and PPM are
/// 8-bit sRGB: an image in ACEScg or XYZ is converted to linear sRGB first, then encoded (IEC 61966-2-1) and
/// rounded; what lies outside [0,1] is clipped and counted. Reading gives linear values back.
///
/// Files are written under a temporary name and renamed. checkWritable() (atomic_file.h) says beforehand
/// whether that can work.
#pragma once

#include "base/atomic_file.h"
#include "image/image.h"
#include "image/output_format.h"
#include "image/srgb_encoding.h"

#include <optional>
#include <string>

namespace crt {

/// By the extension, whatever its case: ".exr", ".png", ".jpg" and ".jpeg", ".ppm", ".pfm".
std::optional<OutputFormat> formatOfFile(const std::string& path);

/// Writes `image`, which has the channels R, G and B. EXR keeps every channel (float, or uint32 for the
/// integer ones), the metadata and the chromaticities; PNG and JPEG keep the metadata; PFM and PPM keep
/// neither.
/// Throws crt::Error(Output).
void writeImage(const std::string& path, OutputFormat format, const Image& image);

/// Reads a PFM, PPM (8 or 16 bits), EXR, PNG or Radiance HDR, chosen by content. Channels named by the file;
/// a format without names gives R, G, B (and A), grey ones repeated. 8- and 16-bit colours are decoded from
/// sRGB. Throws crt::Error(Usage).
Image readImage(const std::string& path);

/// Value of a metadata key, or empty.
std::string metadataValue(const Image& image, const std::string& key);

}  // namespace crt
