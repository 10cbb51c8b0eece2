/// From a distance field to a closed mesh.
#pragma once

#include "distance_field.h"
#include "mesh.h"

namespace crt::meshgen {

/// The surface where `field` is zero inside the box, by marching tetrahedra on a grid of `step`. Each cube
/// is cut into six tetrahedra around one diagonal; neighbours agree on the cut of their common face, so the
/// surface is closed.
Mesh polygonise(const Field& field, Vec low, Vec high, double step);

/// The largest connected part. Tips thinner than the grid can come off as crumbs.
Mesh withoutCrumbs(Mesh mesh);

}  // namespace crt::meshgen
