#include "verify/scenes.h"

#include "image/image_io.h"

#include <fmt/format.h>

#include <utility>

namespace crt::verify {

void writeRgb(const std::string& path, OutputFormat format, std::uint32_t width, std::uint32_t height,
              const std::vector<float>& rgb) {
    Image image;
    image.width = width;
    image.height = height;
    image.channels = {"R", "G", "B"};
    image.pixels = rgb;
    writeImage(path, format, image);
}

std::string yaml(const Cube& cube) {
    std::string text = fmt::format(
        "crt: 1\ncamera: {}\nfilm: {}\nintegrator: {}\nmaterials: {{wall: {{type: diffuse, reflectance: "
        "{}}}}}\n{}objects:\n",
        cube.camera, cube.film, cube.integrator, cube.reflectance, cube.more);
    constexpr std::pair<const char*, const char*> walls[] = {
        {"floor", "[[0,0,0],[0,0,1],[1,0,1],[1,0,0]]"}, {"ceiling", "[[0,1,0],[1,1,0],[1,1,1],[0,1,1]]"},
        {"left", "[[0,0,0],[0,1,0],[0,1,1],[0,0,1]]"},  {"right", "[[1,0,0],[1,0,1],[1,1,1],[1,1,0]]"},
        {"back", "[[0,0,1],[0,1,1],[1,1,1],[1,0,1]]"},  {"front", "[[0,0,0],[1,0,0],[1,1,0],[0,1,0]]"},
    };
    for (const auto& [name, positions] : walls) {
        const bool emits = cube.emitting == "all" || cube.emitting == name;
        text += fmt::format(
            "  - {{name: {}, mesh: {{positions: {}, faces: [[0,1,2,3]]}}, material: wall{}}}\n", name,
            positions, emits ? fmt::format(", emission: {{radiance: {}}}", cube.radiance) : "");
    }
    return text;
}

std::string squareOverFloor(double x, const std::string& integrator, double half_side,
                            const std::string& radiance) {
    return fmt::format(R"(crt: 1
camera: {{position: [{0}, 0.5, 3], target: [{0}, 0, 0], fov: 0.01}}
film: {{resolution: [4, 4]}}
integrator: {1}
materials: {{floor: {{type: diffuse, reflectance: 1}}, lamp: {{type: diffuse, reflectance: 0}}}}
objects:
  - {{name: floor, mesh: {{positions: [[-40,0,-40],[-40,0,40],[40,0,40],[40,0,-40]],
      faces: [[0,1,2,3]]}}, material: floor}}
  - {{name: lamp, mesh: {{positions: [[-{2},1,-{2}],[{2},1,-{2}],[{2},1,{2}],[-{2},1,{2}]],
      faces: [[0,1,2,3]]}}, material: lamp, emission: {{radiance: {3}}}}}
)",
                       x, integrator, half_side, radiance);
}

Stage::Stage(const std::string& camera, const std::string& integrator) {
    set("camera", camera);
    set("film", "{resolution: [4, 4]}");
    set("integrator", integrator);
}

Stage& Stage::set(const std::string& key, const std::string& value) {
    top_[key] = value;
    return *this;
}

Stage& Stage::material(const std::string& name, const std::string& definition) {
    materials_ += fmt::format("  {}: {}\n", name, definition);
    return *this;
}

Stage& Stage::quad(const std::string& name, const std::string& corners, const std::string& material,
                   const std::string& radiance) {
    return mesh(name, corners, "[[0,1,2,3]]", material, radiance);
}

Stage& Stage::mesh(const std::string& name, const std::string& positions, const std::string& faces,
                   const std::string& material, const std::string& radiance) {
    return object(fmt::format(
        "name: {}, mesh: {{positions: {}, faces: {}}}, material: {}{}", name, positions, faces, material,
        radiance.empty() ? "" : fmt::format(", emission: {{radiance: {}}}", radiance)));
}

Stage& Stage::object(const std::string& keys) {
    objects_ += fmt::format("  - {{{}}}\n", keys);
    return *this;
}

Stage& Stage::box(const std::string& name, const Point& a, const Point& b, const std::string& material) {
    std::string positions;
    for (int i = 0; i < 8; ++i)
        positions += fmt::format("{}[{},{},{}]", i == 0 ? "" : ",", (i & 1 ? b : a)[0], (i & 2 ? b : a)[1],
                                 (i & 4 ? b : a)[2]);
    return mesh(name, "[" + positions + "]", "[[0,2,3,1],[4,5,7,6],[0,1,5,4],[2,6,7,3],[0,4,6,2],[1,3,7,5]]",
                material);
}

std::string Stage::yaml() const {
    std::string text = "crt: 1\n";
    for (const auto& [key, value] : top_) text += fmt::format("{}: {}\n", key, value);
    if (!materials_.empty()) text += "materials:\n" + materials_;
    if (!objects_.empty()) text += "objects:\n" + objects_;
    return text;
}

}  // namespace crt::verify
