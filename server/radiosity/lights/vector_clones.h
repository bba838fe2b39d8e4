#pragma once

// RADBAKE_VECTOR_CLONES before a function: code for wider vectors as well, chosen when the program starts. Bits do not
// depend on the choice: nothing is contracted or reordered. Sanitizers start too late for the choosing.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && defined(__OPTIMIZE__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define RADBAKE_VECTOR_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define RADBAKE_VECTOR_CLONES
#endif
