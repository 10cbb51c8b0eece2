/// The denoiser of crt's Python package.
#pragma once

#include <string>
#include <vector>

namespace crt {

/// Puts the program that denoises a film into `outputs` in the place of this process; `bare`: without albedo
/// and normal. Throws crt::Error(Usage) where there is none.
void becomeDenoiser(const std::string& film, const std::vector<std::string>& outputs, bool bare);

}  // namespace crt
