/// The meshes that crt-meshgen writes. Each stands on y = 0, is centred in x and z, has height 1 and
/// faces −z, where nothing else is said.
#pragma once

#include "mesh.h"

#include <cstdint>

namespace crt::meshgen {

Mesh sphere(std::uint32_t segments, std::uint32_t rings);

/// A dispersing prism: equilateral section of height 1 in the xy plane, apex up, two units long in z. Its
/// faces are flat, so the mesh stores no normals.
Mesh prism();

/// An ape sitting on a block of stone and thinking, chin on hand, after the bronze that Hugo Rheinhold made
/// in 1892.
Mesh figure();

/// A winged dragon, half coiled, head turned to the viewer. Long and thin in every direction, and as fine in
/// its scales as it is coarse on its wings.
Mesh dragon();

/// A height field of waves, x and z from -1/2 to 1/2, of 2 cells² triangles.
Mesh grid(std::uint32_t cells, bool with_normals);

/// The ground of a forest, x and z from -1/2 to 1/2: knolls, a trail that winds along z through (0, 0, -1/2)
/// at height 0, and a slope at the far end. Colours of vertices: litter, moss and the sand of the trail.
Mesh terrain();

}  // namespace crt::meshgen
