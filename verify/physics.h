/// The wrong physics that wrong figures point to.
#pragma once

#include "verify/context.h"

#include <string>
#include <vector>

namespace crt::verify {

/// One sentence about `measured` where `expected` should be: the mistake whose value it matches (within a
/// per cent, or within `uncertainty` if that is more), or else what its ratio to the right value suggests.
std::string diagnose(double measured, double expected, double uncertainty,
                     const std::vector<Mistake>& mistakes);

}  // namespace crt::verify
