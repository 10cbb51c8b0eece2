#include "film/film_pack.h"

#include "base/error.h"
#include "base/parallel.h"

#include <fmt/format.h>
#include <zstd.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <memory>
#include <mutex>
#include <new>
#include <utility>

namespace crt {
namespace {

static_assert(std::endian::native == std::endian::little, "films are packed as little-endian");

constexpr int kLevel = 1;  // Noise does not get smaller by trying harder.
constexpr std::size_t kLeastPlane = sizeof(std::uint32_t) + 1;

struct FreeContext {
    void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
    void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
};

/// `records` records of `bytes` bytes each.
template <class Byte>
struct Section {
    Byte* data;
    std::size_t records, bytes;
};

/// The sections of a film, const or not, in the order of the file.
template <class Byte, class AnyFilm>
std::array<Section<Byte>, 4> sectionsOf(AnyFilm& film) {
    const auto section = [](auto& values, std::size_t pixels) {
        using Value = typename std::remove_reference_t<decltype(values)>::value_type;
        const std::size_t bytes = values.size() * sizeof(Value);
        return Section<Byte>{reinterpret_cast<Byte*>(values.data()), pixels,
                             pixels == 0 ? 0 : bytes / pixels};
    };
    const std::size_t pixels = film.counts.size();
    return {section(film.sums, pixels), section(film.counts, pixels), section(film.primitives, pixels),
            section(film.splats, pixels)};
}

/// Several planes of one block, filled at once: a walk over the block for each single plane would load each
/// of its cache lines again for each byte.
class Planes {
public:
    static constexpr std::size_t kAtOnce = 64;  // A cache line of a record.

    void resize(std::size_t records) { records_ = records; }

    std::span<unsigned char> operator[](std::size_t plane) {
        return std::span(bytes_).subspan(plane * kStride, records_);
    }

    /// The bytes byte, …, byte + count − 1 of each record of `bytes` bytes.
    void fill(const unsigned char* block, std::size_t bytes, std::size_t byte, std::size_t count) {
        forEachByte(count, [&](std::size_t i, std::size_t k) {
            bytes_[k * kStride + i] = block[i * bytes + byte + k];
        });
    }
    /// The way back.
    void empty(unsigned char* block, std::size_t bytes, std::size_t byte, std::size_t count) const {
        forEachByte(count, [&](std::size_t i, std::size_t k) {
            block[i * bytes + byte + k] = bytes_[k * kStride + i];
        });
    }

private:
    // A cache line more than the pixels: at a distance of a power of two all planes would share one set of
    // the cache.
    static constexpr std::size_t kStride = kPackedPixels + 64;

    template <class Move>
    void forEachByte(std::size_t count, const Move& move) const {
        for (std::size_t i = 0; i < records_; ++i)
            for (std::size_t k = 0; k < count; ++k) move(i, k);
    }

    std::vector<unsigned char> bytes_ = std::vector<unsigned char>(kAtOnce * kStride);
    std::size_t records_ = 0;
};

/// Packs planes of a film one after the other.
class Packer {
public:
    Packer() : context_(ZSTD_createCCtx()), packed_(ZSTD_compressBound(kPackedPixels)) {
        if (!context_) throw std::bad_alloc();
    }

    /// The planes of the records first, …, end − 1, at most kPackedPixels.
    std::vector<unsigned char> pack(const Section<const unsigned char>& section, std::size_t first,
                                    std::size_t end) {
        bytes_.clear();
        const unsigned char* block = section.data + first * section.bytes;
        planes_.resize(end - first);
        for (std::size_t byte = 0; byte < section.bytes; byte += Planes::kAtOnce) {
            const std::size_t count = std::min(Planes::kAtOnce, section.bytes - byte);
            planes_.fill(block, section.bytes, byte, count);
            for (std::size_t k = 0; k < count; ++k) add(planes_[k]);
        }
        return bytes_;
    }

private:
    void add(std::span<const unsigned char> plane) {
        const bool all_equal = std::memcmp(plane.data(), plane.data() + 1, plane.size() - 1) == 0;
        if (all_equal) return append(plane.data(), 1);
        const std::size_t size = ZSTD_compressCCtx(context_.get(), packed_.data(), packed_.size(),
                                                   plane.data(), plane.size(), kLevel);
        if (ZSTD_isError(size))
            throw Error(ErrorKind::Internal,
                        fmt::format("zstd cannot pack a film: {}", ZSTD_getErrorName(size)));
        if (size < plane.size()) return append(packed_.data(), size);
        append(plane.data(), plane.size());
    }
    void append(const unsigned char* bytes, std::size_t size) {
        const auto length = static_cast<std::uint32_t>(size);
        const auto* length_bytes = reinterpret_cast<const unsigned char*>(&length);
        bytes_.insert(bytes_.end(), length_bytes, length_bytes + sizeof length);
        bytes_.insert(bytes_.end(), bytes, bytes + size);
    }

    std::unique_ptr<ZSTD_CCtx, FreeContext> context_;
    Planes planes_;
    std::vector<unsigned char> packed_, bytes_;
};

/// Packers that blocks take turns with: each takes two megabytes, which the system would clear again for
/// each block.
class Packers {
public:
    std::vector<unsigned char> pack(const Section<const unsigned char>& section, std::size_t first,
                                    std::size_t end) {
        std::unique_ptr<Packer> packer = take();
        std::vector<unsigned char> packed = packer->pack(section, first, end);
        const std::scoped_lock lock(mutex_);
        free_.push_back(std::move(packer));
        return packed;
    }

private:
    std::unique_ptr<Packer> take() {
        const std::scoped_lock lock(mutex_);
        if (free_.empty()) return std::make_unique<Packer>();
        std::unique_ptr<Packer> packer = std::move(free_.back());
        free_.pop_back();
        return packer;
    }

    std::mutex mutex_;
    std::vector<std::unique_ptr<Packer>> free_;
};

class Unpacker {
public:
    explicit Unpacker(std::span<const unsigned char> packed) : context_(ZSTD_createDCtx()), rest_(packed) {
        if (!context_) throw std::bad_alloc();
    }

    bool read(const Section<unsigned char>& section) {
        for (std::size_t first = 0; first < section.records; first += kPackedPixels) {
            planes_.resize(std::min(kPackedPixels, section.records - first));
            unsigned char* block = section.data + first * section.bytes;
            for (std::size_t byte = 0; byte < section.bytes; byte += Planes::kAtOnce) {
                const std::size_t count = std::min(Planes::kAtOnce, section.bytes - byte);
                for (std::size_t k = 0; k < count; ++k)
                    if (!read(planes_[k])) return false;
                planes_.empty(block, section.bytes, byte, count);
            }
        }
        return true;
    }
    bool atEnd() const { return rest_.empty(); }

private:
    bool read(std::span<unsigned char> plane) {
        std::uint32_t size = 0;
        if (rest_.size() < kLeastPlane) return false;
        std::memcpy(&size, rest_.data(), sizeof size);
        rest_ = rest_.subspan(sizeof size);
        if (size == 0 || size > rest_.size()) return false;
        const std::span<const unsigned char> packed = rest_.first(size);
        rest_ = rest_.subspan(size);
        if (size == 1) {
            std::fill(plane.begin(), plane.end(), packed.front());
            return true;
        }
        if (size == plane.size()) {
            std::copy(packed.begin(), packed.end(), plane.begin());
            return true;
        }
        return ZSTD_decompressDCtx(context_.get(), plane.data(), plane.size(), packed.data(), size) ==
               plane.size();
    }

    std::unique_ptr<ZSTD_DCtx, FreeContext> context_;
    std::span<const unsigned char> rest_;
    Planes planes_;
};

}  // namespace

std::vector<unsigned char> packFilm(const Film& film) {
    std::vector<unsigned char> all;
    Packers packers;
    for (const Section<const unsigned char>& section : sectionsOf<const unsigned char>(film)) {
        // Each block is packed for itself, so that any number of threads make the same bytes.
        std::vector<std::vector<unsigned char>> blocks(partsOf(section.records, kPackedPixels));
        parallelFor(section.records, kPackedPixels, [&](std::size_t first, std::size_t end) {
            blocks[first / kPackedPixels] = packers.pack(section, first, end);
        });
        std::size_t bytes = all.size();
        for (const std::vector<unsigned char>& block : blocks) bytes += block.size();
        all.reserve(bytes);
        for (const std::vector<unsigned char>& block : blocks)
            all.insert(all.end(), block.begin(), block.end());
    }
    return all;
}

unsigned __int128 leastPackedBytes(const FilmShape& shape) {
    using Wide = unsigned __int128;
    const Wide blocks = (Wide{shape.width} * shape.height + kPackedPixels - 1) / kPackedPixels;
    const Wide planes = Wide{shape.channels} * 16 + 8 + ((shape.aovs & kAovPrimitive) != 0 ? 4 : 0) +
                        Wide{8} * shape.splatWords();
    return blocks * planes * kLeastPlane;
}

bool unpackFilm(std::span<const unsigned char> packed, Film& film) {
    Unpacker unpacker(packed);
    for (const Section<unsigned char>& section : sectionsOf<unsigned char>(film))
        if (!unpacker.read(section)) return false;
    return unpacker.atEnd();
}

}  // namespace crt
