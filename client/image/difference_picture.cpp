#include "client/image/difference_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <string>
#include <utility>

namespace radbake::image {
namespace {

using Colour = std::array<double, 3>;

constexpr int kLeastWidth = 512;
constexpr double kShownShare = 0.99;
/// Two equal maps have a scale too.
constexpr double kLeastLimit = 1e-6;
/// The scale below a map: pixels of its bar, of the gaps about it, and of a dot of a letter.
constexpr int kBarHeight = 14, kGap = 6, kDot = 3;
constexpr int kGlyphWidth = 3, kGlyphHeight = 5;
constexpr Colour kNotCompared{48, 48, 48}, kInk{20, 20, 20}, kPaper{255, 255, 255};

/// Blue, white, red, told apart by the colour-blind: Brewer's RdBu.
Colour colour_of(double t) {
  static constexpr Colour kStops[] = {{33, 102, 172}, {103, 169, 207}, {247, 247, 247}, {239, 138, 98}, {178, 24, 43}};
  const double at = (std::clamp(t, -1.0, 1.0) + 1) * 2;
  const auto low = std::min<std::size_t>(static_cast<std::size_t>(at), 3);
  const double share = at - static_cast<double>(low);
  Colour colour;
  for (std::size_t c = 0; c < 3; ++c) colour[c] = kStops[low][c] + share * (kStops[low + 1][c] - kStops[low][c]);
  return colour;
}

/// Rows of dots from the top, three bits each, of the letters that numbers in percent are written with.
std::array<std::uint8_t, kGlyphHeight> glyph_of(char letter) {
  switch (letter) {
    case '0': return {7, 5, 5, 5, 7};
    case '1': return {2, 6, 2, 2, 7};
    case '2': return {7, 1, 7, 4, 7};
    case '5': return {7, 4, 7, 1, 7};
    case '.': return {0, 0, 0, 0, 2};
    case '+': return {0, 2, 7, 2, 0};
    case '-': return {0, 0, 7, 0, 0};
    case '%': return {5, 1, 2, 4, 5};
    default: return {};
  }
}

class Canvas {
 public:
  Canvas(int width, int height)
      : picture_{width, height, std::vector<std::uint8_t>(std::size_t(width) * std::size_t(height) * 3)} {
    fill(0, 0, width, height, kPaper);
  }

  void fill(int x, int y, int width, int height, const Colour& colour) {
    for (int j = std::max(y, 0); j < std::min(y + height, picture_.height); ++j) {
      for (int i = std::max(x, 0); i < std::min(x + width, picture_.width); ++i) {
        for (std::size_t c = 0; c < 3; ++c) {
          picture_.rgb[(std::size_t(j) * std::size_t(picture_.width) + std::size_t(i)) * 3 + c] =
              static_cast<std::uint8_t>(std::lround(colour[c]));
        }
      }
    }
  }

  void write(int x, int y, const std::string& text) {
    for (const char letter : text) {
      const auto rows = glyph_of(letter);
      for (int j = 0; j < kGlyphHeight; ++j) {
        for (int i = 0; i < kGlyphWidth; ++i) {
          if (rows[std::size_t(j)] >> (kGlyphWidth - 1 - i) & 1) fill(x + i * kDot, y + j * kDot, kDot, kDot, kInk);
        }
      }
      x += (kGlyphWidth + 1) * kDot;
    }
  }

  Picture take() { return std::move(picture_); }

 private:
  Picture picture_;
};

int width_of(const std::string& text) { return static_cast<int>(text.size()) * (kGlyphWidth + 1) * kDot - kDot; }

/// The next of 1, 2, 5 x 10^k.
double rounded_up(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  for (const double step : {1.0, 2.0, 5.0}) {
    // What the logarithm rounds is no reason for the next step.
    if (value <= step * power * (1 + 1e-9)) return step * power;
  }
  return 10 * power;
}

double limit_of(const std::vector<TexelDifference>& differences) {
  std::vector<double> sizes;
  sizes.reserve(differences.size());
  for (const TexelDifference& texel : differences) sizes.push_back(std::fabs(texel.relative));
  const auto rank = sizes.begin() + std::ptrdiff_t(kShownShare * static_cast<double>(sizes.size() - 1));
  std::nth_element(sizes.begin(), rank, sizes.end());
  return rounded_up(std::max(*rank, kLeastLimit));
}

std::string percent(double share) {
  char text[40];
  // Only digits of 1, 2, 5 x 10^k, no exponent: the glyphs have no other.
  const int decimals = std::max(0, static_cast<int>(-std::floor(std::log10(share * 100) + 1e-9)));
  std::snprintf(text, sizeof text, "%.*f%%", decimals, share * 100);
  return text;
}

}  // namespace

DifferencePicture draw_difference(const MapPair& pair, std::span<const std::uint8_t> mask) {
  const std::vector<TexelDifference> differences = texel_differences(pair, mask);
  DifferencePicture result;
  result.limit = limit_of(differences);
  const int enlarged = std::max(1, (kLeastWidth + pair.reference.width - 1) / pair.reference.width);
  const int width = pair.reference.width * enlarged, height = pair.reference.height * enlarged;
  Canvas canvas(width, height + kGap + kBarHeight + kGap + kGlyphHeight * kDot + kGap);

  canvas.fill(0, 0, width, height, kNotCompared);
  for (const TexelDifference& texel : differences) {
    canvas.fill(texel.x * enlarged, texel.y * enlarged, enlarged, enlarged, colour_of(texel.relative / result.limit));
  }

  // The scale: a bar, its ends and its middle.
  const int bar_y = height + kGap, text_y = bar_y + kBarHeight + kGap;
  for (int x = 0; x < width; ++x) {
    const double t = width > 1 ? 2.0 * x / (width - 1) - 1 : 0;
    canvas.fill(x, bar_y, 1, kBarHeight, colour_of(t));
  }
  const std::string high = "+" + percent(result.limit);
  canvas.write(kGap, text_y, "-" + percent(result.limit));
  canvas.write((width - width_of("0")) / 2, text_y, "0");
  canvas.write(width - kGap - width_of(high), text_y, high);
  result.picture = canvas.take();
  return result;
}

}  // namespace radbake::image
