#include "urdf_check.h"

#include <algorithm>
#include <map>
#include <set>
#include <vector>

#include "fv_robot_model/types.h"
#include "internal.h"

namespace fv_robot_model {
namespace {

using tinyxml2::XMLElement;

constexpr std::size_t kLargestText = std::size_t{64} << 20;  // [bytes]

std::string attributeOf(const XMLElement* element, const char* name) {
  const char* value = element == nullptr ? nullptr : element->Attribute(name);
  return value == nullptr ? "" : value;
}

/// The names of the children of that kind, in order; each must have one of its own.
std::vector<std::string> namesOf(const XMLElement& robot, const char* kind) {
  std::vector<std::string> names;
  std::set<std::string> seen;
  for (auto* child = robot.FirstChildElement(kind); child != nullptr;
       child = child->NextSiblingElement(kind)) {
    names.push_back(attributeOf(child, "name"));
    if (names.back().empty())
      throw ModelError(text("URDF line ", child->GetLineNum(), ": a ", kind, " has no name"));
    if (!seen.insert(names.back()).second)
      throw ModelError(
          text("URDF line ", child->GetLineNum(), ": two ", kind, "s are named '", names.back(), "'"));
  }
  return names;
}

void checkKind(const XMLElement& joint, const std::string& name) {
  const std::string kind = attributeOf(&joint, "type");
  if (kind == "floating" || kind == "planar")
    throw ModelError(text("joint '", name, "' is ", kind,
                          ", which is not supported; valid: revolute, continuous, prismatic, fixed"));
  const bool slides = kind == "prismatic";
  if (kind != "revolute" && kind != "continuous" && !slides && kind != "fixed")
    throw ModelError(text("joint '", name, "' is of the unknown type '", kind,
                          "'; valid: revolute, continuous, prismatic, fixed"));
  if ((kind == "revolute" || slides) && joint.FirstChildElement("limit") == nullptr)
    throw ModelError(text("joint '", name, "' is ", kind, " but has no <limit>"));
}

/// Both ends are links, and nothing hangs on two joints.
void checkEnds(const XMLElement& joint, const std::string& name, const std::vector<std::string>& links,
               std::map<std::string, std::string>& joint_above) {
  std::string ends[2];
  const char* const tags[2] = {"parent", "child"};
  for (int k = 0; k < 2; ++k) {
    ends[k] = attributeOf(joint.FirstChildElement(tags[k]), "link");
    if (std::find(links.begin(), links.end(), ends[k]) == links.end())
      throw ModelError(text("joint '", name, "' has unknown link '", ends[k], "' as its ", tags[k],
                            "; valid: ", joined(links)));
  }
  if (ends[0] == ends[1]) throw ModelError(text("joint '", name, "' joins link '", ends[0], "' to itself"));
  const auto [other, is_new] = joint_above.emplace(ends[1], name);
  if (!is_new)
    throw ModelError(text("link '", ends[1], "' hangs on two joints, '", other->second, "' and '", name,
                          "': the links must be a tree"));
}

void checkGeometry(const XMLElement& link, const std::string& name, const char* what) {
  for (auto* element = link.FirstChildElement(what); element != nullptr;
       element = element->NextSiblingElement(what)) {
    const XMLElement* geometry = element->FirstChildElement("geometry");
    const XMLElement* shape = geometry == nullptr ? nullptr : geometry->FirstChildElement();
    const std::string kind = shape == nullptr ? "" : shape->Name();
    if (kind != "box" && kind != "cylinder" && kind != "sphere" && kind != "mesh")
      throw ModelError(text("URDF line ", element->GetLineNum(), ": a ", what, " of link '", name,
                            kind.empty() ? "' has no geometry" : "' has the unknown geometry '" + kind + "'",
                            "; valid: box, cylinder, sphere, mesh"));
  }
}

void checkRoot(const std::vector<std::string>& links, const std::map<std::string, std::string>& joint_above) {
  std::vector<std::string> roots;
  for (const std::string& link : links)
    if (joint_above.count(link) == 0) roots.push_back(link);
  if (roots.size() == 1) return;
  throw ModelError(text("the URDF needs one root link, that is one without a joint above it; it has ",
                        roots.size(), ": ", joined(roots)));
}

/// The parser behind this one takes as many bytes for a character as its first byte says, without a look at
/// them: it runs beyond quotes, and beyond the end.
void requireUtf8(const std::string& xml) {
  for (std::size_t at = 0; at < xml.size();) {
    const auto first = static_cast<unsigned char>(xml[at]);
    const std::size_t length = first < 0x80                    ? 1
                               : first >= 0xC2 && first < 0xE0 ? 2
                               : first >= 0xE0 && first < 0xF0 ? 3
                               : first >= 0xF0 && first < 0xF5 ? 4
                                                               : 0;
    bool whole = length > 0 && at + length <= xml.size();
    for (std::size_t k = 1; whole && k < length; ++k)
      whole = (static_cast<unsigned char>(xml[at + k]) & 0xC0) == 0x80;
    if (!whole) throw ModelError(text("the URDF is not UTF-8: byte ", at));
    at += length;
  }
}

}  // namespace

void readXml(const std::string& xml, const std::string& what, tinyxml2::XMLDocument& document) {
  if (xml.size() > kLargestText)
    throw ModelError(text("the ", what, " is ", xml.size(), " bytes long; at most ", kLargestText));
  if (document.Parse(xml.c_str(), xml.size()) != tinyxml2::XML_SUCCESS)
    throw ModelError(text("the ", what, " is not XML: ", document.ErrorStr()));
  for (const tinyxml2::XMLNode* node = document.FirstChild(); node != nullptr; node = node->NextSibling())
    if (node->ToUnknown() != nullptr)
      throw ModelError(
          text("the ", what, " has a document type (<!", node->Value(), ">), which is not read"));
}

void checkUrdf(const std::string& xml) {
  requireUtf8(xml);
  tinyxml2::XMLDocument document;
  readXml(xml, "URDF", document);
  const XMLElement* robot = document.FirstChildElement("robot");
  if (robot == nullptr) throw ModelError("the URDF has no <robot> element");
  const std::vector<std::string> links = namesOf(*robot, "link");
  namesOf(*robot, "joint");
  for (auto* link = robot->FirstChildElement("link"); link != nullptr;
       link = link->NextSiblingElement("link"))
    for (const char* what : {"visual", "collision"}) checkGeometry(*link, attributeOf(link, "name"), what);
  std::map<std::string, std::string> joint_above;
  for (auto* joint = robot->FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint")) {
    checkKind(*joint, attributeOf(joint, "name"));
    checkEnds(*joint, attributeOf(joint, "name"), links, joint_above);
  }
  checkRoot(links, joint_above);
}

}  // namespace fv_robot_model
