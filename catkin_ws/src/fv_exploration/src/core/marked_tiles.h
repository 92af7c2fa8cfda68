#pragma once
#include <cstdint>
#include <vector>

namespace fv {

/// Indices of the tiles whose mark is set, ascending.
inline std::vector<int> marked(const std::vector<uint8_t>& tiles) {
  std::vector<int> out;
  for (int i = 0; i < static_cast<int>(tiles.size()); ++i)
    if (tiles[i]) out.push_back(i);
  return out;
}

}  // namespace fv
