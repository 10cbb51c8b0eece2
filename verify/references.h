/// The expected values of the cases, computed in double from closed forms and deterministic quadrature.
#pragma once

#include "spectra/spectra.h"

#include <array>
#include <complex>
#include <functional>
#include <numbers>
#include <vector>

namespace crt::verify {

inline constexpr double kPi = std::numbers::pi;
inline constexpr double kDegree = kPi / 180;  ///< In radians.

/// Form factor of a polygon seen from a point with a unit normal: the share of the Lambertian's hemisphere
/// that it fills, irradiance over π·radiance. Lambert's formula (1760): (1/2π) Σ Θᵢ Γᵢ·n over the
/// edges, after cutting off what lies below the horizon. The polygon is flat and convex; its sense does not
/// matter.
double polygonFormFactor(const Vec3d& point, const Vec3d& normal, const std::vector<Vec3d>& polygon);

/// The same of an axis-parallel square of half side `half_side` at height 1 over a horizontal point, its
/// centre at horizontal offset x: the sum of corner rectangles, F(a, b) = (1/2π) (A atan B + …) (Howell,
/// "A Catalog of Radiation Heat Transfer Configuration Factors", B-3). A second route to the same number.
double squareFormFactor(double x, double half_side);

/// The same between two rectangles that stand on each other at a right angle with a common edge of length 1:
/// from the one that reaches `depth` away from the edge to the one that reaches `height` (Howell, C-14).
double perpendicularFormFactor(double depth, double height);

/// ∫∫ f(u, v) over [u0, u1] × [v0, v1], Gauss–Legendre of 30 × 30 points on `panels` × `panels`
/// panels.
double rectangleIntegral(const std::function<double(double, double)>& f, double u0, double u1, double v0,
                         double v1, int panels = 4);

/// E (1 − ρ^(k+1)) / (1 − ρ) for E = 1: radiance in a closed room whose walls emit 1 and reflect ρ,
/// after k scattering events. ρ > 0, not 1.
double furnaceRadiance(double albedo, int depth);

/// Unpolarised reflectance of a smooth interface; eta is the index beyond over the index before. 1 in total
/// internal reflection.
double fresnelDielectric(double cos_incidence, double eta);

/// The same of a metal of index n + ik, in complex arithmetic.
double fresnelConductor(double cosine, double n, double k);

/// The share of light from everywhere that a metal of index n + ik and GGX microfacets of width
/// α = roughness² scatters towards a view at `cosine`, each ray mirrored once: quadrature over the normals
/// of Fresnel's reflectance times Smith's height-correlated shadowing (Heitz 2014), in double. 1 bounce
/// loses light: even of a perfect metal it is below 1.
double microfacetAlbedo(double cosine, double n, double k, double roughness);

/// The same with what is lost given back: what is mirrored twice, three times, … by Kulla and Conty
/// (2017), the series summed term by term. 1 for a perfect metal.
double roughConductorAlbedo(double cosine, double n, double k, double roughness);

/// "F82-tint" (Kutz, Hasan and Edmondson 2021), as OpenPBR Surface 1.1 has it: Schlick's curve from f0, less
/// a dip that leaves `tint` of it at the cosine 1/7.
double f82Tint(double cosine, double f0, double tint);

/// The roughness of a metal or a gloss under a rough coat, by OpenPBR Surface 1.1.
double widened(double base, double coat);

/// As roughConductorAlbedo, of a metal that reflects `weight` times that.
double tintedMetalAlbedo(double cosine, double f0, double tint, double weight, double roughness);

/// As roughConductorAlbedo of a metal whose microfacets are wider along x than along y, as OpenPBR Surface
/// 1.1 says: α_x = r² √(2 / (1 + (1 − a)²)), α_y = (1 − a) α_x. `view`: unit, z along the normal.
double brushedAlbedo(const Vec3d& view, double n, double k, double roughness, double anisotropy);

/// Radiance towards `view` of such a surface of perfect metal, lit by a beam from `light` that brings
/// irradiance 1 to a plane that faces it.
double brushedReflection(const Vec3d& view, const Vec3d& light, double roughness, double anisotropy);

/// Of light from everywhere, the shares that rough glass sends towards a view at `cosine`; eta is the index
/// beyond over the index on the side of the view. Microfacets as of microfacetAlbedo, each of which
/// reflects what Fresnel's equations say and refracts the rest by Snell's law about its normal.
struct ScatteredShares {
    double reflected, transmitted;
};
ScatteredShares microfacetShares(double cosine, double eta, double roughness);

/// The same with what is lost given back, to both sides in the ratio that reciprocity allows: in sum 1.
ScatteredShares roughDielectricShares(double cosine, double eta, double roughness);

/// Of light from everywhere, the share that a diffuse base of albedo `base` under a coat of index `eta`
/// sends towards a view at `cosine`: the coat's once-mirrored light, and of the rest all rounds between
/// base and coat as a geometric series. The share that the coat sends back from below follows from the
/// share that it lets in: it transmits η² times as much diffuse light in one direction as in the other.
double plasticAlbedo(double cosine, double base, double eta, double roughness);

/// Of diffuse light from below, the share that such a coat sends back.
double internalReflectance(double eta, double roughness);

/// The coat of OpenPBR Surface 1.1, by the formulas of its section on coats, on a base of the given
/// roughness.
struct Lacquer {
    double ior = 1.6, roughness = 0, color = 1, darkening = 1, base_roughness = 1;

    /// Of light from everywhere the share that it mirrors towards a view; what is left of the rest of what
    /// the base, of such an albedo straight on, loses by reflections inside; what is left of light that
    /// crosses it once, on its way to a direction outside.
    double mirrored(double cosine) const;
    double darkened(double cosine, double base) const;
    double passed(double cosine) const;
    /// Radiance towards `view` of what it mirrors, where it is rough, of a beam from `light` that brings
    /// irradiance 1 to a plane that faces it (z along the normal); and factor on that of what lies below.
    double reflection(const Vec3d& view, const Vec3d& light) const;
    double below(const Vec3d& view, const Vec3d& light, double base) const;
    /// Of light from everywhere, the share that is sent towards a view by the coat and a Lambertian base.
    double albedo(double cosine, double base) const;
};

/// EON (Portsmouth, Kutz and Hill 2025) of reflectance `rho` and roughness r, by the closed forms of the
/// paper: radiance towards `view` of a surface lit by a beam from `light` that brings irradiance 1 to a
/// plane that faces it (z along the normal); and of light from everywhere the share towards `cosine`.
double eonReflection(const Vec3d& view, const Vec3d& light, double rho, double r);
double eonAlbedo(double cosine, double rho, double r);

/// Of light from everywhere, the share that a smooth gloss of index `eta` on a rough base sends towards a
/// view at `cosine`: what the gloss mirrors, and what one reflection by the base sends on, by quadrature
/// over directions, scaled to lose nothing where it loses least, and all further ones.
double glossyEonAlbedo(double cosine, double rho, double r, double eta);

/// The sheen of Zeltner, Burley and Chiang (2022), by the fits of MaterialX 1.39: of light towards a view at
/// `cosine` the share that it takes; and the density, per steradian, with which that comes from `light`: the
/// linearly transformed cosine, by its matrix. z is along the normal.
double sheenAlbedo(double cosine, double roughness);
double sheenDensity(const Vec3d& view, const Vec3d& light, double roughness);

/// Reflectance of a film of real index on something of index `under`, both relative to the medium
/// before, where light has the wavelength: by the film's characteristic matrix (Abelès 1950; Born and
/// Wolf, 1.6), for light across and in the plane of incidence.
std::array<double, 2> polarisedFilmReflectance(double cosine, double film, double thickness_nm,
                                               double wavelength_nm, std::complex<double> under);
/// The mean of both.
double filmReflectance(double cosine, double film, double thickness_nm, double wavelength_nm,
                       std::complex<double> under);

/// Of unpolarised light the share that passes a pane of index eta, one of whose sides may have a film: all
/// rounds between its sides, each polarisation by itself (Stokes 1862).
double paneTransmittance(double cosine, double eta, double film = 1, double thickness_nm = 0,
                         double wavelength_nm = 550);

/// Planck's law in W·m⁻³·sr⁻¹ (CODATA 2018, exact constants).
double planck_W_m3_sr(double wavelength_nm, double temperature_K);

}  // namespace crt::verify
