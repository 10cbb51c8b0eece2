#include "verify/scenes.h"

#include <fmt/format.h>

#include <utility>

namespace crt::verify {

std::string yaml(const Cube& cube) {
    std::string text = fmt::format("crt: 1\ncamera: {}\nfilm: {}\nintegrator: {}\nmaterials: {{wall: {{type: diffuse, reflectance: {}}}}}\n{}objects:\n",
                                   cube.camera, cube.film, cube.integrator, cube.reflectance, cube.more);
    constexpr std::pair<const char*, const char*> walls[] = {
        {"floor", "[[0,0,0],[0,0,1],[1,0,1],[1,0,0]]"}, {"ceiling", "[[0,1,0],[1,1,0],[1,1,1],[0,1,1]]"},
        {"left", "[[0,0,0],[0,1,0],[0,1,1],[0,0,1]]"},  {"right", "[[1,0,0],[1,0,1],[1,1,1],[1,1,0]]"},
        {"back", "[[0,0,1],[0,1,1],[1,1,1],[1,0,1]]"},  {"front", "[[0,0,0],[1,0,0],[1,1,0],[0,1,0]]"},
    };
    for (const auto& [name, positions] : walls) {
        const bool emits = cube.emitting == "all" || cube.emitting == name;
        text += fmt::format("  - {{name: {}, mesh: {{positions: {}, faces: [[0,1,2,3]]}}, material: wall{}}}\n", name, positions,
                            emits ? fmt::format(", emission: {{radiance: {}}}", cube.radiance) : "");
    }
    return text;
}

std::string squareOverFloor(double x, const std::string& integrator, double half_side, const std::string& radiance) {
    return fmt::format(R"(crt: 1
camera: {{position: [{0}, 0.5, 3], target: [{0}, 0, 0], fov: 0.01}}
film: {{resolution: [4, 4]}}
integrator: {1}
materials: {{floor: {{type: diffuse, reflectance: 1}}, lamp: {{type: diffuse, reflectance: 0}}}}
objects:
  - {{name: floor, mesh: {{positions: [[-40,0,-40],[-40,0,40],[40,0,40],[40,0,-40]], faces: [[0,1,2,3]]}}, material: floor}}
  - {{name: lamp, mesh: {{positions: [[-{2},1,-{2}],[{2},1,-{2}],[{2},1,{2}],[-{2},1,{2}]], faces: [[0,1,2,3]]}}, material: lamp, emission: {{radiance: {3}}}}}
)",
                       x, integrator, half_side, radiance);
}

}  // namespace crt::verify
