#include "compile/distributions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>
#include <optional>

namespace crt {
namespace {

/// Nodes of the inverse of the distribution with this density on [lower, upper], by trapezoids on `steps`
/// intervals.
std::vector<double> inverseDistribution(const std::function<double(double)>& density, double lower,
                                        double upper, std::size_t steps, std::size_t cells) {
    const double width = (upper - lower) / static_cast<double>(steps);
    std::vector<double> cumulative(steps + 1, 0.0);
    for (std::size_t i = 0; i < steps; ++i) {
        const double x = lower + width * static_cast<double>(i);
        cumulative[i + 1] = cumulative[i] + 0.5 * (density(x) + density(x + width)) * width;
    }
    std::vector<double> nodes(cells + 1);
    for (std::size_t k = 0; k <= cells; ++k) {
        const double wanted = cumulative.back() * static_cast<double>(k) / static_cast<double>(cells);
        const auto above = std::upper_bound(cumulative.begin(), cumulative.end(), wanted);
        const auto i = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(
            above - cumulative.begin() - 1, 0, static_cast<std::ptrdiff_t>(steps) - 1));
        const double span = cumulative[i + 1] - cumulative[i];
        nodes[k] = lower + width * (static_cast<double>(i) +
                                    (span > 0 ? std::min(1.0, (wanted - cumulative[i]) / span) : 0.0));
    }
    nodes.front() = lower;
    nodes.back() = upper;
    return nodes;
}

std::vector<float> toFloat(const std::vector<double>& values) { return {values.begin(), values.end()}; }

double gaussian(double x, double sigma) { return std::exp(-x * x / (2 * sigma * sigma)); }

/// Four-term Blackman–Harris window over [−radius, radius] (Harris 1978, minimum 4-term).
double blackmanHarris(double x, double radius) {
    const double t = std::numbers::pi * (x / radius + 1);
    return 0.35875 - 0.48829 * std::cos(t) + 0.14128 * std::cos(2 * t) - 0.01168 * std::cos(3 * t);
}

}  // namespace

namespace {

/// From the first to the last wavelength that bins or responses measure; nothing where there are none.
std::optional<std::array<double, 2>> measuredRange_nm(const SpectralFilm& film) {
    std::optional<std::array<double, 2>> range;
    const auto extend = [&](double from_nm, double to_nm) {
        range = range ? std::array{std::min((*range)[0], from_nm), std::max((*range)[1], to_nm)}
                      : std::array{from_nm, to_nm};
    };
    if (film.bins.count > 0) extend(film.bins.from_nm, film.bins.to_nm);
    for (const SensorResponse& response : film.responses)
        for (std::size_t i = 0; i + 1 < kSpectrumSize; ++i)
            if (response.spectrum[i] > 0 || response.spectrum[i + 1] > 0)
                extend(kWavelengthMin_nm + static_cast<double>(i),
                       kWavelengthMin_nm + static_cast<double>(i + 1));
    return range;
}

}  // namespace

// (x̄ + ȳ + z̄)^0.4: docs/decisions/0008-wavelengths.md says why not x̄ + ȳ + z̄ itself.
std::vector<float> wavelengthTable(std::size_t cells, const SpectralFilm& film) {
    const auto& cie = cieObserver();
    const auto density = [&](double wavelength_nm) {
        const double position =
            std::clamp(wavelength_nm - kWavelengthMin_nm, 0.0, static_cast<double>(kSpectrumSize - 1));
        const auto i =
            std::min(static_cast<std::size_t>(position), static_cast<std::size_t>(kSpectrumSize - 2));
        const double f = position - static_cast<double>(i);
        double sum = 0;
        for (const Spectrum& s : cie) sum += s[i] + f * (s[i + 1] - s[i]);
        return std::pow(sum, 0.4);
    };
    constexpr std::size_t kSteps = 4 * (kSpectrumSize - 1);
    const auto table = [&](const std::function<double(double)>& wanted) {
        return toFloat(inverseDistribution(wanted, kWavelengthMin_nm, kWavelengthMax_nm, kSteps, cells));
    };
    const auto measured = measuredRange_nm(film);
    if (!measured) return table(density);
    const auto [from_nm, to_nm] = *measured;
    const double step = static_cast<double>(kSpectrumSize - 1) / static_cast<double>(kSteps);
    double seen = 0;
    for (std::size_t i = 0; i < kSteps; ++i)
        seen += density(kWavelengthMin_nm + step * (static_cast<double>(i) + 0.5)) * step;
    return table([&, from = from_nm, to = to_nm](double nm) {
        return density(nm) / seen + (nm >= from && nm <= to ? 1 / (to - from) : 0.0);
    });
}

std::vector<float> observerTable(std::size_t stride) {
    const auto& cie = cieObserver();
    std::vector<float> table;
    for (std::size_t i = 0; i < stride; ++i) {
        const std::size_t nm = std::min<std::size_t>(i, kSpectrumSize - 1);
        for (const Spectrum& s : cie) table.push_back(static_cast<float>(s[nm] / cieYIntegral()));
        table.push_back(0.0f);
    }
    return table;
}

std::vector<float> filterTable(const FilmSettings& film, std::size_t octaves, std::size_t steps) {
    const double radius = film.filter_radius;
    std::function<double(double)> filter;
    switch (film.filter) {
        case PixelFilter::Box:
            if (radius == 0.5) return {};
            filter = [](double) { return 1.0; };
            break;
        case PixelFilter::Gaussian:
            filter = [sigma = film.filter_sigma, edge = gaussian(radius, film.filter_sigma)](double x) {
                return std::max(0.0, gaussian(x, sigma) - edge);
            };
            break;
        case PixelFilter::BlackmanHarris:
            filter = [radius](double x) { return std::max(0.0, blackmanHarris(x, radius)); };
            break;
    }
    // Summed from the edge inwards, so that the tail keeps its digits.
    constexpr std::size_t kIntervals = std::size_t{1} << 16;
    const double width = radius / static_cast<double>(kIntervals);
    const auto at = [&](std::size_t i) { return radius - width * static_cast<double>(i); };
    std::vector<double> beyond(kIntervals + 1, 0.0);
    for (std::size_t i = 0; i < kIntervals; ++i)
        beyond[i + 1] = beyond[i] + 0.5 * (filter(at(i)) + filter(at(i + 1))) * width;
    const auto distance = [&](double share) {
        const double wanted = share * beyond.back();
        const auto above = std::upper_bound(beyond.begin(), beyond.end(), wanted);
        if (above == beyond.end()) return 0.0;
        const auto i = static_cast<std::size_t>(above - beyond.begin()) - 1;
        return at(i) - width * (wanted - beyond[i]) / (beyond[i + 1] - beyond[i]);
    };
    std::vector<float> table;
    for (std::size_t octave = 0; octave < octaves; ++octave)
        for (std::size_t step = 0; step < steps; ++step) {
            const double share = 1 - 0.5 * static_cast<double>(step) / static_cast<double>(steps);
            table.push_back(static_cast<float>(distance(std::ldexp(share, -static_cast<int>(octave)))));
        }
    table.push_back(static_cast<float>(distance(std::ldexp(0.5, -static_cast<int>(octaves)))));
    return table;
}

std::vector<std::uint64_t> choiceTable(const std::vector<double>& weights) {
    std::vector<std::uint64_t> first{0};
    if (weights.empty()) return first;
    constexpr std::uint64_t kAll = std::uint64_t{1} << 32;
    const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
    // One each, and of the rest what the weights so far are worth. Rounding each share by itself could give
    // away more than there is.
    const auto rest = static_cast<double>(kAll - weights.size());
    double sum = 0;
    for (const double w : weights) {
        sum += w;
        first.push_back(first.size() + static_cast<std::uint64_t>(rest * (sum / total)));
    }
    return first;
}

}  // namespace crt
