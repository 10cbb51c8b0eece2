#include "scene/yaml/scene_objects.h"

#include "base/log.h"
#include "base/vec3d.h"
#include "scene/yaml/degrees.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace crt {
namespace {

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
        if (row == Vec3d{}) return 0;
        rows[r] = normalised(row);
    }
    return dot(rows[0], cross(rows[1], rows[2]));
}

/// The area of what an emission of the object would make shine, of all its placements together: not of faces
/// that emit by themselves.
double emittingArea(const Scene& scene, const Object& object, const Mesh& mesh) {
    double area = 0;
    for (const Matrix4d& m : object.transforms) {
        if (object.shape) {
            const double scale = evenScaleOf(m).value_or(0);
            area += areaOf(*object.shape) * scale * scale;
            continue;
        }
        const auto edge = [&](std::size_t triangle, std::size_t to) {
            const Vec3d d =
                mesh.positions[mesh.triangles[triangle][to]] - mesh.positions[mesh.triangles[triangle][0]];
            return Vec3d{m[0] * d[0] + m[1] * d[1] + m[2] * d[2], m[4] * d[0] + m[5] * d[1] + m[6] * d[2],
                         m[8] * d[0] + m[9] * d[1] + m[10] * d[2]};
        };
        for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
            if (emissionIndexOf(scene, object, mesh, i) < 0)
                area += 0.5 * length(cross(edge(i, 1), edge(i, 2)));
    }
    return area;
}

}  // namespace

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
            if (axis == Vec3d{})
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
    room_.placements += list->items.size();
    room_.require(object.place("transforms"), out_);
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

// ---- Objects --------------------------------------------------------------------------------------------

void ObjectReader::read(const YamlNode& list) {
    for (std::size_t i = 0; i < list.items.size(); ++i) readObject(*list.items[i], list.items[i]->place, i);
    meshes_.finish();
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
            materials_.find(material_name, section.place("material"), section.has("obj")).value_or(-1);

    if (!section.has("obj")) {
        if (!section.has("material"))
            out_.error(place, fmt::format("'material' is missing in {}", section.subject()));
        if (material_given && !named) section.error("material", "only an OBJ has its own materials");
    }
    const std::optional<std::uint32_t> mesh = meshes_.read(section, material_name, object);
    const auto area_m2 = [&] {
        const double metres = scene_.metres_per_unit.value_or(1);
        return mesh ? emittingArea(scene_, object, scene_.meshes[*mesh]) * metres * metres : 0;
    };
    object.emission = materials_.readEmission(section, object.material, material_name, area_m2).value_or(-1);
    if (mesh && !object.shape && scene_.meshes[*mesh].triangles.empty())
        return tellLeftOut(object, section.subject());
    object.mesh = mesh.value_or(0);
    if (mesh) meshes_.checkTextures(section, object);
    scene_.objects.push_back(std::move(object));
}

}  // namespace crt
