#include "base/byte_hash.h"

#include <fmt/format.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace crt {

struct ByteHash::State {
    XXH3_state_t xxh3;
};

ByteHash::ByteHash() : state_(std::make_unique<State>()) { XXH3_128bits_reset(&state_->xxh3); }
ByteHash::~ByteHash() = default;

// The state of 64 and of 128 bits is one; only the digests differ.
void ByteHash::add(const void* bytes, std::size_t size) { XXH3_128bits_update(&state_->xxh3, bytes, size); }

std::uint64_t ByteHash::digest64() const { return XXH3_64bits_digest(&state_->xxh3); }

std::string ByteHash::digits128() const {
    const XXH128_hash_t hash = XXH3_128bits_digest(&state_->xxh3);
    return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

}  // namespace crt
