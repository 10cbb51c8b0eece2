/// Scenes as texts: what they become, or what is said about them.
#pragma once

#include "base/log.h"
#include "captured_log.h"
#include "catch.h"
#include "scene/yaml/scene_yaml.h"

#include <string>
#include <vector>

namespace crt::test {

/// Keeps warnings off the terminal while it lives. They are counted all the same.
struct Quiet {
    Quiet() { setLogLevel(LogLevel::Off); }
    ~Quiet() { setLogLevel(LogLevel::Info); }
};

inline Scene parse(const std::string& body, const std::vector<SceneOverride>& overrides = {},
                   const std::string& directory = ".") {
    const Quiet quiet;
    return parseScene("crt: 1\n" + body, "scene.yaml", directory, overrides);
}

/// The error of a text that must not be a scene.
inline Error refusal(const std::string& yaml, const std::vector<SceneOverride>& overrides = {},
                     const std::string& directory = ".") {
    const Quiet quiet;
    try {
        parseScene(yaml, "scene.yaml", directory, overrides);
    } catch (const Error& e) {
        CHECK(e.kind() == ErrorKind::Scene);
        return e;
    }
    FAIL("accepted:\n" << yaml);
    throw;
}

/// The messages about a scene whose second line onwards is `body`.
inline std::string refused(const std::string& body, const std::vector<SceneOverride>& overrides = {},
                           const std::string& directory = ".") {
    return refusal("crt: 1\n" + body, overrides, directory).what();
}

/// The log of a scene that is accepted.
inline std::string saidOf(const std::string& body, const std::string& directory) {
    const CapturedLog log;
    parseScene("crt: 1\n" + body, "scene.yaml", directory, {});
    return log.text();
}

/// The messages about a reflectance.
inline std::string refusedReflectance(const std::string& spectrum) {
    return refused("materials:\n  m: {type: diffuse, reflectance: " + spectrum + "}\n");
}

inline std::string refusedOverride(const std::string& body, const std::string& argument) {
    return refused(body, {parseOverride(argument)});
}

inline std::size_t count(const std::string& text, const std::string& word) {
    std::size_t n = 0;
    for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++n;
    return n;
}

inline const std::string kTriangle = "{positions: [[0, 0, 0], [1, 0, 0], [0, 1, 0]], faces: [[0, 1, 2]]}";
inline const std::string kGrey = "materials: {grey: {type: diffuse, reflectance: 0.5}}\n";

inline std::string meshScene(const std::string& object) {
    return kGrey + "objects:\n  - {material: grey, " + object + "}\n";
}

}  // namespace crt::test
