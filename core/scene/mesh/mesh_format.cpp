#include "scene/mesh/mesh_format.h"

#include "scene/mesh/obj_text.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

namespace crt {
namespace {

using namespace std::string_view_literals;

struct Signature {
    std::string_view begin;
    const char* format;
};

constexpr std::array kSignatures{
    Signature{"ply\n"sv, "a PLY file"},
    Signature{"ply\r"sv, "a PLY file"},
    Signature{"glTF"sv, "a binary glTF file (.glb)"},
    Signature{"Kaydara FBX Binary"sv, "an FBX file"},
    Signature{"; FBX"sv, "an FBX file"},
    Signature{"BLENDER"sv, "a Blender file"},
    Signature{"#usda"sv, "a USD file"},
    Signature{"PXR-USDC"sv, "a USD file"},
    Signature{"#VRML"sv, "a VRML file"},
    Signature{"OFF\n"sv, "an OFF file"},
    Signature{"OFF\r"sv, "an OFF file"},
    Signature{"COFF\n"sv, "an OFF file"},
    Signature{"solid "sv, "an STL file"},
    Signature{"<?xml"sv, "an XML file (COLLADA, X3D or another format)"},
    Signature{"<COLLADA"sv, "a COLLADA file"},
    Signature{"\x89PNG"sv, "a PNG image"},
    Signature{"\xFF\xD8\xFF"sv, "a JPEG image"},
    Signature{"\x76\x2F\x31\x01"sv, "an OpenEXR image"},
    Signature{"#?RADIANCE"sv, "a Radiance HDR image"},
    Signature{"GIF8"sv, "a GIF image"},
    Signature{"PK\x03\x04"sv, "a ZIP archive (USDZ, 3MF or another format); unpack it first"},
    Signature{"\x1F\x8B"sv, "a gzip archive; unpack it first"},
    Signature{"%PDF"sv, "a PDF file"},
    Signature{"\x7F"
              "ELF"sv,
              "a program"},
    Signature{"crt:"sv, "a scene of crt"},
    Signature{"version https://git-lfs"sv,
              "a pointer of Git LFS to a file that was not fetched: git lfs pull"},
};

/// 80 bytes, a number of triangles, and 50 bytes for each.
bool isBinaryStl(std::string_view content) {
    constexpr std::size_t kHeader = 84, kTriangle = 50;
    if (content.size() < kHeader + kTriangle || (content.size() - kHeader) % kTriangle != 0) return false;
    std::uint32_t triangles = 0;
    for (std::size_t i = 0; i < 4; ++i)
        triangles |= std::uint32_t{static_cast<unsigned char>(content[80 + i])} << (8 * i);
    return (content.size() - kHeader) / kTriangle == triangles;
}

}  // namespace

std::string otherFormat(std::string_view content) {
    if (isBinaryStl(content)) return "an STL file";
    if (content.starts_with("\xEF\xBB\xBF")) content.remove_prefix(3);
    content.remove_prefix(std::min(content.find_first_not_of(" \t\r\n"), content.size()));
    for (const Signature& signature : kSignatures)
        if (content.starts_with(signature.begin)) return signature.format;
    if (content.starts_with('{'))
        return content.substr(0, 4096).find("\"asset\"") != content.npos ? "a glTF file" : "a JSON file";
    return {};
}

bool looksLikeMtl(std::string_view content) {
    TextLines lines(content);
    while (lines.next())
        if (lines.keyword() == "newmtl") return true;
    return false;
}

}  // namespace crt
