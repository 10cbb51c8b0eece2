#include "judge/converge/variants.h"

#include "base/error.h"
#include "base/words.h"
#include "scene/yaml/yaml_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace crt::converge {
namespace {

const std::map<std::string, std::string>& shortNames() {
    static const std::map<std::string, std::string> names{
        {"sampler", "sampler.type"},       {"replicates", "sampler.replicates"},
        {"nee", "integrator.nee"},         {"roulette", "integrator.roulette"},
        {"depth", "integrator.max_depth"}, {"accelerator", "integrator.accelerator"},
        {"filter", "film.filter"}};
    return names;
}

}  // namespace

Vary parseVary(const std::string& text) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
        throw Error(
            ErrorKind::Usage,
            fmt::format("--vary takes KEY=VALUE,VALUE such as sampler=sobol,independent, not '{}'", text));
    Vary vary;
    vary.key = text.substr(0, equals);
    const auto found = shortNames().find(vary.key);
    if (found == shortNames().end() && vary.key.find('.') == std::string::npos) {
        std::vector<std::string> names;
        for (const auto& [name, path] : shortNames()) names.push_back(name);
        const std::string hint = didYouMean(vary.key, names);
        throw Error(ErrorKind::Usage,
                    fmt::format("--vary takes {} and keys of the scene such as film.filter, not '{}'{}",
                                fmt::join(names, ", "), vary.key, hint.empty() ? "" : "; " + hint));
    }
    vary.path = found != shortNames().end() ? found->second : vary.key;
    vary.values = parseList(text.substr(equals + 1), "--vary");
    return vary;
}

std::vector<Variant> variantsOf(const std::vector<Vary>& vary) {
    std::vector<Variant> variants{{}};
    for (const Vary& v : vary) {
        std::vector<Variant> longer;
        for (const Variant& variant : variants)
            for (const std::string& value : v.values) {
                Variant next = variant;
                next.label += fmt::format("{}{}={}", next.label.empty() ? "" : " ", v.key, value);
                next.changes.push_back({v.path, value});
                longer.push_back(std::move(next));
            }
        variants = std::move(longer);
    }
    return variants;
}

Scene loadSmall(SceneRequest request, const std::vector<SceneOverride>& changes, int resolution) {
    request.overrides.insert(request.overrides.end(), changes.begin(), changes.end());
    Scene scene = loadScene(request);
    const bool sized = std::any_of(request.overrides.begin(), request.overrides.end(),
                                   [](const SceneOverride& o) { return o.path == "film.resolution"; });
    const int longer = std::max(scene.film.width, scene.film.height);
    const bool cropped = scene.film.crop != std::array<int, 4>{0, 0, 0, 0};
    if (resolution <= 0 || sized || cropped || longer <= resolution) return scene;
    const auto scaled = [&](int side) {
        return std::max(1, static_cast<int>(std::lround(static_cast<double>(side) * resolution / longer)));
    };
    request.overrides.push_back(
        {"film.resolution", fmt::format("[{},{}]", scaled(scene.film.width), scaled(scene.film.height))});
    return loadScene(request);
}

}  // namespace crt::converge
