/// What a film's sums do not say of its paths, and estimates of its error ask for.
#pragma once

#include "compile/brightest_path.h"

namespace crt {

struct PathFacts {
    bool independent = false;  ///< Samples are not of a Sobol sequence: their spread is no mere bound.
    BrightestPath brightest{};
};

}  // namespace crt
