#include <tinyxml2.h>

#include <algorithm>
#include <functional>
#include <map>
#include <string>

#include "mesh_builder.h"
#include "mesh_formats.h"
#include "urdf_check.h"

namespace fv_robot_model {
namespace {

using tinyxml2::XMLElement;
using Transform = Eigen::Affine3d;

constexpr int kMostDepth = 100;                    // of nodes in nodes, those behind instances too
constexpr int kMostInstances = 100'000;            // instances of instances grow without end
constexpr std::size_t kMostNumbers = 100'000'000;  // read for all instances together

std::string attributeOf(const XMLElement& element, const char* name) {
  const char* value = element.Attribute(name);
  return value == nullptr ? "" : value;
}

std::size_t sizeOf(const XMLElement& element, const char* name, std::size_t otherwise) {
  const char* value = element.Attribute(name);
  return value == nullptr ? otherwise : numberOf<std::size_t>(value, name);
}

/// All text directly inside of an element; comments may part it.
std::string textOf(const XMLElement& element) {
  std::string all;
  for (auto* node = element.FirstChild(); node != nullptr; node = node->NextSibling())
    if (node->ToText() != nullptr) all += node->Value();
  return all;
}

template <typename Number>
std::vector<Number> numbersOf(const XMLElement& element, const char* what) {
  const std::string all = textOf(element);
  std::vector<Number> numbers;
  Words words(all);
  for (std::string_view word = words.next(); !word.empty(); word = words.next())
    numbers.push_back(numberOf<Number>(word, what));
  return numbers;
}

template <typename Use>
void forEach(const XMLElement& parent, const char* name, const Use& use) {
  for (auto* child = parent.FirstChildElement(name); child != nullptr;
       child = child->NextSiblingElement(name))
    use(*child);
}

const XMLElement& childOf(const XMLElement& parent, const char* name) {
  const XMLElement* child = parent.FirstChildElement(name);
  if (child == nullptr)
    throw ModelError(text("line ", parent.GetLineNum(), ": <", parent.Name(), "> lacks <", name, ">"));
  return *child;
}

Transform transformOf(const XMLElement& element) {
  const std::string kind = element.Name();
  const auto n = numbersOf<double>(element, "number of a transform");
  const auto require = [&](std::size_t count) {
    if (n.size() != count)
      throw ModelError(
          text("line ", element.GetLineNum(), ": <", kind, "> has ", n.size(), " numbers; valid: ", count));
  };
  Transform T = Transform::Identity();
  if (kind == "matrix") {
    require(16);
    T.matrix() = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(n.data());
    T.makeAffine();
  } else if (kind == "translate") {
    require(3);
    T.translation() << n[0], n[1], n[2];
  } else if (kind == "scale") {
    require(3);
    T.linear() = Eigen::Vector3d(n[0], n[1], n[2]).asDiagonal();
  } else if (kind == "rotate") {
    require(4);
    const Eigen::Vector3d axis(n[0], n[1], n[2]);
    if (axis.norm() > 0) T.linear() = Eigen::AngleAxisd(n[3] * M_PI / 180, axis.normalized()).matrix();
  }
  return T;
}

/// The geometry of a document's scene.
class ColladaReader {
 public:
  explicit ColladaReader(const XMLElement& root) : root_(root) { index(root); }

  TriangleMesh read() {
    Transform T = Transform::Identity();
    if (const auto* asset = root_.FirstChildElement("asset"))
      if (const auto* unit = asset->FirstChildElement("unit"))
        if (unit->Attribute("meter") != nullptr)
          T.linear() *= numberOf<double>(unit->Attribute("meter"), "unit's length");
    forEach(childOf(root_, "scene"), "instance_visual_scene", [&](const XMLElement& instance) {
      forEach(target(instance, "url", "visual_scene"), "node",
              [&](const XMLElement& node) { addNode(node, T, 0); });
    });
    return mesh_.take();
  }

 private:
  void index(const XMLElement& element) {
    if (element.Attribute("id") != nullptr) by_id_.emplace(element.Attribute("id"), &element);
    for (auto* child = element.FirstChildElement(); child != nullptr; child = child->NextSiblingElement())
      index(*child);
  }

  /// The element that an attribute refers to.
  const XMLElement& target(const XMLElement& element, const char* attribute, const char* kind) const {
    const std::string url = attributeOf(element, attribute);
    const auto found = url.empty() || url[0] != '#' ? by_id_.end() : by_id_.find(url.substr(1));
    if (found == by_id_.end() || std::string(found->second->Name()) != kind)
      throw ModelError(
          text("line ", element.GetLineNum(), ": '", url.substr(0, 60), "' is no <", kind, "> of this file"));
    return *found->second;
  }

  void addNode(const XMLElement& node, Transform T, int depth) {
    if (depth > kMostDepth)
      throw ModelError(text("its nodes are nested deeper than ", kMostDepth, ", or hold themselves"));
    if (++instances_ > kMostInstances)
      throw ModelError(text("its scene has more than ", kMostInstances, " nodes"));
    for (auto* child = node.FirstChildElement(); child != nullptr; child = child->NextSiblingElement()) {
      const std::string kind = child->Name();
      if (kind == "node") addNode(*child, T, depth + 1);
      if (kind == "instance_node") addNode(target(*child, "url", "node"), T, depth + 1);
      if (kind == "instance_geometry") addGeometry(target(*child, "url", "geometry"), T);
      if (kind == "matrix" || kind == "translate" || kind == "rotate" || kind == "scale")
        T = T * transformOf(*child);
      if (kind == "lookat" || kind == "skew" || kind == "instance_controller")
        throw ModelError(text("line ", child->GetLineNum(), ": <", kind, "> is not read; export without it"));
    }
  }

  void addGeometry(const XMLElement& geometry, const Transform& T) {
    if (++instances_ > kMostInstances)
      throw ModelError(text("its scene has more than ", kMostInstances, " geometries"));
    const XMLElement& mesh = childOf(geometry, "mesh");
    for (auto* part = mesh.FirstChildElement(); part != nullptr; part = part->NextSiblingElement()) {
      const std::string kind = part->Name();
      const bool has_faces = kind == "triangles" || kind == "polylist" || kind == "polygons" ||
                             kind == "trifans" || kind == "tristrips";
      if (has_faces && part->FirstChildElement("input") != nullptr) addFaces(*part, kind, T);
    }
  }

  /// Corners of the faces of one primitive element.
  void addFaces(const XMLElement& part, const std::string& kind, const Transform& T) {
    std::size_t stride = 1, offset = 0;
    const XMLElement* vertices = nullptr;
    forEach(part, "input", [&](const XMLElement& input) {
      const std::size_t own = sizeOf(input, "offset", 0);
      if (own > 64)
        throw ModelError(text("line ", input.GetLineNum(), ": offset is ", own, "; valid: up to 64"));
      stride = std::max(stride, own + 1);
      if (attributeOf(input, "semantic") != "VERTEX") return;
      offset = own;
      vertices = &target(input, "source", "vertices");
    });
    if (vertices == nullptr)
      throw ModelError(text("line ", part.GetLineNum(), ": <", kind, "> has no vertices"));
    const std::vector<Eigen::Vector3d>& positions = positionsOf(*vertices);
    std::vector<std::size_t> sizes;
    if (const auto* vcount = part.FirstChildElement("vcount"))
      sizes = numbersOf<std::size_t>(*vcount, "vcount");
    const auto addIndices = [&](const XMLElement& p) {
      const auto numbers = numbersOf<std::size_t>(p, "vertex number");
      if ((numbers_read_ += numbers.size()) > kMostNumbers)
        throw ModelError(text("its scene has more than ", kMostNumbers, " vertex numbers"));
      std::vector<Eigen::Vector3d> corners;
      for (std::size_t at = offset; at < numbers.size(); at += stride) {
        if (numbers[at] >= positions.size())
          throw ModelError(text("line ", p.GetLineNum(), ": vertex ", numbers[at], " of ", positions.size()));
        corners.push_back(T * positions[numbers[at]]);
      }
      addCorners(corners, kind, sizes);
    };
    forEach(part, "p", addIndices);
    forEach(part, "ph", [&](const XMLElement& with_hole) { addIndices(childOf(with_hole, "p")); });
  }

  void addCorners(const std::vector<Eigen::Vector3d>& corners, const std::string& kind,
                  const std::vector<std::size_t>& sizes) {
    if (kind == "triangles") {
      for (std::size_t k = 2; k < corners.size(); k += 3)
        mesh_.addTriangle(corners[k - 2], corners[k - 1], corners[k]);
    } else if (kind == "tristrips") {
      for (std::size_t k = 2; k < corners.size(); ++k)
        mesh_.addTriangle(corners[k - 2 + k % 2], corners[k - 1 - k % 2], corners[k]);
    } else if (kind == "polylist") {
      auto begin = corners.begin();
      for (const std::size_t size : sizes) {
        if (size > static_cast<std::size_t>(corners.end() - begin))
          throw ModelError("a polylist has too few corners");
        mesh_.add({begin, begin + static_cast<std::ptrdiff_t>(size)});
        begin += static_cast<std::ptrdiff_t>(size);
      }
    } else {
      mesh_.add(corners);
    }
  }

  const std::vector<Eigen::Vector3d>& positionsOf(const XMLElement& vertices) {
    const auto known = positions_.find(&vertices);
    if (known != positions_.end()) return known->second;
    std::vector<Eigen::Vector3d> positions;
    forEach(vertices, "input", [&](const XMLElement& input) {
      if (attributeOf(input, "semantic") == "POSITION")
        positions = sourcePoints(target(input, "source", "source"));
    });
    return positions_[&vertices] = std::move(positions);
  }

  std::vector<Eigen::Vector3d> sourcePoints(const XMLElement& source) const {
    const XMLElement& accessor = childOf(childOf(source, "technique_common"), "accessor");
    const auto numbers = numbersOf<double>(target(accessor, "source", "float_array"), "coordinate");
    const std::size_t count = sizeOf(accessor, "count", 0), stride = sizeOf(accessor, "stride", 1);
    const std::size_t first = sizeOf(accessor, "offset", 0);
    const bool fits = stride >= 3 && first <= numbers.size() && count <= (numbers.size() - first) / stride;
    if (!fits)
      throw ModelError(text("line ", accessor.GetLineNum(), ": ", count, " points of ", stride,
                            " numbers from number ", first, " on; there are ", numbers.size()));
    std::vector<Eigen::Vector3d> points;
    for (std::size_t i = 0; i < count; ++i)
      points.emplace_back(Eigen::Map<const Eigen::Vector3d>(&numbers[first + i * stride]));
    return points;
  }

  const XMLElement& root_;
  std::map<std::string, const XMLElement*> by_id_;
  std::map<const XMLElement*, std::vector<Eigen::Vector3d>> positions_;
  MeshBuilder mesh_;
  int instances_ = 0;
  std::size_t numbers_read_ = 0;
};

}  // namespace

TriangleMesh readCollada(const std::string& xml) {
  tinyxml2::XMLDocument document;
  readXml(xml, "Collada file", document);
  const XMLElement* root = document.FirstChildElement("COLLADA");
  if (root == nullptr) throw ModelError("has no <COLLADA> element");
  return ColladaReader(*root).read();
}

}  // namespace fv_robot_model
