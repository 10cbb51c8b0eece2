/// An image in memory: named planes, as files have them.
#pragma once

#include "image/view_transform.h"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace crt {

/// Row-major, for points as rows: p' = p · M, as OpenEXR has it.
using RowMatrix4d = std::array<double, 16>;

/// An image plane set: named float channels, row-major, top row first. The images that image_io writes and
/// compare reads.
struct Image {
    std::uint32_t width = 0, height = 0;
    std::vector<std::string> channels;      ///< "R","G","B","Albedo.R",…,"sampleCount","id.primitive"
    std::vector<float> pixels;              ///< [height][width][channels]
    std::vector<std::uint32_t> integers;    ///< [height][width][integer_channels]
    std::vector<std::string> integer_channels;
    std::vector<std::pair<std::string, std::string>> metadata;  ///< crt/backend, crt/seed, …
    std::optional<std::array<double, 8>> chromaticities;
    /// Where the pixels lie in the whole picture, in pixels from its upper left corner (EXR: data window),
    /// and how large that is (EXR: display window); 0 × 0: they are all of it.
    std::int32_t left = 0, top = 0;
    std::uint32_t whole_width = 0, whole_height = 0;
    /// For EXR: matrices for points as rows (film_record.h), and the chromaticity x, y of the light to be
    /// seen as white where that was not applied.
    std::optional<RowMatrix4d> world_to_camera, world_to_ndc;
    std::optional<std::array<double, 2>> adopted_neutral;
    /// For EXR: the luminance of the colour (1, 1, 1), of images whose pixels are radiance.
    std::optional<double> white_luminance_cd_m2;
    /// For display formats, and not yet applied to the pixels.
    ViewTransform view = ViewTransform::None;
};

}  // namespace crt
