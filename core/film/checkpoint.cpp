#include "film/checkpoint.h"

#include "base/atomic_file.h"
#include "base/byte_hash.h"
#include "base/input_file.h"
#include "base/log.h"
#include "film/film_pack.h"

#include <fmt/format.h>

// In the header's inline form, so that nothing has to be linked or found at run time.
#include <sys/stat.h>
#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <new>
#include <set>
#include <string_view>

namespace crt {
namespace {

// Sections are written as they lie in memory; a big-endian port would swap here and nowhere else.
static_assert(std::endian::native == std::endian::little, "checkpoints are little-endian");

constexpr std::array<unsigned char, 8> kMagic{0x89, 'C', 'R', 'T', 'F', 0x0d, 0x0a, 0x1a};
constexpr std::size_t kHashDigits = 32;
constexpr std::size_t kVersionBytesMax = 255;
constexpr std::uint32_t kRecordBytesMax = 1u << 28;
constexpr std::uint32_t kRangesMax = 1u << 20;

/// The part of fixed size.
struct Header {
    std::array<unsigned char, 8> magic;
    std::uint32_t format_version;
    std::uint32_t header_bytes;
    std::uint64_t file_bytes;
    std::uint64_t checksum;
    std::uint32_t width, height, channels, aovs;
    std::array<char, kHashDigits> scene_hash;
    std::uint32_t version_bytes;
    std::uint32_t range_count;
    std::uint32_t bits_version;
    std::uint32_t record_bytes;
};
static_assert(sizeof(Header) == 96 && offsetof(Header, checksum) == 24 &&
              offsetof(Header, scene_hash) == 48);
constexpr std::size_t kBeforeChecksum = offsetof(Header, checksum);
constexpr std::size_t kAfterChecksum = kBeforeChecksum + sizeof(std::uint64_t);

std::uint64_t roundUp8(std::uint64_t bytes) { return (bytes + 7) & ~std::uint64_t{7}; }

/// The fixed header without the checksum itself.
void addHeader(ByteHash& checksum, const Header& header) {
    const auto* bytes = reinterpret_cast<const unsigned char*>(&header);
    checksum.add(bytes, kBeforeChecksum);
    checksum.add(bytes + kAfterChecksum, sizeof(Header) - kAfterChecksum);
}

/// Sample ranges, version, record and scale of splats: the part of the header whose size varies.
std::vector<unsigned char> packTail(const Film& film, const FilmIdentity& identity,
                                    const std::string& record) {
    const auto& ranges = film.samples.ranges();
    const std::size_t range_bytes = ranges.size() * 16;
    const std::size_t record_begin = range_bytes + roundUp8(identity.version.size());
    const std::size_t record_end = record_begin + roundUp8(record.size());
    const double scale = film.shape().splat_scale;
    std::vector<unsigned char> bytes(record_end + (scale != 0 ? sizeof scale : 0), 0);
    for (std::size_t i = 0; i < ranges.size(); ++i) {
        std::memcpy(&bytes[i * 16], &ranges[i].first, 8);
        std::memcpy(&bytes[i * 16 + 8], &ranges[i].second, 8);
    }
    if (!identity.version.empty())
        std::memcpy(&bytes[range_bytes], identity.version.data(), identity.version.size());
    if (!record.empty()) std::memcpy(&bytes[record_begin], record.data(), record.size());
    if (scale != 0) std::memcpy(&bytes[record_end], &scale, sizeof scale);
    return bytes;
}

[[noreturn]] void refuse(const std::string& path, const std::string& why) {
    throw Error(ErrorKind::Usage, fmt::format("'{}' {}", path, why), {path});
}

struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
};

std::unique_ptr<std::FILE, CloseFile> openFilm(const std::string& path) {
    try {
        std::FILE* const file = ::fdopen(openInput(path), "rb");
        if (file == nullptr) throw std::bad_alloc();
        return std::unique_ptr<std::FILE, CloseFile>(file);
    } catch (const InputRefused& refused) {
        refuse(path, refused.what());
    }
}

void readExactly(std::FILE* file, const std::string& path, void* bytes, std::size_t size) {
    if (size == 0 || std::fread(bytes, 1, size, file) == size) return;
    if (std::ferror(file)) refuse(path, fmt::format("cannot be read: {}", std::strerror(errno)));
    refuse(path, "became shorter while it was read");
}

bool isHexHash(const char* digits, std::size_t size) {
    return size == kHashDigits && std::all_of(digits, digits + size, [](char c) {
               return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
           });
}

using Wide = unsigned __int128;

/// Sample ranges, version and record.
std::uint64_t bytesToRecordEnd(const Header& h) {
    return h.range_count * std::uint64_t{16} + roundUp8(h.version_bytes) + roundUp8(h.record_bytes);
}

/// The same with the scale of splats.
std::uint64_t tailBytes(const Header& h) {
    return bytesToRecordEnd(h) + (h.format_version == kCheckpointVersionSplats ? sizeof(double) : 0);
}

/// Size of the part before the film.
Wide headBytes(const Header& h) { return Wide{tailBytes(h)} + sizeof(Header); }

/// True if the header can describe a file of its size.
bool sizesFit(const Header& h) {
    if (h.header_bytes != headBytes(h)) return false;
    if (h.format_version > kCheckpointVersionUnpacked)
        return h.file_bytes >= headBytes(h) + leastPackedBytes({h.width, h.height, h.channels, h.aovs});
    const Wide pixels = Wide{h.width} * h.height;
    const Wide ids = (h.aovs & kAovPrimitive) != 0 ? (pixels * 4 + 7) / 8 * 8 : 0;
    return h.record_bytes == 0 && h.file_bytes == headBytes(h) + pixels * h.channels * 16 + pixels * 8 + ids;
}

FilmRecord readRecordOf(const std::string& path, const std::vector<unsigned char>& tail, const Header& h) {
    const auto* text = reinterpret_cast<const char*>(tail.data()) + h.range_count * std::size_t{16} +
                       roundUp8(h.version_bytes);
    try {
        FilmRecord record = readRecord({text, h.record_bytes});
        const auto& [x0, y0, x1, y1] = record.window;
        if (static_cast<std::uint32_t>(x1 - x0) != h.width ||
            static_cast<std::uint32_t>(y1 - y0) != h.height)
            throw Error(ErrorKind::Usage, "belongs to a film of another size");
        return record;
    } catch (const Error& error) {
        refuse(path, fmt::format("holds a scene record that {}", error.what()));
    }
}

}  // namespace

void writeCheckpoint(const std::string& path, const Film& film, const FilmIdentity& identity) {
    if (!isHexHash(identity.scene_hash.data(), identity.scene_hash.size()))
        throw Error(ErrorKind::Internal,
                    fmt::format("'{}' is not a scene hash of 32 hex digits", identity.scene_hash));
    if (identity.version.size() > kVersionBytesMax || film.samples.ranges().size() > kRangesMax)
        throw Error(ErrorKind::Internal,
                    "the film has too many sample ranges, or crt too long a version, for a checkpoint");

    if (film.shape().spectral != (identity.record ? identity.record->spectral.count() : 0))
        throw Error(ErrorKind::Internal, "the film has other spectral channels than its record says");

    const std::string record = identity.record ? recordText(*identity.record) : std::string();
    if (record.size() > kRecordBytesMax)
        throw Error(ErrorKind::Internal, "the film has too long a record for a checkpoint");
    const std::vector<unsigned char> tail = packTail(film, identity, record);
    Header header{};
    header.magic = kMagic;
    header.format_version = film.splats.empty() ? kCheckpointVersion : kCheckpointVersionSplats;
    header.header_bytes = static_cast<std::uint32_t>(sizeof(Header) + tail.size());
    header.width = film.shape().width;
    header.height = film.shape().height;
    header.channels = film.shape().channels;
    header.aovs = film.shape().aovs;
    std::copy_n(identity.scene_hash.data(), kHashDigits, header.scene_hash.begin());
    header.version_bytes = static_cast<std::uint32_t>(identity.version.size());
    header.range_count = static_cast<std::uint32_t>(film.samples.ranges().size());
    header.bits_version = identity.bits_version;
    header.record_bytes = static_cast<std::uint32_t>(record.size());
    AtomicFile file(path);  // Where it cannot be written, nothing need be packed.
    const std::vector<unsigned char> packed = packFilm(film);
    header.file_bytes = header.header_bytes + packed.size();
    ByteHash checksum;
    addHeader(checksum, header);
    checksum.add(tail.data(), tail.size());
    checksum.add(packed.data(), packed.size());
    header.checksum = checksum.digest64();

    file.write(&header, sizeof header);
    file.write(tail.data(), tail.size());
    file.write(packed.data(), packed.size());
    file.commit();
}

std::pair<Film, FilmIdentity> readCheckpoint(const std::string& path) {
    const std::unique_ptr<std::FILE, CloseFile> file = openFilm(path);
    struct stat status {};
    if (::fstat(::fileno(file.get()), &status) != 0)
        refuse(path, fmt::format("cannot be read: {}", std::strerror(errno)));
    const auto actual_bytes = static_cast<std::uint64_t>(status.st_size);
    if (actual_bytes == 0) refuse(path, "is empty, not a crt film");

    Header header{};
    readExactly(file.get(), path, &header, std::min<std::uint64_t>(actual_bytes, sizeof header));
    if (std::memcmp(header.magic.data(), kMagic.data(),
                    std::min<std::uint64_t>(actual_bytes, kMagic.size())) != 0)
        refuse(path, "is not a crt film: its first bytes differ");
    if (actual_bytes >= 12 && (header.format_version < kCheckpointVersionUnpacked ||
                               header.format_version > kCheckpointVersionSplats))
        refuse(path, fmt::format("is a crt film of format {}; this crt reads formats {} to {}",
                                 header.format_version, kCheckpointVersionUnpacked,
                                 kCheckpointVersionSplats));
    if (actual_bytes < sizeof header)
        refuse(path, fmt::format("is truncated: it has {} bytes and its header needs {}", actual_bytes,
                                 sizeof header));
    // Sizes before anything is allocated: a damaged width must not ask for a terabyte.
    if (actual_bytes < header.file_bytes)
        refuse(path, fmt::format("is truncated: it has {} of {} bytes", actual_bytes, header.file_bytes));
    if (actual_bytes > header.file_bytes || header.version_bytes > kVersionBytesMax ||
        header.range_count > kRangesMax || header.record_bytes > kRecordBytesMax || !sizesFit(header))
        refuse(path, "is damaged: its header contradicts its size");
    // A side of no pixels makes any other side fit the size; walking four thousand million empty rows would
    // take a minute.
    if (std::min(header.width, header.height) < 1 || std::max(header.width, header.height) > kFilmSideMax)
        refuse(path, fmt::format("is damaged: its header states {} x {} pixels, and films have 1 to {} per "
                                 "side",
                                 header.width, header.height, kFilmSideMax));

    const char* const kBadChecksum = "is damaged: its checksum does not match its content";
    ByteHash checksum;
    addHeader(checksum, header);
    std::vector<unsigned char> tail(header.header_bytes - sizeof(Header));
    readExactly(file.get(), path, tail.data(), tail.size());
    checksum.add(tail.data(), tail.size());

    std::vector<unsigned char> packed;
    if (header.format_version > kCheckpointVersionUnpacked) {
        packed.resize(header.file_bytes - header.header_bytes);
        readExactly(file.get(), path, packed.data(), packed.size());
        checksum.add(packed.data(), packed.size());
        if (checksum.digest64() != header.checksum) refuse(path, kBadChecksum);
    }

    std::optional<FilmRecord> record;
    if (header.record_bytes > 0) record = readRecordOf(path, tail, header);
    const std::uint32_t spectral = record ? record->spectral.count() : 0;
    double splat_scale = 0;
    if (header.format_version == kCheckpointVersionSplats)
        std::memcpy(&splat_scale, &tail[bytesToRecordEnd(header)], sizeof splat_scale);

    // The shape of an unpacked film is used before the checksum is known; Film refuses one that cannot be.
    const auto make_film = [&] {
        try {
            const bool squares = header.format_version == kCheckpointVersionUnpacked;
            return Film({header.width, header.height, header.channels,
                         header.aovs | (squares ? kAovSquares : 0u), spectral, splat_scale});
        } catch (const Error& error) {
            if (error.kind() != ErrorKind::Internal) throw;  // Too large for this machine is not damaged.
            refuse(path, kBadChecksum);
        }
    };
    Film film = make_film();
    const auto read_section = [&](auto& values) {
        const std::size_t bytes = values.size() * sizeof(values[0]);
        readExactly(file.get(), path, values.data(), bytes);
        checksum.add(values.data(), bytes);
        return bytes;
    };
    if (header.format_version > kCheckpointVersionUnpacked) {
        if (!unpackFilm(packed, film)) refuse(path, "is damaged: its film cannot be unpacked");
    } else {
        read_section(film.sums);
        read_section(film.counts);
        const std::size_t primitive_bytes = read_section(film.primitives);
        std::vector<unsigned char> padding(roundUp8(primitive_bytes) - primitive_bytes);
        read_section(padding);
        if (checksum.digest64() != header.checksum) refuse(path, kBadChecksum);
    }

    // From here on the file is what a crt wrote; what is checked still is what could only be a bug of that
    // crt.
    FilmIdentity identity{
        std::string(header.scene_hash.data(), kHashDigits),
        std::string(reinterpret_cast<const char*>(tail.data()) + header.range_count * std::size_t{16},
                    header.version_bytes),
        header.bits_version};
    identity.record = std::move(record);
    if (!isHexHash(identity.scene_hash.data(), identity.scene_hash.size()))
        refuse(path, "holds an invalid scene hash");
    try {
        for (std::uint32_t i = 0; i < header.range_count; ++i) {
            SampleRange range;
            std::memcpy(&range.first, &tail[i * std::size_t{16}], 8);
            std::memcpy(&range.second, &tail[i * std::size_t{16} + 8], 8);
            film.samples.add(range);
        }
    } catch (const Error& error) {
        refuse(path, fmt::format("holds impossible sample ranges: {}", error.what()));
    }
    return {std::move(film), std::move(identity)};
}

namespace {

/// The traits that `found` has and `expected` lacks, in words.
std::string differenceText(const FilmIdentity& found, const FilmIdentity& expected) {
    std::vector<std::string> differences;
    if (found.record && expected.record) differences = differingTraits(*found.record, *expected.record);
    if (differences.empty())
        return fmt::format("its hash is {}, expected is {}", found.scene_hash, expected.scene_hash);
    return fmt::format("{}", fmt::join(differences, "; "));
}

}  // namespace

void requireSameScene(const std::string& path, const FilmIdentity& found, const FilmIdentity& expected) {
    // Before the hash, which covers the version too and could not say what differs.
    if (found.bits_version != expected.bits_version)
        refuse(path, fmt::format("holds samples of bits version {}, rendered by crt {}, and version {} is "
                                 "expected: samples of two versions cannot be combined; render it again",
                                 found.bits_version, found.version, expected.bits_version));
    if (found.scene_hash != expected.scene_hash)
        refuse(path, fmt::format("belongs to another scene, seed or film: {}",
                                 differenceText(found, expected)));
    if (found.version != expected.version)
        logWarning("'{}' was rendered by crt {}, this is {}: samples may differ between versions", path,
                   found.version, expected.version);
}

std::string joinVersions(const std::string& a, const std::string& b) {
    constexpr std::string_view kBetween = " and ", kMore = "more";
    std::set<std::string> versions;
    for (const std::string& text : {a, b})
        for (std::size_t begin = 0; begin < text.size();) {
            const std::size_t end = std::min(text.find(kBetween, begin), text.size());
            versions.insert(text.substr(begin, end - begin));
            begin = end + kBetween.size();
        }
    const std::string joined = fmt::format("{}", fmt::join(versions, kBetween));
    if (joined.size() <= kVersionBytesMax) return joined;
    const std::size_t end = joined.rfind(kBetween, kVersionBytesMax - kBetween.size() - kMore.size());
    return fmt::format("{}{}{}", joined.substr(0, end), kBetween, kMore);
}

namespace {

std::uint64_t firstSample(const Film& film) {
    return film.samples.ranges().empty() ? ~std::uint64_t{0} : film.samples.ranges().front().first;
}

/// The record of the film with the lower first sample leads, so that the order of the films does not show.
void addRecord(std::optional<FilmRecord>& record, std::optional<FilmRecord> other, bool other_leads) {
    if (!record || (other && other_leads)) std::swap(record, other);
    if (record && other) record->addRun(*other);
}

}  // namespace

void mergeFilm(std::pair<Film, FilmIdentity>& merged, const std::string& merged_name, const Film& film,
               const FilmIdentity& identity, const std::string& name) {
    auto& [sum, sum_identity] = merged;
    if (identity.bits_version != sum_identity.bits_version)
        throw Error(
            ErrorKind::Usage,
            fmt::format("'{}' and '{}' hold samples of bits versions {} and {}, which cannot be combined: "
                        "render one of them again",
                        merged_name, name, sum_identity.bits_version, identity.bits_version),
            {name});
    if (identity.scene_hash != sum_identity.scene_hash)
        throw Error(ErrorKind::Usage,
                    fmt::format("'{}' and '{}' differ in scene, seed or film: {}", name, merged_name,
                                differenceText(identity, sum_identity)),
                    {name});
    requireSameScene(name, identity, sum_identity);
    const bool leads = firstSample(film) < firstSample(sum);
    try {
        sum.add(film);
    } catch (const Error& error) {
        refuse(name, fmt::format("cannot be merged with the files before it: {}", error.what()));
    }
    addRecord(sum_identity.record, identity.record, leads);
    sum_identity.version = joinVersions(sum_identity.version, identity.version);
}

std::pair<Film, FilmIdentity> mergeCheckpoints(const std::vector<std::string>& paths) {
    if (paths.empty()) throw Error(ErrorKind::Usage, "nothing to merge: name at least one .crtfilm file");
    std::pair<Film, FilmIdentity> merged = readCheckpoint(paths.front());
    for (std::size_t i = 1; i < paths.size(); ++i) {
        const auto [film, identity] = readCheckpoint(paths[i]);
        mergeFilm(merged, paths.front(), film, identity, paths[i]);
    }
    return merged;
}

}  // namespace crt
