// The only file with PCL's headers: they are slow to compile.
#include "cloud_filters.h"

#include <pcl/filters/radius_outlier_removal.h>
#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/point_types.h>

#include <cmath>

#include "fv_exploration/errors.h"

namespace fv {

namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

Cloud::Ptr inRange(const Eigen::Ref<const PointsF>& points, const FilterConfig& c) {
  Cloud::Ptr out(new Cloud);
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const double range = points.row(i).cast<double>().norm();
    if (!(range >= kNearestReturn && range <= kFarthestReturn)) continue;
    if (range < c.min_range_m || (c.max_range_m > 0 && range > c.max_range_m)) continue;
    out->push_back({points(i, 0), points(i, 1), points(i, 2)});
  }
  return out;
}

template <class Filter>
Cloud::Ptr filtered(Filter& filter, const Cloud::Ptr& in) {
  Cloud::Ptr out(new Cloud);
  filter.setInputCloud(in);
  filter.filter(*out);
  return out;
}

/// PCL's grid counts its cubes in 32 bits and gives the cloud back unthinned beyond: refuse that instead.
void requireCountable(const Cloud& cloud, double leaf_m) {
  Eigen::Array3f low = Eigen::Array3f::Constant(INFINITY), high = -low;
  for (const pcl::PointXYZ& p : cloud) {
    low = low.min(p.getArray3fMap());
    high = high.max(p.getArray3fMap());
  }
  const double cubes = ((high - low) / static_cast<float>(leaf_m) + 1.F).cast<double>().prod();
  require(cubes < 2147483647.0, "voxel_leaf_m", leaf_m,
          "an edge that cuts the cloud into fewer than 2^31 cubes");
}

}  // namespace

void FilterConfig::validate() const {
  require(min_range_m >= 0, "min_range_m", min_range_m, "0 or more");
  require(max_range_m == 0 || max_range_m > min_range_m, "max_range_m", max_range_m,
          "0 (off) or above min_range_m");
  require(voxel_leaf_m >= 0, "voxel_leaf_m", voxel_leaf_m, "0 (off) or more");
  require(outlier_neighbours >= 0, "outlier_neighbours", outlier_neighbours, "0 (off) or more");
  require(outlier_deviations > 0, "outlier_deviations", outlier_deviations, "above 0");
  require(isolated_radius_m >= 0, "isolated_radius_m", isolated_radius_m, "0 (off) or more");
  require(isolated_neighbours >= 1, "isolated_neighbours", isolated_neighbours, "1 or more");
}

PointsF filterCloud(const Eigen::Ref<const PointsF>& points_sensor, const FilterConfig& c) {
  c.validate();
  Cloud::Ptr cloud = inRange(points_sensor, c);
  if (c.voxel_leaf_m > 0 && !cloud->empty()) {
    requireCountable(*cloud, c.voxel_leaf_m);
    pcl::VoxelGrid<pcl::PointXYZ> grid;
    const auto leaf = static_cast<float>(c.voxel_leaf_m);
    grid.setLeafSize(leaf, leaf, leaf);
    cloud = filtered(grid, cloud);
  }
  if (c.outlier_neighbours > 0 && static_cast<int>(cloud->size()) > c.outlier_neighbours) {
    pcl::StatisticalOutlierRemoval<pcl::PointXYZ> outliers;
    outliers.setMeanK(c.outlier_neighbours);
    outliers.setStddevMulThresh(c.outlier_deviations);
    cloud = filtered(outliers, cloud);
  }
  if (c.isolated_radius_m > 0 && !cloud->empty()) {
    pcl::RadiusOutlierRemoval<pcl::PointXYZ> isolated;
    isolated.setRadiusSearch(c.isolated_radius_m);
    isolated.setMinNeighborsInRadius(c.isolated_neighbours);
    cloud = filtered(isolated, cloud);
  }
  PointsF out(cloud->size(), 3);
  for (std::size_t i = 0; i < cloud->size(); ++i) out.row(i) = (*cloud)[i].getVector3fMap();
  return out;
}

}  // namespace fv
