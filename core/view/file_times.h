/// Detects changes of files by the time of their last change and their size.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace crt {

class FileTimes {
public:
    FileTimes() = default;
    using Time = std::filesystem::file_time_type;

    /// Notes how the files are now; of those that `earlier` has noted, what it noted. Others count as
    /// changed if they changed from `began` on, when reading them began: perhaps it read their old contents.
    explicit FileTimes(const std::vector<std::string>& files, const FileTimes& earlier = {},
                       Time began = Time::max());

    /// True if one of them differs from its noted state: changed, gone, or there again.
    bool changed() const;

private:
    struct State {
        Time time{};
        std::uintmax_t bytes = 0;
        bool operator==(const State&) const = default;
    };
    static std::optional<State> stateOf(const std::string& file);

    std::map<std::string, std::optional<State>> noted_;
};

}  // namespace crt
