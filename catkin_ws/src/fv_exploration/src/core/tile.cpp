#include "tile.h"

#include <algorithm>
#include <cstring>
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

/// Pairs of labels, own and other, as they are found.
class LabelPairs {
 public:
  /// None of so many possible ones.
  void clear(int own, int other) {
    others_ = other;
    missing_ = own * other;
    found_.assign((missing_ + 63) / 64, 0);
  }
  void add(int own, int other) {
    const int i = own * others_ + other;
    const uint64_t bit = uint64_t{1} << (i & 63);
    missing_ -= !(found_[i >> 6] & bit);
    found_[i >> 6] |= bit;
  }
  /// Whether there are no others to find.
  bool full() const { return missing_ == 0; }

  /// Each once, in order.
  void appendTo(std::vector<TileLink>& out, int direction) const {
    for (std::size_t word = 0; word < found_.size(); ++word)
      for (uint64_t rest = found_[word]; rest; rest &= rest - 1) {
        const int i = static_cast<int>(64 * word) + __builtin_ctzll(rest);
        out.push_back({static_cast<uint16_t>(i / others_), static_cast<uint16_t>(i % others_),
                       static_cast<uint8_t>(direction)});
      }
  }

 private:
  int others_ = 0, missing_ = 0;
  std::vector<uint64_t> found_;  // a bit each
};

/// Links of a row of `own` to a row next to it, straight above, below or beside it.
void linkRows(const LabelledMask& own, int row, const LabelledMask& other, int other_row, LabelPairs& found) {
  const unsigned mask = own.mask[row], theirs = other.mask[other_row];
  if (!((mask | mask << 1 | mask >> 1) & theirs)) return;
  const uint16_t* label = &own.runs.labels[own.runs.first[row]];
  const uint16_t* other_labels = &other.runs.labels[other.runs.first[other_row]];
  for (unsigned rest = mask; rest; ++label) {
    const int low = __builtin_ctz(rest);
    const unsigned ends =
        (own.runs.starts[row] | ~mask) & ~((2u << low) - 1);  // bits at which the run is over
    const unsigned run = mask & ((ends & -ends) - 1) & ~((1u << low) - 1);
    rest &= ~run;
    unsigned near = (run | run << 1 | run >> 1) & theirs;
    if (!near) continue;
    const unsigned starts = other.runs.starts[other_row];
    const uint16_t* other_label = other_labels + bitCount(starts & ((2u << __builtin_ctz(near)) - 1)) - 1;
    for (; near; ++other_label) {  // what begins within reach is reached
      found.add(*label, *other_label);
      const unsigned next = starts & ~((2u << __builtin_ctz(near)) - 1);
      near &= next ? ~((next & -next) - 1) : 0;
    }
  }
}

/// The rows of a tile that look at the next one along y or z: all of them, the first or the last.
struct Span {
  int begin, end;
  explicit Span(int step) : begin(step > 0 ? kTile - 1 : 0), end(step < 0 ? 1 : kTile) {}
};

/// Links to the tile in a direction; 13: within the tile.
void linkTowards(const LabelledMask& own, const LabelledMask& other, int direction, LabelPairs& found) {
  found.clear(own.labels, other.labels);
  const Voxel step = directionStep(direction);
  const Span ys(step.y()), zs(step.z());
  const int x = step.x() < 0 ? 0 : kTile - 1, other_x = kTile - 1 - x;
  for (int z = zs.begin; z < zs.end; ++z)
    for (int y = ys.begin; y < ys.end && !found.full(); ++y) {
      const int row = y + kTile * z;
      const unsigned mask = own.mask[row];
      if (!mask || (step.x() && !(mask >> x & 1))) continue;
      // Rows beside, above and below that lie in the other tile.
      for (int dz = z - 1 - kTile * step.z(); dz <= z + 1 - kTile * step.z(); ++dz)
        for (int dy = y - 1 - kTile * step.y(); dy <= y + 1 - kTile * step.y(); ++dy) {
          if (dz < 0 || dz >= kTile || dy < 0 || dy >= kTile) continue;
          const int other_row = dy + kTile * dz;
          if (!step.x())
            linkRows(own, row, other, other_row, found);
          else if (other.mask[other_row] >> other_x & 1)
            found.add(own.runs.at(row, x), other.runs.at(other_row, other_x));
        }
    }
}

/// Call visit(first voxel, length, label) for each stretch of a row of a mask in which runs were found
/// without labels of their own.
template <class Visit>
void forEachRun(const TileMask& mask, const RunLabels& runs, const Voxel& corner, const Visit& visit) {
  auto label = runs.labels.begin();
  for (int row = 0; row < kTile * kTile; ++row)
    for (unsigned rest = mask[row]; rest; ++label) {
      const int low = __builtin_ctz(rest), length = __builtin_ctz(~(rest >> low));
      visit(Voxel(corner + Voxel(low, row % kTile, row / kTile)), length, *label);
      rest &= ~(((1u << length) - 1) << low);
    }
}

/// Seed and merge in those components of a tile that are not one ellipsoid.
/// @param whole per component all of it, @param fits whether that is one ellipsoid.
/// @param[in,out] runs labels: components; then nodes.
VoidGraph clusterParts(const TileMask& voids, const Voxel& corner, const ClusterRule& rule,
                       const BigVector<VoidNode>& whole, const std::vector<uint8_t>& fits, RunLabels& runs) {
  std::vector<Voxel> rest;
  std::vector<int> labels, place, at;  // of the nodes of `rest`, of its voxels; of components
  forEach(voids, [&](int x, int y, int z) {
    if (!fits[runs.at(y + kTile * z, x)]) rest.push_back(corner + Voxel(x, y, z));
  });
  VoidGraph graph = clusterVoids(rest, rule, at);
  const int parts = static_cast<int>(graph.nodes.size());
  std::vector<int> order(parts);  // the nodes of `rest`, then components that fit, ascending by id
  std::iota(order.begin(), order.end(), 0);
  for (std::size_t i = 0; i < whole.size(); ++i)
    if (fits[i]) order.push_back(parts + static_cast<int>(i));
  const auto node = [&](int i) -> const VoidNode& { return i < parts ? graph.nodes[i] : whole[i - parts]; };
  std::sort(order.begin(), order.end(), [&](int a, int b) { return node(a).id < node(b).id; });
  place.resize(parts + whole.size());
  VoidGraph out;
  for (const int i : order) {
    place[i] = static_cast<int>(out.nodes.size());
    out.nodes.push_back(node(i));
  }
  for (const auto& [a, b] : graph.edges) out.edges.push_back(std::minmax(place[a], place[b]));
  out.settled = out.edges.size();
  std::size_t next = 0;
  forEach(voids, [&](int x, int y, int z) {
    const int component = runs.at(y + kTile * z, x);
    labels.push_back(place[fits[component] ? parts + component : at[next++]]);
  });
  runs = runsOf(voids, labels);
  return out;
}

bool sameRow(const LabelledMask& a, const LabelledMask& b, int row) {
  if (a.mask[row] != b.mask[row] || a.runs.starts[row] != b.runs.starts[row]) return false;
  const int runs = bitCount(a.runs.starts[row]);
  const uint16_t *p = a.runs.labels.data() + a.runs.first[row], *q = b.runs.labels.data() + b.runs.first[row];
  for (int i = 0; i < runs; ++i)  // few: not worth a call
    if (p[i] != q[i]) return false;
  return true;
}

bool sameVoxel(const LabelledMask& a, const LabelledMask& b, int row, int x) {
  const int in_a = a.mask[row] >> x & 1, in_b = b.mask[row] >> x & 1;
  return in_a == in_b && (!in_a || a.runs.at(row, x) == b.runs.at(row, x));
}

}  // namespace

uint32_t touchedDirections(int x, int y, int z) {
  static const std::array<uint32_t, 27> kTouched = [] {  // by the side of the tile that the voxel lies at
    std::array<uint32_t, 27> out{};
    for (int side = 0; side < 27; ++side)
      for (int m = 0; m < 8; ++m) {
        const Voxel step = directionStep(side);
        out[side] |= 1u << tileDirection(m & 1 ? step.x() : 0, m & 2 ? step.y() : 0, m & 4 ? step.z() : 0);
      }
    return out;
  }();
  const auto side = [](int c) { return c == 0 ? -1 : c == kTile - 1 ? 1 : 0; };
  return kTouched[tileDirection(side(x), side(y), side(z))];
}

std::vector<Voxel> maskVoxels(const TileMask& mask, const Voxel& corner) {
  std::vector<Voxel> out;
  forEach(mask, [&](int x, int y, int z) { out.push_back(corner + Voxel(x, y, z)); });
  return out;
}

int maskCount(const TileMask& mask) {
  // Bits of 16 rows at a time, added up in bytes: not every machine counts bits in one instruction.
  uint64_t count = 0;
  for (int z = 0; z < kTile; ++z) {
    uint64_t bytes = 0;
    for (int part = 0; part < kTile / 4; ++part) {
      uint64_t w;
      std::memcpy(&w, &mask[kTile * z + 4 * part], 8);
      w -= w >> 1 & 0x5555555555555555u;
      w = (w & 0x3333333333333333u) + (w >> 2 & 0x3333333333333333u);
      bytes += (w + (w >> 4)) & 0x0f0f0f0f0f0f0f0fu;
    }
    count += ((bytes & 0x00ff00ff00ff00ffu) + (bytes >> 8 & 0x00ff00ff00ff00ffu)) * 0x0001000100010001u >> 48;
  }
  return static_cast<int>(count);
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
      const unsigned wide = mask[row] | mask[row] << 1 | mask[row] >> 1;
      if (y > 0 && wide & mask[row - 1]) runs.unite(row, row - 1);
      if (z == 0) continue;
      for (int other = std::max(0, y - 1); other <= std::min(kTile - 1, y + 1); ++other)
        if (wide & mask[other + kTile * (z - 1)]) runs.unite(row, other + kTile * (z - 1));
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
  BigVector<VoidNode> whole(components, VoidNode{{}, 0});
  forEachRun(voids, runs, corner, [&](const Voxel& first, int length, int component) {
    if (whole[component].moments.n == 0) whole[component].id = voxelId(first);
    whole[component].moments.addRow(first, length);
  });
  std::vector<uint8_t> fits(components);
  for (int i = 0; i < components; ++i) fits[i] = rule.accepts(whole[i].moments);
  if (std::all_of(fits.begin(), fits.end(), [](uint8_t fit) { return fit; }))
    return {std::move(whole), {}, 0};
  return clusterParts(voids, corner, rule, whole, fits, runs);
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

void relink(const LabelledMask& own, const std::array<const LabelledMask*, 27>& around, uint32_t which,
            std::vector<TileLink>& links) {
  if (!which) return;
  thread_local LabelPairs found;
  thread_local std::vector<TileLink> out;
  out.clear();
  auto old = links.begin();
  for (int d = 0; d < 27; ++d) {
    const auto begin = old;
    while (old != links.end() && old->direction == d) ++old;
    if (!(which >> d & 1)) {
      out.insert(out.end(), begin, old);
    } else if (own.count && around[d]) {
      linkTowards(own, *around[d], d, found);
      found.appendTo(out, d);
    }
  }
  links = out;
}

}  // namespace fv
