#include "view/pace.h"

#include <algorithm>
#include <cmath>

namespace crt {
namespace {

/// Of rendering a picture while the camera moves.
constexpr double kPictureSeconds = 0.03;
/// From one picture to the next, where reading it from the device leaves half of kPictureSeconds: more than
/// twenty a second.
constexpr double kPeriodSeconds = 0.045;
/// Of a picture that refines a smaller one.
constexpr double kRefineSeconds = 0.25;
constexpr double kUnhurriedSeconds = 0.4;
/// Of the first picture of an unknown device. A hundredth of a second even on two cores, for most scenes.
constexpr double kFirstPixels = 16384;
constexpr unsigned kMostDivisor = 32;

}  // namespace

void Pace::rendered(std::uint64_t pixels, std::uint64_t samples, double seconds) {
    const double rate = static_cast<double>(pixels * samples) / std::max(seconds, 1e-6);
    // Small pictures keep no large device busy, so that a rise is believed at once.
    paths_per_second_ = rate > paths_per_second_ ? rate : 0.7 * paths_per_second_ + 0.3 * rate;
}

void Pace::handedOn(double seconds) {
    hand_on_seconds_ = hand_on_seconds_ == 0 ? seconds : 0.7 * hand_on_seconds_ + 0.3 * seconds;
}

unsigned Pace::divisorWithin(std::uint64_t pixels, double seconds) const {
    const double affordable = paths_per_second_ > 0 ? paths_per_second_ * seconds : kFirstPixels;
    unsigned divisor = 1;
    while (divisor<kMostDivisor&& static_cast<double>(pixels) / (divisor * divisor)> affordable)
        divisor *= 2;
    return divisor;
}

unsigned Pace::firstDivisor(std::uint64_t pixels) const { return divisorWithin(pixels, kPictureSeconds); }

unsigned Pace::nextDivisor(std::uint64_t pixels, unsigned divisor) const {
    return std::min(divisor / 2, divisorWithin(pixels, kRefineSeconds));
}

std::uint64_t Pace::samplesOfChunk(std::uint64_t pixels, bool unhurried) const {
    const double hurried =
        std::clamp(kPeriodSeconds - hand_on_seconds_, kPictureSeconds / 2, kPictureSeconds);
    const double seconds = unhurried ? kUnhurriedSeconds : hurried;
    const double affordable =
        paths_per_second_ * seconds / static_cast<double>(std::max<std::uint64_t>(pixels, 1));
    return std::max<std::uint64_t>(1, static_cast<std::uint64_t>(std::min(affordable, 1e6)));
}

}  // namespace crt
