#pragma once

#include <cmath>
#include <concepts>

#include "common/geometry/vector.h"

namespace radbake::radiosity {

/// Light has three channels; where all is grey, one does. What is written for both gives equal bits for equal channels:
/// no channel's arithmetic looks at another, and what joins them gives x for (x, x, x).
template <typename C>
concept Channels = std::same_as<C, double> || std::same_as<C, Vec3>;

template <Channels C>
inline constexpr int kNumChannels = std::same_as<C, Vec3> ? 3 : 1;

// A number as its own only channel. The same for Vec3 is in common/geometry/vector.h.
inline double scaled_by(double a, double b) { return a * b; }
inline double max_component(double a) { return a; }
inline bool is_finite(double a) { return std::isfinite(a); }

inline double magnitudes(double a) { return std::fabs(a); }
inline Vec3 magnitudes(Vec3 a) { return {std::fabs(a.x), std::fabs(a.y), std::fabs(a.z)}; }

/// Mean of the channels. Unlike mean_component() it gives x itself for (x, x, x), as long as x is finite.
inline double mean_of_channels(double a) { return a; }
inline double mean_of_channels(Vec3 a) { return a.x + ((a.y - a.x) + (a.z - a.x)) / 3; }

inline double channel(const double& a, int) { return a; }
inline double& channel(double& a, int) { return a; }
inline double channel(const Vec3& a, int c) { return a[c]; }
inline double& channel(Vec3& a, int c) { return a[c]; }

/// function(a, b) of each channel.
template <typename Function>
double by_channel(double a, double b, const Function& function) {
  return function(a, b);
}
template <typename Function>
Vec3 by_channel(Vec3 a, Vec3 b, const Function& function) {
  return {function(a.x, b.x), function(a.y, b.y), function(a.z, b.z)};
}

}  // namespace radbake::radiosity
