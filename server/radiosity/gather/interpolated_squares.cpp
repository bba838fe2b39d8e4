// Which squares of texels interpolation puts off too far.
#include <algorithm>
#include <utility>

#include "server/radiosity/gather/gather.h"

namespace radbake::radiosity {

template <typename OnSquare>
void LightmapGather::for_each_square_above(double limit, const OnSquare& on_square) const {
  roles_.for_each_plain_square([&](int i, int j) {
    // One square's second differences tell little: those beside it are like it.
    double sum = 0;
    int num = 0;
    for (int b = std::max(j - 1, 0); b <= std::min(j + 1, roles_.nodes_down() - 1); ++b) {
      for (int a = std::max(i - 1, 0); a <= std::min(i + 1, roles_.nodes_across() - 1); ++a) {
        if (!roles_.is_plain(a, b)) continue;
        sum += estimate_.interpolation_square(cell_of(texel_of_node(a, b)));
        ++num;
      }
    }
    if (sum > limit * limit * num) on_square(i, j);
  });
}

LightmapGather::Interpolation LightmapGather::interpolation_above(double limit) const {
  Interpolation out;
  const int spacing = roles_.spacing();
  for_each_square_above(limit, [&](int i, int j) {
    std::uint64_t num = 0;
    for (int dy = 0; dy < spacing; ++dy) {
      for (int dx = 0; dx < spacing; ++dx) num += facts_[texel_of_node(i, j, dx, dy)].counts();
    }
    out.squares += static_cast<double>(num) * estimate_.interpolation_square(cell_of(texel_of_node(i, j)));
    out.num_texels += num;
  });
  return out;
}

void LightmapGather::stop_interpolating_above(double limit) {
  // All are found before any is refused: each is judged by those beside it.
  std::vector<std::pair<int, int>> squares;
  for_each_square_above(limit, [&](int i, int j) { squares.emplace_back(i, j); });
  const int spacing = roles_.spacing();
  for (const auto& [i, j] : squares) {
    roles_.refuse(i, j);
    estimate_.forget_interpolation(cell_of(texel_of_node(i, j)));
    // Texels at its border, too, as others may be interpolated in the square beside it: but not nodes.
    for (int dy = 0; dy <= spacing; ++dy) {
      for (int dx = 0; dx <= spacing; ++dx) {
        if (dx % spacing == 0 && dy % spacing == 0) continue;
        estimate_.forget_gathered(texel_of_node(i, j, dx, dy));
      }
    }
  }
}

}  // namespace radbake::radiosity
