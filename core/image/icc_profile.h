/// Colour profiles that are embedded in images (ICC.1:2010). crt does not apply them; it reports those whose
/// colours are not those of sRGB. Part of the image module (image_module.h).
#pragma once

#include <string>
#include <string_view>

namespace crt::image {

/// Empty if the colours of `profile` are those of sRGB, within a hundredth of white. For others their name:
/// the one in the profile, or `otherwise`.
std::string nameUnlessSrgb(std::string_view profile, std::string_view otherwise);

/// The same for the content of a PNG's iCCP: a name, and the profile compressed.
std::string nameUnlessSrgbOfPng(std::string_view chunk);

}  // namespace crt::image
