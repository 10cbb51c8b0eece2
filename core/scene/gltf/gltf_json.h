/// The JSON of a glTF file, read as it stands beside tinygltf: that says neither where something is wrong
/// nor that a value of the wrong kind was left out.
#pragma once

#include "scene/gltf/gltf_compression.h"
#include "scene/gltf/gltf_file.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace crt {

/// "a list", "17": what is found where something else is expected.
std::string describeJson(const nlohmann::json& value);

/// True if crt supports an extension.
bool knowsGltfExtension(const std::string& name);

/// `at` gives the JSON pointer of a value, and is asked for it only where something is wrong.
struct GltfJson {
    using Value = nlohmann::json;

    const GltfFile& file;
    Value root;

    /// The items of a list at the top; an empty one where it is not there.
    const Value& list(const char* name) const {
        static const Value nothing = Value::array();
        const auto found = root.find(name);
        if (found == root.end()) return nothing;
        requireList(*found, [&] { return fmt::format("/{}", name); });
        for (std::size_t i = 0; i < found->size(); ++i)
            requireObject((*found)[i], [&] { return fmt::format("/{}/{}", name, i); });
        return *found;
    }
    template <class At>
    void requireList(const Value& value, const At& at) const {
        if (!value.is_array())
            file.fail(at(), fmt::format("expected a list, found {}", describeJson(value)));
    }
    template <class At>
    void requireObject(const Value& value, const At& at) const {
        if (!value.is_object())
            file.fail(at(), fmt::format("expected an object, found {}", describeJson(value)));
    }
    template <class At>
    std::uint64_t whole(const Value& value, const At& at) const {
        if (!value.is_number_unsigned())
            file.fail(at(), fmt::format("expected a whole number from 0 on, found {}", describeJson(value)));
        return value.get<std::uint64_t>();
    }
    template <class At>
    void requireIndex(const Value& value, std::size_t count, const char* what, const At& at) const {
        const std::uint64_t index = whole(value, at);
        if (index >= count)
            file.fail(at(),
                      fmt::format("there is no {} {}: the file has {}, counted from 0", what, index, count));
    }
    /// Of an object's member, where it is there.
    template <class At>
    void index(const Value& object, const char* key, std::size_t count, const char* what, const At& at,
               bool required = false) const {
        const auto found = object.find(key);
        if (found != object.end())
            requireIndex(*found, count, what, [&] { return at() + "/" + key; });
        else if (required)
            file.fail(at(), fmt::format("'{}' is missing", key));
    }
    template <class At>
    std::uint64_t member(const Value& object, const char* key, std::uint64_t fallback, const At& at) const {
        const auto found = object.find(key);
        return found == object.end() ? fallback : whole(*found, [&] { return at() + "/" + key; });
    }
    template <class At>
    void numbers(const Value& object, const char* key, std::size_t count, const At& at) const {
        const auto found = object.find(key);
        if (found == object.end()) return;
        const bool good = found->is_array() && found->size() == count &&
                          std::all_of(found->begin(), found->end(), [](const Value& v) {
                              return v.is_number() && std::isfinite(v.get<double>());
                          });
        if (!good) file.fail(at() + "/" + key, fmt::format("expected a list of {} finite numbers", count));
    }
    template <class At>
    void indices(const Value& object, const char* key, std::size_t count, const char* what,
                 const At& at) const {
        const auto found = object.find(key);
        if (found == object.end()) return;
        const auto place = [&] { return at() + "/" + key; };
        requireList(*found, place);
        for (std::size_t i = 0; i < found->size(); ++i)
            requireIndex((*found)[i], count, what, [&] { return fmt::format("{}/{}", place(), i); });
    }

    std::size_t count(const char* name) const {
        const auto found = root.find(name);
        return found != root.end() && found->is_array() ? found->size() : 0;
    }

    /// Throws crt::Error(Scene) for what is of the wrong kind, or names what is not there.
    void check() const;

    /// The compression of a buffer view or a primitive; nothing if it has none. `at` is its pointer.
    std::optional<MeshoptView> meshoptOf(const Value& view, const std::string& at) const;
    std::optional<DracoPrimitive> dracoOf(const Value& primitive, const std::string& at) const;

private:
    void checkAsset() const;
    void checkBytes() const;
    void checkMeshes() const;
    void checkWeights(const nlohmann::json& of, const nlohmann::json& mesh, const std::string& at) const;
    void checkPrimitive(const Value& primitive, const std::string& at) const;
    void checkNodes() const;
    void checkTextures() const;
};

}  // namespace crt
