#pragma once

#include <cstdint>
#include <span>
#include <stop_token>
#include <utility>
#include <vector>

#include "server/radiosity/patches/patches.h"

namespace radbake::radiosity {

/// Cuts grid cells along the lines where another surface touches or crosses them.
///
/// A wall that stands on a floor, or goes through it, meets it in a segment; each cell that the segment runs through is
/// cut by its whole line. Surfaces that lie in the cell's own plane cut nothing.
class ContactCutter {
 public:
  /// Works on patches whose pieces are not sorted yet.
  ContactCutter(const Surfaces& surfaces, const Visibility& visibility, std::span<const std::uint32_t> group_of,
                Patches& patches)
      : surfaces_(surfaces), visibility_(visibility), group_of_(group_of), patches_(patches) {}

  /// Turns cells into parts: cell_of_piece and is_double_sided are by grid cell before, by front patch after.
  /// At most max_new patches are added; cells beyond that stay whole and are counted. Stopped, cells stay whole.
  void cut_cells(std::vector<std::uint32_t>& cell_of_piece, std::vector<std::uint8_t>& is_double_sided,
                 std::size_t max_new, const std::stop_token& stop);

 private:
  using Cut = Patches::Cut;
  using Piece = Patches::Piece;

  /// What is found for one cell, by itself.
  struct CellCuts {
    std::vector<Cut> cuts;
    std::vector<std::pair<std::uint32_t, Piece>> parts;  ///< with the sides of the cuts that they lie on
    std::vector<std::uint32_t> sides;                    ///< those that parts have, ascending
  };
  using Near = std::span<const std::uint32_t>;  ///< triangles around a cell

  CellCuts cut_cell(std::span<const Piece> pieces, bool is_whole, std::vector<std::uint32_t>& near) const;
  void find_cuts(std::span<const Piece> pieces, std::vector<std::uint32_t>& near, std::vector<Cut>& cuts) const;
  void add_contact(const Piece& piece, std::uint32_t other, Near near, std::vector<Cut>& cuts) const;
  /// Whether the triangle's group has another triangle across this side.
  bool goes_on_beyond(std::uint32_t triangle, int side, Near near) const;
  void split(const Piece& piece, std::span<const Cut> cuts, std::vector<std::pair<std::uint32_t, Piece>>& parts) const;

  const Surfaces& surfaces_;
  const Visibility& visibility_;
  std::span<const std::uint32_t> group_of_;
  Patches& patches_;
};

}  // namespace radbake::radiosity
