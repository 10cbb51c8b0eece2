#include "film/film_pack.h"

#include "base/error.h"
#include "base/parallel.h"

#include <fmt/format.h>
#include <zstd.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <memory>
#include <new>

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
std::array<Section<Byte>, 3> sectionsOf(AnyFilm& film) {
    const auto section = [](auto& values, std::size_t pixels) {
        using Value = typename std::remove_reference_t<decltype(values)>::value_type;
        const std::size_t bytes = values.size() * sizeof(Value);
        return Section<Byte>{reinterpret_cast<Byte*>(values.data()), pixels,
                             pixels == 0 ? 0 : bytes / pixels};
    };
    const std::size_t pixels = film.counts.size();
    return {section(film.sums, pixels), section(film.counts, pixels), section(film.primitives, pixels)};
}

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
        plane_.resize(end - first);
        for (std::size_t byte = 0; byte < section.bytes; ++byte) {
            for (std::size_t i = 0; i < plane_.size(); ++i) plane_[i] = block[i * section.bytes + byte];
            addPlane();
        }
        return std::move(bytes_);
    }

private:
    void addPlane() {
        if (std::all_of(plane_.begin(), plane_.end(),
                        [this](unsigned char b) { return b == plane_.front(); }))
            return append(plane_.data(), 1);
        const std::size_t size = ZSTD_compressCCtx(context_.get(), packed_.data(), packed_.size(),
                                                   plane_.data(), plane_.size(), kLevel);
        if (ZSTD_isError(size))
            throw Error(ErrorKind::Internal,
                        fmt::format("zstd cannot pack a film: {}", ZSTD_getErrorName(size)));
        if (size < plane_.size()) return append(packed_.data(), size);
        append(plane_.data(), plane_.size());
    }
    void append(const unsigned char* bytes, std::size_t size) {
        const auto length = static_cast<std::uint32_t>(size);
        const auto* length_bytes = reinterpret_cast<const unsigned char*>(&length);
        bytes_.insert(bytes_.end(), length_bytes, length_bytes + sizeof length);
        bytes_.insert(bytes_.end(), bytes, bytes + size);
    }

    std::unique_ptr<ZSTD_CCtx, FreeContext> context_;
    std::vector<unsigned char> plane_, packed_, bytes_;
};

class Unpacker {
public:
    explicit Unpacker(std::span<const unsigned char> packed) : context_(ZSTD_createDCtx()), rest_(packed) {
        if (!context_) throw std::bad_alloc();
    }

    bool read(const Section<unsigned char>& section) {
        for (std::size_t first = 0; first < section.records; first += kPackedPixels) {
            plane_.resize(std::min(kPackedPixels, section.records - first));
            unsigned char* block = section.data + first * section.bytes;
            for (std::size_t byte = 0; byte < section.bytes; ++byte) {
                if (!readPlane()) return false;
                for (std::size_t i = 0; i < plane_.size(); ++i) block[i * section.bytes + byte] = plane_[i];
            }
        }
        return true;
    }
    bool atEnd() const { return rest_.empty(); }

private:
    bool readPlane() {
        std::uint32_t size = 0;
        if (rest_.size() < kLeastPlane) return false;
        std::memcpy(&size, rest_.data(), sizeof size);
        rest_ = rest_.subspan(sizeof size);
        if (size == 0 || size > rest_.size()) return false;
        const std::span<const unsigned char> packed = rest_.first(size);
        rest_ = rest_.subspan(size);
        if (size == 1) {
            std::fill(plane_.begin(), plane_.end(), packed.front());
            return true;
        }
        if (size == plane_.size()) {
            std::copy(packed.begin(), packed.end(), plane_.begin());
            return true;
        }
        return ZSTD_decompressDCtx(context_.get(), plane_.data(), plane_.size(), packed.data(), size) ==
               plane_.size();
    }

    std::unique_ptr<ZSTD_DCtx, FreeContext> context_;
    std::span<const unsigned char> rest_;
    std::vector<unsigned char> plane_;
};

}  // namespace

std::vector<unsigned char> packFilm(const Film& film) {
    std::vector<unsigned char> all;
    for (const Section<const unsigned char>& section : sectionsOf<const unsigned char>(film)) {
        // Each block is packed for itself, so that any number of threads make the same bytes.
        std::vector<std::vector<unsigned char>> blocks(partsOf(section.records, kPackedPixels));
        parallelFor(section.records, kPackedPixels, [&](std::size_t first, std::size_t end) {
            blocks[first / kPackedPixels] = Packer().pack(section, first, end);
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
    const Wide planes = Wide{shape.channels} * 16 + 8 + ((shape.aovs & kAovPrimitive) != 0 ? 4 : 0);
    return blocks * planes * kLeastPlane;
}

bool unpackFilm(std::span<const unsigned char> packed, Film& film) {
    Unpacker unpacker(packed);
    for (const Section<unsigned char>& section : sectionsOf<unsigned char>(film))
        if (!unpacker.read(section)) return false;
    return unpacker.atEnd();
}

}  // namespace crt
