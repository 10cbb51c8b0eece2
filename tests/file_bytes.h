/// Whole files as strings, byte by byte.
#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace crt {

inline std::string slurp(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

inline void spit(const std::filesystem::path& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
}

}  // namespace crt
