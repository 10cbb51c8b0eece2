#include "binding.h"

#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

namespace nb = nanobind;
using namespace nb::literals;

namespace crt_python {
namespace {

/// The image's own memory, which the array keeps alive. [height][width][channels]
nb::ndarray<nb::numpy, const float, nb::ndim<3>> pixelsOf(nb::object self) {
    const crt::Image& image = nb::cast<const crt::Image&>(self);
    return {image.pixels().data(), {image.height(), image.width(), image.channels().size()}, self};
}

}  // namespace

void bindImage(nb::module_& module) {
    nb::class_<crt::Image>(module, "Image", "Named planes of floats.")
        .def_static("load", &crt::Image::load, "path"_a, nb::call_guard<nb::gil_scoped_release>(),
                    "From PFM, PPM, EXR, PNG or Radiance HDR; values are linear.")
        .def(
            "save", [](const crt::Image& image, const std::string& path) { image.save(path); }, "path"_a,
            nb::call_guard<nb::gil_scoped_release>(),
            "By the extension: .exr keeps everything, .pfm floats, .png and .ppm 8 bits of sRGB.")
        .def_prop_ro("width", &crt::Image::width)
        .def_prop_ro("height", &crt::Image::height)
        .def_prop_ro("channels", &crt::Image::channels)
        .def_prop_ro("pixels", &pixelsOf);
}

}  // namespace crt_python
