#include "scene/mesh/obj_reader.h"

#include "base/error.h"
#include "scene/mesh/obj_text.h"

#include <fmt/format.h>

#include <array>
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

class ObjReader {
public:
    ObjReader(std::string_view text, const std::string& path, Stage& stage)
        : lines_(text), path_(path), stage_(stage), bytes_(text.size()) {
        stage_.setAmount(static_cast<double>(bytes_));
    }

    ObjContents read() {
        while (lines_.next()) {
            statement(lines_.keyword());
            stage_.at(static_cast<double>(bytes_ - lines_.bytesLeft()));
        }
        return std::move(obj_);
    }

private:
    void statement(std::string_view keyword) {
        if (keyword == "v")
            position();
        else if (keyword == "vn")
            obj_.normals.push_back(threeNumbers("a vertex normal", obj_.bad_normals));
        else if (keyword == "f" || keyword == "fo")
            face();
        else if (keyword == "usemtl")
            useMaterial();
        else if (keyword == "mtllib")
            library();
        else if (keyword == "l")
            ++obj_.lines;
        else if (keyword == "p")
            ++obj_.points;
        else if (keyword == "curv" || keyword == "curv2" || keyword == "surf")
            ++obj_.free_forms;
    }

    [[noreturn]] void fail(const std::string& sentence) const {
        throw Error(ErrorKind::Scene, sentence, {path_, lines_.number()});
    }

    /// All of them NaN, and noted, where one cannot be read. More may follow (a weight, a colour).
    Vec3d threeNumbers(const char* what, ObjLoss& loss) {
        std::string_view rest = lines_.arguments();
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
            return {kNan, kNan, kNan};
        }
        return v;
    }

    void position() {
        obj_.positions.push_back(threeNumbers("a vertex", obj_.bad_positions));
        if (obj_.vertex_colors) return;
        std::string_view rest = lines_.arguments();
        int fields = 0;
        while (!nextField(rest).empty()) ++fields;
        obj_.vertex_colors = fields >= 6;
    }

    /// Of "7", "7/1", "7//3" or "7/1/3"; counted from 1, or backwards from the newest with a minus. What
    /// stands for the texture is not looked at.
    ObjCorner corner(std::string_view field) const {
        const std::string_view position = field.substr(0, field.find('/'));
        std::int64_t at = 0;
        if (!readIndex(position, at))
            fail(fmt::format("{} is not a corner of a face (v, v/vt, v//vn or v/vt/vn, counted from 1)",
                             inQuotes(field)));
        const auto fromZero = [](std::int64_t i, std::size_t count) {
            return i > 0 ? i - 1 : static_cast<std::int64_t>(count) + i;
        };
        ObjCorner corner{fromZero(at, obj_.positions.size()), kNoObjNormal};
        if (corner.position < 0)
            fail(fmt::format("a face names vertex {}, but only {} stand before it", at,
                             obj_.positions.size()));

        const std::size_t texture = position.size();  // Of the first '/'.
        const std::size_t second =
            texture < field.size() ? field.find('/', texture + 1) : std::string_view::npos;
        if (second == std::string_view::npos || second + 1 == field.size()) return corner;
        std::string_view normal = field.substr(second + 1);
        normal = normal.substr(0, normal.find('/'));
        const bool readable = readIndex(normal, at);
        if (readable) corner.normal = fromZero(at, obj_.normals.size());
        if (!readable || corner.normal < 0) corner.normal = kBadObjNormal;
        return corner;
    }

    /// A whole number other than 0.
    static bool readIndex(std::string_view digits, std::int64_t& index) {
        const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), index);
        return error == std::errc() && end == digits.data() + digits.size() && index != 0;
    }

    void face() {
        ObjFace f{obj_.corners.size(), 0, material_, lines_.number()};
        std::string_view rest = lines_.arguments();
        for (std::string_view field = nextField(rest); !field.empty(); field = nextField(rest)) {
            obj_.corners.push_back(corner(field));
            ++f.corner_count;
        }
        if (f.corner_count < 3)
            obj_.small_faces.add(
                f.line, fmt::format("a face needs at least three corners, this one has {}", f.corner_count));
        else
            obj_.faces.push_back(f);
    }

    void useMaterial() {
        const auto [known, fresh] = material_index_.try_emplace(
            std::string(lines_.arguments()), static_cast<std::int32_t>(obj_.material_names.size()));
        if (fresh) obj_.material_names.push_back(known->first);
        material_ = known->second;
    }

    /// Some exporters repeat the statement before each object.
    void library() {
        std::string arguments(lines_.arguments());
        if (libraries_.insert(arguments).second)
            obj_.libraries.push_back({std::move(arguments), lines_.number()});
    }

    TextLines lines_;
    const std::string& path_;
    Stage& stage_;
    std::size_t bytes_;
    ObjContents obj_;
    std::set<std::string> libraries_;
    std::int32_t material_ = -1;
    std::map<std::string, std::int32_t> material_index_;
};

}  // namespace

ObjContents readObj(std::string_view text, const std::string& path, Stage& stage) {
    return ObjReader(text, path, stage).read();
}

}  // namespace crt
