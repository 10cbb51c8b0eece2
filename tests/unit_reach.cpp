// A shadow ray ends before the light that it goes to, however small and far the light is, and meets what is
// in front of it.
#include "captured_log.h"
#include "kernel/lights/shape_light.h"
#include "kernel_test.h"
#include "scene/yaml/scene_yaml.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

using namespace kernel_test;
using crt::Vec3d;

namespace {

const char* const kLights[] = {
    "mesh: {positions: [[-1, 0, -1], [-1, 0, 1], [1, 0, 1], [1, 0, -1]], faces: [[0, 1, 2, 3]]}",
    "mesh: {positions: [[-1, 0, -1], [0, 0, 1], [1, 0.5, -0.5]], faces: [[0, 1, 2]]}",
    "sphere: {radius: 1}",
    "disk: {radius: 1}",
    "cylinder: {radius: 0.5, from_z: -1, to_z: 1}",
};

/// A light of half size `size`, turned at random, amid two triangles at the ends of a cube of edge 1.98: the
/// scene keeps its lengths when it is compiled.
crt::CompiledScene sceneWith(const std::string& light, double size, const Vec3d& at, Random& random) {
    const Vec3d axis = random.direction();
    const std::string text = fmt::format(
        R"(crt: 1
materials: {{m: {{type: diffuse, reflectance: 0}}}}
objects:
  - mesh: {{positions: [[-0.99, -0.99, -0.99], [-0.99, -0.99, -0.98], [-0.99, -0.98, -0.99],
                       [0.99, 0.99, 0.99], [0.99, 0.99, 0.98], [0.99, 0.98, 0.99]],
           faces: [[0, 1, 2], [3, 4, 5]]}}
    material: m
  - {}
    material: m
    transform:
      - {{rotate: {{axis: [{}, {}, {}], angle_deg: {}}}}}
      - {{scale: {}}}
      - {{translate: [{}, {}, {}]}}
    emission: {{radiance: 1}}
)",
        light, axis[0], axis[1], axis[2], random.uniform(0, 360), size, at[0], at[1], at[2]);
    const crt::test::CapturedLog quiet;
    return crt::compileScene(crt::parseScene(text, "test", ".", {}), 0);
}

/// The largest share of the part of the way that is left out, 1 − reach, that would not have been enough,
/// because of rounding.
double largestShare(const std::string& light, Random& random) {
    double share = 0;
    for (int scene = 0; scene < 240; ++scene) {
        // In the middle coordinates are small; elsewhere they are rounded, too.
        const bool middle = scene % 2 == 0;
        const double size = std::pow(10.0, random.uniform(-6, middle ? -0.3 : -1));
        const double away = middle ? 0 : std::pow(10.0, random.uniform(-4, -0.2));
        const Vec3d at = times(random.direction(), away);
        const crt::CompiledScene compiled = sceneWith(light, size, at, random);
        const CrtContext ctx = contextOf(compiled);
        REQUIRE(ctx.scene->depth_scale == 1);
        for (int ray = 0; ray < 500; ++ray) {
            const vec3 p =
                toFloat(plus(at, times(random.direction(), size * std::pow(10.0, random.uniform(-2, 6)))));
            if (std::max({crt_abs(p.x), crt_abs(p.y), crt_abs(p.z)}) > 0.99f) continue;
            CrtSampler sampler = crt_sampler_begin(CRT_SAMPLER_INDEPENDENT, 0,
                                                   crt_seed(1, static_cast<u32>(random.bits())), 2, 3);
            const u32 chosen = crt_light_choose(&ctx, &sampler, 0);
            const CrtLightSample to = crt_is_shape_light(&ctx, chosen)
                                          ? crt_shape_light_sample(&ctx, chosen, &sampler, 0, p)
                                          : crt_light_sample(&ctx, chosen, &sampler, 0, p);
            if (!(to.pdf > 0)) continue;
            const CrtHit hit = crt_brute_force_closest(&ctx, rayOf(p, to.point - p));
            if (hit.slot == CRT_NONE) continue;  // Past an edge.
            share = std::max(share, (1 - static_cast<double>(hit.t)) / (1 - static_cast<double>(to.reach)));
        }
    }
    return share;
}

}  // namespace

TEST_CASE("a shadow ray ends before the light that it goes to, with half of what it leaves out",
          "[kernel][rays]") {
    Random random(48);
    for (const char* light : kLights) {
        INFO(light);
        const double share = largestShare(light, random);
        CAPTURE(share);
        CHECK(share < 0.5);
        CHECK(share > 0);
    }
}

TEST_CASE("what lies at the end of a ray's reach is no hit, and what lies before it is", "[kernel][rays]") {
    Random random(49);
    for (const char* light : kLights) {
        INFO(light);
        const crt::CompiledScene compiled = sceneWith(light, 0.25, {}, random);
        const CrtContext ctx = contextOf(compiled);
        const vec3 o = toFloat({0.03, 0.05, 0.9}), d = make_vec3(0, 0, -1);
        const f32 t = crt_brute_force_closest(&ctx, rayOf(o, d)).t;
        REQUIRE(t < 1);
        for (const bool beyond : {false, true}) {
            const CrtRay ray = rayOf(o, d, beyond ? std::nextafter(t, 1.0f) : t);
            CrtPassable passable = crt_none_passable(ray.reach);
            CHECK((crt_brute_force_closest(&ctx, ray).slot != CRT_NONE) == beyond);
            CHECK((crt_brute_force_any(&ctx, ray, &passable) != 0) == beyond);
        }
    }
}
