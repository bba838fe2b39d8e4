#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "common/base/result.h"
#include "server/radiosity/form_factor/analytic.h"

namespace radbake::study {

/// A pair of polygons and what stands between them.
struct PolygonCase {
  radiosity::PolygonCorners from, to;
  std::vector<radiosity::PolygonCorners> occluders;
};

/// Reads {"polygons": [[[x, y, z], ...], ...], "from", "to", "occluders": [indices]}.
/// Errors: kInvalidArgument naming the member.
Result<PolygonCase> read_polygon_case(const nlohmann::ordered_json& source);

}  // namespace radbake::study
