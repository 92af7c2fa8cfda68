#include "tile_layout.h"

namespace fv {

TileLayout::TileLayout(const GridFrame& of) : frame(of), group_of(of.tileCount()) {
  for (int d = 0; d < 27; ++d) step_to[d] = frame.tileIndex(directionStep(d));
  const Voxel along = (frame.tiles + Voxel::Constant(3)) / 4;
  groups.resize(along.prod());
  for (int t = 0; t < count(); ++t) {
    const Voxel g = frame.tile(t) / 4;
    group_of[t] = (g.z() * along.y() + g.y()) * along.x() + g.x();
    groups[group_of[t]].push_back(t);
  }
}

std::array<int, 27> TileLayout::neighbours(int t) const {
  std::array<int, 27> out;
  const Voxel at = frame.tile(t);
  const auto inside = [](int c, int count) { return c >= 0 && c < count; };
  for (int d = 0; d < 27; ++d) {
    const Voxel n = at + directionStep(d);
    const bool within =
        inside(n.x(), frame.tiles.x()) && inside(n.y(), frame.tiles.y()) && inside(n.z(), frame.tiles.z());
    out[d] = within ? t + step_to[d] : -1;
  }
  return out;
}

}  // namespace fv
