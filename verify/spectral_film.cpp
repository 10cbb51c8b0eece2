// Group E, the part about what instruments see of the light: bins of wavelengths and responses of sensors.
#include "verify/context.h"
#include "verify/scenes.h"

#include "kernel/dialect/features.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace crt::verify {
namespace {

constexpr std::uint64_t kMeasured = CRT_FEATURE_SPECTRAL_FILM | CRT_FEATURE_ENVIRONMENT;

/// Constant light from everywhere, on a film with `instruments`.
std::string measured(const std::string& radiance, const std::string& instruments) {
    return Stage("{position: [0, 0, 0], target: [0, 0, 1], fov: 1}")
        .set("film", fmt::format("{{resolution: [4, 4], {}}}", instruments))
        .set("environment", fmt::format("{{radiance: {}}}", radiance))
        .yaml();
}

/// Linear between nanometres.
double onGrid(const Spectrum& s, double nm) {
    const double position = nm - kWavelengthMin_nm;
    const auto i = std::min(static_cast<std::size_t>(position), static_cast<std::size_t>(kSpectrumSize - 2));
    return s[i] + (position - static_cast<double>(i)) * (s[i + 1] - s[i]);
}

/// ∫ f dλ by midpoints 0.01 nm apart, none of them at a node of the tables.
template <class Function>
double integral(double from_nm, double to_nm, const Function& f) {
    const auto steps = static_cast<int>(std::lround((to_nm - from_nm) * 100));
    const double step = (to_nm - from_nm) / steps;
    double sum = 0;
    for (int k = 0; k < steps; ++k) sum += f(from_nm + (k + 0.5) * step);
    return sum * step;
}

Quantity binned(const std::string& what, std::uint32_t which, double expected) {
    return {what, [which](const std::vector<Film>& films) { return meanOfBin(films[0], which); },
            expected};
}

constexpr const char* kWarm = "{blackbody: 2700, scale: 3}";
Spectrum warm() {
    Spectrum s = blackbodySpectrum(2700, true);
    for (double& value : s.values) value *= 3;
    return s;
}

void bins(Context& context) {
    constexpr double kFrom = 405.5, kTo = 725.5;
    constexpr std::uint32_t kBins = 8;
    const std::string film =
        fmt::format("spectral: {{from_nm: {}, to_nm: {}, bins: {}}}", kFrom, kTo, kBins);
    const Spectrum lamp = warm();
    std::vector<Quantity> flat, coloured;
    for (std::uint32_t bin = 0; bin < kBins; ++bin) {
        const double width = (kTo - kFrom) / kBins, lower = kFrom + bin * width;
        flat.push_back(binned(fmt::format("radiance 1, {} to {} nm", lower, lower + width), bin, 1));
        coloured.push_back(
            binned(fmt::format("2700 K, {} to {} nm", lower, lower + width), bin,
                   integral(lower, lower + width, [&](double nm) { return onGrid(lamp, nm); }) / width));
    }
    const Effort effort{.samples = 256, .most = 16384};
    context.estimate(flat, {measured("1", film)}, 0.004, effort);
    context.estimate(coloured, {measured(kWarm, film)}, 0.004, effort);

    // The bins of a film are of the samples of its X, Y and Z: their sum, each times the observer's mean in
    // it, can be off by no more than the observer varies within a bin.
    for (const std::uint32_t count : {94u, 470u}) {
        const Film both = context.render(
            measured(kWarm, fmt::format("spectral: {{from_nm: 360, to_nm: 830, bins: {}}}", count)),
            samples(64));
        const auto& observer = cieObserver();
        double worst = 0;
        for (std::size_t c = 0; c < 3; ++c)
            for (std::uint32_t x = 0; x < 4; ++x) {
                double sum = 0, bound = 1e-6 * both.mean(x, 0, static_cast<std::uint32_t>(c));
                for (std::uint32_t bin = 0; bin < count; ++bin) {
                    const double width = 470.0 / count, lower = 360 + bin * width;
                    double least = 1e9, most = 0;
                    for (int k = 0; k <= 100; ++k) {
                        const double value = onGrid(observer[c], lower + width * k / 100);
                        least = std::min(least, value);
                        most = std::max(most, value);
                    }
                    const double mean =
                        integral(lower, lower + width,
                                 [&](double nm) { return onGrid(observer[c], nm); }) / width;
                    const double power =
                        both.mean(x, 0, both.shape().firstSpectral() + bin) * width / cieYIntegral();
                    sum += power * mean;
                    bound += power * std::max(most - mean, mean - least);
                }
                const double off = std::abs(sum - both.mean(x, 0, static_cast<std::uint32_t>(c)));
                worst = fartherFrom(0, worst, off / bound);
            }
        context.holds(fmt::format("{} bins from 360 to 830 nm, seen by the observer, are X, Y and Z", count),
                      worst <= 1, "within the observer's range in each bin",
                      "bins hold other samples than X, Y and Z, or lie elsewhere",
                      fmt::format("at worst {:.3f} of the bound", worst));
    }
}

std::string tableOf(const Spectrum& s) {
    std::string nm, value;
    for (std::size_t i = 0; i < kSpectrumSize; ++i) {
        nm += fmt::format("{}{}", i == 0 ? "" : ", ", kWavelengthMin_nm + static_cast<int>(i));
        value += fmt::format("{}{}", i == 0 ? "" : ", ", s[i]);
    }
    return fmt::format("{{table: {{nm: [{}], value: [{}]}}}}", nm, value);
}

void responses(Context& context) {
    const Spectrum lamp = warm();
    const Spectrum& luminous = cieObserver()[1];
    Spectrum blue, red;  // A bell, and a filter with a steep edge.
    for (std::size_t i = 0; i < kSpectrumSize; ++i) {
        const double nm = kWavelengthMin_nm + static_cast<double>(i);
        blue[i] = std::exp(-(nm - 450) * (nm - 450) / 800);
        red[i] = nm < 600 ? 0 : nm < 700 ? 2.5 : 0.5;
    }
    const auto film = [&](bool normalise) {
        return fmt::format("responses: {{y: {}, blue: {}, red: {}}}, normalise_responses: {}",
                           tableOf(luminous), tableOf(blue), tableOf(red), normalise);
    };
    const Film with_y = context.render(measured(kWarm, film(true)), samples(16));
    double worst = 1;
    for (std::uint32_t y = 0; y < 4; ++y)
        for (std::uint32_t x = 0; x < 4; ++x)
            worst = fartherFrom(1, worst,
                                with_y.mean(x, y, with_y.shape().firstSpectral()) / with_y.mean(x, y, 1));
    context.relative("a sensor that answers as the observer does, over Y", worst, 1, 1e-6);

    for (const bool normalise : {true, false}) {
        std::vector<Quantity> flat, coloured;
        for (const auto& [which, response] : {std::pair{1u, &blue}, std::pair{2u, &red}}) {
            const auto answer = [&, r = response](double nm) { return onGrid(*r, nm); };
            const double whole = integral(360, 830, answer), unit = normalise ? whole : 1;
            const char* const name = which == 1 ? "bell" : "edge";
            const char* const by = normalise ? "" : ", not normalised";
            flat.push_back(binned(fmt::format("radiance 1, a {}{}", name, by), which, whole / unit));
            coloured.push_back(
                binned(fmt::format("2700 K, a {}{}", name, by), which,
                       integral(360, 830, [&](double nm) { return onGrid(lamp, nm) * answer(nm); }) / unit));
        }
        const Effort effort{.samples = 256, .most = 16384};
        context.estimate(flat, {measured("1", film(normalise))}, 0.004, effort);
        context.estimate(coloured, {measured(kWarm, film(normalise))}, 0.004, effort);
    }
}

}  // namespace

std::vector<Case> spectralFilmCases() {
    return {
        row("E22", "spectral-film",
            "Light of radiance 1 and of 2700 K in 8 bins; 94 and 470 bins seen by the observer",
            "mean radiance of each bin; X, Y and Z within the observer's range in a bin",
            "integrals in double; the same samples", "± 0.4 %; an exact bound", Level::Commit, kMeasured,
            bins),
        row("E23", "sensor-responses", "Sensors: the observer's ȳ, a bell, a filter with a steep edge",
            "Y of the image; ∫ L r dλ / ∫ r dλ, or ∫ L r dλ",
            "the same samples; integrals in double", "1e-6; ± 0.4 %", Level::Commit, kMeasured, responses),
    };
}

}  // namespace crt::verify
