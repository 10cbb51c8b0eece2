// Over 450 lines: short functions, one for each source of a spectrum and each step to a colour.
#include "spectra/spectra.h"

#include "base/error.h"
#include "base/input_file.h"
#include "spectra/spectra_data.h"
#include "spectra/spectrum_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

namespace crt {
namespace {

double wavelengthAt(std::size_t i) {
    return static_cast<double>(kWavelengthMin_nm) + static_cast<double>(i);
}

/// Piecewise linear through (x, y); beyond the ends the end value or zero. `x` increases strictly and is not
/// empty.
Spectrum resample(const std::vector<double>& x, const std::vector<double>& y, Outside outside) {
    Spectrum s;
    std::size_t right = 0;  // First knot at or beyond the wavelength; only moves forward.
    for (std::size_t i = 0; i < s.values.size(); ++i) {
        const double w = wavelengthAt(i);
        while (right < x.size() && x[right] < w) ++right;
        if (right < x.size() && x[right] == w) {
            s[i] = y[right];
        } else if (right == 0 || right == x.size()) {
            s[i] = outside == Outside::Clamp ? (right == 0 ? y.front() : y.back()) : 0.0;
        } else {
            const double t = (w - x[right - 1]) / (x[right] - x[right - 1]);
            s[i] = y[right - 1] + t * (y[right] - y[right - 1]);
        }
    }
    return s;
}

struct Knot {
    double nm, value;
};

/// Twice what a cell of one nanometre gives to the node at each of its ends.
struct CellShares {
    double left = 0, right = 0;
};

/// ∫ f (1 − t) and ∫ f t over the cell that begins at `lower`, twice, of the lines through `knots`: by
/// Simpson's rule, which is exact for parabolas. Between the ends of the table, `first_nm` and `last_nm`,
/// and a nanometre f is what the table is continued by.
CellShares momentsOf(const std::vector<Knot>& knots, double lower, double first_nm, double last_nm) {
    CellShares shares;
    for (std::size_t k = 0; k + 1 < knots.size(); ++k) {
        double a = knots[k].value, b = knots[k + 1].value;
        if (knots[k + 1].nm == first_nm) b = a;
        if (knots[k].nm == last_nm) a = b;
        const double t0 = knots[k].nm - lower, t1 = knots[k + 1].nm - lower;
        const double middle = 0.5 * (t0 + t1), sixth = (t1 - t0) / 6;
        shares.left += 2 * sixth * (a * (1 - t0) + 2 * (a + b) * (1 - middle) + b * (1 - t1));
        shares.right += 2 * sixth * (a * t0 + 2 * (a + b) * middle + b * t1);
    }
    return shares;
}

/// True if the table falls to zero at the whole nanometre `nm`, which is then the end of a step and not of a
/// line. The ends of the grid are not treated as ends of a table.
bool stepsAt(double nm, const std::vector<double>& x, const std::vector<double>& y, Outside outside) {
    if (outside != Outside::Zero || nm == kWavelengthMin_nm || nm == kWavelengthMax_nm) return false;
    return (nm == x.front() && y.front() != 0) || (nm == x.back() && y.back() != 0);
}

/// Where a table has knots between two nanometres, reading it off at the nanometres would lose or invent
/// lines that are narrower than that; and where it ends on a nanometre with a step to zero, the step would
/// become a ramp of a nanometre and add half of it. In such cells each node gets ∫ f·(its share of the
/// linear interpolation) instead, so that integral and mean wavelength are the table's. A cell without inner
/// knots and steps is linear already and keeps its values; nothing leaves the range of the table's values
/// and zero.
void conserveIntegral(const std::vector<double>& x, const std::vector<double>& y, Outside outside,
                      Spectrum& s) {
    const Spectrum read_off = s;
    const std::size_t cells = s.values.size() - 1;
    std::vector<CellShares> of_cell(cells);
    bool changed = false;
    for (std::size_t i = 0; i < cells; ++i) {
        const double lower = wavelengthAt(i), upper = lower + 1;
        if (outside == Outside::Zero && (upper <= x.front() || lower >= x.back())) {
            changed = changed || read_off[i] != 0 || read_off[i + 1] != 0;
            continue;
        }
        std::vector<Knot> knots{{lower, read_off[i]}};
        const auto first = static_cast<std::size_t>(std::upper_bound(x.begin(), x.end(), lower) - x.begin());
        for (std::size_t k = first; k < x.size() && x[k] < upper; ++k) knots.push_back({x[k], y[k]});
        knots.push_back({upper, read_off[i + 1]});
        if (knots.size() == 2 && !stepsAt(lower, x, y, outside) && !stepsAt(upper, x, y, outside)) {
            of_cell[i] = {read_off[i], read_off[i + 1]};
        } else {
            of_cell[i] = momentsOf(knots, lower, x.front(), x.back());
            changed = true;
        }
    }
    if (!changed) return;
    // The outermost nodes have one cell each.
    s.values.front() = of_cell.front().left;
    s.values.back() = of_cell.back().right;
    for (std::size_t i = 1; i < cells; ++i) s[i] = 0.5 * (of_cell[i - 1].right + of_cell[i].left);
}

[[noreturn]] void fail(const std::string& sentence, SourcePlace place = {}) {
    throw Error(ErrorKind::Scene, sentence, std::move(place));
}

Spectrum luminanceNormalised(Spectrum s) {
    const double y = spectrumToXyz(s)[1];
    for (double& v : s.values) v /= y;
    return s;
}

Matrix3d inverse(const Matrix3d& m) {
    const auto cofactor = [&](int r, int c) {
        const int r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
        return m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
    };
    const double det = m[0][0] * cofactor(0, 0) + m[0][1] * cofactor(0, 1) + m[0][2] * cofactor(0, 2);
    Matrix3d inv;
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) inv[r][c] = cofactor(c, r) / det;
    return inv;
}

Vec3d xyzFromChromaticity(double x, double y) { return {x / y, 1.0, (1.0 - x - y) / y}; }

/// RGB → XYZ from primaries and white, so that RGB (1,1,1) is the white with Y = 1 (SMPTE RP 177).
Matrix3d rgbToXyz(const std::array<double, 8>& c) {
    const Vec3d r = xyzFromChromaticity(c[0], c[1]);
    const Vec3d g = xyzFromChromaticity(c[2], c[3]);
    const Vec3d b = xyzFromChromaticity(c[4], c[5]);
    Matrix3d m{{{r[0], g[0], b[0]}, {r[1], g[1], b[1]}, {r[2], g[2], b[2]}}};
    const Vec3d scale = multiply(inverse(m), xyzFromChromaticity(c[6], c[7]));
    for (Vec3d& row : m)
        for (int i = 0; i < 3; ++i) row[i] *= scale[i];
    return m;
}

/// The fields of one line of a spectrum file: split at blanks, commas and semicolons, up to '#'.
std::vector<std::string_view> splitFields(std::string_view line) {
    constexpr std::string_view kSeparators = " \t,;\r\v\f";
    line = line.substr(0, line.find('#'));
    std::vector<std::string_view> fields;
    for (std::size_t at = line.find_first_not_of(kSeparators); at != std::string_view::npos;) {
        const std::size_t end = std::min(line.find_first_of(kSeparators, at), line.size());
        fields.push_back(line.substr(at, end - at));
        at = line.find_first_not_of(kSeparators, end);
    }
    return fields;
}

/// Independent of the locale; false unless the whole text is one number.
bool parseNumber(std::string_view text, double& value) {
    if (text.size() > 1 && text[0] == '+') text.remove_prefix(1);
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size();
}

}  // namespace

bool Spectrum::isConstant() const {
    return std::all_of(values.begin(), values.end(), [&](double v) { return v == values.front(); });
}

double Spectrum::min() const { return *std::min_element(values.begin(), values.end()); }
double Spectrum::max() const { return *std::max_element(values.begin(), values.end()); }

Spectrum constantSpectrum(double value) {
    Spectrum s;
    s.values.fill(value);
    return s;
}

Spectrum tableSpectrum(const std::vector<double>& wavelength_nm, const std::vector<double>& value,
                       Outside outside) {
    if (wavelength_nm.size() != value.size())
        fail(fmt::format("a spectrum table has {} wavelengths but {} values", wavelength_nm.size(),
                         value.size()));
    if (wavelength_nm.empty()) fail("a spectrum table is empty");
    for (std::size_t i = 0; i < value.size(); ++i) {
        if (!std::isfinite(wavelength_nm[i]))
            fail(fmt::format("wavelength {} of a spectrum table is not finite", i + 1));
        if (!std::isfinite(value[i]))
            fail(fmt::format("the value at {} nm of a spectrum table is not finite", wavelength_nm[i]));
        if (i > 0 && !(wavelength_nm[i] > wavelength_nm[i - 1]))
            fail(fmt::format("wavelengths of a spectrum table must increase, but {} nm follows {} nm",
                             wavelength_nm[i], wavelength_nm[i - 1]));
    }
    if (outside == Outside::Error &&
        (wavelength_nm.front() > kWavelengthMin_nm || wavelength_nm.back() < kWavelengthMax_nm))
        fail(
            fmt::format("a spectrum table covers {} to {} nm, not all of {} to {} nm; add 'outside: clamp' "
                        "or 'outside: zero'",
                        wavelength_nm.front(), wavelength_nm.back(), kWavelengthMin_nm, kWavelengthMax_nm));
    if (outside == Outside::Zero && wavelength_nm.size() == 1)
        fail(fmt::format(
            "a spectrum table of one wavelength with 'outside: zero' is zero everywhere, because {} nm "
            "alone has no width; give two or more, or say 'outside: clamp' for a constant",
            wavelength_nm.front()));
    Spectrum s = resample(wavelength_nm, value, outside);
    conserveIntegral(wavelength_nm, value, outside, s);
    return s;
}

std::string refusalOfUnit(double first_nm, double last_nm) {
    constexpr double kLargestInMetres = 1e-3, kLargestInMicrometres = 10, kSmallestInAngstroms = 3000;
    const char* const guess = last_nm <= 0                 ? "and wavelengths are above 0"
                              : last_nm < kLargestInMetres ? "are these metres? Multiply them by 1e9"
                              : last_nm < kLargestInMicrometres
                                  ? "are these micrometres? Multiply them by 1000"
                              : first_nm >= kSmallestInAngstroms ? "are these ångströms? Divide them by 10"
                                                                 : nullptr;
    if (guess == nullptr) return {};
    return fmt::format(
        "wavelengths must be in nm, but these go from {} to {}, and crt renders {} to {} nm; {}", first_nm,
        last_nm, kWavelengthMin_nm, kWavelengthMax_nm, guess);
}

SampledSpectrum readSpectrumTable(const std::string& path) {
    std::string text;
    try {
        text = readInput(path, kMostSpectrumBytes);
    } catch (const InputRefused& refused) {
        fail(fmt::format("this spectrum file {}", refused.what()), {path});
    }

    SampledSpectrum table;
    auto& [wavelength, value] = table;
    std::string_view rest = text;
    if (rest.starts_with("\xEF\xBB\xBF"))
        rest.remove_prefix(3);  // Spreadsheets like to write a byte-order mark.
    bool header_allowed = true;
    int first_line = 0;
    for (int line_number = 1; !rest.empty(); ++line_number) {
        const std::size_t newline = std::min(rest.find('\n'), rest.size());
        const std::vector<std::string_view> fields = splitFields(rest.substr(0, newline));
        rest.remove_prefix(std::min(newline + 1, rest.size()));
        if (fields.empty()) continue;

        const SourcePlace place{path, line_number};
        double w = 0, v = 0;
        if (!parseNumber(fields[0], w)) {
            if (!header_allowed)
                fail(fmt::format("expected a wavelength in nm, found '{}'", fields[0]), place);
            header_allowed = false;
            continue;
        }
        header_allowed = false;
        if (fields.size() != 2)
            fail(fmt::format("expected two numbers, wavelength in nm and value, found {}",
                             fields.size() == 1 ? "one" : fmt::format("{} fields", fields.size())), place);
        if (!parseNumber(fields[1], v)) fail(fmt::format("expected a number, found '{}'", fields[1]), place);
        if (!std::isfinite(w) || !std::isfinite(v)) fail("wavelength and value must be finite", place);
        if (!wavelength.empty() && !(w > wavelength.back()))
            fail(fmt::format("wavelengths must increase, but {} nm follows {} nm", w, wavelength.back()),
                 place);
        if (wavelength.empty()) first_line = line_number;
        wavelength.push_back(w);
        value.push_back(v);
    }
    if (wavelength.empty()) fail("this spectrum file holds no numbers", {path});
    if (const std::string why = refusalOfUnit(wavelength.front(), wavelength.back()); !why.empty())
        fail(why, {path, first_line});
    return table;
}

Spectrum readSpectrumFile(const std::string& path, Outside outside) {
    const auto [wavelength, value] = readSpectrumTable(path);
    // The remaining errors concern the table as a whole; the message gains the name of the file.
    try {
        return tableSpectrum(wavelength, value, outside);
    } catch (const Error& e) {
        fail(e.what(), {path});
    }
}

Spectrum blackbodySpectrum(double temperature_K, bool normalise) {
    if (!(temperature_K > 0) || !std::isfinite(temperature_K))
        fail(fmt::format("a black body needs a temperature above 0 K, not {}", temperature_K));
    // CODATA 2018, exact by definition of the SI.
    constexpr double kPlanck = 6.62607015e-34;     // J s
    constexpr double kLight = 299792458.0;         // m s⁻¹
    constexpr double kBoltzmann = 1.380649e-23;    // J K⁻¹
    constexpr double kPerMetreToPerNanometre = 1e-9;
    // Logarithms, because a cold body's radiance underflows while its shape, which is what `normalise` asks
    // for, does not.
    Spectrum s;
    for (std::size_t i = 0; i < s.values.size(); ++i) {
        const double metres = wavelengthAt(i) * 1e-9;
        const double x = kPlanck * kLight / (metres * kBoltzmann * temperature_K);
        s[i] = std::log(2.0 * kPlanck * kLight * kLight * kPerMetreToPerNanometre) - 5.0 * std::log(metres) -
               x - std::log(-std::expm1(-x));
    }
    const double shift = normalise ? s.max() : 0.0;
    for (double& v : s.values) v = std::exp(v - shift);
    return s;
}

std::optional<Spectrum> illuminantSpectrum(std::string_view name) {
    for (const data::Illuminant& lamp : data::kIlluminants) {
        if (lamp.name != name) continue;
        std::vector<double> wavelength(lamp.power.size());
        for (std::size_t i = 0; i < wavelength.size(); ++i)
            wavelength[i] = lamp.first_nm + static_cast<double>(i) * lamp.step_nm;
        return luminanceNormalised(
            resample(wavelength, {lamp.power.begin(), lamp.power.end()}, Outside::Zero));
    }
    return std::nullopt;
}

const std::vector<std::string>& illuminantNames() {
    static const std::vector<std::string> names = [] {
        std::vector<std::string> n;
        for (const data::Illuminant& lamp : data::kIlluminants) n.emplace_back(lamp.name);
        return n;
    }();
    return names;
}

std::optional<Spectrum> glassIndex(std::string_view name) {
    for (const data::Glass& glass : data::kGlasses)
        if (glass.name == name) return sellmeierIndex(glass.B, glass.C_um2);
    return std::nullopt;
}

const std::vector<std::string>& glassNames() {
    static const std::vector<std::string> names = [] {
        std::vector<std::string> n;
        for (const data::Glass& glass : data::kGlasses) n.emplace_back(glass.name);
        return n;
    }();
    return names;
}

Spectrum sellmeierIndex(const std::array<double, 3>& B, const std::array<double, 3>& C_um2) {
    Spectrum s;
    for (std::size_t i = 0; i < s.values.size(); ++i) {
        const double um = wavelengthAt(i) * 1e-3;
        double n2 = 1.0;
        // A term with B = 0 is absent; skipping it keeps 0/0 out when its C happens to fall on a wavelength.
        for (std::size_t t = 0; t < B.size(); ++t)
            if (B[t] != 0.0) n2 += B[t] * um * um / (um * um - C_um2[t]);
        if (!std::isfinite(n2) || n2 <= 0.0)
            fail(
                fmt::format("these Sellmeier coefficients give n² = {:.4g} at {} nm; n² must be positive "
                            "from {} to {} nm",
                            n2, wavelengthAt(i), kWavelengthMin_nm, kWavelengthMax_nm));
        s[i] = std::sqrt(n2);
    }
    return s;
}

Spectrum cauchyIndex(const std::vector<double>& coefficients_um) {
    if (coefficients_um.empty()) fail("a Cauchy formula needs at least one coefficient");
    Spectrum s;
    for (std::size_t i = 0; i < s.values.size(); ++i) {
        const double um = wavelengthAt(i) * 1e-3;
        double n = 0.0;  // Horner in 1/λ².
        for (auto c = coefficients_um.rbegin(); c != coefficients_um.rend(); ++c) n = n / (um * um) + *c;
        if (!std::isfinite(n) || n <= 0.0)
            fail(fmt::format(
                "these Cauchy coefficients give n = {:.4g} at {} nm; n must be positive from {} to {} nm", n,
                wavelengthAt(i), kWavelengthMin_nm, kWavelengthMax_nm));
        s[i] = n;
    }
    return s;
}

std::optional<std::pair<Spectrum, Spectrum>> metalIndex(std::string_view name) {
    for (const data::Metal& metal : data::kMetals) {
        if (metal.symbol != name && metal.name != name) continue;
        const std::vector<double> wavelength(metal.wavelength_nm.begin(), metal.wavelength_nm.end());
        return std::pair{resample(wavelength, {metal.n.begin(), metal.n.end()}, Outside::Clamp),
                         resample(wavelength, {metal.k.begin(), metal.k.end()}, Outside::Clamp)};
    }
    return std::nullopt;
}

const std::vector<std::string>& metalNames() {
    static const std::vector<std::string> names = [] {
        std::vector<std::string> n;
        for (const data::Metal& metal : data::kMetals) n.emplace_back(metal.symbol);
        for (const data::Metal& metal : data::kMetals) n.emplace_back(metal.name);
        return n;
    }();
    return names;
}

double srgbToLinear(double encoded) {
    return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

double linearToSrgb(double linear) {
    return linear <= 0.0031308 ? linear * 12.92 : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
}

const std::array<Spectrum, 3>& cieObserver() {
    static_assert(data::kObserverSize == kSpectrumSize);
    static const std::array<Spectrum, 3> observer{Spectrum{data::kCieX}, Spectrum{data::kCieY},
                                                  Spectrum{data::kCieZ}};
    return observer;
}

double cieYIntegral() {
    static const double integral = [] {
        double sum = 0.0;
        for (const double y : data::kCieY) sum += y;
        return sum;
    }();
    return integral;
}

Vec3d spectrumToXyz(const Spectrum& radiance) {
    Vec3d xyz{0, 0, 0};
    for (std::size_t i = 0; i < radiance.values.size(); ++i) {
        xyz[0] += radiance[i] * data::kCieX[i];
        xyz[1] += radiance[i] * data::kCieY[i];
        xyz[2] += radiance[i] * data::kCieZ[i];
    }
    for (double& v : xyz) v /= cieYIntegral();
    return xyz;
}

std::array<double, 8> chromaticities(ColorSpace space) {
    switch (space) {
        case ColorSpace::LinearSrgb:
            return {0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290};  // ITU-R BT.709
        case ColorSpace::AcesCg:
            return {0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767};  // AMPAS S-2014-004
        case ColorSpace::Xyz: break;
    }
    return {1, 0, 0, 1, 0, 0, 1.0 / 3.0, 1.0 / 3.0};
}

Matrix3d xyzToRgb(ColorSpace space) {
    const std::array<double, 8> c = chromaticities(space);
    switch (space) {
        case ColorSpace::LinearSrgb: return inverse(rgbToXyz(c));
        case ColorSpace::AcesCg:
            return multiply(inverse(rgbToXyz(c)),
                            bradfordAdaptation(d65WhiteXyz(), xyzFromChromaticity(c[6], c[7])));
        case ColorSpace::Xyz: break;
    }
    return {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
}

std::optional<Matrix3d> linearSrgbOf(const std::array<double, 8>& primaries) {
    constexpr double kLeastY = 1e-6, kMostGain = 1000;  // Usual spaces have entries below 5.
    for (std::size_t i = 1; i < primaries.size(); i += 2)
        if (!(std::abs(primaries[i]) >= kLeastY)) return std::nullopt;
    const Matrix3d to_srgb =
        multiply(xyzToRgb(ColorSpace::LinearSrgb),
                 multiply(bradfordAdaptation(xyzFromChromaticity(primaries[6], primaries[7]), d65WhiteXyz()),
                          rgbToXyz(primaries)));
    for (const Vec3d& row : to_srgb)
        for (const double entry : row)
            if (!(std::abs(entry) < kMostGain)) return std::nullopt;
    return to_srgb;
}

Matrix3d bradfordAdaptation(const Vec3d& from_white_xyz, const Vec3d& to_white_xyz) {
    // Lam 1985, as in the ICC profile specification, annex E.
    constexpr Matrix3d kCone{
        {{0.8951, 0.2664, -0.1614}, {-0.7502, 1.7135, 0.0367}, {0.0389, -0.0685, 1.0296}}};
    const Vec3d from = multiply(kCone, from_white_xyz);
    const Vec3d to = multiply(kCone, to_white_xyz);
    Matrix3d scaled = kCone;
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) scaled[r][c] *= to[r] / from[r];
    return multiply(inverse(kCone), scaled);
}

Vec3d d65WhiteXyz() { return xyzFromChromaticity(0.3127, 0.3290); }

Vec3d multiply(const Matrix3d& m, const Vec3d& v) {
    Vec3d r{};
    for (int i = 0; i < 3; ++i) r[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
    return r;
}

Matrix3d multiply(const Matrix3d& a, const Matrix3d& b) {
    Matrix3d r{};
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) r[i][j] = a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j];
    return r;
}

}  // namespace crt
