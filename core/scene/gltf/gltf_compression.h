/// Compressed meshes of glTF files, by the libraries of their authors: meshoptimizer
/// (EXT_meshopt_compression) and Draco (KHR_draco_mesh_compression).
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace crt {

/// The compression of a buffer view.
struct MeshoptView {
    enum class Mode { Attributes, Triangles, Indices };
    enum class Filter { None, Octahedral, Quaternion, Exponential };
    std::uint64_t buffer = 0, offset = 0, length = 0;  ///< The bytes.
    std::uint64_t stride = 0, count = 0;               ///< Of the decompressed elements.
    Mode mode = Mode::Attributes;
    Filter filter = Filter::None;
};

/// The rule of the extension that `view` breaks, in words; empty if it breaks none.
std::string faultOf(const MeshoptView& view);

/// The elements, `stride` bytes each; empty where the bytes are damaged. Requires a view without fault.
std::string decodeMeshopt(const MeshoptView& view, std::string_view bytes);

/// A primitive that Draco compressed.
struct DracoPrimitive {
    int view = -1;                             ///< Of the bytes.
    std::map<std::string, std::uint32_t> ids;  ///< Draco's, by the names of attributes.
};

/// An attribute of a Draco mesh, or its corners.
struct DracoValues {
    std::size_t count = 0;
    std::string bytes;  ///< Closely packed, in the component type that was asked for.
};

/// A decoded mesh of Draco.
class DracoMesh {
public:
    /// `why` gets the reason where the bytes are none; then nothing else may be asked.
    DracoMesh(std::string_view bytes, std::string& why);
    ~DracoMesh();
    DracoMesh(const DracoMesh&) = delete;
    DracoMesh& operator=(const DracoMesh&) = delete;

    /// The corners of its triangles in a component type of glTF. A count of 0: they do not fit into it.
    DracoValues corners(int component_type) const;
    /// An attribute by Draco's number, with as many components; a count of 0: there is none such.
    DracoValues attribute(std::uint32_t id, int component_type, std::size_t components) const;

private:
    struct State;  // Of a library that only gltf_compression.cpp includes.
    State* state_ = nullptr;
};

}  // namespace crt
