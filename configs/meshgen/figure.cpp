#include "polygonise.h"
#include "shapes.h"
#include "simplify.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace crt::meshgen {

Mesh figure() {
    Field field;

    // The stone, and a slab under the feet.
    field.add(0.001, [](Vec p) { return roundBox(p, {0, 0.11, 0.16}, {0.25, 0.14, 0.22}, 0.035); });
    field.add(0.03, [](Vec p) { return roundBox(p, {0, 0.0, -0.10}, {0.31, 0.045, 0.40}, 0.02); });

    // Trunk: a heavy pelvis, a rounded back, a deep chest that leans forward.
    field.addBall({0, 0.335, 0.13}, {0.190, 0.130, 0.165}, 0.02);
    field.addBone({0, 0.40, 0.13}, {0, 0.66, 0.02}, 0.165, 0.175, 0.12);
    field.addBall({0, 0.46, 0.00}, {0.150, 0.150, 0.130}, 0.08);
    field.addBall({0, 0.68, 0.06}, {0.215, 0.115, 0.130}, 0.08);

    // Head: thrust forward between the shoulders; brow ridge, muzzle, crest and ears.
    field.addBone({0, 0.74, 0.00}, {0, 0.86, -0.10}, 0.115, 0.095, 0.08);
    field.addBall({0, 0.935, -0.115}, {0.112, 0.118, 0.132}, 0.05);
    field.addBall({0, 0.990, -0.055}, {0.045, 0.062, 0.105}, 0.06);
    field.addBone({-0.062, 0.955, -0.222}, {0.062, 0.955, -0.222}, 0.028, 0.028, 0.03);
    field.addBall({0, 0.862, -0.228}, {0.078, 0.062, 0.072}, 0.04);
    field.addBone({-0.035, 0.838, -0.262}, {0.035, 0.838, -0.262}, 0.030, 0.030, 0.02);
    field.addBall({0, 0.905, -0.265}, {0.030, 0.020, 0.026}, 0.02);
    for (const double side : {-1.0, 1.0}) {
        const auto s = [side](Vec p) { return side < 0.0 ? mirrorX(p) : p; };
        const Vec eye = s({0.043, 0.925, -0.243});
        field.carve(0.02, [eye](Vec p) { return ellipsoid(p, eye, {0.026, 0.018, 0.03}); });
        field.addBall(s({0.043, 0.926, -0.226}), {0.017, 0.014, 0.014}, 0.006);
        const Vec ear = s({0.122, 0.925, -0.09}), hollow = s({0.143, 0.925, -0.102});
        field.addBall(ear, {0.020, 0.043, 0.034}, 0.012);
        field.carve(0.01, [hollow](Vec p) { return ellipsoid(p, hollow, {0.014, 0.026, 0.02}); });
        const Vec nostril = s({0.013, 0.897, -0.292});
        field.carve(0.01, [nostril](Vec p) { return ellipsoid(p, nostril, {0.008, 0.007, 0.012}); });
    }
    field.carve(0.008, [](Vec p) {
        return roundCone(p, {-0.055, 0.847, -0.288}, {0.055, 0.847, -0.288}, 0.006, 0.006);
    });

    // Legs: thighs out, knees high, feet flat with a thumb-like great toe.
    for (const double side : {-1.0, 1.0}) {
        const auto s = [side](Vec p) { return side < 0.0 ? mirrorX(p) : p; };
        const Vec knee = side < 0.0 ? Vec{-0.20, 0.43, -0.20} : Vec{0.215, 0.415, -0.18};
        const Vec ankle = s({0.165, 0.10, -0.16});
        field.addBone(s({0.10, 0.33, 0.07}), knee, 0.105, 0.072, 0.05);
        field.addBone(knee, ankle, 0.066, 0.046, 0.03);
        field.addBall(mix(knee, ankle, 0.40) + Vec{0, 0, 0.03}, {0.056, 0.090, 0.056}, 0.04);
        field.addBone(ankle, s({0.17, 0.072, -0.12}), 0.044, 0.040, 0.02);
        field.addBone(ankle + Vec{0, -0.02, 0}, s({0.185, 0.068, -0.30}), 0.044, 0.038, 0.03);
        for (int toe = 0; toe < 4; ++toe) {
            const double x = 0.162 + 0.024 * toe;
            field.addBone(s({x, 0.068, -0.29}), s({x + 0.004 * toe, 0.058, -0.365 + 0.008 * toe}), 0.016,
                          0.014, 0.012);
        }
        field.addBone(s({0.15, 0.068, -0.25}), s({0.108, 0.060, -0.315}), 0.020, 0.016, 0.015);
    }

    // Its right arm: elbow on the knee, hand under the chin.
    const Vec right_elbow{-0.205, 0.520, -0.215}, right_wrist{-0.085, 0.745, -0.285};
    field.addBone({-0.215, 0.69, 0.03}, right_elbow, 0.088, 0.058, 0.06);
    field.addBone(right_elbow, right_wrist, 0.058, 0.038, 0.03);
    field.addBall(mix(right_elbow, right_wrist, 0.35) + Vec{-0.015, 0, 0}, {0.058, 0.085, 0.058}, 0.03);
    field.addBone(right_wrist, {-0.035, 0.790, -0.285}, 0.038, 0.034, 0.02);
    for (int finger = 0; finger < 4; ++finger) {
        const Vec knuckle{-0.020 + 0.004 * finger, 0.802 - 0.019 * finger, -0.300 + 0.002 * finger};
        field.addBone(knuckle + Vec{-0.03, -0.004, 0.004}, knuckle + Vec{0.022, 0, 0.002}, 0.015, 0.014,
                      0.010);
        field.addBone(knuckle + Vec{0.022, 0, 0.002}, knuckle + Vec{0.018, -0.004, 0.038}, 0.014, 0.012,
                      0.008);
    }
    field.addBone({-0.065, 0.785, -0.270}, {-0.088, 0.842, -0.262}, 0.018, 0.014, 0.015);

    // Its left arm: hanging over the other knee.
    const Vec left_elbow{0.325, 0.500, -0.085}, left_wrist{0.235, 0.465, -0.300};
    field.addBone({0.215, 0.69, 0.03}, left_elbow, 0.088, 0.058, 0.06);
    field.addBone(left_elbow, left_wrist, 0.057, 0.038, 0.03);
    field.addBall(mix(left_elbow, left_wrist, 0.35) + Vec{0.01, 0.008, 0}, {0.058, 0.056, 0.085}, 0.03);
    field.addBone(left_wrist, {0.215, 0.425, -0.345}, 0.037, 0.036, 0.02);
    for (int finger = 0; finger < 4; ++finger) {
        const Vec knuckle{0.247 - 0.023 * finger, 0.408, -0.362 + 0.003 * finger};
        field.addBone(knuckle + Vec{0, 0.02, 0.01}, knuckle + Vec{0, -0.05, -0.006}, 0.0155, 0.0145, 0.010);
        field.addBone(knuckle + Vec{0, -0.05, -0.006}, knuckle + Vec{0, -0.092, 0.012}, 0.0145, 0.012,
                      0.008);
    }
    field.addBone({0.195, 0.43, -0.325}, {0.160, 0.375, -0.318}, 0.018, 0.014, 0.015);

    Mesh mesh =
        simplified(withoutCrumbs(polygonise(field, {-0.45, -0.03, -0.56}, {0.47, 1.14, 0.45}, 0.010)), 4746);
    // A closed surface has an even number of triangles. The 4,745th is the last one: the lowest face of the
    // slab, on which everything stands, is left open by the one triangle that no camera here sees.
    const auto lowest =
        std::min_element(mesh.triangles.begin(), mesh.triangles.end(), [&](const auto& a, const auto& b) {
            const auto height = [&](const auto& t) {
                return mesh.positions[t[0]].y + mesh.positions[t[1]].y + mesh.positions[t[2]].y;
            };
            return height(a) < height(b);
        });
    mesh.triangles.erase(lowest);
    normalise(mesh);
    addNormals(mesh);
    return mesh;
}

}  // namespace crt::meshgen
