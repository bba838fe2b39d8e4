#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "server/radiosity/solve/largest_key.h"
#include "server/radiosity/solve/solve_monitor.h"

namespace radbake::radiosity {
namespace {

constexpr std::size_t kSweepsBetweenLooks = 8;

/// What unshot light counts in the order of shooting: A dB, the mean of the channels. A patch without visible area can
/// not be left out if its column is not empty: it counts with the mean area.
std::vector<double> weights_of(std::span<const double> areas) {
  double sum = 0;
  for (const double area : areas) sum += area;
  const double mean = sum > 0 ? sum / static_cast<double>(areas.size()) : 1;
  std::vector<double> weights;
  for (const double area : areas) weights.push_back(area > 0 ? area : mean);
  return weights;
}

template <Channels C>
double unshot_flux(double weight, C unshot) {
  const double flux = weight * mean_of_channels(magnitudes(unshot));
  return std::isfinite(flux) ? flux : std::numeric_limits<double>::infinity();
}

}  // namespace

template <Channels C>
void solve_by_shooting(SolveMonitor<C>& monitor, std::vector<C>& radiosity, std::vector<C>& unshot) {
  const TransportOperator& transport = monitor.transport();
  const ProblemOf<C>& problem = monitor.problem();
  const std::size_t n = radiosity.size(), steps_per_check = std::max<std::size_t>(1, n / 32);
  const std::vector<double> weights = weights_of(transport.areas());
  std::optional<LargestKey> largest;
  std::vector<std::uint32_t> patches(n);
  std::vector<std::uint32_t> others;
  std::vector<double> form_factors, keys(n);
  double flux = 0;

  bool is_unshot_known = false;
  while (monitor.goes_on(radiosity, unshot)) {
    if (!is_unshot_known) {
      // What the guess lacks is its residual: add it, and it is what has not been shot.
      if (!largest) largest.emplace(n);
      unshot.assign(monitor.residuals().begin(), monitor.residuals().end());
      flux = monitor.flux();
      patches.resize(n);
      std::iota(patches.begin(), patches.end(), 0u);
      keys.resize(n);
      for (std::size_t i = 0; i < n; ++i) {
        radiosity[i] += unshot[i];
        flux += transport.areas()[i] * mean_of_channels(unshot[i]);
        keys[i] = unshot_flux(weights[i], unshot[i]);
      }
      largest->set(patches, keys);
    }
    is_unshot_known = true;
    for (std::size_t steps = 1; steps <= kSweepsBetweenLooks * n && !monitor.is_cancelled(); ++steps) {
      const std::uint32_t i = largest->largest();
      if (largest->key(i) == 0) {
        // All is shot; what rounding has left over since then shows in a look.
        if (steps == 1) return monitor.end_without_progress();
        is_unshot_known = false;
        break;
      }
      // Shoot from i: B_j += (M F)_ji dB_i and dB_j += the same, for all j.
      const C shot = unshot[i];
      constexpr double kNone = 0;
      unshot[i] = {};
      largest->set(std::span(&i, 1), std::span(&kNone, 1));
      transport.column(i, patches, form_factors);
      const auto receive = [&](std::uint32_t j, C received) {
        radiosity[j] += received;
        unshot[j] += received;
        flux += transport.areas()[j] * mean_of_channels(received);
        keys.push_back(unshot_flux(weights[j], unshot[j]));
      };
      keys.clear();
      for (std::size_t k = 0; k < patches.size(); ++k) {
        const std::uint32_t j = patches[k];
        receive(j, scaled_by(problem.reflectance[j], shot * form_factors[k]));
      }
      largest->set(patches, keys);
      if (problem.transmits()) {
        keys.clear();
        others.clear();
        for (std::size_t k = 0; k < patches.size(); ++k) {
          const std::uint32_t j = problem.other_side[patches[k]];
          if (max_component(problem.transmittance[j]) == 0) continue;
          receive(j, scaled_by(problem.transmittance[j], shot * form_factors[k]));
          others.push_back(j);
        }
        largest->set(others, keys);
      }
      monitor.add_steps(1, 1);
      // r = M F dB: its size is at most (1 - margin) that of dB.
      if (steps % steps_per_check == 0 &&
          !monitor.needs_no_look((1 - monitor.margin()) * monitor.size_of(unshot), flux, radiosity, unshot)) {
        is_unshot_known = false;
        break;
      }
    }
  }
}
template void solve_by_shooting(SolveMonitor<double>&, std::vector<double>&, std::vector<double>&);
template void solve_by_shooting(SolveMonitor<Vec3>&, std::vector<Vec3>&, std::vector<Vec3>&);

}  // namespace radbake::radiosity
