/// The tree by which many lights are chosen (kernel/lights/light_tree.h).
#pragma once

#include "base/vec3d.h"
#include "kernel/dialect/layout.h"

#include <cstdint>
#include <vector>

namespace crt {

/// From how many lights at a place on there is a tree: measured (docs/decisions/0026-light-tree.md).
inline constexpr std::size_t kLightTreeLights = 16;

/// Where lights lie, which way they shine, and how much. Their normals are up to θ_o from the axis, and
/// each shines up to θ_e from its own.
struct LightBounds {
    Vec3d lower{}, upper{};
    Vec3d axis{0, 0, 1};  ///< Unit.
    double theta_o = 0, theta_e = 0;
    double power = 0;     ///< Above 0; any unit.
    bool two_sided = false;
};

/// All that both are.
LightBounds boundsOfBoth(const LightBounds& a, const LightBounds& b);

struct LightTree {
    std::vector<kernel::CrtLightNode> nodes;  ///< The root first; parents before children.
    std::vector<std::uint32_t> leaf_of;       ///< By light: 4 times the node + which of its children.
};

/// Of one light or more. The same for the same lights, whatever the number of threads.
LightTree buildLightTree(const std::vector<LightBounds>& lights);

}  // namespace crt
