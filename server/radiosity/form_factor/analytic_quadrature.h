#pragma once

#include <span>
#include <vector>

namespace radbake::radiosity {

/// A node in 0..1 and its weight; the weights sum to 1.
struct GaussPoint {
  double node = 0, weight = 0;
};

/// The n-point Gauss-Legendre rule on 0..1, exact for polynomials of degree 2n - 1. Precondition: 1 <= n <= 20.
/// Source: Golub & Welsch 1969; nodes by Newton's method on the Legendre polynomial.
std::span<const GaussPoint> gauss_legendre(int n);

/// A point of a triangle by the shares of its corners, and its weight; the weights sum to 1.
struct TrianglePoint {
  double a = 0, b = 0, c = 0, weight = 0;
};

/// 7 points, exact for degree 5. Source: Radon 1948.
std::span<const TrianglePoint> radon_rule();
/// 16 points, exact for degree 8. Source: Dunavant 1985.
std::span<const TrianglePoint> dunavant_rule();

}  // namespace radbake::radiosity
