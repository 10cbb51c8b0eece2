#include "image/development.h"

#include "base/error.h"
#include "scene/scene.h"

namespace crt {

Development Development::forFloats() const {
    if (apply_to_float) return *this;
    return {.color_space = color_space, .white = std::nullopt, .exposure_ev = 0, .apply_to_float = false};
}

Development developmentOf(const Scene& scene) {
    Development development{.color_space = scene.film.color_space,
                            .white = std::nullopt,
                            .exposure_ev = scene.film.exposure_ev,
                            .apply_to_float = scene.film.apply_to_float};
    if (scene.film.white_balance) {
        Vec3d white = spectrumToXyz(*scene.film.white_balance);
        const double luminance = white[1];
        if (!(luminance > 0))
            throw Error(ErrorKind::Scene, "the white balance illuminant has no visible light", {scene.file});
        for (double& component : white) component /= luminance;
        development.white = white;
    }
    return development;
}

}  // namespace crt
