#include "view/planes.h"

#include "base/error.h"
#include "base/parallel.h"
#include "base/words.h"
#include "film/luminance_error.h"
#include "film/resolve.h"
#include "image/image_io.h"
#include "kernel/dialect/layout.h"
#include "scene/aov.h"
#include "spectra/spectra.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

namespace crt {
namespace {

using Rgb = std::array<double, 3>;
/// Colour of a pixel, in [0, 1] as screens take it.
using Painter = std::function<Rgb(std::size_t pixel)>;

constexpr std::size_t kPixelsAtOnce = 16384;

std::array<std::uint8_t, 3> bytesOf(const Rgb& rgb) {
    std::array<std::uint8_t, 3> bytes{};
    for (std::size_t c = 0; c < 3; ++c) {
        const double value = rgb[c] > 0 ? std::min(rgb[c], 1.0) : 0.0;  // NaN is 0.
        bytes[c] = static_cast<std::uint8_t>(std::lround(value * 255));
    }
    return bytes;
}

void paint(Picture& picture, const Painter& colour) {
    const std::size_t pixels = std::size_t{picture.width} * picture.height;
    picture.rgba.resize(4 * pixels);
    parallelFor(pixels, kPixelsAtOnce, [&](std::size_t first, std::size_t end) {
        for (std::size_t p = first; p < end; ++p) {
            const auto bytes = bytesOf(colour(p));
            std::copy(bytes.begin(), bytes.end(), &picture.rgba[4 * p]);
            picture.rgba[4 * p + 3] = 255;
        }
    });
}

/// Adds a bar of the colours of `colour`, which takes 0 at the low end and 1 at the high end.
void addScale(Picture& picture, ColourScale scale, const std::function<Rgb(double part)>& colour) {
    constexpr int kSteps = 32;
    for (int i = 0; i <= kSteps; ++i)
        scale.colours.push_back(bytesOf(colour(static_cast<double>(i) / kSteps)));
    picture.scales.push_back(std::move(scale));
}

/// The bytes that a PNG of the image has.
void paintImage(Picture& picture, const Image& image) {
    const EncodedImage encoded = encodeSrgb8(image);
    const std::size_t pixels = std::size_t{picture.width} * picture.height;
    picture.rgba.resize(4 * pixels);
    parallelFor(pixels, kPixelsAtOnce, [&](std::size_t first, std::size_t end) {
        for (std::size_t p = first; p < end; ++p) {
            std::copy_n(&encoded.rgb[3 * p], 3, &picture.rgba[4 * p]);
            picture.rgba[4 * p + 3] = 255;
        }
    });
}

/// From dark blue to light yellow, each step lighter than the one before.
Rgb heat(double t) {
    static constexpr std::array<Rgb, 5> kStops{
        {{0.05, 0.05, 0.25}, {0.15, 0.30, 0.60}, {0.15, 0.60, 0.55}, {0.65, 0.80, 0.30}, {1.0, 0.97, 0.75}}};
    const double at = std::clamp(t, 0.0, 1.0) * (kStops.size() - 1);
    const auto stop = std::min(static_cast<std::size_t>(at), kStops.size() - 2);
    const double part = at - static_cast<double>(stop);
    Rgb rgb{};
    for (std::size_t c = 0; c < 3; ++c)
        rgb[c] = kStops[stop][c] + part * (kStops[stop + 1][c] - kStops[stop][c]);
    return rgb;
}

/// Columns of a channel of the image.
class Channel {
public:
    Channel(const Image& image, const std::string& name) : image_(image) {
        const auto found = std::find(image.channels.begin(), image.channels.end(), name);
        if (found == image.channels.end())
            throw Error(ErrorKind::Internal, fmt::format("the image has no channel {}", name));
        index_ = static_cast<std::size_t>(found - image.channels.begin());
    }
    double operator[](std::size_t pixel) const {
        return image_.pixels[pixel * image_.channels.size() + index_];
    }

private:
    const Image& image_;
    std::size_t index_ = 0;
};

void paintAlbedo(Picture& picture, const Image& image, const Channel& r, const Channel& g,
                 const Channel& b) {
    const std::optional<Matrix3d> to_srgb = toLinearSrgb(image);
    picture.legend = "albedo: the share of light that the surface reflects";
    addScale(picture, {}, [](double part) {
        const double c = linearToSrgb(part);
        return Rgb{c, c, c};
    });
    paint(picture, [&](std::size_t p) {
        Rgb rgb{r[p], g[p], b[p]};
        if (to_srgb) rgb = multiply(*to_srgb, rgb);
        for (double& c : rgb) c = linearToSrgb(std::clamp(c, 0.0, 1.0));
        return rgb;
    });
}

void paintDepth(Picture& picture, const Channel& depth) {
    std::vector<double> known;
    for (std::size_t p = 0; p < std::size_t{picture.width} * picture.height; ++p)
        if (depth[p] > 0 && std::isfinite(depth[p])) known.push_back(depth[p]);
    if (known.empty()) return paint(picture, [](std::size_t) { return Rgb{}; });
    const auto at = [&](double part) {
        const auto n = static_cast<std::ptrdiff_t>(part * static_cast<double>(known.size() - 1));
        std::nth_element(known.begin(), known.begin() + n, known.end());
        return known[static_cast<std::size_t>(n)];
    };
    // A few pixels at an edge may be far off.
    const double nearest = at(0.005), farthest = at(0.995);
    const double range = std::max(farthest - nearest, 1e-9 * farthest);
    const auto shade = [](double part) {
        const double light = 0.95 - 0.85 * std::clamp(part, 0.0, 1.0);
        return Rgb{light, light, light};
    };
    picture.legend = "distance along the ray; black: no surface";
    addScale(picture, {.low = nearest, .high = farthest, .unit = "scene units"}, shade);
    paint(picture,
          [&](std::size_t p) { return depth[p] > 0 ? shade((depth[p] - nearest) / range) : Rgb{}; });
}

void paintNormals(Picture& picture, const std::array<Channel, 3>& axes) {
    picture.legend = "components of the normal";
    constexpr std::array<const char*, 3> kNames{"x", "y", "z"};
    for (std::size_t k = 0; k < 3; ++k)
        addScale(picture, {.name = kNames[k], .low = -1, .high = 1}, [&](double part) {
            Rgb rgb{0.5, 0.5, 0.5};
            rgb[k] = part;
            return rgb;
        });
    paint(picture, [&](std::size_t p) {
        return Rgb{0.5 + 0.5 * axes[0][p], 0.5 + 0.5 * axes[1][p], 0.5 + 0.5 * axes[2][p]};
    });
}

void paintPrimitives(Picture& picture, const Image& image) {
    picture.legend = "a colour for each primitive";
    paint(picture, [&](std::size_t p) {
        const std::uint32_t id = image.integers[p];
        if (id == CRT_NONE) return Rgb{};
        Rgb rgb{};
        std::uint32_t hash = id * 2654435761u + 97u;
        for (double& c : rgb) {
            hash ^= hash >> 15;
            hash *= 2246822519u;
            c = 0.2 + 0.75 * ((hash >> 20) & 255) / 255.0;
        }
        return rgb;
    });
}

/// The error of each pixel beside the image's mean luminance, in steps of factors.
void paintError(Picture& picture, const Channel& error, const Channel& r, const Channel& g, const Channel& b,
                const stats::Rgb& weights) {
    const std::size_t pixels = std::size_t{picture.width} * picture.height;
    double sum = 0;
    for (std::size_t p = 0; p < pixels; ++p)
        sum += weights[0] * r[p] + weights[1] * g[p] + weights[2] * b[p];
    const double mean = sum / static_cast<double>(pixels);
    constexpr double kLeast = 1e-3, kDecades = 3;
    picture.legend =
        "standard error of each pixel's luminance, relative to the mean of the image; grey: not yet known";
    const double most = kLeast * std::pow(10.0, kDecades);
    addScale(picture, {.low = 100 * kLeast, .high = 100 * most, .unit = "%", .logarithmic = true}, heat);
    paint(picture, [&](std::size_t p) {
        if (!std::isfinite(error[p]) || !(mean > 0)) return Rgb{0.3, 0.3, 0.3};  // Not known.
        if (!(error[p] > 0)) return heat(0);
        return heat(std::log10(error[p] / mean / kLeast) / kDecades);
    });
}

}  // namespace

const std::vector<std::string>& planeNames() {
    static const std::vector<std::string> names{"image", "error", "albedo", "normal", "depth", "primitive"};
    return names;
}

std::uint32_t aovsOfPlane(const std::string& plane) { return plane == "image" ? 0 : aovNamed(plane); }

std::uint32_t aovsLacking(const Film& film, const std::string& plane) {
    return aovsOfPlane(plane) & kAovsOfFirstHits & ~film.shape().aovs;
}

std::vector<std::string> whiteNames(const Scene& scene) {
    std::vector<std::string> names{"scene", "none"};
    for (const auto& [name, white] : scene.whites) names.push_back(name);
    for (const std::string& name : illuminantNames())
        if (!scene.whites.contains(name)) names.push_back(name);
    return names;
}

Development developmentFor(const Display& display, const Scene& scene) {
    Development development = developmentOf(scene);
    if (display.exposure_ev) development.exposure_ev = *display.exposure_ev;
    if (display.white == "scene") return development;
    const auto whiteOf = [](const Spectrum& light) {
        const Vec3d xyz = spectrumToXyz(light);
        return xyz * (1 / xyz[1]);
    };
    const std::string& white = display.white;
    if (white == "none") {
        development.white = std::nullopt;
    } else if (const auto found = scene.whites.find(white); found != scene.whites.end()) {
        development.white = found->second;
    } else if (const auto light = illuminantSpectrum(white)) {
        development.white = whiteOf(*light);
    } else if (const auto kelvin = parseNumber(white.substr(0, white.find(" K")));
               white.ends_with(" K") && kelvin.value && *kelvin.value >= 1000 && *kelvin.value <= 40000) {
        development.white = whiteOf(blackbodySpectrum(*kelvin.value, true));
    } else {
        const std::string hint = didYouMean(white, whiteNames(scene));
        throw Error(
            ErrorKind::Usage,
            fmt::format("the scene has no light '{}' for white balance; {}", white,
                        hint.empty() ? "use one of its lights, an illuminant, or 1000 K to 40000 K" : hint));
    }
    return development;
}

Picture pictureOf(const Snapshot& snapshot, const Display& display) {
    const Development shown = developmentFor(display, *snapshot.seen->read);
    if (aovsLacking(*snapshot.film, display.plane) != 0)
        throw Error(ErrorKind::Usage,
                    fmt::format("the film does not contain '{}' yet: try again in a moment", display.plane));
    const bool colours = display.plane == "image";
    const Image image =
        resolveImage(*snapshot.film, colours ? shown : shown.forFloats(), aovsOfPlane(display.plane));
    Picture picture;
    picture.width = image.width;
    picture.height = image.height;
    picture.samples = snapshot.film->samples.count();
    picture.divisor = snapshot.divisor;
    picture.run = snapshot.run;
    picture.pose = snapshot.seen->pose;
    picture.plane = display.plane;
    const auto channel = [&](const char* name) { return Channel(image, name); };
    if (colours) {
        paintImage(picture, image);
    } else if (display.plane == "albedo") {
        paintAlbedo(picture, image, channel("Albedo.R"), channel("Albedo.G"), channel("Albedo.B"));
    } else if (display.plane == "normal") {
        paintNormals(picture, {channel("Ns.X"), channel("Ns.Y"), channel("Ns.Z")});
    } else if (display.plane == "depth") {
        paintDepth(picture, channel("Z"));
    } else if (display.plane == "primitive") {
        paintPrimitives(picture, image);
    } else if (display.plane == "error") {
        paintError(picture, channel("StdError.Y"), channel("R"), channel("G"), channel("B"),
                   stats::luminanceWeights(shown.color_space));
    } else {
        throw Error(ErrorKind::Usage, fmt::format("there is no plane '{}'", display.plane));
    }
    return picture;
}

}  // namespace crt
