#include "mesh_io.h"

#include "error.h"
#include "log.h"

// The loader is compiled into this one file, in double: Debian's two shared builds of it, float and double, export the
// same symbols, so that linking the wrong one would go unnoticed.
#define TINYOBJLOADER_IMPLEMENTATION
#define TINYOBJLOADER_USE_DOUBLE
#include <tiny_obj_loader.h>

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
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

std::string readText(const std::string& path, const char* kind, const SourcePlace& named_at) {
    std::error_code ignored;
    if (std::filesystem::is_directory(path, ignored))
        throw Error(ErrorKind::Scene, fmt::format("{} '{}' is a directory", kind, path), named_at);
    std::ifstream in(path, std::ios::binary);
    if (!in) throw Error(ErrorKind::Scene, fmt::format("cannot open {} '{}'", kind, path), named_at);
    std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    if (in.bad()) throw Error(ErrorKind::Scene, fmt::format("cannot read {} '{}'", kind, path), named_at);
    return text;
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

/// Where a material stands and which statements it has; tinyobjloader keeps only values, and a default looks like any other.
struct MaterialSource {
    std::string file;
    int line = 0;
    std::set<std::string, std::less<>> statements;
};

/// What the OBJ says, before indices are checked: a face may name vertices that follow it.
struct ObjContents {
    std::vector<Vec3d> positions;
    std::vector<Vec3d> normals;
    std::vector<Corner> corners;
    std::vector<Face> faces;
    std::vector<tinyobj::material_t> materials;
    std::vector<MaterialSource> material_sources;  ///< Parallel to `materials`.
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
        return true;
    }

private:
    std::string besideObj(std::string_view name) const {
        return (std::filesystem::path(obj_path_).parent_path() / std::filesystem::path(name)).string();
    }

    void read(std::string_view name, std::vector<tinyobj::material_t>& materials, std::map<std::string, int>& by_name) {
        const std::string path = besideObj(name);
        if (std::find(obj_.files.begin(), obj_.files.end(), path) != obj_.files.end()) return;
        const std::string text = readText(path, "material file", {obj_path_, obj_lines_.lineNumber()});
        obj_.files.push_back(path);

        LineSource lines(text);
        std::istream stream(&lines);
        std::string warnings, errors;
        tinyobj::LoadMtl(&by_name, &materials, &stream, &warnings, &errors);
        std::istringstream each(warnings);
        for (std::string warning; std::getline(each, warning);) logWarning("{}: {}", path, warning);

        // tinyobjloader pushes one material for each newmtl, and one without a name for a file that has none.
        std::vector<MaterialSource> sources;
        LineSource again(text);
        std::istream stream_again(&again);
        for (std::string line; std::getline(stream_again, line);) {
            std::string_view rest(line);
            const std::string_view keyword = nextField(rest);
            if (keyword == "newmtl") {
                if (trimmed(rest).empty()) fail("newmtl needs a name", path, again.lineNumber());
                sources.push_back({path, again.lineNumber(), {}});
            }
            if (!sources.empty() && !keyword.empty() && !keyword.starts_with('#')) sources.back().statements.emplace(keyword);
        }
        sources.resize(materials.size() - obj_.material_sources.size(), MaterialSource{path, 0, {}});
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

Vec3d minus(const Vec3d& a, const Vec3d& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Vec3d cross(const Vec3d& a, const Vec3d& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double maxAbs(const Vec3d& v) { return std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])}); }
double length(const Vec3d& v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

/// No area beyond what rounding the coordinates to double can make up: collinear points seldom give exactly zero.
bool isDegenerate(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    const double scale = std::max(maxAbs(minus(b, a)), maxAbs(minus(c, a)));
    if (!(scale > 0.0)) return true;
    // Edges of size one, so that neither a mesh in metres nor one in parsecs overflows.
    const auto edge = [&](const Vec3d& to) {
        Vec3d e = minus(to, a);
        for (double& x : e) x /= scale;
        return e;
    };
    const double coordinate = std::max({maxAbs(a), maxAbs(b), maxAbs(c)}) / scale;
    return length(cross(edge(b), edge(c))) <= 4.0 * std::numeric_limits<double>::epsilon() * (1.0 + coordinate);
}

/// Splits polygons into triangles. Convex ones become a fan from their first corner, which keeps the diagonal of a quad
/// predictable; the others lose one ear after the other.
class Triangulator {
public:
    /// Corner numbers (0 … n−1) of the triangles, three each. A polygon that crosses itself is fanned and counted.
    const std::vector<std::array<std::uint32_t, 3>>& split(const ObjContents& obj, const Face& face) {
        triangles_.clear();
        const std::uint32_t n = face.corner_count;
        if (n == 3) {
            triangles_.push_back({0, 1, 2});
            return triangles_;
        }
        project(obj, face);
        bool convex = true;
        for (std::uint32_t i = 0; i < n && convex; ++i) convex = turn(i, (i + 1) % n, (i + 2) % n) >= 0.0;

        ring_.resize(n);
        for (std::uint32_t i = 0; i < n; ++i) ring_[i] = i;
        while (!convex && ring_.size() > 3 && cutEar()) {}
        if (!convex && ring_.size() > 3) ++crossing_;
        for (std::size_t i = 1; i + 1 < ring_.size(); ++i) triangles_.push_back({ring_[0], ring_[i], ring_[i + 1]});
        return triangles_;
    }

    std::uint64_t crossingPolygons() const { return crossing_; }

private:
    /// Into the coordinate plane the polygon faces most, counter-clockwise.
    void project(const ObjContents& obj, const Face& face) {
        const auto at = [&](std::uint32_t i) -> const Vec3d& {
            return obj.positions[static_cast<std::size_t>(obj.corners[face.first_corner + i % face.corner_count].position)];
        };
        // Newell's normal, about the first corner: the same for flat and for warped polygons, and far from the origin.
        Vec3d normal{};
        for (std::uint32_t i = 1; i + 1 < face.corner_count; ++i) {
            const Vec3d twice_area = cross(minus(at(i), at(0)), minus(at(i + 1), at(0)));
            for (int k = 0; k < 3; ++k) normal[k] += twice_area[k];
        }
        int axis = 0;
        for (int k = 1; k < 3; ++k)
            if (std::abs(normal[k]) > std::abs(normal[axis])) axis = k;
        int u = (axis + 1) % 3, v = (axis + 2) % 3;
        if (normal[axis] < 0.0) std::swap(u, v);
        points_.resize(face.corner_count);
        for (std::uint32_t i = 0; i < face.corner_count; ++i) {
            const Vec3d p = minus(at(i), at(0));
            points_[i] = {p[u], p[v]};
        }
    }

    /// Twice the signed area of three corners; positive is a left turn.
    double turn(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
        const auto [ax, ay] = points_[a];
        return (points_[b][0] - ax) * (points_[c][1] - ay) - (points_[b][1] - ay) * (points_[c][0] - ax);
    }

    /// Removes one corner whose triangle holds no other. False when there is none.
    bool cutEar() {
        const std::size_t n = ring_.size();
        for (std::size_t i = 0; i < n; ++i) {
            const std::uint32_t a = ring_[(i + n - 1) % n], b = ring_[i], c = ring_[(i + 1) % n];
            if (turn(a, b, c) <= 0.0) continue;
            const bool empty = std::none_of(ring_.begin(), ring_.end(), [&](std::uint32_t p) {
                return p != a && p != b && p != c && points_[p] != points_[a] && points_[p] != points_[b] &&
                       points_[p] != points_[c] && turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
            });
            if (!empty) continue;
            triangles_.push_back({a, b, c});
            ring_.erase(ring_.begin() + static_cast<std::ptrdiff_t>(i));
            return true;
        }
        return false;
    }

    std::vector<std::array<double, 2>> points_;
    std::vector<std::uint32_t> ring_;
    std::vector<std::array<std::uint32_t, 3>> triangles_;
    std::uint64_t crossing_ = 0;
};

using MtlColour = const tinyobj::real_t (&)[3];

/// MTL colours are numbers between 0 and 1 that come out of colour pickers: sRGB-encoded by habit, and read as such.
Vec3d linearColour(MtlColour encoded) {
    Vec3d rgb;
    for (int i = 0; i < 3; ++i) rgb[i] = srgbToLinear(std::clamp(encoded[i], 0.0, 1.0));
    return rgb;
}

/// Ke goes beyond 1 where an exporter multiplied it by a strength: the colour is decoded, the strength stays linear.
Vec3d linearEmission(MtlColour encoded) {
    const double strength = std::max({1.0, encoded[0], encoded[1], encoded[2]});
    Vec3d rgb;
    for (int i = 0; i < 3; ++i) rgb[i] = strength * srgbToLinear(std::max(0.0, encoded[i]) / strength);
    return rgb;
}

double brightest(MtlColour c) { return std::max({c[0], c[1], c[2]}); }

bool inRange(MtlColour c) {
    return std::all_of(std::begin(c), std::end(c), [](double x) { return x >= 0.0 && x <= 1.0; });
}

/// An MTL material as one of ours, by these rules, the first that fits:
///
///  1. d < 1 (Tr > 0) or illum 4, 6, 7, 9: Dielectric, smooth and clear, index Ni or 1.5. Ni alone says nothing: Blender
///     writes it for everything.
///  2. Pm ≥ 0.5: Mirror with reflectance Kd. illum 3 or 5 with Kd ≤ 0.1 and a Ks: Mirror with reflectance Ks.
///  3. Diffuse with reflectance Kd (black when there is none).
///
/// `crt_reflectance file.spd` replaces Kd or Ks of 2 and 3 by a measured spectrum. Ke, if not black, becomes the radiance of
/// a one-sided emitter. Ka is ignored. Whatever is lost on the way (roughness, gloss, partial transparency, textures) is
/// named in one warning.
class MaterialMapper {
public:
    MaterialMapper(const tinyobj::material_t& mtl, const MaterialSource& source, LoadedMesh& out)
        : mtl_(mtl), source_(source), out_(out) {}

    Material material() {
        for (const double x : {mtl_.diffuse[0], mtl_.diffuse[1], mtl_.diffuse[2], mtl_.specular[0], mtl_.specular[1],
                               mtl_.specular[2], mtl_.emission[0], mtl_.emission[1], mtl_.emission[2], mtl_.dissolve, mtl_.ior,
                               mtl_.shininess, mtl_.roughness, mtl_.metallic})
            if (!std::isfinite(x)) refuse("a number that is not finite");

        Material m;
        m.name = mtl_.name;
        m.place = {source_.file, source_.line};
        const bool glass = mtl_.dissolve < 1.0 || mtl_.illum == 4 || mtl_.illum == 6 || mtl_.illum == 7 || mtl_.illum == 9;
        const bool metallic = mtl_.metallic >= 0.5;
        const bool polished = (mtl_.illum == 3 || mtl_.illum == 5) && brightest(mtl_.diffuse) <= 0.1 &&
                              brightest(mtl_.specular) > 0.0;
        if (glass)
            dielectric(m);
        else if (metallic || polished)
            mirror(m, metallic);
        else
            diffuse(m);
        if (!mtl_.diffuse_texname.empty() || !mtl_.specular_texname.empty() || !mtl_.emissive_texname.empty() ||
            !mtl_.alpha_texname.empty() || !mtl_.bump_texname.empty() || !mtl_.normal_texname.empty() ||
            !mtl_.roughness_texname.empty() || !mtl_.metallic_texname.empty())
            lost_.push_back("its textures are left out");
        if (!lost_.empty())
            logWarning("{}:{}: material '{}' is approximated: {}", source_.file, source_.line, mtl_.name, fmt::join(lost_, "; "));
        return m;
    }

    std::optional<Emission> emission() const {
        if (!(brightest(mtl_.emission) > 0.0)) return std::nullopt;
        return Emission{rgbEmission(linearEmission(mtl_.emission)), false};
    }

private:
    bool has(const char* statement) const { return source_.statements.contains(statement); }

    [[noreturn]] void refuse(const std::string& what) const {
        fail(fmt::format("material '{}' has {}", mtl_.name, what), source_.file, source_.line);
    }

    void dielectric(Material& m) {
        m.type = MaterialType::Dielectric;
        const double index = has("Ni") ? mtl_.ior : 1.5;
        if (!(index > 0.0)) refuse(fmt::format("a refractive index Ni of {}", index));
        m.eta = constantSpectrum(index);
        if (mtl_.dissolve > 0.0 && mtl_.dissolve < 1.0) lost_.push_back(fmt::format("d = {:g} becomes clear glass", mtl_.dissolve));
        if (has("Tf") && !(mtl_.transmittance[0] == 1.0 && mtl_.transmittance[1] == 1.0 && mtl_.transmittance[2] == 1.0))
            lost_.push_back("the filter colour Tf is left out");
        if (mtl_.unknown_parameter.contains("crt_reflectance")) lost_.push_back("glass has no crt_reflectance");
        smooth();
    }

    void mirror(Material& m, bool metallic) {
        m.type = MaterialType::Mirror;
        m.reflectance = reflectance(metallic ? mtl_.diffuse : mtl_.specular, metallic ? "Kd" : "Ks");
        if (metallic && mtl_.metallic < 1.0) lost_.push_back(fmt::format("metalness {:g} is taken as 1", mtl_.metallic));
        smooth();
    }

    void diffuse(Material& m) {
        m.type = MaterialType::Diffuse;
        m.reflectance = reflectance(mtl_.diffuse, "Kd");
        if (mtl_.metallic > 0.0) lost_.push_back(fmt::format("metalness {:g} is taken as 0", mtl_.metallic));
        // illum 0 and 1 say that there is no highlight, whatever Ks holds.
        if (mtl_.illum >= 2 && brightest(mtl_.specular) > 0.0)
            lost_.push_back(fmt::format("its gloss (Ks{}) is left out",
                                        roughness() ? fmt::format(", roughness {:.2g}", *roughness()) : ""));
    }

    /// Pr, or what Blender's exporter makes of roughness in Ns = 1000 (1 − roughness)².
    std::optional<double> roughness() const {
        if (has("Pr")) return mtl_.roughness;
        if (has("Ns")) return 1.0 - std::sqrt(std::clamp(mtl_.shininess / 1000.0, 0.0, 1.0));
        return std::nullopt;
    }

    void smooth() {
        constexpr double kVisible = 0.05;
        if (roughness().value_or(0.0) > kVisible) lost_.push_back(fmt::format("roughness {:.2g} is taken as 0", *roughness()));
    }

    Spectrum reflectance(MtlColour colour, const char* name) {
        if (const auto measured = mtl_.unknown_parameter.find("crt_reflectance"); measured != mtl_.unknown_parameter.end()) {
            const std::string path =
                (std::filesystem::path(source_.file).parent_path() / std::filesystem::path(trimmed(measured->second))).string();
            const Spectrum s = readSpectrumFile(path, Outside::Clamp);
            if (s.min() < 0.0 || s.max() > 1.0) fail("a reflectance must lie in [0, 1]", path);
            if (std::find(out_.files.begin(), out_.files.end(), path) == out_.files.end()) out_.files.push_back(path);
            return s;
        }
        if (!inRange(colour)) lost_.push_back(fmt::format("{} is clamped to [0, 1]", name));
        return rgbReflectance(linearColour(colour));
    }

    const tinyobj::material_t& mtl_;
    const MaterialSource& source_;
    LoadedMesh& out_;
    std::vector<std::string> lost_;
};

}  // namespace

LoadedMesh loadObj(const std::string& path, bool use_mtl) {
    const std::string text = readText(path, "mesh", {path});
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
        MaterialMapper mapper(obj.materials[mtl], obj.material_sources[mtl], out);
        material_index[mtl] = static_cast<std::int32_t>(out.materials.size());
        out.materials.push_back(mapper.material());
        if (std::optional<Emission> emission = mapper.emission()) {
            emission_index[mtl] = static_cast<std::int32_t>(out.emissions.size());
            out.emissions.push_back(*emission);
        }
    };

    Mesh& mesh = out.mesh;
    Triangulator triangulator;
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
        for (const auto& triangle : triangulator.split(obj, face)) {
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
