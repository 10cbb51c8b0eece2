#include "compile/settings.h"

#include "base/error.h"
#include "base/log.h"
#include "base/vec3d.h"
#include "kernel/sampling/sampler.h"
#include "scene/aov.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

namespace crt {
namespace {

/// By a power of two first, so that no square overflows or vanishes.
Vec3d normalise(const Vec3d& v) {
    int exponent = 0;
    std::frexp(std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])}), &exponent);
    const Vec3d near_one = v * std::ldexp(1.0, -exponent);
    return near_one * (1.0 / std::sqrt(dot(near_one, near_one)));
}

/// Contents of the film: the channels of first hits that outputs need, those for its error, and splats.
std::uint32_t filmAovs(const Scene& scene, std::uint32_t aovs) {
    const bool color_error = (aovs & kAovColorError) != 0;
    if (color_error && (replicatesOf(scene) < 2 || splats(scene.integrator.type))) {
        const auto asks = std::find_if(scene.outputs.begin(), scene.outputs.end(), [](const Output& output) {
            return (output.aovs & kAovColorError) != 0;
        });
        throw Error(ErrorKind::Scene,
                    "the AOV 'color_error' is the spread between replicates, of each pixel's own samples: "
                    "'sampler.replicates' must be 2 or more, and the integrator one that does not splat",
                    asks != scene.outputs.end() ? asks->place : SourcePlace());
    }
    return (aovs & (kAovsOfFirstHits | kAovColorError)) |
           (replicatesOf(scene) > 1 ? kAovReplicates : kAovSquares) |
           (splats(scene.integrator.type) ? std::uint32_t{kAovSplats} : 0);
}

/// Bins and responses are of a pixel's own samples.
void requireNoSpectrum(const Scene& scene) {
    if (splats(scene.integrator.type) && spectralChannelsOf(scene).count() > 0)
        throw Error(ErrorKind::Scene,
                    fmt::format("integrator.type {} adds samples to other pixels than their own, which "
                                "film.spectral and film.responses cannot hold: remove them",
                                rowOf(scene.integrator.type).word));
}

/// Channels and replicates.
void setChannels(const Scene& scene, std::uint32_t aovs, kernel::CrtScene& header) {
    header.aovs = aovs;
    const auto replicates = static_cast<std::uint32_t>(replicatesOf(scene));
    header.channels = channelsFor(aovs, replicates) + spectralChannelsOf(scene).count();
    header.replicate_shift = static_cast<std::uint32_t>(std::bit_width(replicates) - 1);
#define CRT_SET_CHANNEL(bit, NAME, Name, stem, width, SOURCE, name, exr) \
    header.stem##_channel = firstChannel(aovs, kAov##Name);
    CRT_CHANNEL_LIST(CRT_SET_CHANNEL)
#undef CRT_SET_CHANNEL
}

/// Largest distance from the scene, whose coordinates are within ±1. Farther off, products of coordinates
/// exceed the range of single precision.
constexpr double kFarthest = 1e15;

/// Throws unless distances along rays from the camera are numbers, in scene units.
void requireDepths(const Scene& scene, const kernel::CrtScene& header) {
    if ((header.aovs & kAovDepth) == 0) return;
    const kernel::CrtCamera& camera = header.camera;
    double reach = 4;
    for (const float x : camera.origin) reach += std::abs(static_cast<double>(x));
    const double farthest = reach * static_cast<double>(header.depth_scale);
    if (!(farthest < static_cast<double>(std::numeric_limits<float>::max())))
        throw Error(ErrorKind::Scene,
                    "distances in the scene are too large for single precision: scale the scene down, or "
                    "remove 'depth' from 'aovs'",
                    scene.camera.place);
}

/// Centred, and scaled by 2^scale_exponent.
kernel::CrtCamera cameraOf(const Scene& scene, const Vec3d& centre, int scale_exponent) {
    const Camera& camera = scene.camera;
    const Vec3d view = normalise(camera.target - camera.position);
    const Vec3d right = normalise(cross(view, camera.up));
    const Vec3d up = cross(right, view);
    const double scale = std::ldexp(1.0, scale_exponent);
    kernel::CrtCamera c{};
    for (std::size_t k = 0; k < 3; ++k) {
        c.origin[k] = static_cast<float>((camera.position[k] - centre[k]) * scale);
        c.corner[k] =
            static_cast<float>(view[k] - right[k] * camera.tan_half_width + up[k] * camera.tan_half_height);
        c.step_x[k] = static_cast<float>(right[k] * 2 * camera.tan_half_width / scene.film.width);
        c.step_y[k] = static_cast<float>(-up[k] * 2 * camera.tan_half_height / scene.film.height);
        c.lens_x[k] = static_cast<float>(right[k]);
        c.lens_y[k] = static_cast<float>(up[k]);
        if (!std::isfinite(c.corner[k] + c.step_x[k] + c.step_y[k]) ||
            !(std::abs(static_cast<double>(c.origin[k])) <= kFarthest))
            throw Error(ErrorKind::Scene, "the camera is too far from the scene for single precision",
                        camera.place);
    }
    // Unit directions in single precision are 2^-24 apart; two of them a pixel is the least that tells
    // pixels apart.
    const double pixel =
        2 * std::min(camera.tan_half_width / scene.film.width, camera.tan_half_height / scene.film.height);
    if (pixel < std::ldexp(1.0, -23))
        logWarning(
            "a pixel is {:.2g} radians wide, finer than directions in single precision ({:.2g}): "
            "neighbouring pixels will repeat each other; "
            "use fewer pixels, a wider field of view, or a nearer camera",
            pixel, std::ldexp(1.0, -23));
    const Vec3d to_target = camera.target - camera.position;
    const double focus =
        camera.focus_distance > 0 ? camera.focus_distance : std::sqrt(dot(to_target, to_target));
    if (!(camera.aperture_radius * scale <= kFarthest))
        throw Error(ErrorKind::Scene, "the camera's aperture is too large for single precision",
                    camera.place);
    if (camera.aperture_radius > 0 && !(focus * scale <= kFarthest))
        throw Error(ErrorKind::Scene, "the focus distance of the camera is too large for single precision",
                    camera.place);
    c.lens_radius = static_cast<float>(camera.aperture_radius * scale);
    c.focus_distance = static_cast<float>(focus * scale);
    return c;
}

/// Integrator, sampler, seed, depths, light sampling.
void setIntegrator(const Scene& scene, kernel::CrtScene& header) {
    header.integrator = static_cast<std::uint32_t>(scene.integrator.type);
    switch (scene.sampler.type) {
        case SamplerType::Sobol: header.sampler = CRT_SAMPLER_SOBOL; break;
        case SamplerType::Independent: header.sampler = CRT_SAMPLER_INDEPENDENT; break;
        case SamplerType::XorShift: header.sampler = CRT_SAMPLER_XORSHIFT; break;
    }
    header.seed = kernel::crt_seed(static_cast<std::uint32_t>(scene.sampler.seed),
                                   static_cast<std::uint32_t>(scene.sampler.seed >> 32));
    header.max_depth = std::min(static_cast<std::uint32_t>(scene.integrator.max_depth), CRT_MOST_EVENTS);
    header.roulette_depth =
        scene.integrator.roulette ? static_cast<std::uint32_t>(scene.integrator.roulette_depth) : CRT_NONE;
    header.nee = !scene.integrator.nee ? CRT_NEE_NONE : scene.integrator.mis ? CRT_NEE_MIS : CRT_NEE_ONLY;
}

}  // namespace

void compileView(const Scene& scene, const Vec3d& centre, int scale_exponent, kernel::CrtScene& header) {
    const FilmSettings& film = scene.film;
    header.film_width = static_cast<std::uint32_t>(film.width);
    header.film_height = static_cast<std::uint32_t>(film.height);
    const bool cropped = film.crop != std::array<int, 4>{0, 0, 0, 0};
    header.crop_x = cropped ? static_cast<std::uint32_t>(film.crop[0]) : 0;
    header.crop_y = cropped ? static_cast<std::uint32_t>(film.crop[1]) : 0;
    header.width = cropped ? static_cast<std::uint32_t>(film.crop[2] - film.crop[0]) : header.film_width;
    header.height = cropped ? static_cast<std::uint32_t>(film.crop[3] - film.crop[1]) : header.film_height;
    header.camera = cameraOf(scene, centre, scale_exponent);
}

double splatScale(double power) {
    const bool is_known = std::isnormal(power) && power > 0;
    return std::ldexp(1.0, 32 - std::clamp(is_known ? std::ilogb(power) : 0, -900, 900));
}

kernel::CrtScene compileSettings(const Scene& scene, const FlatScene& flat, std::uint32_t aovs) {
    kernel::CrtScene header{};
    header.magic = CRT_SCENE_MAGIC;
    requireNoSpectrum(scene);
    setChannels(scene, filmAovs(scene, aovs), header);
    header.depth_scale = static_cast<float>(std::ldexp(1.0, -flat.scale_exponent));
    compileView(scene, flat.centre, flat.scale_exponent, header);
    requireDepths(scene, header);
    setIntegrator(scene, header);
    return header;
}

}  // namespace crt
