#include "view/file_times.h"

#include <algorithm>
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

FileTimes::FileTimes(const std::vector<std::string>& files, const FileTimes& earlier) {
    for (const std::string& file : files) {
        const auto found = earlier.noted_.find(file);
        noted_[file] = found != earlier.noted_.end() ? found->second : stateOf(file);
    }
}

bool FileTimes::changed() const {
    return std::any_of(noted_.begin(), noted_.end(),
                       [](const auto& noted) { return stateOf(noted.first) != noted.second; });
}

}  // namespace crt
