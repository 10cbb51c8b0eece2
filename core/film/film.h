/// The film on the host: sums of samples, their algebra (add, merge, checkpoint) and what they resolve to.
///
/// Every sum is an unevaluated pair hi + lo of doubles, so that the order of additions shows only some
/// 2^-100 below the value: any split over threads, tiles, chunks, machines or resumes resolves to the same
/// float image.
#pragma once

#include "base/error.h"
#include "film/film_record.h"
#include "image/development.h"
#include "kernel/dialect/bits_version.h"
#include "scene/aov.h"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace crt {

/// Half-open range of sample indices.
using SampleRange = std::pair<std::uint64_t, std::uint64_t>;

/// Sorted, disjoint, merged ranges of sample indices.
class SampleRanges {
public:
    SampleRanges() = default;
    explicit SampleRanges(const std::vector<SampleRange>& ranges);
    /// Throws crt::Error(Usage) when `range` overlaps what is there.
    void add(SampleRange range);
    std::uint64_t count() const;
    const std::vector<SampleRange>& ranges() const { return ranges_; }
    /// "0-1024;2048-3072"
    std::string text() const;

private:
    std::vector<SampleRange> ranges_;
};

struct FilmShape {
    std::uint32_t width = 0, height = 0;
    std::uint32_t channels = 0;   ///< layout.h: X, Y, Z, then those of kernel/dialect/channels.h.
    std::uint32_t aovs =
        0;  ///< Bits of Aov that need film channels or the primitive plane, kAovReplicates among them.
    std::uint32_t spectral = 0;  ///< Of these channels, the last: scene/spectral_film.h.
    double splat_scale = 0;  ///< CrtScene::splat_scale: of the plane that kAovSplats says is there.
    /// Independent sequences that samples take turns between (layout.h); 1: the film does not tell them
    /// apart.
    std::uint32_t replicates() const;
    /// The first of the `spectral` channels.
    std::uint32_t firstSpectral() const { return channels - spectral; }
    /// Words of a pixel in the plane of splats (kernel/dialect/channels.h); 0: the film takes none.
    std::uint32_t splatWords() const;
    /// Memory of the film's planes.
    std::uint64_t bytes() const;
    bool operator==(const FilmShape&) const = default;
};

class Film {
public:
    explicit Film(FilmShape shape);
    const FilmShape& shape() const { return shape_; }

    std::vector<double> sums;              ///< [height][width][channels][2]
    std::vector<std::uint64_t> counts;     ///< [height][width]
    std::vector<std::uint32_t> primitives; ///< [height][width] or empty
    std::vector<std::uint64_t> splats;     ///< [height][width][splatWords()]: kernel/film/splat.h
    SampleRanges samples;                  ///< Ranges asked for (every pixel has the same).

    /// Adds another film of disjoint sample ranges. Primitive ids are taken from the film with the lower
    /// first sample. Throws crt::Error(Usage) when shapes differ or ranges overlap.
    void add(const Film& other);

    /// hi + lo rounded to double: of the pixel's own samples, without splats.
    double sum(std::uint32_t x, std::uint32_t y, std::uint32_t channel) const;
    /// X, Y or Z of all splats on the pixel, by the channel's number; 0 for other channels.
    double splatSum(std::uint32_t x, std::uint32_t y, std::uint32_t channel) const;
    /// Mean of a channel; 0 when the pixel has no valid sample. Splats come from the samples of all pixels:
    /// their sum is divided by the number of samples that were asked for, whichever of them were valid.
    double mean(std::uint32_t x, std::uint32_t y, std::uint32_t channel) const;
    /// Sum of Y of the samples of a replicate (layout.h) and of their splats, and how many samples were
    /// asked of it; error_estimate.h makes error bars of them.
    std::uint32_t replicates() const { return shape_.replicates(); }
    double replicateSum(std::uint32_t x, std::uint32_t y, std::uint32_t replicate) const;
    /// The same of X (0), Y (1) or Z (2), of films with kAovColorError.
    double replicateSumOf(std::uint32_t component, std::uint32_t x, std::uint32_t y,
                          std::uint32_t replicate) const;
    std::uint64_t replicateSamples(std::uint32_t replicate) const;
    /// Samples that were NaN or infinite and were dropped.
    std::uint64_t invalidSamples() const;
    /// Splats that were NaN, infinite or too large, and were left out: of all pixels, and of one by its
    /// number.
    std::uint64_t droppedSplats() const;
    std::uint64_t droppedSplatsOf(std::size_t pixel) const;

private:
    FilmShape shape_;
};

/// The pixels [x0, x1) × [y0, y1) of a film, as a film. Throws crt::Error(Internal) beyond its edge.
Film cropped(const Film& film, const std::array<int, 4>& window);

}  // namespace crt
