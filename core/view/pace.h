/// Chooses the size of the first images and the number of samples of the next chunk, so that the view
/// follows the camera during a drag: small pictures on slow devices, whole ones on fast.
#pragma once

#include <cstdint>

namespace crt {

class Pace {
public:
    /// Records the time of an image of the film at 1/divisor of its size with this number of samples per
    /// pixel.
    void rendered(std::uint64_t pixels, std::uint64_t samples, double seconds);
    /// So long it took until a picture that was rendered had left the device.
    void handedOn(double seconds);
    /// A device of which nothing is known.
    void forget() { *this = {}; }

    /// For the first image of a film with this number of pixels: a power of two.
    unsigned firstDivisor(std::uint64_t pixels) const;
    /// After a picture at `divisor`, which is above 1.
    unsigned nextDivisor(std::uint64_t pixels, unsigned divisor) const;
    /// For the whole film; `unhurried` if no page is open.
    std::uint64_t samplesOfChunk(std::uint64_t pixels, bool unhurried) const;

    /// 0: not known.
    double pathsPerSecond() const { return paths_per_second_; }

private:
    unsigned divisorWithin(std::uint64_t pixels, double seconds) const;

    double paths_per_second_ = 0, hand_on_seconds_ = 0;
};

}  // namespace crt
