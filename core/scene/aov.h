/// The rows of kernel/dialect/channels.h for the host: what a film holds of each pixel beside its colour,
/// and the names of its planes.
#pragma once

#include "kernel/dialect/channels.h"
#include "kernel/dialect/layout.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace crt {

/// Values are bits of an AOV mask. kAovReplicates is not an output: it holds the sums that error estimates
/// come from.
enum Aov : std::uint32_t {
#define CRT_AOV_VALUE(bit, NAME, Name, ...) kAov##Name = CRT_AOV_##NAME,
    CRT_CHANNEL_LIST(CRT_AOV_VALUE) CRT_PLANE_LIST(CRT_AOV_VALUE)
#undef CRT_AOV_VALUE
};

/// The code, of the kernel or of the film, that makes the values of an AOV.
enum class AovSource { FirstHit, Samples, Ids, Splats, Film };

struct AovRow {
    Aov aov;
    std::uint32_t width;  ///< Separate film channels.
    AovSource source;
    bool integer;                ///< Its image channels are 32-bit integers; otherwise floats.
    std::string_view name;       ///< In scene files; empty when it is no output.
    std::string_view exr_names;  ///< Separated by commas.
};

/// Those with film channels first, in the order of the film.
inline constexpr AovRow kAovRows[] = {
#define CRT_SOURCE_FIRST_HIT AovSource::FirstHit
#define CRT_SOURCE_SAMPLES AovSource::Samples
#define CRT_SOURCE_IDS AovSource::Ids
#define CRT_SOURCE_SPLATS AovSource::Splats
#define CRT_SOURCE_FILM AovSource::Film
#define CRT_TYPE_FLOAT false
#define CRT_TYPE_UINT true
#define CRT_CHANNEL_ROW(bit, NAME, Name, stem, width, SOURCE, name, exr) \
    {kAov##Name, width, CRT_SOURCE_##SOURCE, false, name, exr},
#define CRT_PLANE_ROW(bit, NAME, Name, TYPE, SOURCE, name, exr) \
    {kAov##Name, 0, CRT_SOURCE_##SOURCE, CRT_TYPE_##TYPE, name, exr},
    CRT_CHANNEL_LIST(CRT_CHANNEL_ROW) CRT_PLANE_LIST(CRT_PLANE_ROW)
#undef CRT_SOURCE_FIRST_HIT
#undef CRT_SOURCE_SAMPLES
#undef CRT_SOURCE_IDS
#undef CRT_SOURCE_SPLATS
#undef CRT_SOURCE_FILM
#undef CRT_TYPE_FLOAT
#undef CRT_TYPE_UINT
#undef CRT_CHANNEL_ROW
#undef CRT_PLANE_ROW
};

/// Bits of all rows for which `belongs` is true.
template <class Predicate>
constexpr std::uint32_t aovsWhere(Predicate belongs) {
    std::uint32_t mask = 0;
    for (const AovRow& row : kAovRows)
        if (belongs(row)) mask |= row.aov;
    return mask;
}

/// The data of the kernel's first hit.
inline constexpr std::uint32_t kAovsOfFirstHits = aovsWhere(
    [](const AovRow& row) { return row.source == AovSource::FirstHit || row.source == AovSource::Ids; });

/// First film channel of `aov` in a film that holds `aovs`; 0 when it has none there.
constexpr std::uint32_t firstChannel(std::uint32_t aovs, std::uint32_t aov) {
    std::uint32_t channel = CRT_CHANNELS_BASE;
    for (const AovRow& row : kAovRows) {
        const bool held = (aovs & row.aov) != 0 && row.width > 0;
        if (row.aov == aov) return held ? channel : 0;
        if (held) channel += row.width;
    }
    return 0;
}

/// Channels of a film that holds `aovs`, among them the sums of all replicates but the last: of Y, and with
/// kAovColorError of X and Z.
constexpr std::uint32_t channelsFor(std::uint32_t aovs, std::uint32_t replicates = CRT_REPLICATES_MAX) {
    std::uint32_t channels = CRT_CHANNELS_BASE;
    for (const AovRow& row : kAovRows)
        if (aovs & row.aov) channels += row.aov == kAovReplicates ? replicates - 1 : row.width;
    if (aovs & kAovColorError) channels += 2 * (replicates - 1);
    return channels;
}

/// The names that a scene file may use under `aovs`, in the order of the rows.
inline std::vector<std::string> aovNames() {
    std::vector<std::string> names;
    for (const AovRow& row : kAovRows)
        if (!row.name.empty()) names.emplace_back(row.name);
    return names;
}

/// The bit of a name from aovNames; 0 for any other.
constexpr std::uint32_t aovNamed(std::string_view name) {
    for (const AovRow& row : kAovRows)
        if (!row.name.empty() && row.name == name) return row.aov;
    return 0;
}

/// Channels of an image that an AOV makes.
inline std::vector<std::string> exrNames(const AovRow& row) {
    std::vector<std::string> names;
    for (std::string_view rest = row.exr_names; !rest.empty();) {
        const std::size_t length = rest.find(',') == std::string_view::npos ? rest.size() : rest.find(',');
        names.emplace_back(rest.substr(0, length));
        rest.remove_prefix(length == rest.size() ? length : length + 1);
    }
    return names;
}

}  // namespace crt
