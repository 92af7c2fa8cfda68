#pragma once
#include <octomap/OcTree.h>

#include <memory>
#include <string>

namespace fv {

/// What a .ot file holds, checked but not yet made a tree of.
struct OtFile {
  double resolution_m;
  std::size_t nodes;
  std::string payload;  ///< OcTree::readData reads it, unless there are no nodes
};

/// Read a .ot file that is whole: header, `id`, as many nodes as it says, nothing cut off, nothing behind.
/// @param payload_bytes size of one node's data, without the byte of its children; log odds come first.
/// @throws MapFileError naming the file and what is wrong.
OtFile readOtFile(const std::string& path, const std::string& id, std::size_t payload_bytes);

/// Read a .bt or .ot (by its ending) file of an OcTree after checking it. @throws MapFileError.
std::unique_ptr<octomap::OcTree> readOcTree(const std::string& path);

}  // namespace fv
