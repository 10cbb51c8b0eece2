/// PNG files of 8 bits without compression: what is made at build time needs no library for it.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>

namespace crt::meshgen {

using Rgb = std::array<double, 3>;  ///< 0 to 1, as it is stored.

/// `color` of (u, v), each from 0 to 1, v from the top row down.
std::string pngOf(unsigned width, unsigned height, const std::function<Rgb(double u, double v)>& color);

}  // namespace crt::meshgen
