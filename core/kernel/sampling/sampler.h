/*
 * sampler.h: the random numbers of sample s of pixel p. Counter-based: a number is a function of (seed,
 * pixel, sample, dimension) alone, on every backend, in any order, without end: dimensions never wrap. One
 * dimension is one call, of one or two numbers.
 */
#ifndef CRT_SAMPLER_H
#define CRT_SAMPLER_H

#include "kernel/dialect/features.h"
#include "kernel/dialect/math.h"
#include "kernel/sampling/shuffles.h"

CRT_KERNEL_BEGIN

/* Dimensions. Functions that draw numbers for a vertex or for a ray take the base of their dimensions from
   the caller (crt_vertex_dimension, CRT_PASSING_DIMENSION), so that several subpaths can have separate
   ones. */
#define CRT_DIM_FILM 0u
#define CRT_DIM_WAVELENGTH 1u
#define CRT_DIM_LENS 2u
#define CRT_DIM_HERO 3u
#define CRT_DIM_VERTEX 4u
#define CRT_DIM_PER_VERTEX 8u /* two are for what materials to come ask for */
#define CRT_DIM_LIGHT 0u        /* point on the emitter */
#define CRT_DIM_BSDF 1u         /* scattered direction, or which of two */
#define CRT_DIM_LIGHT_CHOICE 2u /* which emitter */
#define CRT_DIM_ROULETTE 3u
#define CRT_DIM_CHOICE 4u       /* which of several ways to scatter; two numbers */
#define CRT_DIM_MIX 7u          /* which material of a mix */

/* The base of a camera path's vertex after `depth` scattering events. */
CRT_FN u32 crt_vertex_dimension(u32 depth) { return CRT_DIM_VERTEX + CRT_DIM_PER_VERTEX * depth; }

/* Each surface that a ray meets before it ends has one dimension. */
#define CRT_DIM_PASS 0x80000000u
#define CRT_PASSES_MAX 4096u /* the next surface stops a ray */
/* On from there, where there are panes: whether one is passed, and which material of a mix is met. */
#define CRT_DIM_PANE 0x20000000u
#define CRT_DIM_PANE_MIX 0x40000000u

/* The base of a camera path's ray to the vertex after `depth` scattering events, or of that vertex's shadow
   ray. A macro: as a function it changes what NVCC inlines, and the full kernel spills 220 bytes. */
#define CRT_PASSING_DIMENSION(depth, shadow) \
    (CRT_DIM_PASS + CRT_PASSES_MAX * (2u * (depth) + ((shadow) ? 1u : 0u)))

typedef struct CrtSampler {
    u32 kind;
    u32 pixel_key;      /* Sobol: hash of seed, pixel and sequence. Independent: the pixel */
    u32 index;          /* Sobol: in the sequence, shuffled. Independent: low half of the sample index */
    u32 index_high;
    u32 seed_low, seed_high;
    u32 block;          /* Philox: which block of four numbers is in b0…b3 */
    u32 b0, b1, b2, b3; /* xorshift: its state is b0 */
} CrtSampler;

typedef struct CrtRandom2 {
    f32 x, y; /* in (0, 1) */
} CrtRandom2;

/* A bijection on 32 bits with good avalanche (Wellons' hash prospector, "lowbias32"). */
CRT_FN u32 crt_hash(u32 x) {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    x ^= x >> 16;
    return x;
}

/* Two rounds of a Feistel network, a bijection on 64 bits, each word hashed. */
CRT_FN CrtSeed crt_seed(u32 low, u32 high) {
    CrtSeed s;
    s.low = low;
    s.high = high;
    s.first = low ^ crt_hash(high + 0x9e3779b9u);
    s.second = high ^ crt_hash(s.first + 0x85ebca6bu);
    s.first ^= crt_hash(s.second + 0xc2b2ae35u);
    return s;
}

/* Key of a sequence of a pixel. The seed's two words enter one before and one after a hash: with one word,
   hash(pixel ^ word), seeds whose words differ in their low bits alone would give the same keys to other
   pixels. */
CRT_FN u32 crt_pixel_key(CrtSeed seed, u32 pixel, u32 sequence) {
    return crt_hash(crt_hash(pixel ^ seed.first) + seed.second + sequence * 0x9e3779b9u);
}

/* The middle of one of 2^23 cells of (0, 1): exact, and never 0 or 1, where warps degenerate. */
CRT_FN f32 crt_unit(u32 bits) { return (f32)(bits >> 9) * (2.0f * CRT_EPSILON) + CRT_EPSILON; }

/* Owen scrambling of a bit-reversed number: each bit is flipped by a hash of the bits below it (Laine and
   Karras 2011, constants by Vegdahl 2021, "Building a Better LK Hash"). */
CRT_FN u32 crt_owen_reversed(u32 x, u32 seed) {
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

/* Owen scrambling of a number whose bits are given in reverse. */
CRT_HOT_FN u32 crt_owen_scrambled(u32 reversed, u32 seed) {
    return crt_reverse_bits(crt_owen_reversed(reversed, seed));
}

/* Scrambles the order of indices: every aligned block of 2^k of them stays one. */
CRT_FN u32 crt_owen_shuffled(u32 index, u32 seed) {
    return crt_owen_scrambled(crt_reverse_bits(index), seed);
}

/* Second Sobol dimension of an index, bit-reversed: the Pascal matrix modulo 2, applied in five steps (Ahmed
 * 2024). */
CRT_FN u32 crt_sobol1_reversed(u32 index) {
    index ^= (index >> 1) & 0x55555555u;
    index ^= (index >> 2) & 0x33333333u;
    index ^= (index >> 4) & 0x0f0f0f0fu;
    index ^= (index >> 8) & 0x00ff00ffu;
    index ^= (index >> 16);
    return index;
}

typedef struct CrtPhilox {
    u32 x0, x1, x2, x3;
} CrtPhilox;

/* Philox 4×32-10 (Salmon et al. 2011). */
CRT_FN CrtPhilox crt_philox(u32 c0, u32 c1, u32 c2, u32 c3, u32 k0, u32 k1) {
    CrtPhilox r;
    for (u32 round = 0u; round < 10u; ++round) {
        const u32 h0 = crt_mulhi(0xd2511f53u, c0);
        const u32 l0 = 0xd2511f53u * c0;
        const u32 h1 = crt_mulhi(0xcd9e8d57u, c2);
        const u32 l1 = 0xcd9e8d57u * c2;
        c0 = h1 ^ c1 ^ k0;
        c1 = l1;
        c2 = h0 ^ c3 ^ k1;
        c3 = l0;
        k0 += 0x9e3779b9u;
        k1 += 0xbb67ae85u;
    }
    r.x0 = c0;
    r.x1 = c1;
    r.x2 = c2;
    r.x3 = c3;
    return r;
}

/* With 2^shift replicates (layout.h), the one that a sample belongs to, and its place there. */
CRT_FN u32 crt_replicate(u64 sample, u32 shift) { return (u32)sample & ((1u << shift) - 1u); }
CRT_FN u64 crt_index_in_replicate(u64 sample, u32 shift) { return sample >> shift; }

/*
 * Numbers of sample `sample` of the pixel with index `pixel` in the whole film. With 2^replicate_shift
 * replicates, Sobol samples take turns between sequences that are each scrambled on their own (Owen 1997,
 * "Monte Carlo variance of scrambled net quadrature", section 3). The other samplers' samples are
 * independent as it is.
 */
CRT_FN CrtSampler crt_sampler_begin(u32 kind, u32 replicate_shift, CrtSeed seed, u32 pixel, u64 sample) {
    CrtSampler s;
    const u32 low = (u32)sample;
    const u32 high = (u32)(sample >> 32);
    s.kind = kind;
    s.pixel_key = pixel;
    s.index = low;
    s.index_high = high;
    s.seed_low = seed.low;
    s.seed_high = seed.high;
    s.block = CRT_NONE;
    s.b0 = s.b1 = s.b2 = s.b3 = 0u;
    if (CRT_HAS(SOBOL) && kind == CRT_SAMPLER_SOBOL) {
        const u32 shift = CRT_HAS(REPLICATES) ? replicate_shift : 0u;
        const u64 index = crt_index_in_replicate(sample, shift);
        /* A sequence has 2^32 points; samples beyond them begin another. */
        const u32 sequence = ((u32)(index >> 32) << shift) + crt_replicate(sample, shift);
        s.pixel_key = crt_pixel_key(seed, pixel, sequence);
        /* Otherwise the samples of an index would have the same points in all sequences, but for their
           scrambles. */
        s.index = crt_owen_shuffled((u32)index, s.pixel_key);
    }
    if (CRT_HAS(XORSHIFT) && kind == CRT_SAMPLER_XORSHIFT) {
        /* Marsaglia's xorshift32 has one bad state, 0, and neighbouring seeds give neighbouring streams:
         * seed it with a hash. */
        const u32 key = crt_pixel_key(seed, pixel, high);
        /* Not + crt_hash(key), which would be the same for key and key ^ low. */
        const u32 h = crt_hash(crt_hash(low ^ key) + crt_hash(key + 0x85ebca6bu));
        s.b0 = h != 0u ? h : 0x6c078965u;
    }
    return s;
}

CRT_FN u32 crt_xorshift(CrtSampler *s) {
    u32 x = s->b0;
    x ^= x << 13;
    x ^= x >> 17;
    x ^= x << 5;
    s->b0 = x;
    return x;
}

/* The index of a Sobol sample, shuffled for a dimension: without it all dimensions would have the same
   points but for their scrambles. In the first dimensions a matrix over GF(2) shuffles it, in eight steps,
   which is chosen so that two dimensions, four numbers, are stratified together (bench/shuffles.cpp). In
   the others a scramble by h does it, as if at random (Burley 2020). Both map every aligned block of 2^k
   indices onto such a block, so that the first 2^k samples stay a net. */
CRT_FN u32 crt_shuffled_index(const CrtSampler *s, u32 dimension, u32 h) {
    if (dimension >= CRT_SHUFFLED_DIMENSIONS) return crt_owen_shuffled(s->index, h);
    u32 index = s->index;
    for (u32 step = 0u; step < CRT_SHUFFLE_STEPS; ++step)
        index ^= (index >> (step + 1u)) & crt_shuffles[CRT_SHUFFLE_STEPS * dimension + step];
    return index;
}

/* One number of 32 random bits. */
CRT_FN u32 crt_sample_bits(CrtSampler *s, u32 dimension) {
    if (CRT_HAS(SOBOL) && s->kind == CRT_SAMPLER_SOBOL) {
        const u32 h = crt_hash(s->pixel_key + dimension * 0x9e3779b9u);
        const u32 shuffled = crt_shuffled_index(s, dimension, h);
        return crt_owen_scrambled(shuffled, h * 0x2c1b3c6du + 0x297a2d39u);
    }
    if (CRT_HAS(INDEPENDENT) && s->kind == CRT_SAMPLER_INDEPENDENT) {
        if (s->block != (dimension >> 1)) {
            const CrtPhilox r =
                crt_philox(s->pixel_key, s->index, s->index_high, dimension >> 1, s->seed_low, s->seed_high);
            s->block = dimension >> 1;
            s->b0 = r.x0;
            s->b1 = r.x1;
            s->b2 = r.x2;
            s->b3 = r.x3;
        }
        return (dimension & 1u) ? s->b2 : s->b0;
    }
    if (CRT_HAS(XORSHIFT)) return crt_xorshift(s);
    return 0u;
}

CRT_HOT_FN f32 crt_sample_1d(CrtSampler *s, u32 dimension) {
    return crt_unit(crt_sample_bits(s, dimension));
}

/* Two numbers, stratified together: the first two Sobol dimensions of a shuffled index, scrambled per
   (pixel, dimension) (Burley 2020, "Practical Hash-based Owen Scrambling"). */
CRT_HOT_FN CrtRandom2 crt_sample_2d(CrtSampler *s, u32 dimension) {
    CrtRandom2 u;
    u.x = 0.0f;
    u.y = 0.0f;
    if (CRT_HAS(SOBOL) && s->kind == CRT_SAMPLER_SOBOL) {
        const u32 h = crt_hash(s->pixel_key + dimension * 0x9e3779b9u);
        const u32 shuffled = crt_shuffled_index(s, dimension, h);
        u.x = crt_unit(crt_owen_scrambled(shuffled, h * 0x2c1b3c6du + 0x297a2d39u));
        /* Its low bits, which flip the first digits, differ from those of x. */
        const u32 swapped = (h >> 16) | (h << 16);
        u.y =
            crt_unit(crt_owen_scrambled(crt_sobol1_reversed(shuffled), swapped * 0x93d765ddu + 0x6e624eb7u));
        return u;
    }
    if (CRT_HAS(INDEPENDENT) && s->kind == CRT_SAMPLER_INDEPENDENT) {
        const u32 x = crt_sample_bits(s, dimension);
        u.x = crt_unit(x);
        u.y = crt_unit((dimension & 1u) ? s->b3 : s->b1);
        return u;
    }
    if (CRT_HAS(XORSHIFT)) {
        u.x = crt_unit(crt_xorshift(s));
        u.y = crt_unit(crt_xorshift(s));
    }
    return u;
}

CRT_KERNEL_END

#endif
