#include "mesh_io.h"

#include "error.h"
#include "input_file.h"
#include "log.h"
#include "triangulate.h"
#include "vec3d.h"

// The loader is compiled into this one file, in double: Debian's two shared builds of it, float and double, export the
// same symbols, so that linking the wrong one would go unnoticed.
#define TINYOBJLOADER_IMPLEMENTATION
#include "mtl_material.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <limits>
#include <map>
#include <set>
#include <sstream>
#include <streambuf>
#include <string_view>

namespace crt {
namespace {

constexpr std::string_view kBlank = " \t\v\f";

[[noreturn]] void fail(const std::string& sentence, const std::string& file, int line = 0) {
    throw Error(ErrorKind::Scene, sentence, {file, line});
}

std::string readText(const std::string& path, const char* kind, std::uint64_t most_bytes, const SourcePlace& named_at) {
    try {
        return readInput(path, most_bytes);
    } catch (const InputRefused& refused) {
        throw Error(ErrorKind::Scene, fmt::format("{} '{}' {}", kind, path, refused.what()), named_at);
    }
}

/// Takes the next field off the front of `line`; empty at its end.
std::string_view nextField(std::string_view& line) {
    line.remove_prefix(std::min(line.find_first_not_of(kBlank), line.size()));
    const std::string_view field = line.substr(0, line.find_first_of(kBlank));
    line.remove_prefix(field.size());
    return field;
}

std::string_view trimmed(std::string_view text) {
    const std::size_t first = text.find_first_not_of(" \t\v\f\r");
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(" \t\v\f\r") + 1 - first);
}

/// Hands a text to tinyobjloader one logical line at a time, so that a callback, which is told neither the line nor its
/// number, can ask here. Line ends of any system become '\n', a backslash at the end joins lines, blanks at the end go.
class LineSource : public std::streambuf {
public:
    explicit LineSource(std::string_view text) : rest_(text) {
        if (rest_.starts_with("\xEF\xBB\xBF")) rest_.remove_prefix(3);
    }

    /// Number of the line last handed out, counted from 1; the first of those joined.
    int lineNumber() const { return line_number_; }
    /// The line last handed out without its keyword.
    std::string_view arguments() const {
        std::string_view line(line_);
        line.remove_suffix(1);
        nextField(line);
        return trimmed(line);
    }

protected:
    int_type underflow() override {
        if (rest_.empty()) return traits_type::eof();
        line_number_ += joined_;
        joined_ = 0;
        line_.clear();
        bool more = true;
        while (more && !rest_.empty()) {
            const std::size_t end = std::min(rest_.find_first_of("\r\n"), rest_.size());
            std::string_view part = trimmed(rest_.substr(0, end));
            rest_.remove_prefix(end);
            rest_.remove_prefix(rest_.starts_with("\r\n") ? 2 : std::min<std::size_t>(1, rest_.size()));
            more = part.ends_with('\\') && !part.starts_with('#');
            if (more) part.remove_suffix(1);
            line_ += part;
            if (more) line_ += ' ';
            ++joined_;
        }
        // One blank after the keyword: tinyobjloader takes further ones for part of a material's name, and passes over a
        // bare "v" in silence, which would put every later index off by one.
        const std::size_t keyword_end = std::min(line_.find_first_of(kBlank), line_.size());
        const std::size_t argument = std::min(line_.find_first_not_of(kBlank, keyword_end), line_.size());
        line_.replace(keyword_end, argument - keyword_end, " ");
        line_ += '\n';
        setg(line_.data(), line_.data(), line_.data() + line_.size());
        return traits_type::to_int_type(line_.front());
    }

private:
    std::string_view rest_;
    std::string line_;
    int line_number_ = 1;
    int joined_ = 0;  ///< Physical lines in line_.
};

/// One corner of a face, counted from 0; kNoNormal where it names no normal.
struct Corner {
    std::int64_t position;
    std::int64_t normal;
};
constexpr std::int64_t kNone = -1;

/// A polygon: a run of corners, its material, and where it stands in the file.
struct Face {
    std::size_t first_corner;
    std::uint32_t corner_count;
    std::int32_t material;  ///< Index into the materials as tinyobjloader numbers them; −1 none.
    int line;
};

/// What the OBJ says, before indices are checked: a face may name vertices that follow it.
struct ObjContents {
    std::vector<Vec3d> positions;
    std::vector<Vec3d> normals;
    std::vector<Corner> corners;
    std::vector<Face> faces;
    std::vector<tinyobj::material_t> materials;
    std::vector<MtlSource> material_sources;  ///< Parallel to `materials`.
    std::vector<std::string> files;
};

/// Reads the MTL files that an mtllib statement names, relative to the OBJ.
class MaterialFiles : public tinyobj::MaterialReader {
public:
    MaterialFiles(const std::string& obj_path, const LineSource& obj_lines, ObjContents& obj)
        : obj_path_(obj_path), obj_lines_(obj_lines), obj_(obj) {}

    /// Called by tinyobjloader with the first blank-separated name. Exporters do not escape blanks in file names, so the
    /// whole argument is tried as one name before it is taken apart.
    bool operator()(const std::string&, std::vector<tinyobj::material_t>* materials, std::map<std::string, int>* by_name,
                    std::string*, std::string*) override {
        std::string_view arguments = obj_lines_.arguments();
        std::error_code ignored;  // Names that no file can have (too long) are not there either.
        if (std::filesystem::exists(besideObj(arguments), ignored)) {
            read(arguments, *materials, *by_name);
        } else {
            for (std::string_view name = nextField(arguments); !name.empty(); name = nextField(arguments))
                read(name, *materials, *by_name);
        }
        return !materials->empty();  // Of an OBJ that names itself, none is read; tinyobjloader takes "yes" to mean one at least.
    }

private:
    std::string besideObj(std::string_view name) const {
        return (std::filesystem::path(obj_path_).parent_path() / std::filesystem::path(name)).string();
    }

    void read(std::string_view name, std::vector<tinyobj::material_t>& materials, std::map<std::string, int>& by_name) {
        const std::string path = besideObj(name);
        if (std::find(obj_.files.begin(), obj_.files.end(), path) != obj_.files.end()) return;
        const std::string text = readText(path, "material file", kMostMaterialBytes, {obj_path_, obj_lines_.lineNumber()});
        obj_.files.push_back(path);

        LineSource lines(text);
        std::istream stream(&lines);
        std::string warnings, errors;
        tinyobj::LoadMtl(&by_name, &materials, &stream, &warnings, &errors);
        std::istringstream each(warnings);
        for (std::string warning; std::getline(each, warning);) logWarning("{}: {}", path, warning);

        // tinyobjloader pushes one material for each newmtl, and one without a name for a file that has none.
        std::vector<MtlSource> sources;
        LineSource again(text);
        std::istream stream_again(&again);
        for (std::string line; std::getline(stream_again, line);) {
            std::string_view rest(line);
            const std::string_view keyword = nextField(rest);
            if (keyword == "newmtl") {
                if (trimmed(rest).empty()) fail("newmtl needs a name", path, again.lineNumber());
                sources.push_back({path, again.lineNumber(), {}, {}});
            }
            if (sources.empty() || keyword.empty() || keyword.starts_with('#')) continue;
            const bool is_first = sources.back().statements.emplace(keyword).second;
            if (is_first && keyword == "crt_reflectance") sources.back().measured_reflectance = trimmed(rest);
        }
        sources.resize(materials.size() - obj_.material_sources.size(), MtlSource{path, 0, {}, {}});
        std::move(sources.begin(), sources.end(), std::back_inserter(obj_.material_sources));
    }

    const std::string& obj_path_;
    const LineSource& obj_lines_;
    ObjContents& obj_;
};

/// Receives the statements of an OBJ. tinyobjloader turns every number it cannot read ("nan", "1,5", a coordinate that is
/// missing) into 0 without a word, so each line is read again here: strictly, and correctly rounded.
class ObjReader {
public:
    ObjReader(const std::string& path, std::string_view text, bool use_mtl) : path_(path), lines_(text), use_mtl_(use_mtl) {}

    ObjContents read() {
        obj_.files.push_back(path_);
        tinyobj::callback_t callbacks;
        callbacks.vertex_cb = [](void* self, double, double, double, double) { static_cast<ObjReader*>(self)->position(); };
        callbacks.normal_cb = [](void* self, double, double, double) { static_cast<ObjReader*>(self)->normal(); };
        callbacks.index_cb = [](void* self, tinyobj::index_t*, int) { static_cast<ObjReader*>(self)->face(); };
        if (use_mtl_) {
            callbacks.usemtl_cb = [](void* self, const char* name, int id) {
                static_cast<ObjReader*>(self)->useMaterial(name, id);
            };
            callbacks.mtllib_cb = [](void* self, const tinyobj::material_t* materials, int count) {
                static_cast<ObjReader*>(self)->obj_.materials.assign(materials, materials + count);
            };
        }
        MaterialFiles material_files(path_, lines_, obj_);
        std::istream stream(&lines_);
        std::string warnings, errors;
        tinyobj::LoadObjWithCallback(stream, callbacks, this, use_mtl_ ? &material_files : nullptr, &warnings, &errors);
        return std::move(obj_);
    }

private:
    /// Three numbers; more may follow (a weight, a colour) and are ignored.
    Vec3d threeNumbers(const char* what) const {
        std::string_view rest = lines_.arguments();
        Vec3d v{};
        for (double& number : v) {
            const std::string_view field = nextField(rest);
            if (field.empty()) fail(fmt::format("a {} needs three numbers", what), path_, lines_.lineNumber());
            const std::string_view digits = field.substr(field.starts_with('+') ? 1 : 0);
            const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
            if (end != digits.data() + digits.size() || error == std::errc::invalid_argument)
                fail(fmt::format("expected a number, found '{}'", field), path_, lines_.lineNumber());
            // Beyond a double: with a negative exponent that is zero, else infinite.
            if (error == std::errc::result_out_of_range)
                number = digits.find('-', 1) != std::string_view::npos ? 0.0 : std::numeric_limits<double>::infinity();
        }
        return v;
    }

    void position() {
        const Vec3d p = threeNumbers("vertex");
        for (const double x : p)
            if (!std::isfinite(x)) fail("the coordinates of a vertex must be finite", path_, lines_.lineNumber());
        obj_.positions.push_back(p);
    }

    /// A normal of no length or with NaN stays in the list, for the indices of those behind it, and marks its faces flat.
    void normal() { obj_.normals.push_back(threeNumbers("vertex normal")); }

    /// "7", "7/1", "7//3" or "7/1/3"; counted from 1, or backwards from the newest with a minus.
    Corner corner(std::string_view field) const {
        std::array<std::int64_t, 3> index{0, 0, 0};  // Position, texture, normal; 0 is not an index.
        std::string_view rest = field;
        for (std::size_t i = 0; i < index.size() && !rest.empty(); ++i) {
            const std::string_view digits = rest.substr(0, rest.find('/'));
            const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), index[i]);
            const bool left_out = i == 1 && digits.empty();
            if (!left_out && (error != std::errc() || end != digits.data() + digits.size() || index[i] == 0))
                fail(fmt::format("'{}' is not a corner of a face (v, v/vt, v//vn or v/vt/vn, counted from 1)", field), path_,
                     lines_.lineNumber());
            rest.remove_prefix(digits.size());
            if (!rest.empty()) rest.remove_prefix(1);
        }
        const auto fromZero = [&](std::int64_t i, std::size_t count, const char* what) -> std::int64_t {
            const std::int64_t zero_based = i > 0 ? i - 1 : static_cast<std::int64_t>(count) + i;
            if (zero_based < 0)
                fail(fmt::format("a face names {} {}, but only {} stand before it", what, i, count), path_, lines_.lineNumber());
            return zero_based;
        };
        return {fromZero(index[0], obj_.positions.size(), "vertex"),
                index[2] == 0 ? kNone : fromZero(index[2], obj_.normals.size(), "normal")};
    }

    void face() {
        Face f{obj_.corners.size(), 0, material_, lines_.lineNumber()};
        std::string_view rest = lines_.arguments();
        for (std::string_view field = nextField(rest); !field.empty() && field[0] != '#'; field = nextField(rest)) {
            obj_.corners.push_back(corner(field));
            ++f.corner_count;
        }
        if (f.corner_count < 3)
            fail(fmt::format("a face needs at least three corners, this one has {}", f.corner_count), path_, lines_.lineNumber());
        obj_.faces.push_back(f);
    }

    void useMaterial(const std::string& name, int id) {
        material_ = id;
        if (id < 0 && undefined_materials_.insert(name).second)
            logWarning("{}:{}: material '{}' is not defined; its faces get the material of the object", path_,
                       lines_.lineNumber(), name);
    }

    const std::string& path_;
    LineSource lines_;
    bool use_mtl_;
    ObjContents obj_;
    std::int32_t material_ = -1;
    std::set<std::string> undefined_materials_;
};

/// Indices that point behind the last vertex or normal of the file.
void checkIndices(const ObjContents& obj, const std::string& path) {
    for (const Face& face : obj.faces)
        for (std::uint32_t i = 0; i < face.corner_count; ++i) {
            const Corner& c = obj.corners[face.first_corner + i];
            if (c.position >= static_cast<std::int64_t>(obj.positions.size()))
                fail(fmt::format("a face names vertex {}, but the file has {}", c.position + 1, obj.positions.size()), path,
                     face.line);
            if (c.normal >= static_cast<std::int64_t>(obj.normals.size()))
                fail(fmt::format("a face names normal {}, but the file has {}", c.normal + 1, obj.normals.size()), path,
                     face.line);
        }
}

double maxAbs(const Vec3d& v) { return std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])}); }

/// No area beyond what rounding the coordinates to double can make up: collinear points seldom give exactly zero.
bool isDegenerate(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    const double scale = std::max(maxAbs(b - a), maxAbs(c - a));
    if (!(scale > 0.0)) return true;
    // Edges of size one, so that neither a mesh in metres nor one in parsecs overflows.
    const auto edge = [&](const Vec3d& to) {
        Vec3d e = to - a;
        for (double& x : e) x /= scale;
        return e;
    };
    const double coordinate = std::max({maxAbs(a), maxAbs(b), maxAbs(c)}) / scale;
    return length(cross(edge(b), edge(c))) <= 4.0 * std::numeric_limits<double>::epsilon() * (1.0 + coordinate);
}

}  // namespace

LoadedMesh loadObj(const std::string& path, bool use_mtl) {
    const std::string text = readText(path, "mesh", kMostMeshBytes, {path});
    ObjContents obj = ObjReader(path, text, use_mtl).read();
    if (obj.faces.empty()) fail("this mesh has no faces", path);
    checkIndices(obj, path);

    LoadedMesh out;
    out.files = obj.files;

    // Normals of unit length; those without a direction are remembered as such.
    std::vector<bool> usable_normal(obj.normals.size());
    for (std::size_t i = 0; i < obj.normals.size(); ++i) {
        Vec3d& n = obj.normals[i];
        const double scale = maxAbs(n);  // First to size one: squares of very long or short normals would not fit.
        for (double& x : n) x /= scale;
        const double unit = length(n);
        usable_normal[i] = std::isfinite(scale) && scale > 0.0 && std::isfinite(unit);
        for (double& x : n) x = usable_normal[i] ? x / unit : 0.0;
    }

    // Materials in the order in which faces first use them.
    std::vector<std::int32_t> material_index(obj.materials.size(), -1);
    std::vector<std::int32_t> emission_index(obj.materials.size(), -1);
    const auto useMaterial = [&](std::size_t mtl) {
        if (material_index[mtl] >= 0) return;
        const MtlMaterial mapped = mapMtlMaterial(obj.materials[mtl], obj.material_sources[mtl]);
        material_index[mtl] = static_cast<std::int32_t>(out.materials.size());
        out.materials.push_back(mapped.material);
        if (mapped.emission) {
            emission_index[mtl] = static_cast<std::int32_t>(out.emissions.size());
            out.emissions.push_back(*mapped.emission);
        }
        const std::string& spectrum = mapped.spectrum_file;
        if (!spectrum.empty() && std::find(out.files.begin(), out.files.end(), spectrum) == out.files.end()) out.files.push_back(spectrum);
    };

    Mesh& mesh = out.mesh;
    Triangulator triangulator;
    std::vector<Vec3d> polygon;
    std::uint64_t flat_faces = 0;
    bool any_smooth = false;
    for (const Face& face : obj.faces) {
        std::int32_t material = -1, emission = -1;
        if (face.material >= 0) {
            const auto mtl = static_cast<std::size_t>(face.material);
            useMaterial(mtl);
            material = material_index[mtl];
            emission = emission_index[mtl];
        }
        bool lost_normal = false;
        polygon.clear();
        for (std::uint32_t i = 0; i < face.corner_count; ++i)
            polygon.push_back(obj.positions[static_cast<std::size_t>(obj.corners[face.first_corner + i].position)]);
        for (const PolygonTriangle& triangle : triangulator.split(polygon)) {
            std::array<std::uint32_t, 3> position, normal;
            bool smooth = true;
            for (int k = 0; k < 3; ++k) {
                const Corner& corner = obj.corners[face.first_corner + triangle[k]];
                position[k] = static_cast<std::uint32_t>(corner.position);
                normal[k] = static_cast<std::uint32_t>(corner.normal);
                const bool named = corner.normal != kNone;
                const bool usable = named && usable_normal[static_cast<std::size_t>(corner.normal)];
                lost_normal |= named && !usable;
                smooth &= usable;
            }
            if (isDegenerate(obj.positions[position[0]], obj.positions[position[1]], obj.positions[position[2]])) {
                ++out.degenerate_faces;
                continue;
            }
            if (!smooth) normal.fill(kNoNormal);
            any_smooth |= smooth;
            mesh.triangles.push_back(position);
            mesh.normal_index.push_back(normal);
            mesh.material.push_back(material);
            mesh.emission.push_back(emission);
        }
        flat_faces += lost_normal;
    }

    if (mesh.triangles.empty()) fail("no face of this mesh has an area", path);
    if (out.degenerate_faces > 0)
        logWarning("{}: {} triangle{} without area left out", path, out.degenerate_faces, out.degenerate_faces == 1 ? "" : "s");
    if (flat_faces > 0)
        logWarning("{}: {} face{} shaded flat: a normal has no direction", path, flat_faces, flat_faces == 1 ? " is" : "s are");
    if (triangulator.crossingPolygons() > 0)
        logWarning("{}: {} polygon{} crossing itself may be split wrongly", path, triangulator.crossingPolygons(),
                   triangulator.crossingPolygons() == 1 ? "" : "s");

    mesh.positions = std::move(obj.positions);
    if (any_smooth)
        mesh.normals = std::move(obj.normals);
    else
        mesh.normal_index.clear();
    if (out.materials.empty()) mesh.material.clear();
    if (out.emissions.empty()) mesh.emission.clear();
    return out;
}

}  // namespace crt
