#pragma once
#include <sys/mman.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>

namespace fv {

/// Zeros, aligned to a cache line. As calloc gives them: of a large array only the pages that are written
/// take memory, and large pages where the system has them; a small one costs no page faults when its memory
/// has been used before.
template <class T>
class ZeroedArray {
 public:
  explicit ZeroedArray(std::size_t size) : block_(std::calloc(size * sizeof(T) + kLine, 1), &std::free) {
    if (!block_) throw std::bad_alloc();
    const auto address = reinterpret_cast<std::uintptr_t>(block_.get());
    data_ = reinterpret_cast<T*>((address + kLine - 1) / kLine * kLine);
    const std::uintptr_t first = (address + kLarge - 1) / kLarge * kLarge, bytes = size * sizeof(T);
    if (address + bytes >= first + kLarge)
      madvise(reinterpret_cast<void*>(first), address + bytes - first, MADV_HUGEPAGE);  // a wish
  }
  T* data() { return data_; }
  const T& operator[](std::size_t i) const { return data_[i]; }

 private:
  static constexpr std::size_t kLine = 64, kLarge = std::size_t{2} << 20;
  std::unique_ptr<void, void (*)(void*)> block_;
  T* data_ = nullptr;
};

}  // namespace fv
