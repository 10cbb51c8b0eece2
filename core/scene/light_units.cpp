#include "scene/light_units.h"

#include <cmath>
#include <numbers>

namespace crt {
namespace {

double sineOf(double degrees) { return std::sin(degrees * (std::numbers::pi / 180)); }

}  // namespace

double oneMinusCos(double degrees) {
    const double sine = sineOf(degrees / 2);
    return 2 * sine * sine;
}

double luminanceOfOne_cd_m2() { return kLuminousEfficacy_lm_W * cieYIntegral(); }

double photometric(const Spectrum& spectral) {
    return luminanceOfOne_cd_m2() * spectrumToXyz(spectral)[1];
}

double integralOverWavelengths(const Spectrum& spectral) {
    double sum = -0.5 * (spectral.values.front() + spectral.values.back());
    for (const double value : spectral.values) sum += value;
    return sum;
}

double spotSolidAngle_sr(double cone_angle_deg, double penumbra_deg) {
    const double bright = oneMinusCos(cone_angle_deg - penumbra_deg), whole = oneMinusCos(cone_angle_deg);
    return 2 * std::numbers::pi * (bright + (whole - bright) / 2);
}

double sunProjectedSolidAngle_sr(double angular_diameter_deg) {
    const double sine = sineOf(angular_diameter_deg / 2);
    return std::numbers::pi * sine * sine;
}

}  // namespace crt
