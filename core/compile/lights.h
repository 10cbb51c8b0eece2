/// The light sources: emitters among the triangles, the choice of one, and the environment.
#pragma once

#include "compile/accelerator.h"
#include "compile/blob_writer.h"
#include "compile/environment_image.h"
#include "compile/flatten.h"
#include "compile/spectrum_table.h"
#include "kernel/dialect/layout.h"
#include "scene/scene.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace crt {

/// Triangles that emit, in the order of their ids: those of an emission that is not black, with area. None
/// in a view that shows no light.
std::vector<std::uint32_t> emittingTriangles(const Scene& scene, const FlatScene& flat);

struct LightPart {
    std::vector<kernel::CrtLight> lights;
    std::vector<std::uint32_t> light_of;  ///< By primitive id: index of its light, or CRT_NONE.
    std::uint32_t environment = 0;        ///< 1 + the index of its light; 0: it has none.
    std::vector<kernel::CrtLightNode> tree;  ///< Of the first `tree_lights` lights; empty: there is none.
    std::uint32_t tree_lights = 0;
    std::vector<kernel::CrtPointLight> point_lights;
    std::uint32_t emitters = 0;  ///< Lights with a surface: the first ones.
    std::uint64_t features = 0;  ///< That kernels need for emission that is an image.
    double power = 0;  ///< Of all lights, in the units that they are chosen by.
};
/// `around`: the texels of an environment that has them, or null. The light of the environment has no
/// radiance yet: its spectrum comes last in the table. `textures`: those that have a record.
LightPart compileLights(const Scene& scene, const FlatScene& flat,
                        const std::vector<std::uint32_t>& emitting, const AcceleratorPart& accelerator,
                        SpectrumTable& spectra, const EnvironmentTexels* around,
                        const std::vector<TextureIndex>& textures);

/// The lights, and behind them the tree.
kernel::CrtSpan appendLights(const LightPart& part, BlobWriter& blob);

/// True if the environment is among the lights.
bool samplesEnvironment(const Scene& scene);

/// True if shadow rays leave the scene: towards its environment, or lights without a surface.
bool shadowRaysLeave(const Scene& scene);

/// The spectrum of the environment, where there is one and the view shows it; otherwise null.
const Spectrum* spectrumOfEnvironment(const Scene& scene);

}  // namespace crt
