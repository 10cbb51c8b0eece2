#include "scene/gltf/gltf_file.h"

#include "base/error.h"
#include "base/input_file.h"
#include "base/words.h"
#include "scene/gltf/gltf_json.h"
#include "scene/gltf/gltf_model.h"
#include "scene/scene_limits.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <filesystem>
#include <system_error>

namespace crt {
namespace {

namespace fs = std::filesystem;
using Value = nlohmann::json;

constexpr std::string_view kMagic = "glTF";

std::uint32_t littleEndian(std::string_view bytes, std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i)
        value |= std::uint32_t{static_cast<unsigned char>(bytes[at + i])} << 8 * i;
    return value;
}

int hexDigit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

std::string percentDecoded(std::string_view uri) {
    std::string text;
    for (std::size_t i = 0; i < uri.size(); ++i) {
        const int high = uri[i] == '%' && i + 2 < uri.size() ? hexDigit(uri[i + 1]) : -1;
        const int low = high >= 0 ? hexDigit(uri[i + 2]) : -1;
        if (low < 0) {
            text += uri[i];
        } else {
            text += static_cast<char>(16 * high + low);
            i += 2;
        }
    }
    return text;
}

/// Nothing where a character is none of base 64.
std::optional<std::string> base64Decoded(std::string_view text) {
    const auto digit = [](char c) {
        if (c >= 'A' && c <= 'Z') return c - 'A';
        if (c >= 'a' && c <= 'z') return c - 'a' + 26;
        if (c >= '0' && c <= '9') return c - '0' + 52;
        return c == '+' || c == '-' ? 62 : c == '/' || c == '_' ? 63 : -1;
    };
    while (!text.empty() && text.back() == '=') text.remove_suffix(1);
    std::string bytes;
    bytes.reserve(text.size() / 4 * 3 + 3);
    std::uint32_t bits = 0;
    int count = 0;
    for (const char c : text) {
        const int value = digit(c);
        if (value < 0) return std::nullopt;
        bits = bits << 6 | static_cast<std::uint32_t>(value);
        count += 6;
        if (count < 8) continue;
        count -= 8;
        bytes += static_cast<char>(bits >> count & 0xff);
    }
    return bytes;
}

/// "http", "file", "C": what stands before the first colon of a URI that names no relative file.
std::string schemeOf(const std::string& uri) {
    const std::size_t colon = uri.find(':');
    if (colon == std::string::npos || colon == 0 || uri.find('/') < colon) return {};
    const auto allowed = [](unsigned char c) { return std::isalnum(c) || c == '+' || c == '-' || c == '.'; };
    return std::all_of(uri.begin(), uri.begin() + static_cast<std::ptrdiff_t>(colon), allowed)
               ? uri.substr(0, colon)
               : std::string();
}

bool isWithin(const fs::path& file, const fs::path& folder) {
    std::error_code unknown;
    // Absolute first: of a relative path that does not exist weakly_canonical leaves a relative one.
    const fs::path whole = fs::weakly_canonical(fs::absolute(folder.empty() ? "." : folder), unknown),
                   inner = fs::weakly_canonical(fs::absolute(file), unknown);
    const auto [end, rest] = std::mismatch(whole.begin(), whole.end(), inner.begin(), inner.end());
    return !unknown && end == whole.end();
}

/// Callbacks that refuse to read or write: tinygltf must not access files.
tinygltf::FsCallbacks noFiles() {
    return {[](const std::string&, void*) { return false; },
            [](const std::string& name, void*) { return name; },
            [](std::vector<unsigned char>*, std::string*, const std::string&, void*) { return false; },
            [](std::string*, const std::string&, const std::vector<unsigned char>&, void*) { return false; },
            nullptr};
}

}  // namespace

void GltfFile::fail(const std::string& pointer, const std::string& why) const {
    throw Error(
        ErrorKind::Scene,
        pointer.empty() ? fmt::format("{}: {}", path_, why) : fmt::format("{}: {}: {}", path_, pointer, why),
        {path_});
}

/// The chunks of a GLB; all of the content is JSON otherwise.
void GltfFile::split() {
    const std::string_view content = content_;
    if (!content.starts_with(kMagic)) {
        json_ = content;
        if (json_.starts_with("\xef\xbb\xbf")) json_.remove_prefix(3);
        return;
    }
    constexpr std::size_t kHeader = 12, kChunkHeader = 8;
    constexpr std::uint32_t kJsonChunk = 0x4e4f534a, kBinaryChunk = 0x004e4942;
    if (content.size() < kHeader + kChunkHeader) fail("", "this GLB ends within its header");
    if (const std::uint32_t version = littleEndian(content, 4); version != 2)
        fail("", fmt::format("this is a GLB of version {}; crt reads version 2", version));
    const std::uint32_t length = littleEndian(content, 8);
    if (length > content.size())
        fail("", fmt::format("this GLB should have {} bytes and ends after {}", length, content.size()));
    const std::string_view whole = content.substr(0, length);
    std::size_t number = 0;
    for (std::size_t at = kHeader; whole.size() >= at + kChunkHeader; ++number) {
        const std::uint32_t size = littleEndian(whole, at), type = littleEndian(whole, at + 4);
        at += kChunkHeader;
        if (size > whole.size() - at)
            fail("", fmt::format("chunk {} of this GLB should have {} bytes and has {}", number, size,
                                 whole.size() - at));
        if (number == 0 && type != kJsonChunk) fail("", "the first chunk of this GLB is not its JSON");
        if (number == 0) json_ = whole.substr(at, size);
        if (number == 1 && type == kBinaryChunk) binary_ = whole.substr(at, size);
        at += size;
    }
    if (number == 0) fail("", "this GLB has no chunk");
}

/// Nesting beyond the limit of JSON readers, which recurse.
void GltfFile::checkText() const {
    if (json_.size() > kMostSceneBytes)
        fail("", fmt::format("its JSON has {} bytes; crt reads up to {}", json_.size(), kMostSceneBytes));
    int depth = 0;
    bool in_text = false;
    for (std::size_t i = 0; i < json_.size(); ++i) {
        const char c = json_[i];
        if (in_text) {
            if (c == '\\') ++i;
            if (c == '"') in_text = false;
        } else if (c == '"') {
            in_text = true;
        } else if (c == '{' || c == '[') {
            if (++depth > kDeepestGltfJson)
                fail("", fmt::format("its JSON is nested more than {} deep", kDeepestGltfJson));
        } else if (c == '}' || c == ']') {
            --depth;
        }
    }
}

/// Remembers how a primitive is compressed, and which accessors are thus decoded.
void GltfFile::keepDraco(const GltfJson& json, const nlohmann::json& primitive, std::size_t mesh,
                         std::size_t number) {
    auto how = json.dracoOf(primitive, fmt::format("/meshes/{}/primitives/{}", mesh, number));
    if (!how) return;
    if (primitive.contains("indices")) draco_accessors_[primitive["indices"].get<int>()] = {mesh, number};
    const Value& attributes = primitive["attributes"];
    for (const auto& [name, id] : how->ids)
        if (const auto found = attributes.find(name); found != attributes.end())
            draco_accessors_[found->get<int>()] = {mesh, number};
    draco_[{mesh, number}] = *std::move(how);
}

void GltfFile::check(const GltfJson& json) {
    json.check();
    const auto text = [](const Value& object, const char* key) {
        const auto found = object.find(key);
        return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
    };
    const Value& buffers = json.list("buffers");
    for (std::size_t i = 0; i < buffers.size(); ++i) {
        Buffer& buffer = buffers_.emplace_back();
        buffer.uri = text(buffers[i], "uri");
        buffer.bytes =
            json.member(buffers[i], "byteLength", 0, [&] { return fmt::format("/buffers/{}", i); });
        buffer.in_container = i == 0 && !buffers[i].contains("uri") && !binary_.empty();
    }
    const Value& views = json.list("bufferViews");
    for (std::size_t i = 0; i < views.size(); ++i)
        if (const auto how = json.meshoptOf(views[i], fmt::format("/bufferViews/{}", i))) meshopt_[i] = *how;
    const Value& meshes = json.list("meshes");
    for (std::size_t i = 0; i < meshes.size(); ++i)
        for (std::size_t k = 0; k < meshes[i]["primitives"].size(); ++k)
            keepDraco(json, meshes[i]["primitives"][k], i, k);
    animations_ = json.list("animations").size();
    const Value& images = json.list("images");
    for (std::size_t i = 0; i < images.size(); ++i) {
        const auto at = [&] { return fmt::format("/images/{}", i); };
        json.index(images[i], "bufferView", json.count("bufferViews"), "buffer view", at);
        ImageSource& image = images_.emplace_back();
        image.name = text(images[i], "name");
        image.uri = text(images[i], "uri");
        if (images[i].contains("bufferView")) image.view = images[i]["bufferView"].get<int>();
    }
}

GltfFile::GltfFile(const std::string& path) : path_(path), model_(std::make_unique<tinygltf::Model>()) {
    try {
        content_ = readInput(path, kMostMeshBytes);
    } catch (const InputRefused& refused) {
        throw Error(ErrorKind::Scene, fmt::format("the glTF file '{}' {}", path, refused.what()), {path});
    }
    files_read_.push_back(path);
    if (content_.empty()) fail("", "this file is empty");
    split();
    checkText();
    GltfJson json{*this, {}};
    try {
        json.root = Value::parse(json_.begin(), json_.end());
    } catch (const Value::exception& e) {
        fail("", fmt::format("its JSON cannot be read: {}", e.what()));
    }
    check(json);
    // Removes the parts for which tinygltf would read files and images, and those that crt does not use.
    for (const char* unused : {"buffers", "images", "animations", "extras"}) json.root.erase(unused);
    if (const auto meshes = json.root.find("meshes"); meshes != json.root.end())
        for (Value& mesh : *meshes)
            for (Value& primitive : mesh["primitives"]) primitive.erase("targets");  // All of weight 0.
    // tinygltf wants a view of indices that only Draco knows. Nothing reads it.
    for (const auto& [place, how] : draco_) {
        const Value& primitive = json.root["meshes"][place.first]["primitives"][place.second];
        if (!primitive.contains("indices")) continue;
        Value& indices = json.root["accessors"][primitive["indices"].get<std::size_t>()];
        if (!indices.contains("bufferView")) indices["bufferView"] = how.view;
    }
    const std::string text = json.root.dump();
    std::vector<std::size_t> primitives;
    for (const Value& mesh : json.list("meshes")) primitives.push_back(mesh.at("primitives").size());
    json.root = {};
    tinygltf::TinyGLTF reader;
    reader.SetFsCallbacks(noFiles());
    std::string errors, warnings;
    bool read = false;
    try {
        read = reader.LoadASCIIFromString(model_.get(), &errors, &warnings, text.data(),
                                          static_cast<unsigned>(text.size()), "", tinygltf::NO_REQUIRE);
    } catch (const std::exception& e) {
        errors = e.what();
    }
    if (!read) {
        while (!errors.empty() && std::isspace(static_cast<unsigned char>(errors.back()))) errors.pop_back();
        fail("", errors.empty() ? std::string("tinygltf cannot read it") : errors.substr(0, 400));
    }
    // tinygltf leaves out what it cannot read.
    for (std::size_t i = 0; i < primitives.size(); ++i)
        if (i >= model_->meshes.size() || model_->meshes[i].primitives.size() != primitives[i])
            fail(fmt::format("/meshes/{}", i), "a primitive of this mesh cannot be read");
}

GltfFile::~GltfFile() = default;

std::string GltfFile::pathOf(const std::string& uri, const std::string& pointer) const {
    const std::string shown = uri.substr(0, 100);
    if (const std::string scheme = schemeOf(uri); !scheme.empty())
        fail(pointer, fmt::format("'{}' is not a local file: crt does not load '{}:' addresses", shown,
                                  scheme.substr(0, 20)));
    std::string name = percentDecoded(uri);
    if (name.find('\0') != std::string::npos) fail(pointer, "the name of the file has a zero byte");
    std::replace(name.begin(), name.end(), '\\', '/');
    const fs::path folder = fs::path(path_).parent_path(), file = folder / name;
    if (allow_outside_) return file.string();
    const fs::path wanted(name);
    const bool up = std::find(wanted.begin(), wanted.end(), "..") != wanted.end();
    if (wanted.is_absolute() || up || !isWithin(file, folder))
        fail(pointer, fmt::format("'{}' lies outside the folder of the glTF file; '--allow-outside' of crt "
                                  "import, or 'allow_outside: true' of an object, allows it",
                                  shown));
    return file.string();
}

std::optional<std::string> GltfFile::dataOf(const std::string& uri, const std::string& pointer) const {
    if (!uri.starts_with("data:")) return std::nullopt;
    constexpr std::string_view kBase64 = ";base64";
    const std::size_t comma = uri.find(',');
    if (comma == std::string::npos || std::string_view(uri).substr(0, comma).find(kBase64) == uri.npos)
        fail(pointer, "this data: URI has no ';base64,'");
    std::optional<std::string> bytes = base64Decoded(std::string_view(uri).substr(comma + 1));
    if (!bytes) fail(pointer, "this data: URI has a character that is not base64");
    return bytes;
}

std::string_view GltfFile::buffer(std::size_t index) {
    Buffer& buffer = buffers_[index];
    const std::string pointer = fmt::format("/buffers/{}", index);
    std::string_view bytes = binary_;
    if (!buffer.in_container) {
        if (buffer.uri.empty()) fail(pointer, "it has no 'uri', and there is no chunk of bytes for it");
        if (!buffer.read) buffer.read = dataOf(buffer.uri, pointer + "/uri");
        if (!buffer.read) {
            const std::string file = pathOf(buffer.uri, pointer + "/uri");
            try {
                buffer.read = readInput(file, kMostMeshBytes);
            } catch (const InputRefused& refused) {
                fail(pointer + "/uri", fmt::format("'{}' {}", file, refused.what()));
            }
            files_read_.push_back(file);
        }
        bytes = *buffer.read;
    }
    if (bytes.size() < buffer.bytes)
        fail(pointer + "/byteLength",
             fmt::format("it should have {} bytes and has {}", buffer.bytes, bytes.size()));
    return bytes.substr(0, buffer.bytes);
}

std::string_view GltfFile::view(int buffer_view, const std::string& pointer) {
    if (buffer_view < 0 || static_cast<std::size_t>(buffer_view) >= model_->bufferViews.size())
        fail(pointer, "it names no buffer view");
    const auto index = static_cast<std::size_t>(buffer_view);
    if (const auto how = meshopt_.find(index); how != meshopt_.end())
        return decompressed(index, how->second);
    const tinygltf::BufferView& view = model_->bufferViews[index];
    const std::string at = fmt::format("/bufferViews/{}", buffer_view);
    if (view.buffer < 0 || static_cast<std::size_t>(view.buffer) >= buffers_.size())
        fail(at + "/buffer", "it names no buffer");
    return bytesOf(static_cast<std::size_t>(view.buffer), view.byteOffset, view.byteLength, at);
}

std::string_view GltfFile::bytesOf(std::size_t index, std::uint64_t offset, std::uint64_t length,
                                   const std::string& pointer) {
    const std::string_view bytes = buffer(index);
    if (offset > bytes.size() || length > bytes.size() - offset)
        fail(pointer, fmt::format("{} bytes from {} on are beyond buffer {}, which has {}", length, offset,
                                  index, bytes.size()));
    return bytes.substr(offset, length);
}

std::string_view GltfFile::decompressed(std::size_t buffer_view, const MeshoptView& how) {
    if (const auto known = decompressed_.find(buffer_view); known != decompressed_.end())
        return known->second;
    const std::string pointer = fmt::format("/bufferViews/{}", buffer_view);
    const std::string_view bytes = bytesOf(how.buffer, how.offset, how.length, pointer);
    const std::string too_many =
        ExpansionLimit(bytes.size()).refusal(how.count, "elements of a compressed buffer view", how.stride);
    if (!too_many.empty()) fail(pointer, too_many);
    std::string made = decodeMeshopt(how, bytes);
    if (made.empty())
        fail(pointer, "meshoptimizer cannot decompress it: it is damaged, or of a version that is too new");
    return decompressed_[buffer_view] = std::move(made);
}

void GltfFile::decodePrimitive(std::size_t mesh, std::size_t primitive) {
    const auto found = draco_.find({mesh, primitive});
    if (found == draco_.end()) return;
    const DracoPrimitive how = found->second;
    draco_.erase(found);  // Once.
    const std::string pointer = fmt::format("/meshes/{}/primitives/{}", mesh, primitive);
    std::string why;
    const DracoMesh decoded(view(how.view, pointer), why);
    if (!why.empty())
        fail(pointer, fmt::format("Draco cannot decode it: {}", printable(why).substr(0, 200)));
    const tinygltf::Primitive& model = model_->meshes[mesh].primitives[primitive];
    const auto keep = [&](int accessor, const std::string& what, const auto& values) {
        const tinygltf::Accessor& form = model_->accessors[static_cast<std::size_t>(accessor)];
        DracoValues made = values(form);
        if (made.count == 0)
            fail(fmt::format("/accessors/{}", accessor),
                 fmt::format("the Draco mesh has no {} of this type", what));
        if (made.count != form.count)
            fail(fmt::format("/accessors/{}/count", accessor),
                 fmt::format("{} elements, and the Draco mesh has {}", form.count, made.count));
        decoded_[accessor] = std::move(made);
    };
    if (model.indices < 0) fail(pointer, "'indices' is missing");
    keep(model.indices, "corners",
         [&](const tinygltf::Accessor& form) { return decoded.corners(form.componentType); });
    for (const auto& [name, id] : how.ids)
        if (const auto accessor = model.attributes.find(name); accessor != model.attributes.end())
            keep(accessor->second, name, [&, unique = id](const tinygltf::Accessor& form) {
                const int components =
                    tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(form.type));
                return decoded.attribute(unique, form.componentType,
                                         static_cast<std::size_t>(std::max(components, 0)));
            });
}

const DracoValues* GltfFile::decoded(int accessor) {
    const auto primitive = draco_accessors_.find(accessor);
    if (primitive == draco_accessors_.end()) return nullptr;
    const auto [mesh, number] = primitive->second;
    decodePrimitive(mesh, number);
    const auto found = decoded_.find(accessor);
    return found == decoded_.end() ? nullptr : &found->second;
}

GltfFile::Image GltfFile::image(std::size_t index) {
    const std::string pointer = fmt::format("/images/{}", index);
    if (index >= images_.size())
        fail("/images",
             fmt::format("there is no image {}: the file has {}, counted from 0", index, images_.size()));
    const ImageSource& source = images_[index];
    Image image;
    image.name = fmt::format("{} (image {})", path_, index);
    if (source.view >= 0) {
        image.bytes = std::make_shared<const std::string>(view(source.view, pointer + "/bufferView"));
    } else if (source.uri.empty()) {
        fail(pointer, "it has neither 'uri' nor 'bufferView'");
    } else if (std::optional<std::string> data = dataOf(source.uri, pointer + "/uri")) {
        image.bytes = std::make_shared<const std::string>(*std::move(data));
    } else {
        image.file = pathOf(source.uri, pointer + "/uri");
        image.name = image.file;
    }
    return image;
}

GltfFile& GltfFiles::open(const std::string& path) {
    std::error_code unknown;
    const std::string same = fs::weakly_canonical(path, unknown).string();
    std::unique_ptr<GltfFile>& file = open_[unknown ? path : same];
    if (!file) file = std::make_unique<GltfFile>(path);
    return *file;
}

}  // namespace crt
