/// Capability maps with a right checksum and any content: sizes that lie, other types, missing parts, any
/// numbers. The HDF5 library writes them, so that what is tried is our reader, not HDF5's. No bytes at all
/// give a right map.
#include "capability_map/map_file.h"

#include <fuzzer/FuzzedDataProvider.h>
#include <hdf5.h>
#include <openssl/sha.h>
#include <unistd.h>

#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace {

using Input = FuzzedDataProvider;
constexpr std::size_t kBlock = 512;

class Writer {
 public:
  explicit Writer(Input& in) : in_(in) {
    const hid_t access = H5Pcreate(H5P_FILE_ACCESS), create = H5Pcreate(H5P_FILE_CREATE);
    H5Pset_fapl_core(access, 1 << 14, 0);
    H5Pset_userblock(create, kBlock);
    file_ = H5Fcreate("fuzz", H5F_ACC_TRUNC, create, access);
    H5Pclose(access);
    H5Pclose(create);
  }

  void text(const char* name, const std::string& right) {
    const uint8_t fault = in_.ConsumeIntegral<uint8_t>();
    if (fault == 1) return;
    if (fault == 2) return number(name, 1.0);
    const std::string words = fault == 3 ? in_.ConsumeRandomLengthString(80) : right;
    const char* pointer = words.c_str();
    const hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR);
    H5Tset_size(type, fault == 4 ? std::max<std::size_t>(words.size(), 1) : H5T_VARIABLE);
    const hid_t attribute = H5Acreate2(file_, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    H5Awrite(attribute, type, fault == 4 ? static_cast<const void*>(pointer) : &pointer);
    H5Aclose(attribute);
    H5Sclose(space);
    H5Tclose(type);
  }

  void number(const char* name, double right) {
    const uint8_t fault = in_.ConsumeIntegral<uint8_t>();
    if (fault == 1) return;
    hsize_t count = fault == 2 ? in_.ConsumeIntegralInRange<hsize_t>(0, 3) : 1;
    std::vector<double> values(4, fault == 3 ? anyNumber() : right);
    const hid_t space = H5Screate_simple(1, &count, nullptr);
    const hid_t attribute = H5Acreate2(file_, name, H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT);
    H5Awrite(attribute, H5T_NATIVE_DOUBLE, values.data());
    H5Aclose(attribute);
    H5Sclose(space);
  }

  /// A dataset of doubles, converted to what the file holds; sizes of more than was written are fill values.
  void array(const char* path, hid_t type, std::vector<hsize_t> shape, std::vector<double> values) {
    const uint8_t fault = in_.ConsumeIntegral<uint8_t>();
    if (fault == 1) return;
    if (fault == 2) type = in_.ConsumeBool() ? H5T_NATIVE_FLOAT : H5T_STD_I16BE;
    if (fault == 3) shape.push_back(1);
    if (fault == 4 && !values.empty())
      values[in_.ConsumeIntegralInRange<std::size_t>(0, values.size() - 1)] = anyNumber();
    const bool lies = fault >= 5 && fault < 8;
    if (lies) shape[in_.ConsumeIntegralInRange<std::size_t>(0, shape.size() - 1)] = anySize();
    const hid_t space = H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr);
    const hid_t layout = H5Pcreate(H5P_DATASET_CREATE), links = H5Pcreate(H5P_LINK_CREATE);
    H5Pset_create_intermediate_group(links, 1);
    if (lies)
      H5Pset_chunk(layout, static_cast<int>(shape.size()), std::vector<hsize_t>(shape.size(), 4).data());
    const hid_t dataset = H5Dcreate2(file_, path, type, space, links, layout, H5P_DEFAULT);
    if (!lies && !values.empty())
      H5Dwrite(dataset, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
    H5Dclose(dataset);
    H5Pclose(layout);
    H5Pclose(links);
    H5Sclose(space);
  }

  std::vector<char> finish() {
    H5Fflush(file_, H5F_SCOPE_LOCAL);
    std::vector<char> image(static_cast<std::size_t>(H5Fget_file_image(file_, nullptr, 0)));
    H5Fget_file_image(file_, image.data(), image.size());
    H5Fclose(file_);
    return image;
  }

 private:
  double anyNumber() {
    const auto bits = in_.ConsumeIntegral<uint64_t>();
    double value;
    std::memcpy(&value, &bits, sizeof(value));
    return value;
  }
  hsize_t anySize() {
    return in_.ConsumeBool() ? in_.ConsumeIntegralInRange<hsize_t>(0, 6)
                             : in_.ConsumeIntegralInRange<hsize_t>(0, hsize_t{1} << 60);
  }

  Input& in_;
  hid_t file_;
};

/// A map of two cells, three directions and one joint, of whose points one is valid; unless the input has it
/// otherwise.
std::vector<char> image(Input& in) {
  Writer file(in);
  file.text("schema", "capability_map");
  file.number("schema_version", 2);
  for (const char* name : {"robot", "group", "base_frame", "tip_frame", "backend"}) file.text(name, "x");
  file.text("urdf_sha256", std::string(64, '0'));
  file.number("threshold", 0.4);
  file.number("pivot_m", 0.1);
  file.number("radius_m", 0.05);
  file.array("reach_center", H5T_NATIVE_DOUBLE, {3}, {0, 0, 0});
  file.array("grid/origin", H5T_NATIVE_DOUBLE, {3}, {0, 0, 0});
  file.array("grid/size", H5T_NATIVE_INT32, {3}, {2, 1, 1});
  file.array("directions/outward", H5T_NATIVE_DOUBLE, {3, 3}, {1, 0, 0, 0, 1, 0, 0, 0, 1});
  file.array("spheres/cell", H5T_NATIVE_INT64, {1}, {1});
  file.array("spheres/bits", H5T_NATIVE_UINT64, {1, 1}, {2});
  file.array("shapes/least_error_type", H5T_NATIVE_INT32, {1}, {1});
  file.array("shapes/least_error_axis", H5T_NATIVE_DOUBLE, {1, 3}, {0, 0, 1});
  file.array("shapes/least_error_opening_rad", H5T_NATIVE_DOUBLE, {1}, {0.5});
  file.array("shapes/least_error_error_percent", H5T_NATIVE_DOUBLE, {1}, {10});
  file.array("joints/limits", H5T_NATIVE_DOUBLE, {1, 2}, {-1, 1});
  file.array("points/witness", H5T_NATIVE_UINT16, {1, 1}, {100});
  return file.finish();
}

/// A file of it, behind the block with its checksum.
std::string written(const std::vector<char>& image) {
  unsigned char digest[SHA256_DIGEST_LENGTH];
  SHA256(reinterpret_cast<const unsigned char*>(image.data()), image.size(), digest);
  std::string line = "capability_map 2 sha256 ";
  char hex[3];
  for (const unsigned char byte : digest) {
    std::snprintf(hex, sizeof(hex), "%02x", byte);
    line += hex;
  }
  line.resize(kBlock, '\0');
  const std::string path =
      (std::filesystem::temp_directory_path() / ("fv-fuzz-" + std::to_string(getpid()))).string() + ".h5";
  std::ofstream(path, std::ios::binary) << line << std::string(image.begin(), image.end());
  return path;
}

void ask(const capability_map::MapFile& map) {
  const auto query = map.query();
  const auto seeds = map.seeds();
  std::vector<double> q(static_cast<std::size_t>(map.joint_limits.rows()));
  for (const double x : {0.05, 0.15, 10.0}) {
    const Eigen::Vector3d p(x, 0.05, 0.05), d(0, 1, 0);
    query.interpolated(p, d);
    query.nearest(p, d);
    map.covered(p, d);
    const auto seed = seeds.nearest(p, d);
    if (seed.point >= 0) map.witness(seed.point, q.data());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  Input in(data, size);
  const std::string path = written(image(in));
  try {
    ask(capability_map::loadMapFile(path));
  } catch (const capability_map::MapFileError&) {
    if (size == 0) __builtin_trap();  // the right map must be read
  }
  std::remove(path.c_str());
  return 0;
}
