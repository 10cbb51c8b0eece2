// Group F: stiff transport. The condition number of L = E / (1 − ρ) is ρ / (1 − ρ): what a rounding or a bias does grows with it.
#include "verify/context.h"
#include "verify/scenes.h"

namespace crt::verify {

std::vector<Case> stiffCases() { return {}; }

}  // namespace crt::verify
