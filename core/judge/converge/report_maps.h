/// Maps of a configuration as PNG: the image, its error, the error that it states, their ratio, and
/// FLIP.
#pragma once

#include "judge/converge/measurement.h"

#include <string>
#include <vector>

namespace crt::converge {

/// One picture, written as a file.
struct Picture {
    std::string file;      ///< Name within the folder.
    std::string title;     ///< "image", "error", "standard error", "z" or "FLIP"
    std::uint32_t width = 0, height = 0;
};

/// A colour scale with what its ends mean.
struct ColourKey {
    std::string title, low, high;
    std::vector<std::string> colours;  ///< "#rrggbb", at even steps from low to high.
};

/// The maps of the configurations of one scene, on common scales.
struct MapSet {
    std::string scene;
    struct OfConfiguration {
        Key key;
        std::uint64_t samples = 0;
        std::vector<Picture> pictures;
    };
    std::vector<OfConfiguration> configurations;
    std::vector<ColourKey> keys;
    std::string left_out;  ///< Reason why there are none; empty if there are some.
};

/// Writes map-<scene>-<n>-<what>.png into `folder` for configuration `n` of each scene, reduced to 384
/// pixels a side at most: errors by their root mean square, z by its largest magnitude. Hours of measuring
/// must not be lost to a missing codec: its absence is a warning, and MapSet::left_out.
std::vector<MapSet> writeMaps(const std::string& folder, const Run& run);

/// Letters, digits and '-' of a name, for files and anchors.
std::string slug(const std::string& name);

}  // namespace crt::converge
