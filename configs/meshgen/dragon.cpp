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

namespace {

/// A curve through points with a radius at each: Catmull and Rom's spline, cut into short straight pieces.
struct Spine {
    struct Knot {
        Vec at;
        double radius;
    };
    std::vector<Knot> knots;

    Spine(const std::vector<Knot>& through, int pieces) {
        const auto get = [&](std::size_t i, int offset) {
            const int j = static_cast<int>(i) + offset, last = static_cast<int>(through.size()) - 1;
            return through[static_cast<std::size_t>(std::clamp(j, 0, last))];
        };
        for (std::size_t i = 0; i + 1 < through.size(); ++i)
            for (int s = 0; s < pieces; ++s)
                knots.push_back(
                    blend(get(i, -1), get(i, 0), get(i, 1), get(i, 2), static_cast<double>(s) / pieces));
        knots.push_back(through.back());
    }

    Vec tangent(std::size_t i) const {
        return unit(knots[std::min(i + 1, knots.size() - 1)].at - knots[i > 0 ? i - 1 : 0].at);
    }
    /// Away from the belly: what is left of "up" across the curve.
    Vec up(std::size_t i) const {
        const Vec t = tangent(i);
        return unit(Vec{0, 1, 0} - t.y * t);
    }

private:
    static Knot blend(Knot a, Knot b, Knot c, Knot d, double t) {
        const double wa = 0.5 * t * (t * (2 - t) - 1), wb = 0.5 * (t * t * (3 * t - 5) + 2);
        const double wc = 0.5 * t * (t * (4 - 3 * t) + 1), wd = 0.5 * t * t * (t - 1);
        return {wa * a.at + wb * b.at + (wc * c.at + wd * d.at),
                std::max(0.004, wa * a.radius + wb * b.radius + wc * c.radius + wd * d.radius)};
    }
};

/// Height of the scales, 0 to 1, at a place on the skin: `around` counts scales round the body, `along` rows
/// towards the tail. Rows are shifted by half a scale, and each scale rises towards its free end.
double scaleHeight(double around, double along) {
    const double a = around + 0.5 * along, b = around - 0.5 * along;
    const double x = a - std::floor(a) - 0.5, y = b - std::floor(b) - 0.5;
    return (1 - 4 * x * x) * (1 - 4 * y * y) * (0.7 + 0.6 * (x - y));
}

}  // namespace

Mesh dragon() {
    Field field;

    // Body from the nape to the tip of the tail.
    const Spine spine({{{-0.640, 0.800, -0.170}, 0.066},
                       {{-0.590, 0.735, -0.100}, 0.070},
                       {{-0.525, 0.600, -0.020}, 0.082},
                       {{-0.400, 0.465, 0.040}, 0.112},
                       {{-0.205, 0.415, 0.060}, 0.158},
                       {{0.020, 0.405, 0.040}, 0.160},
                       {{0.240, 0.395, -0.010}, 0.145},
                       {{0.430, 0.345, -0.070}, 0.112},
                       {{0.610, 0.240, -0.080}, 0.086},
                       {{0.780, 0.135, -0.010}, 0.068},
                       {{0.870, 0.082, 0.150}, 0.055},
                       {{0.800, 0.062, 0.310}, 0.046},
                       {{0.620, 0.056, 0.390}, 0.038},
                       {{0.420, 0.050, 0.370}, 0.031},
                       {{0.270, 0.046, 0.290}, 0.024},
                       {{0.170, 0.050, 0.330}, 0.017},
                       {{0.120, 0.075, 0.410}, 0.010}},
                      5);
    constexpr int kScalesAround = 22;
    double rows =
        0.0;  // Scales keep their shape as the body thins, so rows are counted in units of its girth.
    for (std::size_t i = 0; i + 1 < spine.knots.size(); ++i) {
        const Spine::Knot a = spine.knots[i], b = spine.knots[i + 1];
        const double rows_a = rows;
        rows += length(b.at - a.at) * kScalesAround / (2.0 * kPi * 0.5 * (a.radius + b.radius)) * 0.9;
        const double rows_b = rows;
        const Vec up_a = spine.up(i), up_b = spine.up(i + 1);
        field.add(0.012, [=](Vec p) {
            const double d = roundCone(p, a.at, b.at, a.radius, b.radius);
            const Vec along = b.at - a.at;
            const double t = std::clamp(dot(p - a.at, along) / dot(along, along), 0.0, 1.0);
            const Vec out = p - mix(a.at, b.at, t), up = mix(up_a, up_b, t);
            const double above = dot(out, up), beside = dot(out, cross(unit(along), up));
            const double angle = std::atan2(beside, above), radius = a.radius + t * (b.radius - a.radius);
            const double row = rows_a + t * (rows_b - rows_a);
            // Scales on back and flanks, plates across the belly.
            const double belly = std::clamp(3.0 * (-std::cos(angle) - 0.62), 0.0, 1.0);
            const double plate = std::abs(std::sin(0.5 * kPi * row));
            const double scale = scaleHeight(angle * kScalesAround / (2 * kPi), row);
            const double height = (1 - belly) * scale + belly * 0.8 * std::sqrt(plate);
            return d - 0.085 * radius * (height - 0.3);
        });
    }

    // A crest of spikes down the back, largest over the shoulders.
    for (std::size_t i = 3; i + 6 < spine.knots.size(); i += 2) {
        const Spine::Knot k = spine.knots[i];
        const Vec up = spine.up(i), back = spine.tangent(i);
        const double size = 0.35 * k.radius + 0.018;
        const Vec root = k.at + (0.92 * k.radius) * up;
        field.addBone(root - (0.5 * size) * back, root + size * up + (0.9 * size) * back, 0.30 * size,
                      0.06 * size + 0.002, 0.012);
        field.addBone(root + (0.4 * size) * back, root + size * up + (0.9 * size) * back, 0.26 * size,
                      0.06 * size + 0.002, 0.008);
    }
    // The tail ends in a blade.
    const Vec tip = spine.knots.back().at;
    const Vec blade_root = tip + Vec{0.02, -0.02, -0.01}, blade_end = tip + Vec{-0.035, 0.11, 0.07};
    for (const Vec& corner : {tip + Vec{-0.055, 0.03, 0.03}, tip + Vec{0.05, 0.055, 0.06}})
        field.add(0.01, [=](Vec p) { return membrane(p, blade_root, corner, blade_end, 0.007); });

    // Head, in its own frame: `f` forward along the snout, `u` up, `s` to its left.
    const Vec head{-0.665, 0.845, -0.200};
    const Vec f = unit({-0.62, -0.22, -0.75}), s = unit(cross({0, 1, 0}, f)), u = cross(f, s);
    const auto place = [=](double forward, double up, double side) {
        return head + forward * f + up * u + side * s;
    };
    field.addBone(place(-0.03, -0.005, 0), place(0.06, 0.0, 0), 0.074, 0.062, 0.05);
    field.addBone(place(0.05, 0.006, 0), place(0.205, -0.004, 0), 0.050, 0.034, 0.03);   // Upper jaw.
    field.addBone(place(0.01, -0.050, 0), place(0.180, -0.098, 0), 0.042, 0.022, 0.02);  // Lower jaw, open.
    field.addBall(place(0.214, 0.006, 0), {0.030, 0.024, 0.032}, 0.025);
    field.addBone(place(0.09, -0.048, 0), place(0.170, -0.060, 0), 0.012, 0.006, 0.01);  // Tongue.
    for (const double side : {-1.0, 1.0}) {
        field.addBone(place(0.02, 0.052, side * 0.036), place(0.105, 0.040, side * 0.030), 0.018, 0.010,
                      0.015);                                                            // Brow.
        field.addBall(place(0.070, 0.027, side * 0.051), {0.017, 0.017, 0.017}, 0.004);  // Eye.
        const Vec nostril = place(0.234, 0.022, side * 0.016);
        field.carve(0.006, [nostril](Vec p) { return length(p - nostril) - 0.009; });
        // Horns in three pieces that turn back and up, and two smaller ones below.
        const Vec h0 = place(-0.045, 0.045, side * 0.042), h1 = place(-0.125, 0.085, side * 0.074);
        const Vec h2 = place(-0.205, 0.125, side * 0.082), h3 = place(-0.270, 0.195, side * 0.070);
        field.addBone(h0, h1, 0.024, 0.020, 0.015);
        field.addBone(h1, h2, 0.020, 0.014, 0.01);
        field.addBone(h2, h3, 0.014, 0.004, 0.01);
        field.addBone(place(-0.040, -0.010, side * 0.062), place(-0.120, -0.005, side * 0.120), 0.018, 0.004,
                      0.012);
        field.addBone(place(-0.030, -0.045, side * 0.050), place(-0.085, -0.075, side * 0.095), 0.014, 0.004,
                      0.012);
        for (int tooth = 0; tooth < 6; ++tooth) {
            const double forward = 0.085 + 0.024 * tooth, out = side * (0.036 - 0.0024 * tooth);
            const double fang = tooth == 4 ? 1.8 : 1.0;
            field.addBone(place(forward, -0.018, out), place(forward + 0.003, -0.030 - 0.022 * fang, out),
                          0.0100, 0.0035, 0.004);
            const double jaw = -0.052 - 0.29 * (forward - 0.085);
            field.addBone(place(forward - 0.015, jaw - 0.008, 0.75 * out),
                          place(forward - 0.013, jaw + 0.026, 0.75 * out), 0.0095, 0.0035, 0.004);
        }
    }

    // Legs: shoulder or hip, knee, ankle, foot, four claws.
    const auto leg = [&](Vec hip, Vec knee, Vec ankle, Vec foot, double r) {
        field.addBall(mix(hip, knee, 0.25), {1.25 * r, 1.5 * r, 1.1 * r}, 0.04);
        field.addBone(hip, knee, 1.15 * r, 0.72 * r, 0.04);
        field.addBone(knee, ankle, 0.70 * r, 0.45 * r, 0.02);
        field.addBone(ankle, foot, 0.46 * r, 0.42 * r, 0.015);
        const Vec forward = unit(Vec{foot.x - ankle.x, 0, foot.z - ankle.z}),
                  across = cross({0, 1, 0}, forward);
        for (int toe = -1; toe <= 2; ++toe) {
            const bool spur = toe == 2;
            const Vec direction = spur ? (-1.0) * forward : unit(forward + (0.55 * toe) * across);
            const Vec start = spur ? Vec{ankle.x, 0.03, ankle.z} : foot;
            const Vec knuckle = start + (0.75 * r) * direction + Vec{0, 0.012, 0};
            const Vec end{knuckle.x + 0.55 * r * direction.x, 0.018, knuckle.z + 0.55 * r * direction.z};
            field.addBone(start, knuckle, 0.30 * r, 0.26 * r, 0.012);
            field.addBone(knuckle, end, 0.26 * r, 0.20 * r, 0.008);
            field.addBone(end, {end.x + 0.5 * r * direction.x, 0.004, end.z + 0.5 * r * direction.z},
                          0.16 * r, 0.02 * r, 0.006);
        }
    };
    leg({-0.270, 0.370, -0.080}, {-0.235, 0.235, -0.235}, {-0.255, 0.075, -0.200}, {-0.320, 0.030, -0.255},
        0.072);
    leg({-0.250, 0.370, 0.190}, {-0.170, 0.230, 0.300}, {-0.235, 0.075, 0.275}, {-0.305, 0.030, 0.295},
        0.072);
    leg({0.235, 0.360, -0.130}, {0.130, 0.270, -0.290}, {0.295, 0.105, -0.270}, {0.245, 0.030, -0.335},
        0.090);
    leg({0.260, 0.360, 0.110}, {0.150, 0.255, 0.240}, {0.305, 0.105, 0.215}, {0.245, 0.030, 0.235}, 0.090);

    // Wings, raised: arm, wrist with a claw, four fingers, and skin between them that hangs in arcs.
    for (const double side : {-1.0, 1.0}) {
        const auto w = [side](Vec p) { return (side < 0.0 ? p : mirrorZ(p)) + Vec{0, 0, 0.05}; };
        const Vec shoulder = w({-0.200, 0.525, -0.085}), elbow = w({-0.060, 0.755, -0.185}),
                  wrist = w({-0.235, 0.985, -0.300});
        const std::array<Vec, 5> tip_of{w({-0.120, 1.120, -0.560}), w({0.190, 1.090, -0.600}),
                                        w({0.420, 0.915, -0.520}), w({0.500, 0.680, -0.370}),
                                        w({0.330, 0.505, -0.115})};
        field.addBone(shoulder, elbow, 0.052, 0.030, 0.03);
        field.addBone(elbow, wrist, 0.032, 0.022, 0.012);
        field.addBone(wrist, wrist + Vec{-0.055, 0.055, 0.0}, 0.014, 0.003, 0.01);
        for (std::size_t i = 0; i < 4; ++i) {
            const Vec middle = mix(wrist, tip_of[i], 0.5) + Vec{0, 0.030, 0};  // Fingers bend a little.
            field.addBone(wrist, middle, 0.017, 0.012, 0.008);
            field.addBone(middle, tip_of[i], 0.012, 0.004, 0.006);
        }
        constexpr double kSkin = 0.0075;
        const auto skin = [&](Vec a, Vec b, Vec c) {
            field.add(0.008, [=](Vec p) { return membrane(p, a, b, c, kSkin); });
        };
        for (std::size_t i = 0; i + 1 < tip_of.size(); ++i) {
            // The last tip is where the skin meets the flank; before it the skin hangs from the arm instead
            // of a finger.
            const Vec pa = mix(wrist, tip_of[i], 0.5) + Vec{0, 0.030, 0};
            const Vec pb = i == 3 ? elbow : mix(wrist, tip_of[i + 1], 0.5) + Vec{0, 0.030, 0};
            const Vec rim = mix(mix(tip_of[i], tip_of[i + 1], 0.5), i == 3 ? elbow : wrist, 0.22);
            skin(wrist, pa, pb);
            skin(pa, rim, pb);
            skin(pa, tip_of[i], rim);
            skin(pb, rim, tip_of[i + 1]);
        }
        skin(elbow, tip_of[4], w({0.060, 0.480, -0.090}));
        skin(elbow, w({0.060, 0.480, -0.090}), shoulder);
    }

    Mesh mesh = simplified(
        withoutCrumbs(polygonise(field, {-1.00, -0.03, -0.72}, {1.00, 1.20, 0.80}, 0.0066)), 100000);
    normalise(mesh);
    addNormals(mesh);
    return mesh;
}

}  // namespace crt::meshgen
