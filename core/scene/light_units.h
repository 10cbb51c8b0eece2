/// Converts lumens, candelas and lux to spectra, and computes the solid angles of lights.
#pragma once

#include "spectra/spectra.h"

namespace crt {

/// Luminous efficacy of radiation at 555 nm, lm/W: of the candela's definition (683 lm/W at 540 THz), for
/// the tabulated ȳ(λ) (CIE 15:2018, 7.1).
inline constexpr double kLuminousEfficacy_lm_W = 683.002;

/// Luminance of a film's value Y of 1, cd/m²: Y is ∫L ȳ dλ / ∫ȳ dλ, a mean spectral radiance.
double luminanceOfUnitY_cd_m2();

/// Photometric value of a spectral quantity: lumens of W·nm⁻¹, lux of W·m⁻²·nm⁻¹.
double photometric(const Spectrum& spectral);

/// ∫ over 360–830 nm: watts of W·nm⁻¹.
double integralOverWavelengths(const Spectrum& spectral);

/// 1 − cos without cancellation.
double oneMinusCos(double degrees);

/// Solid angle that a spot of even radiant intensity would fill to have its flux: that of the cone without
/// its penumbra, and half of the penumbra's, over which Hermite's cubic of the cosine has its mean ½.
double spotSolidAngle_sr(double cone_angle_deg, double penumbra_deg);

/// ∫ cos θ dω over a disk of that diameter, of which the axis is the normal: irradiance over radiance.
double sunProjectedSolidAngle_sr(double angular_diameter_deg);

}  // namespace crt
