#include "binding.h"

namespace nb = nanobind;

NB_MODULE(_crt, module) {
    // Others may keep films until the interpreter ends, as Dask does.
    nb::set_leak_warnings(false);
    module.doc() = "libcrt for the package crt, which documents each of these.";
    crt_python::bindErrors(module);
    crt_python::bindScene(module);
    crt_python::bindImage(module);
    crt_python::bindFilm(module);
    crt_python::bindRender(module);
}
