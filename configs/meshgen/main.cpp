/// crt-meshgen OUTDIR: writes the meshes that the scenes in this folder use: sphere.obj, ball.obj,
/// figure.obj, dragon.obj, prism.obj, product.glb, broadleaf.obj, conifer.obj, fern.obj, grass.obj,
/// terrain.ply.
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
/// crt-meshgen --tree SEED TRIANGLES FILE.obj [--conifer]: writes another tree.
///
/// Every object stands on y = 0, is centred in x and z, has height 1, and faces −z.
#include "plant.h"
#include "product.h"
#include "shapes.h"

#include <charconv>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

using namespace crt::meshgen;

namespace {

/// The whole number that is all of the text, if it is at most `most`.
std::optional<std::uint32_t> numberOf(const std::string& digits, std::uint32_t most) {
    std::uint32_t number = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
    if (error != std::errc() || end != digits.data() + digits.size() || number > most) return std::nullopt;
    return number;
}

/// Of "--grid CELLS FILE.ply [--normals]"; 0 where it is not that.
std::uint32_t cellsOf(const std::vector<std::string>& arguments) {
    const bool counts = arguments.size() == 3 || (arguments.size() == 4 && arguments[3] == "--normals");
    if (!counts || arguments[0] != "--grid") return 0;
    return numberOf(arguments[1], 10'000).value_or(0);
}

/// "--tree SEED TRIANGLES FILE.obj [--conifer]"
struct TreeCommand {
    std::uint32_t seed, triangles;
    std::string file;
    bool is_conifer;
};
std::optional<TreeCommand> treeOf(const std::vector<std::string>& arguments) {
    const bool is_conifer = arguments.size() == 5 && arguments[4] == "--conifer";
    if ((arguments.size() != 4 && !is_conifer) || arguments[0] != "--tree") return std::nullopt;
    const auto seed = numberOf(arguments[1], 0xffffffff), triangles = numberOf(arguments[2], 10'000'000);
    // Wood is closed and leaves are two triangles each: their number is even.
    if (!seed || !triangles || *triangles % 2 != 0) return std::nullopt;
    return TreeCommand{*seed, *triangles, arguments[3], is_conifer};
}

void writeAll(const std::filesystem::path& folder) {
    std::filesystem::create_directories(folder);
    writeObj(sphere(32, 16), folder / "sphere.obj", "sphere of 32 segments and 16 rings");
    writeObj(sphere(128, 64), folder / "ball.obj", "sphere of 128 segments and 64 rings");
    writeObj(prism(), folder / "prism.obj", "60 degree prism");
    writeObj(figure(), folder / "figure.obj", "ape, thinking");
    writeObj(dragon(), folder / "dragon.obj", "dragon");
    writeProduct(folder / "product.glb");
    broadleaf(1, 70'000).writeObj(folder / "broadleaf.obj", "broadleaf");
    conifer(1, 70'000).writeObj(folder / "conifer.obj", "conifer");
    fern(1).writeObj(folder / "fern.obj", "fern");
    grass(1).writeObj(folder / "grass.obj", "grass");
    writePly(terrain(), folder / "terrain.ply");
}

}  // namespace

int main(int argc, char** argv) {
    const std::vector<std::string> arguments(argv + 1, argv + argc);
    const std::uint32_t cells = cellsOf(arguments);
    const std::optional<TreeCommand> tree = treeOf(arguments);
    const std::string argument = arguments.size() == 1 ? arguments[0] : "";
    const bool asks_for_help = argument == "--help" || argument == "-h";
    if (cells == 0 && !tree && (argument.empty() || argument[0] == '-')) {
        std::fprintf(
            asks_for_help ? stdout : stderr,
            "usage: crt-meshgen OUTDIR\nWrites sphere.obj, ball.obj, figure.obj, dragon.obj, prism.obj, "
            "product.glb, broadleaf.obj, conifer.obj, fern.obj, grass.obj and terrain.ply into the folder "
            "OUTDIR, which "
            "is made if need be.\n"
            "       crt-meshgen --grid CELLS FILE.ply [--normals]\nWrites a height field of 2 CELLS² "
            "triangles, CELLS up to 10000.\n"
            "       crt-meshgen --tree SEED TRIANGLES FILE.obj [--conifer]\nWrites a tree of groups `bark` "
            "and `leaves`. TRIANGLES is even, up to 10000000.\n");
        return asks_for_help ? 0 : 2;
    }
    try {
        if (cells > 0)
            writePly(grid(cells, arguments.size() == 4), arguments[2]);
        else if (tree)
            (tree->is_conifer ? conifer : broadleaf)(tree->seed, tree->triangles)
                .writeObj(tree->file, tree->is_conifer ? "conifer" : "broadleaf");
        else
            writeAll(argument);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "crt-meshgen: %s\n", error.what());
        return 6;
    }
    return 0;
}
