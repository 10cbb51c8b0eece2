#include "film/auto_exposure.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace crt {
namespace {

/// Of every pixel with light, in the order of the film.
template <class Visit>
void visitLuminances(const Film& film, const Visit& visit) {
    for (std::uint32_t y = 0; y < film.shape().height; ++y)
        for (std::uint32_t x = 0; x < film.shape().width; ++x)
            if (const double luminance = film.mean(x, y, 1); luminance > 0 && std::isfinite(luminance))
                visit(luminance);
}

}  // namespace

std::optional<double> autoExposure_ev(const Film& film) {
    constexpr double kGrey = 0.18, kDarkest = 1e-3;
    double sum = 0, log_sum = 0, count = 0;
    visitLuminances(film, [&](double luminance) { sum += luminance; });
    const double pixels = static_cast<double>(film.shape().width) * film.shape().height;
    const double least = kDarkest * sum / pixels;
    visitLuminances(film, [&](double luminance) {
        if (luminance < least) return;
        log_sum += std::log2(luminance);
        ++count;
    });
    if (count == 0) return std::nullopt;
    const double stops = std::log2(kGrey) - log_sum / count;
    return std::clamp(std::round(stops * 100) / 100, -100.0, 100.0);
}

}  // namespace crt
