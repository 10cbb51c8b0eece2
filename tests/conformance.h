/// What the conformance suite's files share: the backend under test, scenes, and confidence intervals.
#pragma once

#include "backend/integrator.h"
#include "backend/loader.h"
#include "compile.h"
#include "film.h"
#include "scene_yaml.h"

#include <catch2/catch.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace conformance {

/// The backend named by --backend.
const crt::LoadedBackend& backend();
/// The backend that others are compared with, bit by bit: --against, by default the portable C++ build of the kernel (`example`).
const crt::LoadedBackend& reference();

/// A scene from YAML; meshes only inline.
crt::Scene sceneFrom(const std::string& yaml, const std::vector<crt::SceneOverride>& overrides = {});

struct Run {
    crt::IntegratorOptions options;
    std::uint64_t first_sample = 0;
    std::uint64_t samples = 16;
    std::uint32_t aovs = 0;
};

/// Compiles, opens, renders, reads back.
crt::Film render(const crt::LoadedBackend& backend, const crt::Scene& scene, const Run& run);

/// Pixels whose XYZ (every channel, when `all`) mean differs in any bit after rounding to float.
std::uint64_t differingPixels(const crt::Film& a, const crt::Film& b, bool all = true);

/// Mean of Y over the film.
double imageMean(const crt::Film& film);

struct Interval {
    double lower, upper;
};

/// 99.9 % Student interval of the mean of 16 independent replicates: t₁₅ at .9995 is 4.0728.
Interval interval999(const std::vector<double>& sixteen);

/// Equivalence, not failure to reject: the whole 99.9 % interval of the mean over 16 seeds lies within ±delta of `expected`.
/// Renders scene(seed) 16 times with `samples` per pixel.
void requireMean(const std::string& yaml, double expected, double delta, std::uint64_t samples);

}  // namespace conformance
