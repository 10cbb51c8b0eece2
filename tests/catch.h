/// Catch2, version 2 (Debian 12, Ubuntu 22.04) or 3 (later ones): what the tests use of it, under the same
/// names.
#pragma once

#include <string>

#if __has_include(<catch2/catch_all.hpp>)

#include <catch2/catch_all.hpp>

using Catch::Approx;

/// The matcher of strings; version 3 has given this name to one of ranges.
inline auto Contains(const std::string& text) {
    return Catch::Matchers::ContainsSubstring(text);
}

#else

#include <catch2/catch.hpp>

namespace Catch {
namespace clara {}
namespace Clara = clara;
}  // namespace Catch

inline auto Contains(const std::string& text) {
    return Catch::Matchers::Contains(text);
}

#endif
