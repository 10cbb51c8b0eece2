#include "judge/converge/replicate_file.h"

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/input_file.h"

#include <fmt/format.h>

#include <array>
#include <cctype>
#include <filesystem>
#include <fstream>

namespace crt::converge {
namespace {

constexpr std::uint64_t kMagic = 0x32736b6f6f4c5243;  // "CRLooks2"
using Header = std::array<std::uint64_t, 3>;          // Magic, pixels, looks.

}  // namespace

std::string replicateFileName(const Key& key, std::uint32_t replicate) {
    std::string name;
    for (const char c : fmt::format("{}-{}-{}", key.scene, key.backend, key.variant)) {
        const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_' ||
                           c == '.' || c == ',';
        name += plain ? std::string(1, c) : fmt::format("%{:02x}", static_cast<unsigned char>(c));
    }
    return fmt::format("{}-{}.looks", name, replicate);
}

void writeReplicate(const std::string& path, const StoredReplicate& replicate) {
    if (const auto folder = std::filesystem::path(path).parent_path(); !folder.empty())
        makeOutputFolder(folder.string());
    AtomicFile file(path);
    const Header header{kMagic, replicate.standard_error.size(), replicate.looks.size()};
    file.write(header.data(), sizeof header);
    for (const auto& [samples, plane] : replicate.looks) {
        file.write(&samples, sizeof samples);
        file.write(plane.data(), plane.size() * sizeof(float));
    }
    file.write(replicate.rgb.data(), replicate.rgb.size() * sizeof(float));
    file.write(replicate.standard_error.data(), replicate.standard_error.size() * sizeof(float));
    file.commit();
}

std::optional<StoredReplicate> readReplicate(const std::string& path, std::size_t pixels) {
    try {
        requireInput(path);
    } catch (const InputRefused&) {
        return std::nullopt;
    }
    std::ifstream file(path, std::ios::binary);
    Header header{};
    std::error_code error;
    const std::uintmax_t bytes = std::filesystem::file_size(path, error);
    const bool begins =
        !error && file.read(reinterpret_cast<char*>(header.data()), sizeof header) && header[0] == kMagic;
    // No more looks than powers of two, and exactly the bytes that they take.
    const bool fits = begins && header[1] == pixels && header[2] >= 1 && header[2] <= 64 &&
                      bytes == sizeof header + header[2] * (sizeof(std::uint64_t) + pixels * sizeof(float)) +
                                   4 * pixels * sizeof(float);
    StoredReplicate replicate;
    const auto read = [&](std::vector<float>& values, std::size_t count) {
        values.resize(count);
        file.read(reinterpret_cast<char*>(values.data()),
                  static_cast<std::streamsize>(count * sizeof(float)));
    };
    for (std::uint64_t look = 0; fits && look < header[2]; ++look) {
        auto& [samples, plane] = replicate.looks.emplace_back();
        file.read(reinterpret_cast<char*>(&samples), sizeof samples);
        read(plane, pixels);
    }
    if (fits) {
        read(replicate.rgb, 3 * pixels);
        read(replicate.standard_error, pixels);
    }
    if (!fits || !file)
        throw Error(ErrorKind::Usage,
                    fmt::format("'{}' is not a replicate of this run ({} pixels are expected); remove it, "
                                "or choose another folder",
                                path, pixels),
                    {path});
    return replicate;
}

}  // namespace crt::converge
