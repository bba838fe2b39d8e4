#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "client/image/map_difference.h"

namespace radbake::cli {

/// What `radbake compare` found.
struct Comparison {
  image::MapDifference difference;
  std::optional<image::Calibration> calibration;  ///< where standard errors were given
  std::string picture;                            ///< the file written; empty: none
  double picture_limit = 0;                       ///< the relative difference of its full colours
};

std::string comparison_text(const Comparison& comparison);
nlohmann::ordered_json comparison_json(const Comparison& comparison);

}  // namespace radbake::cli
