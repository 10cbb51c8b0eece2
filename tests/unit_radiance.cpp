// Radiance HDR pictures in every order of pixels and every form of rows.
#include "base/error.h"
#include "base/temporary_folder.h"
#include "captured_log.h"
#include "catch.h"
#include "file_bytes.h"
#include "image/image_io.h"
#include "image/texels.h"
#include "spectra/spectra.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <functional>

using namespace crt;
using crt::test::CapturedLog;

namespace {

using Rgbe = std::array<unsigned char, 4>;

/// 9 wide and 10 high, so that rows along either axis may be in runs; with equal neighbours, along both.
constexpr std::uint32_t kWidth = 9, kHeight = 10;
Rgbe pixelAt(std::uint32_t x, std::uint32_t y) {
    const std::uint32_t column = x / 3, row = y / 4;
    return {static_cast<unsigned char>(128 + 10 * column), static_cast<unsigned char>(20 * row + 5),
            static_cast<unsigned char>(3 * column + row), static_cast<unsigned char>(127 + column)};
}

float valueOf(const Rgbe& pixel, std::size_t k) { return std::ldexp(float(pixel[k]), pixel[3] - 136); }

std::string textOf(const Rgbe& pixel) { return {pixel.begin(), pixel.end()}; }

using Row = std::vector<Rgbe>;

std::string flat(const Row& row) {
    std::string text;
    for (const Rgbe& pixel : row) text += textOf(pixel);
    return text;
}

std::string oldRuns(const Row& row) {
    std::string text;
    for (std::size_t x = 0; x < row.size();) {
        std::size_t end = x + 1;
        while (end < row.size() && row[end] == row[x]) ++end;
        text += textOf(row[x]);
        if (end - x > 1) text += textOf({1, 1, 1, static_cast<unsigned char>(end - x - 1)});
        x = end;
    }
    return text;
}

std::string newRuns(const Row& row) {
    std::string text{2, 2, static_cast<char>(row.size() >> 8), static_cast<char>(row.size() & 255)};
    for (std::size_t k = 0; k < 4; ++k)
        for (std::size_t x = 0; x < row.size();) {
            std::size_t end = x + 1;
            while (end < row.size() && row[end][k] == row[x][k]) ++end;
            if (end - x > 2) {
                text += static_cast<char>(128 + end - x);
                text += static_cast<char>(row[x][k]);
            } else {
                text += static_cast<char>(end - x);
                for (std::size_t i = x; i < end; ++i) text += static_cast<char>(row[i][k]);
            }
            x = end;
        }
    return text;
}

/// "-Y +X": the signs and the axes, the slower one first.
std::string pictureIn(const std::string& order, const std::function<std::string(const Row&)>& code,
                      const std::string& header = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n") {
    const bool columns = order[1] == 'X';
    const char vertical = columns ? order[2] : order[0], horizontal = columns ? order[0] : order[2];
    std::string text =
        header + (columns ? fmt::format("{}X {} {}Y {}\n", order[0], kWidth, order[2], kHeight)
                          : fmt::format("{}Y {} {}X {}\n", order[0], kHeight, order[2], kWidth));
    const std::uint32_t rows = columns ? kWidth : kHeight, pixels = columns ? kHeight : kWidth;
    for (std::uint32_t r = 0; r < rows; ++r) {
        Row row;
        for (std::uint32_t c = 0; c < pixels; ++c) {
            const std::uint32_t x = columns ? r : c, y = columns ? c : r;
            row.push_back(
                pixelAt(horizontal == '-' ? kWidth - 1 - x : x, vertical == '+' ? kHeight - 1 - y : y));
        }
        text += code(row);
    }
    return text;
}

void checkPicture(const std::vector<float>& rgb, std::uint32_t width, std::uint32_t height) {
    REQUIRE(width == kWidth);
    REQUIRE(height == kHeight);
    REQUIRE(rgb.size() == 3u * kWidth * kHeight);
    std::size_t wrong = 0;
    for (std::uint32_t y = 0; y < kHeight; ++y)
        for (std::uint32_t x = 0; x < kWidth; ++x)
            for (std::size_t k = 0; k < 3; ++k)
                wrong += rgb[3 * (y * kWidth + x) + k] != valueOf(pixelAt(x, y), k);
    CHECK(wrong == 0);
}

std::string refusalOf(const std::string& path) {
    try {
        (void)readTexels(path);
    } catch (const Error& e) {
        return e.what();
    }
    return "nothing was refused";
}

const std::string kRgbe = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n";

}  // namespace

TEST_CASE("a Radiance picture is read in all eight orders and every form of rows", "[texels][radiance]") {
    const TemporaryFolder folder;
    const std::string path = folder / "a.hdr";
    const std::pair<const char*, std::function<std::string(const Row&)>> forms[] = {
        {"flat", flat}, {"old runs", oldRuns}, {"new runs", newRuns}};
    for (const char* signature : {"#?RADIANCE", "#?RGBE"})
        for (const char* order : {"-Y+X", "-Y-X", "+Y+X", "+Y-X", "+X-Y", "+X+Y", "-X-Y", "-X+Y"})
            for (const auto& [name, form] : forms) {
                INFO(signature << " " << order << " " << name);
                spit(path, pictureIn(order, form,
                                     std::string(signature) + "\n# made by hand\r\npfilt -1 a\n" +
                                         "FORMAT=32-bit_rle_rgbe\n\n"));
                const Texels texels = readTexels(path);
                checkPicture(linearRgb(texels, TexelColor::Auto, path), texels.info.width,
                             texels.info.height);
                const Image image = readImage(path);
                checkPicture(image.pixels, image.width, image.height);
            }
}

TEST_CASE("old runs of a Radiance picture have digits to the base 256", "[texels][radiance]") {
    const TemporaryFolder folder;
    const std::string path = folder / "a.hdr", pixel = textOf({128, 64, 32, 129}),
                      other = textOf({64, 64, 64, 130});
    // 1 + 87 + 2 * 256 pixels, and another.
    spit(path, kRgbe + "-Y 1 +X 601\n" + pixel + textOf({1, 1, 1, 87}) + textOf({1, 1, 1, 2}) + other);
    const std::vector<float> rgb = linearRgb(readTexels(path), TexelColor::Auto, path);
    for (std::size_t x = 0; x < 600; ++x) {
        INFO(x);
        CHECK(rgb[3 * x] == 1);
    }
    CHECK(rgb[1800] == 1);
    CHECK(rgb[1801] == 1);
}

TEST_CASE("a Radiance picture of XYZ becomes red, green and blue", "[texels][radiance]") {
    const TemporaryFolder folder;
    const std::string path = folder / "a.hdr";
    spit(path, "#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n" + textOf({128, 64, 32, 129}));
    const std::vector<float> rgb = linearRgb(readTexels(path), TexelColor::Auto, path);
    const Vec3d expected = multiply(xyzToRgb(ColorSpace::LinearSrgb), Vec3d{1, 0.5, 0.25});
    for (std::size_t k = 0; k < 3; ++k) CHECK(rgb[k] == Approx(expected[k]).margin(1e-6));
    const Image image = readImage(path);
    REQUIRE(image.chromaticities);
    CHECK(toLinearSrgb(image).has_value());
}

TEST_CASE("colours of a Radiance picture with PRIMARIES become those of sRGB", "[texels][radiance]") {
    const TemporaryFolder folder;
    const std::string path = folder / "a.hdr", pixel = textOf({128, 32, 0, 129});
    const auto rgbOf = [&](const std::string& lines) {
        spit(path, "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n" + lines + "\n-Y 1 +X 1\n" + pixel);
        return linearRgb(readTexels(path), TexelColor::Auto, path);
    };
    const std::vector<float> plain{1, 0.25f, 0};
    CHECK(rgbOf("") == plain);
    CHECK(rgbOf("PRIMARIES=0.64 0.33 0.3 0.6 0.15 0.06 0.3127 0.329\n") == plain);
    CHECK(rgbOf("PRIMARIES=0 0 0 0 0 0 0 0\n") == plain);
    // ITU-R BT.2087-0, table 4: BT.2020 in BT.709.
    const std::vector<float> wide = rgbOf("PRIMARIES= .708 .292\t.170 .797 .131 .046 .3127 .3290\n");
    CHECK(wide[0] == Approx(1.6605 - 0.5876 / 4).margin(1e-4));
    CHECK(wide[1] == Approx(-0.1246 + 1.1329 / 4).margin(1e-4));
    CHECK(wide[2] == Approx(-0.0182 - 0.1006 / 4).margin(1e-4));
    CHECK(readImage(path).chromaticities);
    for (const char* wrong :
         {"", "1 2 3", ".64 .33 .3 .6 .15 .06 .33 x", ".64 .33 .3 .6 .15 .06 .33 .33 1"}) {
        spit(path, kRgbe.substr(0, kRgbe.size() - 1) + "PRIMARIES=" + wrong + "\n\n-Y 1 +X 1\n" + pixel);
        CHECK_THAT(refusalOf(path), Contains("its PRIMARIES is '") && Contains("not eight numbers"));
    }
    CHECK_THROWS_WITH(rgbOf("PRIMARIES=.64 .33 .64 .33 .15 .06 .33 .33\n"), Contains("span no colours"));
}

TEST_CASE("the colour correction of a Radiance picture is not divided out, and said once",
          "[texels][radiance]") {
    const TemporaryFolder folder;
    const std::string path = folder / "a.hdr", pixels = "\n-Y 1 +X 1\n" + textOf({128, 128, 128, 129});
    const auto write = [&](const std::string& lines) {
        spit(path, "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n" + lines + pixels);
    };
    write("COLORCORR=2 1 0.5\nCOLORCORR= 2 1 1\n");
    const CapturedLog log;
    CHECK(readImage(path).pixels[0] == 1);
    CHECK(log.warnings() == 1);
    CHECK_THAT(log.text(),
               Contains("a.hdr") && Contains("COLORCORR=4 1 0.5") && Contains("divide them by these"));
    write("COLORCORR=2 4 1\nCOLORCORR=0.5 0.25 1\n");
    CHECK(readImage(path).pixels[0] == 1);
    CHECK(log.warnings() == 1);
    write("COLORCORR=2\n");
    CHECK_THAT(refusalOf(path), Contains("its COLORCORR is '2', which is not three positive numbers"));
}

TEST_CASE("the exposure of a Radiance picture is not divided out, and said once", "[texels][radiance]") {
    const TemporaryFolder folder;
    const std::string path = folder / "a.hdr", pixels = "\n-Y 1 +X 1\n" + textOf({128, 128, 128, 129});
    spit(path, "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\nEXPOSURE = 0.25\n" + pixels);
    CHECK(texelsInfo(path).tags.exposure == Approx(0.5));
    const CapturedLog log;
    CHECK(readImage(path).pixels[0] == 1);
    CHECK(log.warnings() == 1);
    CHECK_THAT(log.text(), Contains("a.hdr") && Contains("EXPOSURE=0.5") && Contains("divide them by it"));
    spit(path, "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\nEXPOSURE=0.5\n" + pixels);
    CHECK(readImage(path).pixels[0] == 1);
    CHECK(log.warnings() == 1);
}

TEST_CASE("a Radiance picture that is damaged says why", "[texels][radiance]") {
    const TemporaryFolder folder;
    const std::string path = folder / "a.hdr";
    const auto refused = [&](const std::string& bytes, const std::string& why) {
        spit(path, bytes);
        INFO(bytes.substr(0, 60));
        CHECK_THAT(refusalOf(path), Contains(why));
    };
    const std::string pixel = textOf({128, 1, 1, 129});
    refused("#?RADIANCE\n\n-Y 1 +X 1\n" + pixel, "no line FORMAT=32-bit_rle_rgbe");
    refused("#?RADIANCE\nFORMAT=32-bit_rle_rgb\n\n-Y 1 +X 1\n" + pixel, "its FORMAT is '32-bit_rle_rgb'");
    refused("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=0\n\n-Y 1 +X 1\n" + pixel, "its EXPOSURE is '0'");
    refused("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n", "it ends before its pixels do");
    for (const char* size : {"-Y 1 -Y 1", "-Y 1", "-Y 0 +X 1", "-Y 1 +X 1 2", "Y 1 X 1", "-Y -1 +X 1"})
        refused(kRgbe + size + "\n" + pixel, "is not a size such as -Y 480 +X 640");
    refused(kRgbe + "-Y 1 +X 2\n" + pixel, "it ends before its pixels do");
    refused(kRgbe + "-Y 40 +X 1\n" + pixel, "more than a file of its size can hold");
    refused(kRgbe + "-Y 1 +X 70000\n" + pixel, "its rows of 70000 pixels are longer than can be read");
    refused(kRgbe + "-Y 20000 +X 20000\n" + std::string(240000, '\1'), "256 million");
    refused(kRgbe + "-Y 20000 +X 20000\n" + pixel, "more than a file of its size can hold");
    refused(kRgbe + "-Y 1 +X 2\n" + textOf({1, 1, 1, 1}) + pixel, "a row begins with a run");
    refused(kRgbe + "-Y 1 +X 2\n" + pixel + textOf({1, 1, 1, 2}), "a run goes beyond its row");
    const std::string runs = kRgbe + "-Y 1 +X 8\n";
    refused(runs + std::string("\x02\x02\x00\x09", 4) + std::string(40, '\1'), "a length that differs");
    refused(runs + std::string("\x02\x02\x00\x08\x89", 5) + std::string(40, '\1'), "a run goes beyond");
    refused(runs + std::string("\x02\x02\x00\x08\x00", 5) + std::string(40, '\1'), "a run goes beyond");
}
