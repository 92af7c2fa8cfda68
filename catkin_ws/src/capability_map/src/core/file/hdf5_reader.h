/// A small, checked face of the HDF5 library: scalars, texts and arrays of a file image in memory.
#pragma once

#include <hdf5.h>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace capability_map {

/// What HDF5 could not do, in plain words.
class Hdf5Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

template <typename T>
struct Hdf5Array {
  std::vector<hsize_t> shape;
  std::vector<T> values;  ///< Row-major.
};

class Hdf5Reader {
 public:
  /// @param image Bytes of a whole file; copied. @throws Hdf5Error.
  explicit Hdf5Reader(std::vector<char> image);
  ~Hdf5Reader();
  Hdf5Reader(const Hdf5Reader&) = delete;
  Hdf5Reader& operator=(const Hdf5Reader&) = delete;

  /// Attributes of the root group. @throws Hdf5Error when missing or of another kind.
  double number(const std::string& name) const;
  std::string text(const std::string& name) const;

  /// A dataset of numbers, converted to T. @throws Hdf5Error when missing, of another rank, or larger
  /// than its file can hold: memory is not taken for what a header promises.
  template <typename T>
  Hdf5Array<T> array(const std::string& path, size_t rank) const;

 private:
  void readArray(const std::string& path, size_t rank, hid_t memory_type, std::vector<hsize_t>& shape,
                 std::vector<char>& bytes, size_t item_bytes) const;

  hsize_t most_bytes_;  ///< That a dataset of this file can have.
  hid_t file_{-1};
};

}  // namespace capability_map
