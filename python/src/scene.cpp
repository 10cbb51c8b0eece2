#include "binding.h"

#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <utility>

namespace nb = nanobind;
using namespace nb::literals;

namespace crt_python {
namespace {

using Overrides = std::vector<std::pair<std::string, std::string>>;

std::vector<crt::SceneOverride> overridesOf(const Overrides& pairs) {
    std::vector<crt::SceneOverride> overrides;
    for (const auto& [key, value] : pairs) overrides.push_back({key, value});
    return overrides;
}

crt::Scene fromFile(const std::string& path, const Overrides& overrides, nb::object message) {
    Listener listener(nb::none(), nb::none(), std::move(message));
    return listening(listener, [&](crt::Watch* watch) {
        return crt::Scene::fromFile(path, overridesOf(overrides), watch);
    });
}

std::string composeFile(const std::string& path, const Overrides& overrides, nb::object message) {
    Listener listener(nb::none(), nb::none(), std::move(message));
    return listening(listener, [&](crt::Watch* watch) {
        return crt::Scene::composeFile(path, overridesOf(overrides), watch);
    });
}

crt::Scene fromText(const std::string& yaml, const Overrides& overrides, const std::string& name,
                    const std::string& directory, nb::object message) {
    Listener listener(nb::none(), nb::none(), std::move(message));
    return listening(listener, [&](crt::Watch* watch) {
        return crt::Scene::fromText(yaml, overridesOf(overrides), watch, name, directory);
    });
}

std::string composeText(const std::string& yaml, const Overrides& overrides, const std::string& name,
                        const std::string& directory, nb::object message) {
    Listener listener(nb::none(), nb::none(), std::move(message));
    return listening(listener, [&](crt::Watch* watch) {
        return crt::Scene::composeText(yaml, overridesOf(overrides), watch, name, directory);
    });
}

}  // namespace

void bindScene(nb::module_& module) {
    nb::class_<crt::Scene>(module, "Scene", "A scene that has been read and checked. It never changes.")
        .def_static("from_file", &fromFile, "path"_a, "overrides"_a, "message"_a.none())
        .def_static("from_text", &fromText, "yaml"_a, "overrides"_a, "name"_a, "directory"_a,
                    "message"_a.none())
        .def_static("compose_file", &composeFile, "path"_a, "overrides"_a, "message"_a.none())
        .def_static("compose_text", &composeText, "yaml"_a, "overrides"_a, "name"_a, "directory"_a,
                    "message"_a.none())
        .def_prop_ro("title", &crt::Scene::title)
        .def_prop_ro("width", &crt::Scene::width)
        .def_prop_ro("height", &crt::Scene::height)
        .def_prop_ro("samples", &crt::Scene::samples)
        .def_prop_ro("seed", &crt::Scene::seed)
        .def_prop_ro("files_read", &crt::Scene::filesRead);
}

}  // namespace crt_python
