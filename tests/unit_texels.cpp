// Image files as values of a scene: every format gives the numbers that it holds, and what is damaged or too
// large is refused before memory is spent on it.
#include "base/error.h"
#include "base/temporary_folder.h"
#include "catch.h"
#include "file_bytes.h"
#include "image/image_io.h"
#include "image/texels.h"
#include "jpeg_file.h"
#include "png_file.h"
#include "spectra/spectra.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>

using namespace crt;

namespace {

/// Three pixels wide, two high: row 0 red, green, blue; row 1 black, grey, white.
const std::vector<std::uint8_t> kCodes{255, 0, 0, 0,   255, 0,   0,   0,   255,
                                       0,   0, 0, 128, 128, 128, 255, 255, 255};

Image imageOf(const std::vector<float>& rgb) {
    Image image;
    image.width = 3;
    image.height = 2;
    image.channels = {"R", "G", "B"};
    image.pixels = rgb;
    return image;
}

std::vector<float> linearCodes() {
    std::vector<float> linear;
    for (const std::uint8_t code : kCodes) linear.push_back(static_cast<float>(srgbToLinear(code / 255.0)));
    return linear;
}

/// The message of an error of kind Scene.
std::string refusal(const std::function<void()>& work) {
    try {
        work();
    } catch (const Error& e) {
        CHECK(e.kind() == ErrorKind::Scene);
        return e.what();
    }
    return "nothing was refused";
}

std::string refusalOf(const std::string& path) {
    return refusal([&] { (void)readTexels(path); });
}

}  // namespace

TEST_CASE("texels of each format, the top row first", "[texels]") {
    const TemporaryFolder folder;
    const std::string png = folder.path() + "/a.png", exr = folder.path() + "/a.exr",
                      pfm = folder.path() + "/a.pfm";
    writeImage(png, OutputFormat::Png, imageOf(linearCodes()));
    writeImage(exr, OutputFormat::Exr, imageOf(linearCodes()));
    writeImage(pfm, OutputFormat::Pfm, imageOf(linearCodes()));
    CHECK(texelsInfo(png).type == TexelType::Uint8);
    CHECK(texelsInfo(exr).type == TexelType::Float);
    CHECK(readTexels(png).bytes == kCodes);
    for (const std::string& path : {png, exr, pfm}) {
        INFO(path);
        const Texels texels = readTexels(path);
        CHECK(texels.info.width == 3);
        CHECK(texels.info.height == 2);
        CHECK(texels.info.channels == 3);
        CHECK(texels.info.count() == texelsInfo(path).count());
        CHECK(linearRgb(texels, TexelColor::Auto, path) == linearCodes());
    }
    // Said otherwise: codes are proportional to light, floats are encoded.
    CHECK(linearRgb(readTexels(png), TexelColor::Linear, png)[12] == 128.0f / 255.0f);
    CHECK(linearRgb(readTexels(exr), TexelColor::Srgb, exr)[12] ==
          Approx(srgbToLinear(srgbToLinear(128 / 255.0))));
}

TEST_CASE("texels of an HDR", "[texels]") {
    const TemporaryFolder folder;
    const std::string path = folder.path() + "/a.hdr";
    using namespace std::string_literals;
    spit(path,
         "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 1\n"s + "\x80\x40\x20\x81" + "\x00\x00\x80\x85"s);
    const Texels texels = readTexels(path);
    CHECK(texels.info.type == TexelType::Float);
    const std::vector<float> rgb = linearRgb(texels, TexelColor::Auto, path);
    CHECK(rgb[0] == Approx(1).epsilon(0.01));
    CHECK(rgb[1] == Approx(0.5).epsilon(0.02));
    CHECK(rgb[5] == Approx(16).epsilon(0.01));
}

TEST_CASE("texels of an EXR lie where its data window lies in the picture", "[texels]") {
    const TemporaryFolder folder;
    const std::string name = folder / "part.exr";
    std::vector<float> rgb(18);
    // Exact as halves.
    for (std::size_t i = 0; i < rgb.size(); ++i) rgb[i] = static_cast<float>(i + 1) / 32;
    Image image = imageOf(rgb);
    image.whole_width = 5;
    image.whole_height = 4;
    // Within the picture, partly outside on either side, and wholly outside of it.
    for (const auto& [left, top] : {std::pair{1, 1}, std::pair{-1, -1}, std::pair{4, 3}, std::pair{9, 0}}) {
        image.left = left;
        image.top = top;
        writeImage(name, OutputFormat::Exr, image);
        const Texels texels = readTexels(name);
        REQUIRE(texels.info.width == 5);
        REQUIRE(texels.info.height == 4);
        REQUIRE(texels.bytes.size() == 5 * 4 * 3 * sizeof(float));
        std::vector<float> found(5 * 4 * 3);
        std::memcpy(found.data(), texels.bytes.data(), texels.bytes.size());
        for (int y = 0; y < 4; ++y)
            for (int x = 0; x < 5; ++x)
                for (int c = 0; c < 3; ++c) {
                    const int column = x - left, row = y - top;
                    const bool inside = column >= 0 && column < 3 && row >= 0 && row < 2;
                    INFO(left << " " << top << ": " << x << " " << y);
                    CHECK(found[static_cast<std::size_t>((y * 5 + x) * 3 + c)] ==
                          (inside ? rgb[static_cast<std::size_t>((row * 3 + column) * 3 + c)] : 0));
                }
    }
}

namespace {

/// The beginning of an EXR of as many channels of halves as asked for, and zeros in place of its pixels.
std::string exrOf(int channels, std::int32_t width, std::int32_t height, std::size_t bytes) {
    const auto number = [](auto value) {
        return std::string(reinterpret_cast<const char*>(&value), sizeof value);
    };
    std::string text = number(std::int32_t{20000630}) + number(std::int32_t{2});
    const auto attribute = [&](const char* name, const char* type, const std::string& value) {
        text += name + std::string(1, '\0') + type + std::string(1, '\0') +
                number(static_cast<std::int32_t>(value.size())) + value;
    };
    std::string list;
    for (int i = 0; i < channels; ++i) {
        const std::string name = i < 3 ? std::string(1, "RGB"[i]) : "c" + std::to_string(10000 + i);
        list += name + std::string(1, '\0') + number(std::int32_t{1}) + std::string(4, '\0') +
                number(std::int32_t{1}) + number(std::int32_t{1});
    }
    const std::string window = std::string(8, '\0') + number(width - 1) + number(height - 1);
    attribute("channels", "chlist", list + std::string(1, '\0'));
    attribute("compression", "compression", "\3");
    attribute("dataWindow", "box2i", window);
    attribute("displayWindow", "box2i", window);
    attribute("lineOrder", "lineOrder", std::string(1, '\0'));
    attribute("pixelAspectRatio", "float", number(1.0f));
    attribute("screenWindowCenter", "v2f", std::string(8, '\0'));
    attribute("screenWindowWidth", "float", number(1.0f));
    return text + std::string(bytes, '\0');
}

}  // namespace

TEST_CASE("an EXR of far more channels than a texture has is refused before they are decoded", "[texels]") {
    const TemporaryFolder folder;
    const std::string name = folder / "many.exr";
    const auto refused = [&](int channels, std::int32_t width) {
        std::ofstream(name, std::ios::binary) << exrOf(channels, width, 1024, 200000);
        return refusal([&] { (void)texelsInfo(name); });
    };
    CHECK_THAT(refused(1000, 2048), Contains("it has 1000 channels") && Contains("a separate file"));
    // Fewer channels, or fewer pixels.
    CHECK(refused(190, 2048) == "nothing was refused");
    CHECK(refused(1000, 256) == "nothing was refused");
}

TEST_CASE("a display window that no pixels pay for is refused", "[texels]") {
    const TemporaryFolder folder;
    const std::string name = folder / "part.exr";
    Image image = imageOf(std::vector<float>(18, 0.5f));
    // 16 million pixels are allowed with any data window, more with 64 times its pixels.
    for (const auto& [width, height] : {std::pair{1u << 24, 1u}, std::pair{4096u, 4096u}}) {
        image.whole_width = width;
        image.whole_height = height;
        writeImage(name, OutputFormat::Exr, image);
        CHECK(texelsInfo(name).count() == std::uint64_t{1} << 24);
    }
    for (const auto& [width, height] : {std::pair{184549379u, 1u}, std::pair{4097u, 4096u}}) {
        image.whole_width = width;
        image.whole_height = height;
        writeImage(name, OutputFormat::Exr, image);
        CHECK_THROWS_WITH(texelsInfo(name), Contains("its display window has") &&
                                       Contains("its data window only 3 x 2"));
    }
}

TEST_CASE("texels of a JPEG: colour, grey, progressive, without metadata", "[texels]") {
    const TemporaryFolder folder;
    const std::string path = folder.path() + "/a.jpg";
    // Of one colour a block: coding at the best quality is off by rounding only.
    const unsigned size = 16;
    std::vector<std::uint8_t> codes;
    for (unsigned y = 0; y < size; ++y)
        for (unsigned x = 0; x < size; ++x) {
            const std::uint8_t level = y < 8 ? 200 : 40;
            codes.insert(codes.end(), {level, x < 8 ? std::uint8_t{100} : std::uint8_t{20}, 90});
        }
    for (const bool progressive : {false, true}) {
        writeJpeg(path, size, size, 3, codes, progressive);
        const Texels texels = readTexels(path);
        REQUIRE(texels.bytes.size() == codes.size());
        int worst = 0;
        for (std::size_t i = 0; i < codes.size(); ++i)
            worst = std::max(worst, std::abs(int{texels.bytes[i]} - int{codes[i]}));
        CHECK(worst <= 2);
    }
    // An IPTC block whose sizes lie: the reader of OpenImageIO reads beyond it (docs/decisions/0005).
    std::string bytes = slurp(path);
    const std::string lies = std::string("\xff\xed\x00\x20", 4) + "Photoshop 3.0" + std::string(1, '\0') +
                             "8BIM\x04\x04\xff\xff\xff\xff\xff\xff\x1c\x02";
    std::string padded = lies;
    padded.resize(2 + 0x20, '\xff');
    bytes.insert(2, padded);
    spit(path, bytes);
    CHECK(readTexels(path).info.width == size);

    std::vector<std::uint8_t> grey(std::size_t{size} * size, 77);
    writeJpeg(path, size, size, 1, grey);
    const Texels texels = readTexels(path);
    CHECK(texels.info.channels == 1);
    CHECK(texels.bytes == grey);
    CHECK(linearRgb(texels, TexelColor::Auto, path).size() == 3 * grey.size());
}

TEST_CASE("colours of other primaries become those of sRGB", "[texels]") {
    const TemporaryFolder folder;
    const std::string path = folder.path() + "/a.exr";
    Image image = imageOf(std::vector<float>(18, 0.5f));
    image.chromaticities = chromaticities(ColorSpace::Xyz);
    writeImage(path, OutputFormat::Exr, image);
    const std::vector<float> rgb = linearRgb(readTexels(path), TexelColor::Auto, path);
    const Vec3d expected = multiply(xyzToRgb(ColorSpace::LinearSrgb), Vec3d{0.5, 0.5, 0.5});
    for (std::size_t k = 0; k < 3; ++k) CHECK(rgb[k] == Approx(expected[k]).margin(1e-6));

    // ITU-R BT.2087-0, table 4: BT.2020 in BT.709.
    image.chromaticities = std::array<double, 8>{0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290};
    image.pixels[0] = 1, image.pixels[1] = 0.25f, image.pixels[2] = 0;
    writeImage(path, OutputFormat::Exr, image);
    const std::vector<float> wide = linearRgb(readTexels(path), TexelColor::Auto, path);
    CHECK(wide[0] == Approx(1.6605 - 0.5876 / 4).margin(1e-4));
    CHECK(wide[1] == Approx(-0.1246 + 1.1329 / 4).margin(1e-4));
    CHECK(wide[2] == Approx(-0.0182 - 0.1006 / 4).margin(1e-4));
    CHECK(wide[3] == Approx(0.5));

    image.chromaticities = std::array<double, 8>{0.7, 0.3, 0.7, 0.3, 0.1, 0.1, 0.3, 0.3};
    writeImage(path, OutputFormat::Exr, image);
    CHECK_THAT(refusal([&] { (void)linearRgb(readTexels(path), TexelColor::Auto, path); }),
               Contains("primaries") && Contains("a.exr"));
}

TEST_CASE("images that cannot be values say why", "[texels]") {
    const TemporaryFolder folder;
    const std::string path = folder.path() + "/a";
    CHECK_THAT(refusalOf(path), Contains(path) && Contains("cannot be opened"));
    CHECK_THAT(refusalOf(folder.path()), Contains("directory"));
    spit(path, "");
    CHECK_THAT(refusalOf(path), Contains("it is not a PNG, JPEG"));
    spit(path, "GIF89a");
    CHECK_THAT(refusalOf(path), Contains("it is not a PNG, JPEG"));

    writeImage(path, OutputFormat::Png, imageOf(linearCodes()));
    const std::string png = slurp(path);
    spit(path, png.substr(0, png.size() - 30));
    CHECK_THAT(refusalOf(path), Contains("cannot read the image"));

    std::vector<std::uint8_t> noise(3 * 64 * 64);
    for (std::size_t i = 0; i < noise.size(); ++i)
        noise[i] = static_cast<std::uint8_t>(i * 2654435761u >> 13);
    for (const bool progressive : {false, true}) {
        writeJpeg(path, 64, 64, 3, noise, progressive);
        const std::string jpeg = slurp(path);
        REQUIRE(readTexels(path).info.width == 64);
        spit(path, jpeg.substr(0, jpeg.size() * 2 / 3));
        CHECK_THAT(refusalOf(path), Contains("cannot read the image") && Contains("end"));
    }
    writeJpeg(path, 64, 64, 4, std::vector<std::uint8_t>(4 * 64 * 64, 9));
    CHECK_THAT(refusalOf(path), Contains("CMYK"));

    // Sizes in headers that no file of this size has, and that no scene needs.
    writeJpeg(path, 64, 64, 3, noise);
    std::string large = slurp(path);
    const std::size_t frame = large.find(std::string("\xff\xc0", 2));
    REQUIRE(frame != std::string::npos);
    large.replace(frame + 5, 4, "\x3f\xff\x3f\xff");  // 16383 x 16383
    spit(path, large);
    CHECK_THAT(refusalOf(path), Contains("file of its size"));
    large.replace(frame + 5, 4, "\x7f\xff\x7f\xff");
    large.resize(std::size_t{5} << 20, '\0');
    spit(path, large);
    CHECK_THAT(refusalOf(path), Contains("32767 x 32767") && Contains("256 million"));

    // A film's other planes are no colour.
    Image named = imageOf(linearCodes());
    named.channels.push_back("depth.q");
    named.pixels.resize(24, 0.25f);
    writeImage(path, OutputFormat::Exr, named);
    CHECK(readTexels(path).info.channels == 3);
}

// The limit counts the memory of the pixels, not the size of the file.
TEST_CASE("an image of one colour is read, however small its file is", "[texels]") {
    const TemporaryFolder folder;
    const std::string path = folder.path() + "/a.png";
    const PngKind kind{.width = 2048, .height = 2048, .bits = 1, .color = 3};
    spit(path, pngOf(kind, zlibStream(std::string(2048 * (1 + 2048 / 8), '\0')),
                     pngChunk("PLTE", std::string("\xff\x80\x40", 3))));
    REQUIRE(std::filesystem::file_size(path) < 700);
    const Texels texels = readTexels(path);
    CHECK(texels.info.count() == 2048 * 2048);
    CHECK(texels.bytes.size() == 3 * texels.info.count());
    CHECK(texels.bytes[texels.bytes.size() - 2] == 0x80);
    CHECK(readImage(path).width == 2048);
}

TEST_CASE("colours of an EXR are multiplied by its alpha, and divided by it", "[texels]") {
    const TemporaryFolder folder;
    const std::string path = folder.path() + "/a.exr";
    Image image = imageOf({});
    image.channels = {"R", "G", "B", "A"};
    for (const float alpha : {1.0f, 0.5f, 0.25f, 0.0f, 0.1f, 1.0f})
        for (const float value : {0.5f, 0.25f, 1.0f, 1.0f}) image.pixels.push_back(value * alpha);
    std::fill_n(image.pixels.begin() + 12, 3, 0.125f);  // Light where nothing is.
    writeImage(path, OutputFormat::Exr, image);
    Texels texels = readTexels(path);
    CHECK(texels.info.is_associated);
    divideByAlpha(texels, readAlpha(path));
    const std::vector<float> rgb = linearRgb(texels, TexelColor::Auto, path);
    for (std::size_t i = 0; i < 6; ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            INFO(i);
            CHECK(rgb[3 * i + k] == (i == 3 ? Approx(0.125) : Approx(k == 0 ? 0.5 : k == 1 ? 0.25 : 1)));
        }
    image.channels = {"R", "G", "B"};
    image.pixels.resize(18);
    writeImage(path, OutputFormat::Exr, image);
    CHECK_FALSE(readTexels(path).info.is_associated);
}

TEST_CASE("a JPEG of endless scans is refused", "[texels]") {
    const TemporaryFolder folder;
    const std::string path = folder.path() + "/a.jpg";
    writeJpeg(path, 64, 64, 1, std::vector<std::uint8_t>(64 * 64, 77), true);
    std::string bytes = slurp(path);
    // The last scan again and again: each would cost a pass over the image.
    const std::size_t last = bytes.rfind(std::string("\xff\xda", 2));
    REQUIRE(last != std::string::npos);
    const std::string scan = bytes.substr(last, bytes.size() - 2 - last);
    std::string many = bytes.substr(0, last);
    for (int i = 0; i < 1000; ++i) many += scan;
    spit(path, many + bytes.substr(bytes.size() - 2));
    CHECK_THAT(refusalOf(path), Contains("scans") || Contains("cannot read"));
}
