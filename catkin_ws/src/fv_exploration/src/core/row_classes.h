#pragma once
#include <algorithm>
#include <cstdint>
#include <cstring>

#include "fv_exploration/grid.h"

namespace fv {

/// The classes of the 16 voxels of a tile's row as bits; read off bytes that hold a Class in their low two
/// bits.
struct RowClasses {
  unsigned unknown = 0, free = 0, occupied = 0;

  explicit RowClasses(const uint8_t* cells) {
    for (int half = 0; half < 2; ++half) {
      uint64_t w;
      std::memcpy(&w, cells + 8 * half, 8);
      unknown |= gather(~(w | w >> 1) & kOnes) << (8 * half);
      free |= gather(w & ~(w >> 1) & kOnes) << (8 * half);
      occupied |= gather(w >> 1 & ~w & kOnes) << (8 * half);
    }
    std::memcpy(bytes_, cells, sizeof(bytes_));
  }

  /// Write the classes, and leave the other bits of the bytes.
  void write(uint8_t* cells) const {
    for (int half = 0; half < 2; ++half) {
      uint64_t target, source;
      std::memcpy(&target, cells + 8 * half, 8);
      std::memcpy(&source, bytes_ + 8 * half, 8);
      target = (target & ~(3 * kOnes)) | (source & (3 * kOnes));
      std::memcpy(cells + 8 * half, &target, 8);
    }
  }

 private:
  static_assert(kUnknown == 0 && kFree == 1 && kOccupied == 2 && kOutside == 3, "the two bits of a class");
  static constexpr uint64_t kOnes = 0x0101010101010101u;
  /// Eight bytes of 0 or 1 as bits, the first byte lowest.
  static unsigned gather(uint64_t bytes) { return static_cast<unsigned>(bytes * 0x0102040810204080u >> 56); }

  uint8_t bytes_[kTile];
};

/// Bits of a tile's row from x = start that lie within [low, high]; low > high: none.
inline uint16_t intervalRow(int start, int low, int high) {
  if (low > high) return 0;  // first: of an empty row these may be the extremes of int
  const int from = std::max(low - start, 0), to = std::min(high - start, kTile - 1);
  if (from > to) return 0;
  return static_cast<uint16_t>(((2u << to) - 1) & ~((1u << from) - 1));
}

}  // namespace fv
