// EULUMDAT files: each symmetry against the luminaire that it describes, units, and what is refused.
#include "base/error.h"
#include "catch.h"
#include "scene/eulumdat_file.h"

#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <numbers>

using crt::Error;
using crt::IesProfile;
using crt::parseEulumdat;

namespace {

/// Candelas per 1,000 lm by the plane and the angle from the nadir, in degrees.
using Lamp = std::function<double(double, double)>;

/// A file of 24 planes and 19 angles, with the planes that its symmetry keeps.
std::string file(int symmetry, const Lamp& lamp, double lumens = 1000, double conversion = 1) {
    constexpr int kPlanes = 24, kAngles = 19;
    std::string text = fmt::format("Maker\n1\n{}\n{}\n15\n{}\n5\n", symmetry, kPlanes, kAngles);
    text += "Report\nName\nNumber\nfile.ldt\nDate\n";
    for (int i = 0; i < 9; ++i) text += "100\n";
    text += fmt::format("100\n80\n{}\n0\n1\n1\nLED\n{}\n3000\n1B\n20\n", conversion, lumens);
    for (int i = 0; i < 10; ++i) text += "0.5\n";
    for (int i = 0; i < kPlanes; ++i) text += fmt::format("{}\n", 15 * i);
    for (int i = 0; i < kAngles; ++i) text += fmt::format("{}\n", 5 * i);
    const int first = symmetry == 3 ? 18 : 0;
    const int count = symmetry == 0 ? 24 : symmetry == 1 ? 1 : symmetry == 4 ? 7 : 13;
    for (int k = 0; k < count; ++k)
        for (int i = 0; i < kAngles; ++i)
            text += fmt::format("{}\n", lamp((first + k) % kPlanes * 15, 5 * i));
    return text;
}

double at(const IesProfile& profile, double horizontal, double vertical) {
    for (std::size_t h = 0; h < profile.horizontal_deg.size(); ++h)
        for (std::size_t v = 0; v < profile.vertical_deg.size(); ++v)
            if (profile.horizontal_deg[h] == horizontal && profile.vertical_deg[v] == vertical)
                return profile.candela[h * profile.vertical_deg.size() + v];
    return -1;
}

std::string refusalOf(const std::string& text) {
    try {
        (void)parseEulumdat(text, "a.ldt");
    } catch (const Error& error) {
        CHECK(error.kind() == crt::ErrorKind::Scene);
        return error.what();
    }
    return "accepted";
}

}  // namespace

// Fails when planes are mirrored in the wrong one, or begin with the wrong one.
TEST_CASE("all symmetries of EULUMDAT describe the whole luminaire", "[eulumdat]") {
    // Of the direction's parts along C0, along C90 and down: each symmetry keeps what its luminaire has.
    const auto lamp = [](int symmetry) -> Lamp {
        return [symmetry](double c, double g) {
            const double phi = c * std::numbers::pi / 180, theta = g * std::numbers::pi / 180;
            const double x = std::sin(theta) * std::cos(phi), y = std::sin(theta) * std::sin(phi);
            const double across = symmetry == 0 || symmetry == 3 ? 20 * y : 20 * std::abs(y);
            const double along = symmetry == 0 || symmetry == 2 ? 30 * x : 30 * std::abs(x);
            return 100 + (symmetry == 1 ? 0 : across + along) + 10 * std::cos(theta);
        };
    };
    for (int symmetry = 0; symmetry <= 4; ++symmetry) {
        INFO("symmetry " << symmetry);
        const Lamp right = lamp(symmetry);
        const IesProfile profile = parseEulumdat(file(symmetry, right), "a.ldt");
        for (const double g : {0.0, 35.0, 90.0})
            for (const double c : {0.0, 30.0, 75.0, 90.0, 135.0, 180.0, 225.0, 270.0, 345.0}) {
                INFO("C" << c << ", G" << g);
                CHECK(at(profile, symmetry == 1 ? 0 : c, g) == Approx(right(c, g)).epsilon(1e-4));
            }
        if (symmetry != 1) {
            CHECK(profile.horizontal_deg.front() == 0);
            CHECK(profile.horizontal_deg.back() == 360);
        }
    }
}

// Fails when a factor is left out, or lines are counted wrongly.
TEST_CASE("candelas of EULUMDAT are per thousand lumens", "[eulumdat]") {
    const Lamp even = [](double, double) { return 1000 / (2 * std::numbers::pi); };  // Into the lower half.
    CHECK(luminousFlux_lm(parseEulumdat(file(1, even), "a.ldt")) == Approx(1000).epsilon(1e-3));
    CHECK(luminousFlux_lm(parseEulumdat(file(1, even, 2500, 0.8), "a.ldt")) == Approx(2000).epsilon(1e-3));
    std::string comma = file(1, even);
    std::replace(comma.begin(), comma.end(), '.', ',');  // Of numbers and names.
    CHECK(luminousFlux_lm(parseEulumdat(comma, "a.ldt")) == Approx(1000).epsilon(1e-3));
    std::string dos;
    for (const char c : file(0, even)) dos += c == '\n' ? std::string("\r\n") : std::string(1, c);
    CHECK(luminousFlux_lm(parseEulumdat(dos + "\x1a", "a.ldt")) == Approx(1000).epsilon(1e-3));
}

TEST_CASE("EULUMDAT files that are wrong are refused with their line", "[eulumdat]") {
    const Lamp even = [](double, double) { return 100; };
    const std::string good = file(4, even);
    const auto with = [&](int line, const std::string& instead) {
        std::string text;
        int number = 0;
        for (std::size_t at = 0; at < good.size();) {
            const std::size_t end = good.find('\n', at);
            text += (++number == line ? instead : good.substr(at, end - at)) + "\n";
            at = end + 1;
        }
        return text;
    };
    CHECK(refusalOf(good) == "accepted");
    CHECK_THAT(refusalOf(with(3, "5")), Contains("the symmetry is 5"));
    CHECK_THAT(refusalOf(with(3, "x")), Contains("expected the symmetry, a number"));
    CHECK_THAT(refusalOf(with(4, "22")), Contains("cannot have symmetry 4"));
    CHECK_THAT(refusalOf(with(4, "1e9")), Contains("the number of C planes"));
    CHECK_THAT(refusalOf(with(6, "1")), Contains("the number of intensities"));
    CHECK_THAT(refusalOf(with(24, "0")), Contains("must be above 0"));
    CHECK_THAT(refusalOf(with(29, "nan")), Contains("the lumens"));
    CHECK_THAT(refusalOf(with(43, "5")), Contains("horizontal angles"));
    CHECK_THAT(refusalOf(with(70, "90")), Contains("must increase"));
    CHECK_THAT(refusalOf(with(100, "-1")), Contains("it must be 0 or more"));
    CHECK_THAT(refusalOf(good + "7\n"), Contains("continues after"));
    CHECK_THAT(refusalOf(good.substr(0, good.size() / 2)), Contains("the file ends where"));
    CHECK_THAT(refusalOf(""), Contains("the file ends where"));
}
