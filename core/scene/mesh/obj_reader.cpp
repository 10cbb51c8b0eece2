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
constexpr double kMostObjUv = 1e6;  // Beyond it nothing is left of the texel.
constexpr std::int32_t kAsBefore = -2;  ///< The material that the lines before the block ended with.

/// What a block of lines says, as far as it can be known without the blocks before it: lines, materials and
/// what counts backwards are of the block alone.
struct ObjPart {
    std::vector<Vec3d> positions, normals;
    std::vector<std::array<double, 2>> uvs;
    ObjBlock block;
    std::vector<std::string> material_names;
    std::int32_t material = kAsBefore;  ///< At its end.
    std::vector<ObjContents::Library> libraries;
    ObjLoss bad_positions, bad_normals, bad_uvs, small_faces;
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
    std::string failure;  ///< Why it was not read beyond `failure_line`.
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
            useMaterial();
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
    Vec3d threeNumbers(std::string_view& rest, const char* what, ObjLoss& loss) {
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
            if (value && std::abs(*value) <= kMostObjUv) {
                uv[k] = *value;
                continue;
            }
            part_.bad_uvs.add(lines_.number(),
                              fmt::format("texture coordinates must be numbers up to {:g}, found {}",
                                          kMostObjUv, inQuotes(field)));
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
            fail(fmt::format("{} is not a corner of a face (v, v/vt, v//vn or v/vt/vn, counted from 1)",
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
            part_.block.faces.push_back(
                {static_cast<std::uint32_t>(first), count, part_.material, lines_.number()});
    }

    void useMaterial() {
        const auto [known, fresh] = material_index_.try_emplace(
            std::string(lines_.arguments()), static_cast<std::int32_t>(part_.material_names.size()));
        if (fresh) part_.material_names.push_back(known->first);
        part_.material = known->second;
    }

    TextLines lines_;
    ObjPart part_;
    std::map<std::string, std::int32_t> material_index_;
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
    /// What comes before a part.
    struct Place {
        std::size_t positions = 0, normals = 0, uvs = 0;
        int line = 0;
        std::vector<std::int32_t> material;  ///< In the file, of those in the part.
        std::int32_t material_before = -1;
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
                            fmt::format("a face names vertex {}, but only {} stand before it", b.written,
                                        place.positions + b.before),
                            {path_, place.line + b.line});
        }
    }

    /// All but vertices and faces.
    void joinStatements() {
        std::map<std::string, std::int32_t> material_index;
        std::set<std::string> libraries;  // Some exporters repeat the statement before each object.
        std::int32_t material = -1;
        for (std::size_t i = 0; i < parts_.size(); ++i) {
            ObjPart& part = parts_[i];
            Place& place = places_[i];
            place.material_before = material;
            for (const std::string& name : part.material_names) {
                const auto [known, fresh] =
                    material_index.try_emplace(name, static_cast<std::int32_t>(obj_.material_names.size()));
                if (fresh) obj_.material_names.push_back(name);
                place.material.push_back(known->second);
            }
            if (part.material != kAsBefore)
                material = place.material[static_cast<std::size_t>(part.material)];
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
            face.material = face.material == kAsBefore
                                ? place.material_before
                                : place.material[static_cast<std::size_t>(face.material)];
            for (std::size_t c = face.first_corner; c < std::size_t{face.first_corner} + face.corner_count;
                 ++c) {
                ObjCorner& corner = part.block.corners[c];
                while (beyond < part.beyond.size() && part.beyond[beyond].first < c) ++beyond;
                const bool too_large = beyond < part.beyond.size() && part.beyond[beyond].first == c;
                if ((too_large || corner.position >= positions_) && !place.missing)
                    place.missing = {too_large ? part.beyond[beyond].second : corner.position, face.line};
                if (corner.normal != kNoObjNormal && corner.normal >= normals_)
                    corner.normal = kBadObjNormal;
                if (corner.uv >= uvs_) corner.uv = kNoObjUv;
            }
        }
        obj_.blocks[i] = std::move(part.block);
        part = {};
    }

    [[noreturn]] void failForMissing(const Missing& missing) const {
        throw Error(
            ErrorKind::Scene,
            fmt::format("a face names vertex {}, but the file has {}", missing.position + 1, positions_),
            {path_, missing.line});
    }

    std::vector<ObjPart> parts_;
    const std::string& path_;
    std::vector<Place> places_;
    std::size_t positions_ = 0, normals_ = 0, uvs_ = 0;
    ObjContents obj_;
};

}  // namespace

ObjContents readObj(std::string_view text, const std::string& path, Stage& stage, std::size_t block_bytes) {
    return PartJoiner(readParts(text, stage, block_bytes), path).join();
}

}  // namespace crt
