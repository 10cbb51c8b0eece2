/*
 * dialect.h: one vocabulary for three compilers (C++17, CUDA C++, OpenCL C 1.2). The only nest of compiler
 * #ifs: every other kernel header reads the same in all three.
 *
 * Rules of the dialect: functions take and return values (or write through a private pointer); no recursion,
 * no globals, no function pointers, no overloads, no v[i], no swizzles, no brace-initialised vectors.
 * Arithmetic is IEEE, never contracted: crt_fma is written where a fused operation is meant. Data in memory
 * is scalars, arrays of scalars, or CrtVec4.
 *
 * Types: u16 u32 i32 u64 f32 f64, vec3, vec4; vec8 and mask8 where CRT_SIMD8 is 1 (CPUs).
 */
#ifndef CRT_DIALECT_H
#define CRT_DIALECT_H

#if defined(__OPENCL_VERSION__) /* ------------------------------------------------ OpenCL C 1.2 */

#pragma OPENCL FP_CONTRACT OFF
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
#define CRT_FN static inline
#if CRT_SIMD8 && CRT_LEAN /* PoCL would call functions of 100 instructions: a tenth of a render */
#define CRT_HOT_FN __attribute__((always_inline)) CRT_FN
#else /* A kernel with all features would take 4 s more to compile. */
#define CRT_HOT_FN CRT_FN
#endif
#define CRT_CALLED_FN __attribute__((noinline)) static
#define CRT_SHARED_FN CRT_FN
#define CRT_GLOBAL __global
#define CRT_CONSTANT __constant
#define CRT_KERNEL_BEGIN
#define CRT_KERNEL_END
typedef ushort u16;
typedef uint u32;
typedef int i32;
typedef ulong u64;
typedef float f32;
typedef double f64;
/* Adds n to a word that other threads add to as well. Returns the carry: 1 if the sum has passed 2^64. The
   order of threads decides which of them gets a carry, not how many carries there are. OpenCL 1.2 promises
   atomics of 32 bits only: a word is two halves, low first. */
CRT_FN u32 crt_atomic_carry(CRT_GLOBAL u64 *word, u64 n) {
    volatile CRT_GLOBAL u32 *halves = (volatile CRT_GLOBAL u32 *)word;
    const u32 low = (u32)n;
    const u32 carry = (u32)(atomic_add(&halves[0], low) + low) < low ? 1u : 0u;
    const u32 high = (u32)(n >> 32) + carry;
    if (high == 0u) return carry;
    return (u32)(atomic_add(&halves[1], high) + high) < high ? 1u : 0u;
}
typedef float3 vec3;
typedef float4 vec4;
#define CRT_BYTE uchar
#define make_vec3(x, y, z) ((float3)((x), (y), (z)))
#define make_vec4(x, y, z, w) ((float4)((x), (y), (z), (w)))
#define splat4(s) ((float4)(s))
#define V3X(v) ((v).x)
#define V3Y(v) ((v).y)
#define V3Z(v) ((v).z)
#define V4X(v) ((v).x)
#define V4Y(v) ((v).y)
#define V4Z(v) ((v).z)
#define V4W(v) ((v).w)
#define crt_fma(a, b, c) fma((float)(a), (float)(b), (float)(c))
#define crt_sqrt(x) sqrt((float)(x))
#define crt_abs(x) fabs((float)(x))
#define crt_floor(x) floor((float)(x))
#define crt_bits(x) as_uint((float)(x))
#define crt_from_bits(u) as_float((uint)(u))
#define crt_mulhi(a, b) mul_hi((uint)(a), (uint)(b))
#define crt_lowest_bit(u) (31u - clz((uint)(u) & (0u - (uint)(u)))) /* of a number that is not 0 */
#define crt_sqrt4(v) sqrt((float4)(v))
#define crt_abs4(v) fabs((float4)(v))
#define crt_load4(p) vload4(0, (p))
#define crt_is_finite(x) isfinite((float)(x))
CRT_FN u32 crt_reverse_bits(u32 x) {
    x = ((x & 0x55555555u) << 1) | ((x >> 1) & 0x55555555u);
    x = ((x & 0x33333333u) << 2) | ((x >> 2) & 0x33333333u);
    x = ((x & 0x0f0f0f0fu) << 4) | ((x >> 4) & 0x0f0f0f0fu);
    x = ((x & 0x00ff00ffu) << 8) | ((x >> 8) & 0x00ff00ffu);
    return (x << 16) | (x >> 16);
}
/* min, max and select lane by lane; a < b ? a : b, so that a NaN in `a` yields b. */
CRT_FN vec4 crt_min4(vec4 a, vec4 b) { return select(b, a, a < b); }
CRT_FN vec4 crt_max4(vec4 a, vec4 b) { return select(b, a, a > b); }
/* The same for tests that only cull: of 0 and −0 it may return either. A NaN in `a` yields b, which is no
   NaN. */
#define crt_cull_min(a, b) fmin((float)(a), (float)(b))
#define crt_cull_max(a, b) fmax((float)(a), (float)(b))
#define crt_cull_min4(a, b) crt_min4(a, b)
#define crt_cull_max4(a, b) crt_max4(a, b)
#define crt_fma4(a, b, c) fma((float4)(a), (float4)(b), (float4)(c))
/* Lane by lane a < b ? x : y. */
CRT_FN vec4 crt_where_less4(vec4 a, vec4 b, vec4 x, vec4 y) { return select(y, x, a < b); }
#define CRT_ROLLED _Pragma("unroll 1")
#define CRT_TWICE _Pragma("unroll 2")
#define crt_fast_reciprocal(x) (1.0f / (x))
#define CRT_FETCH(p) ((void)(p)) /* PoCL's prefetch() does nothing */
#ifndef CRT_SIMD8
#define CRT_SIMD8 1
#endif
#if CRT_SIMD8
typedef float8 vec8;
typedef int8 mask8;
#define splat8(s) ((float8)(s))
#define crt_load8(p) vload8(0, (p))
#define crt_fma8(a, b, c) fma((float8)(a), (float8)(b), (float8)(c))
CRT_FN vec8 crt_min8(vec8 a, vec8 b) { return select(b, a, a < b); }
#define crt_sign8(v) (as_int8(v) & (int8)(0x80000000))         /* sign bits alone */
#define crt_flip8(v, signs) as_float8(as_int8(v) ^ (signs)) /* v with those signs flipped */
/* Sign bits of the lanes, lane 0 in bit 0. */
CRT_FN u32 mask8_bits(mask8 m) {
    const int8 w = m & (int8)(1, 2, 4, 8, 16, 32, 64, 128);
    const int4 a = w.lo | w.hi;
    const int2 b = a.lo | a.hi;
    return (u32)(b.x | b.y);
}
#endif
#define CRT_ASSERT_SIZE(type, bytes) typedef char crt_size_of_##type[(sizeof(type) == (bytes)) ? 1 : -1]

#elif defined(__CUDACC__) || defined(__CUDACC_RTC__) /* ------------------------------- CUDA C++ */

#define CRT_FN static __device__ inline
#define CRT_HOT_FN CRT_FN
#define CRT_CALLED_FN CRT_FN /* a call costs 0.8 % of a render, and users do not wait for this compiler */
/* A function with many callers stays a call: copies of it would fill the instruction cache, and a kernel of
   many materials waits for instructions more than for all else
   (docs/decisions/0041-instruction-cache.md). */
#ifdef CRT_CUDA_ON_HOST
#define CRT_SHARED_FN CRT_FN
#else
#define CRT_SHARED_FN static __device__ __noinline__
#endif
#define CRT_GLOBAL
#define CRT_CONSTANT static __device__ const
#define CRT_KERNEL_BEGIN
#define CRT_KERNEL_END
typedef unsigned short u16;
typedef unsigned int u32;
typedef int i32;
typedef unsigned long long u64;
typedef float f32;
typedef double f64;
struct vec3 {
    f32 x, y, z;
};
struct __align__(16) vec4 {
    f32 x, y, z, w;
};
#define CRT_BYTE unsigned char
CRT_FN vec3 make_vec3(f32 x, f32 y, f32 z) { vec3 v; v.x = x; v.y = y; v.z = z; return v; }
CRT_FN vec4 make_vec4(f32 x, f32 y, f32 z, f32 w) { vec4 v; v.x = x; v.y = y; v.z = z; v.w = w; return v; }
CRT_FN vec4 splat4(f32 s) { return make_vec4(s, s, s, s); }
#define V3X(v) ((v).x)
#define V3Y(v) ((v).y)
#define V3Z(v) ((v).z)
#define V4X(v) ((v).x)
#define V4Y(v) ((v).y)
#define V4Z(v) ((v).z)
#define V4W(v) ((v).w)
CRT_FN vec3 operator+(vec3 a, vec3 b) { return make_vec3(a.x + b.x, a.y + b.y, a.z + b.z); }
CRT_FN vec3 operator-(vec3 a, vec3 b) { return make_vec3(a.x - b.x, a.y - b.y, a.z - b.z); }
CRT_FN vec3 operator*(vec3 a, vec3 b) { return make_vec3(a.x * b.x, a.y * b.y, a.z * b.z); }
CRT_FN vec3 operator*(vec3 a, f32 s) { return make_vec3(a.x * s, a.y * s, a.z * s); }
CRT_FN vec3 operator*(f32 s, vec3 a) { return make_vec3(s * a.x, s * a.y, s * a.z); }
CRT_FN vec3 operator/(vec3 a, f32 s) { return make_vec3(a.x / s, a.y / s, a.z / s); }
CRT_FN vec3 operator-(vec3 a) { return make_vec3(-a.x, -a.y, -a.z); }
CRT_FN vec4 operator+(vec4 a, vec4 b) { return make_vec4(a.x + b.x, a.y + b.y, a.z + b.z, a.w + b.w); }
CRT_FN vec4 operator-(vec4 a, vec4 b) { return make_vec4(a.x - b.x, a.y - b.y, a.z - b.z, a.w - b.w); }
CRT_FN vec4 operator*(vec4 a, vec4 b) { return make_vec4(a.x * b.x, a.y * b.y, a.z * b.z, a.w * b.w); }
CRT_SHARED_FN vec4 operator/(vec4 a, vec4 b) {
    return make_vec4(a.x / b.x, a.y / b.y, a.z / b.z, a.w / b.w);
}
CRT_FN vec4 operator*(vec4 a, f32 s) { return a * splat4(s); }
CRT_FN vec4 operator*(f32 s, vec4 a) { return splat4(s) * a; }
CRT_FN vec4 operator/(vec4 a, f32 s) { return a / splat4(s); }
#ifdef CRT_CUDA_ON_HOST /* the same file behind a shim that runs it as C++ (tests) */
CRT_FN f32 crt_fma(f32 a, f32 b, f32 c) { return __builtin_fmaf(a, b, c); }
CRT_FN f32 crt_sqrt(f32 x) { return __builtin_sqrtf(x); }
CRT_FN u32 crt_bits(f32 x) { u32 u; __builtin_memcpy(&u, &x, 4); return u; }
CRT_FN f32 crt_from_bits(u32 u) { f32 x; __builtin_memcpy(&x, &u, 4); return x; }
CRT_FN u32 crt_mulhi(u32 a, u32 b) { return (u32)(((u64)a * b) >> 32); }
CRT_FN u32 crt_reverse_bits(u32 x) {
    u32 r = 0;
    for (int i = 0; i < 32; ++i) r |= ((x >> i) & 1u) << (31 - i);
    return r;
}
#define crt_abs(x) __builtin_fabsf(x)
#define crt_floor(x) __builtin_floorf(x)
#define fminf __builtin_fminf
#define fmaxf __builtin_fmaxf
#define crt_fast_reciprocal(x) (1.0f / (x))
#else
#define crt_fma(a, b, c) __fmaf_rn((a), (b), (c))
#define crt_sqrt(x) __fsqrt_rn(x)
#define crt_abs(x) fabsf(x)
#define crt_floor(x) floorf(x)
#define crt_bits(x) __float_as_uint(x)
#define crt_from_bits(u) __uint_as_float(u)
#define crt_mulhi(a, b) __umulhi((a), (b))
#define crt_reverse_bits(x) __brev(x)
CRT_FN f32 crt_fast_reciprocal(f32 x) {
    f32 r;
    asm("rcp.approx.ftz.f32 %0, %1;" : "=f"(r) : "f"(x));
    return r;
}
#endif
CRT_FN u32 crt_atomic_carry(u64 *word, u64 n) { return atomicAdd(word, n) + n < n ? 1u : 0u; }
CRT_FN bool crt_is_finite(f32 x) { return (crt_bits(x) & 0x7f800000u) != 0x7f800000u; }
CRT_FN vec4 crt_load4(const f32 *p) { return *reinterpret_cast<const vec4 *>(p); }
CRT_SHARED_FN vec4 crt_sqrt4(vec4 v) {
    return make_vec4(crt_sqrt(v.x), crt_sqrt(v.y), crt_sqrt(v.z), crt_sqrt(v.w));
}
CRT_FN vec4 crt_abs4(vec4 v) { return make_vec4(crt_abs(v.x), crt_abs(v.y), crt_abs(v.z), crt_abs(v.w)); }
CRT_FN vec4 crt_min4(vec4 a, vec4 b) {
    return make_vec4(a.x < b.x ? a.x : b.x, a.y < b.y ? a.y : b.y, a.z < b.z ? a.z : b.z,
                     a.w < b.w ? a.w : b.w);
}
CRT_FN vec4 crt_max4(vec4 a, vec4 b) {
    return make_vec4(a.x > b.x ? a.x : b.x, a.y > b.y ? a.y : b.y, a.z > b.z ? a.z : b.z,
                     a.w > b.w ? a.w : b.w);
}
#define crt_cull_min(a, b) fminf((a), (b))
#define crt_cull_max(a, b) fmaxf((a), (b))
CRT_FN vec4 crt_cull_min4(vec4 a, vec4 b) {
    return make_vec4(fminf(a.x, b.x), fminf(a.y, b.y), fminf(a.z, b.z), fminf(a.w, b.w));
}
CRT_FN vec4 crt_cull_max4(vec4 a, vec4 b) {
    return make_vec4(fmaxf(a.x, b.x), fmaxf(a.y, b.y), fmaxf(a.z, b.z), fmaxf(a.w, b.w));
}
CRT_FN vec4 crt_fma4(vec4 a, vec4 b, vec4 c) {
    return make_vec4(crt_fma(a.x, b.x, c.x), crt_fma(a.y, b.y, c.y), crt_fma(a.z, b.z, c.z),
                     crt_fma(a.w, b.w, c.w));
}
CRT_FN vec4 crt_where_less4(vec4 a, vec4 b, vec4 x, vec4 y) {
    return make_vec4(a.x < b.x ? x.x : y.x, a.y < b.y ? x.y : y.y, a.z < b.z ? x.z : y.z,
                     a.w < b.w ? x.w : y.w);
}
#ifdef CRT_CUDA_ON_HOST
#define CRT_ROLLED _Pragma("GCC unroll 1")
#define CRT_TWICE _Pragma("GCC unroll 2")
#else
#define CRT_ROLLED _Pragma("unroll 1")
#define CRT_TWICE _Pragma("unroll 2")
#endif
#define CRT_FETCH(p) ((void)(p)) /* other warps work meanwhile */
#define CRT_SIMD8 0
#define CRT_ASSERT_SIZE(type, bytes) static_assert(sizeof(type) == (bytes), "layout of " #type)

#else /* ------------------------------------------------------------------------------------ C++17 */

#include <cstdint>
#include <cstring>
#if defined(__AVX2__) && defined(__FMA__)
#include <immintrin.h>
#endif
#define CRT_FN static inline
#define CRT_ROLLED _Pragma("GCC unroll 1") /* before a loop whose body is too long to repeat */
#define CRT_TWICE _Pragma("GCC unroll 2")  /* before one whose turns are to overlap */
#ifdef __OPTIMIZE_SIZE__
#define CRT_HOT_FN CRT_FN
#else
#define CRT_HOT_FN /* so short, or called so often, that a call costs 1 % of a render or more */ \
    __attribute__((always_inline)) static inline
#endif
#define CRT_CALLED_FN \
    __attribute__((noinline, unused)) static /* long, with many callers; or seldom called */
#define CRT_SHARED_FN CRT_FN
#define CRT_GLOBAL
#define CRT_CONSTANT static constexpr
#define CRT_KERNEL_BEGIN namespace crt { namespace kernel {
#define CRT_KERNEL_END } }
CRT_KERNEL_BEGIN
typedef std::uint16_t u16;
typedef std::uint32_t u32;
typedef std::int32_t i32;
typedef std::uint64_t u64;
typedef float f32;
typedef double f64;
#define CRT_BYTE unsigned char
struct vec3 {
    f32 x, y, z;
};
typedef f32 crt_native4 __attribute__((vector_size(16)));
struct vec4 {
    crt_native4 v;
};
CRT_FN vec3 make_vec3(f32 x, f32 y, f32 z) { return vec3{x, y, z}; }
CRT_FN vec4 make_vec4(f32 x, f32 y, f32 z, f32 w) { return vec4{crt_native4{x, y, z, w}}; }
CRT_FN vec4 splat4(f32 s) { return vec4{crt_native4{s, s, s, s}}; }
#define V3X(a) ((a).x)
#define V3Y(a) ((a).y)
#define V3Z(a) ((a).z)
#define V4X(a) ((a).v[0])
#define V4Y(a) ((a).v[1])
#define V4Z(a) ((a).v[2])
#define V4W(a) ((a).v[3])
CRT_FN vec3 operator+(vec3 a, vec3 b) { return make_vec3(a.x + b.x, a.y + b.y, a.z + b.z); }
CRT_FN vec3 operator-(vec3 a, vec3 b) { return make_vec3(a.x - b.x, a.y - b.y, a.z - b.z); }
CRT_FN vec3 operator*(vec3 a, vec3 b) { return make_vec3(a.x * b.x, a.y * b.y, a.z * b.z); }
CRT_FN vec3 operator*(vec3 a, f32 s) { return make_vec3(a.x * s, a.y * s, a.z * s); }
CRT_FN vec3 operator*(f32 s, vec3 a) { return make_vec3(s * a.x, s * a.y, s * a.z); }
CRT_FN vec3 operator/(vec3 a, f32 s) { return make_vec3(a.x / s, a.y / s, a.z / s); }
CRT_FN vec3 operator-(vec3 a) { return make_vec3(-a.x, -a.y, -a.z); }
CRT_FN vec4 operator+(vec4 a, vec4 b) { return vec4{a.v + b.v}; }
CRT_FN vec4 operator-(vec4 a, vec4 b) { return vec4{a.v - b.v}; }
CRT_FN vec4 operator*(vec4 a, vec4 b) { return vec4{a.v * b.v}; }
CRT_FN vec4 operator/(vec4 a, vec4 b) { return vec4{a.v / b.v}; }
CRT_FN vec4 operator*(vec4 a, f32 s) { return vec4{a.v * s}; }
CRT_FN vec4 operator*(f32 s, vec4 a) { return vec4{s * a.v}; }
CRT_FN vec4 operator/(vec4 a, f32 s) { return vec4{a.v / s}; }
CRT_FN u32 crt_atomic_carry(u64 *word, u64 n) {
    return __atomic_fetch_add(word, n, __ATOMIC_RELAXED) + n < n ? 1u : 0u;
}
#define CRT_FETCH(p) __builtin_prefetch(p) /* begins to bring what is at `p` into the cache */
CRT_FN f32 crt_fma(f32 a, f32 b, f32 c) { return __builtin_fmaf(a, b, c); }
CRT_FN f32 crt_sqrt(f32 x) { return __builtin_sqrtf(x); }
CRT_FN f32 crt_abs(f32 x) { return __builtin_fabsf(x); }
CRT_FN f32 crt_floor(f32 x) { return __builtin_floorf(x); }
/* 1/x to within an ulp, and not the same on all backends: for tests that only cull. */
CRT_FN f32 crt_fast_reciprocal(f32 x) { return 1.0f / x; }
CRT_FN u32 crt_bits(f32 x) { u32 u; std::memcpy(&u, &x, 4); return u; }
CRT_FN f32 crt_from_bits(u32 u) { f32 x; std::memcpy(&x, &u, 4); return x; }
CRT_FN u32 crt_mulhi(u32 a, u32 b) { return static_cast<u32>((static_cast<u64>(a) * b) >> 32); }
CRT_FN u32 crt_lowest_bit(u32 u) { return static_cast<u32>(__builtin_ctz(u)); }
CRT_FN bool crt_is_finite(f32 x) { return (crt_bits(x) & 0x7f800000u) != 0x7f800000u; }
CRT_FN u32 crt_reverse_bits(u32 x) {
    x = ((x & 0x55555555u) << 1) | ((x >> 1) & 0x55555555u);
    x = ((x & 0x33333333u) << 2) | ((x >> 2) & 0x33333333u);
    x = ((x & 0x0f0f0f0fu) << 4) | ((x >> 4) & 0x0f0f0f0fu);
    return __builtin_bswap32(x);
}
CRT_FN vec4 crt_load4(const f32 *p) { vec4 r; std::memcpy(&r, p, 16); return r; }
CRT_FN vec4 crt_abs4(vec4 a) {
    typedef i32 bits4 __attribute__((vector_size(16)));
    return vec4{(crt_native4)((bits4)a.v & 0x7fffffff)};
}
CRT_FN vec4 crt_min4(vec4 a, vec4 b) { return vec4{a.v < b.v ? a.v : b.v}; }
CRT_FN vec4 crt_max4(vec4 a, vec4 b) { return vec4{a.v > b.v ? a.v : b.v}; }
CRT_FN vec4 crt_where_less4(vec4 a, vec4 b, vec4 x, vec4 y) { return vec4{a.v < b.v ? x.v : y.v}; }
CRT_FN f32 crt_cull_min(f32 a, f32 b) { return a < b ? a : b; }
CRT_FN f32 crt_cull_max(f32 a, f32 b) { return a > b ? a : b; }
CRT_FN vec4 crt_cull_min4(vec4 a, vec4 b) { return crt_min4(a, b); }
CRT_FN vec4 crt_cull_max4(vec4 a, vec4 b) { return crt_max4(a, b); }
#if defined(__AVX2__) && defined(__FMA__) /* The compiler would take lane after lane. */
CRT_FN vec4 crt_sqrt4(vec4 a) { return vec4{(crt_native4)_mm_sqrt_ps((__m128)a.v)}; }
CRT_FN vec4 crt_fma4(vec4 a, vec4 b, vec4 c) {
    return vec4{(crt_native4)_mm_fmadd_ps((__m128)a.v, (__m128)b.v, (__m128)c.v)};
}
#else
CRT_FN vec4 crt_sqrt4(vec4 a) {
    return make_vec4(crt_sqrt(V4X(a)), crt_sqrt(V4Y(a)), crt_sqrt(V4Z(a)), crt_sqrt(V4W(a)));
}
CRT_FN vec4 crt_fma4(vec4 a, vec4 b, vec4 c) {
    return make_vec4(crt_fma(V4X(a), V4X(b), V4X(c)), crt_fma(V4Y(a), V4Y(b), V4Y(c)),
                     crt_fma(V4Z(a), V4Z(b), V4Z(c)), crt_fma(V4W(a), V4W(b), V4W(c)));
}
#endif
#if defined(__AVX2__) && defined(__FMA__)
#define CRT_SIMD8 1
typedef f32 vec8 __attribute__((vector_size(32)));
typedef i32 mask8 __attribute__((vector_size(32)));
CRT_FN vec8 splat8(f32 s) { return vec8{s, s, s, s, s, s, s, s}; }
CRT_FN vec8 crt_load8(const f32 *p) { return (vec8)_mm256_loadu_ps(p); }
CRT_FN vec8 crt_fma8(vec8 a, vec8 b, vec8 c) {
    return (vec8)_mm256_fmadd_ps((__m256)a, (__m256)b, (__m256)c);
}
CRT_FN vec8 crt_min8(vec8 a, vec8 b) { return (vec8)_mm256_min_ps((__m256)a, (__m256)b); }
CRT_FN mask8 crt_sign8(vec8 v) { return (mask8)v & static_cast<i32>(0x80000000u); }
CRT_FN vec8 crt_flip8(vec8 v, mask8 signs) { return (vec8)((mask8)v ^ signs); }
CRT_FN u32 mask8_bits(mask8 m) { return static_cast<u32>(_mm256_movemask_ps((__m256)m)); }
#else
#define CRT_SIMD8 0
#endif
CRT_KERNEL_END
#define CRT_ASSERT_SIZE(type, bytes) static_assert(sizeof(type) == (bytes), "layout of " #type)

#endif

#endif
