// Over 450 lines: what is written of each part stands beside what is read of it.
#include "film/film_record.h"

#include "base/byte_hash.h"
#include "base/error.h"
#include "base/json_integer.h"
#include "base/memory_reserve.h"
#include "base/vec3d.h"
#include "base/words.h"
#include "scene/aov.h"
#include "scene/missing_light.h"
#include "scene/scene.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <set>
#include <type_traits>

namespace crt {
namespace {

using Json = nlohmann::json;

constexpr std::uint64_t kRecordVersion = 1;

// ---- Camera ---------------------------------------------------------------------------------------------

Vec3d normalised(const Vec3d& v) { return v * (1 / length(v)); }

/// p · M has the components dot(axis, p − origin) + offset·w, one for each column.
struct Column {
    Vec3d axis{};
    double offset = 0;
};
RowMatrix4d matrixOf(const std::array<Column, 4>& columns, const Vec3d& origin) {
    RowMatrix4d m{};
    for (std::size_t c = 0; c < 4; ++c) {
        for (std::size_t r = 0; r < 3; ++r) m[r * 4 + c] = columns[c].axis[r];
        m[12 + c] = columns[c].offset - dot(columns[c].axis, origin);
    }
    return m;
}

void addCamera(FilmRecord& record, const Camera& camera) {
    const Vec3d view = normalised(camera.target - camera.position);
    const Vec3d right = normalised(cross(view, camera.up)), up = cross(right, view);
    const Vec3d back{-view[0], -view[1], -view[2]};
    record.world_to_camera = matrixOf({{{right}, {up}, {back}, {{}, 1}}}, camera.position);
    // x / depth runs from −tan_half_width to tan_half_width, and depth is w. The depth of the result is 1
    // / depth: no reader needs it, but a matrix that has an inverse is of more use than one that has none.
    const Vec3d x = right * (0.5 / camera.tan_half_width) + view * 0.5;
    const Vec3d y = view * 0.5 - up * (0.5 / camera.tan_half_height);
    record.world_to_ndc = matrixOf({{{x}, {y}, {{}, 1}, {view}}}, camera.position);
}

// ---- Traits ---------------------------------------------------------------------------------------------

class Digest {
public:
    template <class Number>
    void add(Number number) {
        static_assert(std::is_arithmetic_v<Number> || std::is_enum_v<Number>);
        hash_.add(&number, sizeof number);
    }
    /// The size goes first, so that no item moves from one array to the next unseen.
    template <class Item>
    void add(const std::vector<Item>& items) {
        static_assert(std::is_trivially_copyable_v<Item>);
        add(std::uint64_t{items.size()});
        if (!items.empty()) hash_.add(items.data(), items.size() * sizeof(Item));
    }
    void add(const Spectrum& spectrum) {
        for (const double value : spectrum.values) add(value);
    }
    std::string digits() const { return fmt::format("{:016x}", hash_.digest64()); }

private:
    ByteHash hash_;
};

std::string vectorText(const Vec3d& v) { return fmt::format("({}, {}, {})", v[0], v[1], v[2]); }

std::string cameraText(const Camera& c) {
    std::string text =
        fmt::format("at {} looking at {}, up {}, {:.4g} × {:.4g} wide at distance 1",
                    vectorText(c.position),
                    vectorText(c.target), vectorText(c.up), 2 * c.tan_half_width, 2 * c.tan_half_height);
    if (c.aperture_radius > 0)
        text += fmt::format(", lens of radius {} focused at {}", c.aperture_radius, c.focus_distance);
    return text;
}

std::string filterText(const FilmSettings& film) {
    switch (film.filter) {
        case PixelFilter::Box: return fmt::format("box of radius {}", film.filter_radius);
        case PixelFilter::Gaussian:
            return fmt::format("gaussian of radius {} and sigma {}", film.filter_radius, film.filter_sigma);
        case PixelFilter::BlackmanHarris: break;
    }
    return fmt::format("Blackman-Harris of radius {}", film.filter_radius);
}

constexpr const char* kIntegratorTrait = "the integrator";
const char* samplerText(SamplerType type) {
    return type == SamplerType::Sobol         ? "sobol"
           : type == SamplerType::Independent ? "independent"
                                              : "xorshift";
}
std::string counted(std::uint64_t n, const char* one, const char* many) {
    return fmt::format("{} {}", n, n == 1 ? one : many);
}
const char* onOff(bool on) { return on ? "on" : "off"; }

std::string planesText(std::uint32_t aovs) {
    std::string text;
    for (const AovRow& row : kAovRows)
        if ((aovs & kAovsOfFirstHits & row.aov) != 0)
            text += fmt::format("{}{}", text.empty() ? "" : ", ", row.name);
    return text.empty() ? "none" : text;
}

SceneTrait geometryTrait(const Scene& scene) {
    Digest digest;
    std::uint64_t triangles = 0, shapes = 0, placements = 0;
    for (const Mesh& mesh : scene.meshes) {
        // Only textures use the coordinates.
        const auto& [positions, normals, corners, normal_index, uvs, uv_index, uvs_are_opacity, colors,
                     material, emission] = mesh;
        digest.add(positions);
        digest.add(normals);
        digest.add(corners);
        digest.add(normal_index);
        digest.add(uvs);
        digest.add(uv_index);
        digest.add(colors);
        digest.add(material);
        digest.add(emission);
    }
    for (const Object& object : scene.objects) {
        digest.add(object.mesh);
        if (object.shape) {
            const Quadric& shape = *object.shape;
            digest.add(std::vector<double>{static_cast<double>(shape.type), shape.radius, shape.from_z,
                                           shape.to_z, shape.inward ? 1.0 : 0.0});
            shapes += object.transforms.size();
        }
        digest.add(object.transforms);
        digest.add(object.material);
        digest.add(object.emission);
        // Corners of instances are rounded otherwise.
        if (object.sharing != Sharing::Auto) digest.add(object.sharing);
        placements += object.transforms.size();
        triangles += object.transforms.size() * scene.meshes[object.mesh].triangles.size();
    }
    return {"the geometry",
            fmt::format("{}{} in {}", counted(triangles, "triangle", "triangles"),
                        shapes > 0 ? fmt::format(" and {}", counted(shapes, "shape", "shapes")) : "",
                        counted(placements, "object", "objects")),
            digest.digits()};
}

// Structured bindings name every member: a new member does not compile until a trait contains it.

SceneTrait materialsTrait(const Scene& scene) {
    Digest digest;
    const auto add = [&digest](const auto& member) { digest.add(member); };
    for (const Material& material : scene.materials) visitMembers(material, add);
    return {"the materials", counted(scene.materials.size(), "material", "materials"), digest.digits()};
}

/// Of images their names and sizes: their texels are read by compilation alone.
void addTexture(Digest& digest, const Texture& texture) {
    const auto& [kind, image, filter, wrap, values, numbers, factor, transform, of_opacity, place] = texture;
    digest.add(kind);
    digest.add(filter);
    digest.add(wrap);
    for (const TextureValue& value : values) {
        digest.add(value.spectrum);
        digest.add(value.texture);
    }
    for (const double number : numbers) digest.add(number);
    for (const double number : transform) digest.add(number);
    if (factor) {
        digest.add(factor->spectrum);
        digest.add(factor->texture);
    }
    if (!image) return;
    if (of_opacity) digest.add(of_opacity);
    digest.add(std::vector<char>(image->file.begin(), image->file.end()));
    for (const std::uint32_t size : {image->width, image->height}) digest.add(size);
    digest.add(image->kind);
}

SceneTrait texturesTrait(const Scene& scene) {
    Digest digest;
    for (const Texture& texture : scene.textures) addTexture(digest, texture);
    return {"the textures", counted(scene.textures.size(), "texture", "textures"), digest.digits()};
}

SceneTrait lightsTrait(const Scene& scene) {
    Digest digest;
    for (const Emission& emission : scene.emissions) {
        digest.add(emission.two_sided);
        digest.add(emission.radiance);
        if (emission.texture != kNoTexture) digest.add(emission.texture);
    }
    if (scene.environment) {
        digest.add(scene.environment->radiance);
        if (scene.environment->light_sampling) digest.add(true);
        const auto add_axes = [&digest](const Axes& axes) {
            for (const Vec3d& axis : {axes.right, axes.up, axes.ahead})
                for (const double x : axis) digest.add(x);
        };
        if (const auto& image = scene.environment->image) {
            digest.add(std::vector<char>(image->file.begin(), image->file.end()));
            digest.add(image->scale);
            add_axes(image->axes);
        }
        if (const auto& sky = scene.environment->sky) {
            for (const double x : sky->towards_sun) digest.add(x);
            digest.add(sky->type);
            digest.add(sky->horizontal);
            digest.add(sky->amount);
            digest.add(sky->rows);
            add_axes(sky->axes);
        }
        if (const auto& sky = scene.environment->clear_sky) {
            for (const double x : sky->towards_sun) digest.add(x);
            for (const double x : sky->ground_albedo) digest.add(x);
            digest.add(sky->turbidity);
            digest.add(sky->scale);
            digest.add(sky->rows);
            add_axes(sky->axes);
        }
    }
    const auto add = [&digest](const auto& member) { digest.add(member); };
    for (const PointLight& light : scene.point_lights) visitMembers(light, add);
    const std::string without_surface =
        scene.point_lights.empty()
            ? std::string()
            : fmt::format(", {} without a surface", counted(scene.point_lights.size(), "light", "lights"));
    return {
        "the light",
        fmt::format("{}{}, {} environment", counted(scene.emissions.size(), "kind of lamp", "kinds of lamp"),
                    without_surface, scene.environment ? "an" : "no"),
        digest.digits()};
}

SceneTrait spectralTrait(const Scene& scene) {
    const SpectralChannels channels = spectralChannelsOf(scene);
    if (channels.count() == 0) return {"the spectral film", "none", {}};
    Digest digest;
    digest.add(channels.bins.from_nm);
    digest.add(channels.bins.to_nm);
    digest.add(scene.film.spectral.normalise);
    for (const SensorResponse& response : scene.film.spectral.responses) digest.add(response.spectrum);
    return {"the spectral film", spectralText(channels), digest.digits()};
}

std::vector<SceneTrait> traitsOf(const Scene& scene, std::uint32_t aovs) {
    const auto& [x0, y0, x1, y1] = scene.film.crop;
    const IntegratorSettings& i = scene.integrator;
    return {{"the resolution", fmt::format("{} × {}", scene.film.width, scene.film.height), {}},
            {"the crop window",
             x1 > x0 ? fmt::format("[{}, {}, {}, {}]", x0, y0, x1, y1) : "the whole film",
             {}},
            {"the filter", filterText(scene.film), {}},
            {"the seed", std::to_string(scene.sampler.seed), {}},
            {"the sampler", samplerText(scene.sampler.type), {}},
            {"the replicates", std::to_string(replicatesOf(scene)), {}},
            {kIntegratorTrait, rowOf(i.type).word, {}},
            {"max_depth", std::to_string(i.max_depth), {}},
            {"roulette", i.roulette ? fmt::format("on from depth {}", i.roulette_depth) : "off", {}},
            {"nee", onOff(i.nee), {}},
            {"mis", onOff(i.mis), {}},
            {"the camera", cameraText(scene.camera), {}},
            geometryTrait(scene),
            materialsTrait(scene),
            texturesTrait(scene),
            lightsTrait(scene),
            {"the AOVs of first hits", planesText(aovs), {}},
            spectralTrait(scene)};
}

// ---- JSON -----------------------------------------------------------------------------------------------

constexpr std::array<const char*, 3> kSpaceNames{"srgb", "acescg", "xyz"};  // In the order of ColorSpace.

Json developmentJson(const Development& development) {
    Json json{{"color_space", kSpaceNames[static_cast<std::size_t>(development.color_space)]},
              {"exposure_ev", development.exposure_ev},
              {"apply_to_float", development.apply_to_float}};
    if (development.white) json["white_xyz"] = *development.white;
    if (development.view != ViewTransform::None)
        json["view"] = kViewTransformNames[static_cast<std::size_t>(development.view)];
    return json;
}

/// Numbers that an image is made with must be ones that a scene could have.
double inRange(const Json& json, double least, double most) {
    const double value = json.get<double>();
    if (!(value >= least && value <= most))
        throw Error(ErrorKind::Usage, fmt::format("has {} for a number", value));
    return value;
}

Vec3d whiteFrom(const Json& json) {
    constexpr double kMost = 1e12;  // Of a colour with Y = 1.
    Vec3d white{};
    for (std::size_t c = 0; c < 3; ++c)
        white[c] = inRange(json.at(c), c == 1 ? 1 : -kMost, c == 1 ? 1 : kMost);
    return white;
}

Development developmentFrom(const Json& json) {
    Development development;
    const auto name = json.at("color_space").get<std::string>();
    const auto found = std::find(kSpaceNames.begin(), kSpaceNames.end(), name);
    if (found == kSpaceNames.end())
        throw Error(ErrorKind::Usage, fmt::format("has the unknown colour space '{}'", name));
    development.color_space = static_cast<ColorSpace>(found - kSpaceNames.begin());
    development.exposure_ev = inRange(json.at("exposure_ev"), -100, 100);
    development.apply_to_float = json.at("apply_to_float").get<bool>();
    if (json.contains("white_xyz")) development.white = whiteFrom(json.at("white_xyz"));
    if (json.contains("view")) {
        const auto view = json.at("view").get<std::string>();
        const auto known = std::find(kViewTransformNames.begin(), kViewTransformNames.end(), view);
        if (known == kViewTransformNames.end())
            throw Error(ErrorKind::Usage, fmt::format("has the unknown view transform '{}'", view));
        development.view = static_cast<ViewTransform>(known - kViewTransformNames.begin());
    }
    return development;
}

Json spectralJson(const SpectralChannels& channels) {
    const SpectralBins& bins = channels.bins;
    return {{"from_nm", bins.from_nm}, {"to_nm", bins.to_nm}, {"bins", bins.count},
            {"responses", channels.responses}};
}

SpectralChannels spectralFrom(const Json& json) {
    SpectralChannels channels;
    channels.bins = {inRange(json.at("from_nm"), 0, kWavelengthMax_nm),
                     inRange(json.at("to_nm"), 0, kWavelengthMax_nm),
                     static_cast<std::uint32_t>(wholeNumber(json.at("bins"), kMostSpectralBins))};
    channels.responses = json.at("responses").get<std::vector<std::string>>();
    if (!areSpectralBins(channels.bins) || channels.responses.size() > kMostSensorResponses ||
        !std::all_of(channels.responses.begin(), channels.responses.end(), isResponseName))
        throw Error(ErrorKind::Usage, "has an invalid spectral film");
    return channels;
}

std::vector<std::string> aovNamesOf(std::uint32_t aovs) {
    std::vector<std::string> names;
    for (const AovRow& row : kAovRows)
        if ((aovs & row.aov) != 0 && !row.name.empty()) names.emplace_back(row.name);
    return names;
}

/// "embree and opencl": both names, each once.
std::string joinNames(const std::string& a, const std::string& b) {
    if (a.empty() || a == b) return b;
    if (b.empty()) return a;
    constexpr std::string_view kBetween = " and ";
    std::set<std::string> names;
    for (const std::string& text : {a, b})
        for (std::size_t begin = 0; begin < text.size();) {
            const std::size_t end = std::min(text.find(kBetween, begin), text.size());
            names.insert(text.substr(begin, end - begin));
            begin = end + kBetween.size();
        }
    return fmt::format("{}", fmt::join(names, kBetween));
}

/// Of a film's sides and of corners in it.
int pixelsFrom(const Json& json) {
    return static_cast<int>(wholeNumber(json, std::numeric_limits<int>::max()));
}

FilmRecord recordFrom(const Json& json) {
    if (const std::uint64_t version = wholeNumber(json.at("record")); version != kRecordVersion)
        throw Error(ErrorKind::Usage, fmt::format("has a record of version {}, and this crt reads {}",
                                                  version, kRecordVersion));
    FilmRecord record;
    record.title = json.at("title").get<std::string>();
    record.seed = wholeNumber(json.at("seed"));
    record.paths.independent = json.at("independent_samples").get<bool>();
    if (json.contains("brightest_path")) {
        const Json& brightest = json.at("brightest_path");
        record.paths.brightest = {brightest.at("luminance").get<double>(), brightest.at("rare").get<bool>()};
        if (!(record.paths.brightest.luminance > 0))
            throw Error(ErrorKind::Usage, "has a brightest path that carries no light");
    }
    record.width = pixelsFrom(json.at("resolution").at(0));
    record.height = pixelsFrom(json.at("resolution").at(1));
    for (std::size_t i = 0; i < record.window.size(); ++i)
        record.window[i] = pixelsFrom(json.at("window").at(i));
    for (const Json& name : json.at("aovs")) record.aovs |= aovNamed(name.get<std::string>());
    if (json.contains("spectral")) record.spectral = spectralFrom(json.at("spectral"));
    record.development = developmentFrom(json.at("development"));
    for (const auto& [name, white] : json.at("lights_xyz").items()) record.whites[name] = whiteFrom(white);
    record.world_to_camera = json.at("world_to_camera").get<RowMatrix4d>();
    record.world_to_ndc = json.at("world_to_ndc").get<RowMatrix4d>();
    for (const Json& trait : json.at("traits"))
        record.traits.push_back({trait.at(0).get<std::string>(), trait.at(1).get<std::string>(),
                                 trait.at(2).get<std::string>()});
    if (json.contains("missing_light"))
        record.missing_light = json.at("missing_light").get<std::vector<std::string>>();
    record.backend = json.at("backend").get<std::string>();
    record.device = json.at("device").get<std::string>();
    record.date_utc = json.at("date_utc").get<std::string>();
    if (json.contains("complete")) record.complete = json.at("complete").get<bool>();

    if (std::max(record.width, record.height) > static_cast<int>(kFilmSideMax))
        throw Error(ErrorKind::Usage,
                    fmt::format("has a film of {} × {} pixels, and films have up to {} a side",
                                 record.width,
                                record.height, kFilmSideMax));
    const auto& [x0, y0, x1, y1] = record.window;
    if (x0 >= x1 || y0 >= y1 || x1 > record.width || y1 > record.height)
        throw Error(ErrorKind::Usage, "has a window outside its film");
    return record;
}

}  // namespace

FilmRecord recordOf(const Scene& scene) {
    FilmRecord record;
    record.title = scene.title;
    record.seed = scene.sampler.seed;
    record.paths.independent = scene.sampler.type != SamplerType::Sobol;
    record.width = scene.film.width;
    record.height = scene.film.height;
    record.window = scene.film.crop[2] > scene.film.crop[0]
                        ? scene.film.crop
                        : std::array<int, 4>{0, 0, scene.film.width, scene.film.height};
    for (const Output& output : scene.outputs) record.aovs |= output.aovs;
    record.spectral = spectralChannelsOf(scene);
    record.development = developmentOf(scene);
    record.whites = scene.whites;
    addCamera(record, scene.camera);
    record.traits = traitsOf(scene, record.aovs);
    record.missing_light = missingLight(scene);
    return record;
}

std::string recordText(const FilmRecord& record) {
    constexpr std::size_t kMostBytes = std::size_t{1} << 20;  // The text and its tree together.
    requireMemory(kMostBytes);
    Json json{{"record", kRecordVersion},
              {"title", record.title},
              {"seed", record.seed},
              {"independent_samples", record.paths.independent},
              {"resolution", {record.width, record.height}},
              {"window", record.window},
              {"aovs", aovNamesOf(record.aovs)},
              {"development", developmentJson(record.development)},
              {"lights_xyz", Json::object()},
              {"world_to_camera", record.world_to_camera},
              {"world_to_ndc", record.world_to_ndc},
              {"traits", Json::array()},
              {"backend", record.backend},
              {"device", record.device},
              {"date_utc", record.date_utc}};
    for (const auto& [name, white] : record.whites) json["lights_xyz"][name] = white;
    for (const SceneTrait& trait : record.traits)
        json["traits"].push_back({trait.name, trait.text, trait.digest});
    if (record.spectral.count() > 0) json["spectral"] = spectralJson(record.spectral);
    if (!record.missing_light.empty()) json["missing_light"] = record.missing_light;
    if (const BrightestPath& brightest = record.paths.brightest; std::isfinite(brightest.luminance))
        json["brightest_path"] = {{"luminance", brightest.luminance}, {"rare", brightest.rare}};
    if (record.complete) json["complete"] = *record.complete;
    // Titles are bytes, not necessarily UTF-8.
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

FilmRecord readRecord(std::string_view text) {
    try {
        return recordFrom(Json::parse(text));
    } catch (const Json::exception& error) {
        throw Error(ErrorKind::Usage, fmt::format("cannot be read ({})", error.what()));
    }
}

std::vector<std::string> differingTraits(const FilmRecord& found, const FilmRecord& expected) {
    std::vector<std::string> sentences;
    for (const SceneTrait& want : expected.traits) {
        const auto have = std::find_if(found.traits.begin(), found.traits.end(),
                                       [&](const SceneTrait& trait) { return trait.name == want.name; });
        if (have == found.traits.end() || *have == want) continue;
        const bool plural = want.name.back() == 's' && want.name != "mis";
        if (have->text != want.text)
            sentences.push_back(
                fmt::format("{} {} {}, not {}", want.name, plural ? "are" : "is", have->text, want.text));
        else
            sentences.push_back(fmt::format("{} {} ({} in both)", want.name,
                                            plural ? "differ" : "differs", have->text));
    }
    return sentences;
}

bool FilmRecord::holdsRadiance() const {
    return std::any_of(traits.begin(), traits.end(), [](const SceneTrait& trait) {
        return trait.name == kIntegratorTrait && measuresLight(trait.text);
    });
}

void FilmRecord::addRun(const FilmRecord& other) {
    backend = joinNames(backend, other.backend);
    device = joinNames(device, other.device);
    date_utc = std::max(date_utc, other.date_utc);
    complete.reset();
}

std::string dateUtc() {
    std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
    if (const char* epoch = std::getenv("SOURCE_DATE_EPOCH"); epoch != nullptr && *epoch != '\0') {
        constexpr std::uint64_t kYear9999 = 253402300799;
        const Parsed<std::uint64_t> seconds = parseUnsigned(epoch);
        if (!seconds.value || *seconds.value > kYear9999)
            throw Error(
                ErrorKind::Usage,
                fmt::format("SOURCE_DATE_EPOCH is '{}'; it must be a number of seconds since 1970",
                            epoch));
        now = static_cast<std::time_t>(*seconds.value);
    }
    std::tm utc{};
    gmtime_r(&now, &utc);
    char text[32];
    const std::size_t length = std::strftime(text, sizeof text, "%Y:%m:%d %H:%M:%S", &utc);
    return {text, length};
}

}  // namespace crt
