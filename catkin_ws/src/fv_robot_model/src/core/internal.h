/// Small helpers shared by the library's own sources.
#pragma once

#include <sstream>
#include <string>
#include <vector>

#include "fv_robot_model/types.h"

namespace fv_robot_model {

/// "a, b, c", or "(none)".
std::string joined(const std::vector<std::string>& names);

/// @throws std::invalid_argument unless there is one finite pose per link.
void checkPoses(const LinkPoses& poses, std::size_t link_count);

/// The keys of a map, in its order.
template <typename Map>
std::vector<std::string> keysOf(const Map& map) {
  std::vector<std::string> keys;
  for (const auto& entry : map) keys.push_back(entry.first);
  return keys;
}

/// One string of anything that can be streamed, for error messages.
template <typename... Parts>
std::string text(const Parts&... parts) {
  std::ostringstream out;
  (out << ... << parts);
  return out.str();
}

}  // namespace fv_robot_model
