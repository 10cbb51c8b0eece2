/// The film's record of its scene: enough to make images without the scene file, and to explain in words why
/// a film and a scene do not match. Kept in .crtfilm files as JSON (checkpoint.h).
#pragma once

#include "film/path_facts.h"
#include "image/development.h"
#include "image/image.h"
#include "scene/spectral_film.h"

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace crt {

inline constexpr std::uint32_t kFilmSideMax = 65535;  ///< Of a film, as scene files have it.

/// One of the things that decide which samples a film holds.
struct SceneTrait {
    std::string name;    ///< "resolution", "the camera"
    std::string text;    ///< "512 × 512"
    std::string digest;  ///< A hash of the details that the text leaves out; empty: none.
    bool operator==(const SceneTrait&) const = default;
};

struct FilmRecord {
    std::string title;
    std::uint64_t seed = 0;
    PathFacts paths;                      ///< For error estimates.
    int width = 0, height = 0;            ///< Of the whole film.
    std::array<int, 4> window{};          ///< The part of it that the film holds: x0, y0, x1, y1, half open.
    std::uint32_t aovs = 0;               ///< Bits of Aov that the scene requests for its EXR files.
    SpectralChannels spectral;            ///< Contents of the film's last channels.
    Development development;
    std::map<std::string, Vec3d> whites;  ///< Named spectra of the scene that are lights: XYZ with Y = 1.
    RowMatrix4d world_to_camera{};        ///< x to the right, y up, the camera looks along −z.
    RowMatrix4d
        world_to_ndc{};  ///< (0, 0) is the upper left corner of the whole film, (1, 1) the lower right.
    std::vector<SceneTrait> traits;
    std::vector<std::string> missing_light;  ///< As missingLight() has it.

    // Of the run that rendered it; empty or nothing when that is not known.
    std::string backend, device;
    std::string date_utc;                 ///< "2026:11:22 05:40:00", of the last sample.
    std::optional<bool> complete;         ///< Has all the samples that were asked for.

    /// Adds the names of another run of the same film, each once, and takes the later of both dates.
    void addRun(const FilmRecord& other);

    /// True if its colours are radiance, false for a debugging view.
    bool holdsRadiance() const;

    bool isCropped() const { return window != std::array<int, 4>{0, 0, width, height}; }
};

struct Scene;

/// The part that follows from the scene, but for `paths.brightest`. Throws crt::Error(Scene) as
/// developmentOf().
FilmRecord recordOf(const Scene& scene);

/// JSON, and back. Throws crt::Error(Usage), a sentence without a place, for text that no crt wrote.
std::string recordText(const FilmRecord& record);
FilmRecord readRecord(std::string_view text);

/// "the resolution is 256 × 256 and not 512 × 512": every trait in which `found` is not `expected`. Empty
/// when there is none.
std::vector<std::string> differingTraits(const FilmRecord& found, const FilmRecord& expected);

/// Now in UTC, "2026:11:22 05:40:00"; with SOURCE_DATE_EPOCH (reproducible-builds.org), that time. Throws
/// crt::Error(Usage) when it is no number.
std::string dateUtc();

}  // namespace crt
