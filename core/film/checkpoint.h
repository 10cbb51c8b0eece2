/// Files that hold a film: a checkpoint of a render, a part of one, or what a render is resumed from.
///
/// A .crtfilm file, little-endian:
///
///     0   magic          89 "CRTF" 0D 0A 1A    (8 bytes; damaged by any transfer that is not binary)
///     8   u32            format version, kCheckpointVersion
///     12  u32            header size in bytes: where the film begins
///     16  u64            file size in bytes
///     24  u64            XXH3-64 of the whole file without these 8 bytes
///     32  u32 × 4        width, height, channels, AOV mask
///     48  char[32]       scene hash, hex digits
///     80  u32            bytes of the crt version text
///     84  u32            number of sample ranges
///     88  u32            version of the bits (kernel/dialect/bits_version.h)
///     92  u32            bytes of the record
///     96  u64 × 2 each   sample ranges, first and end
///         char[]         crt version, zero-padded to 8
///         char[]         record (film_record.h), zero-padded to 8
///         f64            in format 4 only: units of splats in 1 (CrtScene::splat_scale)
///         bytes          to the end of the file: the film, packed (film_pack.h). Its sections are
///             f64 × 2 each   sums, hi and lo, [height][width][channels]
///             u64 each       counts, [height][width]
///             u32 each       primitive ids, [height][width]; only when the AOV mask has them
///             u64 each       splats, [height][width][words]; only in format 4
///
/// Films that take splats (kernel/film/splat.h) have format 4, all others format 3.
///
/// Version 2, which is read still, has these sections as they are, the last zero-padded to 8 bytes, and no
/// record; its films hold squares (kernel/dialect/channels.h) without a bit that says so.
#pragma once

#include "film/film.h"

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace crt {

/// Identity of what was rendered; a checkpoint of another scene, seed, film or version of the bits is
/// refused.
struct FilmIdentity {
    std::string scene_hash;   ///< 32 hex digits: CompiledScene::hash.
    std::string version;      ///< Of crt.
    /// kernel/dialect/bits_version.h of the crt that rendered it.
    std::uint32_t bits_version = CRT_BITS_VERSION;
    std::optional<FilmRecord> record{};  ///< Films of format 2 (checkpoint.h) have none.
};

/// Checkpoint = partial = resume file. Written to a temporary name, synced and renamed.
void writeCheckpoint(const std::string& path, const Film& film, const FilmIdentity& identity);
/// Throws crt::Error(Usage) on a damaged or truncated file (checksum), naming it.
std::pair<Film, FilmIdentity> readCheckpoint(const std::string& path);

inline constexpr std::uint32_t kCheckpointVersion = 3;
/// Of films that take splats.
inline constexpr std::uint32_t kCheckpointVersionSplats = 4;
/// The last version whose films are not packed, and have no record.
inline constexpr std::uint32_t kCheckpointVersionUnpacked = 2;
inline constexpr const char* kCheckpointExtension = ".crtfilm";

/// Refuses to go on from `path` when it holds other bits or another scene than `expected`: crt::Error(Usage)
/// naming both versions of the bits or both hashes. Warns when another version of crt wrote it: a change of
/// bits that went unnoticed would not show otherwise.
void requireSameScene(const std::string& path, const FilmIdentity& found, const FilmIdentity& expected);

/// "1.0.0 and 1.1.0": every version that is in `a` or in `b`, once, in the order of their text, whatever the
/// order of films. "and more" stands for entries that do not fit into a checkpoint.
std::string joinVersions(const std::string& a, const std::string& b);

/// Adds the film `name` to `merged`, a film of the same scene and bits. Throws as mergeCheckpoints, and then
/// changes nothing. The names stand in messages.
void mergeFilm(std::pair<Film, FilmIdentity>& merged, const std::string& merged_name, const Film& film,
               const FilmIdentity& identity, const std::string& name);

/// Adds partial films of one scene; the identity names the versions of all of them. The result does not
/// depend on the order of `paths`. Throws crt::Error(Usage) naming the files when there is none, one is
/// damaged, bits, scenes or shapes differ, or two hold the same samples.
std::pair<Film, FilmIdentity> mergeCheckpoints(const std::vector<std::string>& paths);

}  // namespace crt
