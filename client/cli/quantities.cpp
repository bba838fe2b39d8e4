#include "client/cli/quantities.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace radbake::cli {
namespace {

template <typename... Values>
std::string format(const char* pattern, Values... values) {
  char text[64];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

}  // namespace

std::string grouped(std::uint64_t count) {
  std::string text = std::to_string(count);
  for (std::size_t at = text.size(); at > 3;) text.insert(at -= 3, ",");
  return text;
}

std::string compact(double value) { return format("%.3g", value); }

std::string duration(double seconds) {
  if (!(seconds > 0)) return "0 s";
  if (seconds < 0.995) return format("%.2g s", seconds);
  if (seconds < 9.95) return format("%.1f s", seconds);
  if (seconds < 119.5) return format("%.0f s", seconds);
  const auto whole = static_cast<long long>(std::llround(std::fmin(seconds, 1e15)));
  if (whole < 3600) return format("%lld min %lld s", whole / 60, whole % 60);
  const long long minutes = (whole + 30) / 60;
  return format("%lld h %lld min", minutes / 60, minutes % 60);
}

std::string bytes(std::uint64_t count) {
  const char* const units[] = {"B", "KB", "MB", "GB", "TB", "PB", "EB"};
  double value = static_cast<double>(count);
  std::size_t unit = 0;
  for (; value >= 999.5 && unit + 1 < std::size(units); ++unit) value /= 1024;
  return format(value < 9.95 && unit > 0 ? "%.1f %s" : "%.0f %s", value, units[unit]);
}

std::string counted(std::uint64_t count, const std::string& thing) {
  return grouped(count) + " " + thing + (count == 1 ? "" : thing.ends_with("h") ? "es" : "s");
}

std::string padded(std::string text, std::size_t width) {
  text.resize(std::max(text.size(), width), ' ');
  return text;
}

}  // namespace radbake::cli
