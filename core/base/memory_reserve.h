/// Memory for what follows long work, where the host may run out of it.
#pragma once

#include <cstddef>
#include <memory>
#include <new>

namespace crt {

/// Holds address space back while it lives, so that the code afterwards has that much even if the work
/// before used up all that a limit allows. The pages are not touched and take no memory. Holds nothing if
/// there is no room.
class MemoryReserve {
public:
    explicit MemoryReserve(std::size_t bytes) : held_(new (std::nothrow) std::byte[bytes]) {}

private:
    std::unique_ptr<std::byte[]> held_;
};

/// Throws std::bad_alloc unless this much memory is there. For code that would end the process without it:
/// nlohmann::json allocates in destructors.
inline void requireMemory(std::size_t bytes) {
    const std::unique_ptr<std::byte[]> there(new std::byte[bytes]);
    // A compiler may leave out an allocation that nothing sees.
    asm volatile("" : : "r"(there.get()) : "memory");
}

}  // namespace crt
