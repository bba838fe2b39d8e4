#include "server/service/config_values.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <vector>

#include "server/access/listen_address.h"

namespace radbake::service {
namespace {

/// 1024 to the power of a unit's place, from 1 on.
constexpr std::string_view kUnits = "KMGT";

std::optional<std::uint64_t> read_digits(std::string_view text) {
  std::uint64_t number = 0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (text.empty() || problem != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

std::optional<std::uint64_t> read_bytes(std::string_view text) {
  unsigned shift = 0;
  if (!text.empty()) {
    const std::size_t unit = kUnits.find(text.back());
    if (unit != std::string_view::npos) {
      shift = 10 * static_cast<unsigned>(unit + 1);
      text.remove_suffix(1);
    }
  }
  const auto number = read_digits(text);
  if (!number || *number > (UINT64_MAX >> shift)) return std::nullopt;
  return *number << shift;
}

std::string write_seconds(std::chrono::milliseconds time) {
  std::string text = std::to_string(time.count() / 1000);
  if (const auto rest = time.count() % 1000; rest > 0) {
    std::string decimals = std::to_string(1000 + rest).substr(1);
    decimals.erase(decimals.find_last_not_of('0') + 1);
    text += "." + decimals;
  }
  return text;
}

}  // namespace

std::string write_bytes(std::uint64_t bytes) {
  std::size_t unit = 0;
  while (unit < kUnits.size() && bytes > 0 && bytes % 1024 == 0) {
    bytes /= 1024;
    ++unit;
  }
  return std::to_string(bytes) + (unit > 0 ? std::string(1, kUnits[unit - 1]) : "");
}

ValueKind<std::uint64_t> whole_number(std::uint64_t least, std::uint64_t most) {
  const auto read = [least, most](const std::string& text) {
    const auto number = read_digits(text);
    return number && *number >= least && *number <= most ? number : std::nullopt;
  };
  return {"NUMBER", "a whole number from " + std::to_string(least) + " to " + std::to_string(most), read,
          [](const std::uint64_t& number) { return std::to_string(number); }};
}

ValueKind<std::uint64_t> byte_size(std::uint64_t least, std::uint64_t most) {
  const auto read = [least, most](const std::string& text) {
    const auto bytes = read_bytes(text);
    return bytes && *bytes >= least && *bytes <= most ? bytes : std::nullopt;
  };
  return {"SIZE", "bytes from " + write_bytes(least) + " to " + write_bytes(most) + ", such as 65536, 64K or 1M", read,
          [](const std::uint64_t& bytes) { return write_bytes(bytes); }};
}

ValueKind<std::chrono::milliseconds> seconds(double least, double most) {
  const auto read = [least, most](const std::string& text) -> std::optional<std::chrono::milliseconds> {
    double number = 0;
    const auto [end, problem] =
        std::from_chars(text.data(), text.data() + text.size(), number, std::chars_format::fixed);
    if (text.empty() || problem != std::errc() || end != text.data() + text.size()) return std::nullopt;
    if (!(number >= least && number <= most)) return std::nullopt;  // nor "nan"
    return std::chrono::milliseconds(std::llround(1000 * number));
  };
  const auto in_ms = [](double number) { return std::chrono::milliseconds(std::llround(1000 * number)); };
  return {"SECONDS", "seconds from " + write_seconds(in_ms(least)) + " to " + write_seconds(in_ms(most)), read,
          write_seconds};
}

ValueKind<std::string> one_of(std::initializer_list<const char*> words) {
  const std::vector<std::string> known(words.begin(), words.end());
  std::string list;
  for (std::size_t i = 0; i < known.size(); ++i) {
    list += (i == 0 ? "" : i + 1 < known.size() ? ", " : " or ") + known[i];
  }
  const auto read = [known](const std::string& text) -> std::optional<std::string> {
    if (std::find(known.begin(), known.end(), text) == known.end()) return std::nullopt;
    return text;
  };
  return {"WORD", list, read, [](const std::string& word) { return word; }};
}

ValueKind<std::filesystem::path> path_of(const std::string& what) {
  const auto read = [](const std::string& text) -> std::optional<std::filesystem::path> {
    if (text.empty() || text.find('\0') != std::string::npos) return std::nullopt;
    return std::filesystem::path(text);
  };
  return {"PATH", "the path of " + what, read, [](const std::filesystem::path& path) { return path.string(); }};
}

ValueKind<std::string> address(bool allows_unix) {
  const auto read = [allows_unix](const std::string& text) -> std::optional<std::string> {
    const auto parts = access::read_address(text);
    return parts && (allows_unix || parts->path.empty()) ? std::optional(text) : std::nullopt;
  };
  return {"ADDRESS",
          "HOST:PORT with a port from 0 (any free one) to 65535" +
              (allows_unix
                   ? ", or unix:PATH with a path of at most " + std::to_string(access::kMaxSocketPathBytes) + " bytes"
                   : std::string()),
          read, [](const std::string& text) { return text; }};
}

}  // namespace radbake::service
