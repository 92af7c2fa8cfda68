#include "fv_exploration/tile.h"

#include <algorithm>
#include <numeric>

namespace fv {

namespace {

/// Call visit(x, y, z) for each voxel of a mask, ascending.
template <class Visit>
void forEach(const TileMask& mask, const Visit& visit) {
  for (int row = 0; row < kTile * kTile; ++row)
    for (unsigned bits = mask[row]; bits; bits &= bits - 1)
      visit(__builtin_ctz(bits), row % kTile, row / kTile);
}

/// Which tile a coordinate that may be one beyond its tile lies in: -1, 0 or 1.
int beyond(int c) { return c < 0 ? -1 : c >= kTile ? 1 : 0; }

/// Runs as intervals along x and a union-find over them.
class Runs {
 public:
  explicit Runs(const TileMask& mask) {
    for (int row = 0; row < kTile * kTile; ++row) {
      first_[row] = count_;
      for (unsigned rest = mask[row]; rest;) {
        const int low = __builtin_ctz(rest), length = __builtin_ctz(~(rest >> low));
        low_[count_] = static_cast<uint8_t>(low);
        high_[count_] = static_cast<uint8_t>(low + length - 1);
        parent_[count_] = static_cast<uint16_t>(count_);
        ++count_;
        rest &= ~(((1u << length) - 1) << low);
      }
    }
    first_[kTile * kTile] = count_;
  }

  int count() const { return count_; }
  int first(int row) const { return first_[row]; }
  int find(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  /// Unite the runs of two neighbouring rows that touch.
  void unite(int row, int other) {
    int i = first_[row], j = first_[other];
    while (i < first_[row + 1] && j < first_[other + 1]) {
      if (low_[i] <= high_[j] + 1 && low_[j] <= high_[i] + 1) {
        const int a = find(i), b = find(j);
        parent_[std::max(a, b)] = static_cast<uint16_t>(std::min(a, b));
      }
      high_[i] < high_[j] ? ++i : ++j;
    }
  }

 private:
  static constexpr int kMost = kTile * kTile * kTile / 2;
  int count_ = 0;
  int first_[kTile * kTile + 1];
  uint8_t low_[kMost], high_[kMost];
  uint16_t parent_[kMost];
};

uint64_t pack(const TileLink& l) {
  return uint64_t{l.direction} << 32 | uint64_t{l.own} << 16 | uint64_t{l.other};
}

/// Links as they are found; most repetitions are dropped at once.
class LinkSet {
 public:
  LinkSet() { recent_.fill(~uint64_t{0}); }

  void add(int own, int other, int direction) {
    const uint64_t key = uint64_t(direction) << 32 | uint64_t(own) << 16 | uint64_t(other);
    uint64_t& recent = recent_[(own * 31 + other * 7 + direction) & (kRecent - 1)];
    if (recent == key) return;
    recent = key;
    links_.push_back(
        {static_cast<uint16_t>(own), static_cast<uint16_t>(other), static_cast<uint8_t>(direction)});
  }

  std::vector<TileLink> take() {
    std::sort(links_.begin(), links_.end(), [](const auto& a, const auto& b) { return pack(a) < pack(b); });
    links_.erase(std::unique(links_.begin(), links_.end(),
                             [](const auto& a, const auto& b) { return pack(a) == pack(b); }),
                 links_.end());
    return {links_.begin(), links_.end()};
  }

 private:
  static constexpr int kRecent = 512;
  std::array<uint64_t, kRecent> recent_;
  std::vector<TileLink> links_;
};

/// Links of a row of `own` to a row next to it, straight above, below or beside it.
void linkRows(const LabelledMask& own, int row, const LabelledMask& other, int other_row, int direction,
              LinkSet& links) {
  const unsigned mask = own.mask[row], theirs = other.mask[other_row];
  if (!((mask | mask << 1 | mask >> 1) & theirs)) return;
  for (unsigned rest = mask; rest;) {
    const int low = __builtin_ctz(rest);
    const unsigned ends =
        (own.runs.starts[row] | ~mask) & ~((2u << low) - 1);  // bits at which the run is over
    const unsigned run = mask & ((ends & -ends) - 1) & ~((1u << low) - 1);
    rest &= ~run;
    const int label = own.runs.at(row, low);
    for (unsigned near = (run | run << 1 | run >> 1) & theirs; near;) {
      const int x = __builtin_ctz(near);
      links.add(label, other.runs.at(other_row, x), direction);
      const unsigned next = other.runs.starts[other_row] & ~((2u << x) - 1);
      near &= next ? ~((next & -next) - 1) : 0;
    }
  }
}

/// Count and sums of the voxels of a mask.
Moments maskMoments(const TileMask& mask, const Voxel& corner) {
  Moments moments;
  forEach(mask, [&](int x, int y, int z) { moments.add(corner + Voxel(x, y, z)); });
  return moments;
}

Voxel firstVoxel(const TileMask& mask, const Voxel& corner) {
  int row = 0;
  while (!mask[row]) ++row;
  return corner + Voxel(__builtin_ctz(mask[row]), row % kTile, row / kTile);
}

bool sameRow(const LabelledMask& a, const LabelledMask& b, int row) {
  if (a.mask[row] != b.mask[row] || a.runs.starts[row] != b.runs.starts[row]) return false;
  const int runs = __builtin_popcount(a.runs.starts[row]);
  const uint16_t *p = a.runs.labels.data() + a.runs.first[row], *q = b.runs.labels.data() + b.runs.first[row];
  return std::equal(p, p + runs, q);
}

bool sameVoxel(const LabelledMask& a, const LabelledMask& b, int row, int x) {
  const int in_a = a.mask[row] >> x & 1, in_b = b.mask[row] >> x & 1;
  return in_a == in_b && (!in_a || a.runs.at(row, x) == b.runs.at(row, x));
}

}  // namespace

uint32_t touchedDirections(int x, int y, int z) {
  const auto side = [](int c) { return c == 0 ? -1 : c == kTile - 1 ? 1 : 0; };
  const int sx = side(x), sy = side(y), sz = side(z);
  uint32_t touched = 0;
  for (int m = 0; m < 8; ++m) touched |= 1u << tileDirection(m & 1 ? sx : 0, m & 2 ? sy : 0, m & 4 ? sz : 0);
  return touched;
}

std::vector<Voxel> maskVoxels(const TileMask& mask, const Voxel& corner) {
  std::vector<Voxel> out;
  forEach(mask, [&](int x, int y, int z) { out.push_back(corner + Voxel(x, y, z)); });
  return out;
}

int maskCount(const TileMask& mask) {
  return std::accumulate(mask.begin(), mask.end(), 0,
                         [](int count, uint16_t row) { return count + __builtin_popcount(row); });
}

bool maskEmpty(const TileMask& mask) {
  return std::all_of(mask.begin(), mask.end(), [](uint16_t row) { return row == 0; });
}

int labelComponents(const TileMask& mask, RunLabels& out) {
  Runs runs(mask);
  for (int z = 0; z < kTile; ++z)
    for (int y = 0; y < kTile; ++y) {
      const int row = y + kTile * z;
      if (!mask[row]) continue;
      if (y > 0) runs.unite(row, row - 1);
      if (z == 0) continue;
      for (int other = std::max(0, y - 1); other <= std::min(kTile - 1, y + 1); ++other)
        runs.unite(row, other + kTile * (z - 1));
    }
  for (int row = 0; row < kTile * kTile; ++row) {
    out.starts[row] = static_cast<uint16_t>(mask[row] & ~(mask[row] << 1));
    out.first[row] = static_cast<uint16_t>(runs.first(row));
  }
  out.labels.assign(runs.count(), 0);
  int count = 0;
  for (int i = 0; i < runs.count(); ++i) {  // the root of a component is its first run
    const int root = runs.find(i);
    out.labels[i] = root == i ? static_cast<uint16_t>(count++) : out.labels[root];
  }
  return count;
}

RunLabels runsOf(const TileMask& mask, const std::vector<int>& labels) {
  RunLabels out;
  std::size_t at = 0;
  for (int row = 0; row < kTile * kTile; ++row) {
    out.first[row] = static_cast<uint16_t>(out.labels.size());
    int last_x = -2, last_label = -1;
    for (unsigned bits = mask[row]; bits; bits &= bits - 1) {
      const int x = __builtin_ctz(bits), label = labels[at++];
      if (x != last_x + 1 || label != last_label) {
        out.starts[row] = static_cast<uint16_t>(out.starts[row] | 1u << x);
        out.labels.push_back(static_cast<uint16_t>(label));
      }
      last_x = x;
      last_label = label;
    }
  }
  return out;
}

VoidGraph clusterTile(const TileMask& voids, const Voxel& corner, const ClusterRule& rule, RunLabels& runs) {
  const int components = labelComponents(voids, runs);
  if (components == 0) return {};
  if (components == 1) {
    const VoidNode whole{maskMoments(voids, corner), voxelId(firstVoxel(voids, corner))};
    if (ellipsoidFit(whole.moments, rule.model) >= rule.min_fit) return {{whole}, {}, 0};
  }
  std::vector<int> nodes;
  VoidGraph graph = clusterVoids(maskVoxels(voids, corner), rule, nodes);
  runs = runsOf(voids, nodes);
  return graph;
}

uint32_t changedDirections(const LabelledMask& before, const LabelledMask& after) {
  uint32_t touched = 0;
  for (int row = 0; row < kTile * kTile; ++row) {
    if (sameRow(before, after, row)) continue;
    const int y = row % kTile, z = row / kTile;
    touched |= touchedDirections(1, y, z);
    for (const int x : {0, kTile - 1})
      if (!sameVoxel(before, after, row, x)) touched |= touchedDirections(x, y, z);
  }
  return touched;
}

std::vector<TileLink> linksAround(const LabelledMask& own, const std::array<const LabelledMask*, 27>& around,
                                  int first) {
  LinkSet links;
  for (int row = 0; row < kTile * kTile; ++row) {
    const unsigned mask = own.mask[row];
    if (!mask) continue;
    for (int z = row / kTile - 1; z <= row / kTile + 1; ++z)
      for (int y = row % kTile - 1; y <= row % kTile + 1; ++y) {
        const int straight = tileDirection(0, beyond(y), beyond(z));
        if (straight + 1 < first) continue;
        const int other_row = (y & (kTile - 1)) + kTile * (z & (kTile - 1));
        if (straight >= first && around[straight])
          linkRows(own, row, *around[straight], other_row, straight, links);
        for (const int side : {-1, 1}) {  // across the ends of the row
          const int x = side < 0 ? 0 : kTile - 1;
          const LabelledMask* other = straight + side >= first ? around[straight + side] : nullptr;
          if (other && mask >> x & 1 && other->mask[other_row] >> (kTile - 1 - x) & 1)
            links.add(own.runs.at(row, x), other->runs.at(other_row, kTile - 1 - x), straight + side);
        }
      }
  }
  return links.take();
}

}  // namespace fv
