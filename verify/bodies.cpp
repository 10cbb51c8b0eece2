// Group G, the part about bodies of glass: bodies inside others, and holes in their surface.
#include "base/vec3d.h"
#include "verify/context.h"
#include "verify/references.h"
#include "verify/scenes.h"

#include "kernel/dialect/features.h"

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace crt::verify {
namespace {

/// A box of index 1, 20 wide, between two heights.
struct Layer {
    double from, to, sigma;
};

/// The boxes around the axis z, seen along it from a height, in light of radiance 1. `share` as of objects:
/// the boxes are then one of height 1, stretched and moved.
std::string layers(const std::vector<Layer>& all, double eye, double towards, const char* share = nullptr) {
    std::string text = fmt::format(
        "crt: 1\ncamera: {{position: [0.1, 0.2, {}], target: [0.1, 0.2, {}], up: [0, 1, 0], fov: 0.001}}\n"
        "film: {{resolution: [4, 4]}}\nintegrator: {{max_depth: 64, roulette: false}}\n"
        "environment: {{radiance: 1}}\n",
        eye, eye + towards);
    if (all.empty()) return text;
    text += "materials:\n";
    for (std::size_t i = 0; i < all.size(); ++i)
        text += fmt::format("  m{}: {{type: dielectric, ior: 1, absorption: {}}}\n", i, all[i].sigma);
    text += "objects:\n";
    for (std::size_t i = 0; i < all.size(); ++i) {
        const double z0 = share ? 0 : all[i].from, z1 = share ? 1 : all[i].to;
        text += fmt::format(
            "  - {{mesh: {{positions: [[-10,-10,{0}],[10,-10,{0}],[-10,10,{0}],[10,10,{0}],[-10,-10,{1}],"
            "[10,-10,{1}],[-10,10,{1}],[10,10,{1}]], faces: "
            "[[0,2,3,1],[4,5,7,6],[0,1,5,4],[2,6,7,3],[0,4,6,2],[1,3,7,5]]}}, material: m{2}",
            z0, z1, i);
        if (share)
            text +=
                fmt::format(", share: {}, transforms: [[{{scale: [1, 1, {}]}}, {{translate: [0, 0, {}]}}]]",
                            share, all[i].to - all[i].from, all[i].from);
        text += "}\n";
    }
    return text;
}

void seenThroughLayers(Context& context) {
    const double white = radiance(context.render(layers({}, 20, -1)));
    struct Sight {
        const char* name;
        std::vector<Layer> all;
        double eye, towards, depth;  ///< Σ σ d on the way.
        double mistaken;             ///< If the path forgets the outer medium behind an inner body.
    };
    const std::vector<Layer> panes{{-5, 5, 0.26}, {-3, -2.5, 0}, {1, 1.5, 0}};
    const std::vector<Layer> nested{{-5, 5, 0.1}, {-3, 3, 0.4}, {-1, 1, 1.1}};
    const std::vector<Layer> overlapping{{-3, 1, 0.2}, {-1, 4, 0.5}};
    const std::vector<Layer> touching{{-3, 0, 0.2}, {0, 4, 0.5}}, touching_too{{0, 4, 0.5}, {-3, 0, 0.2}};
    const std::vector<Layer> on_its_floor{{-5, 5, 0.1}, {-5, -2, 0.7}},
        floor_first{{-5, -2, 0.7}, {-5, 5, 0.1}};
    constexpr double kBlack = 1000;
    for (const Sight& it :
         {Sight{"two clear panes in water", panes, 20, -1, 0.26 * 9, 0.26 * 5.5},
          {"from between the panes", panes, 0, -1, 0.26 * 4.5, 0.26 * 2},
          {"from inside a pane", panes, 1.25, -1, 0.26 * 5.5, 0.26 * 2},
          {"three bodies, from outside", nested, 20, -1, 0.4 + 1.6 + 2.2, 0.2 + 0.8 + 2.2},
          {"from inside the first", nested, 4, -1, 0.3 + 1.6 + 2.2, 0.2 + 0.8 + 2.2},
          {"from inside the second, the other way", nested, -2, 1, 0.2 + 1.2 + 2.2, 0.2 + 0.8 + 2.2},
          {"from inside the third", nested, 0.5, -1, 0.2 + 0.8 + 1.65, 0.2 + 0.8 + 1.65},
          // Where two overlap, that which light entered last counts.
          {"two that overlap", overlapping, 20, -1, 0.5 * 3 + 0.2 * 4, 0.5 * 5 + 0.2 * 2},
          {"two that overlap, the other way", overlapping, -20, 1, 0.2 * 2 + 0.5 * 5, 0.2 * 4 + 0.5 * 3},
          // Of two surfaces in one place a ray meets either: the one of the lower number.
          {"two that touch", touching, 20, -1, 2 + 0.6, kBlack},
          {"two that touch, the other way", touching, -20, 1, 2 + 0.6, kBlack},
          {"two that touch, in the other order", touching_too, 20, -1, 2 + 0.6, kBlack},
          {"two that touch, in the other order and the other way", touching_too, -20, 1, 2 + 0.6, kBlack},
          {"one on the floor of another", on_its_floor, 20, -1, 0.7 + 2.1, kBlack},
          {"one on the floor of another, the other way", on_its_floor, -20, 1, 0.7 + 2.1, kBlack},
          {"one on the floor of another, in the other order", floor_first, 20, -1, 0.7 + 2.1, kBlack},
          {"one on the floor of another, both the other way", floor_first, -20, 1, 0.7 + 2.1, kBlack}})
        for (const char* share : {static_cast<const char*>(nullptr), "always"}) {
            if (share && it.all.size() == 2) continue;
            context.relative(fmt::format("{}{}", it.name, share ? ", instances" : ""),
                             radiance(context.render(layers(it.all, it.eye, it.towards, share))) / white,
                             std::exp(-it.depth), 1e-5,
                             {{std::exp(-it.mistaken), "behind an inner body the outer one is forgotten"},
                              {1, "nothing is absorbed"}});
        }
    // Sixteen, one inside another, of three kinds in turn.
    std::vector<Layer> many;
    double depth = 0;
    for (int i = 0; i < 16; ++i) {
        many.push_back({-17.0 + i, 17.0 - i, 0.02 * (1 + i % 3)});
        depth += (i < 15 ? 2 : 4) * many.back().sigma;
    }
    context.relative("sixteen bodies of three kinds", radiance(context.render(layers(many, 30, -1))) / white,
                     std::exp(-depth), 1e-5);
}

constexpr double kSigma = 0.7;

/// Everything in a ball of water: a floor in the middle, the camera 0.5 above it, and a ball that shines
/// inwards, of radius 1, or lights. `clear`: the radius of a clear ball in the water, around the floor.
std::string underWater(double sigma, const char* integrator, const char* light, double clear) {
    std::string text = fmt::format(
        "crt: 1\ncamera: {{position: [0, 0.5, 0], target: [0, 0, 0], up: [0, 0, 1], fov: 0.001}}\n"
        "film: {{resolution: [4, 4]}}\nintegrator: {}\nmaterials:\n"
        "  water: {{type: dielectric, ior: 1, absorption: {}}}\n  clear: {{type: dielectric, ior: 1}}\n"
        "  white: {{type: diffuse, reflectance: 1}}\n  black: {{type: diffuse, reflectance: 0}}\n"
        "{}objects:\n  - {{sphere: {{radius: 3}}, material: water}}\n"
        "  - {{mesh: {{positions: [[-.01,0,-.01],[-.01,0,.01],[.01,0,.01],[.01,0,-.01]], faces: "
        "[[0,1,2,3]]}}, "
        "material: white}}\n",
        integrator, sigma, light[0] == '[' ? fmt::format("lights: {}\n", light) : "");
    if (light[0] != '[')
        text += fmt::format(
            "  - {{sphere: {{radius: 1, inward: true}}, material: black, emission: {{radiance: "
            "{}}}}}\n",
            light);
    if (clear > 0) text += fmt::format("  - {{sphere: {{radius: {}}}, material: clear}}\n", clear);
    return text;
}

void everythingUnderWater(Context& context) {
    const Effort effort{.samples = 64, .most = 4096};
    const auto ratio = [](const std::vector<Film>& f) { return radiance(f[0]) / radiance(f[1]); };
    const auto ask = [&](const std::string& what, const std::string& integrator, const char* light,
                         double clear, double length, double mistaken) {
        context.estimate(what,
                         {underWater(kSigma, integrator.c_str(), light, clear),
                          underWater(0, integrator.c_str(), light, clear)},
                         ratio, std::exp(-kSigma * length), 0.002, effort,
                         {{1, "a path that starts in water does not know it"},
                          {std::exp(-kSigma * mistaken), "behind the clear ball the water is forgotten"}});
    };
    for (const auto& [technique, integrator] :
         {std::pair{"MIS", "{max_depth: 4, roulette: false}"},
          {"scattered rays", "{max_depth: 4, roulette: false, nee: false}"},
          {"light sampling", "{max_depth: 4, roulette: false, mis: false}"}}) {
        ask(fmt::format("camera, floor and lamp under water, {}", technique), integrator, "1", 0, 1.5, 1);
        ask(fmt::format("the floor in a clear ball in the water, {}", technique), integrator, "1", 0.3, 0.9,
            0.2);
    }
    for (const char* light : {"[{type: point, position: [0, 0.8, 0.6], radiant_intensity: 1}]",
                              "[{type: spot, position: [0, 0.8, 0.6], target: [0, 0, 0], cone_angle_deg: "
                              "40, radiant_intensity: 1}]"})
        ask(fmt::format("camera, floor and {:.12} under water", light), "{max_depth: 4}", light, 0, 1.5, 1);
}

void nestedBodies(Context& context) {
    seenThroughLayers(context);
    everythingUnderWater(context);
}

/// A slab or a ball of glass with holes, in light of radiance 1 from everywhere or from one lamp behind.
std::string withHoles(const std::string& material, const char* body, const std::string& light,
                      double slant = 0) {
    return fmt::format(
        "crt: 1\ncamera: {{position: [{}, 0.2, 5], target: [0, 0, 0], fov: 0.001}}\n"
        "film: {{resolution: [4, 4]}}\nintegrator: {{max_depth: 1000, roulette: false}}\n{}\nmaterials:\n"
        "  white: {{type: diffuse, reflectance: 1}}\n  black: {{type: diffuse, reflectance: 0}}\n"
        "  clear: {{type: dielectric, ior: 1.5}}\n  it: {{{}}}\nobjects:\n  - {{{}, material: it}}\n",
        slant, light, material, body);
}

void glassWithHoles(Context& context) {
    constexpr const char* slab =
        "mesh: {positions: [[-9,-9,-.5],[9,-9,-.5],[-9,9,-.5],[9,9,-.5],[-9,-9,.5],[9,-9,.5],[-9,9,.5],[9,9,"
        ".5]], faces: [[0,2,3,1],[4,5,7,6],[0,1,5,4],[2,6,7,3],[0,4,6,2],[1,3,7,5]]}";
    constexpr const char* ball = "sphere: {radius: 1.5}";
    const Effort effort{.samples = 64, .most = 16384};
    for (const char* body : {slab, ball})
        for (const double ior : {1.5, 2.0})
            for (const double opacity : {0.0, 0.3, 0.9})
                for (const char* kind : {"type: dielectric", "type: rough_dielectric, roughness: 0.4"}) {
                    if (kind[6] == 'r' && opacity != 0.3 && !context.atLeast(Level::Merge)) continue;
                    context.estimate(
                        fmt::format("{} of {{{}}}, index {}, opacity {}", body == slab ? "slab" : "ball",
                                    kind, ior, opacity),
                        withHoles(fmt::format("{}, ior: {}, opacity: {}", kind, ior, opacity), body,
                                  "environment: {radiance: 1}", 2),
                        meanRadiance, 1, 0.003, effort,
                        {{opacity + (1 - opacity) * ior * ior,
                        "what comes in by a hole goes out with n²"}});
                }
    context.estimate("a mix of glass and white, opacity .4",
                     withHoles("type: mix, materials: [clear, white], amount: 0.3, opacity: 0.4", ball,
                               "environment: {radiance: 1}"),
                     meanRadiance, 1, 0.003, effort);
    // Straight on, a lamp behind: what the holes let through, and what a whole slab does of the rest.
    const double r = fresnelDielectric(1, 1.5);
    for (const double opacity : {0.0, 0.4, 1.0})
        context.estimate(
            fmt::format("a lamp behind a slab of opacity {}", opacity),
            withHoles(fmt::format("type: dielectric, ior: 1.5, opacity: {}", opacity), slab, "") +
                "  - {mesh: {positions: [[-9,-9,-3],[9,-9,-3],[9,9,-3],[-9,9,-3]], faces: [[0,1,2,3]]}, "
                "material: black, emission: {radiance: 1}}\n",
            meanRadiance, 1 - opacity + opacity * (1 - r) / (1 + r), 0.003, effort,
            {{(1 - opacity) * (1 - opacity) + opacity * (1 - opacity) * (1 - r) * (2.25 + 1 / 2.25),
              "a hole is one in a face, not in the body"}});
    // Light of a point passes both faces of a slab by one hole, to a floor and back to the camera.
    context.estimate(
        "a point over a floor under a slab of opacity .4: over none",
        [&] {
            std::vector<std::string> scenes;
            for (const char* opacity : {"0.4", "0"})
                scenes.push_back(
                    withHoles(fmt::format("type: dielectric, ior: 1.5, opacity: {}", opacity), slab,
                              "lights: [{type: point, position: [0, 0, 4], radiant_intensity: 1}]") +
                    "  - {mesh: {positions: [[-.05,-.17,-3],[.05,-.17,-3],[.05,-.07,-3],[-.05,-.07,"
                    "-3]], "
                    "faces: [[0,1,2,3]]}, material: white}\n");
            return scenes;
        }(),
        [](const std::vector<Film>& f) { return radiance(f[0]) / radiance(f[1]); },
        0.6 * (0.6 + 0.4 * (1 - r) / (1 + r)), 0.02, {.samples = 256, .most = 65536},
        {{0.36 * (0.6 + 0.4 * (1 - r) / (1 + r)), "shadow rays ask at both faces"}});
}

}  // namespace

std::vector<Case> bodyCases() {
    constexpr std::uint64_t all = CRT_FEATURE_DIFFUSE | CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_AREA_LIGHT |
                                  CRT_FEATURE_NEE | CRT_FEATURE_DIELECTRIC | CRT_FEATURE_MEDIA |
                                  CRT_FEATURE_POINT_LIGHT | CRT_FEATURE_SHAPES;
    return {
        row("G50", "nested-bodies",
            "Absorbing bodies inside one another and overlapping, and instances of them, seen through from "
            "outside and from inside each; a floor under water, with the camera, lamps and lights there, "
            "too",
            "exp(−Σ σ d)", "Beer and Lambert", "± 1e-5; ± 0.2 %", Level::Commit,
            all | CRT_FEATURE_INSTANCES,
            nestedBodies),
        row("G51", "glass-with-holes",
            "Slabs and balls of glass, smooth and rough, with an opacity, in light from everywhere; before "
            "a "
            "lamp, and over a floor under a point",
            "1; 1 − a + a (1 − R)/(1 + R)", "conservation of energy; geometric series",
            "± 0.3 %; ± 2 %",
            Level::Commit, all | CRT_FEATURE_ROUGH_DIELECTRIC | CRT_FEATURE_OPACITY | CRT_FEATURE_MIX,
            glassWithHoles),
    };
}

}  // namespace crt::verify
