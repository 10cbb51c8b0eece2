/// XXH3 of bytes that come in pieces.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace crt {

class ByteHash {
public:
    ByteHash();
    ~ByteHash();
    ByteHash(const ByteHash&) = delete;
    ByteHash& operator=(const ByteHash&) = delete;

    void add(const void* bytes, std::size_t size);
    std::uint64_t digest64() const;
    /// XXH3-128, 32 hex digits.
    std::string digits128() const;

private:
    struct State;  // Of a library that only byte_hash.cpp includes.
    std::unique_ptr<State> state_;
};

}  // namespace crt
