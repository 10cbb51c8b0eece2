/// Imported glTF files for tests: the text of the scene, the scene, and the messages.
#pragma once

#include "gltf_file_maker.h"
#include "png_file.h"

#include "base/error.h"
#include "base/temporary_folder.h"
#include "captured_log.h"
#include "compile/compile.h"
#include "scene/import/import.h"
#include "scene/yaml/scene_yaml.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace crt::test {

/// 8 bits, four channels, without filters' help.
inline std::string rgba(unsigned width, unsigned height, const std::vector<std::uint8_t>& codes) {
    const PngKind kind{.width = width, .height = height, .color = 6};
    return pngOf(kind, zlibStream(filteredRows(kind, bytesOf(codes))));
}

/// The text of the import, its scene, and the messages.
struct Imported {
    std::string text, log;
    Scene scene;
};

inline Imported importOf(const GltfMaker& maker) {
    const TemporaryFolder folder;
    const CapturedLog log;
    const std::string path = folder.write("a.glb", maker.glb());
    GltfFiles files;
    Imported result;
    result.text = importModel(files, path).scene;
    try {
        result.scene = loadScene(path);
    } catch (const Error& e) {
        FAIL(result.text << "\n" << e.what());
    }
    // The decoder sees the contents of its textures.
    (void)compileScene(result.scene, 0);
    result.log = log.text();
    return result;
}

/// A square with this material.
inline Imported importOf(const Json& material, const std::function<void(GltfMaker&)>& more = {}) {
    GltfMaker maker = squareFile();
    maker.add("materials", material);
    maker.root["meshes"][0]["primitives"][0]["material"] = 0;
    if (more) more(maker);
    return importOf(maker);
}

inline const std::vector<std::uint8_t> kFourTexels{255, 0,   0, 255, 0,  128, 255, 128,
                                                   10,  200, 0, 0,   90, 60,  255, 64};

inline std::vector<std::uint16_t> wordsOf(const Texture& texture) {
    std::vector<std::uint16_t> words(texture.image->words());
    texture.image->decode(words);
    return words;
}

}  // namespace crt::test
