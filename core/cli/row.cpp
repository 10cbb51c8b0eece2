#include "cli/row.h"

#include "base/standard_output.h"
#include "base/words.h"

#include <fmt/format.h>

namespace crt {

void printRow(const char* name, const std::string& value) {
    constexpr int kColumn = 14;
    std::string indented;
    for (const char c : printable(value)) {
        indented += c;
        if (c == '\n') indented.append(kColumn + 2, ' ');
    }
    printOut("  {:<{}} {}\n", printable(name), kColumn - 1, indented);
}

std::string counted(std::uint64_t n, const char* one, const char* many) {
    return fmt::format("{} {}", n, n == 1 ? one : many);
}

}  // namespace crt
