// A program that renders with libcrt: a scene in memory becomes a film, and that an image file.
#include <crt/crt.h>

#include <cstdio>

constexpr const char* kScene = R"(
crt: 1
film: {resolution: [320, 240]}
camera: {position: [2.6, 1.8, 4.4], target: [0, 0.5, 0], fov: 35}
environment: {radiance: 0.3}
materials:
  clay: {type: diffuse, reflectance: {rgb: [0.8, 0.35, 0.2]}}
  chalk: {type: diffuse, reflectance: 0.8}
objects:
  - name: floor
    material: chalk
    mesh: {positions: [[-9, 0, 9], [9, 0, 9], [9, 0, -9], [-9, 0, -9]], faces: [[0, 1, 2, 3]]}
  - name: pyramid
    material: clay
    mesh: {positions: [[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1], [0, 1.5, 0]],
           faces: [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]}
  - name: lamp
    material: chalk
    emission: {radiance: 12}
    mesh: {positions: [[-2, 4, 0], [-2, 4, 1], [-1, 4, 1], [-1, 4, 0]], faces: [[3, 2, 1, 0]]}
)";

struct Percent : crt::Watch {
    void progress(const crt::Progress& now) override {
        std::fprintf(stderr, "\r%3.0f %%", 100 * now.fraction);
    }
};

int main(int argc, char** argv) try {
    const crt::Scene scene = crt::Scene::fromText(kScene);
    crt::RenderOptions options;
    options.samples = 64;
    Percent percent;
    const crt::Rendered rendered = crt::render(scene, options, &percent);
    rendered.film.saveImage(argc > 1 ? argv[1] : "pyramid.png");
    if (const auto error = rendered.film.error())
        std::fprintf(stderr, "\nerror of the image: %.2g %%\n", 100 * error->relative_rmse);
} catch (const crt::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return static_cast<int>(error.kind());
}
