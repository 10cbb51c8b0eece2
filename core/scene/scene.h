/// The host Scene: what the YAML says, resolved (files read, names looked up, spectra sampled) but still in
/// the author's units and in double. Plain data without behaviour; scene_yaml.cpp fills it, compile.cpp
/// flattens it.
#pragma once

#include "base/error.h"
#include "image/development.h"
#include "image/output_format.h"
#include "scene/aov.h"
#include "scene/clear_sky.h"
#include "scene/ies_file.h"
#include "scene/integrator_type.h"
#include "scene/material.h"
#include "scene/spectral_film.h"
#include "scene/texture.h"
#include "spectra/spectra.h"

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace crt {

/// Row-major 4×4 affine transform, points as columns.
using Matrix4d = std::array<double, 16>;
inline constexpr Matrix4d kIdentity4d{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
/// b, then a.
inline Matrix4d multiply(const Matrix4d& a, const Matrix4d& b) {
    Matrix4d m{};
    for (std::size_t r = 0; r < 4; ++r)
        for (std::size_t c = 0; c < 4; ++c)
            for (std::size_t i = 0; i < 4; ++i) m[4 * r + c] += a[4 * r + i] * b[4 * i + c];
    return m;
}

/// Perspective camera, right-handed world; image right = normalise(target − position) × up.
struct Camera {
    Vec3d position{0, 0, 0};
    Vec3d target{0, 0, 1};
    Vec3d up{0, 1, 0};
    /// Half the image plane's extent at unit distance: tan(fov/2) on the shorter side, or
    /// sensor/(2·focal_length).
    double tan_half_width = 0.5;
    double tan_half_height = 0.5;
    double aperture_radius = 0;  ///< Scene units; 0 is a pinhole.
    double focus_distance =
        0;  ///< Scene units along the view axis; 0 means distance to target. Only used with an aperture.
    SourcePlace place;
};

enum class PixelFilter { Box, Gaussian, BlackmanHarris };

struct FilmSettings {
    int width = 512;
    int height = 512;
    std::array<int, 4> crop{0, 0, 0,
                            0};  ///< x0, y0, x1, y1, half open, in pixels; all zero means the whole film.
    PixelFilter filter = PixelFilter::Box;
    double filter_radius = 0.5;  ///< Pixels. Box .5, gaussian 1.5 and Blackman–Harris 1.5 by default.
    double filter_sigma = 0.5;   ///< Pixels, gaussian only.
    ColorSpace color_space = ColorSpace::LinearSrgb;
    std::optional<Spectrum> white_balance;  ///< Adapt from this illuminant's white to the colour space's.
    double exposure_ev = 0;                 ///< The image is multiplied by 2^ev.
    bool apply_to_float = false;            ///< EXR and PFM get white balance and exposure too.
    ViewTransform view = ViewTransform::None;  ///< Of PNG, JPEG and PPM.
    SpectralFilm spectral;                  ///< Beside X, Y and Z.
};

enum class Accelerator { Auto, Bvh, Aabb, None };

struct IntegratorSettings {
    IntegratorType type = IntegratorType::Path;
    int max_depth = 16;       ///< Scattering events; 0 shows emitters only.
    int roulette_depth = 4;   ///< First scattering event after which Russian roulette may end a path.
    bool roulette = true;
    bool nee = true;          ///< Next event estimation; false is the paper's indirect-only estimator.
    bool mis = true;  ///< Combines it with scattered rays that meet lights; false: light sampling alone
                      ///< where it can.
    Accelerator accelerator = Accelerator::Auto;
};

enum class SamplerType { Sobol, Independent, XorShift };

struct SamplerSettings {
    SamplerType type = SamplerType::Sobol;
    std::uint64_t seed = 0;
    std::uint64_t samples = 64;  ///< Samples per pixel when neither --spp nor --time says otherwise.
    int replicates = 0;          ///< 1, 2, 4, 8, 16, or 0: by the size of the film (replicatesOf).
};

/// A triangle mesh in object space. Polygons are already triangulated.
struct Mesh {
    std::vector<Vec3d> positions;
    std::vector<Vec3d> normals;                           ///< Empty, or referenced by `normal_index`.
    std::vector<std::array<std::uint32_t, 3>> triangles;  ///< Indices into positions.
    std::vector<std::array<std::uint32_t, 3>>
        normal_index;                    ///< Empty, or one per triangle; kNoNormal = flat.
    /// Texture coordinates, v up; empty, or referenced by `uv_index`.
    std::vector<std::array<double, 2>> uvs;
    std::vector<std::array<std::uint32_t, 3>> uv_index;  ///< Empty, or one per triangle; kNoUv = none.
    /// The first of each pair is the opacity of a vertex, for textures that ask for it and no others.
    bool uvs_are_opacity = false;
    /// Linear sRGB in [0, 1], as of `positions`; or empty.
    std::vector<std::array<float, 3>> colors;
    std::vector<std::int32_t> material;  ///< Empty, or one index into Scene::materials per triangle.
    std::vector<std::int32_t>
        emission;  ///< Empty, or one index into Scene::emissions per triangle, −1 none.
};
inline constexpr std::uint32_t kNoNormal = 0xffffffffu;
inline constexpr std::uint32_t kNoUv = 0xffffffffu;

struct Emission {
    Spectrum radiance;  ///< W·m⁻²·sr⁻¹·nm⁻¹
    bool two_sided = false;
    /// An image whose factor is the radiance, in place of it. Not of shapes.
    TextureIndex texture = kNoTexture;
};

enum class QuadricType { Sphere, Disk, Cylinder };

/// A surface of the second order around the origin and the axis z. Whole, or what is left of it where z is
/// in a range.
struct Quadric {
    QuadricType type = QuadricType::Sphere;
    double radius = 1;
    double from_z = -1, to_z = 1;  ///< Of a sphere −radius to radius and less; of a disk 0.
    bool inward = false;           ///< Spheres and cylinders: normals point to the axis.
};

/// "a sphere"
const char* wordOf(QuadricType type);
/// Of its one side.
double areaOf(const Quadric& shape);
/// The factor by which a transform scales lengths; nothing if the scale depends on the direction.
std::optional<double> evenScaleOf(const Matrix4d& transform);
/// Of one that does: what is wrong with that, behind wordOf.
inline constexpr const char* kShapesStayShapes =
    "is scaled by the same factor in every direction: a transform must not stretch or shear it";

/// True if the places of an object share one copy of its mesh.
enum class Sharing { Auto, Always, Never };

/// A mesh or a shape, placed once per transform.
struct Object {
    std::string name;
    Sharing sharing = Sharing::Auto;
    std::uint32_t mesh = 0;                    ///< Index into Scene::meshes.
    std::optional<Quadric> shape{};              ///< In place of the mesh, which is an empty one then.
    std::vector<Matrix4d> transforms{kIdentity4d};
    std::int32_t material =
        -1;  ///< Index into Scene::materials; used where the mesh itself has no material.
    std::int32_t emission =
        -1;  ///< Index into Scene::emissions, −1 none; used where the mesh itself has none.
    SourcePlace place;
};

enum class PointLightType { Point, Spot, Directional, Sun, Ies, Beam };
/// Their names in scene files.
inline constexpr std::pair<PointLightType, const char*> kPointLightNames[] = {
    {PointLightType::Point, "point"},
    {PointLightType::Spot, "spot"},
    {PointLightType::Directional, "directional"},
    {PointLightType::Sun, "sun"},
    {PointLightType::Ies, "ies"},
    {PointLightType::Beam, "beam"}};
/// True if its strength is an intensity, which is per solid angle.
constexpr bool shinesFromPoint(PointLightType type) {
    return type != PointLightType::Directional && type != PointLightType::Sun &&
           type != PointLightType::Beam;
}

/// A light without a surface.
struct PointLight {
    std::string name;
    PointLightType type = PointLightType::Point;
    Spectrum spectrum;    ///< Times `strength`.
    /// Radiant intensity (Point; Spot, on its axis; Ies, where it is greatest), W·sr⁻¹·nm⁻¹;
    /// irradiance of a plane that faces it (Directional, Beam), W·m⁻²·nm⁻¹; or radiance (Sun),
    /// W·m⁻²·sr⁻¹·nm⁻¹: per unit of the spectrum.
    double strength = 1;
    Vec3d position{};                 ///< Point, Spot, Ies; Beam: middle of the section it begins with.
    Vec3d direction{0, -1, 0};        ///< Unit, the way that the light goes. All but Point.
    double cone_angle_deg = 30;       ///< Spot: from the axis to the edge.
    double penumbra_deg = 5;          ///< Spot: the outer part of that angle, where the light falls to 0.
    double angular_diameter_deg = 0.53;  ///< Sun.
    std::shared_ptr<const IesProfile> ies{};  ///< Ies. Not black.
    /// Ies: where the horizontal angle 0 is; Beam: along the slit's width. Unit, perpendicular to the
    /// direction.
    Vec3d across{1, 0, 0};
    double radius = 1;             ///< Beam: of its disk; or 0: a slit of
    double width = 0, height = 0;  ///< this size.
    SourcePlace place;
};

/// Calls visit(member) for the members that decide what the light of a light is.
template <class Visit>
void visitMembers(const PointLight& light, const Visit& visit) {
    const auto& [name, type, spectrum, strength, position, direction, cone_angle_deg, penumbra_deg,
                 angular_diameter_deg, ies, across, radius, width, height, place] = light;
    visit(type);
    visit(spectrum);
    for (const Vec3d* vector : {&position, &direction, &across})
        for (const double x : *vector) visit(x);
    for (const double number :
         {strength, cone_angle_deg, penumbra_deg, angular_diameter_deg, radius, width, height})
        visit(number);
    if (ies)
        for (const auto* values : {&ies->vertical_deg, &ies->horizontal_deg, &ies->candela}) visit(*values);
}

/// Frame of a distant light: perpendicular unit vectors.
struct Axes {
    Vec3d right{1, 0, 0}, up{0, 1, 0}, ahead{0, 0, -1};
};

/// A file of latitudes (rows, from `up` down) and longitudes (columns, the middle one `ahead`).
struct EnvironmentImage {
    std::string file;
    double scale = 1;  ///< Times linear sRGB: radiance, as that of a spectrum {rgb: …}.
    Axes axes;
    SourcePlace place;
};

/// A CIE standard general sky (cie_sky.h).
struct CieSky {
    int type = 12;            ///< 1 to 15.
    Vec3d towards_sun{0, 1, 0};  ///< Unit.
    bool horizontal = false;  ///< Meaning of `amount`.
    double amount = 1;  ///< Radiance of the zenith or irradiance of the ground, per unit of the spectrum.
    Axes axes;                ///< The zenith is `up`.
    int rows = 256;           ///< Of the image that it becomes, twice as wide.
};

/// A clear sky with the colours of its light (clear_sky.h). Its sun is a separate light.
struct ClearSky {
    double turbidity = 3;  ///< 1 to 10.
    SkyValues ground_albedo{};
    Vec3d towards_sun{0, 1, 0};  ///< Unit, not below the horizon.
    double scale = 1;            ///< Times the model's radiance.
    Axes axes;                   ///< The zenith is `up`.
    int rows = 256;              ///< Of the image that it becomes, twice as wide.

    /// Of the sun at its elevation.
    ClearSkyModel model() const;
};

struct Environment {
    Spectrum radiance;            ///< The same in every direction; or times what `image` or a sky has.
    bool light_sampling = false;  ///< Is it a light to sample, or left to scattered rays?
    std::optional<EnvironmentImage> image{};
    std::optional<CieSky> sky{};
    std::optional<ClearSky> clear_sky{};

    bool dependsOnDirection() const { return image || sky || clear_sky; }
};

struct Output {
    std::string file;  ///< As resolved: absolute or relative to the working directory.
    OutputFormat format = OutputFormat::Exr;
    std::uint32_t aovs = 0;  ///< Bits of Aov; EXR only.
    SourcePlace place;
};

struct Scene {
    std::string file;   ///< Path of the YAML, or a name for scenes made in memory.
    std::string title;
    std::optional<double> metres_per_unit;  ///< Nothing: the scene does not say, and a unit is a metre.
    Camera camera;
    FilmSettings film;
    IntegratorSettings integrator;
    SamplerSettings sampler;
    std::vector<Material> materials;
    std::vector<Texture> textures;  ///< Those of a pattern before it.
    std::vector<Emission> emissions;
    std::vector<Mesh> meshes;
    std::vector<Object> objects;
    std::vector<PointLight> point_lights;
    std::optional<Environment> environment;
    std::vector<Output> outputs;
    std::map<std::string, Vec3d> whites;  ///< Named spectra that are lights, with luminance: XYZ with Y = 1.
    std::vector<std::string> files_read;  ///< Every file that went into the scene, the YAML first.
    std::uint64_t input_bytes = 0;        ///< Of all of them; 0 for a scene made in memory.
    double parse_seconds = 0;
};

/// The channels of its film beside those of kernel/dialect/channels.h. Views show no spectrum.
inline SpectralChannels spectralChannelsOf(const Scene& scene) {
    SpectralChannels channels;
    if (!measuresLight(scene.integrator.type)) return channels;
    channels.bins = scene.film.spectral.bins;
    for (const SensorResponse& response : scene.film.spectral.responses)
        channels.responses.push_back(response.name);
    return channels;
}

/// As scene.film says. Throws crt::Error(Scene) when the illuminant of the white balance has no visible
/// light.
Development developmentOf(const Scene& scene);

/// Emission of a triangle of the object's mesh, an index into Scene::emissions: of the file's material, of
/// the scene's, or of the object; −1: it emits nothing.
inline std::int32_t emissionIndexOf(const Scene& scene, const Object& object, const Mesh& mesh,
                                    std::size_t triangle) {
    if (!mesh.emission.empty() && mesh.emission[triangle] >= 0) return mesh.emission[triangle];
    const std::int32_t own = mesh.material.empty() ? -1 : mesh.material[triangle];
    const std::int32_t material = own >= 0 ? own : object.material;
    if (material >= 0 && static_cast<std::size_t>(material) < scene.materials.size())
        if (const std::int32_t shines = scene.materials[static_cast<std::size_t>(material)].emission;
            shines >= 0)
            return shines;
    return object.emission;
}
inline std::int32_t emissionIndexOf(const Scene& scene, const Object& object, std::size_t triangle) {
    return emissionIndexOf(scene, object, scene.meshes[object.mesh], triangle);
}

/// Number of independent sequences of the samples of a pixel (layout.h: CRT_REPLICATES_MAX); 1: the film
/// keeps no sums of replicates. By default as few as give the image's error a thousand degrees of freedom,
/// since the pixels of a film add theirs up and every further sequence costs noise. By the whole film, so
/// that the crop window of an image has its bits.
inline int replicatesOf(const Scene& scene) {
    if (!measuresLight(scene.integrator.type)) return 1;
    if (scene.sampler.replicates != 0) return scene.sampler.replicates;
    constexpr std::int64_t kDegreesOfFreedom = 1000, kMost = 16;
    const std::int64_t pixels = std::int64_t{scene.film.width} * scene.film.height;
    std::int64_t replicates = 2;
    while (replicates < kMost && (replicates - 1) * pixels < kDegreesOfFreedom) replicates *= 2;
    return static_cast<int>(replicates);
}

}  // namespace crt
