#include "srdf.h"

#include <tinyxml2.h>

#include <cmath>

#include "internal.h"
#include "mesh_builder.h"
#include "urdf_check.h"

namespace fv_robot_model {
namespace {

using tinyxml2::XMLElement;

std::string required(const XMLElement& element, const char* attribute) {
  const char* value = element.Attribute(attribute);
  if (value == nullptr || *value == '\0')
    throw ModelError(
        text("SRDF line ", element.GetLineNum(), ": <", element.Name(), "> lacks '", attribute, "'"));
  return value;
}

/// Calls use(child) for every child element of that name.
template <typename Use>
void forEach(const XMLElement& parent, const char* name, Use use) {
  for (const XMLElement* child = parent.FirstChildElement(name); child != nullptr;
       child = child->NextSiblingElement(name))
    use(*child);
}

SrdfGroup parseGroup(const XMLElement& element) {
  SrdfGroup group;
  group.name = required(element, "name");
  forEach(element, "chain", [&](const XMLElement& chain) {
    group.chains.emplace_back(required(chain, "base_link"), required(chain, "tip_link"));
  });
  forEach(element, "joint", [&](const XMLElement& e) { group.joints.push_back(required(e, "name")); });
  forEach(element, "link", [&](const XMLElement& e) { group.links.push_back(required(e, "name")); });
  forEach(element, "group", [&](const XMLElement& e) { group.groups.push_back(required(e, "name")); });
  return group;
}

double jointValue(const std::string& told, int line) {
  const auto refuse = [&] {
    return ModelError(text("SRDF line ", line, ": '", told, "' is no joint value (one finite number)"));
  };
  try {
    Words words(told);
    const double value = numberOf<double>(words.next(), "joint value");
    if (!std::isfinite(value) || !words.next().empty()) throw refuse();
    return value;
  } catch (const ModelError&) {
    throw refuse();
  }
}

SrdfState parseState(const XMLElement& element) {
  SrdfState state{required(element, "name"), required(element, "group"), {}};
  forEach(element, "joint", [&](const XMLElement& joint) {
    const double value = jointValue(required(joint, "value"), joint.GetLineNum());
    if (!state.values.emplace(required(joint, "name"), value).second)
      throw ModelError(text("SRDF line ", joint.GetLineNum(), ": joint '", joint.Attribute("name"),
                            "' has two values in group_state '", state.name, "'"));
  });
  return state;
}

}  // namespace

Srdf parseSrdf(const std::string& xml) {
  tinyxml2::XMLDocument document;
  readXml(xml, "SRDF", document);
  const XMLElement* robot = document.FirstChildElement("robot");
  if (robot == nullptr) throw ModelError("the SRDF has no <robot> element");
  Srdf srdf;
  srdf.robot = required(*robot, "name");
  forEach(*robot, "group", [&](const XMLElement& e) { srdf.groups.push_back(parseGroup(e)); });
  forEach(*robot, "group_state", [&](const XMLElement& e) { srdf.states.push_back(parseState(e)); });
  forEach(*robot, "passive_joint",
          [&](const XMLElement& e) { srdf.passive_joints.push_back(required(e, "name")); });
  forEach(*robot, "disable_collisions", [&](const XMLElement& e) {
    srdf.disabled_pairs.emplace_back(required(e, "link1"), required(e, "link2"));
  });
  return srdf;
}

}  // namespace fv_robot_model
