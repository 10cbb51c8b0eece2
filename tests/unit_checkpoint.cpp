// Checkpoint files: bit for bit there and back, and every kind of damage its own sentence.
//
// Over 450 lines: one kind of file, and every kind of damage to it.
#include "base/log.h"
#include "catch.h"
#include "film/checkpoint.h"
#include "film/checkpoint_writer.h"
#include "film/film_pack.h"
#include "base/temporary_folder.h"
#include "scene/yaml/scene_schema.h"
#include "file_bytes.h"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <random>
#include <span>
#include <unistd.h>
#include <zstd.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

using namespace crt;
using crt::TemporaryFolder;
namespace fs = std::filesystem;

namespace {

const FilmIdentity kIdentity{"0123456789abcdef0123456789abcdef", "0.1.0"};

Film randomFilm(FilmShape shape, SampleRange range, std::uint32_t seed) {
    Film film(shape);
    std::mt19937_64 generator(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (std::size_t i = 0; i < film.sums.size(); i += 2) {
        film.sums[i] = uniform(generator);
        film.sums[i + 1] = uniform(generator) * 1e-18;
    }
    for (auto& n : film.counts) n = range.second - range.first;
    for (auto& id : film.primitives) id = static_cast<std::uint32_t>(generator());
    film.samples.add(range);
    return film;
}

bool sameBits(const std::vector<double>& a, const std::vector<double>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

// 3 × 5 pixels: an odd number of ids, so that the padding is there.
constexpr FilmShape kShape{3, 5, 8, kAovSquares | kAovNormal | kAovDepth | kAovPrimitive};

}  // namespace

TEST_CASE("a checkpoint comes back bit for bit", "[checkpoint]") {
    const TemporaryFolder directory;
    Film film = randomFilm(kShape, {100, 164}, 1);
    film.samples.add({1024, 2048});
    film.sums[0] = -0.0;
    film.sums[1] = 4.9e-324;
    const std::string path = directory / "part.crtfilm";
    writeCheckpoint(path, film, kIdentity);
    const auto [back, identity] = readCheckpoint(path);
    CHECK(back.shape() == film.shape());
    CHECK(sameBits(back.sums, film.sums));
    CHECK(back.counts == film.counts);
    CHECK(back.primitives == film.primitives);
    CHECK(back.samples.text() == "100-164;1024-2048");
    CHECK(identity.scene_hash == kIdentity.scene_hash);
    CHECK(identity.version == kIdentity.version);
    CHECK(directory.fileCount() == 1);  // No temporary is left.

    // The same film is the same file: nothing in it depends on when or where it was written.
    const std::string first = slurp(path);
    writeCheckpoint(path, back, identity);
    CHECK(slurp(path) == first);
}

TEST_CASE("films without samples or ids are checkpoints too", "[checkpoint]") {
    const TemporaryFolder directory;
    const std::string path = directory / "part.crtfilm";
    const FilmShape shape{4, 4, 4, kAovSquares};
    writeCheckpoint(path, Film(shape), {kIdentity.scene_hash, ""});
    const auto [back, identity] = readCheckpoint(path);
    CHECK(back.shape() == shape);
    CHECK(back.samples.count() == 0);
    CHECK(identity.version.empty());
}

// Found by fuzzing: with no pixels a row any number of rows fits the file's size, and whatever walked them
// ran for a minute.
TEST_CASE("a checkpoint of a film with an impossible side is refused", "[checkpoint]") {
    const TemporaryFolder directory;
    const std::string path = directory / "part.crtfilm";
    for (const FilmShape shape :
         {FilmShape{0, 0x81000000u, 4, kAovSquares}, FilmShape{0x81000000u, 0, 4, kAovSquares},
          FilmShape{0, 0, 4, kAovSquares}, FilmShape{65536, 1, 4, kAovSquares}}) {
        writeCheckpoint(path, Film(shape), kIdentity);
        CHECK_THROWS_WITH(readCheckpoint(path), Contains(path) && Contains("1 to 65535 per side"));
    }
}

TEST_CASE("the largest film of a scene file is the largest of a checkpoint", "[checkpoint]") {
    const TemporaryFolder directory;
    const std::string path = directory / "part.crtfilm";
    const auto most = static_cast<std::uint32_t>(schemaSection("film").find("resolution")->range.max);
    writeCheckpoint(path, Film({most, 1, 4, kAovSquares}), kIdentity);
    CHECK(readCheckpoint(path).first.shape().width == most);
    writeCheckpoint(path, Film({most + 1, 1, 4, kAovSquares}), kIdentity);
    CHECK_THROWS_WITH(readCheckpoint(path), Contains("per side"));
}

TEST_CASE("the format is what checkpoint.h says", "[checkpoint]") {
    const TemporaryFolder directory;
    const std::string path = directory / "part.crtfilm";
    Film film({1, 1, 4, kAovSquares});
    film.sums[0] = 1.5;
    film.counts[0] = 2;
    film.samples.add({3, 5});
    writeCheckpoint(path, film, kIdentity);
    const std::string bytes = slurp(path);
    const auto u32 = [&](std::size_t at) { std::uint32_t v; std::memcpy(&v, &bytes[at], 4); return v; };
    const auto u64 = [&](std::size_t at) { std::uint64_t v; std::memcpy(&v, &bytes[at], 8); return v; };
    // Of one pixel every plane is one byte, behind its length.
    REQUIRE(bytes.size() == 96 + 16 + 8 + (4 * 16 + 8) * 5);
    CHECK(bytes.substr(0, 8) == "\x89" "CRTF\r\n\x1a");
    CHECK(u32(8) == kCheckpointVersion);
    CHECK(u32(12) == 96 + 16 + 8);
    CHECK(u64(16) == bytes.size());
    CHECK(u32(32) == 1);
    CHECK(u32(40) == 4);
    CHECK(bytes.substr(48, 32) == kIdentity.scene_hash);
    CHECK(u32(88) == CRT_BITS_VERSION);
    CHECK(u64(96) == 3);
    CHECK(u64(104) == 5);
    CHECK(bytes.substr(112, 8) == std::string("0.1.0\0\0\0", 8));
    const auto plane = [&](std::size_t number) {
        CHECK(u32(120 + number * 5) == 1);
        return static_cast<unsigned char>(bytes[124 + number * 5]);
    };
    CHECK(plane(7) == 0x3f);  // 1.5 is 0x3ff8000000000000.
    CHECK(plane(6) == 0xf8);
    CHECK(plane(5) == 0);
    CHECK(plane(64) == 2);
}

TEST_CASE("films of format 2, which were not packed, are read", "[checkpoint]") {
    const TemporaryFolder directory;
    const std::string path = directory / "part.crtfilm";
    Film film = randomFilm(kShape, {3, 67}, 10);
    writeCheckpoint(path, film, kIdentity);
    std::string bytes = slurp(path).substr(0, 96 + 16 + 8);
    const auto append = [&](const auto& values) {
        bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(values[0]));
    };
    append(film.sums);
    append(film.counts);
    append(film.primitives);
    bytes.resize((bytes.size() + 7) / 8 * 8);
    const std::uint32_t version = 2;
    const std::uint64_t size = bytes.size();
    std::memcpy(&bytes[8], &version, 4);
    std::memcpy(&bytes[16], &size, 8);
    const std::string hashed = bytes.substr(0, 24) + bytes.substr(32);
    const std::uint64_t checksum = XXH3_64bits(hashed.data(), hashed.size());
    std::memcpy(&bytes[24], &checksum, 8);
    spit(path, bytes);
    const auto [back, identity] = readCheckpoint(path);
    CHECK(sameBits(back.sums, film.sums));
    CHECK(back.counts == film.counts);
    CHECK(back.primitives == film.primitives);
    CHECK(back.samples.text() == "3-67");
    bytes[200] = static_cast<char>(~bytes[200]);
    spit(path, bytes);
    CHECK_THROWS_WITH(readCheckpoint(path), Contains("checksum"));
}

namespace {

/// Reads what film_pack.h describes, plane by plane.
class PlaneReader {
public:
    explicit PlaneReader(std::span<const unsigned char> packed) : rest_(packed) {}

    /// True if the rest consists of these records, of this size each.
    template <class Value>
    bool holds(const std::vector<Value>& values, std::size_t records) {
        const auto* bytes = reinterpret_cast<const unsigned char*>(values.data());
        const std::size_t width = values.size() * sizeof(Value) / records;
        for (std::size_t first = 0; first < records; first += kPackedPixels) {
            const std::size_t count = std::min(kPackedPixels, records - first);
            for (std::size_t byte = 0; byte < width; ++byte) {
                const std::vector<unsigned char> plane = next(count);
                for (std::size_t i = 0; i < count; ++i)
                    if (plane[i] != bytes[(first + i) * width + byte]) return false;
            }
        }
        return true;
    }
    bool atEnd() const { return rest_.empty(); }

private:
    std::vector<unsigned char> next(std::size_t records) {
        std::uint32_t size = 0;
        REQUIRE(rest_.size() > sizeof size);
        std::memcpy(&size, rest_.data(), sizeof size);
        REQUIRE(rest_.size() >= sizeof size + size);
        const std::span<const unsigned char> packed = rest_.subspan(sizeof size, size);
        rest_ = rest_.subspan(sizeof size + size);
        if (size == 1) return std::vector<unsigned char>(records, packed.front());
        if (size == records) return {packed.begin(), packed.end()};
        std::vector<unsigned char> plane(records);
        REQUIRE(ZSTD_decompress(plane.data(), plane.size(), packed.data(), size) == records);
        return plane;
    }

    std::span<const unsigned char> rest_;
};

}  // namespace

TEST_CASE("films are packed without loss, in blocks, into less", "[checkpoint]") {
    // Two whole blocks and a short one, of everything that there is: noise, what is the same everywhere,
    // what hardly differs. Sums of 80 bytes a pixel: not all planes are made at once, and the last ones are
    // fewer.
    Film film({kPackedPixels / 64, 130, 5, kAovSquares | kAovDepth | kAovPrimitive});
    std::mt19937_64 generator(1);
    for (std::size_t i = 0; i < film.sums.size(); ++i) {
        const std::uint64_t noise = generator();
        if (i % 10 == 0)
            std::memcpy(&film.sums[i], &noise, sizeof noise);  // every bit pattern, NaN among them
        if (i % 10 == 8) film.sums[i] = 1 + static_cast<double>(noise % 1024) / 1024;
        if (i % 10 == 4) film.sums[i] = -0.0;
    }
    for (std::size_t i = 0; i < film.counts.size(); ++i) {
        film.counts[i] = 64 - (i % 977 == 0);
        film.primitives[i] = static_cast<std::uint32_t>(i / 50);
    }
    const std::vector<unsigned char> packed = packFilm(film);
    const std::size_t raw = film.sums.size() * 8 + film.counts.size() * 8 + film.primitives.size() * 4;
    CHECK(packed.size() < raw / 5);  // 8 of 92 bytes are noise, and 10 bits of another 8.
    CHECK(leastPackedBytes(film.shape()) < packed.size());
    // Packing and unpacking could agree on an order other than that of earlier films.
    PlaneReader planes(packed);
    CHECK(planes.holds(film.sums, film.counts.size()));
    CHECK(planes.holds(film.counts, film.counts.size()));
    CHECK(planes.holds(film.primitives, film.counts.size()));
    CHECK(planes.atEnd());
    Film back(film.shape());
    REQUIRE(unpackFilm(packed, back));
    CHECK(sameBits(back.sums, film.sums));
    CHECK(back.counts == film.counts);
    CHECK(back.primitives == film.primitives);

    // A file that is not a film of this shape is refused, wherever it ends and whatever it holds.
    for (std::size_t size = 0; size < packed.size(); size += 1 + packed.size() / 200)
        CHECK_FALSE(unpackFilm(std::span(packed).first(size), back));
    std::vector<unsigned char> longer = packed;
    longer.push_back(0);
    CHECK_FALSE(unpackFilm(longer, back));
    for (int i = 0; i < 200; ++i) {
        std::vector<unsigned char> damaged = packed;
        damaged[generator() % damaged.size()] ^= static_cast<unsigned char>(1 + generator() % 255);
        unpackFilm(damaged, back);  // to no harm
    }
    // A header that promises more than the file can hold is found out before anything is allocated.
    CHECK(leastPackedBytes({65535, 65535, 100, 0}) > 1000000000);
}

TEST_CASE("a checkpoint is written beside the render, and its failures are told", "[checkpoint]") {
    const TemporaryFolder directory;
    const std::string path = directory / "part.crtfilm";
    {
        CheckpointWriter writer(path);
        CHECK(writer.idle());
        Film film = randomFilm(kShape, {0, 8}, 11);
        const Film first = film;
        writer.save(film, kIdentity);
        film.sums.assign(film.sums.size(), 0.0);  // Later changes of the film are not visible.
        writer.finish();
        CHECK(writer.idle());
        CHECK(sameBits(readCheckpoint(path).first.sums, first.sums));
        writer.save(randomFilm(kShape, {0, 16}, 12), kIdentity);
    }  // The last one is waited for.
    CHECK(readCheckpoint(path).first.samples.count() == 16);

    setLogLevel(LogLevel::Off);
    const int warnings = warningCount();
    CheckpointWriter nowhere(directory / "no/such/part.crtfilm");
    nowhere.save(randomFilm(kShape, {0, 8}, 13), kIdentity);
    nowhere.finish();
    CHECK(warningCount() == warnings + 1);
    nowhere.save(randomFilm(kShape, {0, 8}, 13), kIdentity);
    nowhere.save(randomFilm(kShape, {0, 8}, 13), kIdentity);
    CHECK(warningCount() == warnings + 2);
    nowhere.finish();
    CHECK(warningCount() == warnings + 3);
    setLogLevel(LogLevel::Info);
}

/// Written by the last crt whose films had no record: one pixel, two samples, 3 and 4.
TEST_CASE("films of format 2 are read still", "[checkpoint]") {
    const TemporaryFolder directory;
    const std::string path = directory / "old.crtfilm";
    const unsigned char kOld[] = {
        0x89, 0x43, 0x52, 0x54, 0x46, 0x0d, 0x0a, 0x1a, 0x02, 0x00, 0x00, 0x00, 0x78, 0x00, 0x00, 0x00,
        0xc0, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0xa0, 0x7c, 0x53, 0xa2, 0xd2, 0xfe, 0x44, 0xe4,
        0x01, 0x00, 0x00, 0x00, 0x01, 0x00, 0x00, 0x00, 0x04, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
        0x30, 0x31, 0x32, 0x33, 0x34, 0x35, 0x36, 0x37, 0x38, 0x39, 0x61, 0x62, 0x63, 0x64, 0x65, 0x66,
        0x30, 0x31, 0x32, 0x33, 0x34, 0x35, 0x36, 0x37, 0x38, 0x39, 0x61, 0x62, 0x63, 0x64, 0x65, 0x66,
        0x05, 0x00, 0x00, 0x00, 0x01, 0x00, 0x00, 0x00, 0x02, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
        0x03, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x05, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
        0x30, 0x2e, 0x31, 0x2e, 0x30, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0xf8, 0x3f,
        0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
        0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
        0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
        0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x02, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
    };
    spit(path, {reinterpret_cast<const char*>(kOld), sizeof kOld});
    const auto [film, identity] = readCheckpoint(path);
    CHECK(film.samples.text() == "3-5");
    CHECK(film.sums[0] == 1.5);
    CHECK(film.counts[0] == 2);
    CHECK(identity.scene_hash == kIdentity.scene_hash);
    CHECK_FALSE(identity.record);
}

TEST_CASE("a truncated checkpoint is refused wherever it ends", "[checkpoint]") {
    const TemporaryFolder directory;
    const std::string path = directory / "part.crtfilm";
    writeCheckpoint(path, randomFilm(kShape, {0, 64}, 2), kIdentity);
    const std::string whole = slurp(path);
    const std::string cut = directory / "cut.crtfilm";
    spit(cut, whole);
    for (std::size_t size = whole.size() - 1; size > 0; --size) {
        fs::resize_file(cut, size);
        INFO(size << " of " << whole.size());
        CHECK_THROWS_WITH(readCheckpoint(cut), Contains("cut.crtfilm") && Contains("truncated"));
    }
    spit(cut, "");
    CHECK_THROWS_WITH(readCheckpoint(cut), Contains("empty"));
    spit(cut, whole + '\0');
    CHECK_THROWS_WITH(readCheckpoint(cut), Contains("damaged"));
}

TEST_CASE("a checkpoint with any byte changed is refused", "[checkpoint]") {
    const TemporaryFolder directory;
    const std::string path = directory / "part.crtfilm";
    writeCheckpoint(path, randomFilm(kShape, {0, 64}, 3), kIdentity);
    const std::string whole = slurp(path);
    const std::string bad = directory / "bad.crtfilm";
    spit(bad, whole);
    std::fstream patch(bad, std::ios::binary | std::ios::in | std::ios::out);
    const auto set = [&patch](std::size_t at, char value) {
        patch.seekp(static_cast<std::streamoff>(at));
        patch.put(value).flush();
    };
    for (std::size_t i = 0; i < whole.size(); ++i) {
        set(i, static_cast<char>(whole[i] ^ (1 << (i % 8))));
        INFO("byte " << i);
        try {
            readCheckpoint(bad);
            FAIL_CHECK("accepted");
        } catch (const Error& error) {
            CHECK(error.kind() == ErrorKind::Usage);
            CHECK(error.place().file == bad);
        }
        set(i, whole[i]);
    }
    CHECK_NOTHROW(readCheckpoint(bad));
}

TEST_CASE("what is wrong with a checkpoint is said", "[checkpoint]") {
    const TemporaryFolder directory;
    const std::string path = directory / "part.crtfilm";
    writeCheckpoint(path, randomFilm(kShape, {0, 64}, 4), kIdentity);
    const std::string whole = slurp(path);
    const auto with = [&](std::size_t at, char value) {
        std::string bytes = whole;
        bytes[at] = value;
        spit(path, bytes);
        return path;
    };
    CHECK_THROWS_WITH(
        readCheckpoint(with(8, 9)),
        Contains("format 9") && Contains("reads formats 2 to " + std::to_string(kCheckpointVersionSplats)));
    CHECK_THROWS_WITH(readCheckpoint(with(0, 'x')), Contains("not a crt film"));
    CHECK_THROWS_WITH(readCheckpoint(with(35, 0x7f)),
                      Contains("damaged: its header"));  // Two thousand million pixels wide.
    CHECK_THROWS_WITH(readCheckpoint(with(whole.size() / 2, static_cast<char>(~whole[whole.size() / 2]))),
                      Contains("checksum"));
    CHECK_THROWS_WITH(readCheckpoint(directory / "absent.crtfilm"),
                      Contains("absent.crtfilm") && Contains("No such file"));
    CHECK_THROWS_AS(readCheckpoint(directory.path()), Error);
}

TEST_CASE("the record of a merged film is that of the first samples, with every run in it", "[checkpoint]") {
    const TemporaryFolder directory;
    const auto write = [&](const char* name, SampleRange range, double exposure_ev, const char* backend,
                           const char* date) {
        FilmIdentity identity = kIdentity;
        identity.record.emplace();
        identity.record->width = identity.record->height = 1;
        identity.record->window = {0, 0, 1, 1};
        identity.record->development.exposure_ev = exposure_ev;
        identity.record->backend = backend;
        identity.record->date_utc = date;
        identity.record->complete = true;
        writeCheckpoint(directory / name, randomFilm({1, 1, 4, kAovSquares}, range, 1), identity);
        return directory / name;
    };
    const std::string a = write("a.crtfilm", {8, 16}, 1, "embree", "2026:01:01 00:00:00"),
                      b = write("b.crtfilm", {0, 8}, 2, "cuda", "2025:01:01 00:00:00"),
                      c = write("c.crtfilm", {16, 20}, 3, "embree", "2024:01:01 00:00:00");
    writeCheckpoint(directory / "old.crtfilm", randomFilm({1, 1, 4, kAovSquares}, {100, 101}, 1), kIdentity);
    std::string text;
    for (const std::vector<std::string>& order : {std::vector{a, b, c},
                                                  {c, b, a},
                                                  {b, directory / "old.crtfilm", c, a},
                                                  {directory / "old.crtfilm", c, a, b}}) {
        const std::optional<FilmRecord> record = mergeCheckpoints(order).second.record;
        REQUIRE(record);
        CHECK(record->development.exposure_ev == 2);
        CHECK(record->backend == "cuda and embree");
        CHECK(record->date_utc == "2026:01:01 00:00:00");
        CHECK_FALSE(record->complete);
        CHECK((text.empty() || recordText(*record) == text));
        text = recordText(*record);
    }
    // A record of a film of another size is none of this film.
    FilmIdentity wrong = kIdentity;
    wrong.record.emplace();
    wrong.record->width = wrong.record->height = 2;
    wrong.record->window = {0, 0, 2, 1};
    writeCheckpoint(directory / "wrong.crtfilm", Film({1, 1, 4, kAovSquares}), wrong);
    CHECK_THROWS_WITH(readCheckpoint(directory / "wrong.crtfilm"),
                      Contains("scene record that belongs to a film of another size"));
}

TEST_CASE("a checkpoint of another scene is refused with both hashes", "[checkpoint]") {
    const FilmIdentity other{"ffffffffffffffffffffffffffffffff", "0.1.0"};
    CHECK_NOTHROW(requireSameScene("a.crtfilm", kIdentity, kIdentity));
    CHECK_THROWS_WITH(requireSameScene("a.crtfilm", kIdentity, other),
                      Contains("a.crtfilm") && Contains(kIdentity.scene_hash) && Contains(other.scene_hash));
    setLogLevel(LogLevel::Off);
    const int warnings = warningCount();
    requireSameScene("a.crtfilm", {kIdentity.scene_hash, "0.0.9"}, kIdentity);
    CHECK(warningCount() == warnings + 1);
    setLogLevel(LogLevel::Info);
    const TemporaryFolder directory;
    CHECK_THROWS_AS(
        writeCheckpoint(directory / "x.crtfilm", Film({1, 1, 4, kAovSquares}), {"no hash", "0.1.0"}), Error);
}

TEST_CASE("films of other bits are neither gone on with nor merged", "[checkpoint]") {
    const TemporaryFolder directory;
    // Even if the hash were the same, which covers the version.
    FilmIdentity older = kIdentity;
    older.bits_version = CRT_BITS_VERSION - 1;
    const std::string now = directory / "now.crtfilm", then = directory / "then.crtfilm",
                      later = directory / "later.crtfilm";
    writeCheckpoint(now, randomFilm(kShape, {0, 4}, 1), kIdentity);
    writeCheckpoint(then, randomFilm(kShape, {4, 8}, 2), older);
    writeCheckpoint(later, randomFilm(kShape, {8, 12}, 3), older);
    CHECK(readCheckpoint(now).second.bits_version == CRT_BITS_VERSION);
    CHECK(readCheckpoint(then).second.bits_version == CRT_BITS_VERSION - 1);

    const std::string version = std::to_string(CRT_BITS_VERSION),
                      before = std::to_string(CRT_BITS_VERSION - 1);
    CHECK_THROWS_WITH(requireSameScene(then, older, kIdentity),
                      Contains("samples of bits version " + before +
                               ", rendered by crt 0.1.0, and version " + version + " is expected"));
    CHECK_THROWS_WITH(mergeCheckpoints({now, then}),
                      Contains("bits versions " + version + " and " + before));
    // Sums of one version add up, whatever adds them; they stay what they are.
    CHECK(mergeCheckpoints({then, later}).second.bits_version == CRT_BITS_VERSION - 1);
}

TEST_CASE("a checkpoint that cannot be written is an output error and leaves the old one", "[checkpoint]") {
    const TemporaryFolder directory;
    const Film film = randomFilm(kShape, {0, 8}, 5);
    try {
        writeCheckpoint(directory / "no/such/part.crtfilm", film, kIdentity);
        FAIL("written");
    } catch (const Error& error) {
        CHECK(error.kind() == ErrorKind::Output);
        CHECK_THAT(error.what(), Contains("does not exist"));
    }
    CHECK_THROWS_WITH(writeCheckpoint(directory.path(), film, kIdentity), Contains("is a directory"));
    CHECK_THROWS_WITH(writeCheckpoint("/dev/full", film, kIdentity), Contains("not a regular file"));

    // Through a symbolic link the target is replaced and the link stays.
    writeCheckpoint(directory / "real.crtfilm", film, kIdentity);
    fs::create_symlink("real.crtfilm", directory / "link.crtfilm");
    writeCheckpoint(directory / "link.crtfilm", randomFilm(kShape, {0, 16}, 6), kIdentity);
    CHECK(fs::is_symlink(directory / "link.crtfilm"));
    CHECK(readCheckpoint(directory / "real.crtfilm").first.samples.count() == 16);
}

TEST_CASE("a film of samples of several versions names them all", "[checkpoint]") {
    const TemporaryFolder directory;
    std::vector<std::string> paths;
    std::uint64_t first = 0;
    for (const char* version : {"1.1.0", "0.9.0", "1.1.0"}) {
        paths.push_back(directory / ("part" + std::to_string(first) + ".crtfilm"));
        writeCheckpoint(paths.back(), randomFilm(kShape, {first, first + 8}, 1),
                        {kIdentity.scene_hash, version});
        first += 8;
    }
    do {
        CHECK(mergeCheckpoints(paths).second.version == "0.9.0 and 1.1.0");
    } while (std::next_permutation(paths.begin(), paths.end()));
    // A merge of merges says no more than there is.
    CHECK(joinVersions("0.9.0 and 1.1.0", "1.1.0 and 1.2.0") == "0.9.0 and 1.1.0 and 1.2.0");
    CHECK(joinVersions("", "1.0.0") == "1.0.0");
    std::string many;
    for (int i = 0; i < 100; ++i) many = joinVersions(many, "1." + std::to_string(i) + ".0");
    writeCheckpoint(paths[0], randomFilm(kShape, {0, 8}, 1), {kIdentity.scene_hash, many});
    CHECK(readCheckpoint(paths[0]).second.version == many);
    CHECK_THAT(many, Contains(" and more"));
}

TEST_CASE("merging partial films gives one film whatever the order", "[checkpoint]") {
    const TemporaryFolder directory;
    const std::string a = directory / "a.crtfilm", b = directory / "b.crtfilm", c = directory / "c.crtfilm";
    writeCheckpoint(a, randomFilm(kShape, {0, 64}, 7), kIdentity);
    writeCheckpoint(b, randomFilm(kShape, {64, 128}, 8), kIdentity);
    writeCheckpoint(c, randomFilm(kShape, {256, 300}, 9), kIdentity);
    const Film abc = mergeCheckpoints({a, b, c}).first;
    const Film cba = mergeCheckpoints({c, b, a}).first;
    CHECK(abc.samples.text() == "0-128;256-300");
    CHECK(abc.counts == cba.counts);
    CHECK(abc.primitives == cba.primitives);
    for (std::uint32_t channel = 0; channel < kShape.channels; ++channel)
        CHECK(abc.sum(2, 4, channel) == cba.sum(2, 4, channel));

    CHECK_THROWS_WITH(mergeCheckpoints({a, b, a}), Contains("a.crtfilm") && Contains("0-64"));
    CHECK_THROWS_WITH(mergeCheckpoints({}), Contains("nothing to merge"));
    writeCheckpoint(c, randomFilm(kShape, {256, 300}, 9), {"ffffffffffffffffffffffffffffffff", "0.1.0"});
    CHECK_THROWS_WITH(mergeCheckpoints({a, c}), Contains("a.crtfilm") && Contains("c.crtfilm") &&
                                                    Contains("ffffffffffffffffffffffffffffffff"));
}
