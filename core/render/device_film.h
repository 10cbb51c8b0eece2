/// The film that devices render: on the devices, where it fits, else in bands of rows, one after another.
///
/// A band is a window of the film (CrtScene::crop_y and height), rendered for a whole range of samples, read
/// back, and put into its rows on the host. A sample depends on its pixel and its number alone, so the film
/// is that of a device with room for all of it (docs/decisions/0040-films-in-bands.md). A film that takes
/// splats is not rendered in bands, as the samples of each band add to all rows.
#pragma once

#include "backend/device_group.h"
#include "compile/compile.h"
#include "film/film.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace crt {

/// [owner thread]
class DeviceFilm {
public:
    /// Both must outlive this. While a band is set the scene has the band's window, and its own again when
    /// the function returns.
    DeviceFilm(DeviceGroup& devices, CompiledScene& scene);

    /// DeviceGroup::setScene. Where no device has room for the film, bands are made that fit; where none
    /// has room for the scene beside a single row, that error is thrown.
    void setScene(const std::function<void(double)>& progress = {});

    /// True if the film is rendered in bands: from setScene() on, or from the first render() on, when that
    /// finds that the film leaves no room to work in.
    bool inBands() const { return !bands_.empty(); }
    /// Number of bands; 1 for a film that lies on the devices.
    std::size_t bands() const { return inBands() ? bands_.size() : 1; }

    /// Adds a range to all pixels. `progress` gets [0,1].
    void render(const RenderRange& range, const std::function<void(double)>& progress = {});

    /// Adds to `film` what was rendered: all of it since setScene() when the film is on the devices, and in
    /// bands what was not yet read. A film without samples may hold anything.
    void readFilm(Film& film);

    /// Of the last render() in bands: what would have been no less with fewer samples.
    double fixedSeconds() const { return fixed_seconds_; }

private:
    /// Rows [first, end).
    struct Band {
        std::uint32_t first, end;
        std::uint32_t rows() const { return end - first; }
    };
    void setWindow(const Band& band);
    void beginBands(const Error& why);
    void cut(std::uint32_t first, std::uint32_t rows);
    void renderInBands(const RenderRange& range, const std::function<void(double)>& progress);
    void renderBand(const Band& band, const RenderRange& range, const std::function<void(double)>& progress);

    DeviceGroup& devices_;
    CompiledScene& scene_;
    std::vector<Band> bands_;
    bool rendered_ = false;  ///< Something, since setScene().
    std::optional<Film> part_;    ///< A band's. Kept, as memory that is new costs as much as filling it.
    std::optional<Film> pass_;    ///< All bands' of one range. Likewise.
    std::optional<Film> unread_;  ///< The samples that were rendered in bands and not yet read.
    double fixed_seconds_ = 0;
};

}  // namespace crt
