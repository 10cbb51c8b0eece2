/// crt-meshgen OUTDIR: writes the meshes that the scenes in this folder use: sphere.obj, ball.obj,
/// figure.obj, dragon.obj, prism.obj, product.glb.
///
/// They are made rather than shipped: the source says what they are, nothing is downloaded, and every run
/// writes the same bytes. Sphere and prism are written down directly. Figure and dragon are modelled as
/// signed distance fields (round bones, joined by a smooth minimum), polygonised by marching tetrahedra,
/// which always gives a closed surface, and simplified by quadric error to an exact number of triangles. So
/// triangles are small where the shape is fine and large where it is flat, as in a scan, which is what a BVH
/// has to be good at.
///
/// crt-meshgen --grid CELLS FILE.ply [--normals]: writes a height field of 2 CELLS² triangles, for
/// measuring how large meshes are read.
///
/// Every object stands on y = 0, is centred in x and z, has height 1, and faces −z.
#include "product.h"
#include "shapes.h"

#include <charconv>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>

using namespace crt::meshgen;

namespace {

/// Of "--grid CELLS FILE.ply [--normals]"; 0 where it is not that.
std::uint32_t cellsOf(int argc, char** argv) {
    if ((argc != 4 && (argc != 5 || std::string(argv[4]) != "--normals")) ||
        std::string(argv[1]) != "--grid")
        return 0;
    const std::string digits = argv[2];
    std::uint32_t cells = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), cells);
    constexpr std::uint32_t kMost = 10'000;
    return error == std::errc() && end == digits.data() + digits.size() && cells <= kMost ? cells : 0;
}

}  // namespace

int main(int argc, char** argv) {
    if (const std::uint32_t cells = cellsOf(argc, argv); cells > 0) {
        try {
            writePly(grid(cells, argc == 5), argv[3]);
        } catch (const std::exception& error) {
            std::fprintf(stderr, "crt-meshgen: %s\n", error.what());
            return 6;
        }
        return 0;
    }
    const std::string argument = argc == 2 ? argv[1] : "";
    const bool asks_for_help = argument == "--help" || argument == "-h";
    if (argument.empty() || argument[0] == '-') {
        std::fprintf(
            asks_for_help ? stdout : stderr,
            "usage: crt-meshgen OUTDIR\nWrites sphere.obj, ball.obj, figure.obj, dragon.obj, "
            "prism.obj and product.glb into the folder OUTDIR, which is made if need be.\n"
            "       crt-meshgen --grid CELLS FILE.ply [--normals]\nWrites a height field of 2 CELLS² "
            "triangles, CELLS up to 10000.\n");
        return asks_for_help ? 0 : 2;
    }
    try {
        const std::filesystem::path folder = argument;
        std::filesystem::create_directories(folder);
        writeObj(sphere(32, 16), folder / "sphere.obj", "sphere of 32 segments and 16 rings");
        writeObj(sphere(128, 64), folder / "ball.obj", "sphere of 128 segments and 64 rings");
        writeObj(prism(), folder / "prism.obj", "60 degree prism");
        writeObj(figure(), folder / "figure.obj", "ape, thinking");
        writeObj(dragon(), folder / "dragon.obj", "dragon");
        writeProduct(folder / "product.glb");
    } catch (const std::exception& error) {
        std::fprintf(stderr, "crt-meshgen: %s\n", error.what());
        return 6;
    }
    return 0;
}
