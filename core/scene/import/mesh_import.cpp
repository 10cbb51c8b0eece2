#include "scene/import/mesh_import.h"

#include "scene/light_units.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <optional>
#include <vector>

namespace crt {
namespace {

Bounds boundsOf(const Mesh& mesh) {
    Bounds bounds;
    for (const auto& triangle : mesh.triangles)
        for (const std::uint32_t corner : triangle) bounds.add(mesh.positions[corner]);
    return bounds;
}

/// From within, where the mesh has materials that are seen from there.
std::optional<InnerView> innerViewOf(const Mesh& mesh, double aspect) {
    if (mesh.material.empty() || mesh.triangles.size() > kMostPaintedTriangles) return std::nullopt;
    std::vector<PaintedTriangle> triangles;
    triangles.reserve(mesh.triangles.size());
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const auto& corners = mesh.triangles[i];
        triangles.emplace_back(mesh.positions[corners[0]], mesh.positions[corners[1]],
                               mesh.positions[corners[2]], static_cast<std::uint32_t>(mesh.material[i]));
    }
    return innerView(triangles, aspect);
}

/// Approximate brightness of a white surface within the box of an OBJ, lit by its emitters (Ke), where 1 is
/// white in the image; nothing without emitters.
std::optional<double> brightnessBy(const LoadedMesh& loaded) {
    const Mesh& mesh = loaded.mesh;
    std::vector<double> radiance;
    bool emits = false;
    for (const LoadedMaterial& material : loaded.materials) {
        const bool lamp = material.mtl && material.mtl->emission;
        radiance.push_back(lamp ? photometric(material.mtl->emission->radiance) /
                                      (kLuminousEfficacy_lm_W * cieYIntegral())
                                : 0);
        emits |= lamp;
    }
    if (!emits) return std::nullopt;
    double light = 0;  // Times area.
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const auto& corners = mesh.triangles[i];
        const Vec3d& a = mesh.positions[corners[0]];
        const double area =
            length(cross(mesh.positions[corners[1]] - a, mesh.positions[corners[2]] - a)) / 2;
        if (mesh.material[i] >= 0) light += area * radiance[static_cast<std::size_t>(mesh.material[i])];
    }
    const double radius = boundsOf(mesh).radius();
    return light / (4 * std::numbers::pi * radius * radius);
}

/// Camera and film; and light, unless the file has enough.
std::string viewText(const Mesh& mesh, const std::optional<double>& brightness, Losses& losses) {
    constexpr double kAlmostBlack = 0.004;  // Code 13 of 255.
    constexpr double kAspect = 1.5;
    const std::optional<InnerView> inner = innerViewOf(mesh, kAspect);
    std::string text = chosenCamera(boundsOf(mesh), inner, kAspect, losses);
    text += "film: {resolution: [960, 640]}\nsampler: {samples: 128}\n";
    if (brightness && *brightness < kAlmostBlack) {
        losses.choose(
            "a grey sky in addition to the file's lights, which are too weak (`--set environment=null` "
            "leaves it out)");
        return text + chosenSky("the lights of the file are too weak", 1);
    }
    if (brightness) return text;
    losses.choose(inner ? "a grey sky and a lamp at the camera" : "a grey sky and a lamp");
    return text + chosenLight(inner);
}

}  // namespace

/// Materials stay those of the file; the scene says what faces without one have.
std::string objScene(const LoadedMesh& loaded, const std::string& file_name, Losses& losses) {
    const bool bare =
        loaded.mesh.material.empty() ||
        std::any_of(loaded.mesh.material.begin(), loaded.mesh.material.end(), [&](std::int32_t m) {
            return m < 0 || !loaded.materials[static_cast<std::size_t>(m)].mtl;
        });
    std::string text = viewText(loaded.mesh, brightnessBy(loaded), losses);
    if (bare) {
        losses.choose("grey for faces without a material");
        text += "\nmaterials:\n  grey: {type: diffuse, reflectance: 0.5}\n";
    }
    text += fmt::format("\nobjects:\n  - name: {}\n    obj: {}\n", yamlText(file_name), yamlText(file_name));
    if (bare) text += "    material: grey\n";
    if (std::any_of(loaded.materials.begin(), loaded.materials.end(),
                    [](const LoadedMaterial& m) { return m.mtl.has_value(); })) {
        text += "    # For a material of the scene in place of the file's own:\n    # parts:\n";
        for (const LoadedMaterial& m : loaded.materials)
            if (m.mtl) text += fmt::format("    #   {}: {{material: …}}\n", yamlText(m.name));
    }
    return text;
}

/// Of the colours of its vertices where it has some, else grey; smooth where it has no normals.
std::string plyScene(const Mesh& mesh, const std::string& file_name, Losses& losses) {
    std::string text = viewText(mesh, std::nullopt, losses);
    const bool colored = !mesh.colors.empty();
    losses.choose(colored ? "a matt material with the colours of its vertices" : "a grey material");
    text += fmt::format("\nmaterials:\n  surface: {{type: diffuse, reflectance: {}}}\n",
                        colored ? "{attribute: colors}" : "0.5");
    text += fmt::format("\nobjects:\n  - name: {}\n    ply: {}\n    material: surface\n",
                        yamlText(file_name), yamlText(file_name));
    if (!mesh.normals.empty()) return text;
    losses.choose("smooth normals");
    return text + "    normals: smooth  # the file has none\n";
}

/// Grey, and smooth but for edges: a machined part.
std::string stlScene(const Mesh& mesh, const std::string& file_name, Losses& losses) {
    losses.choose("a grey material, and smooth normals but at edges of more than 30 degrees");
    return viewText(mesh, std::nullopt, losses) +
           fmt::format(
               "\nmaterials:\n  surface: {{type: diffuse, reflectance: 0.5}}\n\nobjects:\n  - name: "
               "{0}\n    stl: {0}\n    material: surface\n    normals: smooth\n    "
               "crease_angle_deg: 30\n",
               yamlText(file_name));
}

}  // namespace crt
