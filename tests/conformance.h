/// The shared parts of the conformance suite: the backend under test, and scenes.
#pragma once

#include "backend/integrator.h"
#include "backend/loader.h"
#include "catch.h"
#include "compile/compile.h"
#include "film/film.h"
#include "scene/yaml/scene_yaml.h"

#include <cstdint>
#include <string>
#include <vector>

namespace conformance {

/// The backend named by --backend.
const crt::LoadedBackend& backend();
/// The backend that others are compared with, bit by bit: --against, by default the portable C++ build of
/// the kernel (`example`), and where that is not installed, or is the one under test, the first of crt's own
/// that runs here.
const crt::LoadedBackend& reference();

/// A scene from YAML; meshes only inline.
crt::Scene sceneFrom(const std::string& yaml, const std::vector<crt::SceneOverride>& overrides = {});

constexpr std::uint32_t kAllAovs = crt::kAovsOfFirstHits;

struct Named {
    std::string name;
    crt::Scene scene;
    bool plain = false;  ///< Needs few features.
};

/// The scenes whose bits are held (conformance_bits.cpp).
std::vector<Named> allScenes();

struct Run {
    crt::IntegratorOptions options;
    std::uint64_t first_sample = 0;
    std::uint64_t samples = 16;
    std::uint32_t aovs = 0;
};

/// --lean-kernels: the backend under test has other kernels than the full one, and must use them.
bool leanKernels();
/// Of the scenes whose lean kernels are compared with the full one, each of this number is taken.
std::size_t leanStride();

/// Compiles, opens, renders, reads back.
crt::Film render(const crt::LoadedBackend& backend, const crt::Scene& scene, const Run& run,
                 CrtBackendReport* report = nullptr);

/// Pixels whose XYZ (every channel, when `all`) mean differs in any bit after rounding to float.
std::uint64_t differingPixels(const crt::Film& a, const crt::Film& b, bool all = true);

/// Mean of Y over the film.
double imageMean(const crt::Film& film);

}  // namespace conformance
