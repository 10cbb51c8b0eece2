#include "compile/scene_identity.h"

#include "base/byte_hash.h"
#include "kernel/dialect/bits_version.h"

#include <cstddef>
#include <cstdint>

namespace crt {
namespace {

using namespace kernel;

/// Hashes a compiled scene. For each array whose rows hold places in the blob it has a function with the
/// array's name (CRT_SCENE_ARRAYS in kernel/dialect/layout.h).
class SceneHash {
public:
    explicit SceneHash(const unsigned char* blob)
        : blob_(blob), header_(*reinterpret_cast<const CrtScene*>(blob)) {}

    /// The size goes first: otherwise an item could move from one array to the next unseen.
    template <class Item>
    void add(const Item* items, std::size_t count) {
        const std::uint64_t sizes[] = {count, sizeof(Item)};
        hash_.add(sizes, sizeof sizes);
        if (count > 0) hash_.add(items, count * sizeof(Item));
    }
    template <class Item>
    void add(const Item& item) {
        add(&item, 1);
    }

    /// The header without what names accelerators and kernels, and without places in the blob. Every other
    /// member of CrtScene belongs to the identity: a setting that was forgotten would mix films.
    void header() {
        CrtScene settings = header_;
        settings.features = 0;
        settings.accelerator = 0;
#define CRT_CLEAR_PLACE(Row, name, IDENTITY) settings.name = {};
        CRT_SCENE_ARRAYS(CRT_CLEAR_PLACE)
#undef CRT_CLEAR_PLACE
        add(settings);
    }

    void arrays() {
#define CRT_HASH_ROWS(Row, name) array<Row>(header_.name);
#define CRT_HASH_PLACES(Row, name) name();
#define CRT_HASH_SEARCH(Row, name)
#define CRT_HASH_ARRAY(Row, name, IDENTITY) CRT_HASH_##IDENTITY(Row, name)
        CRT_SCENE_ARRAYS(CRT_HASH_ARRAY)
#undef CRT_HASH_ROWS
#undef CRT_HASH_PLACES
#undef CRT_HASH_SEARCH
#undef CRT_HASH_ARRAY
    }

    std::string digits() const { return hash_.digits128(); }

private:
    template <class Row>
    const Row* rows(const CrtSpan& span) const {
        return CRT_ARRAY(Row, blob_, span);
    }
    template <class Row>
    void array(const CrtSpan& span) {
        add(rows<Row>(span), span.count);
    }
    /// Calls `row` with a copy of each row of an array.
    template <class Row, class F>
    void each(const CrtSpan& span, const F& row) {
        add(span.count);
        for (std::uint32_t i = 0; i < span.count; ++i) row(Row(rows<Row>(span)[i]));
    }

    /// Every backend has the same trees of meshes, and so their triangles in the same order. The order of
    /// the scene's own triangles belongs to its tree: the caller hashes them by id.
    void triangles() {
        add(rows<CrtTriangle>(header_.triangles) + header_.triangle_count,
            header_.triangles.count - header_.triangle_count);
    }
    void instances() {
        each<CrtInstance>(header_.instances, [this](CrtInstance instance) {
            instance.root = 0;
            add(instance);
        });
    }
    void textures() {
        each<CrtTexture>(header_.textures, [this](CrtTexture texture) {
            array<u16>(texture.words);
            texture.words = {};
            add(texture);
        });
    }
    /// Their other members follow from the materials.
    void losses() {
        each<CrtLoss>(header_.losses, [this](const CrtLoss& loss) { array<f32>(loss.rows); });
    }
    /// A light names its triangle by the place that the tree gave it.
    void lights() {
        const CrtLight* lights = rows<CrtLight>(header_.lights);
        std::vector<CrtLight> by_id(lights, lights + header_.lights.count);
        for (CrtLight& light : by_id)
            if (light.kind == CRT_LIGHT_TRIANGLE || light.kind == CRT_LIGHT_PARALLELOGRAM ||
                light.kind == CRT_LIGHT_SHAPE || light.kind == CRT_LIGHT_TILE)
                light.slot = rows<CrtTriangle>(header_.triangles)[light.slot].id;
        add(by_id.data(), by_id.size());
    }
    void point_lights() {
        each<CrtPointLight>(header_.point_lights, [this](CrtPointLight light) {
            each<CrtLightForm>(light.form, [this](CrtLightForm form) {
                for (CrtSpan* span : {&form.vertical, &form.horizontal, &form.shares}) {
                    array<f32>(*span);
                    *span = {};
                }
                add(form);
            });
            light.form = {};
            add(light);
        });
    }
    void environment_image() {
        each<CrtEnvironmentImage>(header_.environment_image, [this](CrtEnvironmentImage image) {
            array<CrtEnvironmentTexel>(image.texels);
            array<u32>(image.rows);
            array<u32>(image.columns);
            // The guides follow from these.
            image.texels = image.rows = image.columns = image.row_guide = image.column_guides = {};
            add(image);
        });
    }
    void spectral_film() {
        each<CrtSpectralFilm>(header_.spectral_film, [this](CrtSpectralFilm film) {
            array<CrtSpectrumRow>(film.responses);
            film.responses = {};
            add(film);
        });
    }

    const unsigned char* blob_;
    const CrtScene& header_;
    ByteHash hash_;
};

}  // namespace

std::string sceneIdentity(const unsigned char* blob, const std::vector<std::array<float, 9>>& positions) {
    SceneHash hash(blob);
    hash.add(std::uint32_t{CRT_BITS_VERSION});
    hash.header();
    hash.add(positions.data(), positions.size());
    hash.arrays();
    return hash.digits();
}

}  // namespace crt
