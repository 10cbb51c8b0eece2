#include "film.h"

#include "error_estimate.h"
#include "image_metadata.h"
#include "kernel/layout.h"
#include "stats/luminance_error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace crt {
namespace {

static_assert(Film::kReplicates == CRT_REPLICATES);
static_assert(kAovAlbedo == CRT_AOV_ALBEDO && kAovNormal == CRT_AOV_NORMAL && kAovDepth == CRT_AOV_DEPTH &&
                  kAovPrimitive == CRT_AOV_PRIMITIVE && kAovReplicates == CRT_AOV_REPLICATES,
              "the film's AOV bits are the kernel's");

/// a + b = sum + error exactly (Knuth 1969, TAOCP 2, 4.2.2). Needs no |a| ≥ |b|.
void twoSum(double a, double b, double& sum, double& error) {
    sum = a + b;
    const double b_part = sum - a;
    error = (a - (sum - b_part)) + (b - b_part);
}

/// pair += other, to about 2^-104 of the larger (Joldes, Muller and Popescu 2017, algorithm 6, with the branch-free two-sum throughout because
/// a backend's pairs need not be normalised).
void addPair(double* pair, const double* other) {
    double high, high_error, low, low_error;
    twoSum(pair[0], other[0], high, high_error);
    twoSum(pair[1], other[1], low, low_error);
    twoSum(high, high_error + low, high, low);
    twoSum(high, low + low_error, pair[0], pair[1]);
}

/// First film channel of an AOV; the order is the kernel's: albedo, normal, depth, replicates, each only when asked for.
std::uint32_t firstChannel(std::uint32_t aovs, std::uint32_t aov) {
    std::uint32_t channel = CRT_CHANNELS_BASE;
    if (aov == kAovAlbedo) return channel;
    if (aovs & kAovAlbedo) channel += 3;
    if (aov == kAovNormal) return channel;
    if (aovs & kAovNormal) channel += 3;
    if (aov == kAovDepth) return channel;
    if (aovs & kAovDepth) channel += 1;
    return channel;
}

std::uint32_t channelsFor(std::uint32_t aovs) {
    return firstChannel(aovs, kAovReplicates) + ((aovs & kAovReplicates) ? CRT_REPLICATES : 0);
}

/// Samples of `range` that belong to a replicate: its turn is one block in every round of all replicates.
std::uint64_t samplesOfReplicate(SampleRange range, std::uint64_t replicate) {
    constexpr std::uint64_t kBlock = CRT_REPLICATE_BLOCK, kRound = kBlock * CRT_REPLICATES;
    const auto below = [=](std::uint64_t end) {
        const std::uint64_t begin_of_turn = std::min(end % kRound, replicate * kBlock);
        return end / kRound * kBlock + std::min(end % kRound - begin_of_turn, kBlock);
    };
    return below(range.second) - below(range.first);
}

std::string rangeText(SampleRange range) { return fmt::format("{}-{}", range.first, range.second); }

const char* spaceName(ColorSpace space) {
    switch (space) {
        case ColorSpace::LinearSrgb: return "lin_rec709_scene";
        case ColorSpace::AcesCg: return "lin_ap1_scene";
        case ColorSpace::Xyz: break;
    }
    return "lin_ciexyzd65_scene";
}

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
    const auto next = std::lower_bound(ranges_.begin(), ranges_.end(), range.second,
                                       [](const SampleRange& r, std::uint64_t end) { return r.first < end; });
    const auto before = next == ranges_.begin() ? ranges_.end() : std::prev(next);
    if (before != ranges_.end() && before->second > range.first)
        throw Error(ErrorKind::Usage, fmt::format("samples {} overlap samples {}, which are already there: the same samples "
                                                  "would count twice", rangeText(range), rangeText(*before)));
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

Film::Film(FilmShape shape) : shape_(shape) {
    if (shape.channels != channelsFor(shape.aovs))
        throw Error(ErrorKind::Internal, fmt::format("a film with AOV mask {:#x} has {} channels, not {}", shape.aovs,
                                                     channelsFor(shape.aovs), shape.channels));
    const std::size_t pixels = std::size_t{shape.width} * shape.height;
    sums.assign(pixels * shape.channels * 2, 0.0);
    counts.assign(pixels, 0);
    if (shape.aovs & kAovPrimitive) primitives.assign(pixels, CRT_NONE);
}

void Film::add(const Film& other) {
    if (!(shape_ == other.shape_))
        throw Error(ErrorKind::Usage,
                    fmt::format("films differ in shape: {}×{} with {} channels and AOV mask {:#x}, and {}×{} with {} channels and "
                                "AOV mask {:#x}",
                                shape_.width, shape_.height, shape_.channels, shape_.aovs, other.shape_.width, other.shape_.height,
                                other.shape_.channels, other.shape_.aovs));
    // The ranges first, on a copy: what throws must leave the film as it was.
    SampleRanges merged = samples;
    for (const SampleRange& range : other.samples.ranges()) merged.add(range);

    for (std::size_t i = 0; i < sums.size(); i += 2) addPair(&sums[i], &other.sums[i]);
    for (std::size_t i = 0; i < counts.size(); ++i) counts[i] += other.counts[i];
    // The lower first sample wins, so that the id plane does not depend on who is added to whom.
    const auto& mine = samples.ranges();
    const auto& theirs = other.samples.ranges();
    if (!theirs.empty() && (mine.empty() || theirs.front().first < mine.front().first)) primitives = other.primitives;
    samples = std::move(merged);
}

double Film::sum(std::uint32_t x, std::uint32_t y, std::uint32_t channel) const {
    const std::size_t i = ((std::size_t{y} * shape_.width + x) * shape_.channels + channel) * 2;
    return sums[i] + sums[i + 1];
}

double Film::mean(std::uint32_t x, std::uint32_t y, std::uint32_t channel) const {
    const std::uint64_t n = counts[std::size_t{y} * shape_.width + x];
    return n == 0 ? 0.0 : sum(x, y, channel) / static_cast<double>(n);
}

double Film::replicateSum(std::uint32_t x, std::uint32_t y, std::uint32_t replicate) const {
    return sum(x, y, firstChannel(shape_.aovs, kAovReplicates) + replicate);
}

std::uint64_t Film::replicateSamples(std::uint32_t replicate) const {
    std::uint64_t count = 0;
    for (const SampleRange& range : samples.ranges()) count += samplesOfReplicate(range, replicate);
    return count;
}

std::uint64_t Film::invalidSamples() const {
    const std::uint64_t asked = samples.count();
    std::uint64_t invalid = 0;
    for (const std::uint64_t n : counts) invalid += asked > n ? asked - n : 0;
    return invalid;
}

Image resolveImage(const Film& film, const Scene& scene, std::uint32_t aovs) {
    const FilmShape& shape = film.shape();
    constexpr std::uint32_t kInFilm = kAovAlbedo | kAovNormal | kAovDepth | kAovPrimitive;
    if (const std::uint32_t missing = aovs & kInFilm & ~shape.aovs; missing != 0) {
        const char* name = missing & kAovAlbedo ? "albedo" : missing & kAovNormal ? "normal" : missing & kAovDepth ? "depth" : "primitive";
        throw Error(ErrorKind::Usage, fmt::format("an output asks for the {} plane, but the film was rendered without it", name));
    }

    const ColorSpace space = scene.film.color_space;
    const double exposure = std::exp2(scene.film.exposure_ev);
    const Matrix3d to_rgb = xyzToRgb(space);
    Matrix3d color = to_rgb;
    // To D65 in every space: it is the white of sRGB, xyzToRgb takes it to ACEScg's own, and an XYZ image then still becomes the sRGB one by
    // the standard matrix.
    if (scene.film.white_balance) {
        Vec3d white = spectrumToXyz(*scene.film.white_balance);
        const double luminance = white[1];
        if (!(luminance > 0)) throw Error(ErrorKind::Scene, "the white balance illuminant has no visible light", {scene.file});
        for (double& component : white) component /= luminance;
        color = multiply(color, bradfordAdaptation(white, d65WhiteXyz()));
    }
    for (Vec3d& row : color)
        for (double& entry : row) entry *= exposure;
    // The film has the noise of Y alone, and a white balance mixes X, Y and Z: what becomes of that noise is
    // known where it changes brightness and not colour. Then the relative error of luminance stays what it
    // was.
    const stats::Rgb luminance_weights = stats::luminanceWeights(space);
    const auto luminanceGain = [&](const Vec3d& xyz) {
        if (!scene.film.white_balance || !(xyz[1] > 0)) return exposure;
        return std::abs(stats::luminance(multiply(color, xyz), luminance_weights)) / xyz[1];
    };
    // Albedo is a reflectance: the film has it as XYZ under equal-energy light, and a perfect white must come out as (1,1,1) in the RGB spaces
    // whatever the exposure and white balance.
    const Matrix3d albedo_color = multiply(to_rgb, bradfordAdaptation({1, 1, 1}, d65WhiteXyz()));

    Image image;
    image.width = shape.width;
    image.height = shape.height;
    image.channels = {"R", "G", "B"};
    if (aovs & kAovAlbedo) image.channels.insert(image.channels.end(), {"Albedo.R", "Albedo.G", "Albedo.B"});
    if (aovs & kAovNormal) image.channels.insert(image.channels.end(), {"Ns.X", "Ns.Y", "Ns.Z"});
    if (aovs & kAovDepth) image.channels.emplace_back("Z");
    if (aovs & kAovVariance) image.channels.emplace_back("Variance.Y");
    if (aovs & kAovError) image.channels.emplace_back("StdError.Y");
    if (aovs & kAovPrimitive) image.integer_channels.emplace_back("id.primitive");
    if (aovs & kAovSamples) image.integer_channels.emplace_back("sampleCount");

    const LuminanceVariance variance(film);
    const std::size_t pixels = std::size_t{shape.width} * shape.height;
    image.pixels.reserve(pixels * image.channels.size());
    image.integers.reserve(pixels * image.integer_channels.size());
    const auto append = [&image](const Vec3d& v) {
        for (const double component : v) image.pixels.push_back(static_cast<float>(component));
    };
    for (std::uint32_t y = 0; y < shape.height; ++y)
        for (std::uint32_t x = 0; x < shape.width; ++x) {
            const auto triple = [&](std::uint32_t c) { return Vec3d{film.mean(x, y, c), film.mean(x, y, c + 1), film.mean(x, y, c + 2)}; };
            const std::size_t pixel = std::size_t{y} * shape.width + x;
            append(multiply(color, triple(0)));
            if (aovs & kAovAlbedo) append(multiply(albedo_color, triple(firstChannel(shape.aovs, kAovAlbedo))));
            if (aovs & kAovNormal) append(triple(firstChannel(shape.aovs, kAovNormal)));
            if (aovs & kAovDepth)
                image.pixels.push_back(static_cast<float>(film.mean(x, y, firstChannel(shape.aovs, kAovDepth))));
            if (aovs & (kAovVariance | kAovError)) {
                const double error = std::sqrt(variance(x, y)) * luminanceGain(triple(0));
                if (aovs & kAovVariance) image.pixels.push_back(static_cast<float>(error * error));
                if (aovs & kAovError) image.pixels.push_back(static_cast<float>(error));
            }
            if (aovs & kAovPrimitive) image.integers.push_back(film.primitives[pixel]);
            if (aovs & kAovSamples)
                image.integers.push_back(static_cast<std::uint32_t>(
                    std::min<std::uint64_t>(film.counts[pixel], std::numeric_limits<std::uint32_t>::max())));
        }

    image.chromaticities = chromaticities(space);
    // What the film and the scene know of themselves; who rendered it, where and when is for the caller to add.
    image.metadata = {{"colorInteropID", spaceName(space)},
                      {"crt/spp", std::to_string(film.samples.count())},
                      {"crt/sampleRanges", film.samples.text()},
                      {"crt/seed", std::to_string(scene.sampler.seed)},
                      {kExposureKey, fmt::format("{}", scene.film.exposure_ev)},
                      {kWhiteBalanceKey, whiteBalanceText(scene)},
                      {"crt/invalidSamples", std::to_string(film.invalidSamples())}};
    if ((aovs & (kAovVariance | kAovError)) && variance.degreesOfFreedom() >= 1)
        image.metadata.emplace_back(kErrorDofKey, fmt::format("{:.6g}", variance.degreesOfFreedom()));
    const auto& crop = scene.film.crop;
    if (crop != std::array<int, 4>{0, 0, 0, 0})
        image.metadata.emplace_back("crt/crop", fmt::format("{},{},{},{} of {}x{}", crop[0], crop[1], crop[2], crop[3], scene.film.width,
                                                            scene.film.height));
    return image;
}

}  // namespace crt
