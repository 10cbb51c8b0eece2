#include "scene/import/scene_text.h"

#include "base/words.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace crt {
namespace {

bool isPlain(std::string_view name) {
    const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
    const auto inside = [&](char c) {
        return letter(c) || (c >= '0' && c <= '9') || c == '.' || c == '-' || c == '/';
    };
    static const std::set<std::string, std::less<>> kWords{
        "true", "false", "null",  "yes",  "no",  "on", "off", "True", "False", "Null", "Yes", "No", "On",
        "Off",  "TRUE",  "FALSE", "NULL", "YES", "NO", "ON",  "OFF",  "y",     "n",    "Y",   "N"};
    return !name.empty() && letter(name.front()) && std::all_of(name.begin(), name.end(), inside) &&
           !kWords.contains(name) && !looksLikeNumber(name);
}

}  // namespace

std::string yamlText(std::string_view name) {
    if (isPlain(name)) return std::string(name);
    std::string text = "\"";
    for (std::size_t i = 0, length = 0; i < name.size(); i += std::max<std::size_t>(length, 1)) {
        const char c = name[i];
        length = utf8Length(name.substr(i));
        if (c == '"' || c == '\\') text += '\\';
        if (length == 0 || static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
            text += '_';
        else
            text += name.substr(i, length);
    }
    return text + "\"";
}

std::string yamlNumber(double value) { return fmt::format("{}", value == 0 ? 0.0 : value); }

std::string yamlList(const double* values, std::size_t count) {
    std::string text = "[";
    for (std::size_t i = 0; i < count; ++i) text += (i > 0 ? ", " : "") + yamlNumber(values[i]);
    return text + "]";
}

std::string UniqueNames::take(const std::string& name, const std::string& fallback) {
    // Longer names are no names, and each is repeated.
    std::string wanted = (name.empty() ? fallback : name).substr(0, 200);
    // A name cut within a letter of UTF-8 loses the whole letter.
    while (wanted.size() == 200 && (static_cast<unsigned char>(wanted.back()) & 0xc0) == 0x80)
        wanted.pop_back();
    if (wanted.size() == 199 && static_cast<unsigned char>(wanted.back()) >= 0xc0) wanted.pop_back();
    if (looksLikeNumber(wanted)) wanted = "number " + wanted;
    std::string unique = wanted;
    std::size_t& next = next_.try_emplace(wanted, 2).first->second;
    for (; !taken_.insert(unique).second; ++next) unique = fmt::format("{} ({})", wanted, next);
    return unique;
}

std::vector<std::string> Losses::list() const {
    std::vector<std::string> all;
    for (const auto& [what, count] : count_)
        all.push_back(count == 1 ? what : fmt::format("{} ({} times)", what, count));
    return all;
}

void Bounds::add(const Vec3d& point) {
    for (std::size_t k = 0; k < 3; ++k) {
        lower[k] = std::min(lower[k], point[k]);
        upper[k] = std::max(upper[k], point[k]);
    }
}

Vec3d Bounds::centre() const { return lower * 0.5 + upper * 0.5; }
double Bounds::radius() const { return length(upper * 0.5 - lower * 0.5); }

std::string chosenSky(const std::string& why, double brightness) {
    constexpr double kSky = 0.5;
    const double sky = kSky * brightness;
    return fmt::format("\n# Chosen: {}.\nenvironment: {{radiance: {{rgb: {}, space: linear}}}}\n", why,
                       yamlList(Vec3d{sky, sky, sky}));
}

std::string chosenLight(const std::optional<InnerView>& inner) {
    // The lamp's irradiance is 1.9, the sky's 1.6: a white surface has 1.1 towards the lamp and .5 away from
    // it, where the sky has .5.
    constexpr double kIrradiance = 1.9;
    const std::string text = chosenSky("the file has no light", 1) + "lights:\n";
    if (!inner)
        return text +
               "  - {name: key, type: sun, direction: [0.4, -0.75, -0.55], angular_diameter_deg: 20, "
               "radiance: {rgb: [20, 20, 20], space: linear}}\n";
    // As bright as the other at that distance.
    const double intensity = kIrradiance * inner->distance * inner->distance;
    return text + fmt::format(
                      "  - {{name: camera, type: point, position: {}, radiant_intensity: {{rgb: {}, space: "
                      "linear}}}}\n",
                      yamlList(inner->position), yamlList(Vec3d{intensity, intensity, intensity}));
}

Vec3d backOfChosenCamera(double turn_deg) {
    constexpr double kElevation_deg = 22, kRadian = std::numbers::pi / 180;
    const double up = std::sin(kElevation_deg * kRadian), flat = std::cos(kElevation_deg * kRadian);
    return {flat * std::sin(turn_deg * kRadian), up, flat * std::cos(turn_deg * kRadian)};
}

std::string chosenCamera(const Bounds& bounds, const std::optional<InnerView>& inner, double aspect,
                         Losses& losses) {
    const auto section = [](const Vec3d& position, const Vec3d& target, double fov_deg) {
        return fmt::format(
            "\n# Chosen: the file has no camera.\ncamera: {{position: {}, target: {}, fov: {}}}\n",
            yamlList(position), yamlList(target), yamlNumber(fov_deg));
    };
    if (inner) {
        losses.choose("a camera inside it, where it sees more of the materials than from outside");
        return section(inner->position, inner->target, inner->fov_deg);
    }
    losses.choose("a camera that sees the whole model");
    constexpr double kMargin = 1.05;
    const Vec3d back = backOfChosenCamera(kChosenTurn_deg);
    const Vec3d across = cross({0, 1, 0}, back), right = across * (1 / length(across)),
                above = cross(back, right);
    const double shorter = std::tan(kChosenFov_deg / 2 * std::numbers::pi / 180);
    const double half_width = shorter * std::max(aspect, 1.0),
                 half_height = shorter * std::max(1 / aspect, 1.0);
    const Vec3d centre = bounds.centre();
    double distance = 0;
    for (int corner = 0; corner < 8; ++corner) {
        Vec3d at;
        for (std::size_t k = 0; k < 3; ++k) at[k] = corner >> k & 1 ? bounds.upper[k] : bounds.lower[k];
        at = at - centre;
        const double needed =
            std::max(std::abs(dot(at, right)) / half_width, std::abs(dot(at, above)) / half_height);
        distance = std::max(distance, dot(at, back) + kMargin * needed);
    }
    if (!(distance > 0)) distance = 1;
    return section(centre + back * distance, centre, kChosenFov_deg);
}

}  // namespace crt
