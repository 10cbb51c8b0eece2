#include "scene/scene.h"

namespace crt {

Development developmentOf(const Scene& scene) {
    Development development{.color_space = scene.film.color_space,
                            .white = std::nullopt,
                            .exposure_ev = scene.film.exposure_ev,
                            .apply_to_float = scene.film.apply_to_float,
                            .view = scene.film.view};
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
