// View transforms of display formats: published points of their curves, and what each of them must keep.
#include "catch.h"
#include "image/development.h"
#include "image/srgb_encoding.h"
#include "image/view_transform.h"

#include <algorithm>
#include <limits>

using crt::onScreen;
using crt::Vec3d;
using crt::ViewTransform;

namespace {

Vec3d grey(double value) { return {value, value, value}; }

}  // namespace

// Fails when a coefficient is wrong.
TEST_CASE("view transforms pass through their published points", "[view_transform]") {
    CHECK(onScreen(ViewTransform::None, {-1, 0.5, 7}) == Vec3d{-1, 0.5, 7});
    // By hand: 0.18 (2.51 · 0.18 + 0.03) / (0.18 (2.43 · 0.18 + 0.59) + 0.14).
    CHECK(onScreen(ViewTransform::Filmic, grey(0.18))[0] == Approx(0.266899).epsilon(1e-5));
    CHECK(onScreen(ViewTransform::Filmic, grey(1))[1] == Approx(2.54 / 3.16).epsilon(1e-9));
    // AgX shows the middle grey with half of the screen's code, and ends 10 stops below it and 6.5 above.
    CHECK(onScreen(ViewTransform::Agx, grey(0.18))[1] == Approx(std::pow(0.5, 2.2)).epsilon(0.02));
    CHECK(onScreen(ViewTransform::Agx, grey(0.18 / 1024))[1] < 0.001);
    CHECK(onScreen(ViewTransform::Agx, grey(0.18 * 90.5))[1] > 0.97);
}

TEST_CASE("view transforms rise, stay on the screen, and keep greys grey", "[view_transform]") {
    constexpr double kInfinity = std::numeric_limits<double>::infinity(),
                     kNaN = std::numeric_limits<double>::quiet_NaN();
    for (const ViewTransform view : {ViewTransform::Filmic, ViewTransform::Agx}) {
        double before = -1;
        for (double ev = -16; ev <= 16; ev += 0.125) {
            const Vec3d shown = onScreen(view, grey(std::exp2(ev)));
            CHECK(shown[1] >= before - 2e-4);  // The fit of AgX ends in a ripple.
            before = shown[1];
            CHECK(std::max({shown[0], shown[1], shown[2]}) - std::min({shown[0], shown[1], shown[2]}) <
                  2e-3);
        }
        for (const double odd : {-1.0, 0.0, 1e30, kInfinity, -kInfinity, kNaN})
            for (const Vec3d& rgb : {Vec3d{odd, 0.5, 0.5}, Vec3d{0.5, odd, odd}})
                for (const double value : onScreen(view, rgb)) CHECK((value >= 0 && value <= 1));
    }
    // A bright red light turns white in AgX, and stays red otherwise.
    CHECK(onScreen(ViewTransform::Agx, {100, 0, 0})[1] > 0.2);
    CHECK(onScreen(ViewTransform::Filmic, {100, 0, 0})[1] == 0);
}

// Fails when the transform is applied to files of floats, or not to those of a screen.
TEST_CASE("a view transform is for display formats alone", "[view_transform]") {
    crt::Image image;
    image.width = image.height = 1;
    image.channels = {"R", "G", "B"};
    image.pixels = {4, 4, 4};
    CHECK(crt::encodeSrgb8(image).clipped_values == 3);
    image.view = ViewTransform::Filmic;
    const crt::EncodedImage encoded = crt::encodeSrgb8(image);
    CHECK(encoded.clipped_values == 0);
    CHECK(encoded.rgb[0] > 240);
    CHECK(image.pixels[0] == 4);
    crt::Development development;
    development.view = ViewTransform::Agx;
    CHECK(development.forFloats().view == ViewTransform::None);
    development.apply_to_float = true;
    development.exposure_ev = 2;
    CHECK(development.forFloats().view == ViewTransform::None);
    CHECK(development.forFloats().exposure_ev == 2);
}
