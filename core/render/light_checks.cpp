#include "render/light_checks.h"

#include "base/log.h"
#include "base/vec3d.h"
#include "compile/placements.h"
#include "render/deep_glass.h"
#include "scene/missing_light.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>

namespace crt {
namespace {

bool mirrors(const Matrix4d& m) {
    return dot(Vec3d{m[0], m[1], m[2]}, cross(Vec3d{m[4], m[5], m[6]}, Vec3d{m[8], m[9], m[10]})) < 0;
}

/// A face that emits on one side, that to which its unit normal points.
struct Face {
    Vec3d point;
    Vec3d normal;
};

/// Emission of a triangle; null when it emits nothing.
const Emission* emissionOf(const Scene& scene, const Object& object, std::size_t triangle) {
    const std::int32_t index = emissionIndexOf(scene, object, triangle);
    if (index < 0) return nullptr;
    const Emission& emission = scene.emissions[static_cast<std::size_t>(index)];
    return emission.radiance.max() > 0 ? &emission : nullptr;
}

/// Faces of a lamp, wherever it is placed. Nothing when one of them lights both sides, or none emits.
std::vector<Face> oneSidedFaces(const Scene& scene, const Object& object) {
    const Mesh& mesh = scene.meshes[object.mesh];
    std::vector<Face> faces;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Emission* emission = emissionOf(scene, object, t);
        if (emission == nullptr) continue;
        if (emission->two_sided) return {};
        for (const Matrix4d& transform : object.transforms) {
            std::array<Vec3d, 3> p;
            for (std::size_t v = 0; v < 3; ++v)
                p[v] = transformPoint(transform, mesh.positions[mesh.triangles[t][v]]);
            Vec3d normal = cross(p[1] - p[0], p[2] - p[0]);
            const double norm = length(normal);
            if (!(norm > 0)) continue;
            faces.push_back({p[0], normal * ((mirrors(transform) ? -1 : 1) / norm)});
        }
    }
    return faces;
}

/// Largest distance of a shape from the origin of its frame.
double radiusAround(const Quadric& shape, const Matrix4d& transform) {
    const double scale = evenScaleOf(transform).value_or(std::numeric_limits<double>::infinity());
    const double z = std::max(std::abs(shape.from_z), std::abs(shape.to_z));
    return scale * (shape.type == QuadricType::Sphere ? shape.radius : std::hypot(shape.radius, z));
}

/// Is anything in front of a face? `budget` counts down the points that may still be looked at.
class Front {
public:
    explicit Front(const Scene& scene) : scene_(scene) {
        for (const Object& object : scene.objects)
            points_ += std::uint64_t{scene.meshes[object.mesh].positions.size()} * object.transforms.size();
    }

    bool tooManyPoints() const { return points_ > kMostPoints; }
    bool gaveUp() const { return looks_ > kMostLooks; }

    bool isEmpty(const Face& face) {
        constexpr double kRounding = 1e-12;  // Of double, many times over.
        if (!largest_) largest_ = largestCoordinate();
        const double least = kRounding * std::max(*largest_, length(face.point));
        const auto inFront = [&](const Vec3d& p, double reach) {
            return dot(p - face.point, face.normal) + reach > least;
        };
        if (inFront(scene_.camera.position, scene_.camera.aperture_radius)) return false;
        for (const Object& object : scene_.objects)
            for (const Matrix4d& transform : object.transforms)
                for (const Vec3d& p : scene_.meshes[object.mesh].positions) {
                    if (++looks_ > kMostLooks || inFront(transformPoint(transform, p), 0)) return false;
                }
        for (const Object& object : scene_.objects)
            for (const Matrix4d& transform : object.transforms)
                if (object.shape &&
                    inFront(transformPoint(transform, {0, 0, 0}), radiusAround(*object.shape, transform)))
                    return false;
        return true;
    }

private:
    double largestCoordinate() const {
        double largest = 0;
        for (const Object& object : scene_.objects)
            for (const Matrix4d& transform : object.transforms)
                for (const Vec3d& p : scene_.meshes[object.mesh].positions)
                    for (const double x : transformPoint(transform, p))
                        largest = std::max(largest, std::abs(x));
        return largest;
    }

    static constexpr std::uint64_t kMostPoints = 20'000'000, kMostLooks = 100'000'000;
    const Scene& scene_;
    std::uint64_t points_ = 0, looks_ = 0;
    std::optional<double> largest_;  ///< Nothing before the first face.
};

std::string nameOf(const Object& object) {
    return object.name.empty() ? "an object without a name" : fmt::format("'{}'", object.name);
}

/// Possible causes in this scene.
std::vector<std::string> reasonsForBlack(const Scene& scene) {
    std::vector<std::string> lamps, one_sided;
    for (const Object& object : scene.objects) {
        const Mesh& mesh = scene.meshes[object.mesh];
        bool emits = object.shape && emissionOf(scene, object, 0) != nullptr;
        for (std::size_t t = 0; t < mesh.triangles.size() && !emits; ++t)
            emits = emissionOf(scene, object, t) != nullptr;
        if (!emits) continue;
        lamps.push_back(nameOf(object));
        if (!oneSidedFaces(scene, object).empty()) one_sided.push_back(nameOf(object));
    }
    const bool sky = scene.environment && scene.environment->radiance.max() > 0;
    if (lamps.empty() && !sky && scene.point_lights.empty()) return {"the scene has no light"};
    std::vector<std::string> reasons;
    if (!one_sided.empty()) {
        constexpr std::size_t kShown = 3;
        const std::size_t shown = std::min(one_sided.size(), kShown);
        reasons.push_back(fmt::format(
            "{}{} may face away: an emitter shines to the side from which its vertices run "
            "counter-clockwise; 'two_sided: true' makes it shine to both",
            fmt::join(one_sided.begin(), one_sided.begin() + static_cast<std::ptrdiff_t>(shown), ", "),
            shown < one_sided.size() ? fmt::format(" and {} more", one_sided.size() - shown) : ""));
    }
    if (scene.integrator.max_depth == 0)
        reasons.emplace_back("'max_depth: 0' shows emitters and no illuminated surfaces");
    if (!scene.point_lights.empty())
        reasons.emplace_back("the camera does not see point, spot and directional lights, neither directly "
                             "nor in mirrors, smooth metals and glass");
    if (!scene.integrator.nee && !sky) reasons.emplace_back("with 'nee: false' few paths hit a small light");
    constexpr double kNarrow = 0.028;  // As of a fov of pi degrees, which may be meant as radians.
    if (const double tangent = std::min(scene.camera.tan_half_width, scene.camera.tan_half_height);
        tangent < kNarrow)
        reasons.push_back(fmt::format("'fov' is in degrees, and the camera sees {:.2g} of them",
                                      std::atan(tangent) * (360 / std::numbers::pi)));
    reasons.emplace_back("the camera may be inside an object, or look past the scene");
    return reasons;
}

}  // namespace

std::vector<std::string> idleLamps(const Scene& scene) {
    std::vector<std::string> idle;
    if (!measuresLight(scene.integrator.type)) return idle;
    Front front(scene);
    if (front.tooManyPoints()) return idle;
    for (const Object& object : scene.objects) {
        const std::vector<Face> faces = oneSidedFaces(scene, object);
        if (!faces.empty() &&
            std::all_of(faces.begin(), faces.end(), [&](const Face& face) { return front.isEmpty(face); }))
            idle.push_back(nameOf(object));
        if (front.gaveUp()) break;
    }
    return idle;
}

namespace {

double brightestLuminance(const Film& film) {
    double brightest = 0;
    for (std::uint32_t y = 0; y < film.shape().height; ++y)
        for (std::uint32_t x = 0; x < film.shape().width; ++x)
            brightest = std::max(brightest, film.mean(x, y, 1));
    return brightest;
}

}  // namespace

void warnOfIdleLamps(const Scene& scene) {
    for (const std::string& lamp : idleLamps(scene))
        logWarning(
            "{} illuminates nothing: it emits on one side only, and neither a surface nor the camera is on "
            "that side; reverse the order of its vertices, or add 'two_sided: true'",
            lamp);
}

void warnOfMissingLight(const Scene& scene) {
    if (const std::vector<std::string> missing = missingLight(scene); !missing.empty())
        logWarning("{}", missingLightText(missing, scene));
    if (const std::optional<DeepGlass> deep = deepGlass(scene))
        logWarning("the image lacks light behind glass in about {:.0f} % of the view: a ray meets up to {} "
                   "surfaces of glass in a row, and 'max_depth: {}' ends its paths there; the stated error "
                   "does not include it; set 'max_depth' to {} or more",
                   100 * deep->share, deep->surfaces, scene.integrator.max_depth, 2 * deep->surfaces + 2);
}

bool isBlack(const Film& film) {
    const std::size_t stride = std::size_t{2} * film.shape().channels;
    for (std::size_t pixel = 0; pixel < film.sums.size(); pixel += stride)
        for (std::size_t i = 0; i < 6; ++i)  // X, Y and Z, each hi and lo.
            if (film.sums[pixel + i] != 0) return false;
    const std::size_t words = film.shape().splatWords();
    for (std::size_t i = 0; i < film.splats.size(); ++i)
        if (film.splats[i] != 0 && i % words + 1 != words) return false;  // The last one counts the dropped.
    return true;
}

void warnOfLargeUnits(const Film& film, const Scene& scene) {
    constexpr double kBlack = 1.5e-4;  // 8 bits of sRGB show less as 0.
    constexpr double kFar = 30;        // In metres: rooms and stages are smaller.
    if (!measuresLight(scene.integrator.type) || scene.metres_per_unit || film.samples.count() == 0)
        return;
    const PointLight* nearest = nullptr;
    double distance = std::numeric_limits<double>::infinity();
    for (const PointLight& light : scene.point_lights) {
        const double away = length(light.position - scene.camera.position);
        if (shinesFromPoint(light.type) && light.strength > 0 && away < distance)
            nearest = &light, distance = away;
    }
    if (nearest == nullptr || distance < kFar) return;
    const double brightest = brightestLuminance(film) * std::exp2(scene.film.exposure_ev);
    if (brightest <= 0 || brightest > kBlack) return;
    logWarning("the image is nearly black: a scene unit is a metre, so the nearest light, '{}', is {:.3g} m "
               "from the camera; if lengths are in millimetres write 'unit: mm'",
               nearest->name, distance);
}

void warnOfBlackFilm(const Film& film, const Scene& scene) {
    if (!measuresLight(scene.integrator.type) || film.samples.count() == 0 || !isBlack(film)) return;
    logWarning("the image is black: no path met a light; {}", fmt::join(reasonsForBlack(scene), "; "));
}

}  // namespace crt
