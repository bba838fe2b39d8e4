#pragma once

#include <cstdint>
#include <string>

namespace radbake::cli {

// Numbers as people read them.

/// "1,234,567".
std::string grouped(std::uint64_t count);
/// Three digits that count: "0.0123", "12.3", "1.23e+04".
std::string compact(double value);
/// "0.012 s", "0.34 s", "3.4 s", "2 min 5 s", "3 h 20 min".
std::string duration(double seconds);
/// "512 KB", "1.5 GB": steps of 1024.
std::string bytes(std::uint64_t count);
/// "1 lamp", "3 lamps".
std::string counted(std::uint64_t count, const std::string& thing);
/// Text and blanks up to a width; longer text stays whole.
std::string padded(std::string text, std::size_t width);

}  // namespace radbake::cli
