#include "view/primitive_names.h"

#include "compile/instances.h"
#include "compile/placements.h"
#include "kernel/layout.h"

#include <algorithm>

namespace crt {

PrimitiveNames::PrimitiveNames(const CompiledScene& compiled, const Scene& scene) {
    using namespace kernel;
    const CrtScene& header = compiled.header();
    const CrtPrimitive* const primitives = CRT_ARRAY(CrtPrimitive, compiled.data(), header.primitives);
    primitives_.reserve(header.primitives.count);
    for (std::uint32_t i = 0; i < header.primitives.count; ++i)
        primitives_.push_back({primitives[i].material, primitives[i].object});
    for (const Material& material : scene.materials) materials_.push_back(material.name);

    // In the order in which the compiler meets them (placementsOf, compileInstances).
    std::vector<std::uint32_t> instanced;
    for (std::uint32_t o = 0; o < scene.objects.size(); ++o) {
        const Object& object = scene.objects[o];
        objects_.push_back(object.name);
        const bool shared = sharesMesh(scene, object);
        for (const Matrix4d& transform : object.transforms) {
            object_of_.push_back(o);
            if (shared && canInstance(transform)) instanced.push_back(o);
        }
    }
    const CrtInstance* const instances = CRT_ARRAY(CrtInstance, compiled.data(), header.instances);
    first_instanced_ = header.primitives.count;
    for (std::uint32_t i = 0; i < header.instances.count && i < instanced.size(); ++i) {
        instances_.push_back({instances[i].first_id, instances[i].first_primitive, instanced[i]});
        first_instanced_ = std::min(first_instanced_, instances[i].first_primitive);
    }
}

PrimitiveName PrimitiveNames::of(std::uint32_t id) const {
    std::uint32_t object = CRT_NONE, primitive = id;
    if (!instances_.empty() && id >= instances_.front().first_id) {
        const auto after = std::upper_bound(
            instances_.begin(), instances_.end(), id,
            [](std::uint32_t wanted, const Instance& instance) { return wanted < instance.first_id; });
        const Instance& instance = *(after - 1);
        primitive = instance.first_primitive + (id - instance.first_id);
        object = instance.object;
    } else if (id >= first_instanced_) {
        return {};
    }
    if (primitive >= primitives_.size()) return {};
    const Primitive& found = primitives_[primitive];
    if (object == CRT_NONE && found.placement < object_of_.size()) object = object_of_[found.placement];
    PrimitiveName name;
    if (object < objects_.size()) name.object = objects_[object];
    if (found.material < materials_.size()) name.material = materials_[found.material];
    return name;
}

}  // namespace crt
