/// Functions of much arithmetic, compiled for AVX2 as well as for every processor.
#pragma once

/// Before a function's definition: it exists twice, each time with all that it calls in it, and the program
/// chooses when it starts. Both give the same bits, because AVX2 alone fuses no operations. It exists once
/// for other compilers than GCC and other processors than x86-64, and with sanitizers, which would have to
/// start before the choice.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define CRT_FOR_AVX2_TOO __attribute__((target_clones("avx2", "default"), flatten))
#else
#define CRT_FOR_AVX2_TOO
#endif
