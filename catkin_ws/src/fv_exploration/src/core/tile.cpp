#include "fv_exploration/tile.h"

#include <algorithm>

namespace fv {

namespace {

int cellOf(int x, int y, int z) { return x + kTile * (y + kTile * z); }

/// Call visit(x, y, z) for each voxel of a mask, ascending.
template <class Visit>
void forEach(const TileMask& mask, const Visit& visit) {
  for (int row = 0; row < kTile * kTile; ++row)
    for (unsigned bits = mask[row]; bits; bits &= bits - 1)
      visit(__builtin_ctz(bits), row % kTile, row / kTile);
}

/// Which tile a coordinate that may be one beyond its tile lies in: -1, 0 or 1.
int beyond(int c) { return c < 0 ? -1 : c >= kTile ? 1 : 0; }

void flood(const TileMask& mask, TileLabels& labels, std::vector<int>& stack, uint16_t label) {
  while (!stack.empty()) {
    const int cell = stack.back();
    stack.pop_back();
    const int x = cell % kTile, y = cell / kTile % kTile, z = cell / (kTile * kTile);
    for (int nz = std::max(0, z - 1); nz <= std::min(kTile - 1, z + 1); ++nz)
      for (int ny = std::max(0, y - 1); ny <= std::min(kTile - 1, y + 1); ++ny) {
        const unsigned near = mask[ny + kTile * nz] & (x ? 7u << (x - 1) : 3u);
        for (unsigned bits = near; bits; bits &= bits - 1) {
          const int next = cellOf(__builtin_ctz(bits), ny, nz);
          if (labels[next]) continue;
          labels[next] = label;
          stack.push_back(next);
        }
      }
  }
}

uint64_t pack(const TileLink& l) {
  return uint64_t{l.direction} << 32 | uint64_t{l.own} << 16 | uint64_t{l.other};
}

}  // namespace

std::vector<Voxel> maskVoxels(const TileMask& mask, const Voxel& corner) {
  std::vector<Voxel> out;
  forEach(mask, [&](int x, int y, int z) { out.push_back(corner + Voxel(x, y, z)); });
  return out;
}

int maskCount(const TileMask& mask) {
  int count = 0;
  for (const uint16_t row : mask) count += __builtin_popcount(row);
  return count;
}

bool maskEmpty(const TileMask& mask) {
  return std::all_of(mask.begin(), mask.end(), [](uint16_t row) { return row == 0; });
}

int labelComponents(const TileMask& mask, TileLabels& labels) {
  labels.clear();
  if (maskEmpty(mask)) return 0;
  labels.assign(kTileVoxels, 0);
  std::vector<int> stack;
  int count = 0;
  forEach(mask, [&](int x, int y, int z) {
    const int cell = cellOf(x, y, z);
    if (labels[cell]) return;
    labels[cell] = static_cast<uint16_t>(++count);
    stack.push_back(cell);
    flood(mask, labels, stack, labels[cell]);
  });
  return count;
}

VoidGraph clusterTile(const TileMask& voids, const Voxel& corner, const ClusterRule& rule,
                      TileLabels& labels) {
  const int components = labelComponents(voids, labels);
  if (components == 0) return {};
  const std::vector<Voxel> voxels = maskVoxels(voids, corner);
  if (components == 1) {
    VoidNode whole{{}, voxelId(voxels[0])};
    for (const Voxel& v : voxels) whole.moments.add(v);
    if (ellipsoidFit(whole.moments, rule.model) >= rule.min_fit) return {{whole}, {}};
  }
  std::vector<int> nodes;
  VoidGraph graph = clusterVoids(voxels, rule, nodes);
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    const Voxel d = voxels[i] - corner;
    labels[cellOf(d.x(), d.y(), d.z())] = static_cast<uint16_t>(nodes[i] + 1);
  }
  return graph;
}

std::vector<TileLink> linksAround(const TileMask& mask, const TileLabels& own,
                                  const std::array<const TileLabels*, 27>& around, int first) {
  std::vector<TileLink> links;
  const bool inner = first <= 13;  // labels of the tile itself count as around it
  TileLink last{0, 0, 255};
  forEach(mask, [&](int x, int y, int z) {
    const bool border = x == 0 || x == kTile - 1 || y == 0 || y == kTile - 1 || z == 0 || z == kTile - 1;
    if (!border && !inner) return;
    for (int nz = z - 1; nz <= z + 1; ++nz)
      for (int ny = y - 1; ny <= y + 1; ++ny)
        for (int nx = x - 1; nx <= x + 1; ++nx) {
          const int direction = border ? tileDirection(beyond(nx), beyond(ny), beyond(nz)) : 13;
          if (direction < first || !around[direction]) continue;
          const int cell = cellOf(nx & (kTile - 1), ny & (kTile - 1), nz & (kTile - 1));
          const uint16_t other = (*around[direction])[cell];
          if (!other) continue;
          const TileLink link{static_cast<uint16_t>(own[cellOf(x, y, z)] - 1),
                              static_cast<uint16_t>(other - 1), static_cast<uint8_t>(direction)};
          if (pack(link) == pack(last)) continue;  // most repetitions, cheaply
          links.push_back(last = link);
        }
  });
  std::sort(links.begin(), links.end(), [](const auto& a, const auto& b) { return pack(a) < pack(b); });
  links.erase(std::unique(links.begin(), links.end(),
                          [](const auto& a, const auto& b) { return pack(a) == pack(b); }),
              links.end());
  return links;
}

}  // namespace fv
