#include "scene/gltf/gltf_accessor.h"

#include "base/parallel.h"
#include "scene/gltf/gltf_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <utility>

namespace crt {
namespace {

constexpr std::size_t kPart = std::size_t{1} << 14;  // Elements that a thread takes at a time.

/// A sparse accessor without a buffer view is zero but for what it lists: nothing bounds its size.
constexpr std::size_t kMostZeroElements = std::size_t{1} << 24;

std::size_t bytesOf(int component_type) {
    switch (component_type) {
        case TINYGLTF_COMPONENT_TYPE_BYTE:
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: return 1;
        case TINYGLTF_COMPONENT_TYPE_SHORT:
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: return 2;
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
        case TINYGLTF_COMPONENT_TYPE_FLOAT: return 4;
        default: return 0;
    }
}

std::size_t componentsOf(int type) {
    switch (type) {
        case TINYGLTF_TYPE_SCALAR: return 1;
        case TINYGLTF_TYPE_VEC2: return 2;
        case TINYGLTF_TYPE_VEC3: return 3;
        case TINYGLTF_TYPE_VEC4:
        case TINYGLTF_TYPE_MAT2: return 4;
        case TINYGLTF_TYPE_MAT3: return 9;
        case TINYGLTF_TYPE_MAT4: return 16;
        default: return 0;
    }
}

template <class T>
T valueAt(const char* bytes) {
    T value;
    std::memcpy(&value, bytes, sizeof value);
    return value;
}

/// As glTF 2.0, 3.11, has it: signed codes are divided by their largest, and at least -1.
template <class T>
double codeAt(const char* bytes, bool normalized) {
    const double value = valueAt<T>(bytes);
    return normalized ? std::max(value / std::numeric_limits<T>::max(), -1.0) : value;
}

}  // namespace

GltfAccessor::Run GltfAccessor::run(int view, std::size_t offset, std::size_t count, int component_type,
                                    std::size_t components, std::size_t stride,
                                    const std::string& pointer) const {
    const std::size_t each = bytesOf(component_type) * components;
    if (each == 0)
        file_.fail(pointer + "/componentType", fmt::format("there is no type {}", component_type));
    if (stride == 0) stride = each;
    if (stride < each)
        file_.fail(pointer, fmt::format("its elements of {} bytes overlap: the stride is {}", each, stride));
    const std::string_view bytes = file_.view(view, pointer + "/bufferView");
    const bool fits = offset <= bytes.size() && each <= bytes.size() - offset &&
                      (count - 1) <= (bytes.size() - offset - each) / stride;
    if (count > 0 && !fits)
        file_.fail(pointer, fmt::format("{} elements of {} bytes, {} apart, from {} on are beyond buffer "
                                        "view {}, which has {}",
                                        count, each, stride, offset, view, bytes.size()));
    return {bytes.data() + offset, stride, component_type};
}

GltfAccessor::GltfAccessor(GltfFile& file, int index, std::string pointer)
    : file_(file), pointer_(std::move(pointer)) {
    const tinygltf::Model& model = file.model();
    if (index < 0 || static_cast<std::size_t>(index) >= model.accessors.size())
        file.fail(pointer_, "it refers to no accessor");
    const tinygltf::Accessor& accessor = model.accessors[static_cast<std::size_t>(index)];
    const std::string at = fmt::format("/accessors/{}", index);
    count_ = accessor.count;
    components_ = componentsOf(accessor.type);
    normalized_ = accessor.normalized;
    if (components_ == 0) file.fail(at + "/type", "its type is unknown");
    if (const DracoValues* const decoded = file.decoded(index)) {
        plain_ = {decoded->bytes.data(), bytesOf(accessor.componentType) * components_,
                  accessor.componentType};
        return;
    }
    const bool sparse = accessor.sparse.isSparse && accessor.sparse.count > 0;
    if (accessor.bufferView >= 0) {
        const std::size_t stride =
            static_cast<std::size_t>(accessor.bufferView) < model.bufferViews.size()
                ? model.bufferViews[static_cast<std::size_t>(accessor.bufferView)].byteStride
                : 0;
        plain_ = run(accessor.bufferView, accessor.byteOffset, count_, accessor.componentType, components_,
                     stride, at);
    } else if (!sparse) {
        file.fail(at, "it has no 'bufferView'");
    } else if (count_ > kMostZeroElements) {
        file.fail(at + "/count",
                  fmt::format("{} elements without a buffer view are too many", count_));
    }
    if (!sparse) return;
    changed_ = static_cast<std::size_t>(accessor.sparse.count);
    changed_at_ = run(accessor.sparse.indices.bufferView,
                      static_cast<std::size_t>(std::max(accessor.sparse.indices.byteOffset, 0)), changed_,
                      accessor.sparse.indices.componentType, 1, 0, at + "/sparse/indices");
    changed_to_ = run(accessor.sparse.values.bufferView,
                      static_cast<std::size_t>(std::max(accessor.sparse.values.byteOffset, 0)), changed_,
                      accessor.componentType, components_, 0, at + "/sparse/values");
    for (std::size_t i = 0; i < changed_; ++i)
        if (const std::uint32_t row = whole(changed_at_, i); row >= count_)
            file.fail(fmt::format("{}/sparse/indices", at),
                      fmt::format("change {} refers to element {}, and there are {}", i, row, count_));
}

void GltfAccessor::requireComponents(std::size_t least, std::size_t most) const {
    if (components_ >= least && components_ <= most) return;
    file_.fail(pointer_,
               fmt::format("its elements have {} numbers, not {}", components_,
                           least == most ? fmt::format("{}", least) : fmt::format("{} to {}", least, most)));
}

double GltfAccessor::number(const Run& run, std::size_t row, std::size_t component) const {
    if (run.first == nullptr) return 0;
    const char* const bytes = run.first + row * run.stride + component * bytesOf(run.component_type);
    switch (run.component_type) {
        case TINYGLTF_COMPONENT_TYPE_BYTE: return codeAt<std::int8_t>(bytes, normalized_);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: return codeAt<std::uint8_t>(bytes, normalized_);
        case TINYGLTF_COMPONENT_TYPE_SHORT: return codeAt<std::int16_t>(bytes, normalized_);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: return codeAt<std::uint16_t>(bytes, normalized_);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT: return codeAt<std::uint32_t>(bytes, normalized_);
        default: return valueAt<float>(bytes);
    }
}

std::uint32_t GltfAccessor::whole(const Run& run, std::size_t row) const {
    if (run.first == nullptr) return 0;
    const char* const bytes = run.first + row * run.stride;
    switch (run.component_type) {
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: return valueAt<std::uint8_t>(bytes);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: return valueAt<std::uint16_t>(bytes);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT: return valueAt<std::uint32_t>(bytes);
        default: file_.fail(pointer_, "indices are unsigned whole numbers, and these are not");
    }
}

template <std::size_t kWidth>
std::vector<std::array<double, kWidth>> GltfAccessor::rows() const {
    std::vector<std::array<double, kWidth>> all(count_);
    std::atomic<std::size_t> bad{count_};
    const auto take = [&](const Run& run, std::size_t from, std::size_t to) {
        bool finite = true;
        for (std::size_t k = 0; k < kWidth; ++k) {
            all[to][k] = number(run, from, k);
            finite = finite && std::isfinite(all[to][k]);
        }
        if (finite) return;
        std::size_t first = bad.load();
        while (to < first && !bad.compare_exchange_weak(first, to)) continue;
    };
    parallelFor(count_, kPart, [&](std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i) take(plain_, i, i);
    });
    for (std::size_t i = 0; i < changed_; ++i) take(changed_to_, i, whole(changed_at_, i));
    if (const std::size_t i = bad; i < count_)
        file_.fail(pointer_, fmt::format("element {} is NaN or infinite", i));
    return all;
}

template std::vector<std::array<double, 2>> GltfAccessor::rows<2>() const;
template std::vector<std::array<double, 3>> GltfAccessor::rows<3>() const;
template std::vector<std::array<double, 4>> GltfAccessor::rows<4>() const;
template std::vector<std::array<double, 16>> GltfAccessor::rows<16>() const;

std::vector<std::uint32_t> GltfAccessor::indices() const {
    requireComponents(1, 1);
    std::vector<std::uint32_t> all(count_);
    if (plain_.first != nullptr) (void)whole(plain_, 0);  // The type, before threads ask for it.
    parallelFor(count_, kPart, [&](std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i) all[i] = whole(plain_, i);
    });
    for (std::size_t i = 0; i < changed_; ++i) all[whole(changed_at_, i)] = whole(changed_to_, i);
    return all;
}

}  // namespace crt
