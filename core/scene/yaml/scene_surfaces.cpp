// Properties of materials besides their values (scene_objects.h): anisotropy.
#include "scene/yaml/scene_objects.h"

namespace crt {

void ObjectReader::readAnisotropy(const SectionReader& section, Material& material) const {
    section.read("roughness_anisotropy", material.anisotropy);
    section.read("anisotropy_rotation_deg", material.anisotropy_rotation_deg);
    if (!(material.anisotropy > 0)) return;
    if (material.roughness_texture != kNoTexture)
        section.error("roughness_anisotropy",
                      "an anisotropic surface needs a uniform roughness, because the energy loss of its "
                      "microfacets is tabulated",
                      "give 'roughness' a number, or leave 'roughness_anisotropy' out");
    if (material.type == MaterialType::RoughDielectric && material.film_thickness_nm > 0)
        section.error("roughness_anisotropy",
                      "a rough_dielectric under a thin film must be isotropic, because the energy loss of "
                      "its microfacets is tabulated by wavelength",
                      "leave 'thin_film' or 'roughness_anisotropy' out");
}

}  // namespace crt
