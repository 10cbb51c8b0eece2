#include "api/border.h"
#include "base/stage.h"
#include "scene/yaml/scene_yaml.h"

#include <utility>

namespace crt::v0 {
namespace {

std::vector<crt::SceneOverride> changes(const std::vector<SceneOverride>& overrides) {
    std::vector<crt::SceneOverride> list;
    for (const SceneOverride& o : overrides) list.push_back({o.key, o.value});
    return list;
}

/// Of the crop window where there is one, along an axis.
std::uint32_t extent(const FilmSettings& film, std::size_t axis, int whole) {
    const int window = film.crop[axis + 2] - film.crop[axis];
    return static_cast<std::uint32_t>(window > 0 ? window : whole);
}

}  // namespace

Scene Scene::fromFile(const std::string& path, const std::vector<SceneOverride>& overrides, Watch* watch) {
    return api::acrossBorder(watch, [&] {
        const Stage stage("reading " + path);
        return Scene(std::make_shared<const Impl>(Impl{loadScene(path, changes(overrides))}));
    });
}

Scene Scene::fromText(const std::string& yaml, const std::vector<SceneOverride>& overrides, Watch* watch,
                      const std::string& name, const std::string& directory) {
    return api::acrossBorder(watch, [&] {
        const Stage stage("reading " + name);
        return Scene(
            std::make_shared<const Impl>(Impl{parseScene(yaml, name, directory, changes(overrides))}));
    });
}

std::string Scene::composeFile(const std::string& path, const std::vector<SceneOverride>& overrides,
                               Watch* watch) {
    return api::acrossBorder(watch, [&] {
        const Stage stage("reading " + path);
        std::string text;
        loadScene(path, changes(overrides), &text);
        return text;
    });
}

std::string Scene::composeText(const std::string& yaml, const std::vector<SceneOverride>& overrides,
                               Watch* watch, const std::string& name, const std::string& directory) {
    return api::acrossBorder(watch, [&] {
        const Stage stage("reading " + name);
        std::string text;
        parseScene(yaml, name, directory, changes(overrides), &text);
        return text;
    });
}

Scene::Scene(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}
Scene::Scene(const Scene&) = default;
Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(const Scene&) = default;
Scene& Scene::operator=(Scene&&) noexcept = default;
Scene::~Scene() = default;

std::string Scene::title() const { return impl_->scene.title; }
std::uint32_t Scene::width() const { return extent(impl_->scene.film, 0, impl_->scene.film.width); }
std::uint32_t Scene::height() const { return extent(impl_->scene.film, 1, impl_->scene.film.height); }
std::uint64_t Scene::samples() const { return impl_->scene.sampler.samples; }
std::uint64_t Scene::seed() const { return impl_->scene.sampler.seed; }
const std::vector<std::string>& Scene::filesRead() const { return impl_->scene.files_read; }

}  // namespace crt::v0
