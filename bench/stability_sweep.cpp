// Sweeps to where a backend's arithmetic ends: one JSON object a line for every point of a sweep. bench/run
// stability makes pages of them.
//
//     stability_sweep BACKEND SWEEP RAYS
//
// SWEEP: misses, offset-safety, offset-tightness, far, scale, fov, solid-angle. RAYS: of each point,
// roughly.
#include "base/error.h"
#include "base/log.h"
#include "verify/probes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <numbers>
#include <string>

using namespace crt;
using namespace crt::verify;

namespace {

constexpr std::uint64_t kSeed = 20240;
constexpr int kResolution = 512;

void print(const char* sweep, const std::string& fields) {
    std::printf("{\"sweep\": \"%s\", %s}\n", sweep, fields.c_str());
    std::fflush(stdout);
}

int resolutionFor(std::uint64_t rays) {
    return std::clamp(static_cast<int>(std::sqrt(static_cast<double>(rays))), 16, kResolution);
}

Render samplesOf(std::uint64_t samples) {
    Render how;
    how.samples = std::max<std::uint64_t>(1, samples);
    return how;
}

void misses(Context& context, std::uint64_t rays) {
    for (const Place& place : kPlaces)
        for (const Aim aim : {Aim::Vertex, Aim::Edge, Aim::Face}) {
            // A sheet serves as many random rays as one likes, but only one aimed ray a vertex.
            const std::uint64_t samples = aim == Aim::Face ? 16 : 1;
            const int resolution = resolutionFor(rays / samples);
            const Tally t = collect(rays, [&](std::uint64_t seed) {
                return missesOfAimedRays(context, aim, place, resolution, seed, samples);
            });
            print("misses", fmt::format(R"("place": "{}", "aim": "{}", "rays": {}, "failures": {})",
                                        place.name, name(aim), t.rays, t.failures));
        }
}

void offsetSafety(Context& context, std::uint64_t rays) {
    for (const double extent : {1.0, 1e2, 1e4, 1e6})
        for (const double size : {1e-6, 1e-3, 1.0, 1e3, 1e6}) {
            const Tally t = collect(rays, [&](std::uint64_t seed) {
                return selfHits(context, size, extent, resolutionFor(4 * rays), seed);
            });
            print("offset-safety", fmt::format(R"("size": {}, "extent": {}, "rays": {}, "failures": {})",
                                               size, extent, t.rays, t.failures));
        }
}

void offsetTightness(Context& context, std::uint64_t rays) {
    // Few rays a pose: what is skipped is a matter of where the layers lie, not of where the ray meets them.
    for (const double extent : {1.0, 1e2, 1e4})
        for (const double gap : {1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 6e-6, 3e-6, 1e-6, 1e-7}) {
            const Tally t = collect(
                rays, [&](std::uint64_t seed) { return skippedLayers(context, 1, gap, extent, 64, seed); });
            print("offset-tightness", fmt::format(R"("gap": {}, "extent": {}, "rays": {}, "failures": {})",
                                                  gap, extent, t.rays, t.failures));
        }
}

struct Difference {
    std::uint64_t pixels = 0;
    double mean = 0;  ///< relative
};
Difference difference(const Film& a, const Film& b) {
    Difference d;
    for (std::uint32_t y = 0; y < a.shape().height; ++y)
        for (std::uint32_t x = 0; x < a.shape().width; ++x) {
            bool same = true;
            for (std::uint32_t c = 0; c < 3; ++c)
                same = same && static_cast<float>(a.mean(x, y, c)) == static_cast<float>(b.mean(x, y, c));
            d.pixels += !same;
        }
    d.mean = luminance(b) / luminance(a) - 1;
    return d;
}

void compareMoved(Context& context, const char* sweep, std::uint64_t rays, const std::string& fields,
                  const Scene& scene, double scale, const Vec3d& shift) {
    const Render how = samplesOf(rays / (48 * 48));
    try {
        const Difference d =
            difference(context.render(scene, how), context.render(moved(scene, scale, shift), how));
        print(sweep, fmt::format(R"({}, "samples": {}, "pixels": {}, "of": {}, "mean": {})", fields,
                                 how.samples, d.pixels, 48 * 48, d.mean));
    } catch (const Error& error) {
        print(sweep, fmt::format(R"({}, "refused": "{}")", fields, error.what()));
    }
}

void far(Context& context, std::uint64_t rays) {
    // Its vertices are multiples of 2⁻⁴, which whole shifts below 2⁴⁸ leave exact; a third of it
    // rounds at every shift.
    const Scene whole = litRoom(48, kSeed), third = moved(whole, 1.0 / 3, {});
    for (int exponent = 0; exponent <= 14; exponent += 2) {
        const double t = std::pow(10.0, exponent);
        const Vec3d shift{t, std::round(0.7 * t), -std::round(0.3 * t)};
        compareMoved(context, "far", rays, fmt::format(R"("sizes": {}, "representable": true)", t), whole, 1,
                     shift);
        compareMoved(context, "far", rays, fmt::format(R"("sizes": {}, "representable": false)", t), third,
                     1, shift * (1.0 / 3));
    }
}

void scale(Context& context, std::uint64_t rays) {
    const Scene room = litRoom(48, kSeed);
    for (const int m : {-1000, -500, -300, -40, -20, -10, 10, 20, 40, 300, 500, 1000})
        compareMoved(context, "scale", rays, fmt::format(R"("base": 2, "exponent": {})", m), room,
                     std::ldexp(1.0, m), {});
    for (const int m : {-300, -150, -100, -30, -6, -5, -4, -3, -2, -1, 1, 2, 3, 4, 5, 6, 30, 100, 150, 300})
        compareMoved(context, "scale", rays, fmt::format(R"("base": 10, "exponent": {})", m), room,
                     std::pow(10.0, m), {});
}

/// Stripes two pixels wide, exactly where the film's columns are: failures are rays that see the stripe of
/// another column. The view axis is oblique, so that no coordinate of a direction is small.
Tally strayRays(Context& context, double fov_degrees, int resolution, std::uint64_t samples,
                std::uint64_t seed) {
    const double half = std::tan(fov_degrees * std::numbers::pi / 360);
    Scene scene = emptyScene(resolution, seed, {0, 0, 0}, unit({1, 1, 1}), half);
    scene.integrator.max_depth = 0;
    const Vec3d view = unit(scene.camera.target), right = unit(cross(view, scene.camera.up)),
                up = cross(right, view);
    const auto column = [&](int x, double y) {
        return view + right * (half * (2.0 * x / resolution - 1)) + up * (half * y);
    };
    Mesh stripes;
    for (int x = 0; x < resolution; x += 4)
        addQuad(stripes, column(x, -1.5), column(x + 2, -1.5), column(x + 2, 1.5), column(x, 1.5));
    addObject(scene, std::move(stripes), diffuse(0), 1, true);
    Tally tally;
    for (std::uint64_t sample = 0; sample < samples; ++sample) {
        Render how = samplesOf(1);
        how.first_sample = sample;
        const Film film = context.render(scene, how);
        for (std::uint32_t y = 0; y < film.shape().height; ++y)
            for (std::uint32_t x = 0; x < film.shape().width; ++x)
                tally.failures += (radiance(film, x, y) > 0) != (x % 4 < 2);
        tally.rays += film.counts.size();
    }
    return tally;
}

void fov(Context& context, std::uint64_t rays) {
    for (const double degrees :
         {1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 1e-1, 1.0, 10.0, 90.0, 150.0, 170.0, 179.0, 179.9, 179.99}) {
        const Tally t =
            strayRays(context, degrees, 128, std::max<std::uint64_t>(1, rays / (128 * 128)), kSeed);
        print("fov",
              fmt::format(R"("degrees": {}, "rays": {}, "failures": {})", degrees, t.rays, t.failures));
    }
}

/// View factor from a point to a square of half edge h over it at distance 1, parallel (four times that of a
/// corner; Howell, configuration B-4).
double squareFactor(double h) {
    const double r = std::sqrt(1 + h * h);
    return 4 / std::numbers::pi * (h / r) * std::atan(h / r);
}

void solidAngle(Context& context, std::uint64_t rays) {
    constexpr double kView = 1e-5;  // the floor's irradiance is even over so small a patch
    for (const double h : {2.0, 0.5, 0.1, 1e-2, 1e-3, 5e-5, 1e-5, 1e-6, 1e-7, 1e-8}) {
        std::vector<double> means;
        for (std::uint64_t seed = 0; seed < 16; ++seed) {
            Scene scene = emptyScene(16, seed, {0.5, 0.5, 0}, {0, 0, 0}, kView);
            scene.integrator.nee = true;
            scene.integrator.max_depth = 1;
            scene.integrator.accelerator = Accelerator::Auto;
            Mesh floor, lamp;
            addQuad(floor, {-1, 0, -1}, {-1, 0, 1}, {1, 0, 1}, {1, 0, -1});
            addQuad(lamp, {-h, 1, -h}, {h, 1, -h}, {h, 1, h}, {-h, 1, h});
            addObject(scene, std::move(floor), diffuse(0.5));
            addObject(scene, std::move(lamp), diffuse(0), 1);
            const Film film = context.render(scene, samplesOf(rays / (16 * 16 * 16)));
            means.push_back(radiance(film) / (0.5 * squareFactor(h)) - 1);
        }
        double mean = 0, squares = 0;
        for (const double m : means) mean += m / 16;
        for (const double m : means) squares += (m - mean) * (m - mean);
        print("solid-angle",
              fmt::format(
                  R"("half_edge": {}, "solid_angle": {}, "rays": {}, "error": {}, "standard_error": {})", h,
                  4 * std::asin(h * h / (1 + h * h)), rays, mean, std::sqrt(squares / 15 / 16)));
    }
}

}  // namespace

int main(int argc, char** argv) {
    const std::map<std::string, void (*)(Context&, std::uint64_t)> sweeps{
        {"misses", misses},
        {"offset-safety", offsetSafety},
        {"offset-tightness", offsetTightness},
        {"far", far},
        {"scale", scale},
        {"fov", fov},
        {"solid-angle", solidAngle}};
    if (argc != 4 || !sweeps.contains(argv[2])) {
        std::fprintf(stderr,
                     "stability_sweep BACKEND "
                     "misses|offset-safety|offset-tightness|far|scale|fov|solid-angle RAYS\n");
        return 2;
    }
    const Listener listener(standardErrorSink(), LogLevel::Error);
    const ListenerScope scope(listener);
    try {
        const LoadedBackend backend = loadBackend(argv[1]);
        Watch goes_on;
        Context context(backend, {}, Level::Nightly, goes_on);
        sweeps.at(argv[2])(context, static_cast<std::uint64_t>(std::stod(argv[3])));
        return 0;
    } catch (const Error& error) {
        std::fprintf(stderr, "stability_sweep: %s\n", error.what());
        return error.exitCode();
    }
}
