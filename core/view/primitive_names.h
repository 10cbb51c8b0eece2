/// The name in the scene of the surface behind a primitive id of a film.
#pragma once

#include "compile/compile.h"
#include "scene/scene.h"

#include <cstdint>
#include <string>
#include <vector>

namespace crt {

struct PrimitiveName {
    std::string object;    ///< Empty: the object has no name.
    std::string material;  ///< Empty: it has no separate material.
};

/// Keeps what it needs of both: neither need outlive it.
class PrimitiveNames {
public:
    PrimitiveNames(const CompiledScene& compiled, const Scene& scene);

    /// Of an id that a film has; both empty for CRT_NONE and for ids that the scene has not.
    PrimitiveName of(std::uint32_t id) const;

private:
    struct Primitive {
        std::uint32_t material, placement;
    };
    /// A mesh that is stored once: ids from `first_id` on are its triangles, those from `first_primitive`
    /// on.
    struct Instance {
        std::uint32_t first_id, first_primitive, object;
    };
    std::vector<Primitive> primitives_;
    std::vector<Instance> instances_;       ///< By first_id.
    std::vector<std::uint32_t> object_of_;  ///< By placement.
    std::vector<std::string> objects_, materials_;
    std::uint32_t first_instanced_ = 0;  ///< The first primitive of a mesh that is stored once.
};

}  // namespace crt
