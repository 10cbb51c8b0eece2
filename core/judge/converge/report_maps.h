/// Maps of a configuration as PNG: the image, its error, the error that it states, their ratio, and
/// FLIP.
#pragma once

#include "judge/converge/measurement.h"

#include <string>
#include <vector>

namespace crt::converge {

/// One picture, written as a file and ready to be put into a page.
struct Picture {
    std::string file;      ///< Name within the folder.
    std::string title;     ///< "error"
    std::string uri;       ///< data:image/png;base64,…
    std::uint32_t width = 0, height = 0;
};

/// A colour scale with what its ends mean.
struct ColourKey {
    std::string title, low, high;
    std::string css_gradient;
};

/// The maps of the configurations of one scene, on common scales.
struct MapSet {
    struct OfConfiguration {
        Key key;
        std::uint64_t samples = 0;
        std::vector<Picture> pictures;
    };
    std::vector<OfConfiguration> configurations;
    std::vector<ColourKey> keys;
};

/// Writes map-<scene>-<n>-<what>.png into `folder` for configuration `n` of the scene, reduced to 384 pixels
/// a side at most: errors by their root mean square, z by its largest magnitude. Throws crt::Error(Output),
/// also when the codec module cannot be opened.
MapSet writeMaps(const std::string& folder, const Run& run, const std::string& scene);

/// Letters, digits and '-' of a name, for files and anchors.
std::string slug(const std::string& name);

}  // namespace crt::converge
