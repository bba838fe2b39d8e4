#include "server/radiosity/plan/transport_choice.h"

#include <algorithm>

namespace radbake::radiosity {

std::uint64_t transport_bytes(Transport transport, std::uint64_t num_patches, std::uint64_t row_entries) {
  constexpr std::uint64_t kEstimated = 8, kTransposed = 8, kPaired = 8, kDenseEntry = 8, kRow = 64;
  const std::uint64_t n = num_patches, e = std::min(n, row_entries), paired = kPaired * std::min(n, 2 * e);
  switch (transport) {
    case Transport::kAuto: break;
    case Transport::kDense: return n * std::max((kEstimated + kTransposed) * e + paired, paired + kDenseEntry * n);
    case Transport::kSparse: return n * ((kEstimated + kTransposed) * e + paired);
    case Transport::kStreamed: return n * kRow;
  }
  return 0;
}

Transport choose_transport(std::uint64_t num_patches, std::uint64_t row_entries, std::uint64_t memory) {
  const auto fits = [&](Transport transport) { return transport_bytes(transport, num_patches, row_entries) <= memory; };
  const bool are_rows_full = 2 * row_entries >= num_patches;
  if (are_rows_full && fits(Transport::kDense)) return Transport::kDense;
  return fits(Transport::kSparse) ? Transport::kSparse : Transport::kStreamed;
}

}  // namespace radbake::radiosity
