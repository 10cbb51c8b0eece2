#include "compile/emission_image.h"

#include "base/parallel.h"
#include "compile/textures.h"
#include "kernel/values/texture.h"

#include <algorithm>
#include <cmath>

namespace crt {
namespace {

/// Wavelengths at which texels are looked at, two sets of four.
constexpr std::array<double, 8> kLooked_nm{430, 460, 490, 520, 550, 580, 610, 640};

/// The share of each in the brightness of light of a spectrum.
std::array<double, 8> sharesOf(const Spectrum& radiance) {
    std::array<double, 8> shares{};
    double sum = 0;
    for (std::size_t i = 0; i < shares.size(); ++i) {
        const auto at = static_cast<std::size_t>(kLooked_nm[i] - kWavelengthMin_nm);
        shares[i] = radiance[at] * (cieObserver()[0][at] + cieObserver()[1][at] + cieObserver()[2][at]);
        sum += shares[i];
    }
    for (double& share : shares) share = sum > 0 ? share / sum : 1.0 / 8;
    return shares;
}

kernel::vec4 positionsOf(std::size_t first) {
    const auto at = [&](std::size_t i) {
        return static_cast<float>(kLooked_nm[first + i] - kWavelengthMin_nm);
    };
    return kernel::make_vec4(at(0), at(1), at(2), at(3));
}

double twiceArea(const std::array<double, 2>& a, const std::array<double, 2>& b,
                 const std::array<double, 2>& c) {
    return std::abs((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]));
}

/// Of a triangle's corners, the value at a place by barycentrics.
double between(const float* corners, const std::array<double, 2>& at) {
    const auto corner = [&](std::size_t i) { return static_cast<double>(corners[i]); };
    return corner(0) * (1 - at[0] - at[1]) + corner(1) * at[0] + corner(2) * at[1];
}

}  // namespace

std::vector<Tile> tilesOf(std::uint32_t rows) {
    std::vector<Tile> tiles;
    const double step = 1.0 / rows;
    for (std::uint32_t row = 0; row < rows; ++row)
        for (std::uint32_t place = 0; place < 2 * (rows - row) - 1; ++place) {
            const double upside_down = place % 2, side = upside_down == 0 ? step : -step;
            const double b1 = (place / 2 + upside_down) * step, b2 = (row + upside_down) * step;
            tiles.push_back({CRT_TILE(rows, row, place), {{{b1, b2}, {b1 + side, b2}, {b1, b2 + side}}}});
        }
    return tiles;
}

EmissionImage::EmissionImage(const Texture& texture) : wrap_(static_cast<std::uint32_t>(texture.wrap)) {
    kernel::CrtTexture record{};
    setTransform(texture, record);
    std::transform(std::begin(record.from_uv), std::end(record.from_uv), from_uv_.begin(),
                   [](float x) { return static_cast<double>(x); });
    constexpr std::uint32_t kMostParts = 8;
    for (std::uint32_t parts = 1; parts <= kMostParts; ++parts) parts_.push_back(tilesOf(parts));
    const TextureImage& image = *texture.image;
    std::vector<std::uint16_t> words(image.words());
    image.decode(words);
    const std::array<double, 8> shares = sharesOf(texture.factor->spectrum);
    const kernel::vec4 positions[2] = {positionsOf(0), positionsOf(4)};
    Level& whole = levels_.emplace_back(Level{image.width, image.height, {}});
    whole.brightness.resize(std::size_t{image.width} * image.height);
    constexpr std::size_t kPart = std::size_t{1} << 14;
    parallelFor(whole.brightness.size(), kPart, [&](std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i) {
            double sum = 0;
            for (std::size_t half = 0; half < 2; ++half) {
                const kernel::vec4 value = kernel::crt_texel_spectrum(&words[3 * i], positions[half]);
                for (std::uint32_t l = 0; l < 4; ++l)
                    sum += shares[4 * half + l] * static_cast<double>(kernel::crt_lane(value, l));
            }
            whole.brightness[i] = static_cast<float>(sum);
        }
    });
    while (levels_.back().width > 1 || levels_.back().height > 1) {
        const Level& finer = levels_.back();
        Level next{(finer.width + 1) / 2, (finer.height + 1) / 2, {}};
        const auto of = [&](std::uint32_t x, std::uint32_t y) {
            return finer.brightness[std::size_t{std::min(y, finer.height - 1)} * finer.width +
                                    std::min(x, finer.width - 1)];
        };
        for (std::uint32_t y = 0; y < next.height; ++y)
            for (std::uint32_t x = 0; x < next.width; ++x)
                next.brightness.push_back(0.25f * (of(2 * x, 2 * y) + of(2 * x + 1, 2 * y) +
                                                   of(2 * x, 2 * y + 1) + of(2 * x + 1, 2 * y + 1)));
        levels_.push_back(std::move(next));
    }
}

std::array<double, 2> EmissionImage::placeOf(double u, double v) const {
    return {from_uv_[0] * u + from_uv_[1] * v + from_uv_[2],
            from_uv_[3] * u + from_uv_[4] * v + from_uv_[5]};
}

/// Between the four texels around the place: bright ones shine into their neighbours' tiles.
double EmissionImage::at(const Level& level, const std::array<double, 2>& place) const {
    const auto pair = [&](double s, std::uint32_t count) {
        return kernel::crt_texel_pair(static_cast<float>(s), count, wrap_, 0);
    };
    const kernel::CrtTexelPair x = pair(place[0], level.width), y = pair(place[1], level.height);
    const auto texel = [&](std::int32_t column, std::int32_t row) {
        return static_cast<double>(level.brightness[static_cast<std::size_t>(row) * level.width +
                                                    static_cast<std::size_t>(column)]);
    };
    const double fx = static_cast<double>(x.f), fy = static_cast<double>(y.f);
    return std::lerp(std::lerp(texel(x.first, y.first), texel(x.second, y.first), fx),
                     std::lerp(texel(x.first, y.second), texel(x.second, y.second), fx), fy);
}

double EmissionImage::texelsUnder(const kernel::CrtUvs& uvs) const {
    std::array<std::array<double, 2>, 3> corners{};
    for (std::size_t k = 0; k < 3; ++k)
        corners[k] = placeOf(static_cast<double>(uvs.uv[k]), static_cast<double>(uvs.uv[3 + k]));
    return 0.5 * twiceArea(corners[0], corners[1], corners[2]) * levels_[0].width * levels_[0].height;
}

/// By points in the middle of equal parts, of the image that has about a texel for each. A share of the next
/// coarser image keeps a tile from being hardly ever chosen that has a bright texel's edge between its
/// points.
double EmissionImage::mean(const kernel::CrtUvs& uvs, const TileCorners& tile) const {
    const double texels = texelsUnder(uvs) * twiceArea(tile[0], tile[1], tile[2]);
    constexpr double kCoarser = 0.1;
    const double wanted = std::ceil(2 * std::sqrt(texels)), most = static_cast<double>(parts_.size());
    const std::vector<Tile>& parts = parts_[static_cast<std::size_t>(std::clamp(wanted, 2.0, most)) - 1];
    const double coarser = std::ceil(std::log2(std::max(wanted / most, 1.0)));
    const auto level = [&](double number) -> const Level& {
        return levels_[std::min(static_cast<std::size_t>(number), levels_.size() - 1)];
    };
    double sum = 0;
    for (const Tile& part : parts) {
        std::array<double, 2> middle{};
        for (const auto& [b1, b2] : part.at)
            for (std::size_t k = 0; k < 2; ++k)
                middle[k] +=
                    (tile[0][k] + b1 * (tile[1][k] - tile[0][k]) + b2 * (tile[2][k] - tile[0][k])) / 3;
        const std::array<double, 2> place = placeOf(between(uvs.uv, middle), between(uvs.uv + 3, middle));
        sum += std::lerp(at(level(coarser), place), at(level(coarser + 1), place), kCoarser);
    }
    return sum / static_cast<double>(parts.size());
}

}  // namespace crt
