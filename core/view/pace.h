/// How large the first pictures are, and how many samples the next chunk has, so that a hand that moves the
/// camera sees what it does: small pictures on slow devices, whole ones on fast.
#pragma once

#include <cstdint>

namespace crt {

class Pace {
public:
    /// A picture of the film at 1/divisor of its size took so long for so many samples per pixel.
    void rendered(std::uint64_t pixels, std::uint64_t samples, double seconds);
    /// So long it took until a picture that was rendered had left the device.
    void handedOn(double seconds);
    /// A device of which nothing is known.
    void forget() { *this = {}; }

    /// Of the first picture of a film of so many pixels: a power of two.
    unsigned firstDivisor(std::uint64_t pixels) const;
    /// After a picture at `divisor`, which is above 1.
    unsigned nextDivisor(std::uint64_t pixels, unsigned divisor) const;
    /// Of the whole film; `unhurried` when nobody looks.
    std::uint64_t samplesOfChunk(std::uint64_t pixels, bool unhurried) const;

    /// 0: not known.
    double pathsPerSecond() const { return paths_per_second_; }

private:
    unsigned divisorWithin(std::uint64_t pixels, double seconds) const;

    double paths_per_second_ = 0, hand_on_seconds_ = 0;
};

}  // namespace crt
