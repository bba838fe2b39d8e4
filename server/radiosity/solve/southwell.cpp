#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "server/radiosity/solve/largest_key.h"
#include "server/radiosity/solve/solve_monitor.h"

namespace radbake::radiosity {
namespace {

/// After so many sweeps' worth of steps the residual that is carried along is replaced by the true one.
constexpr std::size_t kSweepsBetweenLooks = 8;

}  // namespace

template <Channels C>
void solve_by_southwell(SolveMonitor<C>& monitor, std::vector<C>& radiosity) {
  const TransportOperator& transport = monitor.transport();
  const ProblemOf<C>& problem = monitor.problem();
  const std::size_t n = radiosity.size();
  std::optional<LargestKey> largest;
  std::vector<std::uint32_t> patches(n);
  std::vector<std::uint32_t> others;
  std::vector<double> form_factors, keys(n);
  std::vector<C> residuals;

  while (monitor.goes_on(radiosity)) {
    if (!largest) largest.emplace(n);
    residuals.assign(monitor.residuals().begin(), monitor.residuals().end());
    double flux = monitor.flux();
    patches.resize(n);
    std::iota(patches.begin(), patches.end(), 0u);
    keys.resize(n);
    for (std::size_t i = 0; i < n; ++i) keys[i] = largest_component(residuals[i]);
    largest->set(patches, keys);

    for (std::size_t steps = 0; steps < kSweepsBetweenLooks * n && !monitor.is_cancelled(); ++steps) {
      const std::uint32_t i = largest->largest();
      if (largest->key(i) == 0) {
        if (steps == 0) return monitor.end_without_progress();
        break;
      }
      transport.column(i, patches, form_factors);
      const auto own = std::lower_bound(patches.begin(), patches.end(), i);
      const double own_factor = own != patches.end() && *own == i ? form_factors[own - patches.begin()] : 0;

      // Make equation i hold: dB_i = r_i / (1 - (M F)_ii), and r_j += (M F)_ji dB_i for all others.
      C own_share = problem.reflectance[i] * own_factor;
      if (problem.transmits()) {
        const auto other = std::lower_bound(patches.begin(), patches.end(), problem.other_side[i]);
        if (other != patches.end() && *other == problem.other_side[i]) {
          own_share += problem.transmittance[i] * form_factors[other - patches.begin()];
        }
      }
      const C r = residuals[i];
      const C change = by_channel(r, own_share, [](double residual, double share) { return residual / (1 - share); });
      radiosity[i] += change;
      flux += transport.areas()[i] * mean_of_channels(change);
      keys.resize(patches.size());
      for (std::size_t k = 0; k < patches.size(); ++k) {
        const std::uint32_t j = patches[k];
        residuals[j] = j == i ? C{} : residuals[j] + scaled_by(problem.reflectance[j], change * form_factors[k]);
        keys[k] = largest_component(residuals[j]);
      }
      largest->set(patches, keys);
      if (problem.transmits()) {
        others.clear();
        keys.clear();
        for (std::size_t k = 0; k < patches.size(); ++k) {
          const std::uint32_t j = problem.other_side[patches[k]];
          if (j == i || max_component(problem.transmittance[j]) == 0) continue;
          residuals[j] += scaled_by(problem.transmittance[j], change * form_factors[k]);
          others.push_back(j);
          keys.push_back(largest_component(residuals[j]));
        }
        largest->set(others, keys);
      }
      if (own_factor == 0) {
        // The patch does not see itself, so its column may leave it out.
        constexpr double kNone = 0;
        residuals[i] = {};
        largest->set(std::span(&i, 1), std::span(&kNone, 1));
      }
      monitor.add_steps(1, 1);
      if (!monitor.needs_no_look(largest->key(largest->largest()), flux, radiosity)) break;
    }
  }
}
template void solve_by_southwell(SolveMonitor<double>&, std::vector<double>&);
template void solve_by_southwell(SolveMonitor<Vec3>&, std::vector<Vec3>&);

}  // namespace radbake::radiosity
