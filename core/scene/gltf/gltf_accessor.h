/// Accessors of glTF files as numbers: every component type, normalised ones, strides, sparse ones.
#pragma once

#include "scene/gltf/gltf_file.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace crt {

class GltfAccessor {
public:
    /// Checks that all elements lie within their bytes. `pointer` is what names the accessor, for messages:
    /// "/meshes/0/primitives/0/indices". Throws crt::Error(Scene), as all functions here.
    GltfAccessor(GltfFile& file, int index, std::string pointer);

    std::size_t count() const { return count_; }
    std::size_t components() const { return components_; }
    /// Refuses accessors of another number of components than `least` to `most`.
    void requireComponents(std::size_t least, std::size_t most) const;

    /// The first `kWidth` components of each element, all finite.
    template <std::size_t kWidth>
    std::vector<std::array<double, kWidth>> rows() const;
    /// Elements of one unsigned component.
    std::vector<std::uint32_t> indices() const;

private:
    /// Elements at a regular distance.
    struct Run {
        const char* first = nullptr;  ///< Null: all zero.
        std::size_t stride = 0;
        int component_type = 0;
    };
    Run run(int view, std::size_t offset, std::size_t count, int component_type, std::size_t components,
            std::size_t stride, const std::string& pointer) const;
    double number(const Run& run, std::size_t row, std::size_t component) const;
    std::uint32_t whole(const Run& run, std::size_t row) const;

    GltfFile& file_;
    std::string pointer_;
    std::size_t count_ = 0, components_ = 0;
    bool normalized_ = false;
    Run plain_;
    std::size_t changed_ = 0;  ///< Elements that a sparse accessor replaces.
    Run changed_at_, changed_to_;
};

}  // namespace crt
