/// Pairs of images whose expectation and noise are known because they were made here: pixels of independent
/// replicates, which state the variance of their mean as a film does.
#pragma once

#include "film/film.h"

#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace crt::synthetic {

/// Distribution of one pixel's samples about their mean.
enum class Noise {
    Normal,     ///< As sums of many alike terms do.
    Skewed,     ///< Gamma: bounded below by 0, a long tail above.
    RareLight,  ///< A Poisson number of equally bright paths: most replicates of a dim pixel meet none.
    Fireflies,  ///< Rare, and of very different brightness.
    Coverage,   ///< Of a pixel that an edge crosses: whole numbers of samples, so that replicates agree
                ///< exactly by chance.
};

struct Scenario {
    Noise noise = Noise::Normal;
    /// Else expectations and variances differ a hundredfold, in blocks with sharp edges.
    bool equal_pixels = true;
    std::uint32_t replicates = 4;  ///< The stated variance has one degree of freedom less.
    double relative_noise = 0.1;   ///< Standard error of the median pixel over its mean.
    std::uint32_t width = 64, height = 64;
    bool coloured =
        false;  ///< R and B have independent noise, and G the mean of both; else they are equal.
};

/// Effect of a planted error on the expectation.
struct Planted {
    double everywhere = 0;  ///< Relative.
    double one_tile = 0;    ///< Relative, of the tile of 8 × 8 pixels at (16, 8).
};

class Maker {
public:
    explicit Maker(std::uint64_t seed) : random_(seed), seed_(seed) {}

    /// R = G = B with StdError.Y and its degrees of freedom. `quality` divides the variance, as that factor
    /// more samples would.
    Image image(const Scenario& s, const Planted& planted = {}, double quality = 1) {
        Image image;
        image.width = s.width;
        image.height = s.height;
        image.channels = {"R", "G", "B", "StdError.Y"};
        image.metadata = {{"crt/seed", std::to_string(seed_++)},
                          {"crt/errorDegreesOfFreedom", std::to_string(s.replicates - 1)},
                          {"crt/spp", std::to_string(64 * quality)}};
        for (std::uint32_t y = 0; y < s.height; ++y)
            for (std::uint32_t x = 0; x < s.width; ++x) {
                double expectation = 1, relative = s.relative_noise;
                if (!s.equal_pixels) {
                    const std::uint32_t block = (x / 5 * 7 + y / 3 * 13) % 9;
                    expectation = std::pow(10.0, block / 4.0 - 1);  // 0.1 to 10
                    relative *= std::pow(10.0, ((block * 5) % 9) / 8.0 - 0.5);
                }
                expectation *= 1 + planted.everywhere;
                if (x / 8 == 2 && y / 8 == 1) expectation *= 1 + planted.one_tile;
                addPixel(image, s, expectation, relative * relative / quality);
            }
        return image;
    }

private:
    void addPixel(Image& image, const Scenario& s, double expectation, double relative_variance) {
        const double k = s.replicates, red_of_luminance = 0.2126390 + 0.7151687 / 2;  // Of sRGB.
        std::vector<double> luminances;
        double red = 0, blue = 0, mean = 0;
        for (std::uint32_t r = 0; r < s.replicates; ++r) {
            const double of_red = expectation * replicate(s.noise, k * relative_variance);
            const double of_blue =
                s.coloured ? expectation * replicate(s.noise, k * relative_variance) : of_red;
            red += of_red / k;
            blue += of_blue / k;
            mean +=
                luminances.emplace_back(red_of_luminance * of_red + (1 - red_of_luminance) * of_blue) / k;
        }
        double squares = 0;
        for (const double v : luminances) squares += (v - mean) * (v - mean);
        for (const double v : {red, 0.5 * (red + blue), blue}) image.pixels.push_back(static_cast<float>(v));
        image.pixels.push_back(static_cast<float>(std::sqrt(squares / (k - 1) / k)));
    }

    /// Of mean 1 and this variance.
    double replicate(Noise noise, double variance) {
        switch (noise) {
            case Noise::Normal: return 1 + std::sqrt(variance) * std::normal_distribution<double>()(random_);
            case Noise::Skewed: return std::gamma_distribution<double>(1 / variance, variance)(random_);
            case Noise::RareLight: return variance * std::poisson_distribution<int>(1 / variance)(random_);
            case Noise::Fireflies: {
                // Lognormal brightness of mean 1 and mean square e.
                double sum = 0;
                const double events = std::exp(1.0) / variance;
                for (int n = std::poisson_distribution<int>(events)(random_); n > 0; --n)
                    sum += std::lognormal_distribution<double>(-0.5, 1)(random_);
                return sum / events;
            }
            case Noise::Coverage: break;
        }
        // Half of n samples are inside: variance 1/n of the doubled share.
        const int n = std::max(1, static_cast<int>(std::lround(1 / variance)));
        return 2.0 * std::binomial_distribution<int>(n, 0.5)(random_) / n;
    }

    std::mt19937_64 random_;
    std::uint64_t seed_;
};

}  // namespace crt::synthetic
