#include "compile/table_work.h"

#include "base/error.h"
#include "base/unit_text.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>

namespace crt {
namespace {

/// As the environment has it, or nothing.
std::optional<double> allowedSeconds() {
    const char* const text = std::getenv("CRT_TABLE_SECONDS");
    if (text == nullptr || *text == '\0') return std::nullopt;
    const std::string_view all(text);
    double seconds = 0;
    const auto [end, problem] = std::from_chars(all.data(), all.data() + all.size(), seconds);
    if (problem != std::errc() || end != all.data() + all.size() || !(seconds > 0) || std::isinf(seconds))
        throw Error(ErrorKind::Usage,
                    fmt::format("CRT_TABLE_SECONDS is '{}'; expected a number of seconds such as 60", all));
    return seconds;
}

std::string at(const SourcePlace& place) {
    return place.line > 0 ? fmt::format("{}:{}:{}", place.file, place.line, place.column) : place.file;
}

}  // namespace

void TableWork::add(double steps, const Material& material) {
    if (seconds() <= kMostTableSeconds) last_ = &material;
    steps_ += steps;
    ++tables_;
}

void TableWork::requireBounded() const {
    const std::optional<double> allowed = allowedSeconds();
    if (!allowed && tables_ <= kFewTables) return;
    const double most = allowed.value_or(kMostTableSeconds);
    if (seconds() <= most) return;
    throw Error(ErrorKind::Scene,
                fmt::format("{}: error: the scene has {} rough materials that differ in roughness, index or "
                            "anisotropy; their tables take {} of processor time, and the limit is {}; give "
                            "materials the same values, or set CRT_TABLE_SECONDS={:.0f} to allow it",
                            at(last_->place), tables_, durationText(seconds()), durationText(most),
                            std::ceil(seconds())),
                last_->place);
}

}  // namespace crt
