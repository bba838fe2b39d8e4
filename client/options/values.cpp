#include "client/options/values.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

namespace radbake::options {
namespace {

/// Whether all of a word is one number.
bool parse_number(std::string_view word, double& value) {
  const auto [end, failure] = std::from_chars(word.data(), word.data() + word.size(), value);
  return failure == std::errc() && end == word.data() + word.size() && !word.empty();
}

/// Three finite numbers with commas between them; `what` says what was expected.
Result<Vec3> parse_three(std::string_view text, const std::string& what) {
  Vec3 values;
  for (int i = 0; i < 3; ++i) {
    const std::size_t comma = text.find(',');
    const std::string_view word = text.substr(0, comma);
    if ((comma == std::string_view::npos) != (i == 2)) return invalid_argument("expected " + what);
    if (!parse_number(word, values[i])) {
      return invalid_argument("'" + std::string(word) + "' is not a number; expected " + what);
    }
    if (!std::isfinite(values[i])) return invalid_argument("'" + std::string(word) + "' is not finite");
    if (i < 2) text.remove_prefix(comma + 1);
  }
  return values;
}

}  // namespace

Result<Vec3> parse_rgb(const std::string& text) {
  RADBAKE_ASSIGN_OR_RETURN(const Vec3 rgb, parse_three(text, "R,G,B, for example 1000,1000,1200"));
  if (min_component(rgb) < 0) return invalid_argument("'" + text + "' holds a number below 0");
  return rgb;
}

Result<DirectionalLight> parse_sun(const std::string& text) {
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos) {
    return invalid_argument("expected DX,DY,DZ:R,G,B or DX,DY,DZ:R,G,B:DEGREES, for example " +
                            std::string("0.3,-1,0.2:50000,48000,45000"));
  }
  RADBAKE_ASSIGN_OR_RETURN(const Vec3 direction,
                           parse_three(std::string_view(text).substr(0, colon), "a direction DX,DY,DZ"));
  const std::size_t second = text.find(':', colon + 1);
  RADBAKE_ASSIGN_OR_RETURN(const Vec3 illuminance, parse_rgb(text.substr(colon + 1, second - colon - 1)));
  double degrees = kSunDegrees;
  if (second != std::string::npos) {
    const std::string word = text.substr(second + 1);
    if (!parse_number(word, degrees)) {
      return invalid_argument("'" + word + "' is not a number; expected the sun's angular diameter in degrees");
    }
    if (!(degrees >= 0 && degrees < 180)) {
      return invalid_argument("'" + word + "' degrees: the sun's angular diameter is at least 0 and below 180");
    }
  }
  // Scaled first, so that neither the largest nor the smallest numbers overflow when they are squared.
  const double scale = std::fmax(std::fabs(direction.x), std::fmax(std::fabs(direction.y), std::fabs(direction.z)));
  if (scale == 0) return invalid_argument("the direction " + text.substr(0, colon) + " is zero");
  return DirectionalLight{normalized(direction / scale), illuminance, degrees * std::numbers::pi / 180};
}

Result<SkyImage> parse_sky_image(const std::string& text) {
  SkyImage image{text};
  const std::size_t colon = text.rfind(':');
  const std::string word = colon == std::string::npos ? "" : text.substr(colon + 1);
  if (parse_number(word, image.scale)) {
    image.file = text.substr(0, colon);
    if (!(image.scale > 0 && std::isfinite(image.scale))) {
      return invalid_argument("'" + word + "' as a scale to nit: must be above 0 and finite");
    }
  }
  if (image.file.empty()) return invalid_argument("expected FILE or FILE:SCALE, for example dawn.hdr:2000");
  return image;
}

Result<std::uint64_t> parse_bytes(const std::string& text) {
  const Error bad = invalid_argument("'" + text + "' is not a number of bytes from 1K to 1024G, such as 512M or 4G");
  std::uint64_t value = 0;
  const char* const last = text.data() + text.size();
  const auto [end, failure] = std::from_chars(text.data(), last, value);
  if (failure != std::errc() || last - end > 1) return bad;
  const std::string suffixes = "KMG";
  const std::size_t step = end == last ? 0 : suffixes.find(*end) + 1;
  if (end != last && step == 0) return bad;
  constexpr std::uint64_t kLeast = std::uint64_t{1} << 10, kMost = std::uint64_t{1} << 40;
  if (value > kMost >> (10 * step)) return bad;
  value <<= 10 * step;
  if (value < kLeast) return bad;
  return value;
}

Result<double> parse_share(const std::string& text) {
  const bool is_percentage = text.ends_with('%');
  double value = 0;
  const bool is_number = parse_number(std::string_view(text).substr(0, text.size() - is_percentage), value);
  if (is_percentage) value /= 100;
  if (is_number && value > 0 && value < 1) return value;
  return invalid_argument(
      "'" + text + "' is neither a percentage such as 2% nor a fraction such as 0.02, above 0 and " + "below 100 %");
}

Result<std::uint64_t> parse_milliseconds(const std::string& text) {
  struct Unit {
    std::string_view name;
    double milliseconds;
  };
  constexpr Unit kUnits[] = {{"", 1e3}, {"s", 1e3}, {"ms", 1}, {"m", 6e4}, {"h", 3.6e6}};
  constexpr double kMost = 30 * 24 * 3.6e6;
  const std::size_t length = std::min(text.find_first_of("smh"), text.size());
  double value = 0;
  const bool is_number = parse_number(std::string_view(text).substr(0, length), value);
  for (const Unit& unit : kUnits) {
    const double milliseconds = std::round(value * unit.milliseconds);
    if (is_number && text.substr(length) == unit.name && milliseconds >= 1 && milliseconds <= kMost) {
      return static_cast<std::uint64_t>(milliseconds);
    }
  }
  return invalid_argument("'" + text + "' is not a time from 1ms to 720h, such as 30 or 30s, 500ms, 5m, 2h");
}

}  // namespace radbake::options
