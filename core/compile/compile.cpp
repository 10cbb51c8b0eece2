#include "compile/compile.h"

#include "base/log.h"
#include "base/stage.h"
#include "base/vec3d.h"
#include "compile/blob_writer.h"
#include "compile/bvh_build.h"
#include "compile/distributions.h"
#include "compile/flatten.h"
#include "compile/near_scene.h"
#include "compile/near_surfaces.h"
#include "compile/scene_identity.h"
#include "kernel/features.h"
#include "kernel/layout.h"
#include "kernel/surface.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <optional>

namespace crt {
namespace {

static_assert(kSpectrumSize == CRT_WAVELENGTH_COUNT && CRT_SPECTRUM_STRIDE == CRT_WAVELENGTH_COUNT + 1 &&
                  kWavelengthMin_nm == CRT_WAVELENGTH_MIN_NM,
              "the host's spectra are the kernel's tables");

/// Up to this many triangles `auto` takes the brute-force loop. `bench/run accelerators` measures where the
/// tree begins to pay.
constexpr std::size_t kBruteForceTriangles = 64;

/// By a power of two first, so that no square overflows or vanishes.
Vec3d normalise(const Vec3d& v) {
    int exponent = 0;
    std::frexp(std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])}), &exponent);
    const Vec3d near_one = v * std::ldexp(1.0, -exponent);
    return near_one * (1.0 / std::sqrt(dot(near_one, near_one)));
}

/// Spectra by value: equal ones share a table.
class SpectrumTable {
public:
    std::uint32_t add(const Spectrum& spectrum) {
        const auto [where, is_new] =
            index_.try_emplace(spectrum.values, static_cast<std::uint32_t>(index_.size()));
        if (is_new) {
            for (const double v : spectrum.values) floats_.push_back(static_cast<float>(v));
            floats_.push_back(floats_.back());
        }
        return where->second;
    }
    const std::vector<float>& floats() const { return floats_; }
    std::uint32_t count() const { return static_cast<std::uint32_t>(index_.size()); }

private:
    std::map<SpectrumValues, std::uint32_t> index_;
    std::vector<float> floats_;
};

/// Everything between Scene and blob, step by step in the order of the calls in compileScene.
class Compiler {
public:
    Compiler(const Scene& scene, std::uint32_t aovs, const CompileOptions& options)
        : scene_(scene), options_(options) {
        header_.magic = CRT_SCENE_MAGIC;
        out_.aovs = aovs & kAovsOfFirstHits;
        out_.aovs |= replicatesOf(scene_) > 1 ? kAovReplicates : kAovSquares;
    }

    CompiledScene run() {
        const Stage stage("compiling the scene");
        const auto start = std::chrono::steady_clock::now();
        flatten();
        chooseAccelerator();
        writeGeometry();
        writeEmitters();
        writeMaterials();
        writeTables();
        writeFilm();
        writeCamera();
        writeSettings();
        decideFeatures();
        explainLeftOut();
        finish();
        out_.compile_seconds =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() -
            out_.build_seconds;
        return std::move(out_);
    }

private:
    bool isPath() const { return scene_.integrator.type == IntegratorType::Path; }
    /// Whether light is ever scattered; if not, materials, light sampling and roulette have nothing to do.
    bool scatters() const { return isPath() && scene_.integrator.max_depth > 0; }

    void flatten() {
        flat_ = flattenScene(scene_);
        out_.centre = flat_.centre;
        out_.scale_exponent = flat_.scale_exponent;
        scale_ = std::ldexp(1.0, flat_.scale_exponent);
    }

    void chooseAccelerator() {
        switch (scene_.integrator.accelerator) {
            case Accelerator::Bvh: header_.accelerator = CRT_ACCELERATOR_BVH; break;
            case Accelerator::Aabb: header_.accelerator = CRT_ACCELERATOR_AABB; break;
            case Accelerator::None: header_.accelerator = CRT_ACCELERATOR_BRUTE_FORCE; break;
            case Accelerator::Auto:
                header_.accelerator = flat_.triangles.size() <= kBruteForceTriangles
                                          ? CRT_ACCELERATOR_BRUTE_FORCE
                                          : CRT_ACCELERATOR_BVH;
        }
        // Nothing to find, or, in the view of the boxes, nobody who looks.
        if (flat_.triangles.empty() || scene_.integrator.type == IntegratorType::Aabb)
            header_.accelerator = CRT_ACCELERATOR_BRUTE_FORCE;
    }

    /// Whether the backend finds all hits itself: rays start at the camera or at a surface, and surfaces lie
    /// within 1.
    bool backendFindsHits() const {
        double farthest = 1;
        for (std::size_t k = 0; k < 3; ++k)
            farthest = std::max(farthest, std::abs(scene_.camera.position[k] - out_.centre[k]) * scale_ +
                                              scene_.camera.aperture_radius * scale_);
        // A little less, for what is rounded on the way to the ray.
        return farthest < options_.accelerator_reach * (1 - 1e-6);
    }

    TriangleBounds boundsOf(std::size_t i) const {
        TriangleBounds b{};
        for (std::size_t k = 0; k < 3; ++k) {
            const float* p = &flat_.positions[i][3 * k];
            b.lower[k] = std::min({p[0], p[1], p[2]});
            b.upper[k] = std::max({p[0], p[1], p[2]});
        }
        return b;
    }

    void writeGeometry() {
        const std::size_t count = flat_.triangles.size();
        std::vector<std::uint32_t> order(count);
        for (std::size_t i = 0; i < count; ++i) order[i] = static_cast<std::uint32_t>(i);
        out_.without_nodes = header_.accelerator == CRT_ACCELERATOR_BVH && backendFindsHits();
        if (header_.accelerator == CRT_ACCELERATOR_BVH && !out_.without_nodes) {
            const auto start = std::chrono::steady_clock::now();
            std::vector<TriangleBounds> bounds(count);
            for (std::size_t i = 0; i < count; ++i) bounds[i] = boundsOf(i);
            Bvh bvh = buildBvh(bounds, CRT_BOX_PADDING);
            order = std::move(bvh.order);
            reserveBlob(bvh.nodes.size());
            header_.nodes = blob_.append(bvh.nodes);
            out_.nodes = bvh.nodes.size();
            out_.build_seconds =
                std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        }
        if (out_.nodes == 0) reserveBlob(0);
        slot_of_.resize(count);
        std::vector<kernel::CrtTriangle> slots(count);
        for (std::size_t slot = 0; slot < count; ++slot) {
            const std::uint32_t id = order[slot];
            slot_of_[id] = static_cast<std::uint32_t>(slot);
            std::copy(flat_.positions[id].begin(), flat_.positions[id].end(), slots[slot].p);
            slots[slot].id = id;
        }
        header_.triangles = blob_.append(slots);
        header_.triangle_count = static_cast<std::uint32_t>(count);
        std::vector<kernel::CrtFace> faces(count);
        for (std::size_t i = 0; i < count; ++i) faces[slot_of_[i]] = faceOf(i);
        header_.faces = blob_.append(faces);
        if (header_.accelerator == CRT_ACCELERATOR_BRUTE_FORCE &&
            scene_.integrator.type != IntegratorType::Aabb) {
            std::vector<std::uint32_t> all(count), occluders;
            for (std::uint32_t i = 0; i < count; ++i) {
                all[i] = i;
                if (count > kBruteForceTriangles || canOcclude(i))
                    occluders.push_back(i);  // asking takes quadratic time
            }
            header_.triangles8 = blob_.append(blocksOf(all));
            header_.occluders8 = blob_.append(blocksOf(occluders));
            occluders_ = occluders.size();
        }
        writeObjects();
    }

    /// For what grows with the number of triangles, and some tables.
    void reserveBlob(std::size_t nodes) {
        constexpr std::size_t kTables = std::size_t{1} << 20;
        std::size_t bytes = kTables + nodes * sizeof(kernel::CrtNode4);
        for (const FlatTriangle& t : flat_.triangles)
            bytes += sizeof(kernel::CrtTriangle) + sizeof(kernel::CrtFace) + sizeof(kernel::CrtPrimitive) +
                     (t.smooth ? sizeof(kernel::CrtNormals) : 0);
        blob_.reserve(bytes);
    }

    std::vector<kernel::CrtTriangle8> blocksOf(const std::vector<std::uint32_t>& slots) const {
        std::vector<kernel::CrtTriangle8> blocks((slots.size() + 7) / 8);
        for (kernel::CrtTriangle8& block : blocks) {
            std::fill(std::begin(block.slot), std::end(block.slot), CRT_NONE);
            std::fill(std::begin(block.row[0][3]), std::end(block.row[0][3]), CRT_UNUSED_HEIGHT);
        }
        for (std::size_t i = 0; i < slots.size(); ++i) {
            blocks[i / 8].slot[i % 8] = slots[i];
            const Extent extent = extentOf(slots[i]);
            blocks[i / 8].height_slack[i % 8] = kernel::crt_height_slack(
                static_cast<float>(extent.coordinate), static_cast<float>(extent.size));
            const Vec3d n =
                planeNormal(slots[i]);  // brute force keeps the author's order: slot and id are one
            setRow(blocks[i / 8], 0, i % 8, n, vertexOf(slots[i], 0));
            for (std::size_t v = 0; v < 3; ++v) {
                const Vec3d edge = vertexOf(slots[i], (v + 1) % 3) - vertexOf(slots[i], v);
                const double length = std::sqrt(dot(edge, edge));
                setRow(blocks[i / 8], v + 1, i % 8, length > 0 ? cross(n, edge) * (1 / length) : Vec3d{},
                       vertexOf(slots[i], v));
            }
        }
        return blocks;
    }

    /// The affine function that grows along `direction` and vanishes at `origin`.
    static void setRow(kernel::CrtTriangle8& block, std::size_t row, std::size_t lane,
                       const Vec3d& direction, const Vec3d& origin) {
        for (std::size_t k = 0; k < 3; ++k) block.row[row][k][lane] = static_cast<float>(direction[k]);
        block.row[row][3][lane] = static_cast<float>(-dot(direction, origin));
    }

    /// Unit normal by the order of the vertices; zero for a triangle without area.
    Vec3d planeNormal(std::size_t i) const {
        const Vec3d n = cross(vertexOf(i, 1) - vertexOf(i, 0), vertexOf(i, 2) - vertexOf(i, 0));
        const double length = std::sqrt(dot(n, n));
        return length > 0 ? n * (1 / length) : Vec3d{};
    }

    Vec3d vertexOf(std::size_t i, std::size_t v) const {
        return {flat_.positions[i][v], flat_.positions[i][3 + v], flat_.positions[i][6 + v]};
    }

    /// Whether triangle i can come between two points of the scene: not if the whole scene lies on one side
    /// of its plane, as it does for the walls of a convex room.
    bool canOcclude(std::size_t i) const {
        const Vec3d o = vertexOf(i, 0);
        const Vec3d n = cross(vertexOf(i, 1) - o, vertexOf(i, 2) - o);
        bool above = false, below = false;
        for (std::size_t j = 0; j < flat_.positions.size() && !(above && below); ++j)
            for (std::size_t v = 0; v < 3; ++v) {
                const double d = dot(n, vertexOf(j, v) - o);
                above = above || d > 0;
                below = below || d < 0;
            }
        return above && below;
    }

    /// The largest coordinate of a triangle, and the largest extent of its two edges along an axis: what
    /// rounding depends on.
    struct Extent {
        double coordinate = 0, size = 0;
    };
    Extent extentOf(std::size_t i) const {
        const Vec3d o = vertexOf(i, 0), a = vertexOf(i, 1) - o, b = vertexOf(i, 2) - o;
        Extent e;
        for (std::size_t k = 0; k < 3; ++k) {
            e.coordinate =
                std::max({e.coordinate, std::abs(o[k]), std::abs(o[k] + a[k]), std::abs(o[k] + b[k])});
            e.size = std::max(e.size, std::abs(a[k]) + std::abs(b[k]));
        }
        return e;
    }

    kernel::CrtFace faceOf(std::size_t i) const {
        kernel::CrtFace face{};
        const Vec3d o = vertexOf(i, 0), a = vertexOf(i, 1) - o, b = vertexOf(i, 2) - o;
        const Vec3d n = cross(a, b);
        const double twice_area = std::sqrt(dot(n, n));
        const auto [coordinate, size] = extentOf(i);
        for (std::size_t k = 0; k < 3; ++k)
            face.normal[k] = twice_area > 0 ? static_cast<float>(n[k] / twice_area) : 0.0f;
        face.clearance = kernel::crt_clearance(static_cast<float>(coordinate), static_cast<float>(size));
        face.margin = kernel::crt_edge_margin(static_cast<float>(coordinate), static_cast<float>(size),
                                              static_cast<float>(twice_area));
        return face;
    }

    /// Boxes of the objects, for the paper's culling and for the bounding-box view; triangles of an object
    /// are adjacent unless a BVH moved them.
    void writeObjects() {
        out_.objects = flat_.placements;
        const bool needed =
            header_.accelerator == CRT_ACCELERATOR_AABB || scene_.integrator.type == IntegratorType::Aabb;
        if (!needed) return;
        std::vector<kernel::CrtObject> objects;
        for (std::size_t i = 0; i < flat_.triangles.size(); ++i) {
            const TriangleBounds b = boundsOf(i);
            if (i == 0 || flat_.triangles[i].object != flat_.triangles[i - 1].object) {
                kernel::CrtObject object{};
                for (std::size_t k = 0; k < 3; ++k) {
                    object.lower[k] = std::numeric_limits<float>::infinity();
                    object.upper[k] = -std::numeric_limits<float>::infinity();
                }
                object.first = static_cast<std::uint32_t>(i);
                objects.push_back(object);
            }
            kernel::CrtObject& object = objects.back();
            ++object.count;
            for (std::size_t k = 0; k < 3; ++k) {
                object.lower[k] = std::min(object.lower[k], b.lower[k] - CRT_BOX_PADDING);
                object.upper[k] = std::max(object.upper[k], b.upper[k] + CRT_BOX_PADDING);
            }
        }
        header_.objects = blob_.append(objects);
    }

    double areaOf(std::size_t i) const {
        const auto& p = flat_.positions[i];
        const Vec3d a{p[0], p[3], p[6]}, b{p[1], p[4], p[7]}, c{p[2], p[5], p[8]};
        const Vec3d n = cross(b - a, c - a);
        return 0.5 * std::sqrt(dot(n, n));
    }

    /// If triangles i and i + 1 emit alike and make a parallelogram, as the halves of a quad do: the corner
    /// of triangle i across from their common edge.
    std::optional<std::uint32_t> parallelogramCorner(std::size_t i) const {
        if (i + 1 >= flat_.triangles.size()) return std::nullopt;
        const FlatTriangle &one = flat_.triangles[i], &next = flat_.triangles[i + 1];
        if (next.object != one.object || next.emission != one.emission) return std::nullopt;
        for (std::size_t corner = 0; corner < 3; ++corner) {
            const Vec3d o = vertexOf(i, corner), a = vertexOf(i, (corner + 1) % 3),
                        b = vertexOf(i, (corner + 2) % 3);
            const Vec3d across = a + b - o;
            for (std::size_t v = 0; v < 3; ++v) {
                // Turned the same way round: across, b, a.
                const Vec3d gap = vertexOf(i + 1, v) - across;
                const Vec3d edge = a - o;
                if (vertexOf(i + 1, (v + 1) % 3) == b && vertexOf(i + 1, (v + 2) % 3) == a &&
                    dot(gap, gap) <= 1e-12 * dot(edge, edge))
                    return static_cast<std::uint32_t>(corner);
            }
        }
        return std::nullopt;
    }

    void writeEmitters() {
        emitter_of_.assign(flat_.triangles.size(), CRT_NONE);
        if (!isPath()) return;
        std::vector<kernel::CrtEmitter> emitters;
        std::vector<double> power;
        for (std::size_t i = 0; i < flat_.triangles.size(); ++i) {
            if (flat_.triangles[i].emission < 0) continue;
            const Emission& emission =
                scene_.emissions[static_cast<std::size_t>(flat_.triangles[i].emission)];
            if (!(emission.radiance.max() > 0)) continue;
            double area = areaOf(i);
            if (!(area > 0)) continue;
            kernel::CrtEmitter emitter{};
            emitter.slot = slot_of_[i];
            emitter.spectrum = spectra_.add(emission.radiance);
            emitter.flags = emission.two_sided ? CRT_EMITTER_TWO_SIDED : 0;
            emitter_of_[i] = static_cast<std::uint32_t>(emitters.size());
            if (const auto corner = parallelogramCorner(i)) {
                emitter.flags |= CRT_EMITTER_PARALLELOGRAM;
                emitter.corner = *corner;
                emitter_of_[i + 1] = emitter_of_[i];
                area += areaOf(i + 1);
                ++i;
            }
            emitter.area = static_cast<float>(area);
            emitters.push_back(emitter);
            // By luminance, but never zero for a lamp that the eye hardly sees: the film keeps all of XYZ.
            const Vec3d xyz = spectrumToXyz(emission.radiance);
            power.push_back(area * (xyz[0] + xyz[1] + xyz[2] + 1e-6 * emission.radiance.max()) *
                            (emission.two_sided ? 2 : 1));
        }
        const std::vector<std::uint64_t> first = choiceTable(power);
        for (std::size_t i = 0; i < emitters.size(); ++i) {
            emitters[i].choice = static_cast<std::uint32_t>(first[i]);
            emitters[i].choice_probability =
                static_cast<float>(std::ldexp(static_cast<double>(first[i + 1] - first[i]), -32));
        }
        header_.emitters = blob_.append(emitters);
        out_.emitters = emitters.size();
        if (out_.emitters == 0 && !scene_.environment)
            logWarning(
                "the scene has no light: the image will be black (add emission to an object, or an "
                "environment)");
    }

    void writeMaterials() {
        std::vector<kernel::CrtPrimitive> primitives(flat_.triangles.size());
        std::vector<kernel::CrtNormals> normals;
        std::vector<bool> used(scene_.materials.size(), false);
        bool fallback_used = false;
        for (std::size_t i = 0; i < flat_.triangles.size(); ++i) {
            const FlatTriangle& t = flat_.triangles[i];
            kernel::CrtPrimitive& p = primitives[i];
            const bool known =
                t.material >= 0 && static_cast<std::size_t>(t.material) < scene_.materials.size();
            if (known)
                used[static_cast<std::size_t>(t.material)] = true;
            else
                fallback_used = true;
            p.material = known ? static_cast<std::uint32_t>(t.material)
                               : static_cast<std::uint32_t>(scene_.materials.size());
            p.emitter = emitter_of_[i];
            p.object = t.object;
            p.normals = CRT_NONE;
            if (t.smooth) {
                p.normals = static_cast<std::uint32_t>(normals.size());
                kernel::CrtNormals n{};
                for (std::size_t v = 0; v < 3; ++v)
                    for (std::size_t k = 0; k < 3; ++k) n.n[3 * k + v] = static_cast<float>(t.normals[v][k]);
                normals.push_back(n);
            }
        }
        header_.primitives = blob_.append(primitives);
        header_.normals = blob_.append(normals);

        std::vector<kernel::CrtMaterial> materials;
        for (std::size_t i = 0; i < scene_.materials.size(); ++i)
            materials.push_back(used[i] && isPath() ? writeMaterial(scene_.materials[i])
                                                    : kernel::CrtMaterial{});
        if (fallback_used || materials.empty()) {
            Material grey;  // faces that name no material
            grey.reflectance = constantSpectrum(0.5);
            materials.push_back(isPath() ? writeMaterial(grey) : kernel::CrtMaterial{});
        }
        header_.materials = blob_.append(materials);
        header_.environment = CRT_NONE;
        if (scene_.environment && isPath()) header_.environment = spectra_.add(scene_.environment->radiance);
    }

    kernel::CrtMaterial writeMaterial(const Material& material) {
        kernel::CrtMaterial m{};
        switch (material.type) {
            case MaterialType::Diffuse:
                m.type = CRT_MATERIAL_DIFFUSE;
                m.a = spectra_.add(material.reflectance);
                has_diffuse_ = true;
                break;
            case MaterialType::Mirror:
                m.type = CRT_MATERIAL_MIRROR;
                m.a = spectra_.add(material.reflectance);
                has_conductor_ = true;
                break;
            case MaterialType::Conductor:
                m.type = CRT_MATERIAL_CONDUCTOR;
                m.a = spectra_.add(material.eta);
                m.b = spectra_.add(material.k);
                has_conductor_ = true;
                break;
            case MaterialType::Dielectric:
                m.type = CRT_MATERIAL_DIELECTRIC;
                m.a = spectra_.add(material.eta);
                has_dielectric_ = true;
                if (!material.eta.isConstant()) {
                    m.flags = CRT_MATERIAL_DISPERSIVE;
                    has_dispersion_ = true;
                }
        }
        return m;
    }

    void writeTables() {
        header_.spectra = blob_.append(spectra_.floats());
        header_.spectra.count = spectra_.count();
        std::vector<float> observer;
        const auto& cie = cieObserver();
        for (std::size_t i = 0; i < CRT_SPECTRUM_STRIDE; ++i) {
            const std::size_t nm = std::min<std::size_t>(i, kSpectrumSize - 1);
            for (const Spectrum& s : cie) observer.push_back(static_cast<float>(s[nm] / cieYIntegral()));
            observer.push_back(0.0f);
        }
        header_.observer = blob_.append(observer);
        header_.wavelengths = blob_.append(wavelengthTable(CRT_WAVELENGTH_TABLE));
        header_.filter = blob_.append(filterTable(scene_.film, CRT_FILTER_TABLE));
    }

    void writeFilm() {
        const FilmSettings& film = scene_.film;
        header_.film_width = static_cast<std::uint32_t>(film.width);
        header_.film_height = static_cast<std::uint32_t>(film.height);
        const bool cropped = film.crop != std::array<int, 4>{0, 0, 0, 0};
        header_.crop_x = cropped ? static_cast<std::uint32_t>(film.crop[0]) : 0;
        header_.crop_y = cropped ? static_cast<std::uint32_t>(film.crop[1]) : 0;
        header_.width =
            cropped ? static_cast<std::uint32_t>(film.crop[2] - film.crop[0]) : header_.film_width;
        header_.height =
            cropped ? static_cast<std::uint32_t>(film.crop[3] - film.crop[1]) : header_.film_height;
        header_.aovs = out_.aovs;
        const auto replicates = static_cast<std::uint32_t>(replicatesOf(scene_));
        header_.channels = channelsFor(out_.aovs, replicates);
        header_.replicate_shift = static_cast<std::uint32_t>(std::bit_width(replicates) - 1);
#define CRT_SET_CHANNEL(bit, NAME, Name, stem, width, SOURCE, name, exr) \
    header_.stem##_channel = firstChannel(out_.aovs, kAov##Name);
        CRT_CHANNEL_LIST(CRT_SET_CHANNEL)
#undef CRT_SET_CHANNEL
        header_.depth_scale = static_cast<float>(std::ldexp(1.0, -out_.scale_exponent));
        out_.width = header_.width;
        out_.height = header_.height;
        out_.channels = header_.channels;
    }

    void writeCamera() {
        const Camera& camera = scene_.camera;
        const Vec3d view = normalise(camera.target - camera.position);
        const Vec3d right = normalise(cross(view, camera.up));
        const Vec3d up = cross(right, view);
        kernel::CrtCamera& c = header_.camera;
        for (std::size_t k = 0; k < 3; ++k) {
            c.origin[k] = static_cast<float>((camera.position[k] - out_.centre[k]) * scale_);
            c.corner[k] = static_cast<float>(view[k] - right[k] * camera.tan_half_width +
                                             up[k] * camera.tan_half_height);
            c.step_x[k] = static_cast<float>(right[k] * 2 * camera.tan_half_width / scene_.film.width);
            c.step_y[k] = static_cast<float>(-up[k] * 2 * camera.tan_half_height / scene_.film.height);
            c.lens_x[k] = static_cast<float>(right[k]);
            c.lens_y[k] = static_cast<float>(up[k]);
            if (!std::isfinite(c.origin[k] + c.corner[k] + c.step_x[k] + c.step_y[k]))
                throw Error(ErrorKind::Scene, "the camera is too far from the scene for single precision",
                            camera.place);
        }
        // Unit directions in single precision are 2^-24 apart; two of them a pixel is the least that tells
        // pixels apart.
        const double pixel = 2 * std::min(camera.tan_half_width / scene_.film.width,
                                          camera.tan_half_height / scene_.film.height);
        if (pixel < std::ldexp(1.0, -23))
            logWarning(
                "a pixel is {:.2g} radians wide, finer than directions in single precision ({:.2g}): "
                "neighbouring pixels will repeat each other; "
                "use fewer pixels, a wider field of view, or a nearer camera",
                pixel, std::ldexp(1.0, -23));
        const Vec3d to_target = camera.target - camera.position;
        const double focus =
            camera.focus_distance > 0 ? camera.focus_distance : std::sqrt(dot(to_target, to_target));
        c.lens_radius = static_cast<float>(camera.aperture_radius * scale_);
        c.focus_distance = static_cast<float>(focus * scale_);
    }

    void writeSettings() {
        switch (scene_.integrator.type) {
            case IntegratorType::Path: header_.view = CRT_VIEW_PATH; break;
            case IntegratorType::Normals: header_.view = CRT_VIEW_NORMALS; break;
            case IntegratorType::Aabb: header_.view = CRT_VIEW_AABB; break;
        }
        switch (scene_.sampler.type) {
            case SamplerType::Sobol: header_.sampler = CRT_SAMPLER_SOBOL; break;
            case SamplerType::Independent: header_.sampler = CRT_SAMPLER_INDEPENDENT; break;
            case SamplerType::XorShift: header_.sampler = CRT_SAMPLER_XORSHIFT; break;
        }
        header_.seed = kernel::crt_seed(static_cast<std::uint32_t>(scene_.sampler.seed),
                                        static_cast<std::uint32_t>(scene_.sampler.seed >> 32));
        header_.max_depth = static_cast<std::uint32_t>(scene_.integrator.max_depth);
        header_.roulette_depth = scene_.integrator.roulette
                                     ? static_cast<std::uint32_t>(scene_.integrator.roulette_depth)
                                     : CRT_NONE;
        header_.nee = !scene_.integrator.nee  ? CRT_NEE_NONE
                      : scene_.integrator.mis ? CRT_NEE_MIS
                                              : CRT_NEE_ONLY;
    }

    void decideFeatures() {
        std::uint32_t f = 0;
        const auto need = [&](bool condition, std::uint32_t feature) { f |= condition ? feature : 0u; };
        need(header_.sampler == CRT_SAMPLER_SOBOL, CRT_FEATURE_SOBOL);
        need(header_.sampler == CRT_SAMPLER_INDEPENDENT, CRT_FEATURE_INDEPENDENT);
        need(header_.sampler == CRT_SAMPLER_XORSHIFT, CRT_FEATURE_XORSHIFT);
        const bool traces = scene_.integrator.type != IntegratorType::Aabb;
        need(traces && header_.accelerator == CRT_ACCELERATOR_BVH, CRT_FEATURE_BVH);
        need(traces && header_.accelerator == CRT_ACCELERATOR_BRUTE_FORCE, CRT_FEATURE_BRUTE_FORCE);
        need(traces && header_.accelerator == CRT_ACCELERATOR_AABB, CRT_FEATURE_AABB);
        need(scatters() && has_diffuse_, CRT_FEATURE_DIFFUSE);
        need(scatters() && has_conductor_, CRT_FEATURE_CONDUCTOR);
        need(scatters() && has_dielectric_, CRT_FEATURE_DIELECTRIC);
        need(scatters() && has_dispersion_, CRT_FEATURE_DISPERSION);
        need(traces && header_.normals.count > 0, CRT_FEATURE_SMOOTH_NORMALS);
        need(out_.emitters > 0, CRT_FEATURE_AREA_LIGHT);
        need(scatters() && out_.emitters > 0 && header_.nee && has_diffuse_, CRT_FEATURE_NEE);
        need(header_.environment != CRT_NONE, CRT_FEATURE_ENVIRONMENT);
        need(header_.camera.lens_radius > 0, CRT_FEATURE_LENS);
        need(header_.filter.count > 0, CRT_FEATURE_FILTER);
        need(!isPath(), CRT_FEATURE_VIEW);
        need((out_.aovs & kAovsOfFirstHits) != 0, CRT_FEATURE_AOV);
        need((out_.aovs & kAovReplicates) != 0, CRT_FEATURE_REPLICATES);
        header_.features = f;
        out_.features = f;
    }

    void explainLeftOut() {
        const auto left_out = [&](const char* what, const std::string& why) {
            out_.left_out.emplace_back(what, why);
        };
        const auto has = [&](std::uint32_t feature) { return (out_.features & feature) != 0; };
        if (header_.accelerator != CRT_ACCELERATOR_BVH)
            left_out("BVH", scene_.integrator.accelerator == Accelerator::Auto
                                ? fmt::format("{} triangles: testing all of them is faster (up to {})",
                                              flat_.triangles.size(), kBruteForceTriangles)
                                : std::string("integrator.accelerator asks for another"));
        if (out_.without_nodes) left_out("BVH", "the backend builds an acceleration structure of its own");
        if (has(CRT_FEATURE_NEE) && has(CRT_FEATURE_BRUTE_FORCE) && occluders_ < flat_.triangles.size())
            left_out(
                "shadow tests",
                fmt::format("{} of {} triangles have the whole scene on one side and cannot come between",
                            flat_.triangles.size() - occluders_, flat_.triangles.size()));
        if (!has(CRT_FEATURE_CONDUCTOR)) left_out("mirror and conductor", "no surface uses them");
        if (!has(CRT_FEATURE_DIELECTRIC)) left_out("dielectric", "no surface uses it");
        if (!has(CRT_FEATURE_DISPERSION))
            left_out("hero wavelength selection", "no index of refraction depends on wavelength");
        if (!has(CRT_FEATURE_SMOOTH_NORMALS)) left_out("shading normals", "all faces are flat");
        if (!has(CRT_FEATURE_AREA_LIGHT)) left_out("emission from surfaces", "nothing emits");
        if (!has(CRT_FEATURE_NEE))
            left_out("light sampling and shadow rays", !header_.nee
                                                           ? "integrator.nee is false"
                                                           : "no diffuse surface can be lit by an emitter");
        if (!has(CRT_FEATURE_ENVIRONMENT)) left_out("environment", "there is none");
        if (!has(CRT_FEATURE_LENS)) left_out("thin lens", "the camera is a pinhole");
        if (!has(CRT_FEATURE_FILTER)) left_out("pixel filter table", "the box filter is the pixel itself");
        if (!has(CRT_FEATURE_AOV)) left_out("AOV buffers", "no output asks for first-hit AOVs");
        if (!has(CRT_FEATURE_REPLICATES))
            left_out("replicates", !isPath() ? "integrator.type is a view" : "sampler.replicates is 1");
        if (!has(CRT_FEATURE_VIEW)) left_out("normals and bounding-box views", "integrator.type is path");
        for (const auto& [feature, name] : {std::pair{CRT_FEATURE_SOBOL, "Sobol sampler"},
                                            std::pair{CRT_FEATURE_INDEPENDENT, "independent sampler"},
                                            std::pair{CRT_FEATURE_XORSHIFT, "xorshift sampler"}})
            if (!has(feature)) left_out(name, "sampler.type is another");
    }

    void finish() {
        out_.blob = blob_.finish(header_);
        out_.size_bytes = out_.blob.size() * sizeof(CompiledScene::Line);
        out_.triangles = flat_.triangles.size();
        out_.hash = sceneIdentity(out_.data(), flat_.positions);
    }

    const Scene& scene_;
    const CompileOptions options_;
    CompiledScene out_;
    kernel::CrtScene header_{};
    BlobWriter blob_;
    SpectrumTable spectra_;
    FlatScene flat_;
    std::vector<std::uint32_t> slot_of_;           ///< By primitive id.
    std::vector<std::uint32_t> emitter_of_;
    std::size_t occluders_ = 0;
    double scale_ = 1;
    bool has_diffuse_ = false, has_conductor_ = false, has_dielectric_ = false, has_dispersion_ = false;
};

}  // namespace

/// "'ceiling light'": what the author calls the object of a primitive.
std::string objectOf(const Scene& scene, const CompiledScene& compiled, std::uint32_t primitive) {
    using namespace kernel;
    const auto* header = reinterpret_cast<const CrtScene*>(compiled.data());
    std::uint32_t placement = CRT_ARRAY(CrtPrimitive, compiled.data(), header->primitives)[primitive].object;
    for (const Object& object : scene.objects) {
        if (placement < object.transforms.size())
            return object.name.empty() ? std::string("an object without a name")
                                       : fmt::format("'{}'", object.name);
        placement -= static_cast<std::uint32_t>(object.transforms.size());
    }
    return "a surface";
}

CompiledScene compileScene(const Scene& scene, std::uint32_t aovs, const CompileOptions& options) {
    CompiledScene compiled = Compiler(scene, aovs, options).run();
    if (scene.integrator.type != IntegratorType::Path) return compiled;
    const Stage stage("looking for surfaces too near to each other");
    std::optional<CompiledScene> reduced;
    if (compiled.without_nodes) reduced = nearScene(compiled);
    const CompiledScene& searched = reduced ? *reduced : compiled;
    if (const std::optional<CoplanarLight> found = findCoplanarLight(searched))
        logWarning(
            "{} lies in the plane of {} and overlaps it: rounding decides which of them is seen, and the "
            "image is wrong there; move the lamp {:.3g} "
            "or more towards the side that it lights, or cut a hole for it",
            objectOf(scene, compiled, found->light), objectOf(scene, compiled, found->surface),
            found->least_gap);
    if (scene.integrator.max_depth > 0)
        if (const NearSurfaces found = findNearSurfaces(searched); found.near > 0)
            logWarning(
                "{} of {} triangles looked at have another surface nearer than single precision can tell "
                "for triangles of this size (up to {:.3g} "
                "apart): light between them may be lost; divide the larger triangles there, or move the "
                "surfaces apart or together",
                found.near, found.asked, found.nearest_clearance);
    return compiled;
}

std::string featureNames(std::uint64_t mask) {
    std::string names;
#define CRT_FEATURE_NAME(bit, name, text) \
    if (mask & (1u << bit)) names += (names.empty() ? "" : ", ") + std::string(#name);
    CRT_FEATURE_LIST(CRT_FEATURE_NAME)
#undef CRT_FEATURE_NAME
    std::transform(names.begin(), names.end(), names.begin(),
                   [](char c) { return c == '_' ? '-' : static_cast<char>(std::tolower(c)); });
    return names;
}

}  // namespace crt
