/// YAML → Scene. One table (scene_schema.cpp) describes every key; the parser, the did-you-mean,
/// docs/scene.md and the JSON Schema all come from it.
#pragma once

#include "scene/scene.h"

#include <string>
#include <vector>

namespace crt {

/// `key.path=value` from the command line (`--set`); the value is YAML.
struct SceneOverride {
    std::string path;
    std::string value;
};

/// Splits "film.resolution=[128,128]". Throws crt::Error(Usage) when there is no '='.
SceneOverride parseOverride(const std::string& text);

/// Reads and checks a scene file. Throws crt::Error(Scene) whose message holds every error of the file at
/// once, each as "file:line:column: error: …" with the line, a caret, and the nearest key. Relative file
/// names in the scene are looked up beside the scene file, then in the mesh directory (CRT_MESH_PATH, or
/// share/crt/meshes beside the installed program).
/// A model (.glb, .gltf, .obj) is read as the scene that `crt import` writes of it.
/// "-" is standard input, which is beside the current directory.
/// `composed` gets the text of it all (composed_text.h), unless it is null.
Scene loadScene(const std::string& path, const std::vector<SceneOverride>& overrides = {},
                std::string* composed = nullptr);

/// The same from text; `name` stands in messages, `directory` is where relative files are looked up.
Scene parseScene(const std::string& yaml, const std::string& name, const std::string& directory,
                 const std::vector<SceneOverride>& overrides = {}, std::string* composed = nullptr);

/// JSON Schema, draft-07, of scene files (`crt schema`).
std::string sceneJsonSchema();

/// docs/scene.md, generated.
std::string sceneReferenceMarkdown();

}  // namespace crt
