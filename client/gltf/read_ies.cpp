#include "client/gltf/read_ies.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>

#include "client/gltf/entry.h"

namespace radbake::gltf {
namespace {

/// Numbers parted by blanks, commas and ends of lines.
class Numbers {
 public:
  explicit Numbers(std::string_view text) : text_(text) {}

  Result<double> next(const std::string& what) {
    text_.remove_prefix(std::min(text_.find_first_not_of(kBlanks), text_.size()));
    const std::string_view word = text_.substr(0, text_.find_first_of(kBlanks));
    if (word.empty()) return invalid_argument("the file ends before " + what);
    text_.remove_prefix(word.size());
    double value = 0;
    const char* const begin = word.data() + (word.front() == '+' ? 1 : 0);
    const auto [end, error] = std::from_chars(begin, word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value)) {
      return invalid_argument(what + " is " + in_quotes(word) + ", which is no number");
    }
    return value;
  }

  Result<std::size_t> next_count(const std::string& what) {
    RADBAKE_ASSIGN_OR_RETURN(const double value, next(what));
    if (value >= 1 && value <= static_cast<double>(kMostProfileAngles) && value == std::floor(value)) {
      return static_cast<std::size_t>(value);
    }
    return invalid_argument(what + " is " + std::to_string(value) + ": must be a whole number from 1 to " +
                            std::to_string(kMostProfileAngles));
  }

  Result<std::vector<double>> next_list(std::size_t count, const std::string& what) {
    std::vector<double> values;
    for (std::size_t k = 0; k < count; ++k) {
      RADBAKE_ASSIGN_OR_RETURN(const double value, next(what + " " + std::to_string(k + 1)));
      values.push_back(value);
    }
    return values;
  }

  Result<void> skip(std::size_t count, const std::string& what) {
    for (std::size_t k = 0; k < count; ++k) {
      const Result<double> value = next(what);
      if (!value.ok()) return value.error();
    }
    return {};
  }

 private:
  static constexpr std::string_view kBlanks = " \t\r\n,";
  std::string_view text_;
};

/// What follows the TILT line, and whether it begins with a table of tilts.
struct Body {
  std::string_view text;
  bool has_tilts = false;
};
Result<Body> find_body(std::string_view text) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    constexpr std::string_view kTilt = "TILT=";
    if (line.substr(0, kTilt.size()) != kTilt) continue;
    line.remove_prefix(kTilt.size());
    return Body{text, line.substr(0, 7) == "INCLUDE"};
  }
  return invalid_argument("it has no TILT line: it is no IES file");
}

/// Angles from 90 to 270 mirror the plane through both: the same all around.
void unfold(LightProfile& profile) {
  const std::size_t num = profile.vertical_degrees.size();
  struct Row {
    double degrees;
    std::vector<float> candela;
  };
  std::vector<Row> rows;
  for (std::size_t h = 0; h < profile.horizontal_degrees.size(); ++h) {
    const auto first = profile.candela.begin() + static_cast<std::ptrdiff_t>(h * num);
    const std::vector<float> values(first, first + static_cast<std::ptrdiff_t>(num));
    const double degrees = profile.horizontal_degrees[h], mirrored = degrees <= 180 ? 180 - degrees : 540 - degrees;
    rows.push_back({degrees, values});
    rows.push_back({mirrored, values});
    if (mirrored == 0) rows.push_back({360, values});
    if (mirrored == 360) rows.push_back({0, values});
  }
  std::stable_sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return a.degrees < b.degrees; });
  rows.erase(std::unique(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return a.degrees == b.degrees; }),
             rows.end());
  profile.horizontal_degrees.clear();
  profile.candela.clear();
  for (const Row& row : rows) {
    profile.horizontal_degrees.push_back(row.degrees);
    profile.candela.insert(profile.candela.end(), row.candela.begin(), row.candela.end());
  }
}

}  // namespace

Result<LightProfile> read_ies(std::string_view text) {
  if (text.size() > kMaxIesBytes) {
    return invalid_argument("it has " + std::to_string(text.size()) + " bytes, above the limit of " +
                            std::to_string(kMaxIesBytes));
  }
  RADBAKE_ASSIGN_OR_RETURN(const Body body, find_body(text));
  Numbers numbers(body.text);
  if (body.has_tilts) {
    RADBAKE_RETURN_IF_ERROR(numbers.skip(1, "the lamp's geometry"));
    RADBAKE_ASSIGN_OR_RETURN(const std::size_t num_tilts, numbers.next_count("the number of tilts"));
    RADBAKE_RETURN_IF_ERROR(numbers.skip(2 * num_tilts, "a tilt"));
  }
  RADBAKE_RETURN_IF_ERROR(numbers.skip(1, "the number of lamps"));
  RADBAKE_RETURN_IF_ERROR(numbers.skip(1, "the lumens of a lamp"));
  RADBAKE_ASSIGN_OR_RETURN(double factor, numbers.next("the candela multiplier"));
  RADBAKE_ASSIGN_OR_RETURN(const std::size_t num_vertical, numbers.next_count("the number of vertical angles"));
  RADBAKE_ASSIGN_OR_RETURN(const std::size_t num_horizontal, numbers.next_count("the number of horizontal angles"));
  RADBAKE_ASSIGN_OR_RETURN(const double type, numbers.next("the photometric type"));
  if (type != 1) {
    return invalid_argument("it is of photometric type " +
                            std::string(type == 2   ? "B"
                                        : type == 3 ? "A"
                                                    : std::to_string(type)) +
                            ": only type C (1) is read");
  }
  RADBAKE_RETURN_IF_ERROR(numbers.skip(4, "the size of the opening"));
  for (const char* what : {"the ballast factor", "the ballast-lamp factor"}) {
    RADBAKE_ASSIGN_OR_RETURN(const double ballast, numbers.next(what));
    factor *= ballast;
  }
  RADBAKE_RETURN_IF_ERROR(numbers.skip(1, "the watts"));
  LightProfile profile;
  RADBAKE_ASSIGN_OR_RETURN(profile.vertical_degrees, numbers.next_list(num_vertical, "vertical angle"));
  RADBAKE_ASSIGN_OR_RETURN(profile.horizontal_degrees, numbers.next_list(num_horizontal, "horizontal angle"));
  RADBAKE_ASSIGN_OR_RETURN(const std::vector<double> candela,
                           numbers.next_list(num_vertical * num_horizontal, "intensity"));
  for (const double value : candela) profile.candela.push_back(static_cast<float>(factor * value));
  if (profile.horizontal_degrees.front() == 90 && profile.horizontal_degrees.back() == 270) unfold(profile);
  RADBAKE_RETURN_IF_ERROR(check_profile(profile));
  return profile;
}

}  // namespace radbake::gltf
