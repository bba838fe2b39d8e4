#include "common/base/trace.h"

#include <sys/random.h>

#include <algorithm>
#include <vector>

#include "common/base/check.h"

namespace radbake {
namespace {

constexpr std::size_t kTraceDigits = 32, kParentDigits = 16;
/// Where the parts of version-trace-parent-flags begin, and where they end.
constexpr std::size_t kTraceAt = 3, kParentAt = kTraceAt + kTraceDigits + 1, kFlagsAt = kParentAt + kParentDigits + 1,
                      kEnd = kFlagsAt + 2;

bool is_hex(std::string_view text) {
  return std::all_of(text.begin(), text.end(),
                     [](char digit) { return (digit >= '0' && digit <= '9') || (digit >= 'a' && digit <= 'f'); });
}

bool is_id(std::string_view text) { return is_hex(text) && text.find_first_not_of('0') != std::string_view::npos; }

}  // namespace

std::string random_hex(std::size_t num_bytes) {
  std::vector<unsigned char> bytes(num_bytes);
  RADBAKE_CHECK_EQ(getrandom(bytes.data(), bytes.size(), 0), static_cast<ssize_t>(num_bytes));
  constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const unsigned char byte : bytes) {
    text.push_back(kDigits[byte >> 4]);
    text.push_back(kDigits[byte & 15]);
  }
  return text;
}

TraceContext new_trace() {
  // All zero is no id; it comes up once in 2^64.
  TraceContext trace;
  while (!is_id(trace.trace_id)) trace.trace_id = random_hex(kTraceDigits / 2);
  while (!is_id(trace.parent_id)) trace.parent_id = random_hex(kParentDigits / 2);
  return trace;
}

std::optional<TraceContext> parse_traceparent(std::string_view header) {
  if (header.size() < kEnd) return std::nullopt;
  const std::string_view version = header.substr(0, 2), trace = header.substr(kTraceAt, kTraceDigits),
                         parent = header.substr(kParentAt, kParentDigits), flags = header.substr(kFlagsAt, 2);
  if (!is_hex(version) || version == "ff" || !is_id(trace) || !is_id(parent) || !is_hex(flags)) return std::nullopt;
  if (header[kTraceAt - 1] != '-' || header[kParentAt - 1] != '-' || header[kFlagsAt - 1] != '-') return std::nullopt;
  if (header.size() > kEnd && (version == "00" || header[kEnd] != '-')) return std::nullopt;
  const char low = flags[1];
  const int bits = low <= '9' ? low - '0' : low - 'a' + 10;
  return TraceContext{std::string(trace), std::string(parent), (bits & 1) == 1};
}

std::string to_traceparent(const TraceContext& trace) {
  return "00-" + trace.trace_id + "-" + trace.parent_id + (trace.is_sampled ? "-01" : "-00");
}

}  // namespace radbake
