#include "view/file_times.h"

#include <algorithm>
#include <chrono>
#include <limits>
#include <system_error>

namespace crt {

std::optional<FileTimes::State> FileTimes::stateOf(const std::string& file) {
    std::error_code none;
    State state;
    state.time = std::filesystem::last_write_time(file, none);
    if (none) return std::nullopt;
    state.bytes = std::filesystem::file_size(file, none);
    if (none) state.bytes = 0;  // A folder, or gone meanwhile: the next look tells.
    return state;
}

FileTimes::FileTimes(const std::vector<std::string>& files, const FileTimes& earlier, Time began) {
    // File systems stamp files with a clock that lags behind, by a hundredth of a second at most.
    constexpr std::chrono::milliseconds kLag{20};
    constexpr std::uintmax_t kUnknown = std::numeric_limits<std::uintmax_t>::max();
    for (const std::string& file : files) {
        const auto found = earlier.noted_.find(file);
        std::optional<State>& state = noted_[file];
        state = found != earlier.noted_.end() ? found->second : stateOf(file);
        if (found == earlier.noted_.end() && state && state->time + kLag >= began) state->bytes = kUnknown;
    }
}

bool FileTimes::changed() const {
    return std::any_of(noted_.begin(), noted_.end(),
                       [](const auto& noted) { return stateOf(noted.first) != noted.second; });
}

}  // namespace crt
