#include <bit>
#include <cmath>

#include "common/base/sequence.h"
#include "server/radiosity/visibility/visibility.h"

namespace radbake::radiosity {
namespace {

class Unblocked final : public Visibility {
 public:
  explicit Unblocked(const Visibility& visibility) : visibility_(visibility) {}

  void trace(std::span<const Ray> rays, std::span<Hit> hits) const override { visibility_.trace(rays, hits); }
  void blocked(std::span<const Ray>, std::span<std::uint8_t> blocked) const override {
    std::fill(blocked.begin(), blocked.end(), 0);
  }
  void transmitted(std::span<const Ray>, std::span<Vec3> shares) const override {
    std::fill(shares.begin(), shares.end(), Vec3{1, 1, 1});
  }
  void triangles_near(Vec3 point, double distance, std::vector<std::uint32_t>& triangles) const override {
    visibility_.triangles_near(point, distance, triangles);
  }
  void triangles_in(const Shaft& shaft, std::vector<std::uint32_t>& triangles) const override {
    visibility_.triangles_in(shaft, triangles);
  }
  std::string instruction_set() const override { return visibility_.instruction_set(); }

 private:
  const Visibility& visibility_;
};

}  // namespace

std::unique_ptr<Visibility> make_unblocked(const Visibility& visibility) {
  return std::make_unique<Unblocked>(visibility);
}

Chances::Chances(std::span<const Ray> batch) {
  if (batch.empty()) return;
  for (int axis = 0; axis < 3; ++axis) {
    const std::uint64_t origin = std::bit_cast<std::uint32_t>(batch[0].origin[axis]);
    const std::uint64_t direction = std::bit_cast<std::uint32_t>(batch[0].direction[axis]);
    seed_ = mixed_bits(seed_ ^ (origin << 32 | direction));
  }
}

double Chances::of(std::size_t ray, std::uint32_t triangle) const {
  // Fractions of the golden ratio and of square roots of primes.
  constexpr std::array<double, 8> kTurns = {0.6180339887498949, 0.4142135623730950, 0.7320508075688773,
                                            0.2360679774997897, 0.6457513110645906, 0.3166247903553998,
                                            0.6055512754639893, 0.1231056256176605};
  const std::uint64_t bits = mixed_bits(seed_ ^ triangle);
  const double shift = static_cast<double>(bits >> 11) * 0x1p-53;
  const double at = kTurns[bits % kTurns.size()] * (static_cast<double>(ray) + 0.5) + shift;
  return at - std::floor(at);
}

}  // namespace radbake::radiosity
