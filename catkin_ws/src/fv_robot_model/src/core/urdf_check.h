/// What urdfdom reads over or says unclearly.
#pragma once

#include <tinyxml2.h>

#include <string>

namespace fv_robot_model {

/// XML text as a document: nested less than 500 deep and at most 64 MiB, so that no parser behind it runs out
/// of stack or memory.
/// @param what "URDF" or "SRDF", for messages.
/// @throws ModelError with the line when it is not XML, or holds a document type (entities can grow without
/// end).
void readXml(const std::string& xml, const std::string& what, tinyxml2::XMLDocument& document);

/// Names that are missing, taken twice or unknown, kinds of joints and geometry, limits that are not there.
/// @throws ModelError naming joint or link, and what would be valid; for what is not UTF-8, the byte.
void checkUrdf(const std::string& xml);

}  // namespace fv_robot_model
