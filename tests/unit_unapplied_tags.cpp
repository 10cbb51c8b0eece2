// Tags of images that crt does not apply, in the messages about them.
#include "base/temporary_folder.h"
#include "captured_log.h"
#include "catch.h"
#include "file_bytes.h"
#include "image/image_io.h"
#include "image/texels.h"
#include "jpeg_file.h"
#include "png_file.h"
#include "spectra/spectra.h"

#include <cmath>
#include <initializer_list>
#include <utility>

using namespace crt;
using crt::test::CapturedLog;

namespace {

std::string toldOf(const std::string& path, PixelUse use) {
    std::string all;
    for (const std::string& sentence : sentencesOf(texelsInfo(path).tags, path, use)) all += sentence;
    return all;
}

constexpr PixelUse kEncoded = PixelUse::EncodedColors, kNumbers = PixelUse::Numbers;

}  // namespace

TEST_CASE("what a file says of its pixels and crt does not apply is told", "[texels]") {
    const TemporaryFolder folder;
    const std::string png = folder.path() + "/a.png", jpeg = folder.path() + "/a.jpg";
    const PngKind kind{.width = 1, .height = 1, .bits = 8, .color = 2};
    const std::string stream = zlibStream(std::string("\0abc", 4)), srgb = pngChunk("sRGB", {'\0'});
    spit(png, pngOf(kind, stream, pngChunk("gAMA", bigEndian32(100000))));
    CHECK_THAT(toldOf(png, kEncoded),
               Contains("a.png") && Contains("gamma (gAMA) of 1") && Contains("as sRGB"));
    CHECK(toldOf(png, kNumbers).empty());
    spit(png, pngOf(kind, stream, pngChunk("gAMA", bigEndian32(45455))));
    CHECK(toldOf(png, kEncoded).empty());
    spit(png, pngOf(kind, stream, pngChunk("gAMA", bigEndian32(100000)) + srgb));
    CHECK(toldOf(png, kEncoded).empty());

    // One entry: orientation, SHORT, one of them, 6; in both orders of bytes.
    const std::string little("II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\0\0\0\0", 26),
        big("MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0", 26);
    writeJpeg(jpeg, 8, 8, 1, std::vector<std::uint8_t>(64, 77));
    const std::string plain = slurp(jpeg);
    CHECK(toldOf(jpeg, kEncoded).empty());
    for (const std::string& exif : {little, big}) {
        spit(png, pngOf(kind, stream, pngChunk("eXIf", exif)));
        CHECK_THAT(toldOf(png, kNumbers), Contains("EXIF orientation 6"));
        const std::string data = std::string("Exif\0\0", 6) + exif;
        std::string marked = plain;
        marked.insert(2, std::string("\xff\xe1\0", 3) + static_cast<char>(data.size() + 2) + data);
        spit(jpeg, marked);
        CHECK_THAT(toldOf(jpeg, kNumbers),
                   Contains("a.jpg") && Contains("EXIF orientation 6") && Contains("rotate the pixels"));
        // Truncated anywhere, it is ignored.
        for (std::size_t size = 0; size < exif.size() - 4; ++size) {
            spit(png, pngOf(kind, stream, pngChunk("eXIf", exif.substr(0, size))));
            CHECK(toldOf(png, kNumbers).empty());
        }
    }
}

TEST_CASE("warnings of primaries and code points of a PNG that are not those of sRGB", "[texels]") {
    const TemporaryFolder folder;
    const std::string png = folder / "a.png";
    const auto told = [&](const std::string& chunks, PixelUse use = kEncoded) {
        spit(png, pngOf({.width = 1, .height = 1}, zlibStream(std::string("\0abc", 4)), chunks));
        return toldOf(png, use);
    };
    // White, red, green and blue.
    const auto primaries = [](std::initializer_list<std::uint32_t> numbers) {
        std::string chunk;
        for (const std::uint32_t number : numbers) chunk += bigEndian32(number);
        return pngChunk("cHRM", chunk);
    };
    const std::string srgb = primaries({31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000}),
                      p3 = primaries({31270, 32900, 68000, 32000, 26500, 69000, 15000, 6000}),
                      is_srgb = pngChunk("sRGB", {'\0'});
    CHECK(told(srgb).empty());
    CHECK_THAT(told(p3),
               Contains("(cHRM) 0.68 0.32 0.265 0.69 0.15 0.06 0.3127 0.329, which crt ignores: it "
                        "reads the colours as sRGB"));
    CHECK_THAT(told(p3, PixelUse::LinearColors), Contains("as linear with the primaries of sRGB"));
    CHECK(told(p3, kNumbers).empty());
    CHECK(told(p3 + is_srgb).empty());

    const auto points = [](std::string bytes) { return pngChunk("cICP", bytes); };
    const std::string pq = points({9, 16, 0, 1});
    CHECK(told(points({1, 13, 0, 1}) + p3).empty());  // It counts before the others.
    CHECK_THAT(told(pq + is_srgb), Contains("(cICP) 9/16/0/1, which crt ignores"));
    CHECK_THAT(told(points({1, 8, 0, 1})), Contains("(cICP) 1/8/0/1"));
    CHECK(told(points({1, 8, 0, 1}), PixelUse::LinearColors).empty());
    CHECK(told(pq, kNumbers).empty());
    const CapturedLog log;
    told(pq);
    (void)readImage(png);
    CHECK(log.warnings() == 1);
    CHECK_THAT(log.text(), Contains("cICP"));
}

namespace {

std::string bigEndian16(double value) { return bigEndian32(static_cast<std::uint32_t>(value)).substr(2); }
std::string fixed(double value) {
    return bigEndian32(static_cast<std::uint32_t>(static_cast<std::int32_t>(std::lround(value * 65536))));
}
std::string xyzTag(double x, double y, double z) {
    return std::string("XYZ \0\0\0\0", 8) + fixed(x) + fixed(y) + fixed(z);
}
std::string curveTag(const std::vector<double>& words) {
    std::string tag = std::string("curv\0\0\0\0", 8) + bigEndian32(static_cast<std::uint32_t>(words.size()));
    for (const double word : words) tag += bigEndian16(word);
    return tag;
}
std::string parametricTag(int type, const std::vector<double>& parameters) {
    std::string tag = std::string("para\0\0\0\0", 8) + bigEndian16(type) + std::string(2, '\0');
    for (const double parameter : parameters) tag += fixed(parameter);
    return tag;
}
std::string descriptionTag(const std::string& name) {
    return std::string("desc\0\0\0\0", 8) + bigEndian32(static_cast<std::uint32_t>(name.size() + 1)) + name +
           '\0';
}

using Tags = std::vector<std::pair<std::string, std::string>>;

std::string profileOf(const std::string& space, const Tags& tags) {
    std::string header(128, '\0'), data;
    header.replace(16, 4, space);
    header += bigEndian32(static_cast<std::uint32_t>(tags.size()));
    for (const auto& [name, content] : tags) {
        header += name + bigEndian32(static_cast<std::uint32_t>(132 + 12 * tags.size() + data.size())) +
                  bigEndian32(static_cast<std::uint32_t>(content.size()));
        data += content;
    }
    return header + data;
}

const std::string kSrgbCurve = parametricTag(3, {2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045});

Tags matrixTags(const std::string& curve, bool adobe = false) {
    return {{"desc", descriptionTag(adobe ? "Adobe RGB (1998)" : "made by hand")},
            {"rXYZ", adobe ? xyzTag(0.60974, 0.31111, 0.01947) : xyzTag(0.43607, 0.22249, 0.01392)},
            {"gXYZ", adobe ? xyzTag(0.20528, 0.62567, 0.06087) : xyzTag(0.38515, 0.71687, 0.09708)},
            {"bXYZ", adobe ? xyzTag(0.14919, 0.06322, 0.74457) : xyzTag(0.14307, 0.06061, 0.71410)},
            {"rTRC", curve},
            {"gTRC", curve},
            {"bTRC", curve}};
}

std::string profileChunk(const std::string& profile) {
    return pngChunk("iCCP", std::string("in a file\0\0", 11) + zlibStream(profile));
}

/// A JPEG with a profile in parts of `part` bytes.
std::string withProfile(const std::string& jpeg, const std::string& profile, std::size_t part) {
    const std::size_t count = (profile.size() + part - 1) / part;
    std::string markers;
    for (std::size_t i = 0; i < count; ++i) {
        const std::string data = std::string("ICC_PROFILE\0", 12) + static_cast<char>(i + 1) +
                                 static_cast<char>(count) + profile.substr(i * part, part);
        markers += "\xff\xe2" + bigEndian16(static_cast<double>(data.size() + 2)) + data;
    }
    return jpeg.substr(0, 2) + markers + jpeg.substr(2);
}

}  // namespace

TEST_CASE("warnings of colour profiles that are not those of sRGB", "[texels]") {
    const TemporaryFolder folder;
    const std::string png = folder / "a.png", jpeg = folder / "a.jpg";
    const auto told = [&](const std::string& chunks, PixelUse use = kEncoded) {
        spit(png, pngOf({.width = 1, .height = 1}, zlibStream(std::string("\0abc", 4)), chunks));
        return toldOf(png, use);
    };
    std::vector<double> table;
    for (int i = 0; i < 1024; ++i) table.push_back(65535 * srgbToLinear(i / 1023.0));
    // Each of these is what programs call sRGB.
    for (const std::string& curve :
         {kSrgbCurve, curveTag(table), curveTag({2.2 * 256}), parametricTag(0, {2.2})})
        CHECK(told(profileChunk(profileOf("RGB ", matrixTags(curve)))).empty());
    CHECK(told(profileChunk(profileOf("GRAY", {{"kTRC", kSrgbCurve}}))).empty());

    const std::string adobe = profileOf("RGB ", matrixTags(curveTag({2.2 * 256}), true));
    CHECK_THAT(
        told(profileChunk(adobe)),
        Contains("a.png") && Contains("the colour profile (ICC) 'Adobe RGB (1998)', which crt ignores"));
    CHECK_THAT(told(profileChunk(adobe), PixelUse::LinearColors), Contains("Adobe RGB"));
    CHECK(told(profileChunk(adobe), kNumbers).empty());
    CHECK(told(profileChunk(adobe) + pngChunk("cICP", {1, 13, 0, 1})).empty());
    // It counts before gAMA, too.
    CHECK(
        told(profileChunk(profileOf("RGB ", matrixTags(kSrgbCurve))) + pngChunk("gAMA", bigEndian32(100000)))
            .empty());
    for (const std::string& curve :
         {curveTag({}), curveTag({1.8 * 256}), parametricTag(0, {1.8}), std::string()})
        CHECK_THAT(told(profileChunk(profileOf("RGB ", matrixTags(curve)))),
                   Contains("(ICC) 'made by hand'"));
    CHECK_THAT(told(profileChunk(profileOf("GRAY", {{"kTRC", curveTag({})}}))),
               Contains("(ICC) 'in a file'"));
    Tags with_table = matrixTags(kSrgbCurve);
    with_table.emplace_back("A2B0", std::string("mft2", 4));
    CHECK_THAT(told(profileChunk(profileOf("RGB ", with_table))), Contains("(ICC) 'made by hand'"));
    Tags unicode{{"desc", std::string("mluc\0\0\0\0\0\0\0\1\0\0\0\x0c"
                                      "enUS\0\0\0\x04\0\0\0\x1c\0P\0"
                                      "3",
                                      32)}};
    CHECK_THAT(told(profileChunk(profileOf("RGB ", unicode))), Contains("(ICC) 'P3'"));

    // Damaged profiles are no reason to refuse an image.
    for (std::size_t size = 0; size < adobe.size(); ++size)
        CHECK_THAT(told(profileChunk(adobe.substr(0, size))), Contains("(ICC)"));
    CHECK_THAT(told(pngChunk("iCCP", std::string("cut\0\0", 5) + zlibStream(adobe).substr(0, 50))),
               Contains("(ICC) 'cut'"));
    CHECK_THAT(told(pngChunk("iCCP", "")), Contains("(ICC) 'without a name'"));

    writeJpeg(jpeg, 8, 8, 1, std::vector<std::uint8_t>(64, 77));
    const std::string plain = slurp(jpeg);
    for (const std::size_t part : {adobe.size(), std::size_t{100}}) {
        spit(jpeg, withProfile(plain, adobe, part));
        CHECK_THAT(toldOf(jpeg, kEncoded), Contains("a.jpg") && Contains("(ICC) 'Adobe RGB (1998)'"));
        CHECK(readTexels(jpeg).bytes[0] == 77);
        spit(jpeg, withProfile(plain, profileOf("RGB ", matrixTags(kSrgbCurve)), part));
        CHECK(toldOf(jpeg, kEncoded).empty());
    }
    std::string damaged = withProfile(plain, adobe, 100);
    damaged[2 + 4 + 12] = 9;  // The number of the first part.
    spit(jpeg, damaged);
    CHECK_THAT(toldOf(jpeg, kEncoded), Contains("(ICC) 'damaged'"));
    CHECK(readTexels(jpeg).bytes[0] == 77);
}
