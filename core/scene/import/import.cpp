#include "scene/import/import.h"

#include "base/log.h"
#include "scene/gltf/gltf_model.h"
#include "scene/import/gltf_import.h"
#include "scene/import/mesh_import.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>

namespace crt {
namespace {

namespace fs = std::filesystem;

std::string extensionOf(const std::string& path) {
    std::string extension = fs::path(path).extension().string();
    for (char& c : extension)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return extension;
}

/// What a comment can hold.
std::string inOneLine(std::string text) {
    std::replace_if(
        text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; },
        ' ');
    return text.substr(0, 300);
}

}  // namespace

bool isModel(const std::string& path) {
    const std::string extension = extensionOf(path);
    return extension == ".glb" || extension == ".gltf" || extension == ".obj" || extension == ".ply";
}

std::string importModel(GltfFiles& files, const std::string& path, const ImportOptions& options) {
    const fs::path file(path);
    const std::string folder = options.folder.empty() ? file.parent_path().string() : options.folder;
    const std::string name = fs::proximate(file, folder.empty() ? "." : folder).string();
    Losses losses;
    std::string body;
    std::string about;
    if (extensionOf(path) == ".obj") {
        body = objScene(path, name, losses);
    } else if (extensionOf(path) == ".ply") {
        body = plyScene(path, name, losses);
    } else {
        GltfFile& gltf = files.open(path);
        if (options.allow_outside) gltf.allowOutside();
        body = gltfScene(gltf, name, folder, options.allow_outside, losses);
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
        logInfo("{}: not in the file, and chosen: {}", path, fmt::join(losses.chosen(), "; "));
    const std::string stem = file.stem().string();
    return fmt::format("{}crt: 1\ntitle: {}\n{}\noutputs:\n  - {{file: {}}}\n", text, yamlText(stem), body,
                       yamlText(stem + ".png"));
}

}  // namespace crt
