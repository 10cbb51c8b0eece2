/// The settings of a scene besides surfaces and lights: film, camera, sampler and integrator.
#pragma once

#include "compile/flatten.h"
#include "kernel/dialect/layout.h"
#include "scene/scene.h"

#include <cstdint>

namespace crt {

/// The header with its settings; arrays, accelerator, environment and features are still to come. `aovs`
/// are the bits of Aov that outputs ask for. Lengths are centred and scaled as `flat` is. Warns of pixels
/// finer than directions in single precision. Throws crt::Error(Scene) for a camera too far away.
kernel::CrtScene compileSettings(const Scene& scene, const FlatScene& flat, std::uint32_t aovs);

/// CrtScene::splat_scale of a scene whose lights have this power together, in the units of the light choice
/// (compile/lights.h). A scene without light counts as one of power 1.
double splatScale(double power);

/// The part of it that says from where, and in how many pixels, the scene is seen. Throws and warns so, too.
void compileView(const Scene& scene, const Vec3d& centre, int scale_exponent, kernel::CrtScene& header);

}  // namespace crt
