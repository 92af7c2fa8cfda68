#pragma once
#include <vector>

namespace fv {

/// All parts one after the other; each part's memory is given back as soon as it has been copied.
template <class T>
std::vector<T> concatenated(std::vector<std::vector<T>> parts) {
  std::size_t count = 0;
  for (const std::vector<T>& part : parts) count += part.size();
  std::vector<T> all;
  all.reserve(count);
  for (std::vector<T>& part : parts) {
    all.insert(all.end(), part.begin(), part.end());
    std::vector<T>().swap(part);
  }
  return all;
}

}  // namespace fv
