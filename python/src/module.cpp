#include "binding.h"

NB_MODULE(_crt, module) {
    module.doc() = "libcrt for the package crt, which says what each of these means.";
    crt_python::bindErrors(module);
    crt_python::bindScene(module);
    crt_python::bindImage(module);
    crt_python::bindFilm(module);
    crt_python::bindRender(module);
}
