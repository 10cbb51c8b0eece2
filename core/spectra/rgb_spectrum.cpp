/// RGB → smooth spectrum (sigmoid.h). A scene has a handful of colours, so they are solved for when the
/// scene is read, to the last digit.
#include "base/error.h"
#include "spectra/sigmoid.h"
#include "spectra/spectra.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace crt {
Spectrum rgbReflectance(const Vec3d& linear_srgb) {
    for (const double v : linear_srgb)
        if (!(v >= 0.0 && v <= 1.0))
            throw Error(ErrorKind::Scene,
                        fmt::format("a reflectance colour must lie in [0, 1], not [{}, {}, {}]",
                                    linear_srgb[0], linear_srgb[1], linear_srgb[2]));
    if (linear_srgb[0] == linear_srgb[1] && linear_srgb[1] == linear_srgb[2])
        return constantSpectrum(linear_srgb[0]);
    return sigmoidSpectrum(fittedSigmoid(linear_srgb));
}

Spectrum rgbEmission(const Vec3d& linear_srgb) {
    for (const double v : linear_srgb)
        if (!(v >= 0.0) || !std::isfinite(v))
            throw Error(ErrorKind::Scene,
                        fmt::format("an emission colour must be finite and not negative, not [{}, {}, {}]",
                                    linear_srgb[0], linear_srgb[1], linear_srgb[2]));
    // Half of the range: the sigmoid is smoothest there, and a light has no upper bound that would ask for
    // more.
    const double scale = 2.0 * *std::max_element(linear_srgb.begin(), linear_srgb.end());
    if (scale == 0.0) return constantSpectrum(0.0);
    Spectrum s = rgbReflectance({linear_srgb[0] / scale, linear_srgb[1] / scale, linear_srgb[2] / scale});
    const Spectrum d65 = *illuminantSpectrum("D65");
    for (std::size_t i = 0; i < s.values.size(); ++i) s[i] *= scale * d65[i];
    return s;
}

}  // namespace crt
