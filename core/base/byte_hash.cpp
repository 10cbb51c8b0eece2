#include "base/byte_hash.h"

#include <fmt/format.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <new>

namespace crt {

ByteHash::ByteHash() : state_(XXH3_createState()) {
    if (!state_) throw std::bad_alloc();
    XXH3_128bits_reset(state_.get());
}

// The state of 64 and of 128 bits is one; only the digests differ.
void ByteHash::add(const void* bytes, std::size_t size) { XXH3_128bits_update(state_.get(), bytes, size); }

std::uint64_t ByteHash::digest64() const { return XXH3_64bits_digest(state_.get()); }

std::string ByteHash::digits128() const {
    const XXH128_hash_t hash = XXH3_128bits_digest(state_.get());
    return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

void ByteHash::Free::operator()(XXH3_state_s* state) const { XXH3_freeState(state); }

}  // namespace crt
