// Over 450 lines: one class, which puts a mesh together and says what was lost on the way.
#include "scene/mesh/ply_reader.h"

#include "base/error.h"
#include "base/input_file.h"
#include "base/log.h"
#include "base/parallel.h"
#include "base/vec3d.h"
#include "scene/mesh/mesh_format.h"
#include "scene/mesh/mesh_rules.h"
#include "scene/mesh/ply_properties.h"
#include "scene/mesh/ply_rows.h"
#include "scene/mesh/triangulate.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <functional>
#include <limits>
#include <utility>

namespace crt {

using namespace ply;

namespace {

constexpr std::uint64_t kMostVertices = 0xfffffffeu;  // Below kNoNormal and kNoUv.
constexpr std::size_t kRowsAtATime = std::size_t{1} << 14;

/// Losses in a block of elements.
struct Losses {
    MeshLoss bad_positions, bad_normals, bad_uvs, bad_colors, small_faces;
    std::uint64_t flat_faces = 0, faces_without_position = 0, degenerate = 0, crossing = 0, transparent = 0;

    void add(const Losses& behind) {
        bad_positions.add(behind.bad_positions);
        bad_normals.add(behind.bad_normals);
        bad_uvs.add(behind.bad_uvs);
        bad_colors.add(behind.bad_colors);
        small_faces.add(behind.small_faces);
        flat_faces += behind.flat_faces;
        faces_without_position += behind.faces_without_position;
        degenerate += behind.degenerate;
        crossing += behind.crossing;
        transparent += behind.transparent;
    }
};

class PlyMesh {
public:
    PlyMesh(std::string content, const std::string& path, const PlyOptions& options, Stage& stage,
            std::size_t rows_at_a_time)
        : content_(std::move(content)),
          path_(path),
          options_(options),
          stage_(stage),
          header_(readPlyHeader(content_, path)),
          vertex_(require("vertex")),
          face_(require("face")),
          vertex_slots_(slotsOfVertices(vertex_)),
          face_slots_(slotsOfFaces(face_)) {
        requireProperties();
        const PlyRows rows(content_, header_, path, rows_at_a_time);
        stage_.setAmount(static_cast<double>(vertex_.count + face_.count));
        if (vertex_.count > kMostVertices)
            failMesh("the file has more than four thousand million vertices", path_, vertex_.line);
        trailing_ = rows.trailingBytes();
        readVertices(rows);
        readFaces(rows);
    }

    LoadedMesh take() {
        content_ = {};
        if (triangles_ == 0) requireFaces();
        joinParts();
        repair();
        sayWhatIsLost();
        sayWhatIsLeftOut();
        out_.files = {path_};
        out_.degenerate_faces = losses_.degenerate;
        return std::move(out_);
    }

private:
    /// The triangles of a block of faces.
    struct Part {
        std::vector<std::array<std::uint32_t, 3>> triangles;
        std::vector<std::array<double, 2>> uvs;            ///< Of corners of faces.
        std::vector<std::array<std::uint32_t, 3>> wedges;  ///< Into `uvs`, where faces have any.
        std::vector<std::uint32_t> flat;                   ///< Triangles without usable normals.
        Losses losses;
    };

    // ---- Header ----

    const PlyElement& require(const char* name) const {
        if (const PlyElement* element = header_.find(name)) return *element;
        std::vector<std::string> others;
        for (const PlyElement& e : header_.elements)
            others.push_back(fmt::format("{} of {}", e.count, inQuotes(e.name)));
        if (header_.find("tristrips") != nullptr)
            failMesh(
                "the faces of this mesh are strips of triangles (tristrips), which crt does not read; write "
                "it with the element 'face'",
                path_);
        failMesh(fmt::format("this mesh has no element '{}', only {}", name,
                             others.empty() ? "a header" : fmt::format("{}", fmt::join(others, ", "))),
                 path_);
    }

    void requireProperties() const {
        if (!has(vertex_slots_, kX)) failMesh("vertices need the numbers x, y and z", path_, vertex_.line);
        if (!has(face_slots_, kCorners))
            failMesh("faces need a list 'vertex_indices' or 'vertex_index'", path_, face_.line);
        for (const auto& [property, role] : face_slots_)
            if (role == kCorners && !isInteger(property.type))
                failMesh(fmt::format("the indices of '{}' are integers, not floats", property.name), path_,
                         face_.line);
    }

    // ---- Vertices ----

    void readVertices(const PlyRows& rows) {
        Mesh& mesh = out_.mesh;
        mesh.positions.resize(vertex_.count);
        if (has(vertex_slots_, kNx)) mesh.normals.resize(vertex_.count);
        if (has(vertex_slots_, kU) && !has(face_slots_, kWedges)) mesh.uvs.resize(vertex_.count);
        for (const auto& [property, role] : vertex_slots_) {
            if (role == kRed) color_code_ = ColorCode(property.type, options_.color);
            if (role == kAlpha) full_alpha_ = ColorCode(property.type, options_.color).full();
        }
        if (has(vertex_slots_, kRed)) mesh.colors.resize(vertex_.count);
        const PlyBlocks& blocks = rows.blocksOf(vertex_);
        std::vector<Losses> losses(blocks.places.size());
        forBlocks(blocks, [&](std::size_t block) {
            Row row;
            rows.forEachRow(blocks, block, [&](auto& cursor, std::size_t i, int line) {
                readRow(cursor, vertex_slots_, row);
                setVertex(i, row.number, line, losses[block]);
            });
        });
        for (const Losses& part : losses) losses_.add(part);
        normaliseNormals(mesh.normals);
    }

    /// Of several errors the first in the file is thrown, independent of the order of threads.
    void forBlocks(const PlyBlocks& blocks, const std::function<void(std::size_t)>& read) {
        std::vector<std::optional<Error>> errors(blocks.places.size());
        parallelFor(blocks.places.size(), 1, [&](std::size_t block, std::size_t) {
            try {
                read(block);
            } catch (const Error& error) {
                errors[block].emplace(error);
            }
            stage_.at(static_cast<double>(done_ += blocks.end(block) - blocks.first(block)));
        });
        for (const std::optional<Error>& error : errors)
            if (error) throw Error(*error);
    }

    /// NaN, and noted, where one of them is no number.
    static Vec3d vectorOf(const std::array<double, kNumbers>& number, std::size_t first, const char* what,
                          std::size_t vertex, int line, MeshLoss& loss) {
        const Vec3d v{number[first], number[first + 1], number[first + 2]};
        if (std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2])) return v;
        loss.add(line, fmt::format("the {} of vertex {} is not finite", what, vertex));
        constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
        return {kNoNumber, kNoNumber, kNoNumber};
    }

    void setVertex(std::size_t i, const std::array<double, kNumbers>& number, int line, Losses& losses) {
        Mesh& mesh = out_.mesh;
        mesh.positions[i] = vectorOf(number, kX, "position", i, line, losses.bad_positions);
        if (!mesh.normals.empty())
            mesh.normals[i] = vectorOf(number, kNx, "normal", i, line, losses.bad_normals);
        if (!mesh.uvs.empty()) mesh.uvs[i] = uvOf(number[kU], number[kV], "vertex", i, line, losses.bad_uvs);
        if (!mesh.colors.empty())
            for (std::size_t k = 0; k < 3; ++k)
                mesh.colors[i][k] = colorOf(number[kRed + k], i, line, losses);
        losses.transparent += full_alpha_ > 0 && number[kAlpha] < full_alpha_;
    }

    static std::array<double, 2> uvOf(double u, double v, const char* element, std::size_t number, int line,
                                      MeshLoss& loss) {
        if (std::abs(u) <= kMostMeshUv && std::abs(v) <= kMostMeshUv) return {u, v};
        loss.add(line, fmt::format("texture coordinates must be numbers up to {:g}, and those of {} {} are "
                                   "not",
                                   kMostMeshUv, element, number));
        return {};
    }

    float colorOf(double number, std::size_t vertex, int line, Losses& losses) const {
        const double full = color_code_.full();
        if (number >= 0 && number <= full) return color_code_(number);
        losses.bad_colors.add(line, fmt::format("colours must lie between 0 and {:g}, and vertex {} has {}",
                                                full, vertex, number));
        return color_code_(number > 0 ? full : 0);  // NaN is 0.
    }

    // ---- Faces ----

    void readFaces(const PlyRows& rows) {
        const PlyBlocks& blocks = rows.blocksOf(face_);
        parts_.resize(blocks.places.size());
        forBlocks(blocks, [&](std::size_t block) { readFaces(rows, blocks, block); });
        for (const Part& part : parts_) {
            losses_.add(part.losses);
            triangles_ += part.triangles.size();
            flat_ += part.flat.size();
        }
    }

    void readFaces(const PlyRows& rows, const PlyBlocks& blocks, std::size_t block) {
        Part& part = parts_[block];
        part.triangles.reserve(blocks.end(block) - blocks.first(block));
        Row row;
        Triangulator triangulator;
        std::vector<Vec3d> polygon;
        rows.forEachRow(blocks, block, [&](auto& cursor, std::size_t i, int line) {
            readRow(cursor, face_slots_, row);
            if (!takeCorners(row, i, line, polygon, part)) return;
            const auto first_wedge = static_cast<std::uint32_t>(part.uvs.size());
            const bool wedges = takeWedges(row, i, line, part);
            for (const PolygonTriangle& triangle : triangulator.split(polygon))
                addTriangle(triangle, row, polygon, wedges ? first_wedge : kNoUv, part);
        });
        part.losses.crossing = triangulator.crossingPolygons();
    }

    /// Into `polygon`; false for a face that cannot be seen.
    bool takeCorners(const Row& row, std::size_t face, int line, std::vector<Vec3d>& polygon,
                     Part& part) const {
        const Mesh& mesh = out_.mesh;
        bool lost_position = false, lost_normal = false;
        polygon.clear();
        for (const std::int64_t corner : row.corners) {
            if (corner < 0 || static_cast<std::uint64_t>(corner) >= mesh.positions.size())
                throw BadPlyRow{
                    fmt::format("uses vertex {}, but the file has {}", corner, mesh.positions.size())};
            const auto vertex = static_cast<std::size_t>(corner);
            polygon.push_back(mesh.positions[vertex]);
            lost_position |= !isNumber(polygon.back());
            lost_normal |= !mesh.normals.empty() && !isNumber(mesh.normals[vertex]);
        }
        if (polygon.size() < 3) {
            part.losses.small_faces.add(
                line, fmt::format("a face needs at least three corners, and face {} has {}", face,
                                  polygon.size()));
            return false;
        }
        part.losses.faces_without_position += lost_position;
        part.losses.flat_faces += !lost_position && lost_normal;
        return !lost_position;
    }

    /// The texture coordinates of corners; false where there are not two for each.
    static bool takeWedges(const Row& row, std::size_t face, int line, Part& part) {
        if (row.wedges.empty()) return false;
        if (row.wedges.size() != 2 * row.corners.size()) {
            part.losses.bad_uvs.add(line, fmt::format("face {} has {} corners, and {} numbers in 'texcoord'",
                                                      face, row.corners.size(), row.wedges.size()));
            return false;
        }
        for (std::size_t k = 0; k < row.corners.size(); ++k)
            part.uvs.push_back(
                uvOf(row.wedges[2 * k], row.wedges[2 * k + 1], "face", face, line, part.losses.bad_uvs));
        return true;
    }

    void addTriangle(const PolygonTriangle& triangle, const Row& row, const std::vector<Vec3d>& polygon,
                     std::uint32_t first_wedge, Part& part) const {
        if (isDegenerate(polygon[triangle[0]], polygon[triangle[1]], polygon[triangle[2]])) {
            ++part.losses.degenerate;
            return;
        }
        std::array<std::uint32_t, 3> position{}, wedge{kNoUv, kNoUv, kNoUv};
        bool smooth = true;
        for (std::size_t k = 0; k < 3; ++k) {
            position[k] = static_cast<std::uint32_t>(row.corners[triangle[k]]);
            smooth &= out_.mesh.normals.empty() || isNumber(out_.mesh.normals[position[k]]);
            if (first_wedge != kNoUv) wedge[k] = first_wedge + triangle[k];
        }
        if (!smooth) part.flat.push_back(static_cast<std::uint32_t>(part.triangles.size()));
        part.triangles.push_back(position);
        if (has_wedges_) part.wedges.push_back(wedge);
    }

    void joinParts() {
        Mesh& mesh = out_.mesh;
        if (flat_ == triangles_) mesh.normals = {};  // None of them is of use.
        std::vector<std::size_t> first(parts_.size()), first_uv(parts_.size());
        std::size_t triangles = 0, uvs = 0;
        for (std::size_t i = 0; i < parts_.size(); ++i) {
            first[i] = std::exchange(triangles, triangles + parts_[i].triangles.size());
            first_uv[i] = std::exchange(uvs, uvs + parts_[i].uvs.size());
        }
        if (uvs >= kNoUv)
            failMesh("the file has more than four thousand million texture coordinates", path_);
        mesh.triangles.resize(triangles_);
        if (!mesh.normals.empty()) mesh.normal_index.resize(triangles_);
        if (has_wedges_) mesh.uvs.resize(uvs);
        if (!mesh.uvs.empty()) mesh.uv_index.resize(triangles_);
        parallelFor(parts_.size(), 1, [&](std::size_t i, std::size_t) {
            const Part part = std::exchange(parts_[i], {});
            const auto at = [&](auto& all) { return all.begin() + static_cast<std::ptrdiff_t>(first[i]); };
            std::copy(part.triangles.begin(), part.triangles.end(), at(mesh.triangles));
            if (!mesh.normal_index.empty()) {
                std::copy(part.triangles.begin(), part.triangles.end(), at(mesh.normal_index));
                for (const std::uint32_t flat : part.flat)
                    mesh.normal_index[first[i] + flat].fill(kNoNormal);
            }
            if (mesh.uv_index.empty()) return;
            if (!has_wedges_) {
                std::copy(part.triangles.begin(), part.triangles.end(), at(mesh.uv_index));
                return;
            }
            std::copy(part.uvs.begin(), part.uvs.end(),
                      mesh.uvs.begin() + static_cast<std::ptrdiff_t>(first_uv[i]));
            std::transform(part.wedges.begin(), part.wedges.end(), at(mesh.uv_index), [&](auto wedge) {
                for (std::uint32_t& uv : wedge)
                    if (uv != kNoUv) uv += static_cast<std::uint32_t>(first_uv[i]);
                return wedge;
            });
        });
    }

    /// No triangle names a vertex or normal that is no number, but all that is stored shall be one.
    void repair() {
        Mesh& mesh = out_.mesh;
        if (losses_.bad_positions.count > 0)
            for (Vec3d& p : mesh.positions)
                if (!isNumber(p)) p = somePosition(mesh);
        for (Vec3d& n : mesh.normals)
            if (!isNumber(n)) n = {0, 0, 0};
    }

    // ---- Messages ----

    /// Faces without an area are enough, for what shows nothing but is sound.
    void requireFaces() const {
        const Losses& l = losses_;
        if (l.faces_without_position > 0) failMesh(l.bad_positions.sentence, path_, l.bad_positions.line);
        if (l.degenerate > 0) return;
        if (l.small_faces.count > 0) failMesh(l.small_faces.sentence, path_, l.small_faces.line);
        failMesh(vertex_.count > 0 ? fmt::format("this mesh has no faces, only {} points", vertex_.count)
                                   : std::string("this mesh has no faces"),
                 path_);
    }

    /// "a.ply" or "a.ply:17"
    std::string at(const MeshLoss& loss) const {
        return loss.line > 0 ? fmt::format("{}:{}", path_, loss.line) : path_;
    }

    void sayWhatIsLost() const {
        const Losses& l = losses_;
        if (l.faces_without_position > 0)
            logWarning("{}: {}; {} left out for such vertices", at(l.bad_positions),
                       l.bad_positions.sentence, counted(l.faces_without_position, "face"));
        if (l.small_faces.count > 0)
            logWarning("{}: {}; {} left out", at(l.small_faces), l.small_faces.sentence,
                       counted(l.small_faces.count, "face"));
        if (l.degenerate > 0)
            logWarning("{}: {} without area left out", path_, counted(l.degenerate, "triangle"));
        if (l.flat_faces > 0 && l.bad_normals.count > 0)
            logWarning("{}: {}; {} shaded flat for such normals", at(l.bad_normals), l.bad_normals.sentence,
                       counted(l.flat_faces, "face"));
        else if (l.flat_faces > 0)
            logWarning("{}: {} shaded flat: one of their normals has no direction", path_,
                       counted(l.flat_faces, "face"));
        if (l.bad_uvs.count > 0)
            logWarning("{}: {}; as {} in all, which are left out", at(l.bad_uvs), l.bad_uvs.sentence,
                       counted(l.bad_uvs.count, "pair"));
        if (l.bad_colors.count > 0)
            logWarning("{}: {}; clamped, as {} in all", at(l.bad_colors), l.bad_colors.sentence,
                       counted(l.bad_colors.count, "number"));
        if (l.crossing > 0)
            logWarning("{}: {} may be split wrongly, because their outlines cross themselves", path_,
                       counted(l.crossing, "polygon"));
    }

    static void addNames(const std::vector<Slot>& slots, const char* element,
                         std::vector<std::string>& out) {
        constexpr std::size_t kMostNamed = 8;
        std::vector<std::string> names;
        for (const auto& [property, role] : slots)
            if (role == kNone) names.push_back(inQuotes(property.name));
        if (names.empty()) return;
        const std::size_t more = names.size() > kMostNamed ? names.size() - kMostNamed : 0;
        names.resize(names.size() - more);
        out.push_back(fmt::format("{}{} of {}", fmt::join(names, ", "),
                                  more > 0 ? fmt::format(" and {} more", more) : "", element));
    }

    /// Properties that crt does not support, in one line.
    void sayWhatIsLeftOut() const {
        std::vector<std::string> what;
        addNames(vertex_slots_, "vertices", what);
        if (has(vertex_slots_, kU) && has_wedges_)
            what.push_back("texture coordinates of vertices (faces have their own)");
        if (losses_.transparent > 0) what.push_back("'alpha' of vertices");
        addNames(face_slots_, "faces", what);
        constexpr std::size_t kMostNamed = 8;
        std::size_t elements = 0;
        for (const PlyElement& e : header_.elements)
            if (&e != &vertex_ && &e != &face_ && ++elements <= kMostNamed)
                what.push_back(e.name == "tristrips"
                                   ? fmt::format("{} strips of triangles (tristrips)", e.count)
                                   : fmt::format("{} of {}", e.count, inQuotes(e.name)));
        if (elements > kMostNamed) what.push_back(fmt::format("{} more elements", elements - kMostNamed));
        if (!header_.textures.empty())
            what.push_back(
                fmt::format("the texture {}, which a comment mentions: give the object a material with it",
                            inQuotes(header_.textures.front())));
        if (trailing_ > 0) what.push_back(fmt::format("{} bytes after the last element", trailing_));
        if (!what.empty()) logWarning("{}: left out: {}", path_, fmt::join(what, "; "));
    }

    std::string content_;
    const std::string& path_;
    const PlyOptions& options_;
    Stage& stage_;
    const PlyHeader header_;
    const PlyElement &vertex_, &face_;
    const std::vector<Slot> vertex_slots_, face_slots_;
    const bool has_wedges_ = has(face_slots_, kWedges);
    ColorCode color_code_;
    double full_alpha_ = 0;  ///< 0: there is none.
    LoadedMesh out_;
    std::vector<Part> parts_;
    Losses losses_;
    std::size_t triangles_ = 0, flat_ = 0, trailing_ = 0;
    std::atomic<std::size_t> done_{0};
};

}  // namespace

LoadedMesh readPly(std::string content, const std::string& path, const PlyOptions& options, Stage& stage,
                   std::size_t rows_at_a_time) {
    return PlyMesh(std::move(content), path, options, stage, rows_at_a_time).take();
}

LoadedMesh loadPly(const std::string& path, const PlyOptions& options) {
    Stage stage("reading " + std::filesystem::path(path).filename().string());
    std::string content;
    try {
        content = readInput(path, kMostMeshBytes);
    } catch (const InputRefused& refused) {
        failMesh(fmt::format("mesh '{}' {}", path, refused.what()), path);
    }
    if (!beginsAsPly(content)) {
        const std::string format = otherFormat(content);
        failMesh(format.empty()
                     ? "this is not a PLY file, because its first line is not 'ply'; for an OBJ use 'obj:' "
                       "instead of 'ply:'"
                     : fmt::format("this is {}; 'ply:' needs a PLY file", format),
                 path);
    }
    return readPly(std::move(content), path, options, stage, kRowsAtATime);
}

}  // namespace crt
