// Over 450 lines: one class, which reads objects with the materials and placements that they name.
#include "scene/yaml/scene_objects.h"

#include "base/log.h"
#include "base/vec3d.h"
#include "scene/yaml/degrees.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace crt {
namespace {

bool isZero(const Vec3d& v) { return v[0] == 0 && v[1] == 0 && v[2] == 0; }
bool allFinite(const Matrix4d& m) {
    return std::all_of(m.begin(), m.end(), [](double v) { return std::isfinite(v); });
}

/// Rodrigues' rotation about a unit axis.
Matrix4d rotation(const Vec3d& a, double degrees) {
    const double s = sineOfDegrees(degrees), c = cosineOfDegrees(degrees), t = 1 - c;
    return {t * a[0] * a[0] + c,
            t * a[0] * a[1] - s * a[2],
            t * a[0] * a[2] + s * a[1],
            0,
            t * a[0] * a[1] + s * a[2],
            t * a[1] * a[1] + c,
            t * a[1] * a[2] - s * a[0],
            0,
            t * a[0] * a[2] - s * a[1],
            t * a[1] * a[2] + s * a[0],
            t * a[2] * a[2] + c,
            0,
            0,
            0,
            0,
            1};
}

/// A unit vector, also from components whose squares overflow or vanish.
Vec3d normalised(const Vec3d& v) {
    const double largest = std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])});
    const Vec3d s{v[0] / largest, v[1] / largest, v[2] / largest};
    const double length = std::sqrt(dot(s, s));
    return {s[0] / length, s[1] / length, s[2] / length};
}

/// Determinant of the linear part over the product of its rows' lengths: 0 is flat, whatever the units.
double relativeVolume(const Matrix4d& m) {
    Vec3d rows[3];
    for (std::size_t r = 0; r < 3; ++r) {
        const Vec3d row{m[4 * r], m[4 * r + 1], m[4 * r + 2]};
        if (isZero(row)) return 0;
        rows[r] = normalised(row);
    }
    return dot(rows[0], cross(rows[1], rows[2]));
}

/// Triples in a list of lists.
std::optional<std::vector<Vec3d>> readPoints(const SectionReader& mesh, std::string_view key,
                                             const char* one) {
    const YamlNode* list = mesh.list(key);
    if (list == nullptr) return std::nullopt;
    const KeySchema& row = *mesh.schema().find(key);
    std::vector<Vec3d> points;
    points.reserve(list->items.size());
    bool good = true;
    std::vector<double> values;
    for (std::size_t i = 0; i < list->items.size(); ++i) {
        const YamlNode& item = *list->items[i];
        good &= readNumbers(mesh.diagnostics(), item, item.place, row, fmt::format("{} {}", one, i), values);
        if (good) points.push_back({values[0], values[1], values[2]});
    }
    if (!good) return std::nullopt;
    return points;
}

}  // namespace

ObjectReader::ObjectReader(Diagnostics& out, SceneFiles& files, SpectrumReader& spectra,
                           TextureReader& textures, GltfFiles& gltf, Scene& scene)
    : out_(out),
      files_(files),
      spectra_(spectra),
      textures_(textures),
      gltf_(gltf),
      scene_(scene),
      limit_(scene.input_bytes) {}

ObjectReader::~ObjectReader() = default;

void ObjectReader::requireRoom(const YamlPlace& place) {
    std::string why = limit_.refusal(placements_, "placements", kBytesPerPlacement);
    if (why.empty()) why = limit_.refusal(triangles_, "triangles", kBytesPerTriangle);
    if (why.empty()) return;
    out_.error(place, why);
    out_.throwIfFailed();
}

// ---- Materials ------------------------------------------------------------------------------------------

void ObjectReader::readMaterials(const YamlNode& map) {
    for (const YamlEntry& entry : map.entries) readMaterial(entry);
    resolveParts();
}

void ObjectReader::readMaterial(const YamlEntry& entry) {
    NamedMaterial& named = materials_[entry.key];
    named.place = entry.key_place;
    material_names_.push_back(entry.key);
    if (entry.key == "from_mtl" || entry.key.empty() || looksLikeNumber(entry.key)) {
        out_.error(entry.key_place,
                   fmt::format("'{}' cannot be the name of a material: the word has another meaning there",
                               entry.key));
        return;
    }
    const std::optional<SectionReader> section =
        openVariant(out_, *entry.value, entry.place, "material", fmt::format("material '{}'", entry.key));
    if (!section) return;

    Material material;
    material.name = entry.key;
    material.place = entry.key_place.resolved();
    const auto take = [&](std::string_view key, SpectrumUse use, Spectrum& into) {
        if (std::optional<Spectrum> s = spectra_.read(*section, key, use)) into = *std::move(s);
    };
    const auto takeReflectance = [&] {
        if (TextureReader::isTexture(*section, "reflectance"))
            material.reflectance_texture =
                textures_.read(*section, "reflectance", TexelKind::Spectra).value_or(kNoTexture);
        else
            take("reflectance", SpectrumUse::Reflectance, material.reflectance);
    };
    const auto takeNumber = [&](std::string_view key, double& number, TextureIndex& texture) {
        if (TextureReader::isTexture(*section, key))
            texture = textures_.read(*section, key, TexelKind::Numbers).value_or(kNoTexture);
        else
            section->read(key, number);
    };
    const auto takeRoughness = [&] {
        takeNumber("roughness", material.roughness, material.roughness_texture);
    };
    const std::string kind = variantWord(section->schema());
    for (const auto& [type, word] : kMaterialNames)
        if (kind == word) material.type = type;
    for (const auto& [type, word] : kComposedNames)
        if (kind == word) material.type = type;
    const bool open_pbr = kind == "openpbr";
    takeNumber(open_pbr ? "geometry_opacity" : "opacity", material.opacity, material.opacity_texture);
    if (section->schema().find("normal_map") != nullptr)
        if (const auto map =
                section->section("normal_map", fmt::format("the normal map of {}", section->subject()))) {
            material.normal_texture = textures_.readNormalMap(*map);
            map->read("strength", material.normal_strength);
        }
    const auto add = [&] {
        named.index = static_cast<std::int32_t>(scene_.materials.size());
        scene_.materials.push_back(std::move(material));
    };
    if (open_pbr) {
        readOpenPbr(*section, material);
        add();
        return;
    }
    switch (material.type) {
        case MaterialType::Diffuse:
            section->read("roughness", material.diffuse_roughness);
            takeReflectance();
            makeRoughDiffuse(material);
            break;
        case MaterialType::Mirror: takeReflectance(); break;
        case MaterialType::RoughConductor: takeRoughness(); [[fallthrough]];
        case MaterialType::Conductor: {
            std::string metal;
            if (section->readWord("metal", metal))
                std::tie(material.eta, material.k) = metalIndex(metal).value();
            take("eta", SpectrumUse::Index, material.eta);
            take("k", SpectrumUse::Index, material.k);
            break;
        }
        case MaterialType::RoughDielectric: takeRoughness(); [[fallthrough]];
        case MaterialType::Dielectric:
            material.absorption = spectra_.read(*section, "absorption", SpectrumUse::Absorption);
            [[fallthrough]];
        case MaterialType::ThinDielectric: take("ior", SpectrumUse::Index, material.eta); break;
        case MaterialType::Mix:
            takeNumber("amount", material.amount, material.amount_texture);
            [[fallthrough]];
        case MaterialType::TwoSided: readParts(*section); break;
        case MaterialType::Plastic: {
            double ior = 1.5;
            section->read("ior", ior);
            section->read("roughness", material.roughness);
            material.eta = constantSpectrum(ior);
            takeReflectance();
            break;
        }
    }
    if (material.absorption && !material.isOpaque())
        section->error("opacity",
                       "an absorbing body must be closed: light would enter it through holes",
                       "leave 'opacity' or 'absorption' out");
    if (section->schema().find("thin_film") != nullptr) readThinFilm(*section, material);
    if (section->schema().find("roughness_anisotropy") != nullptr) readAnisotropy(*section, material);
    add();
}

void ObjectReader::readThinFilm(const SectionReader& section, Material& material) {
    if (!section.has("thin_film")) return;
    const std::optional<SectionReader> film =
        section.section("thin_film", fmt::format("the thin film of material '{}'", material.name));
    if (!film) return;
    film->read("thickness_nm", material.film_thickness_nm);
    if (std::optional<Spectrum> index = spectra_.read(*film, "ior", SpectrumUse::Index))
        material.film_index = *std::move(index);
    if (!TextureReader::isTexture(*film, "relative_thickness")) {
        double relative = 1;
        film->read("relative_thickness", relative);
        material.film_thickness_nm *= relative;
    } else if (material.type == MaterialType::RoughDielectric) {
        film->error("relative_thickness",
                    "a thin film on a rough_dielectric needs a uniform thickness, because the energy loss "
                    "of its microfacets is tabulated for one thickness",
                    "remove 'relative_thickness', give a number, or use a dielectric");
    } else {
        material.film_texture =
            textures_.read(*film, "relative_thickness", TexelKind::Numbers).value_or(kNoTexture);
    }
}

std::optional<std::int32_t> ObjectReader::findMaterial(const std::string& name, const YamlPlace& place,
                                                       bool from_mtl_possible) {
    const auto found = materials_.find(name);
    if (found != materials_.end()) {
        found->second.used = true;
        if (found->second.index < 0) return std::nullopt;
        return found->second.index;
    }
    std::vector<std::string> known =
        out_.worthSuggesting(material_names_.size()) ? material_names_ : std::vector<std::string>();
    if (from_mtl_possible) known.push_back("from_mtl");
    out_.error(place, fmt::format("there is no material '{}'", name),
               out_.worthSuggesting(known.size()) ? didYouMean(name, known) : std::string());
    return std::nullopt;
}

void ObjectReader::finish() const {
    UnusedNames unused("material", "materials");
    for (const std::string& name : material_names_)
        if (const NamedMaterial& material = materials_.at(name); !material.used)
            unused.add(name, material.place);
    unused.finish();
}

// ---- Placements -----------------------------------------------------------------------------------------

std::optional<Matrix4d> ObjectReader::readPlacement(const YamlNode& list, const YamlPlace& place,
                                                    const std::string& subject) {
    if (list.kind != YamlKind::List) {
        expected(out_, place, "a list of steps such as {translate: [0, 1, 0]}", subject, list);
        return std::nullopt;
    }
    Matrix4d total = kIdentity4d;
    bool good = true;
    for (std::size_t i = 0; i < list.items.size(); ++i) {
        const YamlNode& item = *list.items[i];
        const std::size_t before = out_.count();
        const std::optional<SectionReader> step =
            openVariant(out_, item, item.place, "transform", fmt::format("step {} of {}", i + 1, subject));
        if (!step) {
            good = false;
            continue;
        }
        Matrix4d m = kIdentity4d;
        const std::string kind = variantWord(step->schema());
        if (kind == "translate") {
            Vec3d by{};
            step->read("translate", by);
            m[3] = by[0], m[7] = by[1], m[11] = by[2];
        } else if (kind == "scale") {
            Vec3d by{1, 1, 1};
            if (step->find("scale")->value->kind == YamlKind::List)
                step->read("scale", by);
            else if (double factor = 1; step->read("scale", factor))
                by = {factor, factor, factor};
            m[0] = by[0], m[5] = by[1], m[10] = by[2];
            if (by[0] == 0 || by[1] == 0 || by[2] == 0)
                step->error("scale", "a scale of 0 flattens the object to nothing");
        } else if (kind == "rotate") {
            const std::optional<SectionReader> turn = step->section("rotate", "the rotation");
            Vec3d axis{0, 0, 1};
            double degrees = 0;
            turn->read("axis", axis);
            turn->read("angle_deg", degrees);
            if (isZero(axis))
                turn->error("axis", "an axis of length 0 has no direction");
            else
                m = rotation(normalised(axis), degrees);
        } else {
            std::vector<double> values(m.begin(), m.end());
            step->read("matrix", values);
            std::copy(values.begin(), values.end(), m.begin());
            constexpr double kFlat = 1e-12;
            if (m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1)
                step->error("matrix", "the last row must be 0 0 0 1: points stay points");
            else if (std::abs(relativeVolume(m)) < kFlat)
                step->error("matrix", "this matrix is not invertible: it flattens the object");
        }
        good &= out_.count() == before;
        total = multiply(m, total);
    }
    if (good && !allFinite(total)) {
        out_.error(place,
                   fmt::format("{} overflows: the product of its steps is too large for a double", subject));
        good = false;
    }
    if (!good) return std::nullopt;
    return total;
}

std::vector<Matrix4d> ObjectReader::readPlacements(const SectionReader& object) {
    if (const YamlEntry* one = object.find("transform")) {
        const std::optional<Matrix4d> m =
            readPlacement(*one->value, one->place, fmt::format("the transform of {}", object.subject()));
        return {m.value_or(kIdentity4d)};
    }
    const YamlNode* list = object.list("transforms");
    if (list == nullptr) return {kIdentity4d};
    if (list->items.empty())
        object.error("transforms",
                     "an object without placements is invisible; leave 'transforms' out for a single one");
    placements_ += list->items.size();
    requireRoom(object.place("transforms"));
    std::vector<Matrix4d> placements;
    placements.reserve(list->items.size());
    for (std::size_t i = 0; i < list->items.size(); ++i) {
        const YamlNode& item = *list->items[i];
        const auto [known, fresh] = written_placements_.try_emplace(&item);
        if (fresh)
            known->second =
                readPlacement(item, item.place, fmt::format("placement {} of {}", i, object.subject()));
        placements.push_back(known->second.value_or(kIdentity4d));
    }
    return placements;
}

// ---- Geometry -------------------------------------------------------------------------------------------

std::optional<std::uint32_t> ObjectReader::readMesh(const SectionReader& section,
                                                    const NormalsUse& normals_use) {
    std::optional<std::vector<Vec3d>> positions = readPoints(section, "positions", "position");
    std::optional<std::vector<Vec3d>> normals = readPoints(section, "normals", "normal");
    const YamlNode* faces = section.list("faces");
    if (!positions || faces == nullptr) return std::nullopt;

    Mesh mesh;
    mesh.positions = *std::move(positions);
    const std::size_t errors_before = out_.count();
    if (section.has("normals") && normals) {
        if (normals->size() != mesh.positions.size())
            section.error("normals", fmt::format("there are {} normals for {} positions", normals->size(),
                                                 mesh.positions.size()));
        for (std::size_t i = 0; i < normals->size(); ++i)
            if (isZero((*normals)[i]))
                out_.error(section.list("normals")->items[i]->place,
                           fmt::format("normal {} has length 0", i));
        mesh.normals = *std::move(normals);
    }
    readAttributes(section, mesh);
    if (faces->items.empty()) section.error("faces", "a mesh without faces cannot be seen");

    const KeySchema& row = *section.schema().find("faces");
    std::uint64_t dropped = 0;
    std::vector<std::uint32_t> polygon;
    std::vector<Vec3d> areas;  // Twice the area of each triangle of the fan, along its normal.
    for (std::size_t f = 0; f < faces->items.size(); ++f) {
        const YamlNode& face = *faces->items[f];
        if (face.kind != YamlKind::List || face.items.size() < 3) {
            expected(out_, face.place, "a list of 3 or more indices", fmt::format("face {}", f), face);
            continue;
        }
        polygon.clear();
        for (const YamlNodePtr& item : face.items) {
            std::int64_t index = 0;
            if (!readScalar(out_, *item, item->place, row, fmt::format("an index of face {}", f), index))
                continue;
            if (static_cast<std::uint64_t>(index) < mesh.positions.size())
                polygon.push_back(static_cast<std::uint32_t>(index));
            else
                out_.error(item->place,
                           fmt::format("face {} uses position {}, but there are only {} (counted from 0)",
                                       f, index, mesh.positions.size()));
        }
        if (polygon.size() != face.items.size()) continue;
        triangles_ += polygon.size() - 2;
        requireRoom(face.place);

        // A fan from the first corner. A triangle that turns against the whole lies outside the polygon.
        const Vec3d& apex = mesh.positions[polygon[0]];
        areas.clear();
        Vec3d sum{};
        for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
            areas.push_back(cross(mesh.positions[polygon[i]] - apex, mesh.positions[polygon[i + 1]] - apex));
            sum = sum + areas.back();
        }
        constexpr double kRounding = 1e-9;
        for (std::size_t i = 0; i < areas.size(); ++i) {
            if (isZero(areas[i])) {
                ++dropped;
                continue;
            }
            if (dot(areas[i], sum) < -kRounding * dot(sum, sum)) {
                out_.error(face.place,
                           fmt::format("face {} is not convex; split it into convex polygons", f));
                break;
            }
            mesh.triangles.push_back({polygon[0], polygon[i + 1], polygon[i + 2]});
        }
    }
    if (out_.count() != errors_before) return std::nullopt;
    if (dropped > 0) {
        logWarning("{}: {} triangles of {} without area were left out",
                   section.place("faces").resolved().text(), dropped, section.subject());
    }
    if (!mesh.normals.empty()) mesh.normal_index = mesh.triangles;
    if (!mesh.uvs.empty()) mesh.uv_index = mesh.triangles;
    setNormals(mesh, normals_use, section.subject());
    scene_.meshes.push_back(std::move(mesh));
    return static_cast<std::uint32_t>(scene_.meshes.size() - 1);
}

// ---- Objects --------------------------------------------------------------------------------------------

void ObjectReader::readObjects(const YamlNode& list) {
    for (std::size_t i = 0; i < list.items.size(); ++i) readObject(*list.items[i], list.items[i]->place, i);
    tellGltf();
}

void ObjectReader::tellLeftOut(const Object& object, const std::string& subject) const {
    const bool emits =
        object.emission >= 0 ||
        (object.material >= 0 && scene_.materials[static_cast<std::size_t>(object.material)].emission >= 0);
    logWarning("{}:{}:{}: {} is left out{}: no face of its mesh has an area", object.place.file,
               object.place.line, object.place.column, subject, emits ? ", and its light with it" : "");
}

void ObjectReader::readObject(const YamlNode& node, const YamlPlace& place, std::size_t number) {
    const YamlEntry* name = node.find("name");
    const SectionReader section(out_, node, place, schemaSection("object"),
                                name != nullptr && name->value->kind == YamlKind::Scalar
                                    ? fmt::format("object '{}'", name->value->text)
                                    : fmt::format("object {}", number));
    Object object;
    object.place = place.resolved();
    object.name = fmt::format("object {}", number);
    section.read("name", object.name);
    object.transforms = readPlacements(section);
    section.readEnum("share", object.sharing);

    std::string material_name;
    const bool material_given = section.read("material", material_name);
    const bool named = material_given && material_name != "from_mtl";
    if (named)
        object.material =
            findMaterial(material_name, section.place("material"), section.has("obj")).value_or(-1);

    std::optional<std::uint32_t> mesh;
    if (!section.has("obj")) {
        if (!section.has("material"))
            out_.error(place, fmt::format("'material' is missing in {}", section.subject()));
        if (material_given && !named) section.error("material", "only an OBJ has its own materials");
    }
    if ((section.has("obj") || section.has("ply")) && !section.has("mesh")) {
        mesh = readMeshFile(section, readMeshUse(section, material_name));
    } else if (section.has("gltf")) {
        mesh = readGltf(section);
    } else if (hasShape(section)) {
        mesh = readShape(section, object);
        refuseMeshKeys(section);
    } else if (const std::optional<SectionReader> written =
                   section.section("mesh", fmt::format("the mesh of {}", section.subject()))) {
        const NormalsUse normals = readNormals(section);
        const auto [known, fresh] =
            written_meshes_.try_emplace({section.find("mesh")->value.get(), normals});
        if (fresh) known->second = readMesh(*written, normals);
        mesh = known->second;
        refuseObjKeys(section);
        if (section.has("vertex_colors"))
            section.error("vertex_colors", "this key needs colours from a PLY",
                          "a 'mesh' has its own 'color_space'");
    }
    object.emission = readEmission(section, object.material, material_name).value_or(-1);
    if (mesh && !object.shape && scene_.meshes[*mesh].triangles.empty())
        return tellLeftOut(object, section.subject());
    object.mesh = mesh.value_or(0);
    if (mesh) checkTextures(section, object);
    scene_.objects.push_back(std::move(object));
}

}  // namespace crt
