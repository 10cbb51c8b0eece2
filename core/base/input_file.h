/// Input files: regular files only, whole, and no larger than their reader can use. A named pipe, /dev/zero
/// or a sparse file of a terabyte is refused at once, where std::ifstream would wait for ever or fill the
/// memory.
#pragma once

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace crt {

/// Reason why a file is not read. what() follows the file's name: "is a directory", "cannot be opened:
/// Permission denied".
class InputRefused : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// Bounds by kind, far beyond what people make: a larger file cannot be of this kind.
inline constexpr std::uint64_t kMostSceneBytes = std::uint64_t{256} << 20;
inline constexpr std::uint64_t kMostMeshBytes = std::uint64_t{32} << 30;
inline constexpr std::uint64_t kMostMaterialBytes = std::uint64_t{64} << 20;
inline constexpr std::uint64_t kMostSpectrumBytes = std::uint64_t{16} << 20;
inline constexpr std::uint64_t kMostImageBytes = std::uint64_t{32} << 30;
inline constexpr std::uint64_t kMostTableBytes =
    std::uint64_t{1} << 30;  ///< Results and experiments of `crt converge` and `crt verify`.

/// Opens a regular file for reading and returns its descriptor, which the caller closes. Never waits. Throws
/// InputRefused.
int openInput(const std::string& path);

/// The same for libraries that open the file themselves: throws InputRefused unless `path` is a regular file
/// that can be read.
void requireInput(const std::string& path);

/// The path without "." and "..", where that still names the same file: behind a symbolic link ".." leads
/// elsewhere.
std::string plainPath(const std::filesystem::path& path);

/// The content of a regular file of at most `most_bytes`. Throws InputRefused.
std::string readInput(const std::string& path, std::uint64_t most_bytes);

/// Everything on standard input, which may be a pipe. Throws InputRefused.
std::string readStandardInput(std::uint64_t most_bytes);

}  // namespace crt
