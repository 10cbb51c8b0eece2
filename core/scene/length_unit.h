/// Length units of a scene. Lengths stay as the scene has them; the unit changes only light that spreads
/// over square metres.
#pragma once

#include <string>
#include <vector>

namespace crt {

struct LengthUnit {
    const char* name;
    double metres;
};

/// Their names in scene files.
inline constexpr LengthUnit kLengthUnits[] = {{"m", 1},     {"dm", 0.1},  {"cm", 0.01},     {"mm", 0.001},
                                              {"um", 1e-6}, {"km", 1000}, {"inch", 0.0254}, {"ft", 0.3048}};

inline std::vector<std::string> lengthUnitNames() {
    std::vector<std::string> names;
    for (const LengthUnit& unit : kLengthUnits) names.emplace_back(unit.name);
    return names;
}

}  // namespace crt
