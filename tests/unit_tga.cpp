// TGA files made by hand: each kind, order of rows and depth gives the pixels that it holds; what is damaged
// is refused with a sentence.
#include "base/error.h"
#include "base/temporary_folder.h"
#include "catch.h"
#include "file_bytes.h"
#include "image/texels.h"

#include <functional>

using namespace crt;

namespace {

/// Three pixels wide, two high: row 0 red, green, blue; row 1 black, grey, white.
const std::vector<std::uint8_t> kCodes{255, 0, 0, 0,   255, 0,   0,   0,   255,
                                       0,   0, 0, 128, 128, 128, 255, 255, 255};
constexpr unsigned kFromTheTop = 32, kFromTheRight = 16;

std::string pair(unsigned value) { return {static_cast<char>(value & 255), static_cast<char>(value >> 8)}; }

/// Three by two pixels; an identification of two bytes, as many files have.
std::string tga(unsigned kind, unsigned depth, unsigned descriptor, const std::string& data,
                const std::string& map = {}, unsigned map_first = 0, unsigned map_depth = 0) {
    const unsigned entries = map.empty() ? 0 : static_cast<unsigned>(map.size() / ((map_depth + 7) / 8));
    std::string header{2, map.empty() ? '\0' : '\1', static_cast<char>(kind)};
    header += pair(map_first) + pair(entries) + static_cast<char>(map_depth);
    header += pair(0) + pair(0) + pair(3) + pair(2);
    header += {static_cast<char>(depth), static_cast<char>(descriptor)};
    return header + "id" + map + data;
}

/// kCodes as a file has them: blue first.
std::string bgr(bool from_the_top, bool from_the_right, bool alpha) {
    std::string data;
    for (std::size_t row = 0; row < 2; ++row)
        for (std::size_t column = 0; column < 3; ++column) {
            const std::size_t y = from_the_top ? row : 1 - row, x = from_the_right ? 2 - column : column;
            for (std::size_t k = 3; k-- > 0;) data += static_cast<char>(kCodes[(3 * y + x) * 3 + k]);
            if (alpha) data += static_cast<char>(10 * (3 * y + x));
        }
    return data;
}

/// As TGA 2.0 ends: what its alpha means, in an extension area.
std::string withMeaning(std::string file, char meaning) {
    const std::size_t at = file.size();
    file.append(494, '\0');
    file += meaning;
    for (int k = 0; k < 4; ++k) file += static_cast<char>(at >> (8 * k) & 255);
    return file + std::string(4, '\0') + "TRUEVISION-XFILE." + '\0';
}

struct Read {
    TemporaryFolder folder;
    std::string path;
    explicit Read(const std::string& bytes) : path(folder.path() + "/a.tga") { spit(path, bytes); }
    Texels color() const { return readTexels(path); }
    Texels alpha() const { return readAlpha(path); }
    std::string refusal() const {
        try {
            (void)readTexels(path);
        } catch (const Error& e) {
            CHECK(e.kind() == ErrorKind::Scene);
            return e.what();
        }
        return "nothing was refused";
    }
};

}  // namespace

TEST_CASE("texels of a TGA: rows and columns in each order", "[texels][tga]") {
    for (const unsigned order : {0u, kFromTheTop, kFromTheRight, kFromTheTop | kFromTheRight}) {
        INFO(order);
        const std::string data = bgr((order & kFromTheTop) != 0, (order & kFromTheRight) != 0, false);
        const Texels texels = Read(tga(2, 24, order, data)).color();
        CHECK(texels.info.width == 3);
        CHECK(texels.info.height == 2);
        CHECK(texels.info.channels == 3);
        CHECK(texels.info.type == TexelType::Uint8);
        CHECK(texels.bytes == kCodes);
        CHECK(Read(tga(2, 24, order, data)).alpha().info.channels == 0);
    }
}

TEST_CASE("texels of a TGA: runs, grey, 16 bits and colour maps", "[texels][tga]") {
    using namespace std::string_literals;
    const std::string top = bgr(true, false, false);
    // One packet of two different pixels, one of one, one of a run of three: it crosses no row here.
    const std::string runs =
        "\x01"s + top.substr(0, 6) + "\x00"s + top.substr(6, 3) + "\x82" + "\x07\x08\x09";
    const Texels texels = Read(tga(10, 24, kFromTheTop, runs)).color();
    REQUIRE(texels.bytes.size() == 18);
    CHECK(std::equal(kCodes.begin(), kCodes.begin() + 9, texels.bytes.begin()));
    for (std::size_t i = 9; i < 18; i += 3) CHECK(texels.bytes[i] == 9);  // Red is last in the file.
    // A run over the end of a row, as writers of TGA 1.0 make them.
    CHECK(Read(tga(11, 8, kFromTheTop, "\x84\x33\x00\x44"s)).color().bytes ==
          std::vector<std::uint8_t>{0x33, 0x33, 0x33, 0x33, 0x33, 0x44});

    const Texels grey = Read(tga(3, 8, 0, "\x01\x02\x03\x04\x05\x06")).color();
    CHECK(grey.info.channels == 1);
    CHECK(grey.bytes == std::vector<std::uint8_t>{4, 5, 6, 1, 2, 3});

    // Five bits each, red highest: 31 is 255, 16 is 132.
    const std::string fives =
        pair(31 << 10) + pair(31 << 5) + pair(31) + pair(0) + pair(16 << 10 | 16 << 5 | 16) + pair(0x7fff);
    CHECK(Read(tga(2, 16, kFromTheTop, fives)).color().bytes ==
          std::vector<std::uint8_t>{255, 0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0, 132, 132, 132, 255, 255, 255});

    // The first entry of the map has the number 5.
    const std::string map = "\x01\x02\x03\x11\x12\x13"s;
    CHECK(Read(tga(1, 8, kFromTheTop, "\x05\x06\x05\x06\x05\x06", map, 5, 24)).color().bytes ==
          std::vector<std::uint8_t>{3, 2, 1, 0x13, 0x12, 0x11, 3, 2, 1, 0x13, 0x12, 0x11, 3, 2, 1, 0x13,
                                    0x12, 0x11});
    CHECK_THAT(Read(tga(1, 8, kFromTheTop, "\x05\x06\x07\x05\x06\x05", map, 5, 24)).refusal(),
               Contains("a.tga") && Contains("is not in the colour map"));
    CHECK_THAT(Read(tga(1, 8, kFromTheTop, "\x05\x06\x04\x05\x06\x05", map, 5, 24)).refusal(),
               Contains("is not in the colour map"));
}

TEST_CASE("alpha of a TGA: where its header and its extension say that it is", "[texels][tga]") {
    const std::string data = bgr(true, false, true);
    const std::string file = tga(2, 32, kFromTheTop | 8, data);
    CHECK(Read(file).color().bytes == kCodes);
    CHECK(Read(file).alpha().bytes == std::vector<std::uint8_t>{0, 10, 20, 30, 40, 50});
    CHECK(Read(tga(2, 32, kFromTheTop, data)).alpha().info.channels == 0);
    CHECK(Read(tga(2, 32, kFromTheTop, data)).color().bytes == kCodes);
    CHECK(Read(withMeaning(file, 3)).alpha().info.channels == 1);
    CHECK(Read(withMeaning(file, 1)).alpha().info.channels == 0);
    CHECK_THAT(Read(withMeaning(file, 4)).refusal(), Contains("premultiplied by alpha"));
}

TEST_CASE("a TGA that is damaged says why", "[texels][tga]") {
    using namespace std::string_literals;
    const std::string data = bgr(true, false, false), file = tga(2, 24, kFromTheTop, data);
    CHECK_THAT(Read(file.substr(0, file.size() - 1)).refusal(), Contains("file of its size"));
    CHECK_THAT(Read(tga(10, 24, kFromTheTop, "\x82\x01\x02\x03\x80\x01\x02"s)).refusal(),
               Contains("ends before its pixels do"));
    CHECK_THAT(Read(tga(10, 24, kFromTheTop, "\x86\x01\x02\x03"s)).refusal(),
               Contains("more pixels than its header says"));
    CHECK_THAT(Read(tga(2, 24, 0x80, data)).refusal(), Contains("interleaved"));
    std::string large = file;
    large.replace(12, 4, "\xff\xff\xff\xff");
    CHECK_THAT(Read(large).refusal(), Contains("file of its size"));
    // Runs of 65535 x 65535 pixels: 129 bytes hold 128 at best.
    large[2] = 10;
    large.resize(std::size_t{140} << 20, '\xff');
    CHECK_THAT(Read(large).refusal(), Contains("65535 x 65535") && Contains("256 million"));
    // Kinds and depths that do not go together are no TGA.
    for (const auto& [kind, depth] : {std::pair{1u, 8u}, {2u, 8u}, {3u, 24u}, {4u, 24u}, {10u, 17u}})
        CHECK_THAT(Read(tga(kind, depth, 0, data)).refusal(), Contains("it is not a PNG, JPEG, TGA"));
}
