#include "common/base/shortened.h"

namespace radbake {

std::string shortened(const std::string& text, std::size_t max_bytes) {
  constexpr char kMore[] = "...";
  if (text.size() <= max_bytes) return text;
  std::size_t end = max_bytes - (sizeof kMore - 1);
  // The bytes of a character after its first are 10xxxxxx.
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0) == 0x80) --end;
  return text.substr(0, end) + kMore;
}

}  // namespace radbake
