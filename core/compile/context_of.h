/// The view of a compiled scene that functions of the kernel take, for the host.
#pragma once

#include "kernel/dialect/context.h"

#include "compile/compile.h"

namespace crt {

/// Valid as long as the scene is.
inline kernel::CrtContext contextOf(const CompiledScene& scene) {
    kernel::CrtContext context{};
    context.blob = scene.data();
    context.scene = &scene.header();
    return context;
}

}  // namespace crt
