// Group N: questions that were written because a planted fault (tests/mutations) would otherwise have gone
// unnoticed. Small scenes, each sharp against one mistake.
#include "verify/context.h"
#include "verify/references.h"
#include "verify/scenes.h"

#include "kernel/dialect/features.h"
#include "spectra/spectra.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <set>
#include <string>
#include <tuple>
#include <utility>

namespace crt::verify {
namespace {

/// Every pixel of `film` is `factor` times that of `unit`. Both have the same random numbers, so that the
/// wavelengths cancel.
void everyPixel(Context& context, const std::string& what, const Film& film, const Film& unit, double factor,
                double tolerance, const std::vector<Mistake>& mistakes) {
    context.relative(what + ": the worst pixel", factor * worstRatio(film, unit, factor), factor, tolerance,
                     mistakes);
}

/// Nothing but an environment of radiance 1.
const std::string kEnvironment = "crt: 1\nfilm: {resolution: [4, 4]}\nenvironment: {radiance: 1}\n";

void roulette(Context& context) {
    Cube cube;
    cube.reflectance = "0.8";
    cube.integrator = "{max_depth: 200, roulette_depth: 1, nee: false}";
    context.estimate("albedo 0.8, roulette from the first event on", yaml(cube), meanRadiance,
                     furnaceRadiance(0.8, 200), 0.01, {.samples = 1024, .most = 16384},
                     {{1 / (1 - 0.64),
                       "survivors of roulette do not carry the light of those that it ended: is the "
                       "division by the probability missing?"}});
}

void rouletteLongPaths(Context& context) {
    Cube cube;
    cube.reflectance = "0.999";
    cube.integrator = "{max_depth: 100000, roulette_depth: 4, nee: false}";
    context.estimate("albedo 0.999: paths of a thousand events", yaml(cube), meanRadiance, 1000, 0.1,
                     {.samples = 16, .most = 64});
}

void insideGlass(Context& context) {
    // Light carries n² when it leaves, however often it was reflected inside: in a uniform world the
    // radiance in glass is n² in all directions.
    const auto scene = [](double index) {
        return fmt::format(R"(crt: 1
camera: {{position: [0, 0, 0], target: [0, 0, 1], fov: 20}}
film: {{resolution: [4, 4]}}
integrator: {{max_depth: 64, roulette: false}}
environment: {{radiance: 1}}
materials: {{glass: {{type: dielectric, ior: {}}}}}
objects:
  - mesh:
      positions: [[-1,-1,-1],[1,-1,-1],[1,1,-1],[-1,1,-1],[-1,-1,1],[1,-1,1],[1,1,1],[-1,1,1]]
      faces: [[0,3,2,1],[4,5,6,7],[0,1,5,4],[2,3,7,6],[0,4,7,3],[1,2,6,5]]
    material: glass
)",
                           index);
    };
    const Film outside = context.render(kEnvironment);
    for (const double n : {1.5, 2.4})
        everyPixel(context, fmt::format("index {}", n), context.render(scene(n)), outside, n * n, 1e-5,
                   {{1, "radiance is not scaled by n² when it is refracted"},
                    {std::pow(n, 4), "radiance is scaled by n² twice"},
                    {std::pow(n, -2),
                     "radiance is scaled by 1/n² where n² belongs: is the relative index upside down?"}});
}

/// A surface of `material` in the plane y = 0, seen under 60° in a world of radiance 1, and a black one
/// beneath it.
std::string underSixtyDegrees(const std::string& material) {
    return fmt::format(R"(crt: 1
camera: {{position: [0, 1, {}], target: [0, 0, 0], fov: 1e-4}}
film: {{resolution: [4, 4]}}
environment: {{radiance: 1}}
materials: {{seen: {}, black: {{type: diffuse, reflectance: 0}}}}
objects:
  - {{mesh: {{positions: [[-9,0,-9],[-9,0,9],[9,0,9],[9,0,-9]], faces: [[0,1,2,3]]}}, material: seen}}
  - {{mesh: {{positions: [[-99,-1,-99],[-99,-1,99],[99,-1,99],[99,-1,-99]], faces: [[0,1,2,3]]}},
      material: black}}
)",
                       -std::numbers::sqrt3, material);
}

void fresnel(Context& context) {
    constexpr double kCosine = 0.5;
    const double index = 1.5;
    const double cos_t = std::sqrt(1 - (1 - kCosine * kCosine) / (index * index));
    const double rs = std::pow((kCosine - index * cos_t) / (kCosine + index * cos_t), 2),
                 rp = std::pow((index * kCosine - cos_t) / (index * kCosine + cos_t), 2);
    const std::vector<Mistake> one{{rs, "only the perpendicular polarisation is there"},
                                   {rp, "only the parallel polarisation is there"}};
    context.estimate("glass of index 1.5 under 60°", underSixtyDegrees("{type: dielectric, ior: 1.5}"),
                     meanRadiance, fresnelDielectric(kCosine, index), 0.02, {.samples = 512, .most = 16384},
                     one);

    // Fresnel's equations for a complex index, in complex arithmetic.
    const std::complex<double> m(1.5, 2.0), c = std::sqrt(m * m - (1 - kCosine * kCosine));
    const double metal_s = std::norm((kCosine - c) / (kCosine + c)),
                 metal_p = std::norm((m * m * kCosine - c) / (m * m * kCosine + c));
    everyPixel(context, "metal of index 1.5 + 2i under 60°",
               context.render(underSixtyDegrees("{type: conductor, eta: 1.5, k: 2}")),
               context.render(kEnvironment), (metal_s + metal_p) / 2, 1e-5,
               {{metal_s, "only the perpendicular polarisation is there"},
                {metal_p, "only the parallel polarisation is there"}});
}

void colour(Context& context) {
    // A box whose walls glow in a band about 570 nm and reflect more of the long wavelengths: E(λ) (1 +
    // ρ(λ)) at depth 1, by whichever way light is found.
    const std::string band = "{table: {nm: [540, 550, 590, 600], value: [0, 1, 1, 0]}, outside: zero}";
    const std::string slope = "{table: {nm: [360, 830], value: [0.1, 0.9]}}";
    Spectrum expected{};
    for (std::size_t i = 0; i < expected.values.size(); ++i) {
        const double nm = kWavelengthMin_nm + static_cast<double>(i);
        const double e = std::clamp(std::min((nm - 540) / 10, (600 - nm) / 10), 0.0, 1.0),
                     rho = 0.1 + 0.8 * static_cast<double>(i) / (kSpectrumSize - 1);
        expected[i] = e * (1 + rho);
    }
    const Vec3d xyz = spectrumToXyz(expected);
    for (const bool nee : {false, true}) {
        Cube cube;
        cube.reflectance = slope;
        cube.radiance = band;
        cube.integrator = fmt::format("{{max_depth: 1, roulette: false, nee: {}}}", nee);
        std::vector<Quantity> quantities;
        for (std::size_t c = 0; c < 3; ++c)
            quantities.push_back({fmt::format("{} {} light sampling", "XYZ"[c], nee ? "with" : "without"),
                                  [c](const std::vector<Film>& f) { return meanXyz(f.front())[c]; },
                                  xyz[c]});
        context.estimate(quantities, {yaml(cube)}, 0.01, {.samples = 256, .most = 4096});
    }
}

void lastNanometre(Context& context) {
    // Radiance rises from 0 at 829 to 1 at 830 nm. The observer is linear in between: ∫ t (a + (b − a)
    // t) dt = (a + 2b) / 6.
    const double a = cieObserver()[0][kSpectrumSize - 2], b = cieObserver()[0][kSpectrumSize - 1];
    context.estimate("X of light between 829 and 830 nm",
                     "crt: 1\nfilm: {resolution: [32, 32]}\nenvironment: {radiance: {table: {nm: [829, "
                     "830], value: [0, 1]}, outside: zero}}\n",
                     [](const Film& f) { return meanXyz(f)[0]; }, (a + 2 * b) / 6 / cieYIntegral(), 0.5,
                     {.samples = 1024, .most = 4096, .seeds = 8},
                     {{0, "the last nanometre of the spectrum is lost"}});
}

void pixelsDiffer(Context& context) {
    const Film film =
        context.render("crt: 1\nfilm: {resolution: [32, 32]}\nenvironment: {radiance: 1}\n", {.samples = 1});
    std::set<double> values;
    for (std::uint32_t y = 0; y < 32; ++y)
        for (std::uint32_t x = 0; x < 32; ++x) values.insert(film.mean(x, y, 0));
    // 2^23 possible numbers: one or two pairs of 1024 pixels may coincide.
    context.holds("one sample of each of 32 x 32 pixels: the values differ", values.size() >= 1000,
                  "at least 1000 of 1024 values differ",
                  "pixels share their random numbers: does the seed leave out a coordinate?",
                  fmt::format("{} values", values.size()));
}

void filmSums(Context& context) {
    constexpr std::uint64_t kSamples = 1 << 20, kParts = 64;
    const std::string scene = "crt: 1\nfilm: {resolution: [2, 1]}\nenvironment: {radiance: 1}\n";
    const Film whole = context.render(scene, {.samples = kSamples});
    Film sum = context.render(scene, {.samples = kSamples / kParts});
    for (std::uint64_t i = 1; i < kParts; ++i)
        sum.add(
            context.render(scene, {.samples = kSamples / kParts, .first_sample = i * (kSamples / kParts)}));
    for (std::uint32_t c = 0; c < 4; ++c)
        context.relative(fmt::format("channel {} of 2^20 samples, and of their 64 parts", c),
                         whole.sum(0, 0, c), sum.sum(0, 0, c), 1e-14,
                         {{sum.sum(0, 0, c) * (1 + 1e-5),
                           "the film loses digits while it adds: is it single precision?"}});
}

void beyondTwoToThe32(Context& context) {
    const std::string scene = "crt: 1\nfilm: {resolution: [4, 4]}\nenvironment: {radiance: 1}\n";
    constexpr std::uint64_t k2To32 = std::uint64_t{1} << 32;
    const Film first = context.render(scene, {.samples = 8}),
               beyond = context.render(scene, {.samples = 8, .first_sample = k2To32});
    int same = 0;
    for (std::uint32_t y = 0; y < 4; ++y)
        for (std::uint32_t x = 0; x < 4; ++x) same += first.mean(x, y, 0) == beyond.mean(x, y, 0);
    context.holds("samples 2^32 to 2^32 + 7 are not samples 0 to 7 again", same == 0, "no pixel the same",
                  "the index of a sample is cut to 32 bits", fmt::format("{} of 16 pixels the same", same));
    Film parts = context.render(scene, {.samples = 8, .first_sample = k2To32 - 8});
    parts.add(beyond);
    context.sameBits("a range across 2^32 is its two halves",
                     context.render(scene, {.samples = 16, .first_sample = k2To32 - 8}), parts,
                     "the index of a sample is cut to 32 bits");
}

/// A lamp in the plane z = 1, seen along z from (x, y), 5e-6 inside an edge: rays run 5e-6 within the box's
/// side, parallel to it within 1e-6.
void grazeBox(Context& context, const char* accelerator, const char* edge, double x, double y) {
    const Film film = context.render(fmt::format(R"(crt: 1
camera: {{position: [{0}, {1}, -1], target: [{0}, {1}, 1], fov: 5e-5}}
film: {{resolution: [8, 8]}}
integrator: {{accelerator: {2}, max_depth: 0}}
materials: {{black: {{type: diffuse, reflectance: 0}}}}
objects:
  - {{mesh: {{positions: [[-1,-1,1],[-1,1,1],[1,1,1],[1,-1,1]], faces: [[0,1,2,3]]}},
      material: black, emission: {{radiance: 1}}}}
)",
                                                 x, y, accelerator));
    std::uint32_t missed = 0;
    for (std::uint32_t v = 0; v < 8; ++v)
        for (std::uint32_t u = 0; u < 8; ++u) missed += film.mean(u, v, 1) > 0.9 ? 0 : 1;
    context.holds(
        fmt::format("parallel to a box ({}) within 1e-6, 5e-6 inside its {} side", accelerator, edge),
        missed == 0, "every pixel is lit",
        "rays that run along a box's side are lost: is the reciprocal of the direction clamped?",
        fmt::format("{} of 64 pixels dark or dim", missed));
}

void grazingBoxes(Context& context) {
    // The boxes of a tree and those of objects each take the reciprocal of a direction in their own way.
    for (const char* accelerator : {"bvh", "aabb"}) {
        grazeBox(context, accelerator, "right", 1 - 5e-6, 0.1);
        grazeBox(context, accelerator, "left", -1 + 5e-6, 0.1);
        grazeBox(context, accelerator, "upper", 0.1, 1 - 5e-6);
        grazeBox(context, accelerator, "lower", 0.1, -1 + 5e-6);
    }
}

void indexMatchedGlass(Context& context) {
    context.estimate(
        "floor below the square light, a plate of index 1 between them", R"(crt: 1
camera: {position: [0, 0.25, 3], target: [0, 0, 0], fov: 0.01}
film: {resolution: [4, 4]}
integrator: {max_depth: 4, roulette: false}
materials: {floor: {type: diffuse, reflectance: 1},
    lamp: {type: diffuse, reflectance: 0}, air: {type: dielectric, ior: 1}}
objects:
  - {mesh: {positions: [[-40,0,-40],[-40,0,40],[40,0,40],[40,0,-40]], faces: [[0,1,2,3]]}, material: floor}
  - {mesh: {positions: [[-2,0.5,-2],[-2,0.5,2],[2,0.5,2],[2,0.5,-2]], faces: [[0,1,2,3]]}, material: air}
  - {mesh: {positions: [[-0.5,1,-0.5],[0.5,1,-0.5],[0.5,1,0.5],[-0.5,1,0.5]], faces: [[0,1,2,3]]},
      material: lamp, emission: {radiance: 1}}
)",
        meanRadiance, squareFormFactor(0, 0.5), 0.02, {.samples = 256, .most = 16384},
        {{2 * squareFormFactor(0, 0.5),
          "light is found twice: straight through glass by light sampling, and by paths through it"},
         {0, "light does not come through glass"}});
}

void bright(Context& context) {
    Cube cube;
    cube.integrator = "{max_depth: 2, roulette: false, nee: true}";
    const Film unit = context.render(yaml(cube));
    for (const int exponent : {-20, 10, 20, 60}) {
        cube.radiance = fmt::format("{:.17g}", std::ldexp(1.0, exponent));
        const Film film = context.render(yaml(cube));
        everyPixel(context, fmt::format("walls of radiance 2^{}", exponent), film, unit,
                   std::ldexp(1.0, exponent), 1e-12, {{0, "what is bright is cut off: is there a clamp?"}});
    }
}

void overflowIsCounted(Context& context) {
    // Scene files are refused such a sky (scene_limits.h).
    Scene scene = context.scene("crt: 1\nfilm: {resolution: [4, 4]}\nenvironment: {radiance: 1}\n");
    scene.environment->radiance = constantSpectrum(3e38);
    const Film film = context.renderRaw(scene, {});
    context.holds(
        "radiance 3e38 times the width of the spectrum is beyond "
        "a float: every sample is dropped and counted",
        film.invalidSamples() == 16 * 16, "256 samples",
        "samples that are no numbers are taken for black, or for bright, without a warning",
        fmt::format("{} of 256 samples counted as invalid", film.invalidSamples()));
    double largest = 0;
    for (const double sum : film.sums) largest = fartherFrom(0, largest, sum);
    context.holds("and nothing of them is in the film", largest == 0, "exactly 0",
                  "the film holds a part of samples that it counts as dropped");
}

}  // namespace

std::vector<Case> mutantCases() {
    return {
        {.id = "N01",
         .name = "roulette",
         .title = "A closed box whose walls emit 1 and reflect 0.8, with roulette after the first event",
         .expected = "E (1 − ρ^(k+1)) / (1 − ρ)",
         .source = "geometric series",
         .tolerance = "± 1 %",
         .needs = CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT,
         .run = roulette},
        {.id = "N02",
         .name = "roulette-long-paths",
         .title = "The same with 0.999: roulette must let paths of a thousand events live",
         .expected = "1000",
         .source = "geometric series",
         .tolerance = "± 10 %",
         .needs = CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT,
         .run = rouletteLongPaths},
        {.id = "N03",
         .name = "inside-glass",
         .title = "Camera within a glass cube in a world of radiance 1",
         .expected = "n² in every pixel",
         .source = "conservation of basic radiance L/n²",
         .tolerance = "1e-5: every path brings the same",
         .needs = CRT_FEATURE_DIELECTRIC | CRT_FEATURE_ENVIRONMENT,
         .run = insideGlass},
        {.id = "N04",
         .name = "fresnel",
         .title = "Glass and metal under 60° in a world of radiance 1",
         .expected = "the mean of both polarisations' reflectance",
         .source = "Fresnel's equations, in complex arithmetic",
         .tolerance = "± 2 % for glass, 1e-5 for metal",
         .needs = CRT_FEATURE_DIELECTRIC | CRT_FEATURE_CONDUCTOR | CRT_FEATURE_ENVIRONMENT,
         .run = fresnel},
        {.id = "N05",
         .name = "colour",
         .title = "A box whose walls glow in a band and reflect along a slope, depth 1",
         .expected = "XYZ of E(λ) (1 + ρ(λ))",
         .source = "sum over the CIE 1931 table",
         .tolerance = "± 1 % in each of X, Y and Z",
         .needs = CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT,
         .run = colour},
        {.id = "N06",
         .name = "last-nanometre",
         .title = "A world that shines between 829 and 830 nm",
         .expected = "(x̄(829) + 2x̄(830)) / 6",
         .source = "integral of the product of two straight lines",
         .tolerance = "± 50 %: one path in thirty thousand has such a wavelength",
         .needs = CRT_FEATURE_ENVIRONMENT,
         .run = lastNanometre},
        {.id = "N07",
         .name = "pixels-differ",
         .title = "One sample of each pixel in a uniform world",
         .expected = "no two the same",
         .source = "a birthday in 2^23",
         .tolerance = "24 of 1024",
         .needs = CRT_FEATURE_ENVIRONMENT,
         .run = pixelsDiffer},
        {.id = "N08",
         .name = "film-sums",
         .title = "2^20 samples at once, and in 64 parts",
         .expected = "the same sums",
         .source = "addition",
         .tolerance = "1e-14",
         .needs = CRT_FEATURE_ENVIRONMENT,
         .run = filmSums},
        {.id = "N09",
         .name = "beyond-2-32",
         .title = "Samples beyond the four thousand millionth",
         .expected = "separate samples",
         .source = "an index has 64 bits",
         .tolerance = "exactly",
         .needs = CRT_FEATURE_ENVIRONMENT,
         .run = beyondTwoToThe32},
        {.id = "N10",
         .name = "grazing-boxes",
         .title = "Rays 5e-6 inside a box's side and parallel to it within 1e-6",
         .expected = "the lamp at its end",
         .source = "geometry",
         .tolerance = "every pixel",
         .needs = CRT_FEATURE_AREA_LIGHT,
         .run = grazingBoxes},
        {.id = "N11",
         .name = "index-matched-glass",
         .title = "A plate of index 1 between lamp and floor",
         .expected = "the form factor, as without the plate",
         .source = "rectangle formula (Howell B-3)",
         .tolerance = "± 2 %",
         .needs = CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_DIELECTRIC,
         .run = indexMatchedGlass},
        {.id = "N12",
         .name = "bright",
         .title = "Walls of radiance 2^-20 to 2^60",
         .expected = "the image of radiance 1, times as much",
         .source = "light is linear",
         .tolerance = "1e-12",
         .needs = CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE,
         .run = bright},
        {.id = "N13",
         .name = "overflow-is-counted",
         .title = "Radiance beyond what a float holds",
         .expected = "samples dropped and counted",
         .source = "docs/architecture.md, Film",
         .tolerance = "exactly",
         .needs = CRT_FEATURE_ENVIRONMENT,
         .run = overflowIsCounted},
    };
}

}  // namespace crt::verify
