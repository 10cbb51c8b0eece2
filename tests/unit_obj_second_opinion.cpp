// OBJ and MTL files by crt's reader and by tinyobjloader: where they differ, each difference is written down
// here with who is right.
#include "base/error.h"
#include "base/stage.h"
#include "base/temporary_folder.h"
#include "captured_log.h"
#include "catch.h"
#include "file_bytes.h"
#include "scene/mesh/mesh_io.h"
#include "scene/mesh/mtl_file.h"
#include "scene/mesh/obj_reader.h"

#include <tiny_obj_loader.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

using namespace crt;
using crt::test::CapturedLog;

namespace {

namespace fs = std::filesystem;
using Words = std::set<std::string>;

/// Position, texture coordinates and normal, from 0; −1 none.
using Corner = std::array<std::int64_t, 3>;

struct Face {
    std::vector<Corner> corners;
    std::string material;         ///< Empty: none that a file defines.
    std::set<std::string> names;  ///< Of the group and the object.
};

/// An OBJ as either reader has it.
struct Reading {
    bool refused = false;
    std::vector<Vec3d> positions, normals;
    std::vector<std::array<double, 2>> uvs;
    std::vector<Face> faces;
    std::map<std::string, double> areas;  ///< Of triangles, by material.
};

Reading byCrt(const std::string& path) {
    Reading reading;
    try {
        const LoadedMesh loaded = loadObj(path);
        Stage stage("reading");
        const ObjContents contents = readObj(slurp(path), path, stage);
        reading.positions = contents.positions;
        reading.normals = contents.normals;
        reading.uvs = contents.uvs;
        std::set<std::string> defined;
        for (const LoadedMaterial& m : loaded.materials)
            if (m.mtl) defined.insert(m.name);
        const auto nameOf = [&](const std::string& name) { return defined.contains(name) ? name : ""; };
        for (const ObjBlock& block : contents.blocks)
            for (std::size_t i = 0, run = 0; i < block.faces.size(); ++i) {
                while (run + 1 < block.runs.size() && block.runs[run + 1].first_face <= i) ++run;
                Face face;
                for (std::uint32_t k = 0; k < block.faces[i].corner_count; ++k) {
                    const ObjCorner& c = block.corners[block.faces[i].first_corner + k];
                    const auto there = [](std::uint32_t index) {
                        return index < kBadObjNormal ? std::int64_t{index} : -1;
                    };
                    face.corners.push_back({c.position, there(c.uv), there(c.normal)});
                }
                if (const std::int32_t m = block.runs[run].material; m >= 0)
                    face.material = nameOf(contents.material_names[static_cast<std::size_t>(m)]);
                if (const std::int32_t p = block.runs[run].part; p >= 0) {
                    const MeshPart& part = contents.parts[static_cast<std::size_t>(p)];
                    face.names = {part.group, part.object};
                }
                reading.faces.push_back(std::move(face));
            }
        const Mesh& mesh = loaded.mesh;
        for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
            const auto& t = mesh.triangles[i];
            const Vec3d a = mesh.positions[t[0]];
            const std::int32_t m = mesh.material.empty() ? -1 : mesh.material[i];
            reading.areas[m < 0 ? "" : nameOf(loaded.materials[static_cast<std::size_t>(m)].name)] +=
                length(cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a)) / 2;
        }
    } catch (const Error&) {
        reading.refused = true;
    }
    return reading;
}

/// Of a flat polygon; NaN where vertices of it are not there.
double areaOf(const std::vector<Vec3d>& positions, const Face& face) {
    for (const Corner& corner : face.corners)
        if (static_cast<std::size_t>(corner[0]) >= positions.size())
            return std::numeric_limits<double>::quiet_NaN();
    Vec3d sum{};
    for (std::size_t k = 0; k < face.corners.size(); ++k) {
        const auto at = [&](std::size_t i) {
            return positions[static_cast<std::size_t>(face.corners[i % face.corners.size()][0])];
        };
        sum = sum + cross(at(k) - at(0), at(k + 1) - at(0));
    }
    return length(sum) / 2;
}

Reading byTinyObj(const std::string& path) {
    Reading reading;
    tinyobj::ObjReader reader;
    tinyobj::ObjReaderConfig config;
    config.triangulate = false;
    config.vertex_color = false;
    if (!reader.ParseFromFile(path, config)) {
        reading.refused = true;
        return reading;
    }
    const tinyobj::attrib_t& all = reader.GetAttrib();
    for (std::size_t i = 0; i + 2 < all.vertices.size(); i += 3)
        reading.positions.push_back({all.vertices[i], all.vertices[i + 1], all.vertices[i + 2]});
    for (std::size_t i = 0; i + 2 < all.normals.size(); i += 3)
        reading.normals.push_back({all.normals[i], all.normals[i + 1], all.normals[i + 2]});
    for (std::size_t i = 0; i + 1 < all.texcoords.size(); i += 2)
        reading.uvs.push_back({all.texcoords[i], all.texcoords[i + 1]});
    for (const tinyobj::shape_t& shape : reader.GetShapes()) {
        std::size_t next = 0;
        for (std::size_t f = 0; f < shape.mesh.num_face_vertices.size(); ++f) {
            Face face;
            for (unsigned k = 0; k < shape.mesh.num_face_vertices[f]; ++k, ++next) {
                const tinyobj::index_t& c = shape.mesh.indices[next];
                face.corners.push_back({c.vertex_index, c.texcoord_index, c.normal_index});
            }
            const int m = shape.mesh.material_ids[f];
            if (m >= 0) face.material = reader.GetMaterials()[static_cast<std::size_t>(m)].name;
            face.names = {shape.name};
            reading.areas[face.material] += areaOf(reading.positions, face);
            reading.faces.push_back(std::move(face));
        }
    }
    return reading;
}

/// But for the rounding of a parser that is not correctly rounded.
template <std::size_t kCount>
bool same(const std::vector<std::array<double, kCount>>& a,
          const std::vector<std::array<double, kCount>>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& p, const auto& q) {
        for (std::size_t k = 0; k < kCount; ++k)
            if (!(std::abs(p[k] - q[k]) <= 1e-14 * std::max(std::abs(p[k]), 1.0))) return false;
        return true;
    });
}

Words differencesOf(const std::string& path) {
    const CapturedLog quiet;
    const Reading ours = byCrt(path), theirs = byTinyObj(path);
    if (ours.refused || theirs.refused)
        return ours.refused == theirs.refused ? Words{}
                                              : Words{ours.refused ? "crt refuses" : "tinyobj refuses"};
    Words words;
    const auto note = [&](bool equal, const char* what) {
        if (!equal) words.insert(what);
    };
    note(same(ours.positions, theirs.positions), "positions");
    note(same(ours.normals, theirs.normals), "normals");
    note(same(ours.uvs, theirs.uvs), "uvs");
    note(ours.faces.size() == theirs.faces.size(), "faces");
    for (std::size_t i = 0; i < std::min(ours.faces.size(), theirs.faces.size()); ++i) {
        const Face &a = ours.faces[i], &b = theirs.faces[i];
        note(a.corners == b.corners, "corners");
        note(a.material == b.material, "materials");
        note(a.names.empty() || a.names.contains(*b.names.begin()), "names");
    }
    constexpr double kFlat = 1e-4;  // Corners of a face lie in one plane but for this.
    for (const auto& [material, area] : ours.areas)
        note(theirs.areas.contains(material) && std::abs(theirs.areas.at(material) - area) <= kFlat * area,
             "areas");
    return words;
}

/// Text that is not a number becomes NaN.
std::vector<double> numbersIn(const std::string& text) {
    std::vector<double> numbers;
    std::istringstream words(text);
    for (std::string word; words >> word;) {
        char* end = nullptr;
        const double number = std::strtod(word.c_str(), &end);
        numbers.push_back(*end == '\0' ? number : std::numeric_limits<double>::quiet_NaN());
    }
    return numbers;
}

std::string lastWord(const std::string& text) { return text.substr(text.find_last_of(" \t") + 1); }

/// Names and statements of an MTL that both know.
Words differencesOfMtl(const std::string& path) {
    const CapturedLog quiet;
    const std::string text = slurp(path);
    const std::vector<MtlText> ours = readMtl(text, path);
    std::map<std::string, int> numbers;
    std::vector<tinyobj::material_t> theirs;
    std::istringstream stream(text);
    std::string warning, error;
    tinyobj::LoadMtl(&numbers, &theirs, &stream, &warning, &error);
    Words words;
    if (ours.size() != theirs.size()) return {"number of materials"};
    for (std::size_t i = 0; i < ours.size(); ++i) {
        const MtlText& a = ours[i];
        const tinyobj::material_t& b = theirs[i];
        if (a.name != b.name) words.insert("names");
        const auto compare = [&](const char* keyword, std::vector<double> found) {
            const MtlStatement* statement = a.find(keyword);
            if (statement == nullptr) return;
            const std::vector<double> said = numbersIn(statement->arguments);
            bool equal = said.size() >= found.size();
            for (std::size_t k = 0; equal && k < found.size(); ++k)
                equal = std::abs(said[k] - found[k]) <= 1e-12 * std::max(1.0, std::abs(said[k]));
            if (!equal) words.insert(fmt::format("{} of '{}'", keyword, a.name));
        };
        compare("Kd", {b.diffuse[0], b.diffuse[1], b.diffuse[2]});
        compare("Ks", {b.specular[0], b.specular[1], b.specular[2]});
        compare("Ke", {b.emission[0], b.emission[1], b.emission[2]});
        compare("Tf", {b.transmittance[0], b.transmittance[1], b.transmittance[2]});
        compare("Ni", {b.ior});
        compare("Ns", {b.shininess});
        compare("illum", {static_cast<double>(b.illum)});
        compare("Pm", {b.metallic});
        if (a.find("Tr") == nullptr) compare("d", {b.dissolve});
        const auto compareMap = [&](const char* keyword, const std::string& found) {
            const MtlStatement* statement = a.find(keyword);
            if (statement != nullptr && lastWord(statement->arguments) != lastWord(found))
                words.insert(fmt::format("{} of '{}'", keyword, a.name));
        };
        compareMap("map_Kd", b.diffuse_texname);
        compareMap("map_d", b.alpha_texname);
        compareMap("norm", b.normal_texname);
    }
    return words;
}

/// Differences, and why crt's reading is the right one.
struct Known {
    Words differences;
    const char* reason;
};

/// A text of an OBJ or MTL file.
struct Text {
    const char* text;
    Known known = {};
};

const std::string kObjTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
constexpr const char* kMtl = "newmtl red\nKd 1 0 0\nnewmtl two words\nKd 0 1 0\n";

const std::vector<Text> kObjTexts{
    {"f 1 2 3\n"},
    {"f 1 2 3\r\n# c\r\n\r\n"},
    {"vt .5 .25\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\nf 1/1 2/1 3/1\nf 1//1 2//1 3//1\n"},
    {"f -3 -2 -1\nv 1 1 0\nf -3 -2 -1\n"},
    {"v 1 1 0\nf 1 2 4 3\n"},
    {"v .2 .2 0\nf 1 2 4 3\n"},
    {"v 2 0 0\nv 2 2 0\nv 1 .5 0\nv 0 2 0\nf 1 4 5 6 7\n"},
    {"l 1 2\np 1\nf 1 2 3\n"},
    {"mtllib a.mtl\nf 1 2 3\nusemtl red\nf 1 2 3\nusemtl gone\nf 1 2 3\n"},
    {"mtllib gone.mtl a.mtl\nusemtl red\nf 1 2 3\n"},
    {"g a\nf 1 2 3\ng b c\nf 1 3 2\no d\nf 2 1 3\n"},
    {"g\nf 1 2 3\n"},
    {"s 1\nf 1 2 3\ns off\nf 1 3 2\n"},
    {"f 1 2 4\nv 0 0 1\n"},
    {"f 1 2 0\n"},
    {"v 123456.789012345678 1e-3 -1E+2\nf 1 2 4\n"},
    {"f 1 2 9\n",
     {{"crt refuses"}, "there is no vertex 9; tinyobjloader gives the number on, beyond its vertices"}},
    {"mtllib a.mtl\nusemtl two words\nf 1 2 3\n",
     {{"areas", "materials"},
      "the line is the name, as exporters write it; tinyobjloader ends it at a blank"}},
    {"f 1 2 \\\n 3\n",
     {{"tinyobj refuses"},
      "a backslash joins lines (the specification of OBJ); tinyobjloader does not know it"}},
    {"f 1/ 2/ 3/\n",
     {{"tinyobj refuses"},
      "nothing behind the stroke is no texture coordinate, which is what exporters mean"}},
    {"vn 0 0 1\nf 1//9 2//1 3//1\n",
     {{"corners"}, "a normal that is not there makes its face flat; tinyobjloader gives the number on"}},
    {"vn 0 0 1\nf 1//x 2//1 3//1\n",
     {{"tinyobj refuses"}, "a normal that is not there makes its face flat, and does not cost the file"}},
    {"f 1/1 2/1 3/1\n",
     {{"corners"}, "coordinates that are not there are none; tinyobjloader gives the number on"}},
    {"v 1,5 0 0\nf 1 2 3\n", {{"positions"}, "1,5 is no number; tinyobjloader takes it for 1"}},
    {"f 1 2\nf 1 2 3\n"},
    {"f 1 2 3 # the end\n",
     {{"tinyobj refuses"}, "a comment may stand behind a statement; tinyobjloader takes it for corners"}},
};

const std::vector<Text> kMtlTexts{
    {"newmtl a\nKd 1 .5 .25\nKs 0 0 1\nKe 1 2 3\nNs 12\nNi 1.5\nd .5\nillum 2\nTf .1 .2 .3\nPm 1\n"},
    {"newmtl a\nmap_Kd a.png\nmap_d b.png\nnorm c.png\nnewmtl b\nmap_Kd -s 2 2 1 -o 0 1 0 t.png\n"},
    {"newmtl a\nmap_Kd a b.png\n"},
    {"# c\n\nnewmtl a\r\nKd 1 0 0\r\nnewmtl b c\r\nKd 0 1 0\r\n"},
    {"newmtl a\nmap_Kd -s 2 2 1 -o 0 1 t.png\n",
     {{"map_Kd of 'a'"}, "-o has two numbers or three; tinyobjloader takes the name for the third"}},
    {"newmtl a\nKd 0.7\n", {{"Kd of 'a'"}, "one number is grey; tinyobjloader makes it red"}},
    {"newmtl a\nKd spectral f.rfl\n",
     {{"Kd of 'a'"}, "a spectrum is no red, green and blue; tinyobjloader makes it black"}},
    {"newmtl a\nNi 1,5\n", {{"Ni of 'a'"}, "1,5 is no number; tinyobjloader takes it for 1"}},
    {"newmtl a\nd -halo 0.5\n",
     {{"d of 'a'"}, "-halo is an option of d; tinyobjloader takes it for 0, which is invisible"}},
    {"newmtl a\nKd 0 0 0\nnewmtl\nKd 1 0 0\n",
     {{"number of materials"},
      "newmtl begins a material, named or not; tinyobjloader gives it to the last one"}},
};

/// Files of the repository, by name.
const std::map<std::string, Known> kObjFiles{
    {"families.obj", {{"tinyobj refuses"}, "a normal that is not there makes its face flat"}},
    {"line_ends.obj", {{"tinyobj refuses"}, "nothing behind the stroke is no texture coordinate"}},
    {"materials.obj", {{"tinyobj refuses"}, "a backslash joins lines"}}};
const std::map<std::string, Known> kMtlFiles{
    {"families.obj", {{"number of materials"}, "newmtl begins a material, named or not"}}};

void check(const Words& found, const Known& known) {
    INFO(known.reason);
    CHECK(found == known.differences);
}

Known knownOf(const std::map<std::string, Known>& all, const std::string& name) {
    const auto found = all.find(name);
    return found == all.end() ? Known{} : found->second;
}

}  // namespace

TEST_CASE("OBJ texts are what tinyobjloader reads, but for known differences", "[obj]") {
    const TemporaryFolder folder;
    folder.write("a.mtl", kMtl);
    for (const Text& text : kObjTexts) {
        INFO(text.text);
        check(differencesOf(folder.write("a.obj", kObjTriangle + text.text)), text.known);
    }
    // The beginning of the file.
    const Known mark{{"areas", "positions"},
                     "the mark of UTF-8 is no part of the first line, which tinyobjloader loses"};
    check(differencesOf(folder.write("a.obj", "\xEF\xBB\xBF" + kObjTriangle + "f 1 2 3\n")), mark);
}

TEST_CASE("MTL texts are what tinyobjloader reads, but for known differences", "[obj][mtl]") {
    const TemporaryFolder folder;
    for (const Text& text : kMtlTexts) {
        INFO(text.text);
        check(differencesOfMtl(folder.write("a.mtl", text.text)), text.known);
    }
}

TEST_CASE("OBJ and MTL files here are what tinyobjloader reads, but for known differences", "[obj][mtl]") {
    const TemporaryFolder folder;
    folder.write("a.spd", "300 0.2\n900 0.8\n");  // As tests/fuzz/fuzz_obj.cpp has it.
    std::size_t objs = 0, mtls = 0;
    for (const char* where : {CRT_SOURCE_DIR "/bench/scenes", CRT_SOURCE_DIR "/configs",
                              CRT_SOURCE_DIR "/tests", CRT_BUILD_DIR "/share/crt"})
        for (const auto& entry : fs::recursive_directory_iterator(where)) {
            const std::string name = entry.path().filename().string(), kind = entry.path().extension();
            if (kind != ".obj" && kind != ".mtl") continue;
            INFO(entry.path().string());
            std::string obj = entry.path(), mtl = kind == ".mtl" ? obj : "";
            if (kind == ".obj") {
                // Seeds of the fuzzer have their MTL behind a mark.
                const std::string bytes = slurp(entry.path()), mark = "%%mtl\n";
                const std::size_t split = bytes.find(mark);
                if (split != std::string::npos) {
                    mtl = folder.write("a.mtl", bytes.substr(split + mark.size()));
                    obj = folder.write("a.obj", bytes.substr(0, split));
                }
                ++objs;
                check(differencesOf(obj), knownOf(kObjFiles, name));
            }
            if (mtl.empty()) continue;
            ++mtls;
            check(differencesOfMtl(mtl), knownOf(kMtlFiles, name));
        }
    CHECK(objs >= 6);
    CHECK(mtls >= 6);
}
