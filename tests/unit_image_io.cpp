// Image files: bytes of the simple formats, everything an EXR has to keep, and what is refused.
//
// Over 450 lines: one list of formats, and what each has to keep and to refuse.
#include "base/error.h"
#include "base/log.h"
#include "base/temporary_folder.h"
#include "captured_log.h"
#include "catch.h"
#include "file_bytes.h"
#include "image/image_io.h"
#include "image/texels.h"
#include "png_file.h"

#include <fmt/format.h>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <limits>

using namespace crt;
using crt::TemporaryFolder;
namespace fs = std::filesystem;

namespace {

std::string floatBytes(const std::vector<float>& values) {
    return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float)};
}

Image rgbImage(std::uint32_t width, std::uint32_t height, std::vector<float> pixels) {
    Image image;
    image.width = width;
    image.height = height;
    image.channels = {"R", "G", "B"};
    image.pixels = std::move(pixels);
    return image;
}

/// Two pixels wide, two high, every plane that a film can have.
Image fullImage() {
    Image image;
    image.width = 2;
    image.height = 2;
    image.channels = {"R",    "G",    "B",    "Albedo.R", "Albedo.G",  "Albedo.B",
                      "Ns.X", "Ns.Y", "Ns.Z", "Z",        "Variance.Y"};
    for (std::size_t i = 0; i < 4 * image.channels.size(); ++i)
        image.pixels.push_back(0.1f * static_cast<float>(i) - 0.7f);
    image.pixels[0] = 1e30f;  // Beyond half.
    image.pixels[1] = std::numeric_limits<float>::denorm_min();
    image.integer_channels = {"id.primitive", "sampleCount"};
    image.integers = {0xffffffffu, 16, 0, 4000000001u, 16777217, 1, 7, 1024};
    image.metadata = {{"Software", "crt 0.1.0"},
                      {"crt/version", "0.1.0"},
                      {"crt/backend", "embree 0.1.0"},
                      {"crt/device", "A CPU (8 threads)"},
                      {"crt/spp", "64"},
                      {"crt/seed", "18446744073709551615"},
                      {"crt/sceneHash", "0123456789abcdef0123456789abcdef"},
                      {"crt/sampleRanges", "0-32;64-96"},
                      {"DateTime", "2026:11:20 10:00:00"},
                      {"renderTimeSeconds", "12.5"},
                      {"samplesPerPixel", "64"},
                      {"colorInteropID", "lin_ap1_scene"}};
    image.chromaticities = chromaticities(ColorSpace::AcesCg);
    return image;
}

bool maps(const char* library) { return slurp("/proc/self/maps").find(library) != std::string::npos; }

/// Runs one hidden test case of `program` in a separate process, where nothing has been loaded yet.
bool runAlone(const std::string& program, const char* tag, const std::string& environment = "") {
    return std::system((environment + " '" + program + "' '" + tag + "' >/dev/null 2>&1").c_str()) == 0;
}
std::string thisProgram() { return fs::read_symlink("/proc/self/exe").string(); }

struct Quiet {
    Quiet() { setLogLevel(LogLevel::Off); }
    ~Quiet() { setLogLevel(LogLevel::Info); }
};

}  // namespace

TEST_CASE("the extension says the format", "[image_io]") {
    CHECK(formatOfFile("a/b.exr") == OutputFormat::Exr);
    CHECK(formatOfFile("a.b.PNG") == OutputFormat::Png);
    CHECK(formatOfFile("x.ppm") == OutputFormat::Ppm);
    CHECK(formatOfFile("x.Pfm") == OutputFormat::Pfm);
    CHECK(formatOfFile("x.jpg") == OutputFormat::Jpeg);
    CHECK(formatOfFile("x.JPEG") == OutputFormat::Jpeg);
    CHECK_FALSE(formatOfFile("x.tif"));
    CHECK_FALSE(formatOfFile("exr"));
}

TEST_CASE("a PFM is its header and little-endian floats, bottom row first", "[image_io]") {
    const TemporaryFolder directory;
    const std::string path = directory / "image.pfm";
    Image image = rgbImage(1, 2, {1, 2, 3, 4, 5, 6});
    image.channels = {"R", "G", "B"};
    writeImage(path, OutputFormat::Pfm, image);
    CHECK(slurp(path) == "PF\n1 2\n-1.0\n" + floatBytes({4, 5, 6, 1, 2, 3}));
    const Image back = readImage(path);
    CHECK(back.width == 1);
    CHECK(back.height == 2);
    CHECK(back.channels == std::vector<std::string>{"R", "G", "B"});
    CHECK(back.pixels == image.pixels);
    CHECK(directory.fileCount() == 1);

    // Colour goes by name, not by position, and other planes stay out.
    image.channels = {"Z", "B", "G", "R"};
    image.pixels = {9, 3, 2, 1, 9, 6, 5, 4};
    writeImage(path, OutputFormat::Pfm, image);
    CHECK(readImage(path).pixels == std::vector<float>{1, 2, 3, 4, 5, 6});

    // Infinities and NaN pass unchanged; the float format has a place for them.
    writeImage(path, OutputFormat::Pfm,
               rgbImage(1, 1, {std::numeric_limits<float>::infinity(), -0.0f, std::nanf("")}));
    CHECK(std::isinf(readImage(path).pixels[0]));
    CHECK(std::signbit(readImage(path).pixels[1]));
    CHECK(std::isnan(readImage(path).pixels[2]));
}

TEST_CASE("PFM variants of other programs are read", "[image_io]") {
    const TemporaryFolder directory;
    const std::string path = directory / "image.pfm";
    spit(path, std::string("PF 1 1 1.0 ") + std::string("\x3f\x80\0\0\x40\0\0\0\x40\x40\0\0", 12));
    CHECK(readImage(path).pixels == std::vector<float>{1, 2, 3});
    spit(path, "Pf\n1 2\n-1\n" + floatBytes({7, 8}));
    CHECK(readImage(path).pixels == std::vector<float>{8, 8, 8, 7, 7, 7});
    const test::CapturedLog log;
    spit(path, "Pf\r\n1 2\r\n-1\r\n" + floatBytes({7, 8}));  // lines end as DOS ends them
    CHECK(readImage(path).pixels == std::vector<float>{8, 8, 8, 7, 7, 7});
    CHECK(log.warnings() == 0);
    spit(path, "Pf\n1 2\n-1\n" + floatBytes({7, 8, 9}));
    CHECK(readImage(path).pixels == std::vector<float>{8, 8, 8, 7, 7, 7});
    CHECK_THAT(log.text(), Contains("4 bytes follow the pixels"));
    spit(path, "PF4\n1 1\n-1\n" + floatBytes({1, 2, 3, 4}));
    CHECK_THROWS_WITH(readImage(path), Contains("PF (colours) or Pf (grey)"));
}

TEST_CASE("a PPM is 8-bit sRGB", "[image_io]") {
    const TemporaryFolder directory;
    const Quiet quiet;
    const std::string path = directory / "image.ppm";
    // Linear 0.2140 is sRGB 0.5: code 127.5, which rounds up.
    const float half = static_cast<float>(srgbToLinear(0.5)) * 1.0001f;
    const Image image = rgbImage(2, 1, {0, 1, half, -0.5f, 7, std::nanf("")});
    writeImage(path, OutputFormat::Ppm, image);
    CHECK(slurp(path) == "P6\n2 1\n255\n" + std::string("\x00\xff\x80\x00\xff\x00", 6));
    const EncodedImage encoded = encodeSrgb8(image);
    CHECK(encoded.clipped_values == 3);
    const Image back = readImage(path);
    CHECK(back.pixels[1] == 1.0f);
    CHECK(back.pixels[2] == Approx(srgbToLinear(128.0 / 255)));

    // Reading and writing again is the identity on every code.
    std::string all = "P6\n# a comment\n256 1\n255\n";
    for (int i = 0; i < 256; ++i) all += std::string(3, static_cast<char>(i));
    spit(path, all);
    const EncodedImage again = encodeSrgb8(readImage(path));
    for (int i = 0; i < 256; ++i) CHECK(int{again.rgb[3 * i]} == i);
    CHECK(again.clipped_values == 0);

    spit(path, std::string("P6 1 1 65535 \xff\xff\x00\x00\x80\x00", 19));
    CHECK(readImage(path).pixels[0] == 1.0f);
    CHECK(readImage(path).pixels[2] == Approx(srgbToLinear(32768.0 / 65535)));
}

TEST_CASE("what lies outside 8 bits is clipped and counted, not what rounding pushed there", "[image_io]") {
    const EncodedImage encoded = encodeSrgb8(rgbImage(1, 1, {std::nextafter(1.0f, 2.0f), -1e-8f, 1.01f}));
    CHECK(encoded.clipped_values == 1);
    CHECK(encoded.rgb == std::vector<std::uint8_t>{255, 0, 255});
}

TEST_CASE("8-bit images of other colour spaces are converted to sRGB", "[image_io]") {
    const Vec3d srgb{0.8, 0.3, 0.1};
    const EncodedImage expected = encodeSrgb8(rgbImage(1, 1, {0.8f, 0.3f, 0.1f}));
    // srgb → XYZ by columns of the published matrix's inverse: solve with the forward one, by Cramer's
    // rule.
    const Matrix3d m = xyzToRgb(ColorSpace::LinearSrgb);
    const auto determinant = [](const Matrix3d& a) {
        return a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) -
               a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) +
               a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]);
    };
    Vec3d xyz{};
    for (int column = 0; column < 3; ++column) {
        Matrix3d replaced = m;
        for (int row = 0; row < 3; ++row) replaced[row][column] = srgb[row];
        xyz[column] = determinant(replaced) / determinant(m);
    }
    for (const ColorSpace space : {ColorSpace::Xyz, ColorSpace::AcesCg}) {
        const Vec3d v = multiply(xyzToRgb(space), xyz);
        Image image =
            rgbImage(1, 1, {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])});
        image.chromaticities = chromaticities(space);
        CHECK(encodeSrgb8(image).rgb == expected.rgb);
    }
    // The white of D65 is white.
    const Vec3d d65 = d65WhiteXyz();
    Image white =
        rgbImage(1, 1, {static_cast<float>(d65[0]), static_cast<float>(d65[1]), static_cast<float>(d65[2])});
    white.chromaticities = chromaticities(ColorSpace::Xyz);
    const EncodedImage encoded = encodeSrgb8(white);
    CHECK(encoded.rgb == std::vector<std::uint8_t>{255, 255, 255});
    CHECK(encoded.clipped_values == 0);
    // Display P3 (SMPTE EG 432-1): its red is beyond that of sRGB, its grey is a grey.
    Image p3 = rgbImage(2, 1, {1, 0, 0, 0.5f, 0.5f, 0.5f});
    p3.chromaticities = {{0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.3290}};
    CHECK(encodeSrgb8(p3).rgb == std::vector<std::uint8_t>{255, 0, 0, 188, 188, 188});
    CHECK(encodeSrgb8(p3).clipped_values == 3);
    white.chromaticities = {{0.7, 0.3, 0.7, 0.3, 0.1, 0.1, 0.3, 0.3}};
    CHECK_THROWS_WITH(encodeSrgb8(white), Contains("primaries"));
}

TEST_CASE("an EXR keeps every plane, type, number and word", "[image_io]") {
    const TemporaryFolder directory;
    const std::string path = directory / "image.exr";
    const Image image = fullImage();
    writeImage(path, OutputFormat::Exr, image);
    CHECK(directory.fileCount() == 1);
    const Image back = readImage(path);
    REQUIRE(back.width == 2);
    REQUIRE(back.height == 2);
    REQUIRE(back.channels.size() == image.channels.size());
    REQUIRE(back.integer_channels.size() == image.integer_channels.size());
    // The library may reorder channels; their names say what they are.
    for (std::size_t c = 0; c < image.channels.size(); ++c) {
        const auto found = std::find(back.channels.begin(), back.channels.end(), image.channels[c]);
        INFO(image.channels[c]);
        REQUIRE(found != back.channels.end());
        for (std::size_t p = 0; p < 4; ++p)
            CHECK(back.pixels[p * back.channels.size() +
                              static_cast<std::size_t>(found - back.channels.begin())] ==
                  image.pixels[p * image.channels.size() + c]);
    }
    for (std::size_t c = 0; c < image.integer_channels.size(); ++c) {
        const auto found =
            std::find(back.integer_channels.begin(), back.integer_channels.end(), image.integer_channels[c]);
        INFO(image.integer_channels[c]);
        REQUIRE(found != back.integer_channels.end());
        for (std::size_t p = 0; p < 4; ++p)
            CHECK(back.integers[p * 2 + static_cast<std::size_t>(found - back.integer_channels.begin())] ==
                  image.integers[p * 2 + c]);
    }
    for (const auto& [name, value] : image.metadata) {
        INFO(name);
        CHECK(metadataValue(back, name) == value);
    }
    CHECK(metadataValue(back, "compression") == "zip");
    CHECK(metadataValue(back, "no such key").empty());
    REQUIRE(back.chromaticities);
    for (int i = 0; i < 8; ++i) CHECK((*back.chromaticities)[i] == Approx((*image.chromaticities)[i]));

    // Without integer planes too.
    writeImage(path, OutputFormat::Exr, rgbImage(1, 1, {1, 2, 3}));
    CHECK(readImage(path).pixels == std::vector<float>{1, 2, 3});
    CHECK_FALSE(readImage(path).integer_channels.size() > 0);
}

TEST_CASE("an EXR says nothing that the caller did not", "[image_io]") {
    const TemporaryFolder directory;
    const std::string path = directory / "image.exr";
    writeImage(path, OutputFormat::Exr, rgbImage(1, 1, {1, 2, 3}));
    const std::string bytes = slurp(path);
    // User, place and command are private unless they are passed in, and the same image is the same file.
    CHECK(metadataValue(readImage(path), "DateTime").empty());
    CHECK(bytes.find(directory.path()) == std::string::npos);
    CHECK(bytes.find("HostComputer") == std::string::npos);
    writeImage(path, OutputFormat::Exr, rgbImage(1, 1, {1, 2, 3}));
    CHECK(slurp(path) == bytes);
}

TEST_CASE("a PNG is 8-bit sRGB with its metadata", "[image_io]") {
    const TemporaryFolder directory;
    const std::string path = directory / "image.png";
    Image image = rgbImage(2, 1, {0, 0.25f, 1, 0.5f, 0.75f, 0.125f});
    image.metadata = {{"Software", "crt 0.1.0"}, {"crt/spp", "64"}};
    writeImage(path, OutputFormat::Png, image);
    const Image back = readImage(path);
    REQUIRE(back.channels == std::vector<std::string>{"R", "G", "B"});
    CHECK(encodeSrgb8(back).rgb == encodeSrgb8(image).rgb);
    CHECK(back.pixels[0] == 0.0f);
    CHECK(back.pixels[2] == 1.0f);
    CHECK(back.pixels[3] == Approx(0.5).epsilon(0.01));
    CHECK(metadataValue(back, "Software") == "crt 0.1.0");
    CHECK(metadataValue(back, "crt/spp") == "64");
    REQUIRE(back.chromaticities);
    CHECK(*back.chromaticities == chromaticities(ColorSpace::LinearSrgb));
}

// Fails when colours are halved in resolution, when the codes are not sRGB, or when a comment is lost.
TEST_CASE("a JPEG is 8-bit sRGB with its metadata as comments", "[image_io]") {
    const TemporaryFolder directory;
    const std::string path = directory / "image.jpg";
    Image image = rgbImage(16, 8, {});
    for (std::uint32_t i = 0; i < 16 * 8; ++i)  // columns of red and blue, one pixel wide
        for (const float value : {i % 2 == 0 ? 0.5f : 0.0f, 0.25f, i % 2 == 0 ? 0.0f : 0.5f})
            image.pixels.push_back(value);
    image.metadata = {{"Software", "crt 0.1.0"}, {"crt/spp", "64"}};
    writeImage(path, OutputFormat::Jpeg, image);
    const std::string bytes = slurp(path);
    CHECK(bytes.starts_with("\xff\xd8\xff"));
    for (const char* comment : {"Software: crt 0.1.0", "crt/spp: 64"}) CHECK_THAT(bytes, Contains(comment));
    const Texels texels = readTexels(path);
    REQUIRE(texels.info.width == 16);
    REQUIRE(texels.info.channels == 3);
    const EncodedImage wanted = encodeSrgb8(image);
    int worst = 0;
    for (std::size_t i = 0; i < wanted.rgb.size(); ++i)
        worst = std::max(worst, std::abs(int{texels.bytes[i]} - int{wanted.rgb[i]}));
    CHECK(worst <= 12);  // With half the resolution of colours it is 90.
    Image wide = rgbImage(65'536, 1, std::vector<float>(3 * 65'536, 0.5f));
    CHECK_THROWS_WITH(writeImage(directory / "wide.jpg", OutputFormat::Jpeg, wide),
                      Contains("cannot write") && Contains("65500"));
    CHECK_FALSE(fs::exists(directory / "wide.jpg"));
}

TEST_CASE("damaged images are refused with a sentence", "[image_io]") {
    const TemporaryFolder directory;
    const std::string path = directory / "image.bad";
    const auto refused = [&](const std::string& bytes, const char* words) {
        spit(path, bytes);
        INFO(bytes.substr(0, 24));
        try {
            readImage(path);
            FAIL_CHECK("accepted");
        } catch (const Error& error) {
            CHECK(error.kind() == ErrorKind::Usage);
            CHECK_THAT(error.what(), Contains(path) && Contains(words));
        }
    };
    refused("", "empty");
    refused("PF\n2 2\n-1.0\n" + floatBytes({1, 2, 3}), "truncated");
    refused("PF\n2 x\n-1.0\n", "'x' for the height");
    refused("PF\n-2 2\n-1.0\n", "'-2' for the width");
    refused("PF\n2 2\n0\n", "scale");
    refused("PF\n2147483647 2147483647\n-1.0\n", "2147483647");
    refused("P6\n4 4\n255\nxx", "truncated");
    refused("P6\n4 4\n70000\nxx", "65535");
    refused("P6", "width");
    refused("this is text, not an image", "");
    CHECK_THROWS_WITH(readImage(directory / "absent.pfm"),
                      Contains("absent.pfm") && Contains("No such file"));
    CHECK_THROWS_WITH(readImage(directory.path()), Contains("is a directory"));

    const std::string exr = directory / "image.exr";
    writeImage(exr, OutputFormat::Exr, fullImage());
    const std::string whole = slurp(exr);
    refused(whole.substr(0, whole.size() - 40), "");
    refused(whole.substr(0, 100), "");
}

// Found by fuzzing. A file of no known format went through all of OpenImageIO's readers; a header could ask
// for any amount of memory.
TEST_CASE("files of other formats and headers beyond the file's size are refused", "[image_io]") {
    const TemporaryFolder directory;
    const std::string path = directory / "image";
    spit(path, "GIF89a, which OpenImageIO would read");
    CHECK_THROWS_WITH(readImage(path), Contains("not an EXR, PNG") && Contains("oiiotool"));
    spit(path, std::string("II*\0\x08\0\0\0", 8));
    CHECK_THROWS_WITH(readImage(path), Contains("not an EXR, PNG"));
    spit(path, "\xff\xd8\xff\xe0");
    CHECK_THROWS_WITH(readImage(path), Contains("not an EXR, PNG"));

    // An EXR whose first attribute says 2 GiB; OpenEXR allocates them.
    spit(path, std::string("\x76\x2f\x31\x01\x02\0\0\0note\0string\0\xff\xff\xff\x7fx", 25));
    CHECK_THROWS_WITH(readImage(path), Contains("attribute 'note' goes beyond the end"));

    // One of a known type that is shorter than the type: OpenEXR would go on reading in the middle of the
    // next.
    spit(path, std::string("\x76\x2f\x31\x01\x02\0\0\0w\0box2i\0\x05\0\0\0.....", 25));
    CHECK_THROWS_WITH(readImage(path), Contains("'w' has 5 bytes and its type, box2i, takes 16"));

    // A PNG whose only chunk says 2 GiB; libpng allocates them.
    spit(path, std::string("\x89PNG\r\n\x1a\n\x7f\xff\xff\xf0tEXtx", 17));
    CHECK_THROWS_WITH(readImage(path), Contains("chunks goes beyond the end"));

    // A Radiance HDR header and eight bytes of one of its 65535 x 65535 pixels.
    spit(path, "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 65535 +X 65535\n12345678");
    CHECK_THROWS_WITH(readImage(path),
                      Contains("65535 x 65535") && Contains("more than a file of its size can hold"));
    // A PNG of which no compression makes so few bytes.
    spit(path, pngOf({.width = 20000, .height = 20000, .bits = 8, .color = 0}, std::string(300, 'x')));
    CHECK_THROWS_WITH(readImage(path),
                      Contains("20000 x 20000 pixels, more than a file of its size can hold"));

    // One row that is so long that OpenImageIO, which reads rows by 64, would allocate 4 GiB; and one that
    // is not.
    Image row = rgbImage(6'000'000, 1, std::vector<float>(18'000'000, 0.5f));
    writeImage(path + ".exr", OutputFormat::Exr, row);
    CHECK_THROWS_WITH(readImage(path + ".exr"),
                      Contains("its rows of 6000000 pixels are longer than can be read"));
    row = rgbImage(65'535, 1, std::vector<float>(3 * 65'535, 0.5f));
    writeImage(path + ".exr", OutputFormat::Exr, row);
    CHECK(readImage(path + ".exr").width == 65'535);
}

TEST_CASE("an image that lacks what it must have is refused", "[image_io]") {
    const TemporaryFolder directory;
    for (const OutputFormat format :
         {OutputFormat::Exr, OutputFormat::Png, OutputFormat::Jpeg, OutputFormat::Ppm, OutputFormat::Pfm}) {
        Image grey = rgbImage(1, 1, {1, 1, 1});
        grey.channels = {"X", "Y", "Z"};
        CHECK_THROWS_AS(writeImage(directory / "image", format, grey), Error);
        CHECK_THROWS_AS(writeImage(directory / "image", format, rgbImage(0, 3, {})), Error);
        CHECK_THROWS_AS(writeImage(directory / "image", format, rgbImage(2, 1, {1, 1, 1})), Error);
    }
    CHECK(directory.fileCount() == 0);
}

TEST_CASE("a folder that a command fills is made, and none above it", "[image_io]") {
    const TemporaryFolder directory;
    for (const char* name : {"a", "b/", "./c/."}) {
        makeOutputFolder(directory / name);
        makeOutputFolder(directory / name);
        CHECK(fs::is_directory(directory / name));
    }
    CHECK_THROWS_WITH(makeOutputFolder(directory / "one/two"),
                      Contains("one/two") && Contains("no folder '" + (directory / "one") + "'"));
    CHECK_THROWS_WITH(makeOutputFolder(directory / "one/two/"),
                      Contains("no folder '" + (directory / "one") + "'"));
    CHECK_FALSE(fs::exists(directory / "one"));
    spit(directory / "file", "x");
    CHECK_THROWS_WITH(makeOutputFolder(directory / "file"), Contains("there is a file of this name"));
    try {
        makeOutputFolder(directory / "file");
    } catch (const Error& error) {
        CHECK(error.kind() == ErrorKind::Output);
    }
}

TEST_CASE("temporaries of killed processes are removed, and no others", "[image_io]") {
    const TemporaryFolder directory;
    const pid_t ended = ::fork();
    if (ended == 0) ::_exit(0);
    REQUIRE(::waitpid(ended, nullptr, 0) == ended);
    const auto temporary = [&](pid_t process, int attempt) {
        const std::string path = directory / fmt::format("image.exr.{}-{}.tmp", process, attempt);
        spit(path, "x");
        return path;
    };
    const std::string left = temporary(ended, 0), locked = temporary(ended, 1),
                      own = temporary(::getpid(), 0);
    const std::string notes = directory / "image.exr.notes.tmp", other = directory / "image.exr2.1-0.tmp",
                      longer = left + ".txt";
    for (const std::string& path : {notes, other, longer}) spit(path, "x");
    // As a process on another machine holds it, which this one cannot see.
    const int descriptor = ::open(locked.c_str(), O_RDWR | O_CLOEXEC);
    REQUIRE(::flock(descriptor, LOCK_EX | LOCK_NB) == 0);
    checkWritable(directory / "image.exr");
    ::close(descriptor);
    CHECK_FALSE(fs::exists(left));
    for (const std::string& path : {locked, own, notes, other, longer}) CHECK(fs::exists(path));
}

TEST_CASE("unwritable outputs are found before anything is rendered", "[image_io]") {
    const TemporaryFolder directory;
    CHECK_NOTHROW(checkWritable(directory / "image.exr"));
    CHECK(directory.fileCount() == 0);
    // No folder is made: it may be a typing error.
    fs::create_directory(directory / "out");
    CHECK_NOTHROW(checkWritable(directory / "out/image.exr"));
    CHECK_THROWS_WITH(
        checkWritable(directory / "oit/image.exr"),
        Contains("no folder '" + (directory / "oit") + "'") && Contains("did you mean 'out'?"));
    CHECK_THROWS_WITH(checkWritable(directory / "one/two/image.exr"),
                      Contains("no folder '" + (directory / "one") + "'") &&
                          Contains("mkdir -p '" + (directory / "one/two") + "'"));
    CHECK_FALSE(fs::exists(directory / "oit"));
    CHECK_FALSE(fs::exists(directory / "one"));
    CHECK(fs::is_empty(directory / "out"));
    CHECK_THROWS_WITH(checkWritable(directory / "out"), Contains("is a directory"));
    CHECK_THROWS_WITH(checkWritable("/dev/null"), Contains("not a regular file"));
    CHECK_THROWS_AS(checkWritable(""), Error);
    spit(directory / "file", "x");
    CHECK_THROWS_WITH(checkWritable(directory / "file/image.exr"), Contains("is not a directory"));
    // An output that is there already keeps its content until the new one is whole.
    CHECK_NOTHROW(checkWritable(directory / "file"));
    CHECK(slurp(directory / "file") == "x");

    if (::geteuid() != 0) {  // Permissions do not bind root.
        fs::permissions(directory.path(), fs::perms::owner_read | fs::perms::owner_exec);
        CHECK_THROWS_WITH(checkWritable(directory / "image.exr"), Contains("Permission denied"));
    }
    // No user, root included, may create files here.
    for (const char* path : {"/proc/crt-image.exr", "/proc/crt-image.pfm"}) {
        try {
            writeImage(path, *formatOfFile(path), rgbImage(1, 1, {1, 1, 1}));
            FAIL_CHECK("written");
        } catch (const Error& error) {
            CHECK(error.kind() == ErrorKind::Output);
            CHECK_THAT(error.what(), Contains(path));
        }
    }
}

TEST_CASE("files get the permissions that the umask says", "[image_io]") {
    const TemporaryFolder directory;
    const mode_t before = ::umask(027);
    writeImage(directory / "image.pfm", OutputFormat::Pfm, rgbImage(1, 1, {1, 1, 1}));
    ::umask(before);
    struct stat status {};
    REQUIRE(::stat((directory / "image.pfm").c_str(), &status) == 0);
    CHECK((status.st_mode & 0777) == 0640);
}

TEST_CASE("PFM and PPM load no image library, and none but reading EXR loads OpenImageIO", "[image_io]") {
    CHECK(runAlone(thisProgram(), "[image-io-alone]"));
}

TEST_CASE("(in a process of its own) each format loads its libraries alone", "[.][image-io-alone]") {
    const TemporaryFolder directory;
    REQUIRE_FALSE(maps("libpng"));
    REQUIRE_FALSE(maps("libOpenImageIO"));
    writeImage(directory / "image.pfm", OutputFormat::Pfm, rgbImage(1, 1, {1, 1, 1}));
    writeImage(directory / "image.ppm", OutputFormat::Ppm, rgbImage(1, 1, {1, 1, 1}));
    readImage(directory / "image.pfm");
    readImage(directory / "image.ppm");
    CHECK_FALSE(maps("libpng"));
    writeImage(directory / "image.png", OutputFormat::Png, rgbImage(1, 1, {1, 1, 1}));
    readImage(directory / "image.png");
    CHECK(maps("libpng"));
    CHECK_FALSE(maps("libOpenImageIO"));
    CHECK_FALSE(maps("libOpenEXR"));
    writeImage(directory / "image.exr", OutputFormat::Exr, rgbImage(1, 1, {1, 1, 1}));
    CHECK(maps("libOpenEXR"));
    CHECK_FALSE(maps("libOpenImageIO"));
    readImage(directory / "image.exr");
    CHECK(maps("libOpenImageIO"));  // Or the checks above would prove nothing.
}

TEST_CASE("without the image modules EXR and PNG are refused and the rest works", "[image_io]") {
    // The modules are looked for beside the program, so a program elsewhere does not find them. A link,
    // because the program is large.
    const TemporaryFolder directory(fs::path(thisProgram()).parent_path());
    fs::create_directories(directory / "bin");
    const std::string program = directory / "bin/tests";
    fs::create_hard_link(thisProgram(), program);
    CHECK(runAlone(program, "[image-io-no-module]", "CRT_BACKEND_PATH="));
}

TEST_CASE("(in a process of its own) without the image modules", "[.][image-io-no-module]") {
    const TemporaryFolder directory;
    const struct {
        OutputFormat format;
        const char *module, *others;
    } cases[] = {{OutputFormat::Exr, "crt_image_exr.so", ".png, .jpg, .pfm and .ppm work without it"},
                 {OutputFormat::Jpeg, "crt_image_plain.so", ".exr, .pfm and .ppm work without it"},
                 {OutputFormat::Png, "crt_image_plain.so", ".exr, .pfm and .ppm work without it"}};
    for (const auto& [format, module, others] : cases) {
        try {
            writeImage(directory / "image", format, rgbImage(1, 1, {1, 1, 1}));
            FAIL_CHECK("written");
        } catch (const Error& error) {
            CHECK(error.kind() == ErrorKind::Output);
            CHECK_THAT(error.what(), Contains(module) && Contains(others));
        }
    }
    CHECK(directory.fileCount() == 0);
    CHECK_NOTHROW(writeImage(directory / "image.pfm", OutputFormat::Pfm, rgbImage(1, 1, {1, 1, 1})));
    spit(directory / "text", "not an image");
    CHECK_THROWS_WITH(readImage(directory / "text"),
                      Contains("cannot read") && Contains("crt_image_plain.so"));
    spit(directory / "mark", "\x76\x2f\x31\x01");
    CHECK_THROWS_WITH(readImage(directory / "mark"),
                      Contains("cannot read") && Contains("crt_image_oiio.so"));
}
