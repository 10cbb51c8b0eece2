#include "scene/yaml/scene_textures.h"

#include "base/words.h"
#include "scene/yaml/degrees.h"
#include "scene/yaml/scene_schema_textures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <utility>
#include <vector>

namespace crt {
namespace {

/// A number cannot be a map of another kind: let a misspelt texture be told as one.
bool isForm(const YamlNode& node, bool of_number) {
    if (node.kind != YamlKind::Map) return false;
    for (const SectionSchema* variant : schemaVariants("texture"))
        if (node.find(variantWord(*variant)) != nullptr) return true;
    return of_number;
}

}  // namespace

TextureReader::TextureReader(Diagnostics& out, SceneFiles& files, SpectrumReader& spectra, GltfFiles& gltf,
                             Scene& scene)
    : out_(out), files_(files), spectra_(spectra), gltf_(gltf), scene_(scene) {}

bool TextureReader::isTexture(const SectionReader& section, std::string_view key) {
    const YamlEntry* entry = section.find(key);
    return entry != nullptr && isForm(*entry->value, section.schema().find(key)->kind == ValueKind::Number);
}

std::optional<TextureIndex> TextureReader::read(const SectionReader& section, std::string_view key,
                                                TexelKind kind) {
    const YamlEntry* entry = section.find(key);
    return readForm(*entry->value, entry->place, fmt::format("'{}' of {}", key, section.subject()),
                    *section.schema().find(key), kind);
}

TextureIndex TextureReader::add(Texture texture) {
    scene_.textures.push_back(std::move(texture));
    return static_cast<TextureIndex>(scene_.textures.size() - 1);
}

std::optional<TextureIndex> TextureReader::readForm(const YamlNode& node, const YamlPlace& place,
                                                    const std::string& what, const KeySchema& row,
                                                    TexelKind kind) {
    const auto [known, fresh] = written_.try_emplace({&node, kind});
    if (!fresh) return known->second;
    const std::optional<SectionReader> form = openVariant(out_, node, place, "texture", what);
    if (!form) return std::nullopt;
    const std::string word = variantWord(form->schema());
    std::optional<Texture> texture;
    if (word == "texture") {
        texture = readImage(*form, kind);
    } else if (word == "attribute") {
        texture = readAttribute(*form, what, kind);
    } else {
        texture = readPattern(*form, row, kind);
    }
    if (!texture) return std::nullopt;
    texture->place = place.resolved();
    return written_[{&node, kind}] = add(*std::move(texture));
}

std::optional<Texture> TextureReader::readAttribute(const SectionReader& form, const std::string& what,
                                                    TexelKind kind) const {
    std::string attribute;
    if (!form.readWord("attribute", attribute)) return std::nullopt;
    const bool colors = attribute == "colors";
    if (colors == (kind == TexelKind::Numbers)) {
        form.error("attribute",
                   colors ? fmt::format("{} is a number and cannot use colours of vertices", what)
                          : fmt::format("{} is a colour and cannot use opacities of vertices", what));
        return std::nullopt;
    }
    if (!colors) return opacityOfVertices(form);
    for (const char* key : {"cutoff", "factor"})
        if (form.has(key)) form.error(key, "this key is for opacities, not for colours");
    Texture texture;
    texture.kind = Texture::Kind::VertexColors;
    return texture;
}

/// The opacity as u of two texels: linear from the middle of one to that of the other, or with a cutoff the
/// one or the other.
Texture TextureReader::opacityOfVertices(const SectionReader& form) {
    constexpr double kFirstMiddle = 0.25, kBetweenMiddles = 0.5, kEdge = 0.5;
    constexpr double kRounding =
        1e-6;  // An opacity that is the cutoff is there, whatever floats make of it.
    double factor = 1, cutoff = -1;
    form.read("factor", factor);
    form.read("cutoff", cutoff);
    Texture texture;
    texture.image = numberRamp(factor);
    texture.wrap = TextureWrap::Clamp;
    texture.of_opacity = true;
    if (cutoff < 0) {
        texture.transform = {kBetweenMiddles, 0, kFirstMiddle, 0, 1, 0};
    } else {
        texture.filter = TextureFilter::Nearest;
        texture.transform = {1, 0, kEdge - cutoff + kRounding, 0, 1, 0};
    }
    return texture;
}

/// (u, v) is scaled, turned and moved, in this order: a scale of 4 puts four images side by side.
void TextureReader::readTransform(const SectionReader& form, Texture& texture) {
    std::vector<double> scale{1, 1}, offset{0, 0};
    double degrees = 0;
    if (const YamlEntry* given = form.find("scale")) {
        if (given->value->kind == YamlKind::List) {
            form.read("scale", scale);
        } else if (double both = 1; form.read("scale", both)) {
            scale = {both, both};
        }
    }
    form.read("offset", offset);
    form.read("rotation_deg", degrees);
    const double s = sineOfDegrees(degrees), c = cosineOfDegrees(degrees);
    texture.transform = {c * scale[0], -s * scale[1], offset[0], s * scale[0], c * scale[1], offset[1]};
}

void TextureReader::readFactor(const SectionReader& form, TexelUse& use) const {
    if (const YamlEntry* given = form.find("factor")) {
        std::vector<double> factor;
        if (given->value->kind == YamlKind::List) {
            if (use.kind == TexelKind::Numbers)
                form.error("factor", "the texels are numbers here: 'factor' is one number");
            else if (form.read("factor", factor))
                use.factor = {factor[0], factor[1], factor[2]};
        } else if (double all = 1; form.read("factor", all)) {
            use.factor = {all, all, all};
        }
    }
    if (form.read("cutoff", use.cutoff) && use.kind != TexelKind::Numbers)
        form.error("cutoff", "the texels are colours here; 'cutoff' is for numbers");
}

std::optional<Texture> TextureReader::readImage(const SectionReader& form, TexelKind kind) {
    Texture texture;
    form.readEnum("filter", texture.filter);
    form.readEnum("wrap", texture.wrap);
    readTransform(form, texture);
    TexelUse use{.kind = kind};
    std::string space = "auto";
    form.readWord("color_space", space);
    use.color = space == "srgb" ? TexelColor::Srgb : space == "auto" ? TexelColor::Auto : TexelColor::Linear;
    if (kind == TexelKind::Numbers) {
        use.color = TexelColor::Auto;
        if (space == "srgb" || space == "linear")
            form.error("color_space",
                       fmt::format("the texels are numbers here, not colours; '{}' would change them",
                                   space),
                       "write 'color_space: raw', or leave it out");
        form.readEnum("channel", use.channel);
    } else if (form.has("channel")) {
        form.error("channel", "the texels are colours here; 'channel' picks one for a number");
    }
    readFactor(form, use);
    bool vertex_colors = false;
    if (form.read("vertex_colors", vertex_colors) && kind == TexelKind::Numbers)
        form.error("vertex_colors", "the texels are numbers here; colours of vertices multiply colours");
    if (vertex_colors) {
        Texture colors;
        colors.kind = Texture::Kind::VertexColors;
        colors.place = form.place("vertex_colors").resolved();
        texture.factor = TextureValue{{}, add(std::move(colors))};
    }
    texture.image = openImage(form, use);
    if (!texture.image) return std::nullopt;
    return texture;
}

/// The file that `texture` names; null where it cannot be read.
std::shared_ptr<const TextureImage> TextureReader::openImage(const SectionReader& form,
                                                             const TexelUse& use) {
    std::string name;
    if (!form.read("texture", name)) return nullptr;
    const std::optional<std::string> path = files_.locate(name, form.place("texture"), out_);
    if (!path) return nullptr;
    std::shared_ptr<const TextureImage> image;
    ImageSource source{*path};
    try {
        if (std::uint64_t number = 0; form.read("image", number)) {
            GltfFile& gltf = gltf_.open(*path);
            GltfFile::Image inside = gltf.image(number);
            for (const std::string& file : gltf.filesRead()) files_.note(file);
            source = {inside.file.empty() ? inside.name : inside.file, inside.bytes};
        }
        image = images_.open(source, use);
        requireRoom(*image, source);
    } catch (const Error& e) {
        if (e.kind() == ErrorKind::Internal) throw;
        form.error("texture", e.what());
        return nullptr;
    }
    if (!source.bytes) files_.note(source.name);
    return image;
}

TextureIndex TextureReader::readNormalMap(const SectionReader& form) {
    Texture texture;
    texture.place = form.place().resolved();
    form.readEnum("filter", texture.filter);
    form.readEnum("wrap", texture.wrap);
    readTransform(form, texture);
    texture.image = openImage(form, {.kind = TexelKind::Normals});
    return texture.image ? add(std::move(texture)) : kNoTexture;
}

bool TextureReader::readPart(const YamlNode& node, const std::string& what, const KeySchema& row,
                             TexelKind kind, TextureValue& value) {
    if (isForm(node, kind == TexelKind::Numbers)) {
        const std::optional<TextureIndex> texture = readForm(node, node.place, what, row, kind);
        value.texture = texture.value_or(kNoTexture);
        return texture.has_value();
    }
    if (kind == TexelKind::Numbers) {
        double number = 0;
        if (!readScalar(out_, node, node.place, row, what, number)) return false;
        value.spectrum = constantSpectrum(number);
        return true;
    }
    std::optional<Spectrum> spectrum =
        spectra_.read(node, node.place, what, row.range, SpectrumUse::Reflectance);
    if (spectrum) value.spectrum = *std::move(spectrum);
    return spectrum.has_value();
}

std::optional<Texture> TextureReader::readPattern(const SectionReader& form, const KeySchema& row,
                                                  TexelKind kind) {
    Texture texture;
    const std::string pattern = variantWord(form.schema());
    for (const auto& [type, word] : kPatternWords)
        if (pattern == word) texture.kind = type;
    readTransform(form, texture);
    for (const KeySchema& key : numbersOfPattern(form.schema())) {
        texture.numbers.push_back(parseNumber(key.fallback).value.value_or(0));
        form.read(key.name, texture.numbers.back());
    }
    const YamlNode* const list = form.list(pattern);
    if (list == nullptr) return std::nullopt;
    if (list->items.size() != 2) {
        form.error(pattern, fmt::format("'{}' lists two values, not {}", pattern, list->items.size()));
        return std::nullopt;
    }
    bool good = true;
    for (std::size_t i = 0; i < 2; ++i)
        good &= readPart(*list->items[i], fmt::format("value {} of {}", i + 1, form.subject()), row, kind,
                         texture.values[i]);
    if (!good) return std::nullopt;
    return texture;
}

/// Stops at the image that makes the scene larger than its files allow (scene_limits.h).
void TextureReader::requireRoom(const TextureImage& image, const ImageSource& source) {
    if (!bytes_of_.try_emplace(&image, image.words()).second) return;
    std::error_code unknown;
    const std::uintmax_t size =
        source.bytes ? source.bytes->size() : std::filesystem::file_size(source.name, unknown);
    bytes_ += 2 * image.words();
    // One image at a time is decoded, which takes more than what stays of it.
    largest_decoding_ = std::max<std::uint64_t>(largest_decoding_, 3 * image.words());
    file_bytes_ += unknown ? 0 : size;
    const ExpansionLimit limit(scene_.input_bytes + file_bytes_);
    const std::string why = limit.refusal(bytes_ + largest_decoding_, "bytes of texels", 1);
    if (!why.empty()) throw Error(ErrorKind::Scene, why);
}

TextureIndex TextureReader::addImage(const std::string& path, const TexelUse& use,
                                     const std::array<double, 6>& transform, TextureWrap wrap,
                                     const SourcePlace& place) {
    Texture texture;
    texture.image = images_.open(path, use);
    requireRoom(*texture.image, {path});
    files_.note(path);
    texture.wrap = wrap;
    texture.transform = transform;
    texture.place = place;
    return add(std::move(texture));
}

}  // namespace crt
