// Over 450 lines: every way to write a PLY well, and every way to write it badly.
// PLY: every way to write the same mesh, what it becomes, what is left out, and that every refusal names the
// place.
#include "base/error.h"
#include "base/parallel.h"
#include "base/stage.h"
#include "base/temporary_folder.h"
#include "captured_log.h"
#include "catch.h"
#include "refused_file.h"
#include "scene/mesh/ply_reader.h"
#include "scene_texts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

using namespace crt;
using crt::TemporaryFolder;
using crt::test::CapturedLog;
using crt::test::parse;
using crt::test::refused;

namespace {

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

LoadedMesh loadText(const std::string& text, const PlyOptions& options = {}) {
    const TemporaryFolder folder;
    return loadPly(folder.write("mesh.ply", text), options);
}

void checkRefused(const std::string& text, int line, const std::string& words) {
    crt::test::checkRefusedFile("mesh.ply", text, line, words,
                                [](const std::string& path) { loadPly(path); });
}

/// Writes numbers as a type says: text, or bytes of either order.
class PlyWriter {
public:
    PlyWriter(const std::string& format, const std::string& header)
        : text_(format == "ascii"), big_(format == "binary_big_endian") {
        content = "ply\nformat " + format + " 1.0\n" + header + "end_header\n";
    }
    PlyWriter& add(const std::string& type, double value) {
        if (text_)
            content += fmt::format("{} ", value);
        else if (type == "char")
            bytes(static_cast<std::int8_t>(value));
        else if (type == "uchar")
            bytes(static_cast<std::uint8_t>(value));
        else if (type == "short")
            bytes(static_cast<std::int16_t>(value));
        else if (type == "ushort")
            bytes(static_cast<std::uint16_t>(value));
        else if (type == "int")
            bytes(static_cast<std::int32_t>(value));
        else if (type == "uint")
            bytes(static_cast<std::uint32_t>(value));
        else if (type == "float")
            bytes(static_cast<float>(value));
        else
            bytes(value);
        return *this;
    }
    PlyWriter& end() {
        if (text_) content += '\n';
        return *this;
    }
    std::string content;

private:
    template <class T>
    void bytes(T value) {
        char raw[sizeof value];
        std::memcpy(raw, &value, sizeof value);
        if (big_) std::reverse(std::begin(raw), std::end(raw));
        content.append(raw, sizeof value);
    }
    bool text_, big_;
};

constexpr const char* kFormats[] = {"ascii", "binary_little_endian", "binary_big_endian"};

const std::string kHeader =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
const std::string kVertices = "0 0 0\n1 0 0\n0 1 0\n";

/// A header of vertices with these properties beside their positions, and of faces.
std::string headerWith(const std::string& vertex, int vertices, const std::string& face, int faces) {
    return fmt::format(
        "element vertex {}\nproperty float x\nproperty float y\nproperty float z\n{}element face {}\n{}",
        vertices, vertex, faces, face);
}
const std::string kIndices = "property list uchar int vertex_indices\n";

}  // namespace

TEST_CASE("a PLY of any format and any types is the same mesh", "[ply]") {
    for (const char* format : kFormats)
        for (const char* number : {"char", "uchar", "short", "ushort", "int", "uint", "float", "double"})
            for (const char* count : {"char", "uchar", "short", "ushort", "int", "uint"})
                for (const char* index : {"char", "uchar", "short", "ushort", "int", "uint"}) {
                    CAPTURE(format, number, count, index);
                    PlyWriter ply(format,
                                  fmt::format("comment made by hand\nelement vertex 4\nproperty {0} x\n"
                                              "property {0} y\nproperty {0} z\nelement face 2\n"
                                              "property list {1} {2} vertex_index\n",
                                              number, count, index));
                    for (const Vec3d& p : {Vec3d{0, 0, 7}, {1, 0, 7}, {1, 2, 7}, {0, 2, 7}})
                        ply.add(number, p[0]).add(number, p[1]).add(number, p[2]).end();
                    ply.add(count, 3).add(index, 0).add(index, 1).add(index, 2).end();
                    ply.add(count, 3).add(index, 0).add(index, 2).add(index, 3).end();
                    const CapturedLog log;
                    const LoadedMesh m = loadText(ply.content);
                    CHECK(m.mesh.positions ==
                          std::vector<Vec3d>{{0, 0, 7}, {1, 0, 7}, {1, 2, 7}, {0, 2, 7}});
                    CHECK(m.mesh.triangles == Triangles{{0, 1, 2}, {0, 2, 3}});
                    CHECK((m.mesh.normals.empty() && m.mesh.uvs.empty() && m.mesh.colors.empty()));
                    CHECK((m.materials.empty() && m.mesh.material.empty() && m.files.size() == 1));
                    CHECK(log.warnings() == 0);
                }
}

TEST_CASE("properties and elements of a PLY may come in any order, with others between", "[ply]") {
    for (const char* format : kFormats) {
        CAPTURE(format);
        PlyWriter ply(
            format,
            "obj_info scanned\nelement camera 1\nproperty float view\nproperty list uchar short ids\n"
            "element face 1\nproperty uchar flags\nproperty list ushort uint vertex_indices\n"
            "property list uchar float weights\n"
            "element nothing 99999999\nelement vertex 3\nproperty double z\nproperty list int char "
            "notes\nproperty float x\nproperty uchar y\nelement edge 1\nproperty int a\n");
        ply.add("float", 3).add("uchar", 2).add("short", -1).add("short", 5).end();
        ply.add("uchar", 9).add("ushort", 3).add("uint", 2).add("uint", 0).add("uint", 1).add("uchar", 1);
        ply.add("float", .5).end();
        ply.add("double", 1e3).add("int", 0).add("float", .25).add("uchar", 200).end();
        ply.add("double", 0)
            .add("int", 2)
            .add("char", 1)
            .add("char", -2)
            .add("float", 1)
            .add("uchar", 0)
            .end();
        ply.add("double", 0).add("int", 0).add("float", 0).add("uchar", 1).end();
        ply.add("int", 4).end();
        const CapturedLog log;
        const LoadedMesh m = loadText(ply.content);
        CHECK(m.mesh.positions == std::vector<Vec3d>{{.25, 200, 1e3}, {1, 0, 0}, {0, 1, 0}});
        CHECK(m.mesh.triangles == Triangles{{2, 0, 1}});
        CHECK(log.warnings() == 1);
        CHECK_THAT(log.text(),
                   Contains("mesh.ply: left out: 'notes' of vertices; 'flags', 'weights' of faces; "
                            "1 of 'camera'; 99999999 of 'nothing'; 1 of 'edge'"));
    }
}

TEST_CASE("lines of a PLY may end as those of any system", "[ply]") {
    for (const std::string end : {"\n", "\r\n", "\r"}) {
        CAPTURE(end.size(), int(end[0]));
        std::string text;
        for (const char c : kHeader + "\n" + kVertices + "3 0 1 2")
            text += c == '\n' ? end : std::string(1, c);
        CHECK(loadText(text).mesh.triangles == Triangles{{0, 1, 2}});
    }
    // After a header with lone '\r' a binary '\n' is data: 10 is the lowest byte of x.
    PlyWriter ply("binary_little_endian", headerWith("", 3, kIndices, 1));
    std::replace(ply.content.begin(), ply.content.end(), '\n', '\r');
    const float x = 3.0000024f;  // 0x4040000a
    ply.add("float", x).add("float", 0).add("float", 0);
    for (const double p : {1, 0, 0, 0, 1, 0}) ply.add("float", p);
    ply.add("uchar", 3).add("int", 0).add("int", 1).add("int", 2);
    CHECK(loadText(ply.content).mesh.positions[0][0] == x);
}

TEST_CASE("normals, texture coordinates and colours of a PLY", "[ply]") {
    const std::string faces = kIndices;
    for (const char* format : kFormats) {
        CAPTURE(format);
        PlyWriter ply(format,
                      headerWith("property float s\nproperty float t\nproperty uchar red\nproperty uchar "
                                 "green\nproperty uchar blue\nproperty uchar alpha\nproperty float nx\n"
                                 "property float ny\nproperty float nz\n",
                                 3, faces, 1));
        const std::vector<Vec3d> p{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
        for (int i = 0; i < 3; ++i) {
            for (const double x : p[static_cast<std::size_t>(i)]) ply.add("float", x);
            ply.add("float", i).add("float", .5);
            ply.add("uchar", 255).add("uchar", 128).add("uchar", 51 * i).add("uchar", 255);
            ply.add("float", 0).add("float", 3).add("float", 4).end();
        }
        ply.add("uchar", 3).add("int", 2).add("int", 0).add("int", 1).end();
        const CapturedLog log;
        const Mesh mesh = loadText(ply.content).mesh;
        CHECK(log.warnings() == 0);
        CHECK(mesh.uvs == std::vector<std::array<double, 2>>{{0, .5}, {1, .5}, {2, .5}});
        CHECK(mesh.uv_index == Triangles{{2, 0, 1}});
        CHECK(mesh.normal_index == Triangles{{2, 0, 1}});
        REQUIRE(mesh.normals.size() == 3);
        CHECK(mesh.normals[0][1] == Approx(.6));
        CHECK(mesh.normals[0][2] == Approx(.8));
        REQUIRE(mesh.colors.size() == 3);
        CHECK(mesh.colors[0][0] == 1.0f);
        CHECK(mesh.colors[2][1] == static_cast<float>(srgbToLinear(128 / 255.0)));
        CHECK(mesh.colors[2][2] == static_cast<float>(srgbToLinear(.4)));
        const Mesh linear = loadText(ply.content, {PlyColor::Linear}).mesh;
        CHECK(linear.colors[2][2] == .4f);
    }
    // Floats are linear unless they are said to be sRGB.
    PlyWriter ply("ascii",
                  headerWith("property float r\nproperty float g\nproperty float b\nproperty float u\n"
                             "property float v\n",
                             3, faces, 1));
    ply.content += "0 0 0 .5 0 1 0 0\n1 0 0 0 0 0 1 0\n0 1 0 0 0 0 1 1\n3 0 1 2\n";
    CHECK(loadText(ply.content).mesh.colors[0] == std::array<float, 3>{.5f, 0, 1});
    CHECK(loadText(ply.content).mesh.uvs[2] == std::array<double, 2>{1, 1});
    CHECK(loadText(ply.content, {PlyColor::Srgb}).mesh.colors[0][0] == static_cast<float>(srgbToLinear(.5)));
}

TEST_CASE("faces of a PLY may have texture coordinates of their own, as MeshLab writes them", "[ply]") {
    const std::string header = headerWith("", 4, kIndices + "property list uchar float texcoord\n", 3)
                                   .insert(0, "comment TextureFile skin.png\n");
    PlyWriter ply("ascii", header);
    ply.content +=
        "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
        "4 0 1 2 3 8 0 0 .5 0 .5 1 0 1\n3 0 1 2 0\n3 2 1 0 6 .1 .2 .3 .4 .5 .6\n";
    const CapturedLog log;
    const Mesh mesh = loadText(ply.content).mesh;
    CHECK(mesh.triangles == Triangles{{0, 1, 2}, {0, 2, 3}, {0, 1, 2}, {2, 1, 0}});
    REQUIRE(mesh.uvs.size() == 7);
    CHECK(mesh.uv_index == Triangles{{0, 1, 2}, {0, 2, 3}, {kNoUv, kNoUv, kNoUv}, {4, 5, 6}});
    CHECK(mesh.uvs[2] == std::array<double, 2>{.5, 1});
    CHECK(mesh.uvs[6] == std::array<double, 2>{.5, .6});
    CHECK_THAT(log.text(), Contains("the texture 'skin.png', which a comment mentions"));
}

TEST_CASE("polygons of a PLY are divided as those of an OBJ", "[ply]") {
    // A concave one, whose fan would cover its notch.
    PlyWriter ply("ascii", headerWith("", 4, kIndices, 1));
    ply.content += "0 0 0\n2 2 0\n0 4 0\n1 2 0\n4 0 1 2 3\n";
    const Mesh mesh = loadText(ply.content).mesh;
    REQUIRE(mesh.triangles.size() == 2);
    double area = 0;
    for (const auto& t : mesh.triangles) {
        const Vec3d &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
        area += .5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
    }
    CHECK(area == Approx(2));
}

TEST_CASE("what is wrong in a PLY costs what it concerns, and is said", "[ply]") {
    struct Case {
        std::string vertex, face, rows;
        std::size_t triangles;
        const char* said;
    };
    const std::string normals = "property float nx\nproperty float ny\nproperty float nz\n";
    for (const Case& c : {
             Case{"", kIndices, "0 0 0\n1 0 0\n0 1 0\nnan 1 0\n3 0 1 2\n3 0 1 3\n", 1,
                  "mesh.ply:13: the position of vertex 3 is not finite; 1 face left out for such "
                  "vertices"},
             {"", kIndices, "0 0 0\n1 0 0\n0 1 0\n1,5 1 0\n3 0 1 2\n3 0 1 3\n", 1, "position of vertex 3"},
             {"", kIndices, "0 0 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2\n2 0 1\n", 1,
              "mesh.ply:15: a face needs at least three corners, and face 1 has 2; 1 face left out"},
             {"", kIndices, "0 0 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2\n0\n", 1,
              "and face 1 has 0; 1 face left out"},
             {"", kIndices, "0 0 0\n1 0 0\n0 1 0\n2 0 0\n3 0 1 2\n3 0 1 3\n", 1,
              "mesh.ply: 1 triangle without area left out"},
             {normals, kIndices, "0 0 0 0 0 1\n1 0 0 0 0 2\n0 1 0 0 0 1\n1 1 0 0 0 0\n3 0 1 2\n3 1 3 2\n", 2,
              "mesh.ply: 1 face shaded flat: one of their normals has no direction"},
             {normals, kIndices, "0 0 0 0 0 1\n1 0 0 0 0 2\n0 1 0 0 0 1\n1 1 0 0 inf 0\n3 0 1 2\n3 1 3 2\n",
              2,
              "mesh.ply:16: the normal of vertex 3 is not finite; 1 face shaded flat for such "
              "normals"},
             {"property float u\nproperty float v\n", kIndices,
              "0 0 0 0 0\n1 0 0 1 nan\n0 1 0 0 1\n1 1 0 1e9 0\n3 0 1 2\n3 1 3 2\n", 2,
              "those of vertex 1 are not; as 2 pairs in all, which are left out"},
             {"", kIndices + "property list uchar float texcoord\n",
              "0 0 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2 6 0 0 1 0 0 1\n3 1 3 2 2 0 0\n", 2,
              "face 1 has 3 corners, and 2 numbers in 'texcoord'"},
             {"property float red\nproperty float green\nproperty float blue\n", kIndices,
              "0 0 0 0 0 0\n1 0 0 2 0 0\n0 1 0 0 -1 0\n1 1 0 0 0 nan\n3 0 1 2\n3 1 3 2\n", 2,
              "colours must lie between 0 and 1, and vertex 1 has 2; clamped, as 3 numbers in all"},
             {"property uchar alpha\nproperty float confidence\n", kIndices,
              "0 0 0 255 1\n1 0 0 254 1\n0 1 0 255 1\n1 1 0 255 1\n3 0 1 2\n3 1 3 2\n", 2,
              "left out: 'confidence' of vertices; 'alpha' of vertices"},
             {"", kIndices, "0 0 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2\n3 1 3 2\n3 0 1 3\n", 2,
              "left out: 8 bytes after the last element"},
         }) {
        CAPTURE(c.rows);
        PlyWriter ply("ascii", headerWith(c.vertex, 4, c.face, 2));
        ply.content += c.rows;
        const CapturedLog log;
        const Mesh mesh = loadText(ply.content).mesh;
        CHECK(mesh.triangles.size() == c.triangles);
        CHECK(log.warnings() == 1);
        CHECK_THAT(log.text(), Contains(c.said));
        for (const Vec3d& p : mesh.positions) CHECK(std::isfinite(p[0] + p[1] + p[2]));
        for (const Vec3d& n : mesh.normals) CHECK(std::isfinite(n[0] + n[1] + n[2]));
        if (!mesh.normal_index.empty())
            CHECK(mesh.normal_index == Triangles{{0, 1, 2}, {kNoNormal, kNoNormal, kNoNormal}});
    }
}

TEST_CASE("bad PLYs are refused with their place", "[ply]") {
    const std::string face = "3 0 1 2\n";
    const auto with = [](std::string text, const std::string& from, const std::string& to) {
        const std::size_t at = text.find(from);
        REQUIRE(at != std::string::npos);
        return text.replace(at, from.size(), to);
    };
    // Headers
    checkRefused("ply\nformat ascii 1.0\nelement vertex 3\n", 4, "the header of this PLY does not end");
    checkRefused("ply\nend_header\n", 2, "lacks the format");
    checkRefused(with(kHeader, "ascii", "binary"), 2,
                 "is ascii, binary_little_endian or binary_big_endian, not 'binary'");
    checkRefused(with(kHeader, "1.0", "2.0"), 2, "crt reads version 1.0 of PLY, not '2.0'");
    checkRefused(with(kHeader, "element vertex 3", "element vertex -3"), 3,
                 "an element needs a name and a number");
    checkRefused(with(kHeader, "element vertex 3", "element vertex"), 3,
                 "an element needs a name and a number");
    checkRefused(with(kHeader, "element face", "element vertex"), 7, "the element 'vertex' occurs twice");
    checkRefused(with(kHeader, "float y", "float x"), 5, "the property 'x' of 'vertex' occurs twice");
    checkRefused(with(kHeader, "float y", "real y"), 5, "'real' is not a PLY type");
    checkRefused(with(kHeader, "float y", "float"), 5, "a property needs a type and a name");
    checkRefused(with(kHeader, "list uchar", "list float"), 8, "the length of a list is an integer");
    checkRefused(with(kHeader, "element vertex 3\n", ""), 3, "a property precedes the first element");
    checkRefused(with(kHeader, "property float y", "colour float y"), 5,
                 "'colour' is not a statement of a PLY header");
    checkRefused(with(kHeader, "float y", "float w"), 3, "vertices need the numbers x, y and z");
    checkRefused(with(kHeader, "vertex_indices", "indices"), 7,
                 "faces need a list 'vertex_indices' or 'vertex_index'");
    checkRefused(with(kHeader, "uchar int", "uchar float"), 7,
                 "the indices of 'vertex_indices' are integers, not floats");
    checkRefused(with(kHeader, "element face", "element tristrips") + kVertices + face, 0,
                 "the faces of this mesh are strips of triangles (tristrips), which crt does not read");
    checkRefused(with(kHeader, "element face", "element polygon"), 0,
                 "this mesh has no element 'face', only 3 of 'vertex', 1 of 'polygon'");
    // Counts
    checkRefused(
        with(kHeader, "vertex 3", "vertex 18446744073709551615") + kVertices + face, 3,
        "the header says 18446744073709551615 of 'vertex', 6 bytes each or more, and 26 bytes follow");
    checkRefused(with(kHeader, "face 1", "face 4000000000") + kVertices + face, 7,
                 "the header says 4000000000 of 'face'");
    checkRefused(kHeader + kVertices, 7,
                 "the header says 1 of 'face', 2 bytes each or more, and 0 bytes follow");
    checkRefused(with(kHeader, "face 1", "face 3") + kVertices + face, 13,
                 "face 1 of 3, counted from 0, is missing: the file ends before it");
    // Rows
    checkRefused(kHeader + "0 0 0\n1 0\n0 1 0\n" + face, 11,
                 "vertex 1 of 3, counted from 0, has too few values on its line");
    checkRefused(kHeader + kVertices + "3 0 1\n", 13, "face 0 of 1, counted from 0, has too few values");
    checkRefused(kHeader + kVertices + "-3 0 1 2\n", 13, "has a list of -3 values");
    checkRefused(kHeader + kVertices + "4000000000 0 1 2\n", 13,
                 "has a list of 4000000000 values, and fewer");
    checkRefused(kHeader + kVertices + "3 0 1 x\n", 13, "has 'x' where a whole number is expected");
    checkRefused(kHeader + kVertices + "3 0 1 1.5\n", 13, "has '1.5' where a whole number is expected");
    checkRefused(kHeader + kVertices + "3 0 1 3\n", 13, "uses vertex 3, but the file has 3");
    checkRefused(kHeader + kVertices + "3 0 -1 2\n", 13, "uses vertex -1, but the file has 3");
    CHECK(loadText(kHeader + kVertices + "3.0 0 1.000 2\n").mesh.triangles == Triangles{{0, 1, 2}});
    // A file of faces without area is sound; its user decides what that means.
    for (const char* only : {"3 0 1 1\n", "3 0 0 1\n"}) {
        const LoadedMesh nothing = loadText(kHeader + kVertices + only);
        CHECK(nothing.mesh.triangles.empty());
        CHECK(nothing.degenerate_faces == 1);
    }
    // Invisible meshes
    checkRefused(kHeader + kVertices + "2 0 1\n", 13,
                 "a face needs at least three corners, and face 0 has 2");
    checkRefused(kHeader + "nan 0 0\n1 0 0\n0 1 0\n" + face, 10,
                 "the position of vertex 0 is not finite");
    checkRefused(with(kHeader, "face 1", "face 0") + kVertices, 0, "this mesh has no faces, only 3 points");
    // Other files
    checkRefused("v 0 0 0\n", 0,
                 "this is not a PLY file, because its first line is not 'ply'; for an OBJ use 'obj:'");
    checkRefused("\x89PNG\r\n", 0, "this is a PNG image; 'ply:' needs a PLY file");
    checkRefused("", 0, "this is not a PLY file");
}

TEST_CASE("a binary PLY that ends early, anywhere, is refused", "[ply]") {
    for (const char* format : {"binary_little_endian", "binary_big_endian"}) {
        PlyWriter ply(format, headerWith("property list uchar float more\n", 3,
                                         kIndices + "property list int float texcoord\n", 2));
        const std::size_t header = ply.content.size();
        for (const double p : {0, 0, 0, 1, 0, 0, 0, 1, 0}) {
            ply.add("float", p);
            if ((ply.content.size() - header) % 13 == 12) ply.add("uchar", 0);
        }
        for (int face = 0; face < 2; ++face) {
            ply.add("uchar", 3).add("int", 0).add("int", 1).add("int", 2).add("int", 6);
            for (int i = 0; i < 6; ++i) ply.add("float", i);
        }
        CHECK(loadText(ply.content).mesh.triangles.size() == 2);
        for (std::size_t size = header; size < ply.content.size(); ++size) {
            CAPTURE(size);
            const TemporaryFolder folder;
            CHECK_THROWS_WITH(loadPly(folder.write("a.ply", ply.content.substr(0, size))),
                              Contains("bytes follow") || Contains("cut off"));
        }
        // A length that the rest of the file cannot hold, in an unused list.
        std::string wild = ply.content;
        wild[header + 12] = '\xff';
        const TemporaryFolder folder;
        CHECK_THROWS_WITH(loadPly(folder.write("a.ply", wild)),
                          Contains("vertex 0 of 3, counted from 0, has a list of 255 values"));
    }
}

TEST_CASE("a PLY says the same in blocks of any size and with any number of threads", "[ply][threads]") {
    // Polygons, lost faces and faces' own texture coordinates: everything whose place depends on what came
    // before.
    std::string good, bad;
    for (const bool wrong : {false, true}) {
        PlyWriter ply("ascii", headerWith("property float nx\nproperty float ny\nproperty float nz\n", 40,
                                          kIndices + "property list uchar float texcoord\n", 30));
        for (int i = 0; i < 40; ++i)
            ply.content += fmt::format("{} {} 0 0 0 {}\n", i % 7, i % 11, i % 13 == 5 ? 0 : 1);
        for (int i = 0; i < 30; ++i) {
            if (wrong && (i == 17 || i == 23))
                ply.content += fmt::format("3 0 1 {}", 40 + i);
            else
                ply.content += fmt::format("{} {} {} {} {}", 3 + i % 2, i, i + 3, i + 8,
                                           i % 2 ? fmt::format("{}", i + 5) : "");
            ply.content += i % 3 ? " 0\n" : i % 2 ? " 8 0 1 2 3 4 5 6 7\n" : " 6 0 1 2 3 4 5\n";
        }
        (wrong ? bad : good) = ply.content;
    }
    const auto digest = [](const std::string& text, std::size_t rows) {
        const CapturedLog log;
        Stage stage("reading");
        try {
            const LoadedMesh m = readPly(text, "mesh.ply", {}, stage, rows);
            std::string all;
            for (const auto* list : {&m.mesh.triangles, &m.mesh.normal_index, &m.mesh.uv_index}) {
                for (const auto& t : *list) all += fmt::format("{} {} {}\n", t[0], t[1], t[2]);
                all += "--\n";
            }
            for (const auto& uv : m.mesh.uvs) all += fmt::format("{} {}\n", uv[0], uv[1]);
            return all + log.text();
        } catch (const Error& error) {
            return fmt::format("{}: {}", error.place().line, error.what());
        }
    };
    const std::string whole = digest(good, 1000), refusal = digest(bad, 1000);
    CHECK_THAT(whole, Contains("shaded flat"));
    CHECK_THAT(refusal, Contains("face 17 of 30, counted from 0, uses vertex 57"));
    for (const unsigned threads : {1u, 3u, 16u})
        runWithThreads(threads, [&] {
            for (std::size_t rows = 1; rows < 45; ++rows) {
                CAPTURE(rows);
                REQUIRE(digest(good, rows) == whole);
                REQUIRE(digest(bad, rows) == refusal);
            }
        });
}

TEST_CASE("a PLY in a scene", "[ply][scene_yaml]") {
    const TemporaryFolder folder;
    folder.write("plain.ply", kHeader + kVertices + "3 0 1 2\n");
    PlyWriter coloured("ascii", headerWith("property uchar red\nproperty uchar green\nproperty uchar blue\n",
                                           3, kIndices, 1));
    coloured.content += "0 0 0 255 0 51\n1 0 0 0 0 0\n0 1 0 0 0 0\n3 0 1 2\n";
    folder.write("coloured.ply", coloured.content);
    const std::string grey = "materials: {grey: {type: diffuse, reflectance: 0.5}}\n";
    const Scene scene =
        parse(grey +
                  "objects: [{ply: plain.ply, material: grey}, {ply: ./plain.ply, material: "
                  "grey}, {ply: coloured.ply, material: grey}, {ply: coloured.ply, material: "
                  "grey, vertex_colors: linear}]",
              {}, folder.path());
    REQUIRE(scene.meshes.size() == 3);
    CHECK(scene.objects[1].mesh == 0);
    CHECK(scene.meshes[0].triangles == Triangles{{0, 1, 2}});
    CHECK(scene.meshes[1].colors[0][2] == static_cast<float>(srgbToLinear(.2)));
    CHECK(scene.meshes[2].colors[0][2] == .2f);
    CHECK(scene.files_read.size() == 2);
    CHECK_THAT(refused(grey + "objects: [{ply: plain.ply}]", {}, folder.path()),
               Contains("'material' is missing in object 0"));
    CHECK_THAT(refused(grey + "objects: [{ply: plain.ply, material: from_mtl}]", {}, folder.path()),
               Contains("only an OBJ has its own materials"));
    for (const char* key : {"override: true", "mtl: {color: srgb}", "parts: {a: {material: grey}}"})
        CHECK_THAT(refused(fmt::format("{}objects: [{{ply: plain.ply, material: grey, {}}}]", grey, key), {},
                           folder.path()),
                   Contains("only an OBJ has"));
    CHECK_THAT(refused(grey + "objects: [{obj: plain.ply, material: grey}]", {}, folder.path()),
               Contains("this is a PLY file; use 'ply:' instead of 'obj:'"));
    CHECK_THAT(refused(grey + "objects: [{ply: plian.ply, material: grey}]", {}, folder.path()),
               Contains("cannot find 'plian.ply'") && Contains("did you mean 'plain.ply'?"));
    CHECK_THAT(refused("materials: {c: {type: diffuse, reflectance: {attribute: colors}}}\nobjects: [{ply: "
                       "plain.ply, material: c}]",
                       {}, folder.path()),
               Contains("material 'c' needs colours of vertices, but the mesh of object 0 has none"));
    folder.write("plain.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    CHECK_THAT(refused(grey + "objects: [{obj: plain.obj, material: grey, vertex_colors: srgb}]", {},
                       folder.path()),
               Contains("this key needs colours from a PLY"));
}
