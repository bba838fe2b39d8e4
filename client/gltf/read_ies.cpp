#include "client/gltf/read_ies.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <limits>
#include <sstream>
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

/// Up to the standard of 1995 the second number beside the ballast factor multiplies as well. In 2002 it has no meaning
/// yet; in 2019 it is the kind of the file. The first line names the standard, and in 1986 there was no such line.
bool has_lamp_factor(std::string_view text) {
  std::string_view line = text.substr(0, text.find('\n'));
  constexpr std::string_view kStandard = "LM-63-";
  const std::size_t at = line.find(kStandard);
  if (at == std::string_view::npos) return true;
  line.remove_prefix(at + kStandard.size());
  int year = 0;
  std::from_chars(line.data(), line.data() + line.size(), year);
  if (year < 100) year += year < 86 ? 2000 : 1900;
  return year <= 1995;
}

struct Row {
  double degrees;
  std::vector<float> candela;
};

/// The row at 180 degrees, from its neighbours where it was not measured. rows: ascending from 90 to 270.
void add_middle(std::vector<Row>& rows) {
  const auto next = std::find_if(rows.begin(), rows.end(), [](const Row& row) { return row.degrees >= 180; });
  if (next->degrees == 180) return;
  const Row& before = *(next - 1);
  const double share = (180 - before.degrees) / (next->degrees - before.degrees);
  Row middle{180, {}};
  for (std::size_t v = 0; v < before.candela.size(); ++v) {
    middle.candela.push_back(static_cast<float>(std::lerp(double{before.candela[v]}, double{next->candela[v]}, share)));
  }
  rows.insert(next, std::move(middle));
}

bool is_folded(const LightProfile& profile) {
  const std::vector<double>& angles = profile.horizontal_degrees;
  return angles.front() == 90 && angles.back() == 270 &&
         std::adjacent_find(angles.begin(), angles.end(), std::greater_equal<>()) == angles.end();
}

/// Angles from 90 to 270 mirror the plane through both: the same all around.
void unfold(LightProfile& profile) {
  const std::size_t num = profile.vertical_degrees.size();
  std::vector<Row> rows;
  for (std::size_t h = 0; h < profile.horizontal_degrees.size(); ++h) {
    const auto first = profile.candela.begin() + static_cast<std::ptrdiff_t>(h * num);
    rows.push_back({profile.horizontal_degrees[h], {first, first + static_cast<std::ptrdiff_t>(num)}});
  }
  add_middle(rows);  // its image closes the circle
  for (std::size_t h = 0, measured = rows.size(); h < measured; ++h) {
    const Row row = rows[h];
    rows.push_back({row.degrees <= 180 ? 180 - row.degrees : 540 - row.degrees, row.candela});
    if (row.degrees == 180) rows.push_back({360, row.candela});
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
  RADBAKE_RETURN_IF_ERROR(check_profile_size(num_vertical, num_horizontal));
  RADBAKE_RETURN_IF_ERROR(numbers.skip(4, "the size of the opening"));
  RADBAKE_ASSIGN_OR_RETURN(const double ballast_factor, numbers.next("the ballast factor"));
  RADBAKE_ASSIGN_OR_RETURN(const double lamp_factor, numbers.next("the number after the ballast factor"));
  factor *= has_lamp_factor(text) ? ballast_factor * lamp_factor : ballast_factor;
  RADBAKE_RETURN_IF_ERROR(numbers.skip(1, "the watts"));
  LightProfile profile;
  RADBAKE_ASSIGN_OR_RETURN(profile.vertical_degrees, numbers.next_list(num_vertical, "vertical angle"));
  RADBAKE_ASSIGN_OR_RETURN(profile.horizontal_degrees, numbers.next_list(num_horizontal, "horizontal angle"));
  RADBAKE_ASSIGN_OR_RETURN(const std::vector<double> candela,
                           numbers.next_list(num_vertical * num_horizontal, "intensity"));
  for (const double value : candela) {
    if (!(std::fabs(factor * value) <= std::numeric_limits<float>::max())) {
      std::ostringstream message;
      message << "intensity " << value << " times " << factor << " cd is beyond single precision";
      return invalid_argument(message.str());
    }
    profile.candela.push_back(static_cast<float>(factor * value));
  }
  if (is_folded(profile)) unfold(profile);
  RADBAKE_RETURN_IF_ERROR(check_profile(profile));
  return profile;
}

}  // namespace radbake::gltf
