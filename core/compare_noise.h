/// Is the difference of two images more than their noise?
#pragma once

#include "film.h"
#include "stats/image_tests.h"

#include <string>
#include <vector>

namespace crt {

struct ChannelBias {
    std::string channel;
    double mean_a = 0, mean_b = 0;
    double difference = 0;          ///< mean_a − mean_b
    stats::Interval interval;       ///< Of the difference, at NoiseComparison::confidence.
    double p = 1;                   ///< That the means are equal.
};

/// What the images' own noise says of their difference.
struct NoiseComparison {
    std::string unknown;            ///< Why nothing is said, one sentence; then all else is empty.
    std::string source_a, source_b; ///< Where variances are from; empty: none, the image is taken as exact.
    double confidence = 0.999;
    std::vector<ChannelBias> channels;
    stats::TestFamily tiles, pixels;   ///< Channels among them: `worst` is place · channels + channel.
    std::uint32_t tiles_across = 0;
    /// (a − b) / standard error; [pixel][channel]. 0 where there is neither noise nor difference, infinite where no noise.
    std::vector<double> z;
    double rms_z = 0;               ///< 1 when all the difference is noise, and the noise is what the images say.
};

/// Images of one size with R, G and B. Between pixels noise is independent, and so are the images: with one seed they are not, and then nothing is
/// said.
NoiseComparison compareNoise(const Image& a, const Image& b);

/// To look at: white where z is 0, red where a is brighter, blue where it is darker, full colour from |z| = 5; black where there is no noise to
/// compare with. The largest |z| of the channels counts.
Image zMap(const NoiseComparison& noise, std::uint32_t width, std::uint32_t height);
/// Writes it: z itself to .exr and .pfm, colours to .png and .ppm. Throws crt::Error(Usage) when there is no z or for another extension,
/// crt::Error(Output).
void writeZMap(const std::string& path, const NoiseComparison& noise, std::uint32_t width, std::uint32_t height);

}  // namespace crt
