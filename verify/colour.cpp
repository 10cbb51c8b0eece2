// Group H: spectra and colour.
#include "film/resolve.h"
#include "verify/context.h"
#include "verify/scenes.h"

#include "compile/compile.h"
#include "image/image_io.h"
#include "kernel/dialect/features.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

namespace crt::verify {
namespace {

constexpr std::uint64_t kLamp = CRT_FEATURE_AREA_LIGHT;
constexpr const char* kEye = "{position: [0, 0, 0], target: [0, 0, 1], fov: 1}";

/// A film full of a lamp with this spectrum.
std::string lamp(const std::string& radiance) {
    return Stage(kEye, "{max_depth: 0}")
        .material("black", "{type: diffuse, reflectance: 0}")
        .quad("lamp", "[[-1,-1,1],[-1,1,1],[1,1,1],[1,-1,1]]", "black", radiance + ", two_sided: true")
        .yaml();
}

/// ∫ L (x̄, ȳ, z̄) dλ / ∫ȳ dλ by trapezoids of 0.01 nm, all tables linear between nanometres as
/// the kernels have them.
Vec3d integrate(const std::function<double(double)>& radiance, double from_nm, double to_nm,
                double step_nm = 0.01) {
    const auto& cie = cieObserver();
    Vec3d xyz{};
    const auto steps = static_cast<int>(std::lround((to_nm - from_nm) / step_nm));
    for (int k = 0; k <= steps; ++k) {
        const double nm = from_nm + k * step_nm;
        const auto i = std::min(static_cast<std::size_t>(nm - kWavelengthMin_nm),
                                static_cast<std::size_t>(kSpectrumSize - 2));
        const double f = nm - kWavelengthMin_nm - static_cast<double>(i);
        const double weight = radiance(nm) * step_nm * (k == 0 || k == steps ? 0.5 : 1) / cieYIntegral();
        for (std::size_t c = 0; c < 3; ++c) xyz[c] += weight * (cie[c][i] + f * (cie[c][i + 1] - cie[c][i]));
    }
    return xyz;
}

double onGrid(const Spectrum& s, double nm) {
    const auto i = std::min(static_cast<std::size_t>(nm - kWavelengthMin_nm),
                            static_cast<std::size_t>(kSpectrumSize - 2));
    return s[i] + (nm - kWavelengthMin_nm - static_cast<double>(i)) * (s[i + 1] - s[i]);
}

/// Triangle of base 2w and area w · height around a line.
std::string line(double nm, double half_width_nm, double height = 1) {
    return fmt::format("{{table: {{nm: [{:.6f}, {:.6f}, {:.6f}], value: [0, {}, 0]}}, outside: zero}}",
                       nm - half_width_nm, nm, nm + half_width_nm, height);
}

const Measure kY = [](const Film& film) { return meanXyz(film)[1]; };

void spectralLines(Context& context) {
    for (const double half_width : {10.0, 5.0, 1.0}) {
        const double expected =
            integrate([=](double nm) { return std::max(0.0, 1 - std::abs(nm - 589) / half_width); },
                      589 - half_width, 589 + half_width)[1];
        context.estimate(fmt::format("589 nm, half width {} nm: Y with 4096 samples", half_width),
                         lamp(line(589, half_width)), kY, expected, 0.002,
                         {.samples = 4096, .most = 4096, .seeds = 64},
                         {{0, "the line falls between the wavelengths that are sampled"}});
    }
}

void linesOffTheGrid(Context& context) {
    // The same power wherever the line lies and however narrow it is: half widths of 0.4, 0.05 and 0.005 nm,
    // heights to match.
    const auto& cie = cieObserver();
    for (const double nm : {589.0, 589.3, 589.5, 588.995})
        for (const double half_width : {0.4, 0.05, 0.005}) {
            const Scene scene = context.scene(lamp(line(nm, half_width, 1 / half_width)));
            const Spectrum& s = scene.emissions.front().radiance;
            double power = 0, moment = 0;
            for (std::size_t i = 0; i < s.values.size(); ++i) {
                power += s[i];
                moment += s[i] * (static_cast<double>(i) + kWavelengthMin_nm);
            }
            context.relative(fmt::format("{} ± {} nm: power", nm, half_width), power, 1, 1e-4,
                             {{0, "a line between two nanometres is lost"},
                              {1 / half_width, "a narrow line is taken for one of a nanometre"}});
            context.absolute(fmt::format("{} ± {} nm: mean wavelength, nm", nm, half_width), moment / power,
                             nm, 1e-3);
        }
    const double expected = onGrid(cie[1], 589.3) / cieYIntegral();
    context.estimate("589.3 ± 0.05 nm: Y", lamp(line(589.3, 0.05, 20)), kY, expected, 0.002,
                     {.samples = 16384, .most = 65536});
}

/// Chromaticity of a film of the line at `nm`.
void chromaticityOf(Context& context, const Film& film, double nm, double x, double y, double tolerance,
                    const std::string& source) {
    const Vec3d xyz = meanXyz(film);
    const double sum = xyz[0] + xyz[1] + xyz[2];
    context.absolute(fmt::format("{} nm: x {}", nm, source), xyz[0] / sum, x, tolerance);
    context.absolute(fmt::format("{} nm: y {}", nm, source), xyz[1] / sum, y, tolerance);
}

void sodium(Context& context) {
    const Scene scene = context.scene(lamp(line(589, 1)));
    const Film film = context.render(scene, {.samples = 65536});
    chromaticityOf(context, film, 589, 0.5690, 0.4303, 0.002, "(CIE 1931)");
    const Image image = resolveImage(film, developmentOf(scene).forFloats(), 0);
    const double scale = cieYIntegral();
    const Vec3d xyz =
        integrate([](double nm) { return std::max(0.0, 1 - std::abs(nm - 589)); }, 588, 590, 0.01);
    constexpr std::array<Vec3d, 3> kToSrgb{{{3.2409699, -1.5373832, -0.4986108},
                                            {-0.9692436, 1.8759675, 0.0415551},
                                            {0.0556301, -0.2039770, 1.0569715}}};
    for (std::size_t c = 0; c < 3; ++c) {
        const double expected =
            (kToSrgb[c][0] * xyz[0] + kToSrgb[c][1] * xyz[1] + kToSrgb[c][2] * xyz[2]) * scale;
        context.absolute(fmt::format("linear sRGB {} of a unit line", "RGB"[c]), image.pixels[c] * scale,
                         expected, 0.001, {{0, "negative values are clamped before the file"}});
    }
    Image bright = image;
    for (float& v : bright.pixels) v *= 100;
    const std::uint64_t clipped = encodeSrgb8(bright).clipped_values;
    context.holds("PNG clips and counts what is out of gamut", clipped >= 2 * film.counts.size(),
                  "2 values a pixel", "values out of gamut are clipped without a warning",
                  fmt::format("{} clipped values", clipped));
}

void fluorescent(Context& context) {
    const Spectrum f11 = *illuminantSpectrum("F11");
    const auto ask = [&](const std::string& what, const std::string& radiance,
                         const std::function<double(double)>& value) {
        const Vec3d expected = integrate(value, kWavelengthMin_nm, kWavelengthMax_nm, 0.1);
        const Vec3d measured = meanXyz(context.render(lamp(radiance), {.samples = 65536}));
        for (std::size_t c = 0; c < 3; ++c)
            context.relative(fmt::format("{}: {}", what, "XYZ"[c]), measured[c], expected[c], 1e-3);
    };
    ask("F11", "{illuminant: F11}", [&](double nm) { return onGrid(f11, nm); });
    // Read off every 5, 10 and 20 nm only: another spectrum, with other colours, which must be found just as
    // well.
    for (const int step : {5, 10, 20}) {
        std::string nm, value;
        for (int w = kWavelengthMin_nm; w <= kWavelengthMax_nm; w += step) {
            nm += fmt::format("{}{}", nm.empty() ? "" : ",", w);
            value += fmt::format("{}{:.17g}", value.empty() ? "" : ",", onGrid(f11, w));
        }
        ask(fmt::format("F11 every {} nm", step),
            fmt::format("{{table: {{nm: [{}], value: [{}]}}, outside: clamp}}", nm, value), [&](double w) {
                const double lower = kWavelengthMin_nm + std::floor((w - kWavelengthMin_nm) / step) * step;
                if (lower + step > kWavelengthMax_nm) return onGrid(f11, lower);
                const double f = (w - lower) / step;
                return onGrid(f11, lower) * (1 - f) + onGrid(f11, lower + step) * f;
            });
    }
}

Vec3d labOf(const Vec3d& xyz, const Vec3d& white) {
    const auto f = [](double t) { return t > 216.0 / 24389 ? std::cbrt(t) : (24389.0 / 27 * t + 16) / 116; };
    const double x = f(xyz[0] / white[0]), y = f(xyz[1] / white[1]), z = f(xyz[2] / white[2]);
    return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

void metamers(Context& context) {
    // A reflectance of ½, and one that differs by what D65 and the observer cannot see: the part of a wave
    // that is orthogonal to D65·(x̄, ȳ, z̄).
    const Spectrum d65 = *illuminantSpectrum("D65");
    std::array<Spectrum, 3> seen = cieObserver();
    for (Spectrum& s : seen)
        for (std::size_t i = 0; i < s.values.size(); ++i) s[i] *= d65[i];
    const auto inner = [](const Spectrum& a, const Spectrum& b) {
        double sum = 0;
        for (std::size_t i = 0; i < a.values.size(); ++i) sum += a[i] * b[i];
        return sum;
    };
    const auto subtract = [&](Spectrum& from, const Spectrum& what) {
        const double share = inner(from, what) / inner(what, what);
        for (std::size_t i = 0; i < from.values.size(); ++i) from[i] -= share * what[i];
    };
    subtract(seen[1], seen[0]);
    subtract(seen[2], seen[0]);
    subtract(seen[2], seen[1]);
    Spectrum unseen;
    for (std::size_t i = 0; i < unseen.values.size(); ++i) unseen[i] = std::sin(static_cast<double>(i) / 12);
    for (int twice = 0; twice < 2; ++twice)
        for (const Spectrum& s : seen) subtract(unseen, s);
    const double scale = 0.45 / std::max(unseen.max(), -unseen.min());
    std::string nm, value;
    for (std::size_t i = 0; i < unseen.values.size(); ++i) {
        nm += fmt::format("{}{}", i == 0 ? "" : ",", i + kWavelengthMin_nm);
        value += fmt::format("{}{:.17g}", i == 0 ? "" : ",", 0.5 + scale * unseen[i]);
    }
    const std::string metamer =
        fmt::format("{{table: {{nm: [{}], value: [{}]}}, outside: clamp}}", nm, value);
    const auto patch = [](const std::string& reflectance, const std::string& light) {
        return Stage("{position: [0, 1, 0], target: [0, 0, 0], up: [0, 0, 1], fov: 1}", kDirect)
            .set("environment", fmt::format("{{radiance: {}}}", light))
            .material("it", fmt::format("{{type: diffuse, reflectance: {}}}", reflectance))
            .quad("it", "[[-9,0,-9],[-9,0,9],[9,0,9],[9,0,-9]]", "it")
            .yaml();
    };
    const Render how{.samples = 65536};
    const Vec3d white = spectrumToXyz(d65);
    const Vec3d a = labOf(meanXyz(context.render(patch("0.5", "{illuminant: D65}"), how)), white),
                b = labOf(meanXyz(context.render(patch(metamer, "{illuminant: D65}"), how)), white);
    context.absolute("under D65: colour difference ΔE*ab", 
                     std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]),
                     0, 0.1, {});
    const double expected = (0.5 + scale * unseen[589 - kWavelengthMin_nm]) / 0.5;
    context.estimate(
        "under a line at 589 nm: ratio of their radiances",
        {patch(metamer, line(589, 1)), patch("0.5", line(589, 1))},
        [](const std::vector<Film>& f) { return meanXyz(f[0])[1] / meanXyz(f[1])[1]; }, expected, 0.003,
        {.samples = 4096, .most = 16384},
        {{1, "the line sees the colour, not the spectrum: is light carried as three numbers?"}});
}

void lasers(Context& context) {
    const auto& cie = cieObserver();
    for (const int nm : {450, 532, 638}) {
        const auto i = static_cast<std::size_t>(nm - kWavelengthMin_nm);
        const double sum = cie[0][i] + cie[1][i] + cie[2][i];
        chromaticityOf(context, context.render(lamp(line(nm, 1)), {.samples = 65536}), nm, cie[0][i] / sum,
                       cie[1][i] / sum, 0.002, "of the observer's table");
    }
}

void equalEnergy(Context& context) {
    const Vec3d expected = spectrumToXyz(constantSpectrum(1));
    const Vec3d measured = meanXyz(context.render(lamp("1"), {.samples = 1u << 18}));
    for (std::size_t c = 0; c < 3; ++c)
        context.relative(
            fmt::format("{} of radiance 1", "XYZ"[c]), measured[c], expected[c], 1e-5,
            {{0.9 * expected[c], "the white point slips: do normalisations of tables differ?"}});
    // CIE 15: the 1 nm tables sum to 106.865, 106.857 and 106.892.
    context.relative("X of the table over its Y", expected[0] / expected[1], 106.865 / 106.857, 1e-4);
    context.relative("Z of the table over its Y", expected[2] / expected[1], 106.892 / 106.857, 1e-4);
}

/// A clear cube of this index in light of illuminant A; empty: nothing.
std::string cubeInLight(const std::string& ior) {
    Stage stage("{position: [0.2, 3, 4], target: [0.5, 0.5, 0.5], fov: 5}",
                "{max_depth: 128, roulette: false}");
    stage.set("environment", "{radiance: {illuminant: A}}");
    if (!ior.empty())
        stage.material("glass", fmt::format("{{type: dielectric, ior: {}}}", ior))
            .box("cube", {0, 0, 0}, {1, 1, 1}, "glass");
    return stage.yaml();
}

void heroWavelength(Context& context) {
    // Refraction that depends on wavelength leaves one of four alive, with four times the weight: the colour
    // of what is seen through a clear body must not change.
    for (const auto& [name, ior] :
         {std::pair{"N-BK7", "{glass: N-BK7}"},
          {"diamond", "{glass: diamond}"},
          {"an index of 1.5 to 1.5000002", "{table: {nm: [360, 830], value: [1.5, 1.5000002]}}"}}) {
        std::vector<Quantity> quantities;
        for (std::size_t c = 0; c < 3; ++c)
            quantities.push_back(
                {fmt::format("{}: {} against the bare light", name, "XYZ"[c]),
                 [c](const std::vector<Film>& f) { return meanXyz(f[0])[c] / meanXyz(f[1])[c]; }, 1});
        context.estimate(quantities, {cubeInLight(ior), cubeInLight("")}, 0.005,
                         {.samples = 4096, .most = 65536},
                         {{0.25, "the hero's weight of four is missing"},
                          {4, "the hero's weight of four is applied, but the others live on"}});
    }
}

void needlessDispersion(Context& context) {
    const Film number = context.render(cubeInLight("1.5"), {.samples = 64});
    for (const auto& [what, ior] :
         {std::pair{"a table of one value", "{table: {nm: [360, 830], value: [1.5, 1.5]}}"},
          {"Cauchy's formula with A alone", "{cauchy: [1.5]}"}}) {
        context.sameBits(fmt::format("{} and the number 1.5", what), number,
                         context.render(cubeInLight(ior), {.samples = 64}),
                         "wavelengths are given up where nothing disperses");
        context.holds(
            fmt::format("{}: the kernel is left without dispersion", what),
            (compileScene(context.scene(cubeInLight(ior)), 0).header().features & CRT_FEATURE_DISPERSION) ==
                0,
            "left out", "a constant index is taken for a dispersive one");
    }
}

/// Σ over lags of the squared autocorrelation: χ² with `lags` degrees of freedom for independent
/// residuals (Ljung and Box 1978).
double ljungBox(const std::vector<double>& residuals, std::size_t lags) {
    const auto n = static_cast<double>(residuals.size());
    double variance = 0, q = 0;
    for (const double r : residuals) variance += r * r;
    for (std::size_t lag = 1; lag <= lags; ++lag) {
        double covariance = 0;
        for (std::size_t i = lag; i < residuals.size(); ++i) covariance += residuals[i] * residuals[i - lag];
        q += covariance * covariance / (variance * variance) / (n - static_cast<double>(lag));
    }
    return n * (n + 2) * q;
}

void spectralBins(Context& context) {
    // 64 bins of 5 nm from 390 to 710 nm, each with separate random numbers. Four wavelengths a path that
    // were placed or weighed unequally would show as a pattern over the bins.
    constexpr int bins = 64, seeds = 16;
    std::vector<double> residuals;
    double worst = 0;
    for (int bin = 0; bin < bins; ++bin) {
        const int from = 390 + 5 * bin;
        const auto glow = [&](double nm) {
            return std::clamp(std::min(nm - from, from + 5 - nm), 0.0, 1.0);
        };
        const Vec3d xyz = integrate(glow, from, from + 5);
        const std::string yaml = fmt::format(
            "crt: 1\nfilm: {{resolution: [4, 4]}}\nsampler: {{type: independent}}\n"
            "environment: {{radiance: {{table: {{nm: [{}, {}, {}, "
            "{}], value: [0, 1, 1, 0]}}, outside: zero}}}}\n",
            from, from + 1, from + 4, from + 5);
        std::vector<double> ratios;
        for (int seed = 0; seed < seeds; ++seed) {
            const Vec3d found = meanXyz(context.render(
                yaml, {.samples = 4096, .seed = 1 + static_cast<std::uint64_t>(seeds * bin + seed)}));
            ratios.push_back((found[0] + found[1] + found[2]) / (xyz[0] + xyz[1] + xyz[2]));
        }
        const stats::Summary summary = stats::summarize(ratios);
        residuals.push_back((summary.mean - 1) / summary.standardError());
        worst = fartherFrom(0, worst, residuals.back());
    }
    const double limit = stats::studentQuantile(1 - stats::sidak(1e-3, bins) / 2, seeds - 1);
    context.absolute("the worst bin, in standard errors of its mean", worst, 0, limit);
    const double pattern = ljungBox(residuals, 10), critical = stats::chiSquaredQuantile(1 - 1e-3, 10);
    context.holds(
        "no pattern over the bins: Ljung and Box, 10 lags", pattern < critical,
        fmt::format("below {:.1f}, p = 1e-3", critical),
        "errors repeat over the spectrum: are four wavelengths a path placed or weighed unequally?",
        fmt::format("{:.1f}", pattern));
}

void tables(Context& context) {
    context.sameBits(
        "a table of one sample, held on both sides, is a constant",
        context.render(lamp("1"), {.samples = 16}),
        context.render(lamp("{table: {nm: [550], value: [1]}, outside: clamp}"), {.samples = 16}),
        "values beyond the table are not the end values");
    context.sameBits(
        "values outside 360 to 830 nm do not matter", context.render(lamp("1"), {.samples = 16}),
        context.render(lamp("{table: {nm: [100, 300, 360, 830, 900], value: [77, 5, 1, 1, 9]}}"),
                       {.samples = 16}),
        "wavelengths beyond the range leak into it");
}

}  // namespace

std::vector<Case> colourCases() {
    constexpr std::uint64_t patch = CRT_FEATURE_DIFFUSE | CRT_FEATURE_ENVIRONMENT;
    constexpr std::uint64_t glass = CRT_FEATURE_DIELECTRIC | CRT_FEATURE_ENVIRONMENT;
    return {
        row("H01", "lines", "A line at 589 nm of half width 10, 5 and 1 nm, 4096 samples", "its luminance",
            "quadrature of 0.01 nm", "± 0.2 %", Level::Commit, kLamp, spectralLines),
        row("H02", "lines-off-grid", "Lines of half width 0.4 to 0.005 nm, on the 1 nm grid and off it",
            "their power and mean wavelength", "area of a triangle", "1e-4; ± 0.001 nm; Y ± 0.2 %",
            Level::Commit, kLamp, linesOffTheGrid),
        row("H03", "sodium", "A line at 589 nm in the file",
            "x, y = 0.5690, 0.4303; linear sRGB 2.116, 0.456, −0.099 times its power",
            "CIE 1931 table, quadrature of 0.01 nm; IEC 61966-2-1", "± 0.002; ± 0.001",
            Level::Commit, kLamp,
            sodium),
        row("H04", "fluorescent", "F11, and F11 read off every 5, 10 and 20 nm", "XYZ",
            "trapezoids of 0.1 nm", "1e-3", Level::Commit, kLamp, fluorescent),
        row("H05", "metamers", "Two reflectances that are one under D65 and two under a line at 589 nm",
            "no colour difference; the ratio of reflectances at 589 nm",
            "orthogonal to D65 times the observer", "ΔE*ab < 0.1; ± 0.3 %", Level::Commit, patch,
            metamers),
        row("H06", "lasers", "Lines at 450, 532 and 638 nm", "chromaticities of the spectral locus",
            "CIE 1931 table", "± 0.002", Level::Commit, kLamp, lasers),
        row("H07", "equal-energy", "Radiance 1 at all wavelengths", "X, Y, Z of the tables' integrals",
            "CIE 15, 1 nm tables", "1e-5; 1e-4 for the tables", Level::Commit, kLamp, equalEnergy),
        row("H08", "hero-wavelength",
            "A clear dispersive cube in the light of illuminant A: N-BK7, diamond, hardly any dispersion",
            "the bare light's X, Y and Z", "conservation of radiance", "± 0.5 %", Level::Merge,
            glass | CRT_FEATURE_DISPERSION, heroWavelength),
        row("H09", "needless-dispersion", "A constant index written as a table or a formula",
            "the image of the number 1.5, by a kernel without dispersion", "–", "same bits", Level::Commit,
            glass, needlessDispersion),
        row("H10", "spectral-bins", "Worlds that glow in one of 64 bins of 5 nm",
            "each bin's power, errors without a pattern", "quadrature of 0.01 nm; pbrt-v4 #424", "p > 1e-3",
            Level::Merge, CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_INDEPENDENT, spectralBins),
        row("H11", "tables",
            "Tables that have one sample, or reach beyond 360 to 830 nm",
            "a constant; only what lies from 360 to 830 nm counts", "docs/scene.md", "same bits",
            Level::Commit, kLamp, tables),
    };
}

}  // namespace crt::verify
