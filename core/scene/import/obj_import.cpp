#include "scene/import/obj_import.h"

#include "scene/mesh/mesh_io.h"

#include <fmt/format.h>

#include <algorithm>

namespace crt {

/// Materials stay those of the file; the scene says what faces without one have.
std::string objScene(const std::string& path, const std::string& file_name, Losses& losses) {
    const LoadedMesh loaded = loadObj(path);
    Bounds bounds;
    for (const auto& triangle : loaded.mesh.triangles)
        for (const std::uint32_t corner : triangle) bounds.add(loaded.mesh.positions[corner]);
    const bool bare =
        loaded.mesh.material.empty() ||
        std::any_of(loaded.mesh.material.begin(), loaded.mesh.material.end(), [&](std::int32_t m) {
            return m < 0 || !loaded.materials[static_cast<std::size_t>(m)].mtl;
        });
    const bool emits = std::any_of(loaded.materials.begin(), loaded.materials.end(),
                                   [](const LoadedMaterial& m) { return m.mtl && m.mtl->emission; });
    losses.choose("a camera that sees all of it");
    std::string text =
        fmt::format("\n# Chosen: an OBJ has no camera.\ncamera: {{{}}}\n", chosenCamera(bounds, 1.5));
    text += "film: {resolution: [960, 640]}\nsampler: {samples: 128}\n";
    if (!emits) {
        losses.choose("a white sky");
        text +=
            "\n# Chosen: the file has no light.\nenvironment: {radiance: {rgb: [0.9, 0.9, 0.9], space: "
            "linear}}\n";
    }
    if (bare) {
        losses.choose("grey for faces without a material");
        text += "\nmaterials:\n  grey: {type: diffuse, reflectance: 0.5}\n";
    }
    text += fmt::format("\nobjects:\n  - name: {}\n    obj: {}\n", yamlText(file_name), yamlText(file_name));
    if (bare) text += "    material: grey\n";
    if (std::any_of(loaded.materials.begin(), loaded.materials.end(),
                    [](const LoadedMaterial& m) { return m.mtl.has_value(); })) {
        text += "    # For a material of the scene in place of the file's own:\n    # material_overrides:\n";
        for (const LoadedMaterial& m : loaded.materials)
            if (m.mtl) text += fmt::format("    #   {}: …\n", yamlText(m.name));
    }
    return text;
}

}  // namespace crt
