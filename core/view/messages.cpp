#include "view/messages.h"

#include "base/error.h"
#include "base/words.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <functional>
#include <map>
#include <vector>

namespace crt {
namespace {

using Json = nlohmann::ordered_json;

[[noreturn]] void refuse(const std::string& key, const char* expected) {
    throw Error(ErrorKind::Usage, fmt::format("'{}' takes {}", key, expected));
}

double number(const Json& value, const std::string& key, double least, double most) {
    const double x = value.is_number() ? value.get<double>() : std::nan("");
    if (!(x >= least && x <= most))
        refuse(key, fmt::format("a number from {:g} to {:g}", least, most).c_str());
    return x;
}

std::array<double, 2> numberPair(const Json& value, const std::string& key, double most) {
    if (!value.is_array() || value.size() != 2) refuse(key, "two numbers");
    return {number(value[0], key, -most, most), number(value[1], key, -most, most)};
}

std::string word(const Json& value, const std::string& key) {
    if (!value.is_string()) refuse(key, "a text");
    return value.get<std::string>();
}

bool flag(const Json& value, const std::string& key) {
    if (!value.is_boolean()) refuse(key, "true or false");
    return value.get<bool>();
}

using Reader = std::function<void(const Json& value, const std::string& key, ViewChange& to)>;

const std::map<std::string, Reader>& readers() {
    static const std::map<std::string, Reader> all{
        {"orbit",
         [](const Json& v, const std::string& k, ViewChange& to) { to.orbit = numberPair(v, k, 100); }},
        {"pan", [](const Json& v, const std::string& k, ViewChange& to) { to.pan = numberPair(v, k, 100); }},
        {"dolly",
         [](const Json& v, const std::string& k, ViewChange& to) { to.dolly = number(v, k, 0.01, 100); }},
        {"focus",
         [](const Json& v, const std::string& k, ViewChange& to) { to.focus = numberPair(v, k, 1); }},
        {"fov_deg", [](const Json& v, const std::string& k,
                       ViewChange& to) { to.fov_deg = number(v, k, kLeastFov_deg, kMostFov_deg); }},
        {"zoom",
         [](const Json& v, const std::string& k, ViewChange& to) { to.zoom = number(v, k, 0.01, 100); }},
        {"reset_camera",
         [](const Json& v, const std::string& k, ViewChange& to) { to.reset_camera = flag(v, k); }},
        {"toggle_paused",
         [](const Json& v, const std::string& k, ViewChange& to) { to.toggle_paused = flag(v, k); }},
        {"paused", [](const Json& v, const std::string& k, ViewChange& to) { to.paused = flag(v, k); }},
        {"samples", [](const Json& v, const std::string& k,
                       ViewChange& to) { to.samples = static_cast<std::uint64_t>(number(v, k, 1, 1e12)); }},
        {"exposure_ev", [](const Json& v, const std::string& k,
                           ViewChange& to) { to.exposure_ev = number(v, k, -100, 100); }},
        {"exposure_step", [](const Json& v, const std::string& k,
                             ViewChange& to) { to.exposure_step = number(v, k, -100, 100); }},
        {"white", [](const Json& v, const std::string& k, ViewChange& to) { to.white = word(v, k); }},
        {"plane", [](const Json& v, const std::string& k, ViewChange& to) { to.plane = word(v, k); }},
        {"backend", [](const Json& v, const std::string& k, ViewChange& to) { to.backend = word(v, k); }},
        {"device", [](const Json& v, const std::string& k, ViewChange& to) { to.device = word(v, k); }},
    };
    return all;
}

Json poseJson(const CameraPose& pose) {
    return {{"position", pose.position},
            {"target", pose.target},
            {"up", pose.up},
            {"focus_distance", pose.focus_distance},
            {"fov_deg", fovOf_deg(pose)}};
}

Json scalesJson(const std::vector<ColourScale>& scales) {
    Json list = Json::array();
    for (const ColourScale& scale : scales) {
        Json colours = Json::array();
        for (const auto& [r, g, b] : scale.colours)
            colours.push_back(fmt::format("#{:02x}{:02x}{:02x}", r, g, b));
        list.push_back({{"name", scale.name},
                        {"low", scale.low},
                        {"high", scale.high},
                        {"unit", scale.unit},
                        {"logarithmic", scale.logarithmic},
                        {"colours", std::move(colours)}});
    }
    return list;
}

Json errorsJson(const std::vector<ErrorPoint>& errors) {
    Json list = Json::array();
    for (const ErrorPoint& e : errors) list.push_back({e.seconds, e.samples, e.error, e.lower, e.upper});
    return list;
}

ViewChange readChange(const Json& json) {
    if (!json.is_object()) throw Error(ErrorKind::Usage, "a change is a JSON object");
    ViewChange change;
    for (const auto& [key, value] : json.items()) {
        const auto reader = readers().find(key);
        if (reader == readers().end()) {
            std::vector<std::string> names;
            for (const auto& [name, read] : readers()) names.push_back(name);
            const std::string hint = didYouMean(key, names);
            throw Error(ErrorKind::Usage,
                        fmt::format("there is no '{}' to change{}", key, hint.empty() ? "" : "; " + hint));
        }
        reader->second(value, key, change);
    }
    return change;
}

}  // namespace

std::vector<RequestedChange> readChanges(const std::string& text) {
    const Json json = Json::parse(text, nullptr, false);
    if (!json.is_object() && !json.is_array())
        throw Error(ErrorKind::Usage, "the request is neither a JSON object nor a list of them");
    std::vector<RequestedChange> changes;
    for (const Json& each : json.is_array() ? json : Json::array({json})) {
        RequestedChange& requested = changes.emplace_back();
        try {
            requested.change = readChange(each);
        } catch (const Error& error) {
            requested.refusal = error.what();
        }
    }
    return changes;
}

std::string sightJson(const Board::Sight& sight) {
    const Status& s = sight.status;
    Json json{{"version", sight.version},
              {"program", s.program},
              {"file", s.file},
              {"title", s.title},
              {"stage", s.stage},
              {"scene_error", s.scene_error},
              {"render_error", s.render_error},
              {"warnings", s.warnings},
              {"backend", s.backend},
              {"device", s.device},
              {"width", s.width},
              {"height", s.height},
              {"samples", s.samples},
              {"samples_wanted", s.samples_wanted},
              {"seconds", s.seconds},
              {"paths_per_second", s.paths_per_second},
              {"paused", s.paused},
              {"camera", poseJson(s.pose)},
              {"camera_yaml", cameraYaml(s.pose, s.has_lens, s.fov_moved)},
              {"camera_moved", s.pose_moved},
              {"has_lens", s.has_lens},
              {"exposure_ev", s.exposure_ev},
              {"white", s.white},
              {"whites", s.whites},
              {"plane", s.plane},
              {"errors", errorsJson(s.errors)}};
    if (const Picture* const p = sight.picture.get())
        json["picture"] = {{"number", p->number},   {"width", p->width},
                           {"height", p->height},   {"samples", p->samples},
                           {"divisor", p->divisor}, {"plane", p->plane},
                           {"run", p->run},
                           {"legend", p->legend},   {"scales", scalesJson(p->scales)},
                           {"of_this_camera", p->pose == s.pose}};
    // Names come from files and drivers, in whatever encoding.
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string cameraYaml(const CameraPose& pose, bool has_lens, bool has_fov) {
    const auto row = [](const char* key, const Vec3d& v) {
        return fmt::format("  {}: [{:.7g}, {:.7g}, {:.7g}]\n", key, v[0], v[1], v[2]);
    };
    std::string text =
        "camera:\n" + row("position", pose.position) + row("target", pose.target) + row("up", pose.up);
    if (has_fov)
        text += fmt::format("  fov: {:.7g}  # instead of focal_length and sensor\n", fovOf_deg(pose));
    if (has_lens && pose.focus_distance > 0)
        text += fmt::format("  focus_distance: {:.7g}\n", pose.focus_distance);
    return text;
}

}  // namespace crt
