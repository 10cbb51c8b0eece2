#include "binding.h"

#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstdint>
#include <string>

namespace nb = nanobind;
using namespace nb::literals;

namespace crt_python {
namespace {

/// The image's own memory, which the array keeps alive. [height][width][channels]
nb::ndarray<nb::numpy, const float, nb::ndim<3>> pixelsOf(nb::object self) {
    const crt::Image& image = nb::cast<const crt::Image&>(self);
    return {image.pixels().data(), {image.height(), image.width(), image.channels().size()}, self};
}

/// Likewise. [height][width][integer_channels]
nb::ndarray<nb::numpy, const std::uint32_t, nb::ndim<3>> integersOf(nb::object self) {
    const crt::Image& image = nb::cast<const crt::Image&>(self);
    return {image.integers().data(), {image.height(), image.width(), image.integerChannels().size()}, self};
}

nb::str describe(const crt::Image& image) {
    nb::list names;
    for (const std::string& name : image.channels()) names.append(name);
    for (const std::string& name : image.integerChannels()) names.append(name);
    return nb::str("<crt.Image {} x {}: {}>")
        .format(image.width(), image.height(), nb::str(", ").attr("join")(names));
}

}  // namespace

void bindImage(nb::module_& module) {
    nb::class_<crt::Image>(module, "Image", "Named planes of floats, and of integers.")
        .def_static("load", &crt::Image::load, "path"_a, nb::call_guard<nb::gil_scoped_release>(),
                    "From PFM, PPM, EXR, PNG or Radiance HDR; values are linear.")
        .def(
            "save", [](const crt::Image& image, const std::string& path) { image.save(path); }, "path"_a,
            nb::call_guard<nb::gil_scoped_release>(),
            "By the extension: .exr keeps everything, .pfm floats, .png, .jpg and .ppm 8 bits of sRGB.")
        .def("__repr__", &describe)
        .def_prop_ro("width", &crt::Image::width)
        .def_prop_ro("height", &crt::Image::height)
        .def_prop_ro("channels", &crt::Image::channels)
        .def_prop_ro("pixels", &pixelsOf)
        .def_prop_ro("integer_channels", &crt::Image::integerChannels)
        .def_prop_ro("integers", &integersOf);
}

}  // namespace crt_python
