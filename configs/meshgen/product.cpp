#include "product.h"

#include "png.h"
#include "vectors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace crt::meshgen {
namespace {

/// A point of a profile: distance from the axis, and height.
struct Point {
    double r, y;
};
using Profile = std::vector<Point>;

/// A quarter of a circle about (r, y) from angle `from` to `to`, in degrees from the outward direction.
void addArc(Profile& profile, Point centre, double radius, double from, double to) {
    constexpr int kPieces = 10;
    for (int i = 0; i <= kPieces; ++i) {
        const double a = (from + (to - from) * i / kPieces) * kPi / 180;
        profile.push_back({centre.r + radius * std::cos(a), centre.y + radius * std::sin(a)});
    }
}

struct Surface {
    std::vector<float> positions, normals, uvs;
    std::vector<std::uint32_t> indices;
};

/// A profile, from below to above, turned about the y axis: u around, v from the top down.
Surface turned(const Profile& profile) {
    constexpr unsigned kSegments = 160;
    Surface surface;
    std::vector<double> along{0};
    for (std::size_t i = 1; i < profile.size(); ++i)
        along.push_back(along.back() +
                        std::hypot(profile[i].r - profile[i - 1].r, profile[i].y - profile[i - 1].y));
    for (std::size_t i = 0; i < profile.size(); ++i) {
        const Point &before = profile[i > 0 ? i - 1 : 0],
                    &after = profile[std::min(i + 1, profile.size() - 1)];
        const double size = std::hypot(after.r - before.r, after.y - before.y);
        const double nr = (after.y - before.y) / size, ny = (before.r - after.r) / size;
        for (unsigned k = 0; k <= kSegments; ++k) {
            const double a = 2 * kPi * (k % kSegments) / kSegments, c = std::cos(a), s = std::sin(a);
            for (const double x : {profile[i].r * s, profile[i].y, profile[i].r * c})
                surface.positions.push_back(static_cast<float>(x));
            for (const double x : {nr * s, ny, nr * c}) surface.normals.push_back(static_cast<float>(x));
            surface.uvs.push_back(static_cast<float>(k) / kSegments);
            surface.uvs.push_back(static_cast<float>(1 - along[i] / along.back()));
        }
    }
    const auto at = [](std::size_t i, unsigned k) {
        return static_cast<std::uint32_t>(i * (kSegments + 1) + k);
    };
    for (std::size_t i = 0; i + 1 < profile.size(); ++i)
        for (unsigned k = 0; k < kSegments; ++k) {
            if (profile[i].r > 0)
                surface.indices.insert(surface.indices.end(), {at(i, k), at(i, k + 1), at(i + 1, k + 1)});
            if (profile[i + 1].r > 0)
                surface.indices.insert(surface.indices.end(), {at(i, k), at(i + 1, k + 1), at(i + 1, k)});
        }
    return surface;
}

/// A round body with rounded edges, closed below and above.
Profile drum(double radius, double lower, double upper, double rounding) {
    Profile profile{{0, lower}};
    addArc(profile, {radius - rounding, lower + rounding}, rounding, -90, 0);
    addArc(profile, {radius - rounding, upper - rounding}, rounding, 0, 90);
    profile.push_back({0, upper});
    return profile;
}

Profile flask() {
    Profile profile{{0, 0}};
    addArc(profile, {0.36, 0.06}, 0.06, -90, 0);
    addArc(profile, {0.24, 0.94}, 0.18, 0, 68);
    addArc(profile, {0.37, 1.27}, 0.17, 248, 180);
    profile.push_back({0.2, 1.34});
    profile.push_back({0, 1.34});
    return profile;
}

Profile ball(double radius, double height) {
    Profile profile;
    for (int i = 0; i <= 80; ++i) {
        const double a = kPi * (i / 80.0 - 0.5);
        profile.push_back({i % 80 == 0 ? 0 : radius * std::cos(a), height + radius * std::sin(a)});
    }
    return profile;
}

// ---- Textures -------------------------------------------------------------------------------------------

/// 0 to 1, the same for the same numbers.
double hash(int x, int y) {
    auto h = static_cast<std::uint32_t>(x) * 0x9e3779b1u ^ static_cast<std::uint32_t>(y) * 0x85ebca6bu;
    h = (h ^ h >> 15) * 0x2c1b3c6du;
    h = (h ^ h >> 12) * 0x297a2d39u;
    return (h ^ h >> 15) / 4294967296.0;
}

/// Between whole numbers, smoothly; repeats after `period` in x.
double noise(double x, double y, int period) {
    const double fx = std::floor(x), fy = std::floor(y), tx = x - fx, ty = y - fy;
    const double sx = tx * tx * (3 - 2 * tx), sy = ty * ty * (3 - 2 * ty);
    const auto at = [&](int i, int k) {
        return hash((static_cast<int>(fx) + i) % period, static_cast<int>(fy) + k);
    };
    return std::lerp(std::lerp(at(0, 0), at(1, 0), sx), std::lerp(at(0, 1), at(1, 1), sx), sy);
}

/// v of the flask's texture: its wall is about from 0.36 to 0.79.
bool isLabel(double v) { return v > 0.42 && v < 0.68; }
bool isStripe(double v) { return std::abs(v - 0.44) < 0.006 || std::abs(v - 0.66) < 0.006; }
/// A row of chevrons in the label.
bool isSign(double u, double v) {
    const double across = u * 12 - std::floor(u * 12);
    return std::abs(v - 0.55) < 0.05 && std::abs(std::abs(v - 0.55) * 6 + 0.25 - across) < 0.09;
}

Rgb flaskColor(double u, double v) {
    if (!isLabel(v)) return {0.87, 0.86, 0.84};
    if (isStripe(v) || isSign(u, v)) return {0.93, 0.90, 0.80};
    return {0.05, 0.18, 0.33};
}

/// Roughness is green, metalness blue.
Rgb flaskMetal(double u, double v) {
    const bool steel = !isLabel(v) || isStripe(v) || isSign(u, v);
    const double brushed = 0.25 + 0.22 * noise(u * 6, v * 150, 6) * noise(u * 40, v * 300, 40);
    return {1, steel ? brushed : 0.42, steel ? 1.0 : 0.0};
}

/// Grooves around the lower wall; up is green.
Rgb flaskNormal(double, double v) {
    const double within = v > 0.71 && v < 0.79 ? 1 : 0;
    const double slope = within * 0.55 * std::sin(2 * kPi * v * 110);
    const double size = std::hypot(slope, 1.0);
    return {0.5, 0.5 + 0.5 * slope / size, 0.5 + 0.5 / size};
}

/// Rings of a trunk, cut along: the round's texture goes around, so they are lines across its top.
Rgb woodColor(double u, double v) {
    const double warp = noise(u * 8, v * 5, 8), ring = std::sin((v * 30 + warp * 5) * 2) * 0.5 + 0.5;
    const double fibre = noise(u * 120, v * 12, 120);
    const double t = std::clamp(0.25 + 0.45 * ring + 0.3 * fibre, 0.0, 1.0);
    return {0.42 + 0.30 * t, 0.25 + 0.23 * t, 0.13 + 0.15 * t};
}

// ---- GLB ------------------------------------------------------------------------------------------------

class Glb {
public:
    std::size_t view(const void* bytes, std::size_t size) {
        append(views_, std::string("{\"buffer\":0,\"byteOffset\":") + std::to_string(binary_.size()) +
                           ",\"byteLength\":" + std::to_string(size) + "}");
        binary_.append(static_cast<const char*>(bytes), size);
        binary_.resize((binary_.size() + 3) / 4 * 4);
        return view_count_++;
    }
    void image(const std::string& png) {
        const std::size_t number = view(png.data(), png.size());
        append(textures_, std::string("{\"source\":") + std::to_string(image_count_++) + "}");
        append(images_,
               std::string("{\"bufferView\":") + std::to_string(number) + ",\"mimeType\":\"image/png\"}");
    }
    void material(const std::string& json) { append(materials_, json); }
    void part(const std::string& name, const Surface& surface) {
        const std::size_t positions = floats(surface.positions, 3), normals = floats(surface.normals, 3),
                          uvs = floats(surface.uvs, 2);
        const std::size_t indices = accessor(view(surface.indices.data(), surface.indices.size() * 4),
                                             "5125", surface.indices.size(), "SCALAR", "");
        const std::string number = std::to_string(part_count_++);
        append(meshes_, std::string("{\"primitives\":[{\"attributes\":{\"POSITION\":") +
                            std::to_string(positions) + ",\"NORMAL\":" + std::to_string(normals) +
                            ",\"TEXCOORD_0\":" + std::to_string(uvs) +
                            "},\"indices\":" + std::to_string(indices) + ",\"material\":" + number + "}]}");
        append(nodes_, std::string("{\"name\":\"") + name + "\",\"mesh\":" + number + "}");
        append(roots_, number);
    }
    std::string content() const {
        std::string json =
            std::string(
                "{\"asset\":{\"version\":\"2.0\",\"generator\":\"crt-meshgen\"},\"scene\":0,\"scenes\":"
                "[{\"nodes\":[") +
            roots_ + "]}],\"nodes\":[" + nodes_ + "],\"meshes\":[" + meshes_ + "],\"materials\":[" +
            materials_ + "],\"textures\":[" + textures_ + "],\"images\":[" + images_ + "],\"accessors\":[" +
            accessors_ + "],\"bufferViews\":[" + views_ +
            "],\"buffers\":[{\"byteLength\":" + std::to_string(binary_.size()) +
            "}],\"extensionsUsed\":[\"KHR_materials_clearcoat\",\"KHR_materials_transmission\","
            "\"KHR_materials_volume\",\"KHR_materials_ior\",\"KHR_texture_transform\"]}";
        json.resize((json.size() + 3) / 4 * 4, ' ');
        const std::string chunks = littleEndian(json.size()) + "JSON" + json + littleEndian(binary_.size()) +
                                   std::string("BIN\0", 4) + binary_;
        return std::string("glTF") + littleEndian(2) + littleEndian(12 + chunks.size()) + chunks;
    }

private:
    static std::string littleEndian(std::size_t value) {
        std::string bytes;
        for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(value >> shift & 255);
        return bytes;
    }
    static void append(std::string& list, const std::string& item) {
        if (!list.empty()) list += ',';
        list += item;
    }
    std::size_t accessor(std::size_t number, const char* component, std::size_t count, const char* type,
                         const std::string& more) {
        append(accessors_, std::string("{\"bufferView\":") + std::to_string(number) +
                               ",\"componentType\":" + component + ",\"count\":" + std::to_string(count) +
                               ",\"type\":\"" + type + "\"" + more + "}");
        return accessor_count_++;
    }
    std::size_t floats(const std::vector<float>& values, std::size_t width) {
        std::string more;
        if (width == 3) {
            std::array<float, 3> least{values[0], values[1], values[2]}, most = least;
            for (std::size_t i = 0; i < values.size(); ++i) {
                least[i % 3] = std::min(least[i % 3], values[i]);
                most[i % 3] = std::max(most[i % 3], values[i]);
            }
            const auto list = [](const std::array<float, 3>& v) {
                return std::string("[") + std::to_string(v[0]) + "," + std::to_string(v[1]) + "," +
                       std::to_string(v[2]) + "]";
            };
            more = ",\"min\":" + list(least) + ",\"max\":" + list(most);
        }
        return accessor(view(values.data(), values.size() * sizeof(float)), "5126", values.size() / width,
                        width == 3 ? "VEC3" : "VEC2", more);
    }

    std::string roots_, nodes_, meshes_, materials_, textures_, images_, accessors_, views_, binary_;
    std::size_t view_count_ = 0, accessor_count_ = 0, image_count_ = 0, part_count_ = 0;
};

}  // namespace

void writeProduct(const std::filesystem::path& path) {
    Glb glb;
    glb.image(pngOf(512, 512, flaskColor));
    glb.image(pngOf(512, 512, flaskMetal));
    glb.image(pngOf(4, 1024, flaskNormal));
    glb.image(pngOf(512, 256, woodColor));
    glb.part("flask", turned(flask()));
    glb.material(
        "{\"name\":\"steel with a label\",\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0},"
        "\"metallicRoughnessTexture\":{\"index\":1}},\"normalTexture\":{\"index\":2}}");
    glb.part("cap", turned(drum(0.215, 1.345, 1.62, 0.04)));
    glb.material(
        "{\"name\":\"red lacquer\",\"pbrMetallicRoughness\":{\"baseColorFactor\":[0.55,0.015,0.02,1],"
        "\"metallicFactor\":0,\"roughnessFactor\":0.5},\"extensions\":{\"KHR_materials_clearcoat\":"
        "{\"clearcoatFactor\":1,\"clearcoatRoughnessFactor\":0.03}}}");
    glb.part("ball", turned(ball(0.17, 1.792)));
    glb.material(
        "{\"name\":\"glass\",\"pbrMetallicRoughness\":{\"metallicFactor\":0,\"roughnessFactor\":0},"
        "\"extensions\":{\"KHR_materials_transmission\":{\"transmissionFactor\":1},"
        "\"KHR_materials_ior\":{\"ior\":1.52},\"KHR_materials_volume\":{\"thicknessFactor\":0.34,"
        "\"attenuationDistance\":0.5,\"attenuationColor\":[0.75,0.93,0.87]}}}");
    glb.part("round", turned(drum(0.8, -0.12, -0.002, 0.03)));
    glb.material(
        "{\"name\":\"wood\",\"pbrMetallicRoughness\":{\"metallicFactor\":0,\"roughnessFactor\":0.45,"
        "\"baseColorTexture\":{\"index\":3,\"extensions\":{\"KHR_texture_transform\":{\"scale\":[2,1]}"
        "}}}}");
    const std::string content = glb.content();
    std::ofstream file(path, std::ios::binary);
    file.write(content.data(), static_cast<std::streamsize>(content.size()));
    file.close();
    if (!file) throw std::runtime_error("cannot write " + path.string());
}

}  // namespace crt::meshgen
