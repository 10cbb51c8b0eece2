#include "scene/mesh/mesh_io.h"

#include "base/error.h"
#include "base/input_file.h"
#include "base/log.h"
#include "base/parallel.h"
#include "base/stage.h"
#include "scene/mesh/material_files.h"
#include "scene/mesh/mesh_format.h"
#include "scene/mesh/mesh_rules.h"
#include "scene/mesh/obj_reader.h"
#include "scene/mesh/obj_text.h"
#include "scene/mesh/ply_header.h"
#include "scene/mesh/triangulate.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <utility>

namespace crt {
namespace {

/// Puts what an OBJ says together: faces become triangles, names become materials.
class MeshBuilder {
public:
    MeshBuilder(ObjContents obj, const std::string& path, const ObjOptions& options)
        : obj_(std::move(obj)), path_(path), options_(options) {}

    LoadedMesh build() {
        out_.files = {path_};
        normaliseNormals(obj_.normals);
        if (options_.use_mtl) files_ = readMaterialFiles(obj_, path_);
        material_index_.assign(obj_.material_names.size(), -1);
        makeTriangles();
        for (const Part& part : parts_) join(part);
        if (triangles_ == 0) requireFaces();
        joinTriangles();
        finish();
        return std::move(out_);
    }

private:
    /// The triangles of a block of faces.
    struct Part {
        /// Normals and texture coordinates where the file has any.
        std::vector<std::array<std::uint32_t, 3>> triangles, normals, uvs;
        std::vector<std::int32_t> material, part;  ///< As of ObjRun, where the file names any.
        std::vector<std::int32_t> used;            ///< Materials, in the order in which faces use them.
        MeshLoss wild_normals, wild_uvs;
        std::uint64_t flat_faces = 0, faces_without_position = 0, degenerate = 0, crossing = 0;
        std::uint64_t triangles_without_uv = 0;
        bool any_smooth = false;
    };

    /// Frees the faces that they are made of.
    void makeTriangles() {
        parts_.resize(obj_.blocks.size());
        std::size_t faces = 0;
        for (const ObjBlock& block : obj_.blocks) faces += block.faces.size();
        any_faces_ = faces > 0;
        Stage stage("making triangles of " + std::filesystem::path(path_).filename().string(),
                    static_cast<double>(faces));
        std::atomic<std::size_t> done{0};
        parallelFor(parts_.size(), 1, [&](std::size_t i, std::size_t) {
            ObjBlock block = std::exchange(obj_.blocks[i], {});
            makeTriangles(block, parts_[i]);
            stage.at(static_cast<double>(done += block.faces.size()));
        });
    }

    void makeTriangles(const ObjBlock& block, Part& part) const {
        Triangulator triangulator;
        std::vector<Vec3d> polygon;
        std::vector<bool> known(obj_.material_names.size(), false);
        part.triangles.reserve(block.faces.size());
        std::size_t run = 0;
        for (std::size_t i = 0; i < block.faces.size(); ++i) {
            const ObjFace& face = block.faces[i];
            if (run + 1 < block.runs.size() && block.runs[run + 1].first_face == i) ++run;
            const std::span<const ObjCorner> corners(&block.corners[face.first_corner], face.corner_count);
            if (!takeCorners(face, corners, polygon, part)) continue;
            const std::int32_t material = block.runs[run].material;
            if (material >= 0 && !known[static_cast<std::size_t>(material)]) {
                known[static_cast<std::size_t>(material)] = true;
                part.used.push_back(material);
            }
            for (const PolygonTriangle& triangle : triangulator.split(polygon))
                addTriangle(triangle, block.runs[run], corners, polygon, part);
        }
        part.crossing = triangulator.crossingPolygons();
    }

    bool usable(std::uint32_t normal) const {
        return normal < kBadObjNormal && isNumber(obj_.normals[normal]);
    }

    /// Into `polygon`; false for a face that cannot be seen.
    bool takeCorners(const ObjFace& face, std::span<const ObjCorner> corners, std::vector<Vec3d>& polygon,
                     Part& part) const {
        bool lost_position = false, lost_normal = false, lost_uv = false;
        polygon.clear();
        for (const ObjCorner& corner : corners) {
            polygon.push_back(obj_.positions[corner.position]);
            lost_position |= !isNumber(polygon.back());
            lost_uv |= corner.uv == kBadObjUv;
            if (corner.normal == kNoObjNormal || usable(corner.normal)) continue;
            lost_normal = true;
            if (corner.normal == kBadObjNormal) part.wild_normals.add(face.line, "");
        }
        if (lost_uv) part.wild_uvs.add(face.line, "");
        part.faces_without_position += lost_position;
        part.flat_faces += !lost_position && lost_normal;
        return !lost_position;
    }

    void addTriangle(const PolygonTriangle& triangle, const ObjRun& run, std::span<const ObjCorner> corners,
                     const std::vector<Vec3d>& polygon, Part& part) const {
        if (isDegenerate(polygon[triangle[0]], polygon[triangle[1]], polygon[triangle[2]])) {
            ++part.degenerate;
            return;
        }
        std::array<std::uint32_t, 3> position, normal, uv;
        bool smooth = true, has_uv = true;
        for (std::size_t k = 0; k < 3; ++k) {
            const ObjCorner& corner = corners[triangle[k]];
            position[k] = corner.position;
            normal[k] = corner.normal;
            smooth &= usable(corner.normal);
            uv[k] = corner.uv;
            has_uv &= corner.uv < kBadObjUv;
        }
        if (!has_uv) uv.fill(kNoUv);
        part.triangles_without_uv += !has_uv;
        if (!smooth) normal.fill(kNoNormal);
        part.any_smooth |= smooth;
        part.triangles.push_back(position);
        if (!obj_.normals.empty()) part.normals.push_back(normal);
        if (!obj_.uvs.empty()) part.uvs.push_back(uv);
        if (namesMaterials()) part.material.push_back(run.material);
        if (!obj_.parts.empty()) part.part.push_back(run.part);
    }

    bool namesMaterials() const { return options_.use_mtl && !obj_.material_names.empty(); }

    /// Counts, and materials in the order in which the faces of the file use them.
    void join(const Part& part) {
        triangles_ += part.triangles.size();
        wild_normals_.add(part.wild_normals);
        wild_uvs_.add(part.wild_uvs);
        flat_faces_ += part.flat_faces;
        faces_without_position_ += part.faces_without_position;
        out_.degenerate_faces += part.degenerate;
        crossing_polygons_ += part.crossing;
        any_smooth_ |= part.any_smooth;
        triangles_without_uv_ += part.triangles_without_uv;
        if (options_.use_mtl)
            for (const std::int32_t name : part.used) addMaterial(static_cast<std::size_t>(name));
    }

    void addMaterial(std::size_t name) {
        if (material_index_[name] >= 0) return;
        LoadedMaterial loaded{obj_.material_names[name], std::nullopt};
        if (const auto defined = files_.materials.find(loaded.name); defined != files_.materials.end())
            loaded.mtl = mapMtlMaterial(defined->second, options_.color, summary_);
        material_index_[name] = static_cast<std::int32_t>(out_.materials.size());
        out_.materials.push_back(std::move(loaded));
    }

    void joinTriangles() {
        Mesh& mesh = out_.mesh;
        mesh.triangles.resize(triangles_);
        if (any_smooth_) mesh.normal_index.resize(triangles_);
        if (anyUv()) mesh.uv_index.resize(triangles_);
        if (!out_.materials.empty()) mesh.material.resize(triangles_);
        if (!obj_.parts.empty()) out_.part.resize(triangles_);
        std::vector<std::size_t> first(parts_.size());
        for (std::size_t i = 1; i < parts_.size(); ++i)
            first[i] = first[i - 1] + parts_[i - 1].triangles.size();
        parallelFor(parts_.size(), 1, [&](std::size_t i, std::size_t) {
            const Part part = std::exchange(parts_[i], {});
            const auto at = static_cast<std::ptrdiff_t>(first[i]);
            std::copy(part.triangles.begin(), part.triangles.end(), mesh.triangles.begin() + at);
            std::copy(part.part.begin(), part.part.end(), out_.part.begin() + (out_.part.empty() ? 0 : at));
            if (any_smooth_)
                std::copy(part.normals.begin(), part.normals.end(), mesh.normal_index.begin() + at);
            if (anyUv()) std::copy(part.uvs.begin(), part.uvs.end(), mesh.uv_index.begin() + at);
            if (!out_.materials.empty())
                std::transform(part.material.begin(), part.material.end(), mesh.material.begin() + at,
                               [this](std::int32_t name) {
                                   return name < 0 ? -1 : material_index_[static_cast<std::size_t>(name)];
                               });
        });
    }

    /// Faces without an area are enough, for what shows nothing but is sound.
    void requireFaces() const {
        const MeshLoss& bad = obj_.bad_positions;
        if (bad.count > 0 && (faces_without_position_ > 0 || !any_faces_))
            failMesh(bad.sentence, path_, bad.line);
        if (out_.degenerate_faces > 0) return;
        if (obj_.small_faces.count > 0) failMesh(obj_.small_faces.sentence, path_, obj_.small_faces.line);
        const std::vector<std::string> others = otherGeometry();
        if (!others.empty())
            failMesh(fmt::format("this mesh has no faces, only {}", fmt::join(others, ", ")), path_);
        failMesh("this mesh has no faces", path_);
    }

    /// Statements that crt does not support.
    std::vector<std::string> otherGeometry() const {
        std::vector<std::string> others;
        if (obj_.lines > 0) others.push_back(counted(obj_.lines, "line statement"));
        if (obj_.points > 0) others.push_back(counted(obj_.points, "point statement"));
        if (obj_.free_forms > 0) others.push_back(counted(obj_.free_forms, "free form"));
        return others;
    }

    void finish() {
        sayWhatIsLost();
        sayMaterials();
        out_.missing_files = files_.missing;
        out_.parts = std::move(obj_.parts);
        out_.files.insert(out_.files.end(), files_.files.begin(), files_.files.end());
        for (const LoadedMaterial& m : out_.materials) {
            if (!m.mtl || m.mtl->spectrum_file.empty()) continue;
            if (std::find(out_.files.begin(), out_.files.end(), m.mtl->spectrum_file) == out_.files.end())
                out_.files.push_back(m.mtl->spectrum_file);
        }
        Mesh& mesh = out_.mesh;
        mesh.positions = std::move(obj_.positions);
        // No triangle names a vertex or normal that is no number, but all that is stored shall be one.
        for (Vec3d& p : mesh.positions)
            if (!isNumber(p)) p = somePosition(mesh);
        for (Vec3d& n : obj_.normals)
            if (!isNumber(n)) n = {0, 0, 0};
        if (any_smooth_) mesh.normals = std::move(obj_.normals);
        if (anyUv()) mesh.uvs = std::move(obj_.uvs);
    }

    bool anyUv() const { return !obj_.uvs.empty() && triangles_without_uv_ < triangles_; }

    void sayWhatIsLost() const {
        if (faces_without_position_ > 0)
            logWarning("{}:{}: {}; {} left out for such vertices", path_, obj_.bad_positions.line,
                       obj_.bad_positions.sentence, counted(faces_without_position_, "face"));
        if (obj_.small_faces.count > 0)
            logWarning("{}:{}: {} with fewer than three corners left out", path_, obj_.small_faces.line,
                       counted(obj_.small_faces.count, "face"));
        if (out_.degenerate_faces > 0)
            logWarning("{}: {} without area left out", path_, counted(out_.degenerate_faces, "triangle"));
        if (flat_faces_ > 0 && wild_normals_.count > 0)
            logWarning("{}:{}: {} shaded flat: they use a normal that is not in the file, which has {}",
                       path_,
                       wild_normals_.line, counted(flat_faces_, "face"), obj_.normals.size());
        else if (flat_faces_ > 0 && obj_.bad_normals.count > 0)
            logWarning("{}:{}: {}; {} shaded flat for such normals", path_, obj_.bad_normals.line,
                       obj_.bad_normals.sentence, counted(flat_faces_, "face"));
        else if (flat_faces_ > 0)
            logWarning("{}: {} shaded flat: one of their normals has no direction", path_,
                       counted(flat_faces_, "face"));
        if (wild_uvs_.count > 0 && !obj_.uvs.empty())
            logWarning("{}:{}: {} without an image: they use texture coordinates that are not in the file, "
                       "which has {}",
                       path_, wild_uvs_.line, counted(wild_uvs_.count, "face"), obj_.uvs.size());
        if (obj_.bad_uvs.count > 0)
            logWarning("{}:{}: {}; taken for (0, 0), as {} in all", path_, obj_.bad_uvs.line,
                       obj_.bad_uvs.sentence, counted(obj_.bad_uvs.count, "pair"));
        if (crossing_polygons_ > 0)
            logWarning("{}: {} may be split wrongly, because their outlines cross themselves", path_,
                       counted(crossing_polygons_, "polygon"));
    }

    /// "'a.mtl' or 'b.mtl'"
    std::string missingFiles() const {
        std::vector<std::string> names;
        for (const std::string& name : files_.missing) names.push_back(inQuotes(name));
        return fmt::format("{}", fmt::join(names, " or "));
    }

    /// One line about all materials of the file, with what else crt has no place for.
    void sayMaterials() const {
        std::vector<std::string> undefined;
        for (const LoadedMaterial& m : out_.materials)
            if (!m.mtl) undefined.push_back(inQuotes(m.name));
        const auto bare = std::count_if(
            out_.mesh.material.begin(), out_.mesh.material.end(),
            [&](std::int32_t m) { return m >= 0 && !out_.materials[static_cast<std::size_t>(m)].mtl; });
        if (!undefined.empty()) {
            constexpr std::size_t kMostNamed = 6;
            const std::size_t more = undefined.size() > kMostNamed ? undefined.size() - kMostNamed : 0;
            undefined.resize(undefined.size() - more);
            logWarning(
                "{}: material{} {}{} not defined{}: {} of {} have no material", path_,
                undefined.size() + more == 1 ? "" : "s", fmt::join(undefined, ", "),
                more > 0                ? fmt::format(" and {} more are", more)
                : undefined.size() == 1 ? " is"
                                        : " are",
                files_.missing.empty() ? "" : fmt::format(", and the file {} does not exist",
                                                          missingFiles()), bare,
                counted(out_.mesh.triangles.size(), "triangle"));
        } else if (!files_.missing.empty()) {
            logWarning("{}: the material file {} does not exist", path_, missingFiles());
        }
        std::vector<std::string> left_out = otherGeometry();
        if (obj_.vertex_colors) left_out.push_back("colours of vertices");
        const std::string geometry =
            left_out.empty() ? "" : fmt::format("left out: {}", fmt::join(left_out, ", "));
        if (summary_.empty()) {
            if (!left_out.empty()) logWarning("{}: {}", path_, geometry);
            return;
        }
        const std::string text =
            fmt::format("{}: {}{}{}", path_, summary_.text(), left_out.empty() ? "" : "; ", geometry);
        if (summary_.lossy() || !left_out.empty())
            logWarning("{}", text);
        else
            logInfo("{}", text);
    }

    ObjContents obj_;
    const std::string& path_;
    const ObjOptions& options_;
    MaterialFiles files_;
    MtlSummary summary_;
    LoadedMesh out_;
    std::vector<std::int32_t> material_index_;  ///< By the name's number in the OBJ; −1: not used yet.
    std::vector<Part> parts_;
    MeshLoss wild_normals_, wild_uvs_;
    std::size_t triangles_ = 0, triangles_without_uv_ = 0;
    std::uint64_t flat_faces_ = 0, faces_without_position_ = 0, crossing_polygons_ = 0;
    bool any_faces_ = false, any_smooth_ = false;
};

/// Contents of an OBJ. Its text is gone when this returns.
ObjContents readContents(const std::string& path) {
    Stage stage("reading " + std::filesystem::path(path).filename().string());
    const std::string text = readTextFile(path, "mesh", kMostMeshBytes, {path});
    if (beginsAsPly(text)) failMesh("this is a PLY file; use 'ply:' instead of 'obj:'", path);
    if (const std::string format = otherFormat(text); !format.empty())
        failMesh(fmt::format("this is {}; crt reads OBJ", format), path);
    ObjContents obj = readObj(text, path, stage);
    const bool any_faces = std::any_of(obj.blocks.begin(), obj.blocks.end(),
                                       [](const ObjBlock& block) { return !block.faces.empty(); });
    if (!any_faces && looksLikeMtl(text))
        failMesh("this is a material file (MTL); name the OBJ that uses it", path);
    return obj;
}

}  // namespace

LoadedMesh loadObj(const std::string& path, const ObjOptions& options) {
    return MeshBuilder(readContents(path), path, options).build();
}

}  // namespace crt
