#include "binding.h"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <utility>

namespace nb = nanobind;
using namespace nb::literals;

namespace crt_python {
namespace {

const char* wordOf(crt::StopReason reason, bool interrupted) {
    switch (reason) {
        case crt::StopReason::Samples: return "samples";
        case crt::StopReason::Time: return "time";
        case crt::StopReason::Target: return "target";
        case crt::StopReason::Watch: break;
    }
    return interrupted ? "interrupted" : "stopped";
}

/// Film, why sampling ended, and the report as JSON.
nb::tuple render(crt::Session& session, const crt::RenderOptions& options, const crt::Film* earlier,
                 nb::object progress, nb::object stage, nb::object message) {
    Listener listener(std::move(progress), std::move(stage), std::move(message));
    crt::Rendered rendered = listening(listener, [&](crt::Watch* watch) {
        return earlier != nullptr ? session.render(crt::Film(*earlier), options, watch)
                                  : session.render(options, watch);
    });
    return nb::make_tuple(std::move(rendered.film), wordOf(rendered.stop, listener.interrupted()),
                          rendered.report_json);
}

std::vector<crt::Plugin> plugins(nb::object message) {
    Listener listener(nb::none(), nb::none(), std::move(message));
    return listening(listener, [](crt::Watch* watch) { return crt::listPlugins(watch); });
}

nb::str describeDevice(const crt::Device& device) {
    return nb::str("<crt.Device {}: {}>").format(device.index, device.name);
}

nb::str describePlugin(const crt::Plugin& plugin) {
    if (!plugin.reason.empty())
        return nb::str("<crt.Plugin {}, which cannot run here: {}>").format(plugin.name, plugin.reason);
    nb::list names;
    for (const crt::Device& device : plugin.devices) names.append(device.name);
    return nb::str("<crt.Plugin {} on {}>").format(plugin.name, nb::str(", ").attr("join")(names));
}

}  // namespace

void bindRender(nb::module_& module) {
    nb::class_<crt::RenderOptions>(module, "RenderOptions")
        .def(nb::init<>())
        .def_rw("backend", &crt::RenderOptions::backend)
        .def_rw("device", &crt::RenderOptions::device)
        .def_rw("threads", &crt::RenderOptions::threads)
        .def_rw("use_cache", &crt::RenderOptions::use_cache)
        .def_rw("samples", &crt::RenderOptions::samples)
        .def_rw("sample_range", &crt::RenderOptions::sample_range)
        .def_rw("time_limit_seconds", &crt::RenderOptions::time_limit_seconds)
        .def_rw("target_error", &crt::RenderOptions::target_error)
        .def_rw("estimate_error", &crt::RenderOptions::estimate_error);
    nb::class_<crt::Session>(module, "Session", "Renders of one scene on devices that stay open.")
        .def(nb::init<const crt::Scene&>(), "scene"_a)
        .def("render", &render, "options"_a, "earlier"_a.none(), "progress"_a.none(), "stage"_a.none(),
             "message"_a.none());

    nb::class_<crt::Device>(module, "Device", "A device of a backend.")
        .def_ro("index", &crt::Device::index)
        .def_ro("name", &crt::Device::name)
        .def_ro("driver", &crt::Device::driver)
        .def_ro("memory_bytes", &crt::Device::memory_bytes)
        .def("__repr__", &describeDevice);
    nb::class_<crt::Plugin>(module, "Plugin", "A backend, and the reason if it cannot run here.")
        .def_ro("name", &crt::Plugin::name)
        .def_ro("path", &crt::Plugin::path)
        .def_ro("version", &crt::Plugin::version)
        .def_ro("devices", &crt::Plugin::devices)
        .def_ro("reason", &crt::Plugin::reason)
        .def("__repr__", &describePlugin);
    module.def("plugins", &plugins, "message"_a.none());
    module.def("version", &crt::version);
    module.def("bits_version", &crt::bitsVersion);
}

}  // namespace crt_python
