/// An image around the scene, as the kernel has it: texels, and the tables by which directions are chosen.
#pragma once

#include "compile/blob_writer.h"
#include "kernel/dialect/layout.h"
#include "scene/scene.h"

namespace crt {

/// Texels of the environment; rows from the zenith down.
struct EnvironmentTexels {
    std::uint32_t width = 0, height = 0;
    std::vector<kernel::CrtEnvironmentTexel> texels;
    std::vector<float> brightness;  ///< X + Y + Z of each, per unit of the environment's radiance.
    double mean_brightness = 0;     ///< Over the sphere.
};

/// Reads the image, or computes the sky, of an environment that has one. Throws crt::Error(Scene), with the
/// place in the scene, for images that cannot be read or light nothing can have: texels that are NaN,
/// negative or infinite, or a shape that is not twice as wide as high.
EnvironmentTexels environmentTexels(const Environment& environment);

/// Appends what the kernel needs of it.
kernel::CrtSpan appendEnvironmentImage(BlobWriter& blob, const Environment& environment,
                                       const EnvironmentTexels& texels);

}  // namespace crt
