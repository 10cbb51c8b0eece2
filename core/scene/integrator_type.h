/// The integrators of kernel/dialect/integrators.h, as scenes name them and as the rest of core asks for
/// them. An integrator that a row adds is known here by its columns alone.
#pragma once

#include "kernel/dialect/features.h"
#include "kernel/dialect/integrators.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace crt {

#define CRT_INTEGRATOR_TYPE(number, NAME, Name, word, stem, KERNELS, light, surfaces, splats) Name = number,
enum class IntegratorType : std::uint32_t { CRT_INTEGRATOR_LIST(CRT_INTEGRATOR_TYPE) };
#undef CRT_INTEGRATOR_TYPE

struct IntegratorRow {
    const char* word = "";        ///< In scene files.
    std::uint64_t features = 0;   ///< Of kernels that have it, beside those of the scene.
    bool measures_light = false;  ///< If not, its image is of colours.
    bool traces_surfaces = false; ///< If not, it needs the objects' boxes alone.
    bool splats = false;          ///< Its films have a plane of splats (kernel/film/splat.h).
};

inline IntegratorRow rowOf(IntegratorType type) {
    constexpr std::uint64_t CRT_FEATURE_ALL = 0;  // what every kernel has
    switch (type) {
#define CRT_INTEGRATOR_ROW(number, NAME, Name, word, stem, KERNELS, light, surfaces, splats) \
    case IntegratorType::Name:                                                               \
        return {word, CRT_FEATURE_##KERNELS | (splats != 0 ? CRT_FEATURE_SPLAT : 0ul), light != 0,   \
                surfaces != 0, splats != 0};
        CRT_INTEGRATOR_LIST(CRT_INTEGRATOR_ROW)
#undef CRT_INTEGRATOR_ROW
    }
    return {};
}

inline bool measuresLight(IntegratorType type) { return rowOf(type).measures_light; }
inline bool tracesSurfaces(IntegratorType type) { return rowOf(type).traces_surfaces; }
inline bool splats(IntegratorType type) { return rowOf(type).splats; }

/// The words of all, by their numbers.
inline std::vector<std::string> integratorWords() {
    std::vector<std::string> words;
    for (std::uint32_t i = 0; *rowOf(static_cast<IntegratorType>(i)).word != '\0'; ++i)
        words.emplace_back(rowOf(static_cast<IntegratorType>(i)).word);
    return words;
}

/// By its word; false for a word of none.
inline bool measuresLight(std::string_view word) {
    for (std::uint32_t i = 0; *rowOf(static_cast<IntegratorType>(i)).word != '\0'; ++i)
        if (rowOf(static_cast<IntegratorType>(i)).word == word)
            return measuresLight(static_cast<IntegratorType>(i));
    return false;
}

}  // namespace crt
