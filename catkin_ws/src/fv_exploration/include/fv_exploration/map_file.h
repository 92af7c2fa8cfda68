#pragma once
#include <octomap/OcTree.h>

#include <memory>
#include <string>

namespace fv {

/// Check that a .ot file is whole: header, `id`, as many nodes as it says, nothing cut off, nothing behind.
/// @param payload_bytes size of one node's data, without the byte of its children.
/// @return the resolution [m].
/// @throws MapFileError naming the file and what is wrong.
double checkOtFile(const std::string& path, const std::string& id, std::size_t payload_bytes);

/// Read a .bt or .ot (by its ending) file of an OcTree after checking it. @throws MapFileError.
std::unique_ptr<octomap::OcTree> readOcTree(const std::string& path);

}  // namespace fv
