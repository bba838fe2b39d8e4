#pragma once

#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/geometry/vector.h"

namespace radbake::radiosity {

/// PolygonCorners [n], n >= 3, of a planar simple polygon, counter-clockwise seen from its front.
using PolygonCorners = std::vector<Vec3>;

/// How a form factor was found. Where parts of the patches went different ways, the last of them in this list.
enum class AnalyticMethod {
  kZero,        ///< neither patch has a part in front of the other
  kKernel,      ///< far and small: Gauss rules on both patches
  kContour,     ///< double contour integral
  kQuadrature,  ///< Lambert's formula over the smaller patch: where the contour cancels
  kOccluded,    ///< the open value less what occluders hide, or Lambert's formula of what is visible over one patch
};
const char* analytic_method_name(AnalyticMethod method);

struct PolygonFormFactor {
  double form_factor = 0;
  double stated_error = 0;  ///< |form_factor - exact| is at most this: two rules, rounding, corners known to 8 ulp
  AnalyticMethod method = AnalyticMethod::kZero;
  long evaluations = 0;  ///< of the kernel, of a contour's inner edge, or of the visible part from a point
};

/// Form factor between two one-sided polygons, with what stands between them.
///
///   F = 1/(pi A_from) int_from int_to cos cos' V / r^2
///
/// Unoccluded parts: 1/(2 pi A) oint oint ln r dr.dr', or Gauss rules on both patches where they are far apart.
/// Occluded: that, less the light on lines that pass through occluders, by integrals over pairs of edges; where
/// occluders are too many or tangled, Lambert's formula of what is visible from a point, integrated over the patch that
/// is further from them. `tolerance` bounds the error of the occluded part; unoccluded ones end near rounding. What
/// does not exceed its error is given as 0.
///
/// Occluders are two-sided and have no thickness. Neither patch may be among them. Policies:
/// * An occluder in the plane of a patch lies on its front and covers it: the limit as it comes from the other patch.
/// * Coplanar patches do not see each other: 0. Patches that coincide face to face have no unique value: refused.
/// * Gaps between occluders below about 64 ulp of the largest coordinate are closed.
///
/// Shapes: from [n], to [m], occluders [k][n_k].
/// Units:  lengths in any one unit; tolerance absolute, dimensionless.
/// Errors: kInvalidArgument: fewer than 3 corners, not finite, zero area, corners off their plane by more than 8 ulp of
///         the polygon's largest coordinate, patches that coincide face to face, a tolerance not above 0. Where the
///         limit of 4 million evaluations ends an occluded case, stated_error is above the tolerance. The two rules see
///         what is visible from the points of their cells, at least 128: light visible from a smaller share can be
///         missed.
/// Cost:   unoccluded: 10 to 200 microseconds; behind a few occluders: 50 to 700; else milliseconds and more.
/// Source: Lambert 1760; Schroeder & Hanrahan 1993 (contour); Santalo 1976 (measure of lines); Walton 2002, NISTIR
/// 6925.
Result<PolygonFormFactor> polygon_form_factor(std::span<const Vec3> from, std::span<const Vec3> to,
                                              std::span<const PolygonCorners> occluders, double tolerance = 1e-4);

}  // namespace radbake::radiosity
