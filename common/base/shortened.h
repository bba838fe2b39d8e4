#pragma once

#include <cstddef>
#include <string>

namespace radbake {

/// Enough of a message for people; what strangers name things may have a mebibyte.
inline constexpr std::size_t kMaxMessageBytes = 1000;

/// A text of at most so many bytes: what is longer is cut before a character of UTF-8, and ends in "...".
/// Precondition: max_bytes > 3.
std::string shortened(const std::string& text, std::size_t max_bytes = kMaxMessageBytes);

}  // namespace radbake
