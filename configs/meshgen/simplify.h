/// Fewer triangles for the same shape.
#pragma once

#include "mesh.h"

#include <cstddef>

namespace crt::meshgen {

/// Collapses edges, cheapest first, until `target` triangles are left. The mesh must be closed and stays so;
/// an edge is passed over if collapsing it would pinch the surface, turn a face over, or leave a sliver.
Mesh simplified(Mesh mesh, std::size_t target);

}  // namespace crt::meshgen
