// The tree of lights: what its nodes hold, and that from any point every light that lights it can be chosen,
// with the probability that the density of a ray that meets it uses.
#include "kernel_test.h"

#include "compile/light_tree.h"
#include "compile/scene_identity.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

using namespace kernel_test;
using crt::Vec3d;

namespace {

/// Lamps of all sizes that face anywhere, spots and points, in a cube; `two_sided`: of all sides.
crt::Scene lamps(Random& random, int count, bool two_sided) {
    crt::Scene scene;
    scene.camera.position = {0, 0, -9};
    scene.materials.resize(1);
    for (int i = 0; i < count; ++i) {
        const Vec3d at{random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-2, 2)};
        const double size = std::pow(10, random.uniform(-3, -0.3));
        crt::Mesh mesh;
        for (int corner = 0; corner < 3; ++corner)
            mesh.positions.push_back(plus(at, times(random.direction(), size)));
        mesh.triangles = {{0, 1, 2}};
        scene.emissions.push_back(
            {crt::constantSpectrum(std::pow(10, random.uniform(-2, 2))), two_sided || i % 5 == 0});
        crt::Object object;
        object.mesh = static_cast<std::uint32_t>(scene.meshes.size());
        object.emission = static_cast<std::int32_t>(scene.emissions.size()) - 1;
        object.material = 0;
        scene.meshes.push_back(mesh);
        scene.objects.push_back(object);
    }
    for (int i = 0; i < count / 4 && !two_sided; ++i) {
        crt::PointLight light;
        light.type = i % 2 == 0 ? crt::PointLightType::Point : crt::PointLightType::Spot;
        light.spectrum = crt::constantSpectrum(1);
        light.position = {random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-2, 2)};
        light.direction = random.direction();
        light.cone_angle_deg = random.uniform(5, 90);
        light.penumbra_deg = random.uniform(0, light.cone_angle_deg);
        scene.point_lights.push_back(light);
    }
    return scene;
}

struct Tree {
    crt::CompiledScene compiled;
    CrtContext ctx;
    explicit Tree(const crt::Scene& scene)
        : compiled(crt::compileScene(scene, 0)), ctx(contextOf(compiled)) {}
    u32 lights() const { return ctx.scene->tree_lights; }
    const CrtLight& light(u32 i) const { return arrayOf<CrtLight>(compiled, ctx.scene->lights)[i]; }
    /// In the kernel's units: the scene reaches ±1.
    static vec3 somewhere(Random& random) {
        return toFloat({random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)});
    }
};

/// True if light sampling finds the light from p, on the side of n, by many tries.
bool lights(const Tree& tree, u32 index, vec3 p, vec3 n) {
    for (u32 i = 0; i < 24; ++i) {
        CrtSampler sampler = crt_sampler_begin(CRT_SAMPLER_INDEPENDENT, 0, crt_seed(5, 6), i, 0);
        vec3 wi;
        if (tree.light(index).kind >= CRT_LIGHT_POINT) {
            const CrtPointLightSample s = crt_point_light_sample(&tree.ctx, index, &sampler, 8, p);
            if (!(s.irradiance > 0)) continue;
            wi = s.wi;
        } else {
            const CrtLightSample s = crt_light_sample(&tree.ctx, index, &sampler, 8, p);
            if (!(s.pdf > 0)) continue;
            wi = s.wi;
        }
        if (dot3(n, n) == 0 || dot3(n, wi) > 0) return true;
    }
    return false;
}

/// A node's record of one of its children.
struct Child {
    Vec3d centre, axis;
    double radius, power, theta_o, cos_e;
    bool two_sided;
};
Child childOf(const CrtLightNode& node, u32 lane) {
    const auto of = [lane](const f32(&values)[4]) { return static_cast<double>(values[lane]); };
    return {{of(node.centre_x), of(node.centre_y), of(node.centre_z)},
            {of(node.axis_x), of(node.axis_y), of(node.axis_z)},
            of(node.radius),
            of(node.power),
            std::atan2(of(node.sin_o), of(node.cos_o)),
            of(node.cos_e),
            node.back[lane] < 0};
}

/// By angles, in double precision (pbrt-v4, 12.6.3), without power and distance; below 0: dark, by a cosine
/// that is missed by that much.
double importanceByAngles(const Child& child, const Vec3d& p, const Vec3d& n) {
    const Vec3d d = minus(child.centre, p);
    const double distance = length(d);
    if (distance <= child.radius) return 1;
    const double b = std::asin(child.radius / distance), towards = -dot(child.axis, d) / distance;
    const auto angle = [](double cosine) { return std::acos(std::clamp(cosine, -1.0, 1.0)); };
    const double emission =
        std::cos(std::max(angle(child.two_sided ? std::abs(towards) : towards) - child.theta_o - b, 0.0));
    if (emission < child.cos_e) return emission - child.cos_e;
    double importance = std::max(emission, 0.01);
    if (dot(n, n) > 0) {
        const double receiver = std::cos(std::max(angle(dot(d, n) / distance) - b, 0.0));
        if (receiver < 0) return receiver;
        importance *= std::max(receiver, 0.01);
    }
    return importance;
}

}  // namespace

TEST_CASE("few lights have no tree, and many that lie at a place have one", "[light tree]") {
    Random random(1);
    const auto few = static_cast<int>(crt::kLightTreeLights);
    CHECK(Tree(lamps(random, few - 1, true)).lights() == 0);
    CHECK(Tree(lamps(random, few, true)).lights() == crt::kLightTreeLights);
    // A sun lies at no place, and keeps a separate share.
    crt::Scene scene = lamps(random, few, true);
    crt::PointLight sun;
    sun.type = crt::PointLightType::Sun;
    sun.spectrum = crt::constantSpectrum(1000);
    scene.point_lights.push_back(sun);
    const Tree tree(scene);
    CHECK(tree.lights() == crt::kLightTreeLights);
    const CrtLight &lamp = tree.light(0), &last = tree.light(tree.lights());
    CHECK(last.kind == CRT_LIGHT_SUN);
    CHECK(lamp.choice_probability + last.choice_probability == Approx(1));
    CHECK(std::ldexp(static_cast<double>(last.choice), -32) == Approx(lamp.choice_probability));
    CHECK(arrayOf<CrtPointLight>(tree.compiled, tree.ctx.scene->point_lights)[0].light == tree.lights());
}

TEST_CASE("the tree holds every light once, and a node all that is below it", "[light tree]") {
    Random random(2);
    const Tree tree(lamps(random, 300, false));
    REQUIRE(tree.lights() == 375);
    const CrtLightNode* nodes = crt_light_nodes(&tree.ctx);
    std::vector<int> seen(tree.lights(), 0);
    std::vector<u32> open{0};
    while (!open.empty()) {
        const u32 i = open.back();
        open.pop_back();
        for (u32 lane = 0; lane < 4; ++lane) {
            const Child child = childOf(nodes[i], lane);
            if (child.power == 0) continue;
            const bool leaf = nodes[i].child[lane] >= CRT_LIGHT_LEAF;
            if (leaf) {
                const u32 light = nodes[i].child[lane] - CRT_LIGHT_LEAF;
                ++seen.at(light);
                CHECK(tree.light(light).choice == 4 * i + lane);
            } else {
                CHECK(nodes[nodes[i].child[lane]].parent == 4 * i + lane);
                open.push_back(nodes[i].child[lane]);
            }
            for (u32 above = i; above != 0; above = nodes[above].parent / 4) {
                const Child outer = childOf(nodes[nodes[above].parent / 4], nodes[above].parent % 4);
                if (leaf) CHECK(length(minus(child.centre, outer.centre)) <= outer.radius);
                const double between = std::acos(std::clamp(dot(child.axis, outer.axis), -1.0, 1.0));
                CHECK(std::min(between + child.theta_o, 3.1415) <= outer.theta_o + 2e-3);
                CHECK(child.cos_e >= outer.cos_e);
                CHECK(outer.power > 0.999999 * child.power);
                CHECK((outer.two_sided || !child.two_sided));
            }
        }
    }
    CHECK(std::count(seen.begin(), seen.end(), 1) == static_cast<std::ptrdiff_t>(seen.size()));
}

TEST_CASE("four children are weighed at once as each by its angles", "[light tree]") {
    Random random(6);
    const Tree tree(lamps(random, 300, false));
    const CrtLightNode* nodes = crt_light_nodes(&tree.ctx);
    u32 inner = 0;
    for (u32 i = 0; i < tree.lights(); ++i) inner = std::max(inner, tree.light(i).choice / 4);
    int dark = 0, bright = 0, within = 0, raised = 0;
    for (int k = 0; k < 20000; ++k) {
        const CrtLightNode& node = nodes[static_cast<u32>(random.uniform() * (inner + 1))];
        const vec3 p = Tree::somewhere(random);
        const vec3 n = k % 3 != 0 ? unitFloat(random.direction()) : make_vec3(0, 0, 0);
        const vec4 importances = crt_light_importances(&node, p, n), shares = crt_light_shares(&node, p, n);
        const double least = 0.999 * 0x1p-20 * static_cast<double>(sum4(importances));
        for (u32 lane = 0; lane < 4; ++lane) {
            const Child child = childOf(node, lane);
            const auto found = static_cast<double>(crt_lane(importances, lane)),
                       share = static_cast<double>(crt_lane(shares, lane));
            CHECK((found > 0 ? share >= std::max(found, least) : share == 0));
            raised += share > found ? 1 : 0;
            const double expected = importanceByAngles(child, toDouble(p), toDouble(n));
            const Vec3d d = minus(child.centre, toDouble(p));
            const double nearest = std::max(dot(d, d), child.radius * child.radius);
            if (child.power == 0) {
                CHECK(found == 0);
            } else if (expected < -2e-3) {
                CHECK(found == 0);
                ++dark;
            } else if (expected > 0) {
                CHECK(std::abs(found * nearest / child.power - expected) < 2e-3);
                ++bright;
                within += dot(d, d) < child.radius * child.radius ? 1 : 0;
            }
        }
    }
    CHECK(dark > 1000);
    CHECK(bright > 1000);
    CHECK(within > 100);
    CHECK(raised > 10);
}

TEST_CASE("what lights a point can be chosen there, and probabilities add up to 1", "[light tree]") {
    Random random(3);
    for (const bool two_sided : {true, false}) {
        const Tree tree(lamps(random, 120, two_sided));
        int lost = 0, lit = 0;
        double least = 1, most = 0;
        for (int k = 0; k < 60; ++k) {
            const vec3 p = Tree::somewhere(random);
            const bool sided = k % 3 != 0;
            const vec3 n = sided ? unitFloat(random.direction()) : make_vec3(0, 0, 0);
            double sum = 0;
            for (u32 i = 0; i < tree.lights(); ++i) {
                const f32 probability = crt_light_tree_probability(&tree.ctx, i, p, n);
                REQUIRE(probability >= 0);
                sum += static_cast<double>(probability);
                if (probability > 0) continue;
                ++lit;
                if (lights(tree, i, p, n)) ++lost;
            }
            // Less than 1 where a node might light the point and neither of its children does.
            if (!sided && two_sided) least = std::min(least, sum);
            most = std::max(most, sum);
        }
        CHECK(lost == 0);
        CHECK(most < 1 + 1e-4);
        if (two_sided)
            CHECK(least > 1 - 1e-4);
        else
            CHECK(lit > 100);  // Otherwise nothing was asked.
    }
}

TEST_CASE("lights of the tree are chosen with the probability that their density is told", "[light tree]") {
    Random random(4);
    const Tree tree(lamps(random, 60, false));
    for (int k = 0; k < 4; ++k) {
        const vec3 p = Tree::somewhere(random),
                   n = k % 2 ? unitFloat(random.direction()) : make_vec3(0, 0, 0);
        std::map<u32, int> chosen;
        constexpr int kDraws = 40000;
        double worst = 0;
        for (u32 i = 0; i < kDraws; ++i) {
            CrtSampler sampler = crt_sampler_begin(CRT_SAMPLER_INDEPENDENT, 0, crt_seed(7, 8), i, 0);
            f32 probability = 0;
            const u32 light = crt_light_tree_choose(&tree.ctx, &sampler, 8, p, n, &probability);
            ++chosen[light];
            if (light == CRT_NONE) continue;
            const f32 told = crt_light_tree_probability(&tree.ctx, light, p, n);
            worst = std::max(worst, std::abs(static_cast<double>(told / probability) - 1));
        }
        CHECK(worst < 1e-5);
        for (u32 i = 0; i < tree.lights(); ++i) {
            const double expected =
                kDraws * static_cast<double>(crt_light_tree_probability(&tree.ctx, i, p, n));
            CHECK(std::abs(chosen[i] - expected) < 5 * std::sqrt(expected + 1) + 1);
        }
    }
}

TEST_CASE("the tree of the same lights is the same, and of lights in one place not deep", "[light tree]") {
    Random random(5);
    std::vector<crt::LightBounds> bounds(3000);
    for (crt::LightBounds& b : bounds) {
        b.lower = b.upper = {random.uniform(), random.uniform(), random.uniform()};
        b.axis = random.direction();
        b.theta_e = 1.5;
        b.power = random.uniform(0.1, 1);
    }
    const crt::LightTree one = crt::buildLightTree(bounds), two = crt::buildLightTree(bounds);
    // Of nodes that are full, 1000 would do.
    CHECK(one.nodes.size() < 1600);
    REQUIRE(one.nodes.size() == two.nodes.size());
    CHECK(std::memcmp(one.nodes.data(), two.nodes.data(), one.nodes.size() * sizeof one.nodes[0]) == 0);
    CHECK(one.leaf_of == two.leaf_of);
    const auto depthOf = [](const crt::LightTree& tree) {
        int deepest = 0;
        for (const std::uint32_t leaf : tree.leaf_of) {
            int depth = 1;
            for (std::uint32_t node = leaf / 4; node != 0; node = tree.nodes[node].parent / 4) ++depth;
            deepest = std::max(deepest, depth);
        }
        return deepest;
    };
    CHECK(depthOf(one) < 12);
    for (crt::LightBounds& b : bounds) b.lower = b.upper = {1, 2, 3};
    CHECK(depthOf(crt::buildLightTree(bounds)) == 6);  // 4^6 is 4096.
    // Each ten times as far as the one before: the worst for buckets of equal width.
    bounds.resize(200);
    for (std::size_t i = 0; i < bounds.size(); ++i)
        bounds[i].lower = bounds[i].upper = {std::pow(10, static_cast<double>(i)), 0, 0};
    CHECK(depthOf(crt::buildLightTree(bounds)) <= 24);
    CHECK(crt::buildLightTree({bounds[0]}).nodes.size() == 1);
}
