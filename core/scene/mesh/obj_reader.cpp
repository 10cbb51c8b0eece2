// Over 450 lines: what a block of lines says stands beside how blocks are joined.
#include "scene/mesh/obj_reader.h"

#include "base/error.h"
#include "base/parallel.h"
#include "scene/mesh/obj_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>

namespace crt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr std::uint32_t kMostIndex = kBadObjNormal - 1;  ///< Corners hold what is below.
/// The name that the lines before the block ended with.
constexpr std::int32_t kAsBefore = -2;

/// Names that statements of a block give to the faces that follow.
struct Names {
    std::vector<std::string> names;  ///< Each once.
    std::map<std::string, std::int32_t, std::less<>> index;
    std::int32_t now = kAsBefore;  ///< Of the next face.

    std::int32_t add(std::string_view name) {
        if (const auto known = index.find(name); known != index.end()) return known->second;
        const auto number = static_cast<std::int32_t>(names.size());
        names.emplace_back(name);
        index.emplace(name, number);
        return number;
    }
};

/// The faces from `first_face` to the next run, by numbers of the block's names.
struct NamedRun {
    std::uint32_t first_face;
    std::int32_t material, group, object;
};

/// The contents of a block of lines, as far as they are known without the earlier blocks: lines, materials
/// and negative indices refer to the block alone.
struct ObjPart {
    std::vector<Vec3d> positions, normals;
    std::vector<std::array<double, 2>> uvs;
    ObjBlock block;
    Names materials, groups, objects;
    std::vector<NamedRun> runs;
    std::vector<ObjContents::Library> libraries;
    MeshLoss bad_positions, bad_normals, bad_uvs, small_faces;
    std::uint64_t lines = 0, points = 0, free_forms = 0;
    bool vertex_colors = false;
    int lines_taken = 0;

    /// An index that counts from the first vertex of the block, since it was given backwards; below 0 it
    /// lies before the block.
    struct Backwards {
        std::size_t corner;
        std::int64_t index, written;
        int line;
        enum class What { Position, Normal, Uv } what;
        std::size_t before;  ///< So many vertices stood before it in the block.
    };
    std::vector<Backwards> backwards;
    /// Positions that 32 bits do not hold.
    std::vector<std::pair<std::size_t, std::int64_t>> beyond;
    std::string failure;  ///< Reason why it was not read beyond `failure_line`.
    int failure_line = 0;
};

/// Thrown where a block cannot be read on.
struct Unreadable {};

class PartReader {
public:
    PartReader(std::string_view text, bool first) : lines_(text, first) {}

    ObjPart read() {
        try {
            while (lines_.next()) statement(lines_.keyword());
        } catch (const Unreadable&) {}
        part_.lines_taken = lines_.linesTaken();
        return std::move(part_);
    }

private:
    void statement(std::string_view keyword) {
        if (keyword == "v")
            position();
        else if (keyword == "vn") {
            std::string_view rest = lines_.arguments();
            part_.normals.push_back(threeNumbers(rest, "a vertex normal", part_.bad_normals));
        } else if (keyword == "vt") {
            textureCoordinates();
        } else if (keyword == "f" || keyword == "fo")
            face();
        else if (keyword == "usemtl")
            use(part_.materials, lines_.arguments());
        else if (keyword == "g")
            use(part_.groups, lines_.arguments().empty() ? "default" : lines_.arguments());
        else if (keyword == "o")
            use(part_.objects, lines_.arguments());
        else if (keyword == "mtllib")
            part_.libraries.push_back({std::string(lines_.arguments()), lines_.number()});
        else if (keyword == "l")
            ++part_.lines;
        else if (keyword == "p")
            ++part_.points;
        else if (keyword == "curv" || keyword == "curv2" || keyword == "surf")
            ++part_.free_forms;
    }

    [[noreturn]] void fail(std::string sentence) {
        part_.failure = std::move(sentence);
        part_.failure_line = lines_.number();
        throw Unreadable();
    }

    /// Takes them off `rest`. All of them NaN, and noted, where one cannot be read. More may follow (a
    /// weight, a colour).
    Vec3d threeNumbers(std::string_view& rest, const char* what, MeshLoss& loss) {
        Vec3d v{};
        for (double& number : v) {
            const std::string_view field = nextField(rest);
            const std::optional<double> value = numberOf(field);
            if (value && std::isfinite(*value)) {
                number = *value;
                continue;
            }
            loss.add(lines_.number(), field.empty() ? fmt::format("{} needs three numbers", what)
                                      : value ? fmt::format("the numbers of {} must be finite, found {}",
                                                            what, inQuotes(field))
                                              : fmt::format("expected a number, found {}", inQuotes(field)));
            rest = lines_.arguments();
            for (int i = 0; i < 3; ++i) nextField(rest);
            return {kNan, kNan, kNan};
        }
        return v;
    }

    void position() {
        std::string_view rest = lines_.arguments();
        part_.positions.push_back(threeNumbers(rest, "a vertex", part_.bad_positions));
        int more = 0;
        while (!part_.vertex_colors && !nextField(rest).empty()) part_.vertex_colors = ++more >= 3;
    }

    /// One number or more; the second is 0 where it is left out. A pair that cannot be read is (0, 0).
    void textureCoordinates() {
        std::string_view rest = lines_.arguments();
        std::array<double, 2> uv{};
        for (std::size_t k = 0; k < 2; ++k) {
            const std::string_view field = nextField(rest);
            if (k > 0 && field.empty()) break;
            const std::optional<double> value = numberOf(field);
            if (value && std::abs(*value) <= kMostMeshUv) {
                uv[k] = *value;
                continue;
            }
            part_.bad_uvs.add(lines_.number(),
                              fmt::format("texture coordinates must be numbers up to {:g}, found {}",
                                          kMostMeshUv, inQuotes(field)));
            uv = {};
            break;
        }
        part_.uvs.push_back(uv);
    }

    /// Of "7", "7/1", "7//3" or "7/1/3"; counted from 1, or backwards from the newest with a minus.
    void addCorner(std::string_view field) {
        const std::size_t number = part_.block.corners.size();
        ObjCorner corner{0, kNoObjNormal};
        const std::string_view position = field.substr(0, field.find('/'));
        std::int64_t at = 0;
        if (!readIndex(position, at))
            fail(fmt::format("{} is not a face corner; expected v, v/vt, v//vn or v/vt/vn, counted from 1",
                             inQuotes(field)));
        if (at < 0)
            addBackwards(number, at, part_.positions.size(), ObjPart::Backwards::What::Position);
        else if (at > kMostIndex)
            part_.beyond.emplace_back(number, at - 1);
        else
            corner.position = static_cast<std::uint32_t>(at - 1);

        const std::size_t texture = position.size();  // Of the first '/'.
        const std::size_t second =
            texture < field.size() ? field.find('/', texture + 1) : std::string_view::npos;
        if (texture + 1 < field.size()) {
            const std::string_view uv = field.substr(texture + 1, second - texture - 1);
            if (!uv.empty()) corner.uv = kBadObjUv;
            if (!uv.empty() && readIndex(uv, at)) {
                if (at < 0)
                    addBackwards(number, at, part_.uvs.size(), ObjPart::Backwards::What::Uv);
                else if (at <= kMostIndex)
                    corner.uv = static_cast<std::uint32_t>(at - 1);
            }
        }
        if (second != std::string_view::npos && second + 1 < field.size()) {
            std::string_view normal = field.substr(second + 1);
            normal = normal.substr(0, normal.find('/'));
            const bool readable = readIndex(normal, at);
            corner.normal = kBadObjNormal;
            if (readable && at < 0)
                addBackwards(number, at, part_.normals.size(), ObjPart::Backwards::What::Normal);
            else if (readable && at <= kMostIndex)
                corner.normal = static_cast<std::uint32_t>(at - 1);
        }
        part_.block.corners.push_back(corner);
    }

    void addBackwards(std::size_t corner, std::int64_t at, std::size_t before,
                      ObjPart::Backwards::What what) {
        // Far beyond any file, so that sums of it fit.
        const std::int64_t index = std::max<std::int64_t>(at, std::int64_t{-1} << 61);
        part_.backwards.push_back(
            {corner, static_cast<std::int64_t>(before) + index, at, lines_.number(), what, before});
    }

    /// A whole number other than 0.
    static bool readIndex(std::string_view digits, std::int64_t& index) {
        const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), index);
        return error == std::errc() && end == digits.data() + digits.size() && index != 0;
    }

    void face() {
        const std::size_t first = part_.block.corners.size();
        std::string_view rest = lines_.arguments();
        for (std::string_view field = nextField(rest); !field.empty(); field = nextField(rest))
            addCorner(field);
        const std::size_t end = part_.block.corners.size();
        if (end > std::numeric_limits<std::uint32_t>::max())
            fail("a face with thousands of millions of corners");
        const auto count = static_cast<std::uint32_t>(end - first);
        if (count < 3)
            part_.small_faces.add(
                lines_.number(), fmt::format("a face needs at least three corners, this one has {}", count));
        else
            addFace({static_cast<std::uint32_t>(first), count, lines_.number()});
    }

    void addFace(const ObjFace& face) {
        if (new_run_)
            part_.runs.push_back({static_cast<std::uint32_t>(part_.block.faces.size()), part_.materials.now,
                                  part_.groups.now, part_.objects.now});
        new_run_ = false;
        part_.block.faces.push_back(face);
    }

    void use(Names& names, std::string_view name) {
        names.now = names.add(name);
        new_run_ = true;
    }

    TextLines lines_;
    ObjPart part_;
    bool new_run_ = true;
};

/// The ends of blocks of some `block_bytes`, each after an end of line that no backslash joins with the
/// next.
std::vector<std::size_t> blockEnds(std::string_view text, std::size_t block_bytes) {
    std::vector<std::size_t> ends;
    std::size_t line = 0;  // Behind which a line begins or goes on.
    for (std::size_t from = block_bytes; from < text.size();) {
        const std::size_t end = text.find_first_of("\r\n", from);
        if (end == std::string_view::npos) break;
        const std::size_t next = end + (text.substr(end, 2) == "\r\n" ? 2 : 1);
        const bool joined = trimmed(text.substr(line, end - line)).ends_with('\\');
        from = joined ? next : next + block_bytes;
        if (joined) continue;
        ends.push_back(next);
        line = next;
    }
    if (ends.empty() || ends.back() < text.size()) ends.push_back(text.size());
    return ends;
}

std::vector<ObjPart> readParts(std::string_view text, Stage& stage, std::size_t block_bytes) {
    stage.setAmount(static_cast<double>(text.size()));
    const std::vector<std::size_t> ends = blockEnds(text, block_bytes);
    std::vector<ObjPart> parts(ends.size());
    std::atomic<std::size_t> done{0};
    parallelFor(parts.size(), 1, [&](std::size_t i, std::size_t) {
        const std::size_t begin = i == 0 ? 0 : ends[i - 1];
        parts[i] = PartReader(text.substr(begin, ends[i] - begin), i == 0).read();
        stage.at(static_cast<double>(done += ends[i] - begin));
    });
    return parts;
}

/// Puts parts behind one another.
class PartJoiner {
public:
    PartJoiner(std::vector<ObjPart> parts, const std::string& path)
        : parts_(std::move(parts)), path_(path), places_(parts_.size()) {}

    ObjContents join() {
        findPlaces();
        if (positions_ > kMostIndex || normals_ > kMostIndex || uvs_ > kMostIndex)
            throw Error(ErrorKind::Scene, "the file has more than four thousand million vertices", {path_});
        for (std::size_t i = 0; i < parts_.size(); ++i) {
            resolveBackwards(i);
            if (!parts_[i].failure.empty())
                throw Error(ErrorKind::Scene, parts_[i].failure,
                            {path_, places_[i].line + parts_[i].failure_line});
        }
        joinStatements();
        obj_.positions.resize(positions_);
        obj_.normals.resize(normals_);
        obj_.uvs.resize(uvs_);
        obj_.blocks.resize(parts_.size());
        parallelFor(parts_.size(), 1, [this](std::size_t i, std::size_t) { joinVertices(i); });
        for (const Place& place : places_)
            if (place.missing) failForMissing(*place.missing);
        return std::move(obj_);
    }

private:
    struct Missing {
        std::int64_t position;
        int line;
    };
    /// The numbers of elements before a part.
    struct Place {
        std::size_t positions = 0, normals = 0, uvs = 0;
        int line = 0;
        std::optional<Missing> missing;  ///< The first face of the part that names a vertex beyond the last.
    };

    void findPlaces() {
        int line = 0;
        for (std::size_t i = 0; i < parts_.size(); ++i) {
            places_[i].positions = positions_;
            places_[i].normals = normals_;
            places_[i].uvs = uvs_;
            places_[i].line = line;
            positions_ += parts_[i].positions.size();
            normals_ += parts_[i].normals.size();
            uvs_ += parts_[i].uvs.size();
            line += parts_[i].lines_taken;
        }
    }

    void resolveBackwards(std::size_t i) {
        const Place& place = places_[i];
        for (const ObjPart::Backwards& b : parts_[i].backwards) {
            if (b.corner >= parts_[i].block.corners.size()) continue;  // of a field that cannot be read
            ObjCorner& corner = parts_[i].block.corners[b.corner];
            using What = ObjPart::Backwards::What;
            const std::size_t first = b.what == What::Position ? place.positions
                                      : b.what == What::Normal ? place.normals
                                                               : place.uvs;
            std::uint32_t& target = b.what == What::Position ? corner.position
                                    : b.what == What::Normal ? corner.normal
                                                             : corner.uv;
            const std::int64_t index = static_cast<std::int64_t>(first) + b.index;
            if (index >= 0)
                target = static_cast<std::uint32_t>(index);
            else if (b.what == What::Position)
                throw Error(ErrorKind::Scene,
                            fmt::format("a face uses vertex {}, but only {} vertices precede it", b.written,
                                        place.positions + b.before),
                            {path_, place.line + b.line});
        }
    }

    /// The names of a kind, of the whole file.
    struct JoinedNames {
        Names all;
        std::int32_t before = -1;             ///< That which the parts so far ended with.
        std::vector<std::int32_t> of_part{};  ///< By number in the part at hand.

        void enter(const Names& part) {
            of_part.clear();
            for (const std::string& name : part.names) of_part.push_back(all.add(name));
        }
        std::int32_t operator()(std::int32_t in_part) const {
            return in_part == kAsBefore ? before : of_part[static_cast<std::size_t>(in_part)];
        }
        void leave(const Names& part) { before = (*this)(part.now); }
    };

    /// Runs by the names of a part → by those of the file.
    void joinRuns(ObjPart& part) {
        materials_.enter(part.materials);
        groups_.enter(part.groups);
        objects_.enter(part.objects);
        for (const NamedRun& run : part.runs)
            part.block.runs.push_back({run.first_face, materials_(run.material),
                                       partOf(groups_(run.group), objects_(run.object))});
        materials_.leave(part.materials);
        groups_.leave(part.groups);
        objects_.leave(part.objects);
    }

    std::int32_t partOf(std::int32_t group, std::int32_t object) {
        if (group < 0 && object < 0) return -1;
        const auto [known, fresh] =
            part_index_.try_emplace({group, object}, static_cast<std::int32_t>(obj_.parts.size()));
        const auto nameOf = [](const JoinedNames& names, std::int32_t i) {
            return i < 0 ? std::string() : names.all.names[static_cast<std::size_t>(i)];
        };
        if (fresh) obj_.parts.push_back({nameOf(groups_, group), nameOf(objects_, object)});
        return known->second;
    }

    /// All but vertices and faces.
    void joinStatements() {
        std::set<std::string> libraries;  // Some exporters repeat the statement before each object.
        for (std::size_t i = 0; i < parts_.size(); ++i) {
            ObjPart& part = parts_[i];
            const Place& place = places_[i];
            joinRuns(part);
            for (ObjContents::Library& library : part.libraries)
                if (libraries.insert(library.arguments).second)
                    obj_.libraries.push_back({std::move(library.arguments), place.line + library.line});
            obj_.bad_positions.add(part.bad_positions, place.line);
            obj_.bad_normals.add(part.bad_normals, place.line);
            obj_.bad_uvs.add(part.bad_uvs, place.line);
            obj_.small_faces.add(part.small_faces, place.line);
            obj_.lines += part.lines;
            obj_.points += part.points;
            obj_.free_forms += part.free_forms;
            obj_.vertex_colors |= part.vertex_colors;
        }
        obj_.material_names = std::move(materials_.all.names);
    }

    void joinVertices(std::size_t i) {
        ObjPart& part = parts_[i];
        Place& place = places_[i];
        std::copy(part.positions.begin(), part.positions.end(),
                  obj_.positions.begin() + static_cast<std::ptrdiff_t>(place.positions));
        std::copy(part.normals.begin(), part.normals.end(),
                  obj_.normals.begin() + static_cast<std::ptrdiff_t>(place.normals));
        std::copy(part.uvs.begin(), part.uvs.end(),
                  obj_.uvs.begin() + static_cast<std::ptrdiff_t>(place.uvs));
        std::size_t beyond = 0;
        for (ObjFace& face : part.block.faces) {
            face.line += place.line;
            for (std::size_t c = face.first_corner; c < std::size_t{face.first_corner} + face.corner_count;
                 ++c) {
                ObjCorner& corner = part.block.corners[c];
                while (beyond < part.beyond.size() && part.beyond[beyond].first < c) ++beyond;
                const bool too_large = beyond < part.beyond.size() && part.beyond[beyond].first == c;
                if ((too_large || corner.position >= positions_) && !place.missing)
                    place.missing = {too_large ? part.beyond[beyond].second : corner.position, face.line};
                if (corner.normal != kNoObjNormal && corner.normal >= normals_)
                    corner.normal = kBadObjNormal;
                if (corner.uv != kNoObjUv && corner.uv >= uvs_) corner.uv = kBadObjUv;
            }
        }
        obj_.blocks[i] = std::move(part.block);
        part = {};
    }

    [[noreturn]] void failForMissing(const Missing& missing) const {
        throw Error(
            ErrorKind::Scene,
            fmt::format("a face uses vertex {}, but the file has {}", missing.position + 1, positions_),
            {path_, missing.line});
    }

    std::vector<ObjPart> parts_;
    const std::string& path_;
    std::vector<Place> places_;
    std::size_t positions_ = 0, normals_ = 0, uvs_ = 0;
    ObjContents obj_;
    JoinedNames materials_, groups_, objects_;
    std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> part_index_;  ///< By group and object.
};

}  // namespace

ObjContents readObj(std::string_view text, const std::string& path, Stage& stage, std::size_t block_bytes) {
    return PartJoiner(readParts(text, stage, block_bytes), path).join();
}

}  // namespace crt
