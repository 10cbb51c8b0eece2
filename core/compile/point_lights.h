/// Lights without a surface, as the kernel has them.
#pragma once

#include "compile/blob_writer.h"
#include "compile/flatten.h"
#include "kernel/dialect/layout.h"
#include "scene/scene.h"

#include <vector>

namespace crt {

/// Those that are not black, suns first; none in a view that shows no light.
std::vector<const PointLight*> shiningPointLights(const Scene& scene);

/// CRT_LIGHT_POINT and so on.
kernel::u32 kindOf(const PointLight& light);

/// Moved and scaled as `flat` is; its index among the lights is still to come. Throws crt::Error(Scene) when
/// it is too far away or too bright for single precision.
kernel::CrtPointLight compilePointLight(const PointLight& light, const FlatScene& flat);

/// The distributions and sections of lights that have one, for the lights of shiningPointLights in their
/// order.
void appendForms(const Scene& scene, const FlatScene& flat, BlobWriter& blob,
                 std::vector<kernel::CrtPointLight>& compiled);

/// Radiant flux over π, per unit of the spectrum, as emitters have it with area times radiance. Of lights
/// that are infinitely far away, what enters the sphere around the scene, whose area is `around`.
double powerOf(const PointLight& light, const kernel::CrtPointLight& compiled, double around,
               int scale_exponent);

}  // namespace crt
