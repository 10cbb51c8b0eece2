/// A scene to be rendered.
#pragma once

#include <crt/export.h>
#include <crt/watch.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

CRT_API_NAMESPACE_BEGIN

/// One key of a scene and its value instead of the scene's, as `crt render --set`: {"film.resolution",
/// "[320, 240]"}. The value is YAML.
struct SceneOverride {
    std::string key, value;
};

/// A scene that has been read and checked (docs/scene.md). It never changes, so that copies share it and
/// threads may use it at once. Throws crt::Error of kind Scene with every error of the text, or Usage for an
/// override.
class CRT_API Scene {
public:
    /// Files that the scene names are looked up beside it, then among the meshes installed with crt.
    static Scene fromFile(const std::string& path, const std::vector<SceneOverride>& overrides = {},
                          Watch* watch = nullptr);
    /// From YAML in memory. `name` stands in messages; `directory` is where files are looked up.
    static Scene fromText(const std::string& yaml, const std::vector<SceneOverride>& overrides = {},
                          Watch* watch = nullptr, const std::string& name = "scene",
                          const std::string& directory = ".");
    /// The input of fromFile or fromText as one text: JSON, which is also YAML, with all included files,
    /// with the overrides, and with absolute paths of the files that it names. fromText makes the same scene
    /// of it.
    static std::string composeFile(const std::string& path, const std::vector<SceneOverride>& overrides = {},
                                   Watch* watch = nullptr);
    static std::string composeText(const std::string& yaml, const std::vector<SceneOverride>& overrides = {},
                                   Watch* watch = nullptr, const std::string& name = "scene",
                                   const std::string& directory = ".");

    Scene(const Scene&);
    Scene(Scene&&) noexcept;
    Scene& operator=(const Scene&);
    Scene& operator=(Scene&&) noexcept;
    ~Scene();

    std::string title() const;
    /// Pixels of the film, or of its crop window where there is one.
    std::uint32_t width() const;
    std::uint32_t height() const;
    /// Per pixel, where a render does not say otherwise.
    std::uint64_t samples() const;
    std::uint64_t seed() const;
    /// The scene file itself and every file that it names.
    const std::vector<std::string>& filesRead() const;

    struct Impl;
    /// For libcrt itself.
    explicit Scene(std::shared_ptr<const Impl> impl);
    const Impl& impl() const { return *impl_; }

private:
    std::shared_ptr<const Impl> impl_;
};

CRT_API_NAMESPACE_END
