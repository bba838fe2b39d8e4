#include "client/options/values.h"

#include <charconv>
#include <cmath>

namespace radbake::options {
namespace {

/// Three finite numbers with commas between them; `what` says what was expected.
Result<Vec3> parse_three(std::string_view text, const std::string& what) {
  Vec3 values;
  for (int i = 0; i < 3; ++i) {
    const std::size_t comma = text.find(',');
    const std::string_view word = text.substr(0, comma);
    if ((comma == std::string_view::npos) != (i == 2)) return invalid_argument("expected " + what);
    const auto [end, failure] = std::from_chars(word.data(), word.data() + word.size(), values[i]);
    if (failure != std::errc() || end != word.data() + word.size() || word.empty()) {
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
    return invalid_argument("expected DX,DY,DZ:R,G,B, for example 0.3,-1,0.2:50000,48000,45000");
  }
  RADBAKE_ASSIGN_OR_RETURN(const Vec3 direction,
                           parse_three(std::string_view(text).substr(0, colon), "a direction DX,DY,DZ"));
  RADBAKE_ASSIGN_OR_RETURN(const Vec3 illuminance, parse_rgb(text.substr(colon + 1)));
  // Scaled first, so that neither the largest nor the smallest numbers overflow when they are squared.
  const double scale = std::fmax(std::fabs(direction.x), std::fmax(std::fabs(direction.y), std::fabs(direction.z)));
  if (scale == 0) return invalid_argument("the direction " + text.substr(0, colon) + " is zero");
  return DirectionalLight{normalized(direction / scale), illuminance};
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

}  // namespace radbake::options
