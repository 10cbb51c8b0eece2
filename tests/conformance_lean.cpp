// Lean kernels give the bits of the full one: for the scenes of conformance_bits.cpp, and for random ones,
// which have fewer features together.
#include "conformance.h"

#include "kernel/dialect/features.h"
#include "spectra/spectra.h"

#include <algorithm>
#include <random>
#include <set>

using namespace conformance;
using crt::Scene;

namespace {

struct Masks {
    std::uint64_t lean = 0, full = 0;
};

/// Renders the scene with both kernels and compares the images.
Masks compareLean(const Scene& scene, std::uint32_t aovs, std::uint64_t samples) {
    Run run;
    run.samples = samples;
    run.aovs = aovs;
    CrtBackendReport of_lean{}, of_full{};
    run.options.kernel = CRT_KERNEL_LEAN_ONLY;
    const crt::Film with_lean = render(backend(), scene, run, &of_lean);
    run.options.kernel = CRT_KERNEL_FULL;
    CHECK(differingPixels(with_lean, render(backend(), scene, run, &of_full)) == 0);
    CHECK(of_full.kernel_features == CRT_FEATURES_ALL);
    const std::uint64_t needed = crt::compileScene(scene, aovs).header().features;
    CHECK((needed & ~of_lean.kernel_features) == 0);
    return {of_lean.kernel_features, of_full.kernel_features};
}

template <class Change>
void forMaterials(Scene& scene, const Change& change) {
    for (crt::Material& material : scene.materials) change(material);
}

/// Makes materials of one kind diffuse.
void becomeDiffuse(Scene& scene, crt::MaterialType type) {
    forMaterials(scene, [&](crt::Material& material) {
        if (material.type != type) return;
        material = {};
        material.reflectance = crt::constantSpectrum(0.5);
    });
}

struct Removal {
    const char* name;
    void (*apply)(Scene& scene);
};

/// Changes that take a feature or two from a scene. A random choice of them leaves features that no other
/// scene has together.
const Removal kRemovals[] = {
    {"holes",
     [](Scene& s) { forMaterials(s, [](auto& m) { m.opacity = 1, m.opacity_texture = crt::kNoTexture; }); }},
    {"mixes",
     [](Scene& s) {
         becomeDiffuse(s, crt::MaterialType::Mix);
         becomeDiffuse(s, crt::MaterialType::TwoSided);
     }},
    {"dispersion",
     [](Scene& s) {
         forMaterials(s, [](auto& m) {
             if (m.transmits()) m.eta = crt::constantSpectrum(1.5);
         });
     }},
    {"thin films",
     [](Scene& s) {
         forMaterials(s, [](auto& m) { m.film_thickness_nm = 0, m.film_texture = crt::kNoTexture; });
     }},
    {"absorption", [](Scene& s) { forMaterials(s, [](auto& m) { m.absorption.reset(); }); }},
    {"interpolated normals",
     [](Scene& s) {
         for (crt::Mesh& mesh : s.meshes) mesh.normals.clear(), mesh.normal_index.clear();
     }},
    {"normal maps", [](Scene& s) { forMaterials(s, [](auto& m) { m.normal_texture = crt::kNoTexture; }); }},
    {"textures",
     [](Scene& s) {
         forMaterials(s, [](auto& m) {
             m.roughness_texture = m.amount_texture = m.opacity_texture = m.film_texture = crt::kNoTexture;
             m.tint_texture = m.transmittance_texture = crt::kNoTexture;
             if (m.clearcoat) m.clearcoat->roughness_texture = crt::kNoTexture;
             if (m.clearcoat) m.clearcoat->roughens = false;
             if (m.reflectance_texture == crt::kNoTexture) return;
             m.reflectance_texture = crt::kNoTexture;
             m.reflectance = crt::constantSpectrum(0.5);
         });
         for (crt::Emission& e : s.emissions) e.texture = crt::kNoTexture;
     }},
    {"images that emit",
     [](Scene& s) {
         for (auto& e : s.emissions) e.texture = crt::kNoTexture;
     }},
    {"factors of images",
     [](Scene& s) {
         for (crt::Emission& e : s.emissions) e.texture = crt::kNoTexture;
         for (crt::Texture& t : s.textures) t.factor.reset();
     }},
    {"sheets",
     [](Scene& s) {
         forMaterials(s,
                      [](auto& m) { m.transmittance.reset(), m.transmittance_texture = crt::kNoTexture; });
     }},
    {"tints",
     [](Scene& s) { forMaterials(s, [](auto& m) { m.tint.reset(), m.tint_texture = crt::kNoTexture; }); }},
    {"anisotropy", [](Scene& s) { forMaterials(s, [](auto& m) { m.anisotropy = 0; }); }},
    {"fuzz", [](Scene& s) { forMaterials(s, [](auto& m) { m.fuzz = 0; }); }},
    {"coats", [](Scene& s) { forMaterials(s, [](auto& m) { m.clearcoat.reset(); }); }},
    {"rough bases", [](Scene& s) { forMaterials(s, [](auto& m) { m.diffuse_roughness = 0; }); }},
    {"mirrors", [](Scene& s) { becomeDiffuse(s, crt::MaterialType::Mirror); }},
    {"smooth metals", [](Scene& s) { becomeDiffuse(s, crt::MaterialType::Conductor); }},
    {"rough metals", [](Scene& s) { becomeDiffuse(s, crt::MaterialType::RoughConductor); }},
    {"smooth glass", [](Scene& s) { becomeDiffuse(s, crt::MaterialType::Dielectric); }},
    {"rough glass", [](Scene& s) { becomeDiffuse(s, crt::MaterialType::RoughDielectric); }},
    {"panes", [](Scene& s) { becomeDiffuse(s, crt::MaterialType::ThinDielectric); }},
    {"plastics", [](Scene& s) { becomeDiffuse(s, crt::MaterialType::Plastic); }},
    {"lamps",
     [](Scene& s) {
         for (crt::Object& object : s.objects) object.emission = -1;
         for (crt::Mesh& mesh : s.meshes) mesh.emission.clear();
         forMaterials(s, [](auto& m) { m.emission = -1; });
     }},
    {"lights without a surface", [](Scene& s) { s.point_lights.clear(); }},
    {"the environment", [](Scene& s) { s.environment.reset(); }},
    {"an environment that is sampled",
     [](Scene& s) {
         if (s.environment) s.environment->light_sampling = false;
     }},
    {"an environment that depends on the direction",
     [](Scene& s) {
         if (s.environment) s.environment->sky.reset(), s.environment->image.reset();
     }},
    {"light sampling", [](Scene& s) { s.integrator.nee = false; }},
    {"a lens", [](Scene& s) { s.camera.aperture_radius = 0; }},
    {"a filter", [](Scene& s) { s.film.filter = crt::PixelFilter::Box, s.film.filter_radius = 0.5; }},
    {"a spectral film", [](Scene& s) { s.film.spectral = {}; }},
    {"instances",
     [](Scene& s) {
         for (crt::Object& object : s.objects) object.sharing = crt::Sharing::Never;
     }},
    {"shapes",
     [](Scene& s) { std::erase_if(s.objects, [](const crt::Object& o) { return o.shape.has_value(); }); }},
    {"a tree", [](Scene& s) { s.integrator.accelerator = crt::Accelerator::None; }},
    {"Sobol", [](Scene& s) { s.sampler.type = crt::SamplerType::Independent; }},
};

/// A scene of the list without a random half of what it may have.
Scene randomScene(const std::vector<Named>& scenes, std::mt19937_64& random, std::string& name) {
    const Named& whole = scenes[random() % scenes.size()];
    Scene scene = whole.scene;
    name = whole.name;
    for (const Removal& removal : kRemovals) {
        if (random() % 2 == 0) continue;
        removal.apply(scene);
        name += std::string(", without ") + removal.name;
    }
    scene.film.width = scene.film.height = 24;
    return scene;
}

}  // namespace

TEST_CASE("a kernel with everything in it gives the bits of the lean one", "[bits][lean]") {
    bool lean_differs = false;
    std::size_t number = 0;
    for (const Named& n : allScenes()) {
        // A compiler takes seconds for each kernel: half of the scenes are rendered with all AOVs, the other
        // half without any, and the plain ones both ways.
        const bool with_aovs = number % 2 == 0;
        if (number++ % leanStride() != 0) continue;
        for (const std::uint32_t aovs : {0u, kAllAovs}) {
            if (with_aovs != (aovs != 0) && !n.plain) continue;
            INFO(n.name << (aovs == 0 ? "" : ", all AOVs"));
            const Masks masks = compareLean(n.scene, aovs, 4);
            // Otherwise one kernel was compared with itself.
            if (n.plain && leanKernels()) CHECK(masks.lean != masks.full);
            lean_differs = lean_differs || masks.lean != masks.full;
        }
    }
    if (leanKernels()) CHECK(lean_differs);  // With a stride there may be no plain scene.
    if (!lean_differs)
        WARN("the backend has one kernel for all scenes, so there was nothing to compare it with");
}

// Holes are looked for where a surface has one, not where surfaces have two sides. Another search finds the
// shadow rays that end on a round lamp.
TEST_CASE("a scene of two-sided surfaces without holes has the same bits in both kernels", "[bits][lean]") {
    const Scene scene = sceneFrom(R"(crt: 1
camera: {position: [0, 1, -4], target: [0, 0.5, 0], fov: 40}
film: {resolution: [24, 24]}
materials:
  white: {type: diffuse, reflectance: 0.7}
  black: {type: diffuse, reflectance: 0}
  sheet: {type: two_sided, front: white, back: black}
objects:
  - name: floor
    mesh: {positions: [[-200,0,-200],[-200,0,200],[200,0,200],[200,0,-200]], faces: [[0,1,2,3]]}
    material: sheet
  - name: lamp
    sphere: {radius: 0.1}
    material: black
    transform: [{translate: [0, 17, 0]}]
    emission: {radiance: 16000}
)");
    compareLean(scene, 0, 64);
}

TEST_CASE("lean kernels of random scenes give the bits of the full one", "[random][lean]") {
    const std::vector<Named> scenes = allScenes();
    std::mt19937_64 random(47);
    std::set<std::uint64_t> masks;
    for (std::size_t number = 0; number < 300; ++number) {
        std::string name;
        const Scene scene = randomScene(scenes, random, name);
        if (number % leanStride() != 0) continue;
        INFO("number " << number << ": " << name);
        masks.insert(compareLean(scene, number % 3 == 0 ? kAllAovs : 0, 4).lean);
    }
    if (leanKernels() && leanStride() == 1) CHECK(masks.size() >= 200);
}
