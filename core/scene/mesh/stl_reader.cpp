#include "scene/mesh/stl_reader.h"

#include "base/input_file.h"
#include "base/log.h"
#include "base/stage.h"
#include "scene/mesh/mesh_rules.h"
#include "scene/mesh/obj_text.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <string_view>
#include <unordered_map>

namespace crt {
namespace {

constexpr std::size_t kHeaderBytes = 80, kCountBytes = 4, kTriangleBytes = 50, kNormalBytes = 12;

using StlCorner = std::array<float, 3>;

struct StlCornerHash {
    std::size_t operator()(const StlCorner& corner) const {
        std::uint64_t hash = 0x9e3779b97f4a7c15u;
        for (const float x : corner) {
            std::uint32_t bits;
            std::memcpy(&bits, &x, sizeof bits);
            hash = (hash ^ bits) * 0xff51afd7ed558ccdu;
            hash ^= hash >> 32;
        }
        return hash;
    }
};

/// Puts the mesh together, triangle by triangle.
class StlMesh {
public:
    explicit StlMesh(const std::string& path) : path_(path) {}

    void add(const std::array<StlCorner, 3>& corners) {
        ++triangles_;
        std::array<std::uint32_t, 3> triangle{};
        for (std::size_t k = 0; k < 3; ++k) {
            for (const float x : corners[k])
                if (!std::isfinite(x)) return void(++not_finite_);
            StlCorner at = corners[k];
            for (float& x : at) x += 0.0f;  // −0 is 0.
            const auto [known, fresh] =
                vertex_of_.try_emplace(at, static_cast<std::uint32_t>(out_.mesh.positions.size()));
            if (fresh) {
                if (out_.mesh.positions.size() >= kNoUv)
                    failMesh("the file has more than four thousand million vertices", path_);
                out_.mesh.positions.push_back({at[0], at[1], at[2]});
            }
            triangle[k] = known->second;
        }
        const auto& p = out_.mesh.positions;
        if (isDegenerate(p[triangle[0]], p[triangle[1]], p[triangle[2]]))
            return void(++out_.degenerate_faces);
        out_.mesh.triangles.push_back(triangle);
    }

    LoadedMesh take() {
        if (triangles_ == 0) failMesh("the file has no triangles", path_);
        if (not_finite_ > 0)
            logWarning("{}: {} left out: their vertices are not finite", path_,
                       counted(not_finite_, "triangle"));
        if (out_.degenerate_faces > 0)
            logWarning("{}: {} without area left out", path_, counted(out_.degenerate_faces, "triangle"));
        if (not_finite_ == triangles_) failMesh("no triangle has finite vertices", path_);
        out_.files = {path_};
        return std::move(out_);
    }

private:
    const std::string& path_;
    LoadedMesh out_;
    std::unordered_map<StlCorner, std::uint32_t, StlCornerHash> vertex_of_;
    std::uint64_t triangles_ = 0, not_finite_ = 0;
};

/// The number of triangles that the header of a binary file says. The content has at least a header.
std::uint64_t countIn(std::string_view content) {
    std::uint32_t count = 0;
    std::memcpy(&count, content.data() + kHeaderBytes, sizeof count);  // little-endian
    return count;
}

bool isBinary(std::string_view content) {
    return content.size() >= kHeaderBytes + kCountBytes &&
           content.size() == kHeaderBytes + kCountBytes + kTriangleBytes * countIn(content);
}

LoadedMesh readBinary(std::string_view content, const std::string& path) {
    StlMesh mesh(path);
    const char* at = content.data() + kHeaderBytes + kCountBytes;
    for (std::uint64_t i = countIn(content); i > 0; --i, at += kTriangleBytes) {
        std::array<StlCorner, 3> corners;
        static_assert(sizeof corners == 36);
        std::memcpy(&corners, at + kNormalBytes, sizeof corners);
        mesh.add(corners);
    }
    return mesh.take();
}

/// Words of an ascii file, with the line that they stand in.
class StlText {
public:
    StlText(std::string_view content, const std::string& path) : content_(content), path_(path) {}

    std::string_view word() {
        while (at_ < content_.size() && isSpace(content_[at_])) line_ += content_[at_++] == '\n';
        const std::size_t first = at_;
        while (at_ < content_.size() && !isSpace(content_[at_])) ++at_;
        return content_.substr(first, at_ - first);
    }
    void skipLine() {
        while (at_ < content_.size() && content_[at_] != '\n') ++at_;
    }
    void expect(std::string_view wanted) {
        const std::string_view found = word();
        if (found != wanted) fail(wanted, found);
    }
    float number() {
        const std::string_view text = word();
        const std::string_view digits = text.starts_with('+') ? text.substr(1) : text;
        float value = 0;
        const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
        if (error == std::errc::result_out_of_range) return std::numeric_limits<float>::infinity();
        if (error != std::errc{} || end != digits.data() + digits.size()) fail("a number", text);
        return value;
    }
    [[noreturn]] void fail(std::string_view wanted, std::string_view found) const {
        failMesh(found.empty() ? fmt::format("the file ends where '{}' should follow", wanted)
                               : fmt::format("'{}' should follow here, found {}", wanted, inQuotes(found)),
                 path_, line_);
    }

private:
    static bool isSpace(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
    std::string_view content_;
    const std::string& path_;
    std::size_t at_ = 0;
    int line_ = 1;
};

LoadedMesh readText(std::string_view content, const std::string& path) {
    StlMesh mesh(path);
    StlText text(content, path);
    for (std::string_view word = text.word(); !word.empty(); word = text.word()) {
        if (word == "solid" || word == "endsolid") {
            text.skipLine();  // a name
            continue;
        }
        if (word != "facet") text.fail("facet", word);
        text.skipLine();  // its normal
        text.expect("outer");
        text.expect("loop");
        std::array<StlCorner, 3> corners{};
        for (StlCorner& corner : corners) {
            text.expect("vertex");
            for (float& x : corner) x = text.number();
        }
        text.expect("endloop");
        text.expect("endfacet");
        mesh.add(corners);
    }
    return mesh.take();
}

}  // namespace

LoadedMesh readStl(const std::string& content, const std::string& path) {
    if (isBinary(content)) return readBinary(content, path);
    if (content.starts_with("solid")) return readText(content, path);
    if (content.size() < kHeaderBytes + kCountBytes)
        failMesh("this is not an STL file: it begins neither with 'solid' nor with a header of 84 bytes",
                 path);
    failMesh(fmt::format("this is not an STL file, or it is damaged: it has {} bytes, and with the {} "
                         "triangles that it says {} would be",
                         content.size(), countIn(content),
                         kHeaderBytes + kCountBytes + kTriangleBytes * countIn(content)),
             path);
}

LoadedMesh loadStl(const std::string& path) {
    const Stage stage("reading " + std::filesystem::path(path).filename().string());
    try {
        return readStl(readInput(path, kMostMeshBytes), path);
    } catch (const InputRefused& refused) {
        failMesh(fmt::format("mesh '{}' {}", path, refused.what()), path);
    }
}

}  // namespace crt
