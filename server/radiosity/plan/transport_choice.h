#pragma once

#include <cstdint>

namespace radbake::radiosity {

/// How the form factors are kept. Field for field radbake.v1.Transport.
enum class Transport { kAuto, kDense, kSparse, kStreamed };
/// "auto", "dense", "sparse", "streamed".
inline const char* transport_name(Transport transport) {
  switch (transport) {
    case Transport::kAuto: return "auto";
    case Transport::kDense: return "dense";
    case Transport::kSparse: return "sparse";
    case Transport::kStreamed: return "streamed";
  }
  return "unknown";
}

/// Bytes that an operator takes at most while it is put together. Shapes: entries of a row at most.
///
///   sparse    n (8 e estimated + 8 e transposed + 8 min(n, 2 e) paired),  e = min(n, entries of a row)
///   dense     the larger of that and the paired rows with 8 n^2
///   streamed  64 n: sums and areas
std::uint64_t transport_bytes(Transport transport, std::uint64_t num_patches, std::uint64_t row_entries);

/// The operator to use within a memory limit: what costs least time of those that fit.
///
/// Dense where rows are so full that written out they are the smaller; else sparse; streamed where neither fits.
Transport choose_transport(std::uint64_t num_patches, std::uint64_t row_entries, std::uint64_t memory);

}  // namespace radbake::radiosity
