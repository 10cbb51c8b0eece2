// Reflectances of three numbers: the kernel's sigmoid against long double, and the table of coefficients
// against the colours that it is asked for.
#include "kernel_test.h"

#include "base/table_store.h"
#include "base/temporary_folder.h"
#include "scoped_variable.h"
#include "spectra/sigmoid.h"

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <filesystem>
#include <limits>
#include <vector>

using namespace kernel_test;

namespace {

using Color = std::array<float, 3>;

long double exactSigmoid(long double x) {
    const long double h = std::sqrt(1 + x * x);
    return x < 0 ? 1 / (2 * h * (h - x)) : 1 - 1 / (2 * h * (h + x));
}

double ulps(f32 computed, long double exact) {
    int exponent = 0;
    std::frexp(exact, &exponent);
    return static_cast<double>(std::abs(computed - exact) / std::ldexp(1.0L, std::max(exponent, -125) - 24));
}

/// Linear sRGB under D65 of what the kernel makes of coefficients, at every nanometre.
crt::Vec3d colorOf(const crt::SigmoidCoefficients& c) {
    crt::Vec3d rgb{};
    for (std::size_t i = 0; i < crt::kSpectrumSize; ++i) {
        const double s = V4X(crt_sigmoid(c[0], c[1], c[2], splat4(static_cast<f32>(i))));
        for (std::size_t k = 0; k < 3; ++k) rgb[k] += crt::rgbWeights()[k][i] * s;
    }
    return rgb;
}

}  // namespace

TEST_CASE("the sigmoid keeps its digits from black to white: below 6 ulp", "[kernel][sigmoid]") {
    Random random(5);
    double worst = 0;
    for (int i = 0; i < 300000; ++i) {
        const f32 magnitude = std::ldexp(1.0f + static_cast<f32>(random.below(1u << 23)) * 0x1p-23f,
                                         static_cast<int>(random.below(28)) - 14);
        const f32 x = random.bits() & 1 ? -magnitude : magnitude;
        const f32 s = V4X(crt_sigmoid_of(splat4(x)));
        worst = std::max(worst, ulps(s, exactSigmoid(x)));
        CHECK((s >= 0 && s <= 1));
    }
    CHECK(worst < 6);
    CHECK(V4X(crt_sigmoid_of(splat4(0))) == 0.5f);
    CHECK(V4X(crt_sigmoid_of(splat4(-FLT_MAX))) == 0);
    CHECK(V4X(crt_sigmoid_of(splat4(FLT_MAX))) == 1);
}

TEST_CASE("the sigmoid of a quadratic, at four wavelengths", "[kernel][sigmoid]") {
    const vec4 s = crt_sigmoid(0.25f, -1.5f, 2, make_vec4(0, 117.5f, 235, 470));
    CHECK(V4X(s) == Approx(static_cast<double>(exactSigmoid(0.25 + 1.5 + 2))).margin(2e-7));
    CHECK(V4Y(s) == Approx(static_cast<double>(exactSigmoid(0.25 + 0.75 + 0.5))).margin(2e-7));
    CHECK(V4Z(s) == Approx(static_cast<double>(exactSigmoid(0.25))).margin(2e-7));
    CHECK(V4W(s) == Approx(static_cast<double>(exactSigmoid(0.25 - 1.5 + 2))).margin(2e-7));
}

TEST_CASE("every colour comes back from its coefficients", "[spectra][sigmoid]") {
    double worst = 0, sum = 0;
    Color worst_at{};
    int count = 0;
    const auto ask = [&](const Color& color) {
        const crt::Vec3d found = colorOf(crt::sigmoidCoefficients(color));
        double error = 0;
        for (std::size_t k = 0; k < 3; ++k) error = std::max(error, std::abs(found[k] - double{color[k]}));
        if (error > worst) worst = error, worst_at = color;
        sum += error;
        ++count;
    };
    Random random(11);
    const auto uniform = [&] { return static_cast<f32>(random.below(1u << 24)) * 0x1p-24f; };
    for (int i = 0; i < 6000; ++i) ask({uniform(), uniform(), uniform()});
    // The faces of the cube, and dark colours.
    for (int i = 0; i < 3000; ++i) {
        Color face{uniform(), uniform(), uniform()};
        face[random.below(3)] = random.bits() & 1 ? 0.0f : 1.0f;
        ask(face);
        const f32 dark = std::pow(uniform(), 4.0f);
        ask({dark * uniform(), dark * uniform(), dark});
    }
    for (const f32 r : {0.0f, 0.5f, 1.0f})
        for (const f32 g : {0.0f, 0.5f, 1.0f})
            for (const f32 b : {0.0f, 0.5f, 1.0f}) ask({r, g, b});
    for (int i = 0; i < 2000; ++i)  // next to white
        ask({1 - 0.02f * uniform(), 1 - 0.02f * uniform(), 1 - 0.02f * uniform()});
    INFO("worst " << worst << " at " << worst_at[0] << " " << worst_at[1] << " " << worst_at[2] << ", mean "
                  << sum / count);
    CHECK(worst < 3e-3);
    CHECK(sum / count < 2e-4);
}

TEST_CASE("coefficients are those of the spectrum that a colour has", "[spectra][sigmoid]") {
    Random random(3);
    double worst = 0;
    for (int i = 0; i < 60; ++i) {
        Color color;
        for (f32& c : color) c = 0.02f + 0.96f * static_cast<f32>(random.below(1u << 24)) * 0x1p-24f;
        const crt::SigmoidCoefficients c = crt::sigmoidCoefficients(color);
        const crt::Spectrum exact = crt::rgbReflectance({color[0], color[1], color[2]});
        for (std::size_t n = 0; n < crt::kSpectrumSize; ++n)
            worst = std::max(
                worst, std::abs(V4X(crt_sigmoid(c[0], c[1], c[2], splat4(static_cast<f32>(n)))) - exact[n]));
    }
    CHECK(worst < 0.01);  // at wavelengths that D65 and the observer hardly see
}

TEST_CASE("greys are flat, and ends stay within (0, 1)", "[spectra][sigmoid]") {
    for (const f32 grey : {1e-4f, 0.02f, 0.18f, 0.5f, 0.9f, 0.999f}) {
        const crt::SigmoidCoefficients c = crt::sigmoidCoefficients({grey, grey, grey});
        CHECK(std::abs(V4X(crt_sigmoid(c[0], c[1], c[2], splat4(0))) - grey) < 1e-4f * grey);
        CHECK(std::abs(V4X(crt_sigmoid(c[0], c[1], c[2], splat4(470))) - grey) < 1e-4f * grey);
    }
    const f32 inf = std::numeric_limits<f32>::infinity(), nan = std::numeric_limits<f32>::quiet_NaN();
    for (const Color& color : {Color{0, 0, 0},
                               {1, 1, 1},
                               {-1, -2, -3},
                               {7, 7, 7},
                               {inf, 0, 1},
                               {nan, 0, 0},
                               {0, nan, 0.5f},
                               {-inf, 1, nan}}) {
        const crt::SigmoidCoefficients c = crt::sigmoidCoefficients(color);
        for (const f32 value : c) CHECK(std::isfinite(value));
    }
    CHECK(colorOf(crt::sigmoidCoefficients({0, 0, 0}))[1] < 2e-7);
    CHECK(colorOf(crt::sigmoidCoefficients({1, 1, 1}))[1] > 1 - 4e-7);
}

TEST_CASE("the table of coefficients on disk is read by the next run", "[spectra][sigmoid][cache]") {
    const crt::TemporaryFolder folder;
    const crt::ScopedVariable variable("CRT_CACHE_DIR", folder.path());
    const auto reds = [] {
        const crt::SigmoidTable table;
        std::vector<crt::SigmoidCoefficients> all;
        for (const float x : {1e-3f, 0.2f, 0.7f, 0.999f})
            all.push_back(table.coefficients({x, x / 2, x / 3}, 0, crt::SigmoidTable::level(x)));
        return all;
    };
    const auto made = reds();
    REQUIRE(std::filesystem::exists(crt::TableStore().path("sigmoids", {})));
    CHECK(reds() == made);
    // A table that would not be made is there: so it was read.
    std::vector<float> planted(3 * 24 * 48 * 48 * 4, 0.25f);
    crt::TableStore().store("sigmoids", {}, planted.data(), planted.size() * sizeof(float));
    CHECK(reds() != made);
    const crt::ScopedVariable no_folder("CRT_CACHE_DIR", "/dev/null");
    CHECK(reds() == made);
}
