#include "scene/import/import.h"

#include "base/error.h"
#include "base/log.h"
#include "base/words.h"
#include "scene/gltf/gltf_model.h"
#include "scene/import/gltf_import.h"
#include "scene/import/mesh_import.h"
#include "scene/mesh/ply_reader.h"
#include "scene/mesh/stl_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <utility>

namespace crt {
namespace {

namespace fs = std::filesystem;

/// Text that a comment can hold.
std::string inOneLine(std::string_view text) {
    constexpr std::size_t kMostBytes = 300;
    std::string line;
    for (std::size_t i = 0, length = 0; i < text.size() && line.size() < kMostBytes; i += length) {
        length = std::max<std::size_t>(utf8Length(text.substr(i)), 1);
        const auto c = static_cast<unsigned char>(text[i]);
        const bool shown = utf8Length(text.substr(i)) > 0 && c >= 0x20 && c != 0x7f;
        line += shown ? text.substr(i, length) : " ";
    }
    return line;
}

void requireUtf8(const std::string& path, std::string_view name) {
    for (std::size_t i = 0; i < name.size(); i += utf8Length(name.substr(i)))
        if (utf8Length(name.substr(i)) == 0)
            throw Error(
                ErrorKind::Scene,
                fmt::format("{}: error: its name is not UTF-8, so a scene cannot refer to it; rename it",
                            path),
                {path});
}

/// In a scene a mesh that shows nothing is left out; here it is all that there is.
std::unique_ptr<LoadedMesh> visibleMesh(LoadedMesh mesh, const std::string& path) {
    if (mesh.mesh.triangles.empty())
        throw Error(
            ErrorKind::Scene,
            fmt::format("{}: error: no face of this mesh has an area: nothing is visible", path),
            {path});
    return std::make_unique<LoadedMesh>(std::move(mesh));
}

}  // namespace

std::string extensionOf(const std::string& path) {
    std::string extension = fs::path(path).extension().string();
    for (char& c : extension)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return extension;
}

bool isModel(const std::string& path) {
    const std::string extension = extensionOf(path);
    return extension == ".glb" || extension == ".gltf" || extension == ".obj" || extension == ".ply" ||
           extension == ".stl";
}

std::string otherRendererOf(const std::string& path) {
    if (extensionOf(path) == ".xml") return "Mitsuba";
    if (path.ends_with(".pbrt") || path.ends_with(".pbrt.gz")) return "pbrt";
    return {};
}

std::string importHint(const std::string& path) {
    return fmt::format("crt's Python package converts it: python3 -m crt import {} -o scene.yaml",
                       path);
}

std::string unreadFormatOf(const std::string& path) {
    constexpr std::pair<const char*, const char*> kUnread[]{
        {".blend", "Blender"}, {".fbx", "FBX"},      {".usd", "USD"},     {".usda", "USD"},
        {".usdc", "USD"},      {".usdz", "USD"},     {".dae", "COLLADA"}, {".3ds", "3ds Max"},
        {".max", "3ds Max"},   {".abc", "Alembic"},  {".ma", "Maya"},     {".mb", "Maya"},
        {".c4d", "Cinema 4D"}, {".skp", "SketchUp"}, {".3dm", "Rhino"},   {".step", "STEP"},
        {".stp", "STEP"},      {".rad", "Radiance"}, {".lxs", "LuxCore"}};
    const std::string extension = extensionOf(path);
    for (const auto& [end, name] : kUnread)
        if (extension == end) return name;
    return {};
}

ImportedModel importModel(GltfFiles& files, const std::string& path, const ImportOptions& options) {
    const fs::path file(path);
    const std::string folder = options.folder.empty() ? file.parent_path().string() : options.folder;
    const std::string name = fs::proximate(file, folder.empty() ? "." : folder).string();
    requireUtf8(path, name);
    Losses losses;
    std::string body;
    std::string about;
    std::unique_ptr<LoadedMesh> mesh;
    if (extensionOf(path) == ".obj") {
        mesh = visibleMesh(loadObj(path), path);
        body = objScene(*mesh, name, losses);
    } else if (extensionOf(path) == ".ply") {
        mesh = visibleMesh(loadPly(path), path);
        body = plyScene(mesh->mesh, name, losses);
    } else if (extensionOf(path) == ".stl") {
        mesh = visibleMesh(loadStl(path), path);
        body = stlScene(mesh->mesh, name, losses);
    } else {
        GltfFile& gltf = files.open(path);
        if (options.allow_outside) gltf.allowOutside();
        body = gltfScene(gltf, name, folder, options, losses);
        const tinygltf::Asset& asset = gltf.model().asset;
        if (!asset.generator.empty()) about += fmt::format("# Made by {}\n", inOneLine(asset.generator));
        if (!asset.copyright.empty()) about += fmt::format("# {}\n", inOneLine(asset.copyright));
    }
    std::string text = fmt::format("# {}, imported by crt.\n{}", inOneLine(name), about);
    if (const std::vector<std::string> lost = losses.list(); !lost.empty()) {
        logWarning("{}: not in the scene as in the file: {}", path, fmt::join(lost, "; "));
        text += "# Not as in the file:\n";
        for (const std::string& loss : lost) text += fmt::format("#   - {}\n", inOneLine(loss));
    }
    if (!losses.chosen().empty())
        logInfo("{}: not in the file, so crt chose: {}", path, fmt::join(losses.chosen(), "; "));
    const std::string stem = file.stem().string();
    text = fmt::format("{}crt: 1\ntitle: {}\n{}\noutputs:\n  - {{file: {}}}\n", text, yamlText(stem), body,
                       yamlText(stem + ".png"));
    return {std::move(text), std::move(mesh)};
}

}  // namespace crt
