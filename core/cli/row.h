/// Lines of a name and a value, as the commands that describe something print them.
#pragma once

#include <cstdint>
#include <string>

namespace crt {

/// "name      value", one per line; further lines of a value stand under the first.
void printRow(const char* name, const std::string& value);

/// "1 triangle", "2 triangles".
std::string counted(std::uint64_t n, const char* one, const char* many);

}  // namespace crt
