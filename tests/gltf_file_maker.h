/// glTF files for tests, built from JSON and bytes.
#pragma once

#include <nlohmann/json.hpp>

#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace crt::test {

using Json = nlohmann::json;

template <class T>
std::string bytesOf(const std::vector<T>& values) {
    std::string bytes(values.size() * sizeof(T), '\0');
    if (!values.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
    return bytes;
}

inline std::string littleEndian32(std::size_t value) {
    std::string bytes;
    for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(value >> shift & 255);
    return bytes;
}

inline std::string base64(const std::string& bytes) {
    static const char* const kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t bits = 0;
        for (std::size_t k = 0; k < 3; ++k)
            bits = bits << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
        for (std::size_t k = 0; k < 4; ++k)
            text += i + k <= bytes.size() ? kDigits[bits >> (18 - 6 * k) & 63] : '=';
    }
    return text;
}

struct GltfMaker {
    static constexpr int kByte = 5120, kUnsignedByte = 5121, kShort = 5122, kUnsignedShort = 5123,
                         kUnsignedInt = 5125, kFloat = 5126;

    Json root{{"asset", {{"version", "2.0"}}}};
    std::string binary;
    std::vector<Json> more_buffers;  ///< After the one of `binary`.

    int add(const char* list, const Json& item) {
        root[list].push_back(item);
        return static_cast<int>(root[list].size()) - 1;
    }
    int view(const std::string& bytes, std::size_t stride = 0) {
        Json item{{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", bytes.size()}};
        if (stride > 0) item["byteStride"] = stride;
        binary += bytes;
        binary.resize((binary.size() + 3) / 4 * 4);
        return add("bufferViews", item);
    }
    int accessor(int view_number, int component, const char* type, std::size_t count,
                 bool normalized = false) {
        Json item{
            {"bufferView", view_number}, {"componentType", component}, {"type", type}, {"count", count}};
        if (normalized) item["normalized"] = true;
        return add("accessors", item);
    }
    int floats(const char* type, std::size_t width, const std::vector<float>& values) {
        return accessor(view(bytesOf(values)), kFloat, type, values.size() / width);
    }
    int points(const std::vector<float>& values) { return floats("VEC3", 3, values); }
    int image(const std::string& png) {
        return add("images", {{"bufferView", view(png)}, {"mimeType", "image/png"}});
    }
    int texture(const std::string& png) { return add("textures", {{"source", image(png)}}); }
    int mesh(const Json& primitive) { return add("meshes", {{"primitives", {primitive}}}); }
    /// A node of the scene.
    int node(const Json& item) {
        const int number = add("nodes", item);
        root["scenes"][0]["nodes"].push_back(number);
        root["scene"] = 0;
        return number;
    }

    std::string glb() const {
        Json json = root;
        if (!binary.empty()) json["buffers"] = {{{"byteLength", binary.size()}}};
        for (const Json& buffer : more_buffers) json["buffers"].push_back(buffer);
        std::string text = json.dump();
        text.resize((text.size() + 3) / 4 * 4, ' ');
        std::string chunks = littleEndian32(text.size()) + "JSON" + text;
        if (!binary.empty()) chunks += littleEndian32(binary.size()) + std::string("BIN\0", 4) + binary;
        return "glTF" + littleEndian32(2) + littleEndian32(12 + chunks.size()) + chunks;
    }
    std::string gltf() const {
        Json json = root;
        if (!binary.empty())
            json["buffers"] = {{{"byteLength", binary.size()},
                                {"uri", "data:application/octet-stream;base64," + base64(binary)}}};
        return json.dump(1);
    }
};

/// A square of side 1 in the plane z = 0 that faces +z, with normals and texture coordinates, and a node.
inline GltfMaker squareFile() {
    GltfMaker maker;
    const int points = maker.points({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0});
    const int normals = maker.points({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1});
    const int uvs = maker.floats("VEC2", 2, {0, 1, 1, 1, 1, 0, 0, 0});
    const int indices = maker.accessor(maker.view(bytesOf(std::vector<std::uint16_t>{0, 1, 2, 0, 2, 3})),
                                       GltfMaker::kUnsignedShort, "SCALAR", 6);
    const int mesh =
        maker.mesh({{"attributes", {{"POSITION", points}, {"NORMAL", normals}, {"TEXCOORD_0", uvs}}},
                    {"indices", indices}});
    maker.node({{"mesh", mesh}});
    return maker;
}

}  // namespace crt::test
