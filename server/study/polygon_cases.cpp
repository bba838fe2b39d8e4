#include "server/study/polygon_cases.h"

#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

namespace radbake::study {

using Json = nlohmann::ordered_json;

Result<PolygonCase> read_polygon_case(const Json& source) {
  PolygonCase out;
  try {
    std::vector<radiosity::PolygonCorners> polygons;
    for (const Json& polygon : source.at("polygons")) {
      radiosity::PolygonCorners& corners = polygons.emplace_back();
      for (const Json& corner : polygon) {
        corners.push_back({corner.at(0).get<double>(), corner.at(1).get<double>(), corner.at(2).get<double>()});
      }
    }
    const auto polygon = [&](const Json& index, const char* member) {
      const auto i = index.get<std::int64_t>();
      if (i < 0 || i >= static_cast<std::int64_t>(polygons.size())) {
        throw std::out_of_range(std::string(member) + " is " + std::to_string(i) + ", but the case has " +
                                std::to_string(polygons.size()) + " polygons");
      }
      return polygons[static_cast<std::size_t>(i)];
    };
    out.from = polygon(source.at("from"), "from");
    out.to = polygon(source.at("to"), "to");
    if (source.contains("occluders")) {
      for (const Json& index : source["occluders"]) out.occluders.push_back(polygon(index, "occluders"));
    }
  } catch (const std::exception& exception) {
    return invalid_argument(exception.what());
  }
  return out;
}

}  // namespace radbake::study
