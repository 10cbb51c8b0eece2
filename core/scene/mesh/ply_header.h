/// The header of a PLY file: which elements it has, with which properties, and how they are written.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace crt {

enum class PlyType : std::uint8_t { Int8, Uint8, Int16, Uint16, Int32, Uint32, Float32, Float64 };

constexpr std::size_t bytesOf(PlyType type) {
    switch (type) {
        case PlyType::Int8:
        case PlyType::Uint8: return 1;
        case PlyType::Int16:
        case PlyType::Uint16: return 2;
        case PlyType::Int32:
        case PlyType::Uint32:
        case PlyType::Float32: return 4;
        case PlyType::Float64: return 8;
    }
    return 0;
}
constexpr bool isInteger(PlyType type) { return type != PlyType::Float32 && type != PlyType::Float64; }

struct PlyProperty {
    std::string name;
    PlyType type;
    std::optional<PlyType> count;  ///< Of a list: the type of its length, an integer.
};

struct PlyElement {
    std::string name;
    std::uint64_t count = 0;
    std::vector<PlyProperty> properties;
    int line = 0;  ///< Of the header.

    const PlyProperty* find(std::string_view property) const;
    /// Bytes of one in a binary file, at least; exactly where it has no lists.
    std::uint64_t leastBytes() const;
    bool hasLists() const;
};

enum class PlyFormat { Ascii, LittleEndian, BigEndian };

struct PlyHeader {
    PlyFormat format = PlyFormat::Ascii;
    char line_end = '\n';               ///< The last character of a line.
    std::vector<PlyElement> elements;   ///< In the order of the file; no two of one name.
    std::vector<std::string> textures;  ///< Files that comments name, as MeshLab writes them.
    std::size_t bytes = 0;              ///< Offset of the first element.
    int lines = 0;

    const PlyElement* find(std::string_view element) const;
};

bool beginsAsPly(std::string_view content);

/// Throws crt::Error(Scene) with file:line for a header that is wrong or does not end.
PlyHeader readPlyHeader(std::string_view content, const std::string& path);

}  // namespace crt
