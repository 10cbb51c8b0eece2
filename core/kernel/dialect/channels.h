/*
 * channels.h: the channels of a film and the outputs of an image, one row each. Masks, widths, the order of
 * film channels, the members of CrtScene, the names in scene files and in EXR files are all made from these
 * rows.
 *
 * CRT_CHANNEL_LIST(C) calls C(bit, NAME, Name, stem, width, SOURCE, "name in scenes", "EXR channels") for
 * each output that has film channels, in the order of these in the film, after X, Y and Z. `width` is their
 * number. Replicates come last, since films may have fewer of them than `width`. CrtScene::<stem>_channel
 * is the first of them. SOURCE says which kernel code adds to them: FIRST_HIT has a function
 * crt_first_hit_<stem> in film.h, SAMPLES is added by crt_film_add_sample.
 *
 * CRT_PLANE_LIST(P) calls P(bit, NAME, Name, TYPE, SOURCE, "name in scenes", "EXR channels") for each
 * output without film channels: IDS is the film's plane of primitive ids, SPLATS that of splats, FILM is
 * made of the film when it is resolved. TYPE is FLOAT or UINT.
 *
 * COLOR_ERROR has film channels all the same, behind the replicates: X and Z of the first replicate, of the
 * second, and so on; as with Y, not of the last. A spectral film has its bins and the responses of its
 * sensors behind all of these: CrtSpectralFilm.
 *
 * An empty name: no output. EXR channels are separated by commas; those of the CRT_CHANNEL_LIST are floats.
 * A bit never changes its meaning, because film files hold the mask.
 */
#ifndef CRT_CHANNELS_H
#define CRT_CHANNELS_H

#define CRT_CHANNEL_LIST(C)                                                                        \
    C(8, SQUARES, Squares, square, 1u, SAMPLES, "", "")                                            \
    C(0, ALBEDO, Albedo, albedo, 3u, FIRST_HIT, "albedo", "Albedo.R,Albedo.G,Albedo.B")            \
    C(1, NORMAL, Normal, normal, 3u, FIRST_HIT, "normal", "Ns.X,Ns.Y,Ns.Z")                        \
    C(2, DEPTH, Depth, depth, 1u, FIRST_HIT, "depth", "Z")                                         \
    C(6, REPLICATES, Replicates, replicate, CRT_REPLICATES_MAX - 1u, SAMPLES, "", "")

#define CRT_PLANE_LIST(P)                                                                          \
    P(3, PRIMITIVE, Primitive, UINT, IDS, "primitive", "id.primitive")                             \
    P(4, VARIANCE, Variance, FLOAT, FILM, "variance", "Variance.Y")                                \
    P(5, SAMPLES, Samples, UINT, FILM, "samples", "sampleCount")                                   \
    P(9, SPLATS, Splats, UINT, SPLATS, "", "")                                                     \
    P(7, ERROR, Error, FLOAT, FILM, "error", "StdError.Y")                                         \
    P(10, COLOR_ERROR, ColorError, FLOAT, FILM, "color_error", "StdError.R,StdError.G,StdError.B")

#define CRT_CHANNEL_ENUM(bit, NAME, Name, stem, width, SOURCE, name, exr) CRT_AOV_##NAME = 1 << bit,
#define CRT_PLANE_ENUM(bit, NAME, Name, TYPE, SOURCE, name, exr) CRT_AOV_##NAME = 1 << bit,
enum CrtAov { CRT_CHANNEL_LIST(CRT_CHANNEL_ENUM) CRT_PLANE_LIST(CRT_PLANE_ENUM) CRT_AOV_END };

/* X, Y and Z of each sample. SQUARES is Y² of each, from which films without replicates estimate their
   variance.
 */
#define CRT_CHANNELS_BASE 3u

/* A pixel of the plane of splats (film/splat.h): sums of two words each, the low one first: X, Y of
   replicate 0, Z, then Y of the other replicates. Behind them stands the number
   of splats that were left out. */
#define CRT_SPLAT_SUM_OF(replicate) ((replicate) == 0u ? 1u : 2u + (replicate))
#define CRT_SPLAT_WORDS(replicates) (2u * (2u + (replicates)) + 1u)

/* Of a film with everything. */
#define CRT_CHANNEL_WIDTH(bit, NAME, Name, stem, width, SOURCE, name, exr) +(width)
#define CRT_CHANNELS_MAX \
    (CRT_CHANNELS_BASE CRT_CHANNEL_LIST(CRT_CHANNEL_WIDTH) + 2u * (CRT_REPLICATES_MAX - 1u))

#endif
