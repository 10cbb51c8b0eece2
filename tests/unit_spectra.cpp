// Spectra and colour: the measured tables by checksum and by smoothness, published reference values, and the
// RGB fit.
//
// Over 450 lines: published values, table after table.
#include "base/error.h"
#include "catch.h"
#include "base/temporary_folder.h"
#include "spectra/spectra.h"
#include "spectra/spectra_data.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <tuple>

using namespace crt;
using crt::TemporaryFolder;

namespace {

double at(const Spectrum& s, int nm) { return s[static_cast<std::size_t>(nm - kWavelengthMin_nm)]; }

/// A table's digits, folded into 64 bits (FNV-1a over the bytes of the doubles): a changed digit is a
/// changed sum.
std::uint64_t checksum(std::span<const double> table) {
    std::uint64_t hash = 0xcbf29ce484222325u;
    for (const double value : table) {
        unsigned char bytes[sizeof value];
        std::memcpy(bytes, &value, sizeof value);
        for (const unsigned char b : bytes) hash = (hash ^ b) * 0x100000001b3u;
    }
    return hash;
}

/// Largest distance between a value and the cubic through its four neighbours, relative to the table's
/// maximum.
double roughness(std::span<const double> v) {
    double worst = 0, top = 0;
    for (const double x : v) top = std::max(top, x);
    for (std::size_t i = 2; i + 2 < v.size(); ++i)
        worst = std::max(worst, std::abs((-v[i - 2] + 4 * v[i - 1] + 4 * v[i + 1] - v[i + 2]) / 6 - v[i]));
    return worst / top;
}

/// Linear sRGB of a reflectance lit by D65.
Vec3d underD65(Spectrum reflectance) {
    const Spectrum d65 = *illuminantSpectrum("D65");
    for (std::size_t i = 0; i < reflectance.values.size(); ++i) reflectance[i] *= d65[i];
    return multiply(xyzToRgb(ColorSpace::LinearSrgb), spectrumToXyz(reflectance));
}

/// Sentence of the scene error that reading `text` as a spectrum file gives, and the line it points to.
std::pair<std::string, int> fileError(const std::string& text, Outside outside = Outside::Clamp) {
    const TemporaryFolder folder;
    const std::string file = folder.write("spectrum.spd", text);
    try {
        readSpectrumFile(file, outside);
    } catch (const Error& e) {
        CHECK(e.kind() == ErrorKind::Scene);
        CHECK(e.place().file == file);
        return {e.what(), e.place().line};
    }
    return {"no error", -1};
}

/// Abscissae in (0, 1) and weights of Gauss's rule of three points.
const std::pair<double, double> kGauss[] = {
    {0.5 - std::sqrt(0.15), 5.0 / 18}, {0.5, 8.0 / 18}, {0.5 + std::sqrt(0.15), 5.0 / 18}};

/// ∫ f(λ) s(λ) dλ over 360–830 nm, s linear between nanometres: f at three points of each nanometre.
template <class F>
double gridIntegral(const Spectrum& s, F f) {
    double sum = 0;
    for (std::size_t i = 0; i + 1 < s.values.size(); ++i)
        for (const auto& [t, weight] : kGauss)
            sum +=
                weight * f(kWavelengthMin_nm + static_cast<double>(i) + t) * (s[i] + t * (s[i + 1] - s[i]));
    return sum;
}

/// The same of the lines through (nm, value) and zero beyond their ends: 2000 times three points between two
/// knots.
template <class F>
double tableIntegral(const std::vector<double>& nm, const std::vector<double>& value, F f) {
    constexpr int kParts = 2000;
    double sum = 0;
    for (std::size_t k = 0; k + 1 < nm.size(); ++k) {
        const double lower = std::max<double>(nm[k], kWavelengthMin_nm);
        const double upper = std::min<double>(nm[k + 1], kWavelengthMax_nm);
        if (!(upper > lower)) continue;
        const double width = (upper - lower) / kParts;
        for (int i = 0; i < kParts; ++i)
            for (const auto& [t, weight] : kGauss) {
                const double w = lower + (i + t) * width,
                             slope = (value[k + 1] - value[k]) / (nm[k + 1] - nm[k]);
                sum += weight * width * f(w) * (value[k] + (w - nm[k]) * slope);
            }
    }
    return sum;
}

}  // namespace

TEST_CASE("the measured tables are the published ones", "[spectra]") {
    // Sums anyone can redo from the publications, then the digits as a whole.
    double x = 0, y = 0, z = 0;
    for (int i = 0; i < data::kObserverSize; ++i)
        x += data::kCieX[i], y += data::kCieY[i], z += data::kCieZ[i];
    CHECK(x == Approx(106.8654695).epsilon(1e-9));
    CHECK(y == Approx(106.8569171).epsilon(1e-9));
    CHECK(z == Approx(106.8922513).epsilon(1e-9));
    CHECK(cieYIntegral() == y);

    CHECK(checksum(data::kCieX) == 0xb09dbe4ae4065464u);
    CHECK(checksum(data::kCieY) == 0xaa5d2f74fa9f284au);
    CHECK(checksum(data::kCieZ) == 0x28f303545754c1beu);
    const std::uint64_t illuminants[] = {0xe2046d4a0f5e421eu, 0xbe621c333dff1e32u, 0x4cb4a59c27aa9394u,
                                         0x9cb2e94d4e80b46eu, 0x96b59a7e032b4d45u, 0x4ea56ccf3c5b7e93u};
    for (std::size_t i = 0; i < data::kIlluminants.size(); ++i) {
        CAPTURE(data::kIlluminants[i].name);
        CHECK(checksum(data::kIlluminants[i].power) == illuminants[i]);
    }
    const std::uint64_t metals[][2] = {{0xb269a0f4e82fbcccu, 0x15a4b670697585edu},
                                       {0x1e04a0e36cad2633u, 0xa20bcfae54d1e587u},
                                       {0x504f3bd51d48dbfau, 0x7a3bac4be3f7c35au},
                                       {0x2e2b316edb0a13e2u, 0x9fd4111f4c44afc1u}};
    for (std::size_t i = 0; i < std::size(metals); ++i) {
        CAPTURE(data::kMetals[i].name);
        CHECK(checksum(data::kMetals[i].n) == metals[i][0]);
        CHECK(checksum(data::kMetals[i].k) == metals[i][1]);
    }
}

TEST_CASE("no digit of the observer stands out of its curve", "[spectra]") {
    // A well-known slip, 0.9874812 for 0.9874182 at 547 nm, is a kink fifteen times the bound.
    CHECK(roughness(data::kCieX) < 1e-4);
    CHECK(roughness(data::kCieY) < 4e-5);
    CHECK(roughness(data::kCieZ) < 2.1e-4);
    const auto& y = data::kCieY;
    const int i = 547 - kWavelengthMin_nm;
    CHECK(std::abs((-y[i - 2] + 4 * y[i - 1] + 4 * y[i + 1] - y[i + 2]) / 6 - y[i]) < 4e-6);
    CHECK(at(cieObserver()[1], 555) == 1.0);
}

TEST_CASE("whites and single lines fall where colorimetry puts them", "[spectra]") {
    for (const std::string& name : illuminantNames()) {
        CAPTURE(name);
        CHECK(spectrumToXyz(*illuminantSpectrum(name))[1] == Approx(1).epsilon(1e-12));
    }
    const auto chromaticity = [](const Vec3d& xyz) {
        const double sum = xyz[0] + xyz[1] + xyz[2];
        return std::pair{xyz[0] / sum, xyz[1] / sum};
    };
    const std::pair<const char*, std::pair<double, double>> whites[] = {
        {"A", {.44757, .40745}},   {"D50", {.34567, .35850}},
        {"D65", {.31272, .32903}}, {"F2", {.3721, .3751}},
        {"F7", {.3129, .3292}},    {"F11", {.3805, .3769}}};  // CIE 15, 1931 observer
    for (const auto& [name, expected] : whites) {
        CAPTURE(name);
        const auto [x, y] = chromaticity(spectrumToXyz(*illuminantSpectrum(name)));
        const double margin =
            name[0] == 'F' ? 3e-4 : 2e-5;  // Lamps with lines: the CIE sums them at 5 nm, crt at 1 nm.
        CHECK(x == Approx(expected.first).margin(margin));
        CHECK(y == Approx(expected.second).margin(margin));
    }
    CHECK_FALSE(illuminantSpectrum("D66"));

    const Vec3d equal_energy = spectrumToXyz(constantSpectrum(1));
    CHECK(equal_energy[0] == Approx(1).margin(4e-4));
    CHECK(equal_energy[1] == Approx(1).epsilon(1e-14));
    CHECK(equal_energy[2] == Approx(1).margin(4e-4));

    Spectrum sodium;
    sodium[589 - kWavelengthMin_nm] = 1;
    const auto [x, y] = chromaticity(spectrumToXyz(sodium));
    CHECK(x == Approx(.5690).margin(5e-4));
    CHECK(y == Approx(.4303).margin(5e-4));
}

TEST_CASE("fluorescent lamps are dark where they were not measured", "[spectra]") {
    const Spectrum f11 = *illuminantSpectrum("F11");
    CHECK(at(f11, 379) == 0.0);
    CHECK(at(f11, 380) > 0.0);
    CHECK(at(f11, 781) == 0.0);
}

TEST_CASE("glass indices agree with the catalogue", "[spectra]") {
    // SCHOTT data sheet N-BK7 gives 1.52238, 1.51680, 1.51432; eight digits from the same formula.
    const data::Glass& bk7 = data::kGlasses[0];
    CHECK(bk7.name == "N-BK7");
    const auto index = [&](double um) {
        double n2 = 1;
        for (int i = 0; i < 3; ++i) n2 += bk7.B[i] * um * um / (um * um - bk7.C_um2[i]);
        return std::sqrt(n2);
    };
    CHECK(index(.4861327) == Approx(1.52237627).margin(6e-9));
    CHECK(index(.5875618) == Approx(1.51680003).margin(6e-9));
    CHECK(index(.6562725) == Approx(1.51432233).margin(6e-9));
    const Spectrum grid = *glassIndex("N-BK7");
    CHECK(at(grid, 588) == Approx(index(.588)).epsilon(1e-14));

    const std::tuple<const char*, double, double> catalogue[] = {
        {"N-BK7", 1.51680, 64.17},   {"SF10", 1.72825, 28.41},    {"SF11", 1.78472, 25.76},
        {"N-SF10", 1.72828, 28.53},  {"N-SF11", 1.78472, 25.68},  {"fused_silica", 1.45846, 67.82},
        {"N-FK51A", 1.48656, 84.47}, {"N-PK51", 1.52855, 76.98},  {"N-K5", 1.52249, 59.48},
        {"N-BK10", 1.49782, 66.95},  {"N-BAK4", 1.56883, 55.98},  {"N-SK16", 1.62041, 60.32},
        {"N-BAF10", 1.67003, 47.11}, {"N-LAK22", 1.65113, 55.89}, {"N-LASF9", 1.85025, 32.17},
        {"F2", 1.62004, 36.37},      {"N-F2", 1.62005, 36.43},    {"SF6", 1.80518, 25.43},
        {"N-SF6", 1.80518, 25.36},   {"N-SF57", 1.84666, 23.78}};
    for (const auto& [name, nd, abbe] : catalogue) {
        CAPTURE(name);
        const Spectrum n = *glassIndex(name);
        const auto line = [&n](double nm) {  // The lines lie between two wavelengths of the grid.
            const int below = static_cast<int>(nm);
            return at(n, below) + (nm - below) * (at(n, below + 1) - at(n, below));
        };
        CHECK(line(587.5618) == Approx(nd).margin(6e-6));
        CHECK((line(587.5618) - 1) / (line(486.1327) - line(656.2725)) == Approx(abbe).margin(.01));
    }
    CHECK(at(*glassIndex("diamond"), 589) == Approx(2.4173).margin(1e-3));
    // At the line of sodium, from tables of physical constants.
    CHECK(at(*glassIndex("sapphire"), 589) == Approx(1.7681).margin(2e-4));
    CHECK(at(*glassIndex("calcium_fluoride"), 589) == Approx(1.4338).margin(2e-4));
    CHECK(at(*glassIndex("magnesium_fluoride"), 589) == Approx(1.3777).margin(2e-4));
    CHECK(at(*glassIndex("acrylic"), 589) == Approx(1.491).margin(2e-3));
    CHECK(at(*glassIndex("polycarbonate"), 589) == Approx(1.585).margin(2e-3));
    CHECK_FALSE(glassIndex("BK8"));
    for (const std::string& name : glassNames()) {
        const Spectrum n = *glassIndex(name);
        for (std::size_t i = 1; i < n.values.size(); ++i) REQUIRE(n[i] < n[i - 1]);  // Normal dispersion.
    }

    CHECK(at(cauchyIndex({1.5046, .0042}), 500) == Approx(1.5046 + .0042 / .25).epsilon(1e-14));
    CHECK(cauchyIndex({1.5}).isConstant());
    CHECK_THROWS_AS(cauchyIndex({}), Error);
    CHECK_THROWS_AS(cauchyIndex({-1}), Error);
    CHECK_THROWS_AS(sellmeierIndex({1, 0, 0}, {.25, 0, 0}), Error);  // A resonance at 500 nm.
}

TEST_CASE("metals answer to symbol and name", "[spectra]") {
    for (const auto& [symbol, name] :
         {std::pair{"Ag", "silver"}, {"Al", "aluminium"}, {"Au", "gold"}, {"Cu", "copper"}}) {
        REQUIRE(metalIndex(symbol));
        CHECK(*metalIndex(symbol) == *metalIndex(name));
    }
    CHECK_FALSE(metalIndex("Xx"));
    CHECK(metalNames().size() == 2 * data::kMetals.size());
    // Normal-incidence reflectance: silver is bright and flat, gold dark in the blue and bright in the red.
    const auto reflectance = [](const char* metal, int nm) {
        const auto [n, k] = *metalIndex(metal);
        const double a = at(n, nm), b = at(k, nm);
        return ((a - 1) * (a - 1) + b * b) / ((a + 1) * (a + 1) + b * b);
    };
    CHECK(reflectance("Ag", 550) > .95);
    CHECK(reflectance("Al", 550) == Approx(.92).margin(.01));
    CHECK(reflectance("Au", 450) == Approx(.39).margin(.02));
    CHECK(reflectance("Au", 650) > .94);
    CHECK(reflectance("Cu", 450) < reflectance("Cu", 650) - .3);
    CHECK(reflectance("brass", 450) < reflectance("brass", 650) - .3);
    // Handbooks: grey metals between half and nine tenths, tungsten the darkest, rhodium and mercury bright.
    CHECK(reflectance("W", 550) == Approx(.50).margin(.02));
    CHECK(reflectance("Cr", 550) == Approx(.56).margin(.03));
    CHECK(reflectance("Rh", 550) == Approx(.77).margin(.02));
    CHECK(reflectance("Hg", 550) == Approx(.78).margin(.02));
    for (const data::Metal& metal : data::kMetals) {
        CAPTURE(metal.name);
        CHECK(std::is_sorted(metal.wavelength_nm.begin(), metal.wavelength_nm.end()));
        CHECK(metal.wavelength_nm.front() <= kWavelengthMin_nm);
        CHECK(metal.wavelength_nm.back() >= kWavelengthMax_nm);
        CHECK(metal.n.size() == metal.wavelength_nm.size());
        CHECK(metal.k.size() == metal.wavelength_nm.size());
        for (int nm = kWavelengthMin_nm; nm + 40 <= kWavelengthMax_nm; nm += 10) {
            // No slip of a digit: the reflectance bends slowly, except at the edges of gold and silver.
            const std::string name(metal.symbol);
            const double bend = reflectance(name.c_str(), nm) - 2 * reflectance(name.c_str(), nm + 20) +
                                reflectance(name.c_str(), nm + 40);
            CHECK(std::abs(bend) < 0.2);
        }
    }
}

TEST_CASE("black bodies follow Planck", "[spectra]") {
    const Spectrum sun = blackbodySpectrum(5778, false);  // Per nanometre; the references are per metre.
    CHECK(at(sun, 400) == Approx(2.3062239e4).epsilon(1e-7));
    CHECK(at(sun, 550) == Approx(2.5857643e4).epsilon(1e-7));
    CHECK(at(sun, 700) == Approx(2.0801530e4).epsilon(1e-7));
    const Spectrum lamp = blackbodySpectrum(2856, false);
    CHECK(at(lamp, 400) == Approx(39.443784).epsilon(1e-7));
    CHECK(at(lamp, 700) == Approx(531.18786).epsilon(1e-7));

    for (const double kelvin : {1.0, 300.0, 2856.0, 5778.0, 1e5, 1e9}) {
        const Spectrum s = blackbodySpectrum(kelvin, true);
        CAPTURE(kelvin);
        CHECK(s.max() == 1.0);  // Also where the radiance itself underflows.
        CHECK(s.min() >= 0.0);
    }
    CHECK(at(blackbodySpectrum(5778, true), 501) == Approx(1).margin(1e-5));  // Wien: 501.518 nm.
    CHECK_THROWS_AS(blackbodySpectrum(0, true), Error);
    CHECK_THROWS_AS(blackbodySpectrum(-5, false), Error);
    CHECK_THROWS_AS(blackbodySpectrum(std::numeric_limits<double>::infinity(), false), Error);
}

TEST_CASE("tables are linear inside and explicit outside", "[spectra]") {
    const Spectrum clamp = tableSpectrum({400, 500, 600}, {1, 3, 2}, Outside::Clamp);
    CHECK(at(clamp, 360) == 1);
    CHECK(at(clamp, 400) == 1);
    CHECK(at(clamp, 450) == Approx(2));
    CHECK(at(clamp, 500) == 3);
    CHECK(at(clamp, 525) == Approx(2.75));
    CHECK(at(clamp, 830) == 2);

    const Spectrum zero = tableSpectrum({400, 500, 600}, {1, 3, 2}, Outside::Zero);
    CHECK(at(zero, 399) == 0);
    CHECK(at(zero, 401) == Approx(clamp[41]).margin(1.0 / 300));
    CHECK(at(zero, 402) == clamp[42]);
    CHECK(at(zero, 598) == at(clamp, 598));
    CHECK(at(zero, 601) == 0);

    CHECK_THROWS_AS(tableSpectrum({400, 500}, {1, 3}, Outside::Error), Error);
    CHECK_THROWS_AS(tableSpectrum({360, 829}, {1, 3}, Outside::Error), Error);
    CHECK(at(tableSpectrum({300, 900}, {1, 1}, Outside::Error), 360) == 1);
    CHECK(tableSpectrum({500}, {.25}, Outside::Clamp) == constantSpectrum(.25));

    // Finer than the grid: half a nanometre of 1 between two of them keeps its integral and its mean; no
    // value leaves the table's range.
    const Spectrum between = tableSpectrum({500.25, 500.75}, {1, 1}, Outside::Zero);
    CHECK(at(between, 500) == Approx(0.25));
    CHECK(at(between, 501) == Approx(0.25));
    CHECK(at(between, 499) == 0);
    const Spectrum line = tableSpectrum({588.28, 588.3, 588.32}, {0, 50, 0}, Outside::Zero);
    CHECK(at(line, 588) + at(line, 589) == Approx(1));
    CHECK(at(line, 589) == Approx(0.3));
    CHECK(tableSpectrum({400, 410.5, 600}, {0.2, 0.2, 0.2}, Outside::Clamp).max() == Approx(0.2));
    CHECK(
        tableSpectrum({400, 587.2, 587.21, 588.9, 588.91, 600}, {0, 0, 1, 1, 0, 0}, Outside::Clamp).max() <=
        1);

    const double nan = std::numeric_limits<double>::quiet_NaN();
    CHECK_THROWS_AS(tableSpectrum({}, {}, Outside::Clamp), Error);
    CHECK_THROWS_AS(tableSpectrum({400, 500}, {1}, Outside::Clamp), Error);
    CHECK_THROWS_AS(tableSpectrum({500, 400}, {1, 1}, Outside::Clamp), Error);
    CHECK_THROWS_AS(tableSpectrum({400, 400}, {1, 1}, Outside::Clamp), Error);
    CHECK_THROWS_AS(tableSpectrum({400, 500}, {1, nan}, Outside::Clamp), Error);
    CHECK_THROWS_AS(tableSpectrum({400, nan}, {1, 1}, Outside::Clamp), Error);
}

TEST_CASE("tables with zero outside keep their integral, wherever they end", "[spectra]") {
    const std::pair<std::vector<double>, std::vector<double>> tables[] = {
        {{549, 551}, {1, 1}},
        {{549.001, 550.999}, {1, 1}},
        {{540, 570}, {1, 1}},
        {{540.5, 570}, {1, 2}},
        {{540, 570.25}, {3, 0}},
        {{540, 550, 590, 600}, {0, 1, 1, 0}},
        {{549, 551}, {0, 2}},
        {{550, 551}, {1, 3}},
        {{549, 550, 551}, {1, 4, 1}},
        {{550, 550.5}, {1, 1}},
        {{550.5, 551}, {2, 1}},
        {{550.3, 550.4}, {5, 7}},
        {{549.9, 550.1}, {4, 4}},
        {{550, 550.001}, {1000, 1000}},
        {{549.999, 550}, {1000, 0}},
        {{588.28, 588.3, 588.32}, {0, 50, 0}},
        {{500, 500.5, 501, 700}, {1, 0, 1, .25}},
        {{360, 362}, {1, 1}},
        {{360.25, 360.75}, {1, 1}},
        {{829.25, 830}, {1, 1}},
        {{828, 830}, {1, 1}},
        {{300, 400}, {1, 1}},
        {{800, 900}, {2, 2}},
        {{300, 360}, {1, 1}},
        {{830, 900}, {1, 1}},
        {{100, 200}, {1, 1}},
    };
    const auto one = [](double) { return 1.0; };
    for (const auto& [nm, value] : tables) {
        CAPTURE(nm, value);
        const Spectrum s = tableSpectrum(nm, value, Outside::Zero);
        CHECK(s.min() >= 0);
        CHECK(s.max() <= *std::max_element(value.begin(), value.end()));
        CHECK(gridIntegral(s, one) == Approx(tableIntegral(nm, value, one)).epsilon(1e-12));
    }
}

TEST_CASE("tables with zero outside act on smooth functions as they are written", "[spectra]") {
    // A curve as narrow as those of the eye. The nanometre that a step is spread over costs up to (1 nm)²/3
    // of the second derivative.
    const auto curve = [](double nm) { return std::exp(-0.5 * (nm - 555) * (nm - 555) / (40.0 * 40.0)); };
    const double second = 1.0 / (40.0 * 40.0);  // The largest of the second derivative, at the top.
    const std::pair<std::vector<double>, std::vector<double>> tables[] = {
        {{549, 551}, {1, 1}},     {{549.001, 550.999}, {1, 1}}, {{540, 570}, {1, 1}},
        {{540.4, 569.7}, {1, 1}}, {{500, 550}, {0, 1}},         {{500, 550.5}, {1, .5}},
        {{549, 551}, {0, 2}},     {{520, 521}, {1, 3}},         {{520.2, 520.3}, {1, 3}},
        {{589, 589.001}, {1, 1}}, {{400, 700}, {1, 1}},         {{540, 550, 590, 600}, {2, 1, 1, 3}},
    };
    for (const auto& [nm, value] : tables) {
        CAPTURE(nm, value);
        const double expected = tableIntegral(nm, value, curve),
                     bare = tableIntegral(nm, value, [](double) { return 1.0; });
        const double found = gridIntegral(tableSpectrum(nm, value, Outside::Zero), curve);
        CHECK(std::abs(found - expected) < second * bare / 3);
    }
    // The luminance of two nanometres, with ends on whole nanometres and just inside them.
    const auto luminance = [](double first, double last) {
        return spectrumToXyz(tableSpectrum({first, last}, {1, 1}, Outside::Zero))[1];
    };
    CHECK(luminance(549, 551) == Approx(luminance(549.001, 550.999) * 2 / 1.998).epsilon(1e-5));
    CHECK(luminance(549, 551) == Approx(2 * 0.9949501 / cieYIntegral()).epsilon(1e-4));  // ȳ(550)
}

TEST_CASE("a step within a narrow table keeps its mean wavelength", "[spectra]") {
    const std::pair<std::vector<double>, std::vector<double>> tables[] = {
        {{549, 550}, {0, 2}},     {{549.001, 549.999}, {0, 2}}, {{550, 550.5}, {1, 1}},
        {{549.75, 550.25}, {1, 2}}, {{550, 551}, {3, 1}}};
    const auto identity = [](double nm) { return nm - 550; };
    for (const auto& [nm, value] : tables) {
        CAPTURE(nm, value);
        const double found = gridIntegral(tableSpectrum(nm, value, Outside::Zero), identity);
        CHECK(found == Approx(tableIntegral(nm, value, identity)).margin(1e-12));
    }
}

TEST_CASE("with zero outside, one wavelength alone is refused", "[spectra]") {
    for (const double nm : {300.0, 550.0, 550.3})
        CHECK_THROWS_WITH(tableSpectrum({nm}, {1}, Outside::Zero),
                          Contains("one wavelength") && Contains("outside: clamp"));
}

TEST_CASE("spectrum files are read as people write them", "[spectra]") {
    const Spectrum expected = tableSpectrum({400, 500.5, 700}, {.1, .2, .3}, Outside::Clamp);
    for (const char* text :
         {"400 0.1\n500.5 0.2\n700 0.3\n", "wavelength_nm,value\n400,0.1\n500.5,.2\n700,3e-1",
          "# measured\r\n400\t0.1\r\n\r\n500.5 \t 0.2 # middle\r\n700 +0.3\r\n",
          "\xEF\xBB\xBFnm;value\n400;0.1\n 500.5 ; 0.2\n700; 0.3"}) {
        CAPTURE(text);
        const TemporaryFolder folder;
        CHECK(readSpectrumFile(folder.write("spectrum.spd", text), Outside::Clamp) == expected);
    }
}

TEST_CASE("bad spectrum files say where", "[spectra]") {
    const auto check = [](const char* text, int line, const char* words, Outside outside = Outside::Clamp) {
        const auto [sentence, at_line] = fileError(text, outside);
        CAPTURE(text);
        CHECK_THAT(sentence, Contains(words));
        CHECK(at_line == line);
    };
    check("400 1\nfive 2\n", 2, "'five'");
    check("400 1\n500 many\n", 2, "'many'");
    check("400 1\n500\n", 2, "found one");
    check("400 1 2\n", 1, "found 3 fields");
    check("# a\n500 1\n\n400 1\n", 4, "must increase");
    check("400 1\n500 nan\n", 2, "finite");
    check("400 1\n500 1e999\n", 2, "1e999");
    check("nm value\nnm value\n400 1\n", 2, "'nm'");
    check("", 0, "no numbers");
    check("# only a comment\n", 0, "no numbers");
    check("400 1\n700 1\n", 0, "not all of 360 to 830", Outside::Error);
    CHECK_THROWS_AS(readSpectrumFile("/nonexistent/x.spd", Outside::Clamp), Error);
    CHECK_THROWS_WITH(readSpectrumFile("/", Outside::Clamp), Contains("directory"));
}

TEST_CASE("wavelengths in another unit than nanometres are refused, whatever the key outside is",
          "[spectra]") {
    for (const Outside outside : {Outside::Clamp, Outside::Zero, Outside::Error}) {
        const auto check = [&](const char* text, int line, const char* words) {
            const auto [sentence, at_line] = fileError(text, outside);
            CAPTURE(text);
            CHECK_THAT(sentence, Contains("wavelengths must be in nm") && Contains(words));
            CHECK(at_line == line);
        };
        check("um,value\n0.36,0.1\n0.83,0.9\n", 2,
              "from 0.36 to 0.83, and crt renders 360 to 830 nm; are these micrometres?");
        check("# m\n3.6e-7 1\n8.3e-7 2\n", 2, "are these metres?");
        check("3600 1\n8300 2\n", 1, "are these ångströms?");
        check("-700 1\n-400 2\n", 1, "and wavelengths are above 0");
    }
    // Each of these has a part that can be nanometres.
    for (const char* text :
         {"0 0.1\n500 0.2\n", "9 0.1\n10 0.2\n", "900 0.1\n2500 0.2\n", "2999 0\n4000 1\n"}) {
        CAPTURE(text);
        CHECK(fileError(text).first == "no error");
    }
}

TEST_CASE("colours of any primaries become those of sRGB", "[spectra]") {
    const auto check = [](const std::array<double, 8>& primaries, const Matrix3d& expected, double margin) {
        const std::optional<Matrix3d> found = linearSrgbOf(primaries);
        REQUIRE(found);
        for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c) CHECK((*found)[r][c] == Approx(expected[r][c]).margin(margin));
        const Vec3d white = multiply(*found, Vec3d{1, 1, 1});
        for (const double v : white) CHECK(v == Approx(1));
    };
    // ITU-R BT.2087-0, table 4: BT.2020 in BT.709.
    check({0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290},
          {{{1.6605, -0.5876, -0.0728}, {-0.1246, 1.1329, -0.0083}, {-0.0182, -0.1006, 1.1187}}}, 1e-4);
    check(chromaticities(ColorSpace::LinearSrgb), {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, 1e-12);
    // Of another white than D65: into ACEScg and back.
    const Matrix3d back =
        multiply(*linearSrgbOf(chromaticities(ColorSpace::AcesCg)), xyzToRgb(ColorSpace::AcesCg));
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c)
            CHECK(back[r][c] == Approx(xyzToRgb(ColorSpace::LinearSrgb)[r][c]).margin(1e-12));
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const std::array<double, 8>& none : {std::array<double, 8>{},
                                              {0.3, 0.3, 0.3, 0.3, 0.3, 0.3, 0.3, 0.3},
                                              {0.64, 0.33, 0.64, 0.33, 0.15, 0.06, 0.3127, 0.329},
                                              {0.64, nan, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329}})
        CHECK_FALSE(linearSrgbOf(none));
}

TEST_CASE("RGB reflectances give back their colour under D65", "[spectra][rgb]") {
    const double steps[] = {0, .001, .02, .1, .3, .5, .8, .97, 1};
    for (const double r : steps)
        for (const double g : steps)
            for (const double b : steps) {
                const Spectrum s = rgbReflectance({r, g, b});
                const Vec3d back = underD65(s);
                CAPTURE(r, g, b, back[0], back[1], back[2]);
                REQUIRE(std::abs(back[0] - r) < 1e-3);
                REQUIRE(std::abs(back[1] - g) < 1e-3);
                REQUIRE(std::abs(back[2] - b) < 1e-3);
                REQUIRE(s.min() >= 0);
                REQUIRE(s.max() <= 1);
                if (r == g && g == b) REQUIRE(s == constantSpectrum(r));
            }
    // Next to grey is next to constant: no jump where the exact case takes over.
    const Spectrum near_grey = rgbReflectance({.5, .5, .5 + 1e-9});
    CHECK(near_grey.max() - near_grey.min() < 1e-7);

    CHECK_THROWS_AS(rgbReflectance({-.01, 0, 0}), Error);
    CHECK_THROWS_AS(rgbReflectance({0, 1.01, 0}), Error);
    CHECK_THROWS_AS(rgbReflectance({0, 0, std::numeric_limits<double>::quiet_NaN()}), Error);
}

TEST_CASE("RGB emissions keep colour and strength", "[spectra][rgb]") {
    for (const Vec3d& rgb : {Vec3d{1, 1, 1}, {17, 12, 4}, {0, 0, 3}, {1e-6, 2e-6, 1e-6}, {1e6, 0, 0}}) {
        const Vec3d back = multiply(xyzToRgb(ColorSpace::LinearSrgb), spectrumToXyz(rgbEmission(rgb)));
        const double top = std::max({rgb[0], rgb[1], rgb[2]});
        CAPTURE(rgb[0], rgb[1], rgb[2]);
        for (int i = 0; i < 3; ++i) CHECK(std::abs(back[i] - rgb[i]) < 1e-3 * top);
    }
    const Spectrum white = rgbEmission({1, 1, 1}), d65 = *illuminantSpectrum("D65");
    for (std::size_t i = 0; i < white.values.size(); ++i) REQUIRE(white[i] == Approx(d65[i]).epsilon(1e-12));
    CHECK(rgbEmission({0, 0, 0}) == constantSpectrum(0));
    CHECK_THROWS_AS(rgbEmission({-1, 0, 0}), Error);
    CHECK_THROWS_AS(rgbEmission({std::numeric_limits<double>::infinity(), 0, 0}), Error);
}

TEST_CASE("the sRGB transfer function is its own inverse", "[spectra][rgb]") {
    for (int i = 0; i <= 255; ++i)
        CHECK(linearToSrgb(srgbToLinear(i / 255.0)) == Approx(i / 255.0).margin(1e-7));
    CHECK(srgbToLinear(1) == Approx(1).epsilon(1e-15));
    CHECK(srgbToLinear(.5) == Approx(.21404114).margin(1e-8));
}

TEST_CASE("colour spaces have the published matrices and map white to white", "[spectra]") {
    // IEC 61966-2-1 prints four digits.
    const double iec[3][3] = {{3.2406, -1.5372, -.4986}, {-.9689, 1.8758, .0415}, {.0557, -.2040, 1.0570}};
    const Matrix3d srgb = xyzToRgb(ColorSpace::LinearSrgb);
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) CHECK(srgb[r][c] == Approx(iec[r][c]).margin(5e-4));
    for (const ColorSpace space : {ColorSpace::LinearSrgb, ColorSpace::AcesCg}) {
        const Vec3d white = multiply(xyzToRgb(space), d65WhiteXyz());
        for (const double v : white) CHECK(v == Approx(1).epsilon(1e-12));
    }
    const Vec3d v{.2, .3, .4};
    CHECK(multiply(xyzToRgb(ColorSpace::Xyz), v) == v);

    // Adaptation takes one white to the other and back.
    const Vec3d d50{.96422, 1, .82521};
    const Matrix3d there = bradfordAdaptation(d65WhiteXyz(), d50),
                   back = bradfordAdaptation(d50, d65WhiteXyz());
    const Vec3d mapped = multiply(there, d65WhiteXyz());
    const Matrix3d both = multiply(back, there);
    for (int i = 0; i < 3; ++i) {
        CHECK(mapped[i] == Approx(d50[i]).epsilon(1e-12));
        for (int j = 0; j < 3; ++j) CHECK(both[i][j] == Approx(i == j ? 1 : 0).margin(1e-12));
    }
    CHECK(there[0][0] == Approx(1.0478112).margin(1e-3));  // Lindbloom's D65 → D50.
}
