/// Converts a film to the colours of an image: settings that do not affect samples, so that they can be
/// changed after the render (`crt develop`).
#pragma once

#include "image/view_transform.h"
#include "spectra/spectra.h"

#include <optional>

namespace crt {

struct Development {
    ColorSpace color_space = ColorSpace::LinearSrgb;
    /// XYZ with Y = 1 of the light that becomes the white of the colour space. Nothing: colours stay as they
    /// are.
    std::optional<Vec3d> white;
    double exposure_ev = 0;       ///< Stops: values are multiplied by 2 to this power.
    bool apply_to_float = false;  ///< Files of floats get exposure and white balance too.
    ViewTransform view = ViewTransform::None;  ///< Of display formats.

    /// For EXR and PFM, and for whatever is measured: radiance in the colour space, without exposure and
    /// white balance unless apply_to_float asks for them (docs/decisions/0013).
    Development forFloats() const {
        Development floats = *this;
        floats.view = ViewTransform::None;
        if (!apply_to_float) floats.white = std::nullopt, floats.exposure_ev = 0;
        return floats;
    }

    bool operator==(const Development&) const = default;
};

}  // namespace crt
