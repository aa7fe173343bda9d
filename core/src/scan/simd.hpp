#pragma once

/// Compiles a function for AVX2, too, and takes that version where the processor has it.
///
/// Not under ThreadSanitizer: the choice is made before its runtime is up, and it would crash. Nor
/// with clang, whose clones of functions seen from other files do not link.
#if defined(__SANITIZE_THREAD__) || defined(__clang__)
#define SCANLOC_SIMD
#else
#define SCANLOC_SIMD __attribute__((target_clones("avx2", "default")))
#endif

/// For what takes or tells vectors: such a function is inlined everywhere, so that they are never
/// passed.
#define SCANLOC_INLINE inline __attribute__((always_inline))
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wpsabi"
#endif
