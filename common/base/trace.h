#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace radbake {

/// Which distributed trace a call belongs to, as it travels in the header traceparent.
/// Source: W3C Trace Context, Recommendation of 23 November 2021, section 3.2.
struct TraceContext {
  std::string trace_id;   ///< 32 hexadecimal digits in lower case, not all 0: the same for all that one request causes
  std::string parent_id;  ///< 16 such digits: the caller
  bool is_sampled = true;
};

/// A trace of its own, by random numbers of the system.
TraceContext new_trace();

/// Reads version-trace-parent-flags. Strict: wrong lengths, capitals, zero ids and version ff are none; of a version
/// that is newer than 00, what follows the flags is not looked at.
std::optional<TraceContext> parse_traceparent(std::string_view header);

/// In version 00.
std::string to_traceparent(const TraceContext& trace);

/// Random bytes as hexadecimal digits, two a byte. Precondition: at most 256 bytes.
std::string random_hex(std::size_t num_bytes);

}  // namespace radbake
