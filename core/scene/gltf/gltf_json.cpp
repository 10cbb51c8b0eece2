#include "scene/gltf/gltf_json.h"

#include <algorithm>
#include <initializer_list>
#include <set>

namespace crt {
namespace {

using Value = nlohmann::json;

/// Extensions whose absence would be seen, and which crt has.
const std::set<std::string, std::less<>> kKnownExtensions{"EXT_meshopt_compression",
                                                          "KHR_meshopt_compression",
                                                          "KHR_draco_mesh_compression",
                                                          "KHR_lights_punctual",
                                                          "KHR_materials_clearcoat",
                                                          "KHR_materials_emissive_strength",
                                                          "KHR_materials_ior",
                                                          "KHR_materials_iridescence",
                                                          "KHR_materials_sheen",
                                                          "KHR_materials_specular",
                                                          "KHR_materials_transmission",
                                                          "KHR_materials_unlit",
                                                          "KHR_materials_volume",
                                                          "KHR_mesh_quantization",
                                                          "KHR_texture_transform",
                                                          "KHR_materials_anisotropy",
                                                          "KHR_materials_dispersion",
                                                          "KHR_materials_variants",
                                                          "KHR_materials_diffuse_transmission",
                                                          "KHR_materials_pbrSpecularGlossiness"};

/// The object of an extension; null where it is not there.
const Value* extensionOf(const Value& object, const char* name) {
    const auto extensions = object.find("extensions");
    if (extensions == object.end() || !extensions->is_object()) return nullptr;
    const auto found = extensions->find(name);
    return found == extensions->end() ? nullptr : &*found;
}

}  // namespace

bool knowsGltfExtension(const std::string& name) { return kKnownExtensions.contains(name); }

std::string describeJson(const Value& value) {
    switch (value.type()) {
        case Value::value_t::null: return "null";
        case Value::value_t::object: return "an object";
        case Value::value_t::array: return "a list";
        case Value::value_t::string: return "a text";
        case Value::value_t::boolean: return "true or false";
        default: return value.dump();
    }
}

void GltfJson::check() const {
    checkAsset();
    checkBytes();
    checkMeshes();
    checkNodes();
    checkTextures();
}

void GltfJson::checkAsset() const {
    if (!root.is_object()) file.fail("", fmt::format("expected an object, found {}", describeJson(root)));
    const auto asset = root.find("asset");
    if (asset == root.end()) file.fail("", "this is not a glTF file: 'asset' is missing");
    requireObject(*asset, [] { return "/asset"; });
    const auto version = asset->find("version");
    if (version == asset->end() || !version->is_string())
        file.fail("/asset/version", "expected a version such as \"2.0\"");
    if (version->get_ref<const std::string&>().empty())
        file.fail("/asset/version", "expected a version such as \"2.0\", found an empty text");
    if (!version->get_ref<const std::string&>().starts_with("2."))
        file.fail("/asset/version", fmt::format("this is glTF {}; crt reads version 2.0",
                                                version->get_ref<const std::string&>().substr(0, 20)));
    const auto required = root.find("extensionsRequired");
    if (required == root.end()) return;
    requireList(*required, [] { return "/extensionsRequired"; });
    for (std::size_t i = 0; i < required->size(); ++i) {
        const Value& item = (*required)[i];
        const std::string name =
            item.is_string() ? item.get<std::string>().substr(0, 100) : describeJson(item);
        if (knowsGltfExtension(name)) continue;
        const std::string at = fmt::format("/extensionsRequired/{}", i);
        if (name == "KHR_texture_basisu")
            file.fail(at,
                      "its textures are KTX2 files, which crt does not read; export them as PNG or JPEG");
        file.fail(at, fmt::format("the file needs the extension '{}', which crt does not have", name));
    }
}

void GltfJson::checkBytes() const {
    const Value& views = list("bufferViews");
    for (std::size_t i = 0; i < views.size(); ++i) {
        const auto at = [&] { return fmt::format("/bufferViews/{}", i); };
        index(views[i], "buffer", count("buffers"), "buffer", at, true);
        member(views[i], "byteOffset", 0, at);
        member(views[i], "byteLength", 0, at);
        if (const std::uint64_t stride = member(views[i], "byteStride", 0, at);
            stride > 252 || stride % 4 != 0)
            file.fail(at() + "/byteStride",
                      fmt::format("a stride of {} bytes: it must be a multiple of 4 up to 252", stride));
        (void)meshoptOf(views[i], at());
    }
    const Value& accessors = list("accessors");
    for (std::size_t i = 0; i < accessors.size(); ++i) {
        const Value& accessor = accessors[i];
        const auto at = [&] { return fmt::format("/accessors/{}", i); };
        index(accessor, "bufferView", views.size(), "buffer view", at);
        member(accessor, "byteOffset", 0, at);
        member(accessor, "componentType", 0, at);
        if (const std::uint64_t n = member(accessor, "count", 0, at); n == 0 || n >= 0xffffffffu)
            file.fail(at() + "/count", fmt::format("{} elements: there must be 1 to 2^32 - 2", n));
        const auto type = accessor.find("type");
        static const std::set<std::string> kTypes{"SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"};
        if (type == accessor.end() || !type->is_string() || !kTypes.contains(type->get<std::string>()))
            file.fail(at() + "/type", "expected SCALAR, VEC2, VEC3, VEC4, MAT2, MAT3 or MAT4");
        const auto sparse = accessor.find("sparse");
        if (sparse == accessor.end()) continue;
        requireObject(*sparse, [&] { return at() + "/sparse"; });
        const std::uint64_t few = member(*sparse, "count", 0, [&] { return at() + "/sparse"; });
        if (few > accessor.at("count").get<std::uint64_t>())
            file.fail(at() + "/sparse/count", "there are more changes than elements");
        for (const char* part : {"indices", "values"}) {
            const auto place = [&] { return fmt::format("{}/sparse/{}", at(), part); };
            const auto found = sparse->find(part);
            if (found == sparse->end()) file.fail(place(), "it is missing");
            requireObject(*found, place);
            index(*found, "bufferView", views.size(), "buffer view", place, true);
            if (member(*found, "byteOffset", 0, place) > 0x7fffffffu)
                file.fail(place() + "/byteOffset", "this is beyond the buffer");
        }
    }
}

std::optional<MeshoptView> GltfJson::meshoptOf(const Value& view, const std::string& at) const {
    for (const char* name : {"EXT_meshopt_compression", "KHR_meshopt_compression"}) {
        const Value* const found = extensionOf(view, name);
        if (found == nullptr) continue;
        const std::string pointer = fmt::format("{}/extensions/{}", at, name);
        const auto here = [&] { return pointer; };
        requireObject(*found, here);
        index(*found, "buffer", count("buffers"), "buffer", here, true);
        const auto word = [&](const char* key, const char* fallback,
                              std::initializer_list<const char*> words) {
            const auto value = found->find(key);
            const std::string text = value == found->end() ? fallback
                                     : value->is_string()  ? value->get<std::string>()
                                                           : describeJson(*value);
            const auto place = std::find(words.begin(), words.end(), text);
            if (place == words.end())
                file.fail(
                    fmt::format("{}/{}", pointer, key),
                    fmt::format("expected {}; found '{}'", fmt::join(words, ", "), text.substr(0, 60)));
            return place - words.begin();
        };
        const MeshoptView made{
            .buffer = found->at("buffer").get<std::uint64_t>(),
            .offset = member(*found, "byteOffset", 0, here),
            .length = member(*found, "byteLength", 0, here),
            .stride = member(*found, "byteStride", 0, here),
            .count = member(*found, "count", 0, here),
            .mode = static_cast<MeshoptView::Mode>(word("mode", "", {"ATTRIBUTES", "TRIANGLES", "INDICES"})),
            .filter = static_cast<MeshoptView::Filter>(
                word("filter", "NONE", {"NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL"}))};
        if (const std::string fault = faultOf(made); !fault.empty()) file.fail(pointer, fault);
        if (made.count > 0xffffffffu ||
            made.count * made.stride != member(view, "byteLength", 0, [&] { return at; }))
            file.fail(pointer, fmt::format("{} elements of {} bytes are not the bytes of the buffer view",
                                           made.count, made.stride));
        return made;
    }
    return std::nullopt;
}

std::optional<DracoPrimitive> GltfJson::dracoOf(const Value& primitive, const std::string& at) const {
    const Value* const found = extensionOf(primitive, "KHR_draco_mesh_compression");
    if (found == nullptr) return std::nullopt;
    const std::string pointer = at + "/extensions/KHR_draco_mesh_compression";
    const auto here = [&] { return pointer; };
    requireObject(*found, here);
    index(*found, "bufferView", count("bufferViews"), "buffer view", here, true);
    DracoPrimitive made{found->at("bufferView").get<int>(), {}};
    const auto attributes = found->find("attributes");
    if (attributes == found->end()) file.fail(pointer, "'attributes' is missing");
    requireObject(*attributes, [&] { return pointer + "/attributes"; });
    for (auto it = attributes->begin(); it != attributes->end(); ++it) {
        const auto place = [&] { return fmt::format("{}/attributes/{}", pointer, it.key().substr(0, 60)); };
        if (const std::uint64_t id = whole(*it, place); id > 0xffffffffu)
            file.fail(place(), "there is no such attribute");
        else
            made.ids[it.key()] = static_cast<std::uint32_t>(id);
    }
    if (member(primitive, "mode", 4, [&] { return at; }) != 4)
        file.fail(at + "/mode", "crt reads triangles (mode 4) of Draco and nothing else");
    return made;
}

void GltfJson::checkPrimitive(const Value& primitive, const std::string& at) const {
    (void)dracoOf(primitive, at);
    const auto here = [&] { return at; };
    const auto attributes = primitive.find("attributes");
    if (attributes == primitive.end()) file.fail(at, "'attributes' is missing");
    requireObject(*attributes, [&] { return at + "/attributes"; });
    for (auto it = attributes->begin(); it != attributes->end(); ++it)
        requireIndex(*it, count("accessors"), "accessor",
                     [&] { return at + "/attributes/" + it.key().substr(0, 60); });
    index(primitive, "indices", count("accessors"), "accessor", here);
    index(primitive, "material", count("materials"), "material", here);
    if (const std::uint64_t mode = member(primitive, "mode", 4, here); mode > 6)
        file.fail(at + "/mode", fmt::format("there is no mode {}; 0 to 6", mode));
}

void GltfJson::checkMeshes() const {
    const Value& meshes = list("meshes");
    for (std::size_t i = 0; i < meshes.size(); ++i) {
        const auto at = [&] { return fmt::format("/meshes/{}/primitives", i); };
        const auto primitives = meshes[i].find("primitives");
        if (primitives == meshes[i].end()) file.fail(at(), "it is missing");
        requireList(*primitives, at);
        for (std::size_t k = 0; k < primitives->size(); ++k) {
            requireObject((*primitives)[k], [&] { return fmt::format("{}/{}", at(), k); });
            checkPrimitive((*primitives)[k], fmt::format("{}/{}", at(), k));
        }
        checkWeights(meshes[i], meshes[i], fmt::format("/meshes/{}", i));
    }
}

/// Morph targets whose weights are 0 change nothing.
void GltfJson::checkWeights(const Value& of, const Value& mesh, const std::string& at) const {
    const auto weights = of.find("weights");
    if (weights == of.end()) return;
    requireList(*weights, [&] { return at + "/weights"; });
    const bool morphed = std::any_of(weights->begin(), weights->end(),
                                     [](const Value& w) { return !w.is_number() || w.get<double>() != 0; });
    const Value& primitives = mesh.at("primitives");
    if (morphed && std::any_of(primitives.begin(), primitives.end(),
                               [](const Value& primitive) { return primitive.contains("targets"); }))
        file.fail(at + "/weights",
                  "this mesh has active morph targets, which crt does not support; apply them (shape keys) "
                  "before the export");
}

void GltfJson::checkNodes() const {
    const Value& nodes = list("nodes");
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        const Value& node = nodes[i];
        const auto at = [&] { return fmt::format("/nodes/{}", i); };
        index(node, "mesh", count("meshes"), "mesh", at);
        if (node.contains("mesh"))
            checkWeights(node, list("meshes")[node.at("mesh").get<std::size_t>()], at());
        index(node, "camera", count("cameras"), "camera", at);
        index(node, "skin", count("skins"), "skin", at);
        indices(node, "children", nodes.size(), "node", at);
        numbers(node, "matrix", 16, at);
        numbers(node, "translation", 3, at);
        numbers(node, "rotation", 4, at);
        numbers(node, "scale", 3, at);
    }
    const Value& skins = list("skins");
    for (std::size_t i = 0; i < skins.size(); ++i) {
        const auto at = [&] { return fmt::format("/skins/{}", i); };
        indices(skins[i], "joints", nodes.size(), "node", at);
        index(skins[i], "inverseBindMatrices", count("accessors"), "accessor", at);
    }
    const Value& scenes = list("scenes");
    for (std::size_t i = 0; i < scenes.size(); ++i)
        indices(scenes[i], "nodes", nodes.size(), "node", [&] { return fmt::format("/scenes/{}", i); });
    index(root, "scene", scenes.size(), "scene", [] { return std::string(); });
    list("cameras");
    list("materials");
}

void GltfJson::checkTextures() const {
    const Value& textures = list("textures");
    list("images");
    list("samplers");
    for (std::size_t i = 0; i < textures.size(); ++i) {
        const auto at = [&] { return fmt::format("/textures/{}", i); };
        index(textures[i], "source", count("images"), "image", at);
        index(textures[i], "sampler", count("samplers"), "sampler", at);
    }
}

}  // namespace crt
