/// The contents of a film in little space, without loss: what a .crtfilm file holds behind its header.
///
/// Of the bytes of sums some hardly differ from pixel to pixel (signs and exponents, the lower halves of
/// pairs, counts) and others are noise. So bytes of the same kind are put side by side: each section (sums,
/// counts, primitive ids, splats) is divided into blocks of kPackedPixels pixels, the last one shorter, and
/// a block into planes, one for each byte of a pixel's record. A plane is
///
///     u32      n: bytes that follow
///     n bytes  n = 1: the byte that all of the plane are; n = number of pixels: the plane as it is;
///              else a zstd frame of it
#pragma once

#include "film/film.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace crt {

inline constexpr std::size_t kPackedPixels = 16384;

/// Sums, counts, primitive ids and splats of `film`. The same film gives the same bytes with the same
/// version of zstd.
std::vector<unsigned char> packFilm(const Film& film);

/// The least that a packed film of this shape takes: a file with less is damaged, and nothing need be
/// allocated to say so. Wider than 64 bits, as shapes that are read from files may be anything.
unsigned __int128 leastPackedBytes(const FilmShape& shape);

/// The way back. Returns false when `packed` is not a film of this shape; what `film` holds then does not
/// matter.
bool unpackFilm(std::span<const unsigned char> packed, Film& film);

}  // namespace crt
