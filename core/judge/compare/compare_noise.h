/// Is the difference of two images more than their noise?
#pragma once

#include "film/film.h"
#include "judge/stats/image_tests.h"

#include <string>
#include <vector>

namespace crt {

struct ChannelBias {
    std::string channel;
    double mean_a = 0, mean_b = 0;
    double difference = 0;     ///< mean_a − mean_b
    stats::Interval interval;  ///< Of the difference, at NoiseComparison::confidence.
    double p = 1;              ///< P that the means are equal.
    bool beyondNoise() const { return !interval.contains(0); }  ///< The same as p < 1 − confidence.
};

/// The remaining difference of R, G or B when every pixel of A has B's luminance.
struct ColourShift {
    std::string channel;
    double relative = 0;  ///< Mean over the image, over B's mean luminance.
    double p = 1;         ///< P that there is no bias: by the signs of the pixels' differences.
};

/// The verdict of the images' own noise on their difference. When nothing is wrong, an alarm of each kind (a
/// channel's mean, any tile, any pixel) is as rare as 1 − confidence: where noise is normal; and, of means
/// and tiles, also where the images differ in their seeds alone, whatever the noise and however few the
/// degrees of freedom of the stated variances. Means and tiles are judged by the stated noise and by the
/// signs of the pixels' differences (stats/pooled_tests.h), and both must agree. A pixel is judged by its
/// own variance and by that of its neighbours, and not at all where its variance has fewer than seven
/// degrees of freedom. Differences that go up and down alike, or lie in a few pixels, show in their squares
/// (stats::excessP): over the image, and in a tile without its two largest, which may be fireflies. Where
/// only luminance has a stated noise, colour is judged by the signs of the pixels' differences, and where
/// neither image states any, all is. The mean of a render of fewer samples than the other's has at least the
/// variance that the other's says. Of images under 64 pixels, and with noise that is skewed and not alike in
/// both, the mean is judged as if noise were normal; that of tiles is then at least the average of the tiles
/// about them.
struct NoiseComparison {
    std::string unknown;             ///< Reason why there is no verdict, one sentence; then all else is
                                     ///< empty.
    std::string source_a, source_b;  ///< Where variances are from; empty: none, the image is taken as exact.
    bool stated = false;             ///< One image at least says how large its noise is.
    double confidence = 0.999;
    std::vector<ChannelBias> channels;
    std::vector<ColourShift>
        colours;                  ///< R, G and B, where `channels` is luminance alone and colour is judged.
    std::string colour_unjudged;  ///< Reason why it is not, one sentence without a full stop; empty if it
                                  ///< is.
    stats::TestFamily tiles, pixels;  ///< Channels among them: `worst` is place · channels + channel.
    std::string pixels_untested;  ///< Reason why single pixels are not tested, one sentence without a full
                                  ///< stop; empty if they are.
    std::uint32_t tiles_across = 0;
    /// (a − b) / standard error; [pixel][channel]. 0 where there is neither noise nor difference, infinite
    /// where no noise. The standard error is the larger of the pixel's own and the average of the 7 × 7
    /// pixels about it.
    std::vector<double> z;
    /// √(Σ (a − b)² / Σ stated variances): 1 when all the difference is noise, and the noise is what
    /// the images say. Unbiased with any degrees of freedom, which the mean square of single z's is not.
    double rms_z = 0;
    double rms_z_p = 1;  ///< That noise makes it so large. Only with stated noise.

    double alpha() const { return 1 - confidence; }
    bool anyBeyondNoise() const;  ///< True if a test of any kind raises an alarm.
    bool rmsBeyondNoise() const { return rms_z_p < alpha(); }
    /// Of three colours any may raise the alarm.
    bool beyondNoise(const ColourShift& colour) const {
        return colour.p * static_cast<double>(colours.size()) < alpha();
    }
};

/// Images of one size with R, G and B. Between pixels noise is independent, and so are the images: with one
/// seed they are not, and then nothing is said.
NoiseComparison compareNoise(const Image& a, const Image& b);

/// To look at: white where z is 0, red where a is brighter, blue where it is darker, full colour from |z| =
/// 5; black where there is no noise to compare with. The largest |z| of the channels counts.
Image zMap(const NoiseComparison& noise, std::uint32_t width, std::uint32_t height);
/// Writes it: z itself to .exr and .pfm, colours to .png, .jpg and .ppm. Throws crt::Error(Usage) when there
/// is no z or for another extension, crt::Error(Output).
void writeZMap(const std::string& path, const NoiseComparison& noise, std::uint32_t width,
               std::uint32_t height);

}  // namespace crt
