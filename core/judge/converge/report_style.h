/// The page's style sheet, plots excepted.
#pragma once

#include <string>

namespace crt::converge {

std::string pageCss();

}  // namespace crt::converge
