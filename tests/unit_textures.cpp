// Textures: texels against the colours they hold, look-ups against double arithmetic, orientation, what a
// scene file may say of them, and what OBJ and MTL files bring.
//
// Over 450 lines: one scene with a texture, seen by look-ups, files and readers.
#include "file_bytes.h"
#include "gltf_file_maker.h"
#include "kernel_test.h"

#include "base/error.h"
#include "base/temporary_folder.h"
#include "base/words.h"
#include "captured_log.h"
#include "image/image_io.h"
#include "scene/textures/texture_files.h"
#include "scene/yaml/scene_schema_textures.h"
#include "scene/yaml/scene_yaml.h"
#include "spectra/sigmoid.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>

using namespace kernel_test;

namespace {

using crt::CompiledScene;
using crt::Scene;
using crt::test::CapturedLog;
using Color = std::array<double, 3>;

/// A table of linear sRGB, the top row first.
struct Picture {
    std::uint32_t width, height;
    std::vector<Color> texels;

    const Color& at(std::int64_t x, std::int64_t y) const {
        return texels[static_cast<std::size_t>(y * width + x)];
    }
};

Picture noise(std::uint32_t width, std::uint32_t height, std::uint64_t seed) {
    Random random(seed);
    Picture picture{width, height, {}};
    for (std::uint32_t i = 0; i < width * height; ++i)
        picture.texels.push_back({random.uniform(), random.uniform(), random.uniform()});
    return picture;
}

void write(const std::string& path, crt::OutputFormat format, const Picture& picture) {
    crt::Image image;
    image.width = picture.width;
    image.height = picture.height;
    image.channels = {"R", "G", "B"};
    for (const Color& c : picture.texels)
        for (const double v : c) image.pixels.push_back(static_cast<float>(v));
    crt::writeImage(path, format, image);
}

/// A square of side 1 with (u, v) = (x, z), whose reflectance is `value`.
std::string squareWith(const std::string& value,
                       const std::string& more = "uvs: [[0,0],[0,1],[1,1],[1,0]],") {
    return fmt::format(
        "crt: 1\nmaterials: {{it: {{type: diffuse, reflectance: {}}}}}\nobjects:\n"
        "  - {{mesh: {{{} positions: [[0,0,0],[0,0,1],[1,0,1],[1,0,0]], faces: [[0,1,2,3]]}}, material: "
        "it}}\n"
        "environment: {{radiance: 1}}\n",
        value, more);
}

Scene sceneOf(const std::string& yaml, const std::string& folder = {}) {
    return crt::parseScene(yaml, "test.yaml", folder);
}

/// The kernel's value of the reflectance of the first material at (u, v), as linear sRGB under D65.
class Probe {
public:
    explicit Probe(const std::string& yaml, const std::string& folder = {})
        : scene_(sceneOf(yaml, folder)), compiled_(crt::compileScene(scene_, 0)) {
        context_.blob = compiled_.data();
        context_.scene = &compiled_.header();
    }
    const CompiledScene& compiled() const { return compiled_; }
    const Scene& scene() const { return scene_; }

    vec4 value(const CrtSurface& surface, double position) const {
        const CrtMaterial* materials = CRT_ARRAY(CrtMaterial, context_.blob, context_.scene->materials);
        return crt_value(&context_, materials[0].of.diffuse.reflectance, &surface,
                         splat4(static_cast<f32>(position)));
    }
    double opacity(const CrtSurface& surface) const {
        return double{
            V4X(crt_value(&context_, crt_compositions(&context_)[0].opacity, &surface, splat4(0)))};
    }
    Color color(const CrtSurface& surface) const {
        Color rgb{};
        for (std::size_t i = 0; i < crt::kSpectrumSize; ++i)
            for (std::size_t k = 0; k < 3; ++k)
                rgb[k] += crt::rgbWeights()[k][i] * double{V4X(value(surface, static_cast<double>(i)))};
        return rgb;
    }
    Color color(double u, double v) const { return color(at(u, v)); }
    static CrtSurface at(double u, double v) {
        CrtSurface surface{};
        surface.at.u = static_cast<f32>(u);
        surface.at.v = static_cast<f32>(v);
        return surface;
    }
    /// Hit of a triangle.
    CrtSurface hit(std::uint32_t slot, double b1, double b2) const {
        CrtHit h{};
        h.t = 1;
        h.b1 = static_cast<f32>(b1);
        h.b2 = static_cast<f32>(b2);
        h.slot = slot;
        h.id = CRT_ARRAY(CrtTriangle, context_.blob, context_.scene->triangles)[slot].id;
        return crt_surface(&context_, h);
    }

    /// The corners of a triangle of the scene.
    std::uint32_t slotOf(std::uint32_t id) const {
        std::uint32_t slot = 0;
        while (CRT_ARRAY(CrtTriangle, context_.blob, context_.scene->triangles)[slot].id != id) ++slot;
        return slot;
    }

private:
    Scene scene_;
    CompiledScene compiled_;
    CrtContext context_{};
};

double distance(const Color& a, const Color& b) {
    return std::max({std::abs(a[0] - b[0]), std::abs(a[1] - b[1]), std::abs(a[2] - b[2])});
}

/// The index that a texel beyond the image has, by definition and not by the kernel's way.
std::int64_t wrapped(std::int64_t i, std::int64_t count, const std::string& wrap) {
    if (wrap == "clamp") return std::clamp<std::int64_t>(i, 0, count - 1);
    if (wrap == "repeat") return ((i % count) + count) % count;
    const std::int64_t period = ((i % (2 * count)) + 2 * count) % (2 * count);
    return period < count ? period : 2 * count - 1 - period;
}

/// Bilinear in double, v up.
Color bilinear(const Picture& picture, double u, double v, const std::string& wrap) {
    const double x = u * picture.width - 0.5, y = (1 - v) * picture.height - 0.5;
    const auto x0 = static_cast<std::int64_t>(std::floor(x)), y0 = static_cast<std::int64_t>(std::floor(y));
    Color sum{};
    for (const std::int64_t dy : {0, 1})
        for (const std::int64_t dx : {0, 1}) {
            const double fx = x - static_cast<double>(x0), fy = y - static_cast<double>(y0);
            const double weight = (dx ? fx : 1 - fx) * (dy ? fy : 1 - fy);
            const Color& texel =
                picture.at(wrapped(x0 + dx, picture.width, wrap), wrapped(y0 + dy, picture.height, wrap));
            for (std::size_t k = 0; k < 3; ++k) sum[k] += weight * texel[k];
        }
    return sum;
}

/// Of table, texel and single precision together: the colour of a texel in the image.
constexpr double kColorError = 3e-3;

std::string errorOf(const std::function<void()>& work) {
    try {
        work();
    } catch (const crt::Error& e) {
        CHECK(e.kind() == crt::ErrorKind::Scene);
        return e.what();
    }
    return "nothing was refused";
}
std::string refusal(const std::string& yaml, const std::string& folder = {}) {
    return errorOf([&] { sceneOf(yaml, folder); });
}
std::string refusalAtCompile(const std::string& yaml, const std::string& folder) {
    return errorOf([&] { (void)crt::compileScene(sceneOf(yaml, folder), 0); });
}

}  // namespace

TEST_CASE("a texel keeps the colour of its coefficients", "[texture]") {
    Random random(9);
    double worst = 0;
    for (int i = 0; i < 4000; ++i) {
        std::array<float, 3> color;
        for (float& c : color) c = static_cast<float>(random.uniform());
        if (i % 4 == 0) color[random.below(3)] = i % 8 == 0 ? 0.0f : 1.0f;
        const crt::SigmoidCoefficients c = crt::sigmoidCoefficients(color);
        const std::array<std::uint16_t, 3> texel = crt::texelOf(c);
        Color before{}, after{};
        for (std::size_t n = 0; n < crt::kSpectrumSize; ++n) {
            const vec4 position = splat4(static_cast<f32>(n));
            const double a = V4X(crt_sigmoid(c[0], c[1], c[2], position)),
                         b = V4X(crt_texel_spectrum(texel.data(), position));
            for (std::size_t k = 0; k < 3; ++k) {
                before[k] += crt::rgbWeights()[k][n] * a;
                after[k] += crt::rgbWeights()[k][n] * b;
            }
        }
        worst = std::max(worst, distance(before, after));
    }
    INFO(worst);
    CHECK(worst < 6e-4);  // of saturated colours, whose coefficients are large
    // Beyond the range all three shrink together, and zero is exact.
    const vec4 huge = crt_texel_spectrum(crt::texelOf({-1e9f, 1e9f, 0}).data(), splat4(235));
    CHECK(V4X(huge) < 1e-8f);
    CHECK(V4X(crt_texel_spectrum(crt::texelOf({0, 0, 0}).data(), splat4(100))) == 0.5f);
    for (const float c : {-8191.0f, -2.0f, -1.99999f, -0.24f, 0.25f, 0.99999f, 1.0f, 8191.0f}) {
        const auto texel = crt::texelOf({c, 0, 0});
        const double x = std::pow(2.0, static_cast<int>((texel[1] & 3u) | (texel[2] & 3u) << 2) - 2) *
                         (texel[0] - 32768.0) / 32768.0;
        CHECK(x == Approx(c).margin(std::abs(c) / 16384 + 4e-6));
    }
}

TEST_CASE("images: bilinear between texels, wrapped, as in double arithmetic", "[texture]") {
    const crt::TemporaryFolder folder;
    const Picture picture = noise(5, 3, 1);
    write(folder.path() + "/a.exr", crt::OutputFormat::Exr, picture);
    Random random(2);
    for (const std::string wrap : {"repeat", "mirror", "clamp"}) {
        const Probe probe(squareWith(fmt::format("{{texture: a.exr, wrap: {}}}", wrap)), folder.path());
        // Of the texels as they are seen, which is the truth that is known best.
        Picture seen = picture;
        for (std::uint32_t y = 0; y < 3; ++y)
            for (std::uint32_t x = 0; x < 5; ++x) {
                seen.texels[y * 5 + x] = probe.color((x + 0.5) / 5, 1 - (y + 0.5) / 3);
                CHECK(distance(seen.texels[y * 5 + x], picture.at(x, y)) < kColorError);
            }
        INFO(wrap);
        CHECK((probe.compiled().header().features & CRT_FEATURE_TEXTURE) != 0);
        double worst = 0;
        for (int i = 0; i < 150; ++i) {
            const double u = static_cast<f32>(random.uniform(-3, 4)),
                         v = static_cast<f32>(random.uniform(-3, 4));
            worst = std::max(worst, distance(probe.color(u, v), bilinear(seen, u, v, wrap)));
        }
        INFO(worst);
        CHECK(worst < 1e-5);
        // The seams: half of the last texel and half of the first, or the edge.
        CHECK(distance(probe.color(0, 0.5), bilinear(seen, 0, 0.5, wrap)) < 1e-5);
        CHECK(distance(probe.color(1, 1), bilinear(seen, 1, 1, wrap)) < 1e-5);
        CHECK(distance(probe.color(-1e-9, 2), bilinear(seen, -1e-9, 2, wrap)) < 1e-5);
    }
}

TEST_CASE("half-way between black and white lies grey", "[texture]") {
    const crt::TemporaryFolder folder;
    write(folder.path() + "/a.exr", crt::OutputFormat::Exr, {2, 1, {{0, 0, 0}, {1, 1, 1}}});
    const Probe probe(squareWith("{texture: a.exr, wrap: clamp}"), folder.path());
    for (const double u : {0.3, 0.5, 0.7}) {
        const double expected = (u * 2 - 0.5);
        CHECK(distance(probe.color(u, 0.5), {expected, expected, expected}) < 1e-5);
    }
}

TEST_CASE("images lie with their upper row up, and turn counter-clockwise against (u, v)", "[texture]") {
    const crt::TemporaryFolder folder;
    const Color red{0.8, 0.1, 0.1}, green{0.1, 0.8, 0.1}, blue{0.1, 0.1, 0.8}, grey{0.4, 0.4, 0.4};
    write(folder.path() + "/a.exr", crt::OutputFormat::Exr, {2, 2, {red, green, blue, grey}});
    const auto color = [&](const std::string& more, double u, double v) {
        return Probe(squareWith(fmt::format("{{texture: a.exr, filter: nearest{}}}", more)), folder.path())
            .color(u, v);
    };
    const auto same = [](const Color& a, const Color& b) { return distance(a, b) < kColorError; };
    CHECK(same(color("", 0.25, 0.75), red));
    CHECK(same(color("", 0.75, 0.75), green));
    CHECK(same(color("", 0.25, 0.25), blue));
    CHECK(same(color("", 0.75, 0.25), grey));
    // Twice as often; moved by half; (u, v) turned by a quarter: (0.75, 0.25) becomes (-0.25, 0.75).
    CHECK(same(color(", scale: 2", 0.125, 0.375), red));
    CHECK(same(color(", scale: 2", 0.625, 0.125), blue));
    CHECK(same(color(", scale: [1, 2]", 0.25, 0.375), red));
    CHECK(same(color(", offset: [0.5, 0]", 0.25, 0.75), green));
    CHECK(same(color(", offset: [0, 0.5]", 0.25, 0.75), blue));
    CHECK(same(color(", rotation_deg: 90", 0.75, 0.25), green));
    CHECK(same(color(", rotation_deg: 180, wrap: clamp", 0.75, 0.25), blue));
    // Scale, then turn, then move: (0.375, 0.25) → (0.75, 0.25) → (-0.25, 0.75) → (0.25, 0.75).
    CHECK(same(color(", scale: [2, 1], rotation_deg: 90, offset: [0.5, 0], wrap: clamp", 0.375, 0.25), red));
    CHECK(same(color(", scale: -1, wrap: mirror", 0.25, 0.25), blue));
}

TEST_CASE("texture coordinates follow the surface, also where it is mirrored", "[texture]") {
    const crt::TemporaryFolder folder;
    write(folder.path() + "/a.exr", crt::OutputFormat::Exr, {2, 1, {{0, 0, 0}, {1, 1, 1}}});
    std::string yaml = squareWith("{texture: a.exr}");
    struct Placed {
        const char* transform;
        double factor, depth;
    };
    for (const auto& [transform, factor, depth] :
         {Placed{"", 1, 1}, Placed{", transform: [{scale: [-1, 1, 1]}]", -1, 1},
          Placed{", transform: [{scale: [2, 1, 3]}]", 2, 3}}) {
        std::string placed = yaml;
        placed.replace(placed.find(", material: it}"), 0, transform);
        const Probe probe(placed, folder.path());
        Random random(4);
        const auto& centre = probe.compiled().centre;
        const double scale = std::ldexp(1.0, probe.compiled().scale_exponent);
        for (int i = 0; i < 40; ++i) {
            const double b1 = random.uniform(0.1, 0.4), b2 = random.uniform(0.1, 0.4);
            const CrtSurface s = probe.hit(random.below(2), b1, b2);
            const double x = s.p.x / scale + centre[0], z = s.p.z / scale + centre[2];
            CHECK(s.at.u == Approx(x / factor).margin(1e-5));
            CHECK(s.at.v == Approx(z / depth).margin(1e-5));
        }
    }
}

TEST_CASE("checkers alternate, also below zero, and may be made of textures", "[texture]") {
    const Probe probe(squareWith("{checker: [0.25, {checker: [0.5, 0.75], scale: 8}], scale: 2}"));
    const auto value = [&](double u, double v) { return V4X(probe.value(Probe::at(u, v), 0)); };
    CHECK(value(0.1, 0.1) == 0.25f);
    CHECK(value(-0.1, -0.1) == 0.25f);
    CHECK(value(0.51, 0.51) == 0.25f);
    CHECK(value(0.51, 0.01) == 0.5f);
    CHECK(value(0.51 + 0.125, 0.01) == 0.75f);
    CHECK(value(-0.01, 0.01) == 0.75f);
    CHECK(value(1e5 + 0.1, 0.1) == 0.25f);
    CHECK((probe.compiled().header().features & CRT_FEATURE_TABLE) == 0);
    // Spectra of its values are in the scene's table.
    const Probe colored(squareWith("{checker: [{rgb: [0.7, 0.2, 0.1], space: linear}, 0.5]}"));
    CHECK(distance(colored.color(0.5, 0.5), {0.7, 0.2, 0.1}) < 1e-3);
}

TEST_CASE("the numbers of a pattern are keys of scene files, and in the blob", "[texture]") {
    // The others are images and attributes.
    CHECK(crt::schemaVariants("texture").size() == std::size(crt::kPatternWords) + 2);
    for (const auto& [kind, word] : crt::kPatternWords) {
        INFO(word);
        const crt::SectionSchema& section = crt::schemaSection(std::string("texture/") + word);
        CHECK(section.keys.front().name == word);
        for (const crt::KeySchema& key : crt::numbersOfPattern(section)) {
            INFO(key.name);
            CHECK(key.kind == crt::ValueKind::Number);
            CHECK(key.shape == crt::ValueShape::One);
            CHECK(crt::parseNumber(key.fallback).value);
        }
        Scene scene = sceneOf(squareWith(fmt::format("{{{}: [0.25, 0.75]}}", word)));
        CHECK(scene.textures[0].kind == kind);
        CHECK(scene.textures[0].numbers.size() == crt::numbersOfPattern(section).size());
        scene.textures[0].numbers = {0.375, -2};
        const CompiledScene compiled = crt::compileScene(scene, 0);
        const CrtTexture& record = *CRT_ARRAY(CrtTexture, compiled.data(), compiled.header().textures);
        REQUIRE(record.words.count == 4);
        const f32* numbers = CRT_ARRAY(f32, compiled.data(), record.words);
        CHECK(numbers[0] == 0.375f);
        CHECK(numbers[1] == -2.0f);
        const std::string hash = compiled.hash;
        scene.textures[0].numbers[1] = 2;
        CHECK(crt::compileScene(scene, 0).hash != hash);
    }
}

TEST_CASE("colours of vertices, linear in between at every wavelength", "[texture]") {
    const Probe probe(squareWith("{attribute: colors}",
                                 "colors: [[0.8,0.1,0.1],[0.1,0.8,0.1],[0.1,0.1,0.8],[0.5,0.5,0.5]], "
                                 "color_space: linear,"));
    const Color corner[3] = {{0.8, 0.1, 0.1}, {0.1, 0.8, 0.1}, {0.1, 0.1, 0.8}};
    std::uint32_t slot = 0;
    if (probe.hit(0, 0.2, 0.2).at.id != 0) slot = 1;
    Random random(8);
    for (int i = 0; i < 30; ++i) {
        const double b1 = random.uniform(0.05, 0.45), b2 = random.uniform(0.05, 0.45);
        Color expected{};
        for (std::size_t k = 0; k < 3; ++k)
            expected[k] = (1 - b1 - b2) * corner[0][k] + b1 * corner[1][k] + b2 * corner[2][k];
        CHECK(distance(probe.color(probe.hit(slot, b1, b2)), expected) < kColorError);
    }
    // 8-bit colours are encoded unless said otherwise.
    const Probe encoded(squareWith("{attribute: colors}",
                                   "colors: [[0.5,0.5,0.5],[0.5,0.5,0.5],[0.5,0.5,0.5],"
                                   "[0.5,0.5,0.5]],"));
    const double linear = crt::srgbToLinear(0.5);
    CHECK(distance(encoded.color(encoded.hit(0, 0.3, 0.3)), {linear, linear, linear}) < kColorError);
}

TEST_CASE("the colour of an sRGB image comes back", "[texture]") {
    const crt::TemporaryFolder folder;
    Random random(6);
    Picture picture{8, 8, {}};
    for (int i = 0; i < 64; ++i) {
        Color c;
        for (double& v : c) v = crt::srgbToLinear(random.below(256) / 255.0);
        picture.texels.push_back(c);
    }
    write(folder.path() + "/a.png", crt::OutputFormat::Png, picture);
    const Probe probe(squareWith("{texture: a.png, filter: nearest}"), folder.path());
    double worst = 0;
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 8; ++x) {
            const Color found = probe.color((x + 0.5) / 8, 1 - (y + 0.5) / 8), &asked = picture.at(x, y);
            worst = std::max(worst, distance(found, asked));
        }
    INFO(worst);
    CHECK(worst < kColorError);
    // Numbers that are proportional to light stay what they are.
    const Probe linear(squareWith("{texture: a.png, filter: nearest, color_space: linear}"), folder.path());
    const double code = crt::linearToSrgb(picture.at(3, 2)[1]);
    CHECK(linear.color(3.5 / 8, 1 - 2.5 / 8)[1] == Approx(code).margin(kColorError));
}

TEST_CASE("roughness from a channel of an image", "[texture]") {
    const crt::TemporaryFolder folder;
    write(folder.path() + "/a.exr", crt::OutputFormat::Exr, {2, 1, {{0.2, 0.6, 0.9}, {0.4, 0.1, 0.7}}});
    const auto probe = [&](const std::string& more) {
        return Probe(fmt::format("crt: 1\nmaterials: {{it: {{type: rough_conductor, metal: Au, roughness: "
                                 "{{texture: a.exr, wrap: clamp{}}}}}}}\nobjects:\n  - {{mesh: {{uvs: "
                                 "[[0,0],[0,1],[1,1]], positions: [[0,0,0],[0,0,1],[1,0,1]], faces: "
                                 "[[0,1,2]]}}, material: it}}\nenvironment: {{radiance: 1}}\n",
                                 more),
                     folder.path());
    };
    const auto roughness = [](const Probe& p, double u) {
        CrtContext context{};
        context.blob = p.compiled().data();
        context.scene = &p.compiled().header();
        const CrtSurface surface = Probe::at(u, 0.5);
        const CrtMaterial* m = CRT_ARRAY(CrtMaterial, context.blob, context.scene->materials);
        return V4X(crt_value(&context, m[0].roughness, &surface, splat4(7)));
    };
    CHECK(roughness(probe(""), 0) == Approx(0.2).margin(1e-5));
    CHECK(roughness(probe(", channel: green"), 0) == Approx(0.6).margin(1e-5));
    CHECK(roughness(probe(", channel: blue"), 0.5) == Approx(0.8).margin(1e-5));
    CHECK_THAT(errorOf([&] { probe(", color_space: srgb"); }), Contains("raw"));
}

TEST_CASE("a file is in memory once, and scenes without textures have nothing of them", "[texture]") {
    const crt::TemporaryFolder folder;
    write(folder.path() + "/a.png", crt::OutputFormat::Png, noise(16, 16, 3));
    const std::string twice =
        "crt: 1\nmaterials:\n  a: {type: diffuse, reflectance: {texture: a.png}}\n"
        "  b: {type: mirror, reflectance: {texture: ./a.png, scale: 3}}\nobjects:\n"
        "  - {mesh: {uvs: [[0,0],[0,1],[1,1]], positions: [[0,0,0],[0,0,1],[1,0,1]], faces: [[0,1,2]]}, "
        "material: a}\n"
        "  - {mesh: {uvs: [[0,0],[0,1],[1,1]], positions: [[0,1,0],[0,1,1],[1,1,1]], faces: [[0,1,2]]}, "
        "material: b}\nenvironment: {radiance: 1}\n";
    const Scene scene = sceneOf(twice, folder.path());
    CHECK(scene.textures.size() == 2);
    CHECK(scene.textures[0].image == scene.textures[1].image);
    CHECK(std::count(scene.files_read.begin(), scene.files_read.end(), folder.path() + "/a.png") == 1);
    const CompiledScene compiled = crt::compileScene(scene, 0);
    CHECK(compiled.images == 1);
    CHECK(compiled.texel_bytes == 16 * 16 * 6);

    const CompiledScene plain = crt::compileScene(sceneOf(squareWith("0.5")), 0);
    const CrtScene& header = plain.header();
    CHECK(header.uvs.count == 0);
    CHECK(header.textures.count == 0);
    CHECK(header.vertex_colors.count == 0);
    CHECK((plain.header().features & CRT_FEATURE_TEXTURE) == 0);
    // A texture of a material that nothing has is not decoded.
    const CompiledScene unused = crt::compileScene(
        sceneOf("crt: 1\nmaterials: {a: {type: diffuse, reflectance: {texture: a.png}}}\n", folder.path()),
        0);
    CHECK(unused.texel_bytes == 0);
    CHECK((unused.header().features & CRT_FEATURE_TEXTURE) == 0);
}

TEST_CASE("films of scenes whose textures differ do not merge", "[texture]") {
    const crt::TemporaryFolder folder;
    Picture picture = noise(4, 4, 5);
    write(folder.path() + "/a.exr", crt::OutputFormat::Exr, picture);
    picture.texels[7][1] = 1 - picture.texels[7][1];
    write(folder.path() + "/b.exr", crt::OutputFormat::Exr, picture);
    const std::string uvs = "uvs: [[0,0],[0,1],[1,1],[1,0]],";
    const auto hash = [&](const std::string& value, const std::string& more) {
        return crt::compileScene(sceneOf(squareWith(value, more), folder.path()), 0).hash;
    };
    std::vector<std::string> hashes{
        hash("{texture: a.exr}", uvs),
        hash("{texture: b.exr}", uvs),
        hash("{texture: a.exr, wrap: clamp}", uvs),
        hash("{texture: a.exr, filter: nearest}", uvs),
        hash("{texture: a.exr, color_space: srgb}", uvs),
        hash("{texture: a.exr, scale: 2}", uvs),
        hash("{texture: a.exr}", "uvs: [[0,0],[0,1],[1,1],[1,0.5]],"),
        hash("{checker: [0.2, 0.4]}", uvs),
        hash("{checker: [0.4, 0.2]}", uvs),
        hash("{attribute: colors}", "colors: [[0,0,0],[0,0,1],[0,1,1],[1,1,1]],"),
        hash("{attribute: colors}", "colors: [[0,0,0],[0,0,1],[0,1,1],[1,1,0.5]],")};
    CHECK(hash("{texture: a.exr}", uvs) == hashes.front());
    std::sort(hashes.begin(), hashes.end());
    CHECK(std::unique(hashes.begin(), hashes.end()) == hashes.end());
}

TEST_CASE("what is wrong about textures is told with its place", "[texture]") {
    const crt::TemporaryFolder folder;
    const std::string& in = folder.path();
    write(in + "/a.png", crt::OutputFormat::Png, noise(4, 4, 3));
    CHECK_THAT(refusal(squareWith("{texture: b.png}"), in),
               Contains("test.yaml:2:") && Contains("cannot find 'b.png'") && Contains("a.png"));
    CHECK_THAT(refusal(squareWith("{texture: a.png, wrap: repeated}"), in), Contains("repeat"));
    CHECK_THAT(refusal(squareWith("{texture: a.png, filtre: nearest}"), in), Contains("'filter'"));
    CHECK_THAT(refusal(squareWith("{texture: a.png, channel: red}"), in), Contains("channel"));
    CHECK_THAT(refusal(squareWith("{texture: a.png, scale: 1e300}"), in), Contains("1000000"));
    CHECK_THAT(refusal(squareWith("{texture: a.png, cutoff: 0.5}"), in),
               Contains("'cutoff' is for numbers"));
    CHECK_THAT(refusal(squareWith("{texture: a.png}", ""), in),
               Contains("test.yaml:4:") && Contains("no texture coordinates") && Contains("uvs"));
    CHECK_THAT(refusal(squareWith("{checker: [0.5, {texture: a.png}]}", ""), in),
               Contains("no texture coordinates"));
    CHECK_THAT(refusal(squareWith("1, normal_map: {texture: a.png}", ""), in),
               Contains("no texture coordinates"));
    CHECK_THAT(refusal(squareWith("{attribute: colors}"), in), Contains("colours of vertices"));
    CHECK_THAT(refusal(squareWith("{attribute: colours}", ""), in), Contains("colors"));
    CHECK_THAT(refusal(squareWith("{checker: [0.5]}"), in), Contains("two values"));
    CHECK_THAT(refusal(squareWith("{checker: [0.5, 1.5]}"), in), Contains("0 to 1"));
    CHECK_THAT(refusal(squareWith("0.5", "uvs: [[0,0],[0,1]],"), in), Contains("2 uvs for 4 positions"));
    CHECK_THAT(refusal(squareWith("0.5", "uvs: [[0,0],[0,1],[1,1],[nan,0]],"), in), Contains("nan"));
    CHECK_THAT(refusal(squareWith("0.5", "colors: [[0,0,0],[0,0,2],[1,1,1],[1,0,0]],"), in),
               Contains("0 to 1"));
    CHECK_THAT(refusal("crt: 1\nenvironment: {radiance: {texture: a.png}}\n", in), Contains("texture"));

    crt::spit(in + "/text.png", "hello");
    CHECK_THAT(refusal(squareWith("{texture: text.png}"), in),
               Contains("test.yaml:2:") && Contains("it is not a PNG, JPEG"));
    std::ifstream file(in + "/a.png", std::ios::binary);
    std::string bytes{std::istreambuf_iterator<char>(file), {}};
    const std::size_t pixels = bytes.find("IDAT") + 8;
    bytes[pixels] = static_cast<char>(bytes[pixels] ^ 0x55);
    crt::spit(in + "/bent.png", bytes);
    CHECK_THAT(refusalAtCompile(squareWith("{texture: bent.png}"), in), Contains("bent.png"));
    write(in + "/nan.exr", crt::OutputFormat::Exr, {2, 1, {{0, 0, 0}, {0, std::nan(""), 0}}});
    CHECK_THAT(refusalAtCompile(squareWith("{texture: nan.exr}"), in), Contains("x = 1, y = 0"));

    const CapturedLog log;
    write(in + "/bright.exr", crt::OutputFormat::Exr, {2, 1, {{0, 0, 0}, {7, 0.5, 0}}});
    const Probe probe(squareWith("{texture: bright.exr, filter: nearest}"), in);
    CHECK(distance(probe.color(0.75, 0.5), {1, 0.5, 0}) < 2e-3);
    CHECK_THAT(log.text(), Contains("1 values outside [0, 1]"));
}

TEST_CASE("a texture of an EXR with alpha has the colours before they were multiplied", "[texture]") {
    const crt::TemporaryFolder folder;
    crt::Image image;
    image.width = image.height = 1;
    image.channels = {"R", "G", "B", "A"};
    image.pixels = {0.375f, 0.1875f, 0.09375f, 0.75f};
    crt::writeImage(folder / "a.exr", crt::OutputFormat::Exr, image);
    const Probe probe(squareWith("{texture: a.exr}"), folder.path());
    CHECK(distance(probe.color(0.5, 0.5), {0.5, 0.25, 0.125}) < 2e-3);
}

TEST_CASE("opacities of vertices, linear in between or by a threshold", "[texture][gltf]") {
    const crt::TemporaryFolder folder;
    crt::test::GltfMaker maker = crt::test::squareFile();
    std::vector<float> colors;
    for (const float alpha : {0.2f, 0.6f, 1.0f, 0.4f}) colors.insert(colors.end(), {1, 1, 1, alpha});
    maker.root["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = maker.floats("VEC4", 4, colors);
    folder.write("a.glb", maker.glb());
    const auto with = [](const std::string& more, const std::string& opacity = ", vertex_opacity: true") {
        return "crt: 1\nmaterials: {it: {type: diffuse, reflectance: 0.5, opacity: {attribute: opacity" +
               more + "}}}\nobjects: [{gltf: {file: a.glb, mesh: 0" + opacity + "}, material: it}]\n";
    };
    // In the first triangle, of the vertices 0, 1 and 2.
    const auto opacity = [&](const std::string& more, double b1, double b2) {
        const Probe probe(with(more), folder.path());
        return probe.opacity(probe.hit(probe.slotOf(0), b1, b2));
    };
    for (const auto& [b1, b2] : {std::pair{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}, {0.5, 0.5}, {0.25, 0.5}}) {
        const double alpha = 0.2 * (1 - b1 - b2) + 0.6 * b1 + b2;
        INFO(alpha);
        CHECK(opacity("", b1, b2) == Approx(alpha).margin(1e-4));
        CHECK(opacity(", factor: 0.5", b1, b2) == Approx(alpha / 2).margin(1e-4));
        CHECK(opacity(", cutoff: 0.6", b1, b2) == (alpha >= 0.6 ? 1 : 0));
        CHECK(opacity(", cutoff: 0.61, factor: 0.5", b1, b2) ==
              Approx(alpha >= 0.61 ? 0.5 : 0).margin(1e-4));
    }
    const std::string& in = folder.path();
    CHECK_THAT(refusal(with("", ""), in), Contains("opacity of vertices") && Contains("vertex_opacity"));
    CHECK_THAT(refusal(squareWith("{attribute: opacity}"), in),
               Contains("cannot use opacities of vertices"));
    CHECK_THAT(refusal(squareWith("{attribute: colors, cutoff: 0.5}", ""), in), Contains("for opacities"));
    write(in + "/a.png", crt::OutputFormat::Png, noise(4, 4, 3));
    CHECK_THAT(refusal("crt: 1\nmaterials: {it: {type: diffuse, reflectance: {texture: a.png}}}\nobjects: "
                       "[{gltf: {file: a.glb, mesh: 0, vertex_opacity: true}, material: it}]\n",
                       in),
               Contains("opacities instead of texture coordinates"));
}

TEST_CASE("what an image says and crt ignores is told once for all textures of it", "[texture]") {
    const crt::TemporaryFolder folder;
    crt::spit(folder / "a.hdr",
              std::string("#?RGBE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\n\n-Y 1 +X 1\n") + "\x80\x40\x20\x80");
    const CapturedLog log;
    const Probe probe(squareWith("{checker: [{texture: a.hdr}, {texture: a.hdr, factor: 0.5}]}"),
                      folder.path());
    CHECK(distance(probe.color(0.5, 0.5), {0.5, 0.25, 0.125}) < 2e-3);
    CHECK(log.warnings() == 1);
    CHECK_THAT(log.text(), Contains("EXPOSURE=2"));
}

TEST_CASE("an OBJ brings texture coordinates, its MTL images", "[texture][obj]") {
    const crt::TemporaryFolder folder;
    const std::string& in = folder.path();
    const Color left{0.7, 0.2, 0.1}, right{0.1, 0.2, 0.7};
    write(in + "/Wood Tiles.exr", crt::OutputFormat::Exr, {2, 1, {left, right}});
    crt::spit(
        in + "/a.mtl",
        "newmtl wood\nKd 0 0 0\nmap_Kd -s 1 1 -clamp on textures\\wood tiles.EXR\nnewmtl gone\nKd 0.5 0.5 "
        "0.5\nmap_Kd gone.png\nnewmtl broken\nKd 0.25 0.25 0.25\nmap_Kd a.obj\n");
    crt::spit(in + "/a.obj",
              "mtllib a.mtl\nv 0 0 0\nv 0 0 1\nv 1 0 1\nv 1 0 0\nvt 0 0\nvt 0 1 0\nvt 1 1\nvt 1\n"
              "usemtl wood\nf 1/1 2/2 3/3 4/4\nusemtl gone\nf -4/-4 -3/-3 -2/-2\nusemtl broken\nf 1 2 3\n");
    const std::string yaml = "crt: 1\nobjects: [{obj: a.obj}]\nenvironment: {radiance: 1}\n";
    const CapturedLog log;
    const Scene scene = sceneOf(yaml, in);
    CHECK_THAT(log.text(), Contains("map_Kd (1)") && Contains("a.mtl:9") && Contains("it is not a PNG, "
                                                                                     "JPEG"));
    REQUIRE(scene.textures.size() == 1);
    const crt::Mesh& mesh = scene.meshes[0];
    REQUIRE(mesh.uvs.size() == 4);
    CHECK(mesh.uvs[2] == std::array<double, 2>{1, 1});
    CHECK(mesh.uvs[3] == std::array<double, 2>{1, 0});
    REQUIRE(mesh.uv_index.size() == 4);
    CHECK(mesh.uv_index[2] == std::array<std::uint32_t, 3>{0, 1, 2});
    CHECK(mesh.uv_index[3] == std::array<std::uint32_t, 3>{crt::kNoUv, crt::kNoUv, crt::kNoUv});
    const Probe probe(yaml, in);
    CHECK(distance(probe.color(0.1, 0.5), left) < kColorError);
    CHECK(distance(probe.color(1.4, 0.5), right) < kColorError);  // held beyond its edge
    CHECK(scene.materials[1].reflectance_texture == crt::kNoTexture);
    CHECK(scene.materials[1].reflectance[0] == Approx(0.5));

    // Opacity and normals: a mask whose right half is there, and which leans to the right.
    write(in + "/mask.exr", crt::OutputFormat::Exr, {2, 1, {{0, 0, 0}, {1, 0, 0}}});
    write(in + "/lean.exr", crt::OutputFormat::Exr, {1, 1, {{0.9f, 0.5f, 0.8f}}});
    crt::spit(in + "/c.mtl",
              "newmtl leaf\nKd 1 1 1\nd 0.5\nmap_d -clamp on mask.exr\nnorm lean.exr\n"
              "newmtl fence\nKd 1 1 1\nd 0.5\nmap_d a.obj\n");
    crt::spit(in + "/c.obj",
              "mtllib c.mtl\nv 0 0 0\nv 0 0 1\nv 1 0 1\nv 1 0 0\nvt 0 0\nvt 0 1\nvt 1 1\nvt 1 0\nusemtl "
              "leaf\nf 1/1 2/2 3/3 4/4\nusemtl fence\nf 1/1 2/2 3/3\n");
    const Scene cut = sceneOf("crt: 1\nobjects: [{obj: c.obj}]\nenvironment: {radiance: 1}\n", in);
    const crt::Material &leaf = cut.materials.at(0), &fence = cut.materials.at(1);
    REQUIRE((leaf.opacity_texture >= 0 && leaf.normal_texture >= 0));
    const crt::Texture& mask = cut.textures.at(static_cast<std::size_t>(leaf.opacity_texture));
    CHECK(mask.image->kind == crt::TexelKind::Numbers);
    CHECK(mask.wrap == crt::TextureWrap::Clamp);
    std::vector<std::uint16_t> texels(2);
    mask.image->decode(texels);
    CHECK(texels == std::vector<std::uint16_t>{0, 65535});
    CHECK(cut.textures.at(static_cast<std::size_t>(leaf.normal_texture)).image->kind ==
          crt::TexelKind::Normals);
    CHECK((fence.opacity == .5 && fence.opacity_texture == crt::kNoTexture));
    CHECK_THAT(log.text(), Contains("c.mtl:9") && Contains("crt uses d instead"));

    // Faces without vt, or with one that is not there, show Kd and d.
    crt::spit(in + "/d.mtl", "newmtl half\nKd 0.25 0.5 1\nd 0.75\nmap_Kd Wood Tiles.exr\nmap_d mask.exr\n");
    crt::spit(in + "/d.obj",
              "mtllib d.mtl\nv 0 0 0\nv 0 0 1\nv 1 0 1\nv 1 0 0\nvt 0 0\nvt 0 1\nvt 1 1\nusemtl half\n"
              "f 1/1 2/2 3/3\nf 1 3 4\nf 1/1 3/3 4/9\n");
    const Scene half = sceneOf("crt: 1\nobjects: [{obj: d.obj}]\nenvironment: {radiance: 1}\n", in);
    CHECK_THAT(log.text(), Contains("d.obj:12: 1 face without an image") && Contains("which has 3"));
    REQUIRE(half.meshes[0].material.size() == 3);
    const std::int32_t whole = half.meshes[0].material[0], bare = half.meshes[0].material[1];
    CHECK((bare != whole && half.meshes[0].material[2] == bare));
    const crt::Material &with_image = half.materials.at(static_cast<std::size_t>(whole)),
                        &without = half.materials.at(static_cast<std::size_t>(bare));
    CHECK((with_image.reflectance_texture >= 0 && with_image.opacity_texture >= 0));
    CHECK((without.reflectance_texture == crt::kNoTexture && without.opacity_texture == crt::kNoTexture));
    CHECK(without.opacity == .75);
    CHECK_THAT(without.name, Contains("half without vt"));

    // A material of the scene's, on an OBJ with texture coordinates and on one without.
    const std::string own =
        "crt: 1\nmaterials: {it: {type: diffuse, reflectance: {texture: Wood Tiles.exr}}}\nobjects: [{obj: "
        "NAME, material: it, override: true}]\nenvironment: {radiance: 1}\n";
    const auto with = [&](const char* name) {
        std::string text = own;
        return text.replace(text.find("NAME"), 4, name);
    };
    CHECK_NOTHROW(sceneOf(with("a.obj"), in));
    crt::spit(in + "/b.obj", "v 0 0 0\nv 0 0 1\nv 1 0 1\nf 1 2 3\n");
    CHECK_THAT(refusal(with("b.obj"), in), Contains("no texture coordinates") && Contains("test.yaml:3:"));
}
