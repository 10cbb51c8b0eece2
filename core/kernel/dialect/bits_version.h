/*
 * bits_version.h: one number for "renders the same samples". Raise it whenever any bit of any sample
 * changes: in the light transport, in elementary functions, in the sampler, in what compile.cpp writes into
 * the scene. Adding what no scene had before changes nothing.
 *
 * A plugin of another version is refused, and so is a film: their samples must not be mixed in one image.
 * The conformance suite compares films with stored hashes (tests/bits_hashes.txt), so that a change of bits
 * cannot go unseen; it says how to store new ones.
 *
 *   1   what carries no version
 *   2   the first version that plugins and films carry
 *   3   materials as BSDFs, eight dimensions a vertex
 *   4   rough_conductor and rough_dielectric give back what their microfacets lose
 *   5   interpolated normals keep the light of surfaces that reflect
 *   6   nodes of the tree of lights have four children
 *   7   a sphere that shines is not sampled from its own surface
 *   8   rays pass panes, bodies know what surrounds them, small things keep their digits in large scenes
 *   9   roulette counts the panes that a path has passed
 *   10  a table has the mean reflectance of a film on a rough metal
 *   11  Sobol points of two dimensions are stratified together
 *   12  rounding does not make a small light block the rays towards it
 *   13  a coat of index 1 reflects nothing, also at the horizon
 */
#ifndef CRT_BITS_VERSION_H
#define CRT_BITS_VERSION_H

#define CRT_BITS_VERSION 13u

#endif
