// Writes images of 4096 x 4096 texels, as photographs are: gradients, edges, fine detail and noise; and a
// scene that shows each on a square. For docs/results/speed.md.
//
//     texture_files FOLDER [jpg|png] [COUNT]
#include "image/image_io.h"
#include "jpeg_file.h"
#include "spectra/spectra.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace {

constexpr unsigned kSize = 4096;

std::vector<std::uint8_t> photograph() {
    std::vector<std::uint8_t> codes;
    codes.reserve(std::size_t{3} * kSize * kSize);
    std::uint64_t state = 7;
    for (unsigned y = 0; y < kSize; ++y)
        for (unsigned x = 0; x < kSize; ++x) {
            const double u = double(x) / kSize, v = double(y) / kSize;
            const double grain = std::sin(90 * (u + 0.03 * std::sin(25 * v))),
                         edge = std::sin(7 * u * v * 9) > 0;
            state = state * 6364136223846793005u + 1442695040888963407u;
            const double noise = double(state >> 56) / 255 - 0.5;
            for (int k = 0; k < 3; ++k) {
                const double level = 0.45 + 0.25 * std::sin(3 * u + 2 * v + 1.5 * k) + 0.12 * grain +
                                     0.1 * edge + 0.04 * noise;
                codes.push_back(
                    static_cast<std::uint8_t>(std::lround(255 * std::fmin(std::fmax(level, 0), 1))));
            }
        }
    return codes;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc < 2) {
        std::fputs("usage: texture_files FOLDER [jpg|png] [COUNT]\n", stderr);
        return 2;
    }
    const std::string folder = argv[1], format = argc > 2 ? argv[2] : "jpg";
    const int count = argc > 3 ? std::atoi(argv[3]) : 16;
    std::filesystem::create_directories(folder);
    const std::string first = fmt::format("{}/0.{}", folder, format);
    const std::vector<std::uint8_t> codes = photograph();
    if (format == "jpg") {
        writeJpeg(first, kSize, kSize, 3, codes, false, 90);
    } else {
        crt::Image image;
        image.width = image.height = kSize;
        image.channels = {"R", "G", "B"};
        for (const std::uint8_t code : codes)
            image.pixels.push_back(static_cast<float>(crt::srgbToLinear(code / 255.0)));
        crt::writeImage(first, crt::OutputFormat::Png, image);
    }
    std::string materials, objects;
    for (int i = 0; i < count; ++i) {
        const std::string name = fmt::format("{}.{}", i, format);
        if (i > 0)
            std::filesystem::copy_file(first, folder + "/" + name,
                                       std::filesystem::copy_options::overwrite_existing);
        materials += fmt::format("  m{}: {{type: diffuse, reflectance: {{texture: {}}}}}\n", i, name);
        objects += fmt::format(
            "  - {{mesh: {{positions: [[{0},{1},0],[{0},{3},0],[{2},{3},0],[{2},{1},0]], uvs: "
            "[[0,0],[0,1],[1,1],[1,0]], faces: [[0,3,2,1]]}}, material: m{4}}}\n",
            i % 4, i / 4, i % 4 + 0.95, i / 4 + 0.95, i);
    }
    std::ofstream(folder + "/scene.yaml")
        << "crt: 1\ncamera: {position: [2, 2, -6], target: [2, 2, 0], fov: 40}\nfilm: {resolution: [256, "
           "256]}\nenvironment: {radiance: {illuminant: D65}}\nmaterials:\n"
        << materials << "objects:\n"
        << objects;
    return 0;
}
