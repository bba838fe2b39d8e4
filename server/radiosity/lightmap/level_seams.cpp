#include "server/radiosity/lightmap/level_seams.h"

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>

#include "server/radiosity/survey/mesh_edges.h"

namespace radbake::radiosity {
namespace {

constexpr double kSamplesPerTexel = 2;
/// Ends of an edge that lie nearer, in texels, lie side by side.
constexpr double kSamePlace = 1e-3;
/// How much a difference counts against a move of a measured texel, and a move of a filled one.
constexpr double kSeamWeight = 10;
constexpr double kFilledWeight = 0.05;
constexpr double kTolerance = 1e-6;
constexpr int kMaxIterations = 500;

/// The four texels of a bilinear look-up.
struct LookUp {
  std::array<std::uint32_t, 4> texels;
  std::array<double, 4> weights;
};

/// Where a viewer meets a seam from either side.
struct SeamSample {
  LookUp a, b;
};

/// Looks up where a point of a sheet lies: texel centres at halves, clamped at the sheet's border.
LookUp look_up(const Layout& layout, int sheet, Vec2 p) {
  const double x = p.x - 0.5, y = p.y - static_cast<double>(sheet) * layout.height - 0.5;
  const double left = std::floor(x), top = std::floor(y);
  const double fx = x - left, fy = y - top;
  LookUp out;
  for (int k = 0; k < 4; ++k) {
    const int column = std::clamp(static_cast<int>(left) + k % 2, 0, layout.width - 1);
    const int row = std::clamp(static_cast<int>(top) + k / 2, 0, layout.height - 1);
    out.texels[k] = static_cast<std::uint32_t>((sheet * layout.height + row) * layout.width + column);
    out.weights[k] = (k % 2 == 0 ? 1 - fx : fx) * (k / 2 == 0 ? 1 - fy : fy);
  }
  return out;
}

double distance(Vec2 a, Vec2 b) { return std::hypot(a.x - b.x, a.y - b.y); }

std::vector<SeamSample> find_samples(const Surfaces& surfaces, const Layout& layout) {
  std::vector<SeamSample> samples;
  for (const MeshRange& range : mesh_ranges(surfaces)) {
    for (const SharedEdge& edge : shared_edges(surfaces, range.begin, range.end)) {
      // The edge runs the other way round in the second triangle.
      const int a0 = edge.edge_of_a, a1 = (a0 + 1) % 3, b1 = edge.edge_of_b, b0 = (b1 + 1) % 3;
      const auto& a = layout.corners[edge.a];
      const auto& b = layout.corners[edge.b];
      if (distance(a[a0], b[b0]) < kSamePlace && distance(a[a1], b[b1]) < kSamePlace) continue;
      if (twice_area(a) == 0 || twice_area(b) == 0) continue;
      const bool is_smooth = are_same_normal(surfaces.corner_normal(edge.a, a0), surfaces.corner_normal(edge.b, b0)) &&
                             are_same_normal(surfaces.corner_normal(edge.a, a1), surfaces.corner_normal(edge.b, b1));
      if (!is_smooth) continue;
      const double texels = std::max(distance(a[a0], a[a1]), distance(b[b0], b[b1]));
      const int sheet = layout.meshes[surfaces.meshes[edge.a]].sheet;
      const int n = std::max(1, static_cast<int>(std::ceil(texels * kSamplesPerTexel)));
      for (int i = 0; i < n; ++i) {
        const double s = (i + 0.5) / n;
        samples.push_back(
            {look_up(layout, sheet, a[a0] * (1 - s) + a[a1] * s), look_up(layout, sheet, b[b0] * (1 - s) + b[b1] * s)});
      }
    }
  }
  return samples;
}

/// The texels that samples look up, ascending: the unknowns.
std::vector<std::uint32_t> looked_up(const std::vector<SeamSample>& samples) {
  std::vector<std::uint32_t> texels;
  texels.reserve(8 * samples.size());
  for (const SeamSample& sample : samples) {
    texels.insert(texels.end(), sample.a.texels.begin(), sample.a.texels.end());
    texels.insert(texels.end(), sample.b.texels.begin(), sample.b.texels.end());
  }
  std::sort(texels.begin(), texels.end());
  texels.erase(std::unique(texels.begin(), texels.end()), texels.end());
  return texels;
}

double difference_of(const std::vector<SeamSample>& samples, std::span<const float> rgba) {
  double squares = 0, mean = 0;
  const auto value = [&](const LookUp& look, int channel) {
    double sum = 0;
    for (int k = 0; k < 4; ++k) sum += look.weights[k] * rgba[4 * std::size_t{look.texels[k]} + channel];
    return sum;
  };
  for (const SeamSample& sample : samples) {
    for (int channel = 0; channel < 3; ++channel) {
      const double a = value(sample.a, channel), b = value(sample.b, channel);
      squares += (a - b) * (a - b);
      mean += (a + b) / 2;
    }
  }
  const double n = 3 * static_cast<double>(samples.size());
  return mean > 0 ? std::sqrt(squares / n) / (mean / n) : 0;
}

}  // namespace

SeamReport level_seams(const Surfaces& surfaces, const Layout& layout, std::span<const TexelState> states,
                       std::span<float> rgba) {
  SeamReport report;
  const std::vector<SeamSample> samples = find_samples(surfaces, layout);
  report.num_samples = samples.size();
  if (samples.empty()) return report;
  report.difference_before = difference_of(samples, rgba);

  // One row a sample: the weights of the one side less those of the other.
  const std::vector<std::uint32_t> texels = looked_up(samples);
  const auto unknown = [&](std::uint32_t texel) {
    return static_cast<int>(std::lower_bound(texels.begin(), texels.end(), texel) - texels.begin());
  };
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(8 * samples.size());
  for (std::size_t s = 0; s < samples.size(); ++s) {
    for (int k = 0; k < 4; ++k) {
      entries.emplace_back(static_cast<int>(s), unknown(samples[s].a.texels[k]), samples[s].a.weights[k]);
      entries.emplace_back(static_cast<int>(s), unknown(samples[s].b.texels[k]), -samples[s].b.weights[k]);
    }
  }
  const auto num_unknowns = static_cast<Eigen::Index>(texels.size());
  Eigen::SparseMatrix<double> differences(static_cast<Eigen::Index>(samples.size()), num_unknowns);
  differences.setFromTriplets(entries.begin(), entries.end());
  Eigen::VectorXd weights(num_unknowns);
  for (Eigen::Index i = 0; i < num_unknowns; ++i) {
    weights[i] = states[texels[static_cast<std::size_t>(i)]] == TexelState::kValid ? 1 : kFilledWeight;
  }
  Eigen::SparseMatrix<double> system = kSeamWeight * Eigen::SparseMatrix<double>(differences.transpose() * differences);
  system += Eigen::SparseMatrix<double>(weights.asDiagonal());
  Eigen::ConjugateGradient<Eigen::SparseMatrix<double>, Eigen::Lower | Eigen::Upper> solver;
  solver.setTolerance(kTolerance);
  solver.setMaxIterations(kMaxIterations);
  solver.compute(system);

  for (int channel = 0; channel < 3; ++channel) {
    Eigen::VectorXd before(num_unknowns);
    for (Eigen::Index i = 0; i < num_unknowns; ++i) {
      before[i] = rgba[4 * std::size_t{texels[static_cast<std::size_t>(i)]} + channel];
    }
    const Eigen::VectorXd target = weights.cwiseProduct(before);
    const Eigen::VectorXd after = solver.solveWithGuess(target, before);
    for (Eigen::Index i = 0; i < num_unknowns; ++i) {
      // Light is never negative.
      rgba[4 * std::size_t{texels[static_cast<std::size_t>(i)]} + channel] =
          std::max(0.0f, static_cast<float>(after[i]));
    }
  }
  report.difference = difference_of(samples, rgba);
  return report;
}

}  // namespace radbake::radiosity
