#include "binding.h"

#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <memory>
#include <utility>

namespace nb = nanobind;
using namespace nb::literals;

namespace crt_python {
namespace {

template <class T>
nb::ndarray<nb::numpy, T> arrayOf(std::unique_ptr<T[]> values, std::initializer_list<std::size_t> shape) {
    T* const data = values.release();
    const nb::capsule owner(data, [](void* p) noexcept { delete[] static_cast<T*>(p); });
    return nb::ndarray<nb::numpy, T>(data, shape, owner);
}

/// Means of X, Y and Z. [height][width][3]
nb::ndarray<nb::numpy, double> xyzOf(const crt::Film& film) {
    const std::size_t width = film.width(), height = film.height();
    auto values = std::make_unique<double[]>(width * height * 3);
    {
        const nb::gil_scoped_release release;
        double* next = values.get();
        for (std::uint32_t y = 0; y < height; ++y)
            for (std::uint32_t x = 0; x < width; ++x)
                for (const double value : film.mean(x, y)) *next++ = value;
    }
    return arrayOf(std::move(values), {height, width, 3});
}

/// Valid samples. [height][width]
nb::ndarray<nb::numpy, std::uint64_t> countsOf(const crt::Film& film) {
    const std::size_t width = film.width(), height = film.height();
    auto values = std::make_unique<std::uint64_t[]>(width * height);
    {
        const nb::gil_scoped_release release;
        std::uint64_t* next = values.get();
        for (std::uint32_t y = 0; y < height; ++y)
            for (std::uint32_t x = 0; x < width; ++x) *next++ = film.count(x, y);
    }
    return arrayOf(std::move(values), {height, width});
}

/// One copy, where a + b + … makes one of each sum.
crt::Film sumOfAll(const std::vector<const crt::Film*>& films) {
    crt::Film sum = *films.at(0);
    for (std::size_t i = 1; i < films.size(); ++i) sum.merge(*films[i]);
    return sum;
}

crt::Film sumOf(const crt::Film& a, const crt::Film& b) { return sumOfAll({&a, &b}); }

crt::Image develop(const crt::Film& film, bool for_display, std::optional<double> exposure_ev,
                   std::vector<std::string> aovs) {
    return film.develop({for_display, exposure_ev, std::move(aovs)});
}

nb::str describeError(const crt::ErrorEstimate& error) {
    return nb::str(
               "<crt.ErrorEstimate {:.3g} % ({:.3g} to {:.3g} %) expected; this image: at most {:.3g} %{}>")
        .format(100 * error.relative_rmse, 100 * error.relative_rmse_lower, 100 * error.relative_rmse_upper,
                100 * error.half_width_95, error.missing_light.empty() ? "" : " + missing light");
}

nb::str describeFilm(const crt::Film& film) {
    return nb::str("<crt.Film {} x {}, {} samples a pixel>")
        .format(film.width(), film.height(), film.samples());
}

}  // namespace

void bindFilm(nb::module_& module) {
    module.def("sum_films", &sumOfAll, "films"_a, nb::call_guard<nb::gil_scoped_release>());

    nb::class_<crt::ErrorEstimate>(
        module, "ErrorEstimate",
        "A film's estimate of its own error, relative to the mean luminance:\n"
        "relative_rmse with relative_rmse_lower and _upper is the expected error,\n"
        "over seeds, with its 95 % interval; half_width_95 is what the error of\n"
        "this image is at most, with a probability of 95 %. missing_light lists\n"
        "light that no sample finds and no error includes; empty: none is known.")
        .def_ro("relative_rmse", &crt::ErrorEstimate::relative_rmse)
        .def_ro("relative_rmse_lower", &crt::ErrorEstimate::relative_rmse_lower)
        .def_ro("relative_rmse_upper", &crt::ErrorEstimate::relative_rmse_upper)
        .def_ro("half_width_95", &crt::ErrorEstimate::half_width_95)
        .def_ro("mean_luminance", &crt::ErrorEstimate::mean_luminance)
        .def_ro("missing_light", &crt::ErrorEstimate::missing_light)
        .def("__repr__", &describeError);
    nb::class_<crt::Film>(module, "Film",
                          "Sums of samples: the result of a render, from which images are made.")
        .def_static("load", &crt::Film::load, "path"_a, nb::call_guard<nb::gil_scoped_release>())
        .def("save", &crt::Film::save, "path"_a, nb::call_guard<nb::gil_scoped_release>())
        .def("__repr__", &describeFilm)
        .def("__add__", &sumOf, "other"_a, nb::call_guard<nb::gil_scoped_release>())
        .def_prop_ro("width", &crt::Film::width)
        .def_prop_ro("height", &crt::Film::height)
        .def_prop_ro("samples", &crt::Film::samples)
        .def_prop_ro("sample_ranges", &crt::Film::sampleRanges)
        .def_prop_ro("aovs", &crt::Film::aovs)
        .def_prop_ro("xyz", &xyzOf, nb::rv_policy::automatic)
        .def_prop_ro("counts", &countsOf, nb::rv_policy::automatic)
        .def_prop_ro("error", &crt::Film::error)
        .def("error_within", &crt::Film::errorWithin, "target"_a,
             "True if `crt render --target-error` would stop: half_width_95 is at most the target for all\n"
             "pixels, and for the even and for the odd ones of a checkerboard.",
             nb::call_guard<nb::gil_scoped_release>())
        .def("develop", &develop, "for_display"_a = false, "exposure_ev"_a = nb::none(),
             "aovs"_a = std::vector<std::string>(), nb::call_guard<nb::gil_scoped_release>())
        .def(
            "save_image", [](const crt::Film& film, const std::string& path) { film.saveImage(path); },
            "path"_a, nb::call_guard<nb::gil_scoped_release>());
}

}  // namespace crt_python
