#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>

namespace fv {

/// A voxel by its integer coordinates: its centre is (voxel + 0.5) * resolution [m], map frame. OctoMap's key
/// - 32768.
using Voxel = Eigen::Vector3i;
/// (N, 3) points [m].
using Points = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
using PointsF = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;
/// (N, 3) voxels.
using Voxels = Eigen::Matrix<int32_t, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// Half the number of OctoMap's keys along an axis.
constexpr int kKeyOffset = 32768;
/// What a sensor can measure at all [m]. Nearer and farther points come from wrong byte orders, from drivers
/// that write 0 0 0 for no return, or from damaged files.
constexpr double kNearestReturn = 1e-6, kFarthestReturn = 1e5;
/// Edge of a tile [voxels]; evaluation is cached by tile.
constexpr int kTile = 16;
constexpr int kTileVoxels = kTile * kTile * kTile;

/// What the map says of a voxel. kOutside: beyond the exploration volume, neither known nor wanted.
enum Class : uint8_t { kUnknown = 0, kFree = 1, kOccupied = 2, kOutside = 3 };
/// A voxel's byte in an evaluation: the class, and beside it what was found.
constexpr uint8_t kClassMask = 3, kFrontierFlag = 4, kVoidFlag = 8;

/// Floor of a / b for b > 0.
inline int floorDiv(int a, int b) { return a >= 0 ? a / b : -((-a + b - 1) / b); }

/// A box of whole tiles and the linear index of its voxels, x fastest.
struct GridFrame {
  Voxel origin{0, 0, 0};  ///< lowest voxel, a multiple of kTile
  Voxel tiles{0, 0, 0};   ///< number of tiles along each axis

  Voxel dims() const { return tiles * kTile; }
  Voxel end() const { return origin + dims(); }
  std::size_t size() const { return static_cast<std::size_t>(tiles.cast<int64_t>().prod()) * kTileVoxels; }
  int tileCount() const { return tiles.prod(); }
  bool contains(const Voxel& v) const {
    return (v.array() >= origin.array()).all() && (v.array() < end().array()).all();
  }
  /// Linear index of a voxel that the frame contains.
  std::size_t index(const Voxel& v) const {
    const Voxel d = v - origin;
    return (static_cast<std::size_t>(d.z()) * tiles.y() * kTile + d.y()) * tiles.x() * kTile + d.x();
  }
  Voxel voxel(std::size_t index) const {
    const std::size_t nx = tiles.x() * kTile, ny = tiles.y() * kTile;
    return origin + Voxel(index % nx, index / nx % ny, index / (nx * ny));
  }
  int tileIndex(const Voxel& tile) const { return (tile.z() * tiles.y() + tile.y()) * tiles.x() + tile.x(); }
  int tileOf(const Voxel& v) const { return tileIndex((v - origin) / kTile); }
  Voxel tile(int index) const {
    return {index % tiles.x(), index / tiles.x() % tiles.y(), index / (tiles.x() * tiles.y())};
  }
  bool operator==(const GridFrame& o) const { return origin == o.origin && tiles == o.tiles; }
};

/// One number per voxel, the same in every frame; ascending with z, then y, then x.
inline uint64_t voxelId(const Voxel& v) {
  const auto part = [](int c) { return static_cast<uint64_t>(c + kKeyOffset) & 0xffff; };
  return part(v.z()) << 32 | part(v.y()) << 16 | part(v.x());
}

}  // namespace fv
