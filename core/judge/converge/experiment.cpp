#include "judge/converge/experiment.h"

#include "base/error.h"
#include "base/input_file.h"
#include "film/film_record.h"
#include "judge/converge/json_parts.h"
#include "judge/converge/reference.h"
#include "judge/converge/report_maps.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>

namespace crt::converge {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFormat = "crt converge experiment 1";

std::string placeOf(const Key& key) {
    if (key == Key{}) return "the run";
    return fmt::format("{}, {}{}{}", key.scene, key.backend, key.variant.empty() ? "" : ", ", key.variant);
}

const char* samplerName(SamplerType type) {
    switch (type) {
        case SamplerType::Sobol: return "sobol";
        case SamplerType::Independent: return "independent";
        case SamplerType::XorShift: break;
    }
    return "xorshift";
}

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
    throw Error(ErrorKind::Usage,
                fmt::format("'{}' holds a different experiment: {}; choose another folder, or the same "
                            "settings",
                            fs::path(path).parent_path().string(), what));
}

Experiment readExperiment(const std::string& path) {
    std::string text;
    try {
        text = readInput(path, kMostTableBytes);
    } catch (const InputRefused& refused) {
        throw Error(ErrorKind::Usage, fmt::format("'{}' cannot be resumed, because its experiment.json {}",
                                                  fs::path(path).parent_path().string(), refused.what()));
    }
    try {
        const Json json = Json::parse(text);
        if (json.at("format") != kFormat)
            throw Error(ErrorKind::Usage, fmt::format("'{}' is of another crt", path));
        Experiment experiment;
        for (const Json& entry : json.at("properties")) {
            Properties p{{entry.at("scene"), entry.at("backend"), entry.at("variant")}, {}};
            for (const auto& [name, value] : entry.at("values").items())
                p.values.emplace_back(name, value.get<std::string>());
            experiment.push_back(std::move(p));
        }
        return experiment;
    } catch (const nlohmann::json::exception& e) {
        throw Error(ErrorKind::Usage,
                    fmt::format("'{}' cannot be read ({}), so the run cannot be resumed", path, e.what()),
                    {path});
    }
}

constexpr const char* kDigestMark =
    " #";  // Between the words of a trait and the digest of what they leave out.

std::string withoutDigest(const std::string& text) { return text.substr(0, text.rfind(kDigestMark)); }

const Properties* find(const Experiment& experiment, const Key& key) {
    const auto found = std::find_if(experiment.begin(), experiment.end(),
                                    [&](const Properties& p) { return p.key == key; });
    return found == experiment.end() ? nullptr : &*found;
}

void requireSame(const std::string& path, const Properties& then, const Properties& now) {
    for (const auto& [name, text] : now.values) {
        const auto found = std::find_if(then.values.begin(), then.values.end(),
                                        [&key = name](const auto& value) { return value.first == key; });
        const std::string was = found == then.values.end() ? "unknown" : found->second;
        if (was != text && withoutDigest(was) == withoutDigest(text))
            refuse(path, fmt::format("{} of {} differs ({} in both)", name, placeOf(now.key),
                                     withoutDigest(text)));
        if (was != text)
            refuse(path, fmt::format("{} of {} was {}, and is {} now", name, placeOf(now.key),
                                     withoutDigest(was), withoutDigest(text)));
    }
}

}  // namespace

Properties commonProperties(const BuildInfo& build, const IntegratorOptions& options) {
    Properties p;
    p.values = {{"the program",
                 fmt::format("crt {} {}{}", CRT_VERSION, build.commit, build.dirty ? " with changes" : "")},
                {"the number of threads", options.threads == 0 ? "all" : std::to_string(options.threads)},
                {"the processor", processorName()},
                {"the device", options.device.empty() ? "the first" : options.device}};
    return p;
}

Properties propertiesOf(const Key& key, const Scene& scene, const std::string& content,
                        const std::string& reference) {
    const IntegratorSettings& integrator = scene.integrator;
    Properties p;
    p.key = key;
    p.values = {{"the size", fmt::format("{} × {}", scene.film.width, scene.film.height)},
                {"the colour", colourText(scene)},
                {"the maximum depth", std::to_string(integrator.max_depth)},
                {"light sampling", integrator.nee ? "on" : "off"},
                {"multiple importance sampling", integrator.mis ? "on" : "off"},
                {"light sampling of the environment",
                 scene.environment && scene.environment->light_sampling ? "on" : "off"},
                {"roulette",
                 integrator.roulette ? fmt::format("from depth {} on", integrator.roulette_depth) : "off"},
                {"the sampler", fmt::format("{}, {} replicates", samplerName(scene.sampler.type),
                                            scene.sampler.replicates)},
                {"the seed", std::to_string(scene.sampler.seed)},
                {"the reference", reference}};
    // The visible scene, in words if there are any; the hash decides.
    for (const SceneTrait& trait : recordOf(scene).traits)
        for (const char* name :
             {"the crop window", "the filter", "the camera", "the geometry", "the materials", "the light"})
            if (trait.name == name)
                p.values.emplace_back(name, trait.digest.empty() ? trait.text
                                                                 : fmt::format("{}{}{}", trait.text,
                                                                               kDigestMark, trait.digest));
    p.values.emplace_back("the hash of the visible scene", content);
    return p;
}

void writeExperiment(const std::string& path, const Experiment& experiment) {
    Json json;
    json["format"] = kFormat;
    json["properties"] = Json::array();
    for (const Properties& p : experiment) {
        Json values = Json::object();
        for (const auto& [name, text] : p.values) values[name] = text;
        json["properties"].push_back({{"scene", p.key.scene},
                                      {"backend", p.key.backend},
                                      {"variant", p.key.variant},
                                      {"values", values}});
    }
    writeWhole(path, json.dump(1, ' ', false, Json::error_handler_t::replace) + '\n');
}

std::vector<SessionOfRun> readSessions(const std::string& path) {
    std::error_code ignored;
    if (!fs::exists(path, ignored)) return {};
    try {
        std::vector<SessionOfRun> sessions;
        for (const Json& entry : Json::parse(readInput(path, kMostTableBytes)))
            sessions.push_back({entry.at("command"), entry.at("started"), entry.at("spent_seconds")});
        return sessions;
    } catch (const InputRefused& refused) {
        throw Error(ErrorKind::Usage, fmt::format("'{}' {}", path, refused.what()), {path});
    } catch (const nlohmann::json::exception& e) {
        throw Error(ErrorKind::Usage,
                    fmt::format("'{}' cannot be read ({}), so the run cannot be resumed", path, e.what()),
                    {path});
    }
}

void writeSessions(const std::string& path, const std::vector<SessionOfRun>& sessions) {
    Json json = Json::array();
    for (const SessionOfRun& session : sessions)
        json.push_back({{"command", session.command},
                        {"started", session.started},
                        {"spent_seconds", session.spent_seconds}});
    writeWhole(path, json.dump(1, ' ', false, Json::error_handler_t::replace) + '\n');
}

void requireSameExperiment(const std::string& path, const Experiment& experiment) {
    const Experiment then = readExperiment(path);
    for (const Properties& p : experiment) {
        const Properties* before = find(then, p.key);
        if (before == nullptr) refuse(path, fmt::format("it has no {}", placeOf(p.key)));
        requireSame(path, *before, p);
    }
    for (const Properties& p : then)
        if (find(experiment, p.key) == nullptr) refuse(path, fmt::format("it has {} too", placeOf(p.key)));
}

std::vector<std::string> namesOfScenes(const std::vector<SceneRequest>& scenes) {
    std::vector<std::string> names;
    std::vector<fs::path> files;
    for (const SceneRequest& scene : scenes) {
        std::error_code ignored;
        const fs::path canonical = fs::weakly_canonical(scene.file, ignored);
        if (std::find(files.begin(), files.end(), canonical) != files.end())
            throw Error(ErrorKind::Usage, fmt::format("the scene '{}' is named twice", scene.file));
        files.push_back(canonical);
        names.push_back(fs::path(scene.file).stem().string());
    }
    // Slugs name the files of the report, so it is they that must differ.
    std::vector<std::string> unique = names;
    for (std::size_t i = 0; i < names.size(); ++i) {
        const auto same = [&](const std::string& other) { return slug(other) == slug(names[i]); };
        if (std::count_if(names.begin(), names.end(), same) > 1)
            unique[i] = (files[i].parent_path().filename() / names[i]).string();
    }
    for (std::size_t i = 0; i < unique.size(); ++i)
        for (std::size_t n = 2;
             std::any_of(unique.begin(), unique.begin() + static_cast<std::ptrdiff_t>(i),
                         [&](const std::string& other) { return slug(other) == slug(unique[i]); });
             ++n)
            unique[i] = fmt::format("{} {}", names[i], n);
    return unique;
}

void refuseRepeats(const std::vector<std::string>& names, const std::string& option) {
    for (auto name = names.begin(); name != names.end(); ++name)
        if (std::find(names.begin(), name, *name) != name)
            throw Error(ErrorKind::Usage, fmt::format("{} names '{}' twice", option, *name));
}

}  // namespace crt::converge
