/// Detects the format of a file that was given as an OBJ.
#pragma once

#include <string>
#include <string_view>

namespace crt {

/// "a PLY file", "a PNG image": by how the file begins. Empty for what may be an OBJ.
std::string otherFormat(std::string_view content);

/// True if a text has materials where an OBJ has faces.
bool looksLikeMtl(std::string_view content);

}  // namespace crt
