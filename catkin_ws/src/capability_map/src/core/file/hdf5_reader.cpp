#include "hdf5_reader.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace capability_map {

namespace {

constexpr hsize_t kMostShrunk = 1100;  // a byte in the file may stand for 1032 by deflate, never for more
constexpr hsize_t kMostBytes = hsize_t{1} << 40;

/// Closes a handle of HDF5 when it goes out of scope.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t), const std::string& what) : id_(id), close_(close) {
    if (id_ < 0) throw Hdf5Error("no readable " + what);
  }
  ~Handle() { close_(id_); }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  operator hid_t() const { return id_; }  // NOLINT: a handle is used as the number it is

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

/// HDF5 prints its errors unless told not to; the caller's setting comes back.
class Quiet {
 public:
  Quiet() {
    H5Eget_auto2(H5E_DEFAULT, &print_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  ~Quiet() { H5Eset_auto2(H5E_DEFAULT, print_, data_); }
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;

 private:
  H5E_auto2_t print_{nullptr};
  void* data_{nullptr};
};

template <typename T>
hid_t memoryType();
template <>
hid_t memoryType<double>() {
  return H5T_NATIVE_DOUBLE;
}
template <>
hid_t memoryType<int32_t>() {
  return H5T_NATIVE_INT32;
}
template <>
hid_t memoryType<int64_t>() {
  return H5T_NATIVE_INT64;
}
template <>
hid_t memoryType<uint64_t>() {
  return H5T_NATIVE_UINT64;
}
template <>
hid_t memoryType<uint16_t>() {
  return H5T_NATIVE_UINT16;
}

}  // namespace

Hdf5Reader::Hdf5Reader(std::vector<char> image)
    : most_bytes_(std::min(kMostBytes, kMostShrunk * image.size())) {
  const Quiet quiet;
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, "HDF5 library");
  constexpr size_t kGrowth = 1 << 16;
  H5Pset_fapl_core(access, kGrowth, 0);  // in memory, nothing is written back
  H5Pset_file_image(access, image.data(), image.size());
  file_ = H5Fopen("capability map", H5F_ACC_RDONLY, access);
  if (file_ < 0) throw Hdf5Error("no HDF5 file");
}

Hdf5Reader::~Hdf5Reader() { H5Fclose(file_); }

double Hdf5Reader::number(const std::string& name) const {
  const Quiet quiet;
  const Handle attribute(H5Aopen(file_, name.c_str(), H5P_DEFAULT), H5Aclose, "attribute " + name);
  const Handle space(H5Aget_space(attribute), H5Sclose, "attribute " + name);
  double value = 0.0;
  if (H5Sget_simple_extent_npoints(space) != 1 || H5Aread(attribute, H5T_NATIVE_DOUBLE, &value) < 0) {
    throw Hdf5Error("attribute " + name + " is no number");
  }
  return value;
}

std::string Hdf5Reader::text(const std::string& name) const {
  const Quiet quiet;
  const Handle attribute(H5Aopen(file_, name.c_str(), H5P_DEFAULT), H5Aclose, "attribute " + name);
  const Handle space(H5Aget_space(attribute), H5Sclose, "attribute " + name);
  const Handle type(H5Aget_type(attribute), H5Tclose, "attribute " + name);
  char* words = nullptr;
  const bool is_text = H5Sget_simple_extent_npoints(space) == 1 && H5Tget_class(type) == H5T_STRING &&
                       H5Tis_variable_str(type) > 0 && H5Aread(attribute, type, &words) >= 0;
  if (!is_text || words == nullptr) throw Hdf5Error("attribute " + name + " is no text");
  std::string copy(words);
  H5free_memory(words);
  return copy;
}

void Hdf5Reader::readArray(const std::string& path, size_t rank, hid_t memory_type,
                           std::vector<hsize_t>& shape, std::vector<char>& bytes, size_t item_bytes) const {
  const Quiet quiet;
  const Handle dataset(H5Dopen2(file_, path.c_str(), H5P_DEFAULT), H5Dclose, "dataset " + path);
  const Handle space(H5Dget_space(dataset), H5Sclose, "dataset " + path);
  if (H5Sget_simple_extent_ndims(space) != static_cast<int>(rank)) {
    throw Hdf5Error("dataset " + path + " has not " + std::to_string(rank) + " dimensions");
  }
  shape.assign(rank, 0);
  H5Sget_simple_extent_dims(space, shape.data(), nullptr);
  hsize_t items = 1;
  for (const hsize_t length : shape) {
    if (length > most_bytes_ || items * length > most_bytes_ / item_bytes)
      throw Hdf5Error("dataset " + path + " promises more numbers than a file of this size can hold");
    items *= length;
  }
  bytes.resize(items * item_bytes);
  if (items > 0 && H5Dread(dataset, memory_type, H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes.data()) < 0) {
    throw Hdf5Error("dataset " + path + " does not hold numbers that can be read");
  }
}

template <typename T>
Hdf5Array<T> Hdf5Reader::array(const std::string& path, size_t rank) const {
  Hdf5Array<T> out;
  std::vector<char> bytes;
  readArray(path, rank, memoryType<T>(), out.shape, bytes, sizeof(T));
  out.values.resize(bytes.size() / sizeof(T));
  if (!bytes.empty()) std::memcpy(out.values.data(), bytes.data(), bytes.size());
  return out;
}

template Hdf5Array<double> Hdf5Reader::array(const std::string&, size_t) const;
template Hdf5Array<int32_t> Hdf5Reader::array(const std::string&, size_t) const;
template Hdf5Array<int64_t> Hdf5Reader::array(const std::string&, size_t) const;
template Hdf5Array<uint64_t> Hdf5Reader::array(const std::string&, size_t) const;
template Hdf5Array<uint16_t> Hdf5Reader::array(const std::string&, size_t) const;

}  // namespace capability_map
