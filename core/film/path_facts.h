/// Properties of a film's paths that its sums do not contain. Error estimates need them.
#pragma once

#include "compile/brightest_path.h"

namespace crt {

struct PathFacts {
    bool independent = false;  ///< Samples are not of a Sobol sequence: their spread is no mere bound.
    BrightestPath brightest{};
};

}  // namespace crt
