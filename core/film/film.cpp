#include "film/film.h"

#include "base/host.h"
#include "base/large_memory.h"
#include "base/parallel.h"
#include "film/error_estimate.h"
#include "film/luminance_error.h"
#include "image/image_metadata.h"
#include "kernel/dialect/layout.h"
#include "scene/aov.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>

namespace crt {
namespace {

/// a + b = sum + error exactly (Knuth 1969, TAOCP 2, 4.2.2). Needs no |a| ≥ |b|.
void twoSum(double a, double b, double& sum, double& error) {
    sum = a + b;
    const double b_part = sum - a;
    error = (a - (sum - b_part)) + (b - b_part);
}

/// pair += other, to about 2^-104 of the larger (Joldes, Muller and Popescu 2017, algorithm 6, with the
/// branch-free two-sum throughout because a backend's pairs need not be normalised).
void addPair(double* pair, const double* other) {
    double high, high_error, low, low_error;
    twoSum(pair[0], other[0], high, high_error);
    twoSum(pair[1], other[1], low, low_error);
    twoSum(high, high_error + low, high, low);
    twoSum(high, low + low_error, pair[0], pair[1]);
}

/// The same of the splats of a pixel: sums of 128 bits, then their number (kernel/dialect/channels.h).
void addSplats(std::uint64_t* to, const std::uint64_t* from, std::size_t words) {
    for (std::size_t i = 0; i + 1 < words; i += 2) {
        to[i] += from[i];
        to[i + 1] += from[i + 1] + (to[i] < from[i] ? 1 : 0);
    }
    if (words != 0) to[words - 1] += from[words - 1];
}

/// A sum of the plane of splats.
__int128 splatUnits(const Film& film, std::uint32_t x, std::uint32_t y, std::uint32_t sum) {
    const std::size_t pixel = std::size_t{y} * film.shape().width + x;
    const std::uint64_t* words = &film.splats[pixel * film.shape().splatWords() + std::size_t{2} * sum];
    return static_cast<__int128>(static_cast<unsigned __int128>(words[1]) << 64 | words[0]);
}

bool hasRightChannels(const FilmShape& shape) {
    const std::uint32_t replicates = shape.replicates();
    int exponent = 0;
    const bool has_scale = std::isnormal(shape.splat_scale) &&
                           std::frexp(shape.splat_scale, &exponent) == 0.5;
    const bool has_splats = (shape.aovs & kAovSplats) != 0;
    if (has_scale != has_splats || (!has_scale && shape.splat_scale != 0)) return false;
    return shape.channels >= shape.spectral &&
           shape.firstSpectral() == channelsFor(shape.aovs, replicates) &&
           std::has_single_bit(replicates) && replicates <= CRT_REPLICATES_MAX;
}

/// Samples of `range` that belong to a replicate: they take turns.
std::uint64_t samplesOfReplicate(SampleRange range, std::uint64_t replicate, std::uint64_t replicates) {
    const auto below = [=](std::uint64_t end) {
        return end / replicates + (end % replicates > replicate ? 1 : 0);
    };
    return below(range.second) - below(range.first);
}

std::string rangeText(SampleRange range) { return fmt::format("{}-{}", range.first, range.second); }

}  // namespace

SampleRanges::SampleRanges(const std::vector<SampleRange>& ranges) {
    for (const SampleRange& range : ranges) add(range);
}

void SampleRanges::add(SampleRange range) {
    if (range.first > range.second)
        throw Error(ErrorKind::Usage,
                    fmt::format("sample range {} ends before it begins", rangeText(range)));
    if (range.first == range.second) return;
    // `next` is the first range that begins at or after this one ends; only the one before it can overlap.
    const auto next =
        std::lower_bound(ranges_.begin(), ranges_.end(), range.second,
                         [](const SampleRange& r, std::uint64_t end) { return r.first < end; });
    const auto before = next == ranges_.begin() ? ranges_.end() : std::prev(next);
    if (before != ranges_.end() && before->second > range.first)
        throw Error(ErrorKind::Usage,
                    fmt::format("samples {} overlap samples {}, which the film already has: the same "
                                "samples would count twice",
                                rangeText(range), rangeText(*before)));
    const bool joins_before = before != ranges_.end() && before->second == range.first;
    const bool joins_next = next != ranges_.end() && next->first == range.second;
    if (joins_before && joins_next) {
        before->second = next->second;
        ranges_.erase(next);
    } else if (joins_before) {
        before->second = range.second;
    } else if (joins_next) {
        next->first = range.first;
    } else {
        ranges_.insert(next, range);
    }
}

std::uint64_t SampleRanges::count() const {
    std::uint64_t count = 0;
    for (const SampleRange& range : ranges_) count += range.second - range.first;
    return count;
}

std::string SampleRanges::text() const {
    std::string text;
    for (const SampleRange& range : ranges_) {
        if (!text.empty()) text += ';';
        text += rangeText(range);
    }
    return text;
}

std::uint64_t FilmShape::bytes() const {
    const std::uint64_t of_primitive = (aovs & kAovPrimitive) != 0 ? 4 : 0;
    return std::uint64_t{width} * height *
           (16 * std::uint64_t{channels} + 8 + 8 * std::uint64_t{splatWords()} + of_primitive);
}

Film::Film(FilmShape shape) : shape_(shape) {
    if (!hasRightChannels(shape))
        throw Error(ErrorKind::Internal, fmt::format("a film with AOV mask {:#x} cannot have {} channels",
                                                     shape.aovs, shape.channels));
    const std::size_t pixels = std::size_t{shape.width} * shape.height;
    // Said beforehand: a system that promises memory which it does not have would end the process in the
    // middle.
    const std::uint64_t bytes = shape.bytes();
    constexpr std::uint64_t kWorthAsking = std::uint64_t{1} << 28;
    if (bytes > kWorthAsking && bytes > availableHostMemory())
        throw Error(ErrorKind::Device,
                    fmt::format("a film of {} × {} pixels with {} channels takes {:.1f} GB of memory, and "
                                "{:.1f} GB are free; reduce it, or render parts of it with --crop",
                                shape.width, shape.height, shape.channels, static_cast<double>(bytes) / 1e9,
                                static_cast<double>(availableHostMemory()) / 1e9));
    const std::size_t numbers = pixels * shape.channels * 2;
    sums.reserve(numbers);
    touchLargeMemory(sums.data(), numbers * sizeof(double));
    sums.assign(numbers, 0.0);
    counts.assign(pixels, 0);
    if (shape.aovs & kAovPrimitive) primitives.assign(pixels, CRT_NONE);
    splats.assign(pixels * shape.splatWords(), 0);
}

void Film::add(const Film& other) {
    if (!(shape_ == other.shape_))
        throw Error(ErrorKind::Usage, fmt::format("films differ in shape: {}×{} with {} channels and AOV "
                                                  "mask {:#x}, and {}×{} with {} "
                                                  "channels and AOV mask {:#x}",
                                                  shape_.width, shape_.height, shape_.channels, shape_.aovs,
                                                  other.shape_.width, other.shape_.height,
                                                  other.shape_.channels, other.shape_.aovs));
    // The ranges first, on a copy: what throws must leave the film as it was.
    SampleRanges merged = samples;
    for (const SampleRange& range : other.samples.ranges()) merged.add(range);

    constexpr std::size_t kPixelsAtOnce = 8192;
    const std::size_t values = std::size_t{2} * shape_.channels;
    parallelFor(counts.size(), kPixelsAtOnce, [&](std::size_t first, std::size_t end) {
        for (std::size_t i = first * values; i < end * values; i += 2) addPair(&sums[i], &other.sums[i]);
        for (std::size_t i = first; i < end; ++i) counts[i] += other.counts[i];
        const std::size_t words = shape_.splatWords();
        for (std::size_t i = first; i < end; ++i)
            addSplats(splats.data() + i * words, other.splats.data() + i * words, words);
    });
    // The lower first sample wins, so that the id plane does not depend on who is added to whom.
    const auto& mine = samples.ranges();
    const auto& theirs = other.samples.ranges();
    if (!theirs.empty() && (mine.empty() || theirs.front().first < mine.front().first))
        primitives = other.primitives;
    samples = std::move(merged);
}

double Film::sum(std::uint32_t x, std::uint32_t y, std::uint32_t channel) const {
    const std::size_t i = ((std::size_t{y} * shape_.width + x) * shape_.channels + channel) * 2;
    return sums[i] + sums[i + 1];
}

double Film::mean(std::uint32_t x, std::uint32_t y, std::uint32_t channel) const {
    const std::uint64_t n = counts[std::size_t{y} * shape_.width + x];
    const double own = n == 0 ? 0.0 : sum(x, y, channel) / static_cast<double>(n);
    if (splats.empty() || channel >= CRT_CHANNELS_BASE || samples.count() == 0) return own;
    return own + splatSum(x, y, channel) / static_cast<double>(samples.count());
}

double Film::splatSum(std::uint32_t x, std::uint32_t y, std::uint32_t channel) const {
    if (splats.empty() || channel >= CRT_CHANNELS_BASE) return 0;
    if (channel != 1) return static_cast<double>(splatUnits(*this, x, y, channel)) / shape_.splat_scale;
    __int128 units = 0;
    for (std::uint32_t r = 0; r < replicates(); ++r) units += splatUnits(*this, x, y, CRT_SPLAT_SUM_OF(r));
    return static_cast<double>(units) / shape_.splat_scale;
}

std::uint32_t FilmShape::replicates() const {
    const std::uint32_t without = channelsFor(aovs & ~(kAovReplicates | kAovColorError));
    if ((aovs & kAovReplicates) == 0 || firstSpectral() <= without) return 1;
    const std::uint32_t sums = (aovs & kAovColorError) != 0 ? 3 : 1;  // Of a replicate.
    return (firstSpectral() - without) / sums + 1;
}

double Film::replicateSum(std::uint32_t x, std::uint32_t y, std::uint32_t replicate) const {
    double splatted = 0;
    if (!splats.empty())
        splatted =
            static_cast<double>(splatUnits(*this, x, y, CRT_SPLAT_SUM_OF(replicate))) / shape_.splat_scale;
    return replicateSumOf(1, x, y, replicate) + splatted;
}

double Film::replicateSumOf(std::uint32_t component, std::uint32_t x, std::uint32_t y,
                            std::uint32_t replicate) const {
    const std::uint32_t first = firstChannel(shape_.aovs, kAovReplicates), stored = replicates() - 1;
    const auto channelOf = [&](std::uint32_t r) {
        return component == 1 ? first + r : first + stored + 2 * r + (component == 2 ? 1 : 0);
    };
    if (replicate < stored) return sum(x, y, channelOf(replicate));
    // In pairs: next to one bright sample in another replicate, this one's sum would be rounding.
    const double* pixel = &sums[(std::size_t{y} * shape_.width + x) * shape_.channels * 2];
    double rest[2] = {pixel[2 * component], pixel[2 * component + 1]};
    for (std::uint32_t r = 0; r < stored; ++r) {
        const double minus[2] = {-pixel[channelOf(r) * 2], -pixel[channelOf(r) * 2 + 1]};
        addPair(rest, minus);
    }
    return rest[0] + rest[1];
}

std::uint32_t FilmShape::splatWords() const {
    return (aovs & kAovSplats) != 0 ? CRT_SPLAT_WORDS(replicates()) : 0;
}

std::uint64_t Film::replicateSamples(std::uint32_t replicate) const {
    std::uint64_t count = 0;
    for (const SampleRange& range : samples.ranges())
        count += samplesOfReplicate(range, replicate, replicates());
    return count;
}

std::uint64_t Film::invalidSamples() const {
    const std::uint64_t asked = samples.count();
    std::uint64_t invalid = 0;
    for (const std::uint64_t n : counts) invalid += asked > n ? asked - n : 0;
    return invalid;
}

std::uint64_t Film::droppedSplats() const {
    std::uint64_t dropped = 0;
    for (std::size_t pixel = 0; pixel < counts.size(); ++pixel) dropped += droppedSplatsOf(pixel);
    return dropped;
}

std::uint64_t Film::droppedSplatsOf(std::size_t pixel) const {
    return splats.empty() ? 0 : splats[(pixel + 1) * shape_.splatWords() - 1];
}

Film cropped(const Film& film, const std::array<int, 4>& window) {
    const FilmShape& whole = film.shape();
    const auto& [x0, y0, x1, y1] = window;
    if (x0 < 0 || y0 < 0 || x0 >= x1 || y0 >= y1 || static_cast<std::uint32_t>(x1) > whole.width ||
        static_cast<std::uint32_t>(y1) > whole.height)
        throw Error(ErrorKind::Internal, "a film was cropped beyond its edge");
    FilmShape shape = whole;
    shape.width = static_cast<std::uint32_t>(x1 - x0);
    shape.height = static_cast<std::uint32_t>(y1 - y0);
    Film part(shape);
    part.samples = film.samples;
    const std::size_t left = static_cast<std::size_t>(x0), top = static_cast<std::size_t>(y0);
    const auto copyRows = [&](const auto& from, auto& to, std::size_t values_a_pixel) {
        if (from.empty()) return;
        for (std::size_t y = 0; y < shape.height; ++y) {
            const std::size_t first = (top + y) * whole.width + left;
            std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(first * values_a_pixel),
                        shape.width * values_a_pixel,
                        to.begin() + static_cast<std::ptrdiff_t>(y * shape.width * values_a_pixel));
        }
    };
    copyRows(film.sums, part.sums, std::size_t{2} * whole.channels);
    copyRows(film.counts, part.counts, 1);
    copyRows(film.primitives, part.primitives, 1);
    copyRows(film.splats, part.splats, whole.splatWords());
    return part;
}

}  // namespace crt
