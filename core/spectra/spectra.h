/// Spectra and colour on the host, in double: tables, named data, up-sampling from RGB, the CIE 1931
/// observer, and the matrices between XYZ and output colour spaces. The measured numbers live in
/// spectra_data.cpp with their sources.
#pragma once

#include "base/vec3d.h"

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace crt {

inline constexpr int kWavelengthMin_nm = 360;
inline constexpr int kWavelengthMax_nm = 830;
inline constexpr int kSpectrumSize =
    kWavelengthMax_nm - kWavelengthMin_nm + 1;  ///< 471 values, one a nanometre.

using Matrix3d = std::array<Vec3d, 3>;  ///< Rows.

/// The samples of a spectrum. Copies share them until one of them is changed: scenes hold each spectrum
/// several times, and some hold a hundred thousand. As with the containers of std, different objects may be
/// used by different threads.
class SpectrumValues {
public:
    using Array = std::array<double, kSpectrumSize>;

    SpectrumValues() : shared_(zeros()) {}
    SpectrumValues(const Array& values) : shared_(std::make_shared<Array>(values)) {}
    // Moved, it would be empty; copied, it still is what it was.
    SpectrumValues(const SpectrumValues&) = default;
    SpectrumValues& operator=(const SpectrumValues&) = default;
    ~SpectrumValues() = default;

    static constexpr std::size_t size() { return kSpectrumSize; }
    double operator[](std::size_t i) const { return (*shared_)[i]; }
    double& operator[](std::size_t i) { return own()[i]; }
    double front() const { return shared_->front(); }
    double back() const { return shared_->back(); }
    double& front() { return own().front(); }
    double& back() { return own().back(); }
    Array::const_iterator begin() const { return shared_->begin(); }
    Array::const_iterator end() const { return shared_->end(); }
    Array::iterator begin() { return own().begin(); }
    Array::iterator end() { return own().end(); }
    void fill(double value) { own().fill(value); }

    bool operator==(const SpectrumValues& other) const {
        return shared_ == other.shared_ || *shared_ == *other.shared_;
    }
    bool operator<(const SpectrumValues& other) const {
        return shared_ != other.shared_ && *shared_ < *other.shared_;
    }

private:
    static const std::shared_ptr<Array>& zeros() {
        static const auto all = std::make_shared<Array>();
        return all;
    }
    Array& own() {
        if (shared_.use_count() != 1) shared_ = std::make_shared<Array>(*shared_);
        return *shared_;
    }

    std::shared_ptr<Array> shared_;
};

/// A function of wavelength, sampled at 360, 361, … 830 nm and linear between. Everything a scene names as
/// a spectrum is resolved to this at load.
struct Spectrum {
    SpectrumValues values;

    double& operator[](std::size_t i) { return values[i]; }
    double operator[](std::size_t i) const { return values[i]; }
    bool isConstant() const;
    double min() const;
    double max() const;
    bool operator==(const Spectrum& other) const = default;
};

/// Behaviour of a table beyond its first and last wavelength.
enum class Outside { Clamp, Zero, Error };

Spectrum constantSpectrum(double value);

/// Linear interpolation of (wavelength_nm, value) pairs. Detail finer than a nanometre keeps its integral
/// and its mean wavelength. With Outside::Zero the whole table keeps its integral: the step at an end that
/// is not zero is spread over the nanometres that it touches. Throws crt::Error(Scene) when wavelengths are
/// not strictly increasing, lengths differ, the table is empty, a value is not finite, `outside` is Error
/// and 360–830 nm is not covered, or `outside` is Zero and there is one wavelength alone, which has no
/// width.
Spectrum tableSpectrum(const std::vector<double>& wavelength_nm, const std::vector<double>& value,
                       Outside outside);

/// Reads two-column .spd or .csv text (wavelength_nm, value; '#' comments; separators blank, tab, comma,
/// semicolon; an optional header line). Errors carry file:line.
Spectrum readSpectrumFile(const std::string& path, Outside outside);

/// Planck's law for temperature_K, normalised to 1 at its maximum within 360–830 nm when `normalise`,
/// otherwise in W·m⁻²·sr⁻¹·nm⁻¹ (CODATA 2018 h, c, k).
Spectrum blackbodySpectrum(double temperature_K, bool normalise);

/// CIE illuminant "A", "D50", "D65", "F2", "F7" or "F11", relative power scaled so that its luminance
/// ∫S·ȳ/∫ȳ is 1. Empty when the name is unknown; illuminantNames() lists the known ones.
std::optional<Spectrum> illuminantSpectrum(std::string_view name);
const std::vector<std::string>& illuminantNames();

/// Refractive index of a named glass, crystal or plastic, such as "N-BK7", "diamond" or "acrylic".
std::optional<Spectrum> glassIndex(std::string_view name);
const std::vector<std::string>& glassNames();
/// n(λ) by Sellmeier: n² − 1 = Σ Bᵢλ²/(λ² − Cᵢ), λ in µm, C in µm².
Spectrum sellmeierIndex(const std::array<double, 3>& B, const std::array<double, 3>& C_um2);
/// n(λ) by Cauchy: n = A + B/λ² + …, λ in µm.
Spectrum cauchyIndex(const std::vector<double>& coefficients_um);

/// Complex refractive index (n, k) of a metal by symbol or name: "Ag" or "silver".
std::optional<std::pair<Spectrum, Spectrum>> metalIndex(std::string_view name);
const std::vector<std::string>& metalNames();

/// Smooth spectrum for a linear sRGB colour in [0,1] used as reflectance, by Jakob and Hanika 2019 ("A
/// Low-Dimensional Function Space for Efficient Spectral Upsampling"): sigmoid of a quadratic, coefficients
/// found by Gauss–Newton at load. The result under D65 gives back the colour; values stay within (0,1).
/// Components outside [0,1] throw crt::Error(Scene).
Spectrum rgbReflectance(const Vec3d& linear_srgb);
/// The same for an unbounded emission colour: rgbReflectance(rgb / (2·max)) · 2·max · D65
/// (luminance-normalised).
Spectrum rgbEmission(const Vec3d& linear_srgb);
/// sRGB-encoded component in [0,1] to linear, IEC 61966-2-1.
double srgbToLinear(double encoded);
double linearToSrgb(double linear);

/// CIE 1931 2° colour-matching functions x̄, ȳ, z̄ on the 1 nm grid, and ∫ȳ dλ by the sum over the
/// grid.
const std::array<Spectrum, 3>& cieObserver();
double cieYIntegral();
/// XYZ of a radiance spectrum: ∫L·(x̄,ȳ,z̄)dλ / ∫ȳdλ (sum on the 1 nm grid), so that L = 1 gives
/// Y = 1.
Vec3d spectrumToXyz(const Spectrum& radiance);

/// Output colour spaces.
enum class ColorSpace { LinearSrgb, AcesCg, Xyz };
/// Matrix from CIE XYZ (Y=1 scale) to the linear RGB of the space; identity for Xyz. No chromatic adaptation
/// except what the space's white needs by definition (ACEScg is taken with its own ~D60 white,
/// Bradford-adapted from D65).
Matrix3d xyzToRgb(ColorSpace space);
/// From linear RGB of any primaries, {Rx, Ry, Gx, Gy, Bx, By, Wx, Wy}, to linear sRGB, so that white stays
/// white (Bradford). Nothing for primaries that span no colours.
std::optional<Matrix3d> linearSrgbOf(const std::array<double, 8>& primaries);
/// {Rx, Ry, Gx, Gy, Bx, By, Wx, Wy} for the EXR chromaticities attribute.
std::array<double, 8> chromaticities(ColorSpace space);
/// Bradford adaptation in XYZ that maps the white of `from_white_xyz` to `to_white_xyz`.
Matrix3d bradfordAdaptation(const Vec3d& from_white_xyz, const Vec3d& to_white_xyz);
/// White point XYZ (Y = 1) of D65 as the sRGB standard has it (x=.3127, y=.3290).
Vec3d d65WhiteXyz();

Vec3d multiply(const Matrix3d& m, const Vec3d& v);
Matrix3d multiply(const Matrix3d& a, const Matrix3d& b);

}  // namespace crt
