#include "verify/probes.h"

#include "compile/compile.h"
#include "kernel/schedule/pixel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace crt::verify {
namespace {

/// The camera of a scene that holds nothing but its anchors: rays in the compiled scene's own lengths.
class KnownRays {
public:
    explicit KnownRays(const Scene& anchored) : compiled_(compileScene(anchored, 0)) {
        context_.blob = compiled_.data();
        context_.scene = reinterpret_cast<const kernel::CrtScene*>(compiled_.data());
        for (std::size_t k = 0; k < 3; ++k) origin_[k] = context_.scene->camera.origin[k];
    }

    Vec3d origin() const { return origin_; }
    /// Direction of sample 0 of a pixel.
    Vec3d direction(int x, int y) const {
        kernel::CrtPath path;
        kernel::crt_path_begin(&context_, &path, static_cast<kernel::u32>(x), static_cast<kernel::u32>(y),
                               0);
        return {path.ray.d.x, path.ray.d.y, path.ray.d.z};
    }
    /// Direction through a film point, not normalised.
    Vec3d through(double x, double y) const {
        const kernel::CrtCamera& c = context_.scene->camera;
        Vec3d d;
        for (std::size_t k = 0; k < 3; ++k) d[k] = c.corner[k] + x * c.step_x[k] + y * c.step_y[k];
        return d;
    }
    double scale() const { return std::ldexp(1.0, compiled_.scale_exponent); }
    /// A point of the compiled scene, rounded to float there, in the author's units.
    Vec3d authors(const Vec3d& p) const { return roundToFloat(p) * (1 / scale()) + compiled_.centre; }

private:
    CompiledScene compiled_;
    kernel::CrtContext context_{};
    Vec3d origin_{};
};

/// Vertices in rows and columns, joined to a sheet of triangles.
class Sheet {
public:
    Sheet(std::size_t rows, std::size_t columns) : columns_(columns) {
        mesh_.positions.resize(rows * columns);
        for (std::uint32_t r = 0; r + 1 < rows; ++r)
            for (std::uint32_t c = 0; c + 1 < columns; ++c) {
                const auto a = static_cast<std::uint32_t>(r * columns + c),
                           b = a + static_cast<std::uint32_t>(columns);
                mesh_.triangles.push_back({a, a + 1, b});
                mesh_.triangles.push_back({a + 1, b + 1, b});
            }
    }
    Vec3d& at(std::size_t row, std::size_t column) { return mesh_.positions[row * columns_ + column]; }
    Mesh take() { return std::move(mesh_); }

private:
    Mesh mesh_;
    std::size_t columns_;
};

/// A sheet with a vertex, or an edge between two, on every ray. However it folds, its rim lies outside the
/// film, so by continuity it covers every film point: a ray that meets nothing has slipped through.
Mesh sheetOnRays(const KnownRays& rays, Aim aim, const Place& place, int resolution, Dice& dice) {
    constexpr double kRim = 8;  // pixels outside the film
    const auto n = static_cast<std::size_t>(resolution);
    const std::size_t per_ray = aim == Aim::Edge ? 2 : 1;
    const double size = place.size * rays.scale();
    const Vec3d o = rays.origin();
    const double pixel = length(rays.through(1, 0) - rays.through(0, 0));
    Sheet sheet(per_ray * n + 2, n + 2);
    const auto rim = [&](std::size_t row, std::size_t column) {
        const auto film_point = [&](std::size_t i, std::size_t count) {
            return i == 0           ? -kRim
                   : i + 1 == count ? resolution + kRim
                                    : resolution * static_cast<double>(i) / static_cast<double>(count - 1);
        };
        sheet.at(row, column) = rays.authors(
            o +
            unit(rays.through(film_point(column, n + 2), film_point(row, per_ray * n + 2))) * (0.4 * size));
    };
    for (std::size_t c = 0; c < n + 2; ++c) rim(0, c), rim(per_ray * n + 1, c);
    for (std::size_t r = 1; r <= per_ray * n; ++r) rim(r, 0), rim(r, n + 1);
    for (std::size_t y = 0; y < n; ++y)
        for (std::size_t x = 0; x < n; ++x) {
            // Half of the points at a power of two of the ray's length: seen from the origin, they are on
            // the ray exactly.
            const double distance = size * (dice.bits() & 1 ? 0.5 : dice.uniform(0.25, 0.5));
            const Vec3d p = o + rays.direction(static_cast<int>(x), static_cast<int>(y)) * distance;
            if (aim == Aim::Edge) {
                const Vec3d along = dice.direction() * (0.5 * pixel * distance);
                sheet.at(1 + 2 * y, 1 + x) = rays.authors(p + along * dice.uniform());
                sheet.at(2 + 2 * y, 1 + x) = rays.authors(p - along * dice.uniform());
            } else {
                sheet.at(1 + y, 1 + x) = rays.authors(p);
            }
        }
    return sheet.take();
}

Render how(std::uint64_t samples, std::uint64_t first = 0, std::uint32_t aovs = 0) {
    Render render;
    render.samples = samples;
    render.first_sample = first;
    render.aovs = aovs;
    return render;
}

/// Calls `use` with every pixel's place in the film and its radiance. One sample's radiance depends a
/// little on its wavelengths, up to a factor of two at the ends of the observer's range: only ratios of
/// films of the same samples, and orders of magnitude, are meaningful.
template <class Use>
void forEachPixel(const Film& film, Use use) {
    for (std::uint32_t y = 0; y < film.shape().height; ++y)
        for (std::uint32_t x = 0; x < film.shape().width; ++x)
            use(static_cast<std::size_t>(y) * film.shape().width + x, radiance(film, x, y));
}

/// Orthonormal and random.
struct Pose {
    Vec3d x, y, z;
    explicit Pose(Dice& dice) : z(dice.direction()) {
        x = unit(cross(z, dice.direction()));
        y = cross(z, x);
    }
};

}  // namespace

const char* name(Aim aim) { return aim == Aim::Vertex ? "vertices" : aim == Aim::Edge ? "edges" : "faces"; }

const Place kPlaces[3] = {
    {"at the origin", {0, 0, 0}, 1, {0, 0, 0}, 0.95},
    {"far from it", {148376, 1234, -223423}, 100, {148376, 1234, -223423}, 190},
    {"in a scene 2,000 times as large", {148376, 1234, -223423}, 100, {0, 0, 0}, 230000}};

Tally missesOfAimedRays(Context& context, Aim aim, const Place& place, int resolution, std::uint64_t seed,
                        std::uint64_t samples) {
    Dice dice(seed);
    Scene scene =
        emptyScene(resolution, seed, place.centre, place.centre + dice.direction() * place.size, 0.7);
    scene.integrator.max_depth = 0;
    scene.environment = Environment{constantSpectrum(1)};
    // Behind the eye, so small that it alone decides whether the camera is the scene's centre (focus.h):
    // with the sheet as without.
    Mesh speck;
    const Vec3d behind = place.centre * 2 - scene.camera.target;
    const Vec3d off = behind - place.centre;
    addTriangle(speck, place.centre + off * 0.1, place.centre + off * 0.11,
                place.centre + off * 0.1 + Vec3d{off[1], off[2], off[0]} * 0.01);
    addObject(scene, std::move(speck), diffuse(0));
    Scene anchored = scene;
    addAnchors(anchored, place.scene_centre, place.scene_half);
    addObject(scene, sheetOnRays(KnownRays(anchored), aim, place, resolution, dice), diffuse(0));
    addAnchors(scene, place.scene_centre, place.scene_half);
    // Sample 0 is the one that was aimed; the others go anywhere.
    const Film film = context.render(scene, how(samples, aim == Aim::Face ? 1 : 0));
    const double pixels = static_cast<double>(resolution) * resolution;
    Tally tally;
    tally.rays = static_cast<std::uint64_t>(resolution) * static_cast<std::uint64_t>(resolution) * samples;
    tally.failures =
        static_cast<std::uint64_t>(std::ceil(radiance(film) * pixels * static_cast<double>(samples) - 0.5));
    return tally;
}

Tally selfHits(Context& context, double size, double extent, int resolution, std::uint64_t seed) {
    Dice dice(seed);
    const Vec3d centre = dice.inBox(std::max(0.0, 0.9 * extent - 0.5) * size);
    const Pose pose(dice);
    // Long or short, thin or thick.
    const double width = std::pow(10.0, dice.uniform(-2, 0));
    const auto point = [&](double x, double y) {
        return centre + pose.x * (0.5 * size * x) + pose.y * (0.5 * size * y);
    };
    Mesh triangle;
    addTriangle(triangle, point(-1, -width), point(1, dice.uniform(-width, 0)),
                point(dice.uniform(-1, 1), width));
    const double cosine = dice.uniform(0.1, 1) * (dice.bits() & 1 ? 1 : -1),
                 sine = std::sqrt(1 - cosine * cosine);
    const Vec3d eye = centre + (pose.z * cosine + pose.y * sine) * (2 * size);
    Scene scene = emptyScene(resolution, seed, eye, centre, 0.25);
    scene.camera.up = pose.x;
    scene.camera.tan_half_height = 0.26 * std::max(width, 1.0 / 16) * std::abs(cosine) + 0.02;
    scene.integrator.max_depth = 1;
    // The triangle brings 1, the sky 1000: a path that sees both brings 1001, one that meets the triangle
    // twice 2.
    scene.environment = Environment{constantSpectrum(1000)};
    addObject(scene, std::move(triangle), diffuse(1), 1, true);
    addAnchors(scene, {0, 0, 0}, std::max(1.0, extent) * size);
    const Film film = context.render(scene, how(1, 0, kAovPrimitive));
    std::vector<std::size_t> suspects;
    Tally tally;
    forEachPixel(film, [&](std::size_t pixel, double value) {
        if (film.primitives[pixel] != 0) return;
        ++tally.rays;
        if (value < 100) suspects.push_back(pixel);
    });
    if (suspects.empty()) return tally;
    // Or did the path end, its direction rounded into the surface? Then it brings no more than what it sees
    // first.
    scene.integrator.max_depth = 0;
    std::vector<double> first(film.counts.size()), both(film.counts.size());
    forEachPixel(context.render(scene, how(1)),
                 [&](std::size_t pixel, double value) { first[pixel] = value; });
    forEachPixel(film, [&](std::size_t pixel, double value) { both[pixel] = value; });
    for (const std::size_t pixel : suspects) tally.failures += both[pixel] > 1.5 * first[pixel];
    return tally;
}

Tally skippedLayers(Context& context, double size, double gap, double extent, int resolution,
                    std::uint64_t seed) {
    Dice dice(seed);
    const Vec3d centre = dice.inBox(std::max(0.0, 0.9 * extent - 1.5) * size);
    const Pose pose(dice);
    const auto square = [&](double height, double half) {
        Mesh mesh;
        const auto point = [&](double x, double y) {
            return centre + pose.x * (half * x) + pose.y * (half * y) + pose.z * height;
        };
        addQuad(mesh, point(-1, -1), point(1, -1), point(1, 1), point(-1, 1));
        return mesh;
    };
    const double cosine = dice.uniform(0.1, 1), sine = std::sqrt(1 - cosine * cosine);
    Scene scene =
        emptyScene(resolution, seed, centre + (pose.y * sine - pose.z * cosine) * (2 * size), centre, 0.3);
    scene.camera.up = pose.x;
    scene.integrator.max_depth = 1;
    scene.environment = Environment{constantSpectrum(1000)};
    addObject(scene, square(0, 0.5 * size), glass(1));
    addObject(scene, square(gap, size), diffuse(0), 1, true);
    addAnchors(scene, {0, 0, 0}, std::max(1.5, extent) * size);
    const Film film = context.render(scene, how(1, 0, kAovPrimitive));
    Tally tally;
    forEachPixel(film, [&](std::size_t pixel, double value) {
        if (film.primitives[pixel] > 1) return;  // not through the first square
        ++tally.rays;
        tally.failures += !(value > 0 && value < 100);
    });
    return tally;
}

void rareFailures(Context& context, const std::string& what, const Tally& tally, double bound,
                  const std::string& physics) {
    // −ln(0.0005): failures that none of N leaves possible, times N.
    constexpr double kNoneOf = 7.61;
    if (static_cast<double>(tally.rays) * bound >= kNoneOf)
        context.rate(what, tally.failures, tally.rays, bound, physics);
    else
        context.holds(what, tally.failures == 0 && tally.rays > 0,
                      fmt::format("none; a rate of {:g} needs more rays", bound), physics,
                      fmt::format("{} of {}", tally.failures, tally.rays));
}

}  // namespace crt::verify
