#include "scene/gltf/gltf_compression.h"

#include <draco/compression/decode.h>
#include <draco/mesh/mesh.h>
#include <fmt/format.h>
#include <meshoptimizer.h>

#include <array>
#include <cstring>
#include <limits>
#include <memory>

namespace crt {
namespace {

constexpr int kByte = 5120, kUnsignedByte = 5121, kShort = 5122, kUnsignedShort = 5123, kUnsignedInt = 5125,
              kFloat = 5126;  // Component types of glTF.
constexpr std::size_t kMostComponents = 4;

/// Every point's values as T. False where Draco cannot convert one.
template <class T>
bool appendValues(const draco::PointAttribute& attribute, std::uint32_t points, std::size_t components,
                  std::string& bytes) {
    std::array<T, kMostComponents> values{};
    bytes.reserve(points * components * sizeof(T));
    for (draco::PointIndex point(0); point < points; ++point) {
        if (!attribute.ConvertValue<T>(attribute.mapped_index(point), static_cast<std::int8_t>(components),
                                       values.data()))
            return false;
        bytes.append(reinterpret_cast<const char*>(values.data()), components * sizeof(T));
    }
    return true;
}

template <class T>
DracoValues cornersAs(const draco::Mesh& mesh) {
    if (mesh.num_points() > std::numeric_limits<T>::max()) return {};
    DracoValues made;
    made.bytes.reserve(mesh.num_faces() * 3 * sizeof(T));
    for (draco::FaceIndex face(0); face < mesh.num_faces(); ++face)
        for (const draco::PointIndex& corner : mesh.face(face)) {
            const auto index = static_cast<T>(corner.value());
            made.bytes.append(reinterpret_cast<const char*>(&index), sizeof index);
            ++made.count;
        }
    return made;
}

}  // namespace

std::string faultOf(const MeshoptView& view) {
    using Mode = MeshoptView::Mode;
    using Filter = MeshoptView::Filter;
    if (view.mode == Mode::Attributes && (view.stride == 0 || view.stride % 4 != 0 || view.stride > 256))
        return fmt::format("a stride of {} bytes: it must be a multiple of 4 up to 256", view.stride);
    if (view.mode != Mode::Attributes && view.stride != 2 && view.stride != 4)
        return fmt::format("a stride of {} bytes: indices have 2 or 4", view.stride);
    if (view.mode == Mode::Triangles && view.count % 3 != 0)
        return fmt::format("{} indices are no triangles", view.count);
    if (view.filter != Filter::None && view.mode != Mode::Attributes) return "only attributes have a filter";
    if (view.filter == Filter::Octahedral && view.stride != 4 && view.stride != 8)
        return fmt::format("a stride of {} bytes: the octahedral filter needs 4 or 8", view.stride);
    if (view.filter == Filter::Quaternion && view.stride != 8)
        return fmt::format("a stride of {} bytes: the quaternion filter needs 8", view.stride);
    return {};
}

std::string decodeMeshopt(const MeshoptView& view, std::string_view bytes) {
    std::string made(view.count * view.stride, '\0');
    const auto* const data = reinterpret_cast<const unsigned char*>(bytes.data());
    const auto failed = [&] {
        switch (view.mode) {
            case MeshoptView::Mode::Attributes:
                return meshopt_decodeVertexBuffer(made.data(), view.count, view.stride, data, bytes.size());
            case MeshoptView::Mode::Triangles:
                return meshopt_decodeIndexBuffer(made.data(), view.count, view.stride, data, bytes.size());
            case MeshoptView::Mode::Indices: break;
        }
        return meshopt_decodeIndexSequence(made.data(), view.count, view.stride, data, bytes.size());
    };
    if (failed() != 0) return {};
    switch (view.filter) {
        case MeshoptView::Filter::None: break;
        case MeshoptView::Filter::Octahedral:
            meshopt_decodeFilterOct(made.data(), view.count, view.stride);
            break;
        case MeshoptView::Filter::Quaternion:
            meshopt_decodeFilterQuat(made.data(), view.count, view.stride);
            break;
        case MeshoptView::Filter::Exponential:
            meshopt_decodeFilterExp(made.data(), view.count, view.stride);
            break;
    }
    return made;
}

struct DracoMesh::State {
    std::unique_ptr<draco::Mesh> mesh;
};

DracoMesh::DracoMesh(std::string_view bytes, std::string& why) : state_(new State) {
    draco::DecoderBuffer buffer;
    buffer.Init(bytes.data(), bytes.size());
    draco::Decoder decoder;
    auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
    if (decoded.ok())
        state_->mesh = std::move(decoded).value();
    else
        why = decoded.status().error_msg_string();
}

DracoMesh::~DracoMesh() { delete state_; }

DracoValues DracoMesh::corners(int component_type) const {
    switch (component_type) {
        case kUnsignedByte: return cornersAs<std::uint8_t>(*state_->mesh);
        case kUnsignedShort: return cornersAs<std::uint16_t>(*state_->mesh);
        case kUnsignedInt: return cornersAs<std::uint32_t>(*state_->mesh);
        default: return {};
    }
}

DracoValues DracoMesh::attribute(std::uint32_t id, int component_type, std::size_t components) const {
    const draco::PointAttribute* const attribute = state_->mesh->GetAttributeByUniqueId(id);
    // glTF has no truth values, and Draco takes any byte of a file for one.
    if (attribute == nullptr || components == 0 || components > kMostComponents ||
        attribute->num_components() != static_cast<int>(components) ||
        attribute->data_type() == draco::DT_BOOL)
        return {};
    const std::uint32_t points = state_->mesh->num_points();
    DracoValues made{points, {}};
    const auto append = [&] {
        switch (component_type) {
            case kByte: return appendValues<std::int8_t>(*attribute, points, components, made.bytes);
            case kUnsignedByte:
                return appendValues<std::uint8_t>(*attribute, points, components, made.bytes);
            case kShort: return appendValues<std::int16_t>(*attribute, points, components, made.bytes);
            case kUnsignedShort:
                return appendValues<std::uint16_t>(*attribute, points, components, made.bytes);
            case kUnsignedInt:
                return appendValues<std::uint32_t>(*attribute, points, components, made.bytes);
            case kFloat: return appendValues<float>(*attribute, points, components, made.bytes);
            default: return false;
        }
    };
    return append() ? made : DracoValues{};
}

}  // namespace crt
