/// Temporary files and folders.
#pragma once

#include "base/error.h"
#include "base/temporary_pattern.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <system_error>

namespace crt {

/// An empty folder, gone with the object.
class TemporaryFolder {
public:
    /// Throws crt::Error(Output) when `parent` takes no folder.
    explicit TemporaryFolder(const std::filesystem::path& parent = std::filesystem::temp_directory_path()) {
        std::string pattern = temporaryPattern(parent);
        if (::mkdtemp(pattern.data()) == nullptr)
            throw Error(ErrorKind::Output, fmt::format("cannot make a folder in '{}': {}", parent.string(),
                                                       std::strerror(errno)));
        path_ = pattern;
    }
    ~TemporaryFolder() {
        std::error_code ignored;
        std::filesystem::permissions(path_, std::filesystem::perms::owner_all,
                                     ignored);  // Some tests take them away.
        std::filesystem::remove_all(path_, ignored);
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    std::string path() const { return path_.string(); }
    /// Path of what is, or shall be, in it.
    std::string operator/(const std::string& name) const { return (path_ / name).string(); }
    /// Writes a file and returns its path.
    std::string write(const std::string& name, const std::string& text) const {
        std::ofstream(path_ / name, std::ios::binary) << text;
        return *this / name;
    }
    /// Files and folders right in it.
    std::size_t fileCount() const {
        return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(path_),
                                                      std::filesystem::directory_iterator()));
    }

private:
    std::filesystem::path path_;
};

}  // namespace crt
