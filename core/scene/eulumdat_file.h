/// Photometric files of luminaires, EULUMDAT (A. Stockmar, 1990): one value a line, the C planes of a
/// luminaire with one of five symmetries. Candelas are those per 1,000 lm times the lumens of the first set
/// of lamps and the factor of conversion.
#pragma once

#include "scene/ies_file.h"

#include <string>
#include <string_view>

namespace crt {

/// `name` as in messages. Throws crt::Error(Scene) with its line.
IesProfile parseEulumdat(std::string_view text, const std::string& name);

}  // namespace crt
