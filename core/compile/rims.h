/// Rims of shapes that other surfaces touch. A shape has the size that the author gave it. Where its rim
/// lies on another surface, as in a can, rounding would let rays slip between the two: there, and only
/// there, it gets a lip of rounding size.
#pragma once

#include "compile/flatten.h"

namespace crt {

/// Sets the lips in the records of `flat`, whose triangles, shapes and instances have all been placed.
/// `shapes`: those of `flat`, in the author's units. An instance touches what comes into its box.
void closeRims(FlatScene& flat, const std::vector<PlacedShape>& shapes);

}  // namespace crt
