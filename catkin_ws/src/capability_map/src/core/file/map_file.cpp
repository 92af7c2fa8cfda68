#include "capability_map/map_file.h"

#include <openssl/evp.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>

#include "hdf5_reader.h"
#include "view_direction.h"

namespace capability_map {

namespace {

constexpr size_t kBlock = 512;  // the user block, with the checksum in its first line
constexpr int kSchema = 2;
constexpr double kMostCells = 2e7;  // as store.py

std::string sha256(const char* bytes, size_t count) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned length = 0;
  if (EVP_Digest(bytes, count, digest.data(), &length, EVP_sha256(), nullptr) != 1) {
    throw MapFileError("the SHA-256 of OpenSSL does not work");
  }
  constexpr char kDigits[] = "0123456789abcdef";
  std::string hex;
  for (unsigned i = 0; i < length; ++i) {
    hex += kDigits[digest[i] >> 4];
    hex += kDigits[digest[i] & 15];
  }
  return hex;
}

/// The whole file, once its checksum is right: HDF5 never sees a damaged one. Of another file only the start
/// is read.
std::vector<char> verified(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::vector<char> content(kBlock);
  if (!file || file.read(content.data(), kBlock).bad()) {
    throw MapFileError("cannot read capability map " + path + ": " + std::strerror(errno));
  }
  content.resize(static_cast<size_t>(file.gcount()));
  const std::string magic = "capability_map " + std::to_string(kSchema) + " sha256 ";
  if (content.size() < kBlock || std::string(content.data(), magic.size()) != magic) {
    throw MapFileError(path + " is not a capability map of schema " + std::to_string(kSchema));
  }
  content.insert(content.end(), std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  const std::string told(content.data() + magic.size(), 64);
  if (told != sha256(content.data() + kBlock, content.size() - kBlock)) {
    throw MapFileError(path + " is damaged: its content does not fit its checksum; build it again");
  }
  return content;
}

void require(bool fits, const std::string& what) {
  if (!fits) throw Hdf5Error(what);
}

template <int Columns>
Eigen::Matrix<double, Eigen::Dynamic, Columns, Eigen::RowMajor> matrixOf(const Hdf5Array<double>& array,
                                                                         const std::string& name) {
  require(array.shape[1] == Columns, name + " must have " + std::to_string(Columns) + " columns");
  const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Columns, Eigen::RowMajor>> rows(
      array.values.data(), static_cast<Eigen::Index>(array.shape[0]), Columns);
  require(rows.allFinite(), name + " must be finite");
  return rows;
}

Eigen::Vector3d vectorOf(const Hdf5Reader& file, const std::string& path) {
  const Hdf5Array<double> array = file.array<double>(path, 1);
  require(array.values.size() == 3, path + " must be three numbers");
  return {array.values[0], array.values[1], array.values[2]};
}

SphereGrid readGrid(const Hdf5Reader& file) {
  SphereGrid grid;
  grid.origin = vectorOf(file, "grid/origin");
  grid.radius_m = file.number("radius_m");
  const Eigen::Vector3d size = vectorOf(file, "grid/size");
  const bool sound = grid.origin.allFinite() && grid.radius_m > 0.0 && std::isfinite(grid.radius_m) &&
                     (size.array() >= 1.0).all() && size.prod() <= kMostCells;
  require(sound, "its grid is not finite and positive");
  grid.size = size.cast<int>();
  return grid;
}

SphereBits readBits(const Hdf5Reader& file, const SphereGrid& grid, Eigen::Index directions) {
  const Hdf5Array<int64_t> cells = file.array<int64_t>("spheres/cell", 1);
  Hdf5Array<uint64_t> words = file.array<uint64_t>("spheres/bits", 2);
  SphereBits bits;
  bits.words_per_row = static_cast<int>((directions + 63) / 64);
  const bool fits =
      words.shape[0] == cells.values.size() && words.shape[1] == static_cast<hsize_t>(bits.words_per_row);
  require(fits, "spheres/bits does not fit its spheres and directions");
  bits.row_of_cell.assign(static_cast<size_t>(grid.cellCount()), -1);
  int64_t before = -1;
  for (size_t row = 0; row < cells.values.size(); ++row) {
    const int64_t cell = cells.values[row];
    require(cell > before && cell < grid.cellCount(), "its cells are not ascending numbers of its grid");
    bits.row_of_cell[static_cast<size_t>(cell)] = static_cast<int32_t>(row);
    before = cell;
  }
  bits.words = std::move(words.values);
  return bits;
}

void readWitnesses(const Hdf5Reader& file, MapFile& map) {
  map.joint_limits = matrixOf<2>(file.array<double>("joints/limits", 2), "joints/limits");
  Hdf5Array<uint16_t> witnesses = file.array<uint16_t>("points/witness", 2);
  hsize_t valid = 0;
  const auto rows = static_cast<int32_t>(map.bits.words.size() / static_cast<size_t>(map.bits.words_per_row));
  for (int32_t row = 0; row < rows; ++row) {
    for (int k = 0; k < static_cast<int>(map.view_directions.rows()); ++k)
      valid += map.bits.valid(row, k) ? 1 : 0;
  }
  const bool fits =
      witnesses.shape[0] == valid && witnesses.shape[1] == static_cast<hsize_t>(map.joint_limits.rows());
  require(fits, "points/witness does not fit its valid points and joints");
  map.witnesses = std::move(witnesses.values);
}

std::vector<Shape> readShapes(const Hdf5Reader& file, size_t spheres) {
  const auto type = file.array<int32_t>("shapes/least_error_type", 1);
  const auto axis = matrixOf<3>(file.array<double>("shapes/least_error_axis", 2), "shapes/least_error_axis");
  const auto opening = file.array<double>("shapes/least_error_opening_rad", 1);
  const auto error = file.array<double>("shapes/least_error_error_percent", 1);
  const bool fits = type.values.size() == spheres && static_cast<size_t>(axis.rows()) == spheres &&
                    opening.values.size() == spheres && error.values.size() == spheres;
  require(fits, "its shapes do not fit its spheres");
  std::vector<Shape> shapes(spheres);
  for (size_t i = 0; i < spheres; ++i) {
    require(type.values[i] >= 0 && type.values[i] <= 3, "shapes/least_error_type knows 0 to 3");
    shapes[i] = {static_cast<ShapeType>(type.values[i]), axis.row(static_cast<Eigen::Index>(i)),
                 opening.values[i], error.values[i]};
  }
  return shapes;
}

MapFile read(const Hdf5Reader& file) {
  require(file.text("schema") == "capability_map" && file.number("schema_version") == kSchema,
          "another schema");
  MapFile map;
  map.robot = file.text("robot");
  map.group = file.text("group");
  map.base_frame = file.text("base_frame");
  map.tip_frame = file.text("tip_frame");
  map.urdf_sha256 = file.text("urdf_sha256");
  map.backend = file.text("backend");
  map.threshold = file.number("threshold");
  require(map.threshold > 0.0 && map.threshold <= 1.0, "its threshold is not in (0, 1]");
  map.pivots = {file.number("pivot_m"), vectorOf(file, "reach_center")};
  map.grid = readGrid(file);
  map.view_directions = -matrixOf<3>(file.array<double>("directions/outward", 2), "directions/outward");
  const Eigen::ArrayXd lengths = map.view_directions.rowwise().norm().array();
  require(lengths.size() > 0 && ((lengths - 1.0).abs() < 1e-6).all(),
          "directions/outward has no unit vector");
  map.bits = readBits(file, map.grid, map.view_directions.rows());
  map.shapes = readShapes(file, map.bits.words.size() / static_cast<size_t>(map.bits.words_per_row));
  readWitnesses(file, map);
  return map;
}

}  // namespace

bool MapFile::covered(const Eigen::Vector3d& position, const Eigen::Vector3d& direction) const {
  const Eigen::Vector3d d = viewDirection(position, direction);
  const int64_t cell = grid.cellAt(position + grid.radius_m * d);
  const int32_t row = cell < 0 ? -1 : bits.row_of_cell[static_cast<size_t>(cell)];
  return row >= 0 && shapes[static_cast<size_t>(row)].covers(-d);
}

void MapFile::witness(int64_t point, double* q) const {
  const auto joints = static_cast<size_t>(joint_limits.rows());
  for (size_t k = 0; k < joints; ++k) {
    const auto row = joint_limits.row(static_cast<Eigen::Index>(k));
    q[k] = row[0] + (row[1] - row[0]) * witnesses.at(static_cast<size_t>(point) * joints + k) / 65535.0;
  }
}

MapFile loadMapFile(const std::string& path, const std::string& urdf_sha256) {
  std::vector<char> content = verified(path);
  MapFile map;
  try {
    map = read(Hdf5Reader(std::move(content)));
  } catch (const Hdf5Error& error) {
    throw MapFileError(path + ": " + error.what());
  }
  if (!urdf_sha256.empty() && urdf_sha256 != map.urdf_sha256) {
    throw MapFileError(path + " was made for another URDF: its hash is " + map.urdf_sha256 +
                       ", that of the robot " + urdf_sha256 + "; build the map again");
  }
  return map;
}

}  // namespace capability_map
