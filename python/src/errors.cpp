#include "binding.h"

#include <nanobind/stl/string.h>

namespace nb = nanobind;

namespace crt_python {
namespace {

/// Sets the exception `name` of crt.errors, made of what an error says and of more arguments.
template <class... More>
void set(const char* name, const crt::Error& error, const More&... more) {
    const nb::object type = nb::module_::import_("crt.errors").attr(name);
    const crt::SourcePlace& place = error.place();
    const nb::object exception =
        type(error.what(), static_cast<int>(error.kind()), place.file, place.line, place.column, more...);
    PyErr_SetObject(type.ptr(), exception.ptr());
}

}  // namespace

void bindErrors(nb::module_&) {
    nb::register_exception_translator([](const std::exception_ptr& thrown, void*) {
        try {
            std::rethrow_exception(thrown);
        } catch (const crt::RenderFailed& failed) {
            set("RenderFailed", failed, nb::cast(crt::Film(failed.film())));
        } catch (const crt::Error& error) {
            set("Error", error);
        }
    });
}

}  // namespace crt_python
