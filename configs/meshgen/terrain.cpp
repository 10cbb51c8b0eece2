#include "plant.h"
#include "shapes.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace crt::meshgen {
namespace {

/// Smooth noise from -1 to 1: random numbers at the corners of a grid of width 1.
class Noise {
public:
    explicit Noise(std::uint64_t seed) {
        Random random(seed);
        for (double& value : values_) value = random.between(-1, 1);
    }
    double at(double x, double z) const {
        const double fx = std::floor(x), fz = std::floor(z), u = eased(x - fx), v = eased(z - fz);
        const auto value = [&](double i, double j) {
            const auto wrapped = [](double k) {
                return static_cast<std::size_t>(static_cast<long>(k) & 63);
            };
            return values_[64 * wrapped(j) + wrapped(i)];
        };
        return (1 - v) * ((1 - u) * value(fx, fz) + u * value(fx + 1, fz)) +
               v * ((1 - u) * value(fx, fz + 1) + u * value(fx + 1, fz + 1));
    }

private:
    static double eased(double t) { return t * t * (3 - 2 * t); }
    std::vector<double> values_ = std::vector<double>(std::size_t{64} * 64);
};

/// Signed distance along x of a point from the trail.
double besideTrail(double x, double z) {
    const double from_start = z + 0.5;
    return x - 0.022 * onCircle(1000 * from_start).z - 0.03 * from_start * from_start;
}

}  // namespace

Mesh terrain() {
    constexpr std::uint32_t kCells = 200, kSide = kCells + 1;
    constexpr double kTrail = 0.009;  // Half its width.
    const Noise knolls(11), stones(12), moss(13), grain(14);
    Mesh mesh;
    for (std::uint32_t i = 0; i < kSide; ++i)
        for (std::uint32_t j = 0; j < kSide; ++j) {
            const double x = static_cast<double>(j) / kCells - .5, z = static_cast<double>(i) / kCells - .5;
            const double beside = std::abs(besideTrail(x, z));
            // 0 on the trail, 1 in the wood.
            const double wild = std::clamp((beside - 0.6 * kTrail) / (0.9 * kTrail), 0.0, 1.0);
            const double far = std::max(0.0, z - 0.05);
            const double height = 0.012 * knolls.at(8 * x + 20, 8 * z + 20) + 0.35 * far * far +
                                  wild * (0.0016 + 0.0015 * stones.at(45 * x, 45 * z));
            mesh.positions.push_back({x, height, z});
            const double green = std::clamp(
                0.55 + 0.5 * moss.at(30 * x, 30 * z) + 0.6 * grain.at(150 * x, 150 * z), 0.0, 1.0);
            const double shade = 1 + 0.16 * grain.at(190 * x + 7, 190 * z + 3);
            const Vec litter{106, 90, 64}, mossy{82, 90, 46}, sand{150, 132, 106};
            const Vec color = shade * mix(sand, mix(litter, mossy, green), wild);
            mesh.colors.push_back({});
            for (std::size_t k = 0; k < 3; ++k)
                mesh.colors.back()[k] = static_cast<std::uint8_t>(std::clamp(std::lround(k == 0   ? color.x
                                                                                         : k == 1 ? color.y
                                                                                                  : color.z),
                                                                             0l, 255l));
        }
    for (std::uint32_t i = 0; i < kCells; ++i)
        for (std::uint32_t j = 0; j < kCells; ++j) {
            const std::uint32_t v = i * kSide + j;
            mesh.triangles.push_back({v, v + kSide, v + 1});
            mesh.triangles.push_back({v + 1, v + kSide, v + kSide + 1});
        }
    addNormals(mesh);
    // Height 0 where the trail begins.
    const double ground = mesh.positions[kCells / 2].y;
    for (Vec& p : mesh.positions) p.y -= ground;
    return mesh;
}

}  // namespace crt::meshgen
