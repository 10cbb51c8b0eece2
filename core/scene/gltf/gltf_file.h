/// glTF 2.0 and GLB files: the container, the JSON and its references checked, bytes within bounds. tinygltf
/// turns the JSON into structures; it is given no bytes and opens no file.
#pragma once

#include "scene/gltf/gltf_compression.h"

#include <nlohmann/json_fwd.hpp>

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tinygltf {
class Model;
}

namespace crt {

/// JSON deeper than this is refused: readers of JSON call themselves for each level.
inline constexpr int kDeepestGltfJson = 64;

struct GltfJson;

class GltfFile {
public:
    /// Reads a file and checks that everything it names by number is there. Throws crt::Error(Scene),
    /// "a.glb: /nodes/3/mesh: …" with a JSON pointer, for one that is damaged, no glTF 2.0, or needs what
    /// crt does not have (KTX2, morph targets of a weight).
    explicit GltfFile(const std::string& path);
    ~GltfFile();
    GltfFile(const GltfFile&) = delete;
    GltfFile& operator=(const GltfFile&) = delete;

    const std::string& path() const { return path_; }
    const tinygltf::Model& model() const { return *model_; }

    /// Allows buffers that lie outside the file's folder; else they are refused.
    void allowOutside() { allow_outside_ = true; }

    /// The bytes of a buffer view. Reads the buffer's file when it is first asked for. `pointer` is what
    /// names the view, for messages. Throws crt::Error(Scene).
    std::string_view view(int buffer_view, const std::string& pointer);

    /// The elements of an accessor of a primitive that Draco compressed; null for all others. Decodes the
    /// primitive when one of its accessors is first asked for. Throws crt::Error(Scene).
    const DracoValues* decoded(int accessor);

    /// An image: a file beside this one, or bytes in it.
    struct Image {
        std::string name;
        std::string file;  ///< A path. Empty where the image is bytes.
        std::shared_ptr<const std::string> bytes;
    };
    std::size_t imageCount() const { return images_.size(); }
    const std::string& imageName(std::size_t index) const { return images_[index].name; }
    /// Throws crt::Error(Scene).
    Image image(std::size_t index);

    std::size_t animationCount() const { return animations_; }
    /// This file and the buffers' that were read.
    const std::vector<std::string>& filesRead() const { return files_read_; }

    [[noreturn]] void fail(const std::string& pointer, const std::string& why) const;

private:
    struct Buffer {
        std::string uri;
        std::uint64_t bytes = 0;    ///< As the file states.
        bool in_container = false;  ///< The GLB's own.
        std::optional<std::string> read;
    };
    struct ImageSource {
        std::string name, uri;
        int view = -1;
    };
    void split();
    void checkText() const;
    void check(const GltfJson& json);
    void keepDraco(const GltfJson& json, const nlohmann::json& primitive, std::size_t mesh,
                   std::size_t number);
    std::string_view buffer(std::size_t index);
    std::string_view bytesOf(std::size_t buffer, std::uint64_t offset, std::uint64_t length,
                             const std::string& pointer);
    std::string_view decompressed(std::size_t buffer_view, const MeshoptView& how);
    void decodePrimitive(std::size_t mesh, std::size_t primitive);
    /// The path of a file that a URI names.
    std::string pathOf(const std::string& uri, const std::string& pointer) const;
    std::optional<std::string> dataOf(const std::string& uri, const std::string& pointer) const;

    std::string path_, content_;
    std::string_view json_, binary_;
    bool allow_outside_ = false;
    std::vector<Buffer> buffers_;
    std::vector<ImageSource> images_;
    std::map<std::size_t, MeshoptView> meshopt_;  ///< By buffer view.
    std::map<std::size_t, std::string> decompressed_;
    std::map<std::pair<std::size_t, std::size_t>, DracoPrimitive> draco_;  ///< By mesh and primitive.
    std::map<int, std::pair<std::size_t, std::size_t>> draco_accessors_;  ///< To their primitive.
    std::map<int, DracoValues> decoded_;                                   ///< By accessor.
    std::size_t animations_ = 0;
    std::vector<std::string> files_read_;
    std::unique_ptr<tinygltf::Model> model_;
};

/// The glTF files of a scene, each read once.
class GltfFiles {
public:
    GltfFile& open(const std::string& path);

private:
    std::map<std::string, std::unique_ptr<GltfFile>> open_;
};

}  // namespace crt
