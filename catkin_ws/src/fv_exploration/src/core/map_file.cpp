#include "fv_exploration/map_file.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "fv_exploration/errors.h"
#include "fv_exploration/occupancy_map.h"

namespace fv {

namespace {

constexpr int kDepth = 16;
constexpr std::uintmax_t kMostBytes = std::uintmax_t{1} << 31;  // some 400 million nodes

struct MapFile {
  std::string path;
  std::string first, id;
  std::size_t nodes = 0;
  double resolution_m = 0;
  std::string payload;

  [[noreturn]] void fail(const std::string& what) const { throw MapFileError(path + ": " + what); }
};

MapFile openFile(const std::string& path) {
  MapFile file;
  file.path = path;
  std::error_code problem;
  const std::uintmax_t bytes = std::filesystem::file_size(path, problem);  // none for folders, pipes, devices
  if (problem) file.fail("cannot be opened");
  if (bytes > kMostBytes) file.fail("has " + std::to_string(bytes) + " bytes; valid: at most 2 GiB");
  std::ifstream stream(path, std::ios::binary);
  if (!stream) file.fail("cannot be opened");
  std::getline(stream, file.first);
  std::string line;
  bool data = false;
  while (!data && std::getline(stream, line)) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "id") words >> file.id;
    if (word == "size") words >> file.nodes;
    if (word == "res") words >> file.resolution_m;
    data = word == "data";
  }
  if (!data) file.fail("has no octree data; valid: OctoMap's .ot or .bt");
  if (!(file.resolution_m > 0)) file.fail("has no resolution in its header");
  file.payload.assign(std::istreambuf_iterator<char>(stream), {});
  return file;
}

void requireHeader(const MapFile& file, const std::string& first, const std::string& id) {
  if (file.first.rfind(first, 0) != 0)
    file.fail("begins with \"" + file.first.substr(0, 60) + "\"; valid: " + first);
  if (file.id != id) file.fail("holds a " + file.id.substr(0, 60) + "; valid: " + id);
}

/// Walks the nodes of a payload without building them.
class Walk {
 public:
  Walk(const MapFile& file, std::size_t payload_bytes) : file_(file), payload_bytes_(payload_bytes) {}

  void full(int depth = 0) {
    const std::size_t payload = at_;
    take(payload_bytes_);
    float log_odds;  // what a node begins with
    std::memcpy(&log_odds, file_.payload.data() + payload, sizeof(log_odds));
    if (std::isnan(log_odds)) file_.fail("has a node without occupancy (log odds is nan): damaged");
    const unsigned children = take(1);
    enter(depth, children != 0);
    for (int i = 0; i < 8; ++i)
      if (children >> i & 1) full(depth + 1);
  }
  void binary(int depth = 0) {
    const unsigned low = take(1), bits = low | take(1) << 8;
    enter(depth, bits != 0);
    for (int i = 0; i < 8; ++i) {
      const unsigned kind = bits >> (2 * i) & 3;
      if (kind == 3)
        binary(depth + 1);
      else if (kind != 0)
        ++nodes_;
    }
  }
  void finish() const {
    if (at_ != file_.payload.size())
      file_.fail(std::to_string(file_.payload.size() - at_) + " bytes behind the last node");
    if (nodes_ != file_.nodes)
      file_.fail("has " + std::to_string(nodes_) + " nodes, its header says " + std::to_string(file_.nodes));
  }

 private:
  void enter(int depth, bool has_children) {
    ++nodes_;
    if (depth >= kDepth && has_children) file_.fail("is deeper than 16 levels: damaged");
  }
  /// Skip bytes; returns the first.
  unsigned take(std::size_t bytes) {
    if (at_ + bytes > file_.payload.size()) file_.fail("is cut off inside its nodes");
    const auto value = static_cast<unsigned char>(file_.payload[at_]);
    at_ += bytes;
    return value;
  }

  const MapFile& file_;
  std::size_t payload_bytes_;
  std::size_t at_ = 0;
  std::size_t nodes_ = 0;
};

bool endsWith(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

MapFile checkedOt(const std::string& path, const std::string& id, std::size_t payload_bytes) {
  MapFile file = openFile(path);
  requireHeader(file, "# Octomap OcTree file", id);
  Walk walk(file, payload_bytes);
  if (file.nodes > 0) walk.full();
  walk.finish();
  return file;
}

MapFile checkedBt(const std::string& path) {
  MapFile file = openFile(path);
  requireHeader(file, "# Octomap OcTree binary file", "OcTree");
  Walk walk(file, 0);
  if (file.nodes > 0) walk.binary();
  walk.finish();
  return file;
}

}  // namespace

OtFile readOtFile(const std::string& path, const std::string& id, std::size_t payload_bytes) {
  MapFile file = checkedOt(path, id, payload_bytes);
  return {file.resolution_m, file.nodes, std::move(file.payload)};
}

std::unique_ptr<octomap::OcTree> readOcTree(const std::string& path) {
  const bool binary = endsWith(path, ".bt");
  if (!binary && !endsWith(path, ".ot")) throw MapFileError(path + ": unknown ending; valid: .bt, .ot");
  const MapFile file = binary ? checkedBt(path) : checkedOt(path, "OcTree", sizeof(float));
  auto tree = std::make_unique<octomap::OcTree>(file.resolution_m);
  if (file.nodes == 0) return tree;
  std::istringstream stream(file.payload);
  if (binary)
    tree->readBinaryData(stream);
  else
    tree->readData(stream);
  return tree;
}

std::unique_ptr<OccupancyMap> OccupancyMap::read(const std::string& path, const MapConfig* config) {
  const std::unique_ptr<octomap::OcTree> tree = readOcTree(path);
  MapConfig made = config ? *config : MapConfig{};
  if (!config) made.resolution_m = tree->getResolution();
  if (std::fabs(made.resolution_m - tree->getResolution()) > 1e-9 * made.resolution_m) {
    std::ostringstream text;
    text << "resolution_m is " << made.resolution_m << "; valid: " << tree->getResolution() << ", that of "
         << path;
    throw InputError(text.str());
  }
  auto map = std::make_unique<OccupancyMap>(made);
  map->adopt(*tree);
  return map;
}

/// Take over the leaves of a tree, cut to the bounds, with their log odds.
void OccupancyMap::adopt(const octomap::OcTree& tree) {
  std::vector<std::pair<VoxelBox, float>> leaves;
  VoxelBox all{Voxel::Constant(kKeyOffset), Voxel::Constant(-kKeyOffset)};
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf) {
    const int edge = 1 << (tree.getTreeDepth() - leaf.getDepth());
    const octomap::OcTreeKey key = leaf.getIndexKey();
    const Voxel low(key[0] - kKeyOffset, key[1] - kKeyOffset, key[2] - kKeyOffset);
    const VoxelBox box{low.cwiseMax(bounds_.min), (low + Voxel::Constant(edge - 1)).cwiseMin(bounds_.max)};
    if ((box.min.array() > box.max.array()).any()) continue;
    leaves.emplace_back(box, leaf->getLogOdds());
    all = {all.min.cwiseMin(box.min), all.max.cwiseMax(box.max)};
  }
  if (leaves.empty()) return;
  if (!bounded()) makeRoom(all.min, all.max);  // first: a leaf near the root may be too large for any map
  ++sequence_;
  for (const auto& [box, log_odds] : leaves) {
    const Class known = tree_->fillBox(box.min, box.max, log_odds);
    const Voxel size = box.max - box.min + Voxel::Ones();
    for (int z = box.min.z(); z <= box.max.z(); ++z)
      for (int y = box.min.y(); y <= box.max.y(); ++y)
        std::fill_n(classes_.begin() + frame_.index({box.min.x(), y, z}), size.x(), known);
    counts_[known] += size.cast<int64_t>().prod();
  }
}

std::string OccupancyMap::binaryData() const {
  OccupancyTree copy(*tree_);
  copy.toMaxLikelihood();
  copy.prune();
  std::ostringstream stream;
  copy.writeBinaryData(stream);
  return stream.str();
}

std::string OccupancyMap::fullData() const {
  std::ostringstream stream;
  tree_->writeData(stream);
  return stream.str();
}

void OccupancyMap::writeBt(const std::string& path) const {
  OccupancyTree copy(*tree_);
  std::ofstream stream(path, std::ios::binary);
  if (!stream || !copy.writeBinary(stream) || !stream.flush())
    throw MapFileError(path + ": cannot be written");
}

void OccupancyMap::writeOt(const std::string& path) const {
  std::ofstream stream(path, std::ios::binary);
  if (!stream || !tree_->write(stream) || !stream.flush()) throw MapFileError(path + ": cannot be written");
}

}  // namespace fv
