/// The SRDF as written, not yet compared with a URDF.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "fv_robot_model/types.h"

namespace fv_robot_model {

struct SrdfGroup {
  std::string name;
  std::vector<LinkPair> chains;  ///< base link, tip link
  std::vector<std::string> joints;
  std::vector<std::string> links;  ///< Each stands for the joint above it.
  std::vector<std::string> groups;
};

struct SrdfState {
  std::string name;
  std::string group;
  std::map<std::string, double> values;  ///< By joint name.
};

struct Srdf {
  std::string robot;
  std::vector<SrdfGroup> groups;
  std::vector<SrdfState> states;
  std::vector<std::string> passive_joints;
  std::vector<LinkPair> disabled_pairs;
};

/// Reads groups, group states and disabled pairs; virtual joints, end effectors and the like say nothing
/// needed here.
/// @throws ModelError naming the line of broken XML or the element that lacks an attribute.
Srdf parseSrdf(const std::string& xml);

}  // namespace fv_robot_model
