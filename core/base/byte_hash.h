/// XXH3 of bytes that come in pieces.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

struct XXH3_state_s;

namespace crt {

class ByteHash {
public:
    ByteHash();
    void add(const void* bytes, std::size_t size);
    std::uint64_t digest64() const;
    /// XXH3-128, 32 hex digits.
    std::string digits128() const;

private:
    struct Free {
        void operator()(XXH3_state_s* state) const;
    };
    std::unique_ptr<XXH3_state_s, Free> state_;
};

}  // namespace crt
