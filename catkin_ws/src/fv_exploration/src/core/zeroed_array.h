#pragma once
#include <sys/mman.h>

#include <cstddef>
#include <new>
#include <utility>

namespace fv {

/// Zeros of which only the pages that are written to take memory.
template <class T>
class ZeroedArray {
 public:
  explicit ZeroedArray(std::size_t size) : bytes_(size * sizeof(T)) {
    void* memory = mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) throw std::bad_alloc();
    data_ = static_cast<T*>(memory);
  }
  ZeroedArray(ZeroedArray&& o) noexcept : bytes_(o.bytes_), data_(std::exchange(o.data_, nullptr)) {}
  ZeroedArray(const ZeroedArray&) = delete;
  ZeroedArray& operator=(const ZeroedArray&) = delete;
  ~ZeroedArray() {
    if (data_) munmap(data_, bytes_);
  }
  T* data() { return data_; }
  const T& operator[](std::size_t i) const { return data_[i]; }

 private:
  std::size_t bytes_;
  T* data_ = nullptr;
};

}  // namespace fv
