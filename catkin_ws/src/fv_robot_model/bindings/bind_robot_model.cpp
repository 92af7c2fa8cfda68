#include <pybind11/functional.h>

#include "bindings.h"

namespace fv_robot_model {
namespace {

namespace py = pybind11;
using RowMatrixX = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

void bindJointLimits(py::module_& m) {
  py::class_<JointLimits>(m, "JointLimits", "Range of one joint: rad, or m for prismatic joints.")
      .def_readonly("lower", &JointLimits::lower, "Lower end; -pi for a continuous joint.")
      .def_readonly("upper", &JointLimits::upper, "Upper end; +pi for a continuous joint.")
      .def_readonly("velocity", &JointLimits::velocity, "rad/s or m/s; 0 when the URDF gives none.")
      .def_readonly("effort", &JointLimits::effort, "N m or N; 0 when the URDF gives none.")
      .def_readonly("bounded", &JointLimits::bounded, "False: lower and upper do not bind (continuous).");
}

void bindGroup(py::module_& m) {
  py::class_<Group>(m, "Group", "A group of the SRDF; base_link and tip_link are '' unless it is one chain.")
      .def_readonly("name", &Group::name, "Its name.")
      .def_readonly("base_link", &Group::base_link, "Link on which the chain stands; '' when it is no chain.")
      .def_readonly("tip_link", &Group::tip_link, "Last link of the chain; '' when it is no chain.")
      .def_readonly("joint_names", &Group::joint_names, "Names of its movable joints, base first.")
      .def_readonly("joint_indices", &Group::joint_indices,
                    "The same as indices into joint_names of the model.")
      .def_readonly("moved_links", &Group::moved_links, "Indices of all links that any of its joints moves.")
      .def_property_readonly("is_chain", &Group::isChain, "True when it runs from one base to one tip.");
}

/// A joint of the URDF by name: what RobotModel::Link says, with names instead of numbers.
struct JointInfo {
  std::string name;
  std::string type;
  std::string parent;
  std::string child;
  std::string leader;
  RobotModel::Link link;
};

std::string typeOf(const RobotModel::Link& link) {
  using Motion = RobotModel::Link::Motion;
  if (link.motion == Motion::Fixed) return "fixed";
  if (link.motion == Motion::Translation) return "prismatic";
  return link.limits.bounded ? "revolute" : "continuous";
}

std::vector<JointInfo> jointsOf(const RobotModel& model) {
  std::vector<JointInfo> joints;
  for (int i = 0; i < static_cast<int>(model.linkNames().size()); ++i) {
    const RobotModel::Link& link = model.link(i);
    if (link.joint_name.empty()) continue;  // the root, and what is attached
    joints.push_back({link.joint_name, typeOf(link), model.linkNames()[static_cast<std::size_t>(link.parent)],
                      model.linkNames()[static_cast<std::size_t>(i)],
                      link.mimic ? model.jointNames()[static_cast<std::size_t>(link.variable)] : "", link});
  }
  return joints;
}

Array matrixOf(const Eigen::Isometry3d& T) {
  Array out({4, 4});
  writeMatrix(T, out.mutable_data());
  return out;
}

void bindJoint(py::module_& m) {
  py::class_<JointInfo>(m, "Joint", "A joint of the URDF, fixed and mimic ones too.")
      .def_readonly("name", &JointInfo::name, "Its name.")
      .def_readonly("type", &JointInfo::type, "'revolute', 'continuous', 'prismatic' or 'fixed'.")
      .def_readonly("parent", &JointInfo::parent, "The link above it.")
      .def_readonly("child", &JointInfo::child, "The link below it.")
      .def_readonly("leader", &JointInfo::leader,
                    "The joint of joint_names that a mimic follows in the end; '' for others.")
      .def_property_readonly(
          "multiplier", [](const JointInfo& j) { return j.link.multiplier; },
          "Of a mimic: its value is multiplier * q[leader] + offset; else 1.")
      .def_property_readonly(
          "offset", [](const JointInfo& j) { return j.link.offset; }, "See multiplier; else 0.")
      .def_property_readonly(
          "axis", [](const JointInfo& j) { return j.link.axis; },
          "(3,) unit vector, joint frame; x for fixed joints.")
      .def_property_readonly(
          "limits", [](const JointInfo& j) { return j.link.limits; },
          "Its own JointLimits, as the URDF has them; zeros for fixed joints.")
      .def_property_readonly(
          "T_parent_joint", [](const JointInfo& j) { return matrixOf(j.link.T_parent_joint); },
          "(4, 4): joint frame, at zero, to the frame of the parent link.");
}

void bindVisual(py::module_& m) {
  py::class_<Visual> c(m, "Visual", "What a link looks like: one primitive or one mesh.");
  py::enum_<Visual::Kind>(c, "Kind", "Kinds of visuals.")
      .value("Box", Visual::Kind::Box)
      .value("Cylinder", Visual::Kind::Cylinder)
      .value("Sphere", Visual::Kind::Sphere)
      .value("Mesh", Visual::Kind::Mesh);
  c.def_readonly("kind", &Visual::kind, "Which kind.");
  c.def_readonly(
      "dimensions", &Visual::dimensions,
      "(3,) Box: edges [m]. Cylinder: radius, length, 0 [m]. Sphere: radius, 0, 0 [m]. Mesh: scale.");
  c.def_readonly("mesh", &Visual::mesh, "Name of the mesh as the URDF has it; '' for primitives.");
  c.def_property_readonly(
      "T_link_visual", [](const Visual& v) { return matrixOf(v.T_link_visual); },
      "(4, 4): visual frame to link frame.");
}

/// (J,) or (B, J) of joint values to (L, 4, 4) or (B, L, 4, 4).
Array forwardArray(const RobotModel& model, const Array& q) {
  const auto links = static_cast<py::ssize_t>(model.linkNames().size());
  if (q.ndim() != 1 && q.ndim() != 2) throw std::invalid_argument("q must have shape (J,) or (B, J)");
  const bool batch = q.ndim() == 2;
  const py::ssize_t count = batch ? q.shape(0) : 1;
  const py::ssize_t width = q.shape(q.ndim() - 1);
  Array out(batch ? std::vector<py::ssize_t>{count, links, 4, 4} : std::vector<py::ssize_t>{links, 4, 4});
  const double* in = q.data();
  double* result = out.mutable_data();
  const py::gil_scoped_release release;
  LinkPoses poses;
  for (py::ssize_t b = 0; b < count; ++b) {
    model.forward(Eigen::Map<const Eigen::VectorXd>(in + b * width, width), poses);
    for (py::ssize_t l = 0; l < links; ++l) writeMatrix(poses[l], result + 16 * (b * links + l));
  }
  return out;
}

Eigen::VectorXd valuesFromDict(const RobotModel& model, const std::map<std::string, double>& values) {
  Eigen::VectorXd q(model.jointNames().size());
  std::vector<std::string> missing;
  for (std::size_t i = 0; i < model.jointNames().size(); ++i) {
    const auto found = values.find(model.jointNames()[i]);
    if (found == values.end()) {
      missing.push_back(model.jointNames()[i]);
    } else {
      q[static_cast<Eigen::Index>(i)] = found->second;
    }
  }
  for (const auto& entry : values) model.jointIndex(entry.first);
  if (missing.empty()) return q;
  std::string names;
  for (const std::string& name : missing) names += " " + name;
  throw std::invalid_argument("no value for these joints:" + names);
}

py::dict forwardDict(const RobotModel& model, const std::map<std::string, double>& values) {
  const LinkPoses poses = model.forward(valuesFromDict(model, values));
  py::dict out;
  for (std::size_t l = 0; l < poses.size(); ++l) {
    Array matrix({4, 4});
    writeMatrix(poses[l], matrix.mutable_data());
    out[py::str(model.linkNames()[l])] = matrix;
  }
  return out;
}

/// Rows of q, one or many, and how many there are.
Eigen::Map<const RowMatrixX> rowsOf(const Array& q) {
  if (q.ndim() != 1 && q.ndim() != 2) throw std::invalid_argument("q must have shape (n,) or (B, n)");
  const bool batch = q.ndim() == 2;
  return {q.data(), batch ? q.shape(0) : 1, q.shape(q.ndim() - 1)};
}

Array tipPoses(const RobotModel& model, const std::string& name, const Array& q) {
  const Group& group = model.group(name);
  const auto rows = rowsOf(q);
  Array out(q.ndim() == 2 ? std::vector<py::ssize_t>{rows.rows(), 4, 4} : std::vector<py::ssize_t>{4, 4});
  double* result = out.mutable_data();
  const py::gil_scoped_release release;
  for (Eigen::Index b = 0; b < rows.rows(); ++b)
    writeMatrix(model.tipPose(group, rows.row(b).transpose()), result + 16 * b);
  return out;
}

Array jacobians(const RobotModel& model, const std::string& name, const Array& q) {
  const Group& group = model.group(name);
  const auto rows = rowsOf(q);
  const auto n = static_cast<py::ssize_t>(group.joint_indices.size());
  Array out(q.ndim() == 2 ? std::vector<py::ssize_t>{rows.rows(), 6, n} : std::vector<py::ssize_t>{6, n});
  double* result = out.mutable_data();
  const py::gil_scoped_release release;
  for (Eigen::Index b = 0; b < rows.rows(); ++b)
    Eigen::Map<RowMatrixX>{result + 6 * n * b, 6, n} = model.jacobian(group, rows.row(b).transpose());
  return out;
}

/// A Python function as resolver; what it raises becomes a ModelError of one line.
MeshResolver resolverOf(const py::object& function) {
  return [function](const std::string& uri) {
    try {
      return function(uri).cast<std::string>();
    } catch (const py::error_already_set& error) {
      throw ModelError(py::str(error.value()).cast<std::string>());
    }
  };
}

RobotModel fromXml(const std::string& urdf_xml, const std::string& srdf_xml, const py::object& resolver,
                   bool with_shapes) {
  MeshResolver find;
  if (py::isinstance<py::dict>(resolver)) {
    find = packageResolver(resolver.cast<std::map<std::string, std::string>>());
  } else if (!resolver.is_none()) {
    find = resolverOf(resolver);
  }
  return RobotModel::fromXml(urdf_xml, srdf_xml, find, with_shapes);
}

std::vector<std::string> movedLinks(const RobotModel& model, const std::vector<std::string>& joints) {
  std::vector<int> indices;
  for (const std::string& joint : joints) indices.push_back(model.jointIndex(joint));
  std::vector<std::string> names;
  for (const int link : model.movedLinks(indices))
    names.push_back(model.linkNames()[static_cast<std::size_t>(link)]);
  return names;
}

Eigen::VectorXd withGroup(const RobotModel& model, const std::string& group, const Eigen::VectorXd& q_group,
                          Eigen::VectorXd q_all) {
  model.setGroup(model.group(group), q_group, q_all);
  return q_all;
}

void defNames(py::class_<RobotModel>& c) {
  c.def_property_readonly("name", &RobotModel::name, "Name of the robot.");
  c.def_property_readonly("joint_names", &RobotModel::jointNames,
                          "Movable joints that are no mimics: the order of q.");
  c.def_property_readonly("limits", &RobotModel::limits,
                          "JointLimits of each of joint_names, narrowed so that mimics stay within theirs.");
  c.def_property_readonly("joints", &jointsOf,
                          "Every Joint of the URDF, in the order of its child in link_names.");
  c.def_property_readonly("passive_joints", &RobotModel::passiveJoints,
                          "Those of joint_names that the SRDF calls passive: no group holds them.");
  c.def_property_readonly("bare_links", &RobotModel::bareLinks,
                          "Links that are drawn but have no collision shape.");
  c.def_property_readonly("link_names", &RobotModel::linkNames, "Links, parents before children.");
  c.def_property_readonly("root_link", &RobotModel::rootLink, "The link without a parent.");
  c.def_property_readonly("group_names", &RobotModel::groupNames, "Groups of the SRDF.");
  c.def_property_readonly("disabled_pairs", &RobotModel::disabledPairs,
                          "Pairs of links whose contact the SRDF declares harmless.");
  c.def("joint_index", &RobotModel::jointIndex, py::arg("joint"), "Place of a joint; UnknownNameError.");
  c.def("link_index", &RobotModel::linkIndex, py::arg("link"), "Place of a link; UnknownNameError.");
  c.def("parent", &RobotModel::parent, py::arg("link_index"), "Index of the parent link; -1 for the root.");
  c.def("group", &RobotModel::group, py::arg("name"), py::return_value_policy::reference_internal,
        "A group; UnknownNameError lists the valid ones.");
  c.def("named_states", &RobotModel::namedStates, py::arg("group"),
        "Named poses of a group: {name: (n,) values in the order of its joint_names}.");
}

void defKinematics(py::class_<RobotModel>& c) {
  c.def(
      "forward", &forwardDict, py::arg("q"),
      "{joint: value} for every joint to {link: T_root_link (4, 4)}. Missing or unknown joints: ValueError.");
  c.def("forward", &forwardArray, py::arg("q"),
        "T_root_link of every link: (J,) to (L, 4, 4), or (B, J) to (B, L, 4, 4). Wrong size, NaN: "
        "ValueError.");
  c.def("configuration", &valuesFromDict, py::arg("values"), "{joint: value} for every joint to (J,).");
  c.def("tip_pose", &tipPoses, py::arg("group"), py::arg("q_group"),
        "T_base_tip of a chain: (n,) to (4, 4), or (B, n) to (B, 4, 4).");
  c.def("jacobian", &jacobians, py::arg("group"), py::arg("q_group"),
        "Geometric Jacobian of the tip in the base frame, linear rows first: (n,) to (6, n), or (B, n) to "
        "(B, 6, n).");
  c.def("with_group", &withGroup, py::arg("group"), py::arg("q_group"), py::arg("q_all"),
        "A copy of q_all (J,) with the values of one group replaced.");
  c.def(
      "within_limits",
      [](const RobotModel& model, const std::string& group, const Eigen::VectorXd& q, double tolerance) {
        return model.withinLimits(model.group(group), q, tolerance);
      },
      py::arg("group"), py::arg("q_group"), py::arg("tolerance") = 0.0,
      "True when every bounded joint of the group is within its limits, widened by tolerance [rad or m].");
}

}  // namespace

void bindRobotModel(py::module_& m) {
  bindJointLimits(m);
  bindJoint(m);
  bindVisual(m);
  bindGroup(m);
  py::class_<RobotModel> c(m, "RobotModel",
                           "A tree of links and joints with collision shapes and SRDF groups.");
  c.def_static(
      "from_xml", &fromXml, py::arg("urdf_xml"), py::arg("srdf_xml") = "", py::arg("resolver") = py::none(),
      py::arg("with_shapes") = true,
      "From the text of a URDF and an SRDF ('' for none). `resolver` finds meshes other than file:// and\n"
      "absolute ones: {package: folder} or a function from the name as written to an absolute file name.\n"
      "with_shapes=False: no collision shapes, and no mesh is looked for.\n"
      "Raises ModelError naming what is broken or not supported.");
  c.def("with_attached", &RobotModel::withAttached, py::arg("name"), py::arg("parent"), py::arg("shapes"),
        py::arg("touch_links") = std::vector<std::string>{},
        "The same robot holding something: a new last link `name`, fixed to link `parent`, with shapes in "
        "its frame.\n"
        "touch_links are links besides the parent that may touch it.");
  defNames(c);
  defKinematics(c);
  c.def(
      "shapes",
      [](const RobotModel& model, const std::string& link) { return model.shapes(model.linkIndex(link)); },
      py::arg("link"), "Collision shapes of a link by name; [] for a link without.");
  c.def(
      "visuals",
      [](const RobotModel& model, const std::string& link) { return model.visuals(model.linkIndex(link)); },
      py::arg("link"), "Visuals of a link by name; [] for a link that is not drawn.");
  c.def("moved_links", &movedLinks, py::arg("joints"), "Names of all links that any of these joints moves.");
}

}  // namespace fv_robot_model
