#include "mesh.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "internal.h"
#include "mesh_formats.h"
#include "triangle_mesh.h"

namespace fv_robot_model {
namespace {

constexpr char kFile[] = "file://";
constexpr char kPackage[] = "package://";
constexpr std::uintmax_t kMostBytes = std::uintmax_t{1} << 29;
constexpr double kLargestLink = 20.0;  // [m] longer ones are taken for millimetres

bool startsWith(const std::string& text, const std::string& start) { return text.rfind(start, 0) == 0; }

std::string askResolver(const std::string& uri, const MeshResolver& resolver) {
  if (!resolver)
    throw ModelError(
        text("mesh '", uri, "' needs a resolver: only file:// and absolute names are found without"));
  const std::string file = resolver(uri);
  if (file.empty()) throw ModelError(text("the resolver does not know where mesh '", uri, "' lies"));
  return file;
}

/// The whole content. @throws ModelError without the file's name, as readMesh.
std::string contentOf(const std::string& file) {
  std::error_code problem;
  const std::uintmax_t bytes = std::filesystem::file_size(file, problem);  // none for folders and pipes
  if (!problem && bytes > kMostBytes)
    throw ModelError(text("it has ", bytes, " bytes; valid: at most ", kMostBytes));
  std::ifstream stream(file, std::ios::binary);
  if (problem || !stream) throw ModelError("there is no such file, or it may not be read");
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

TriangleMesh readMesh(const std::string& file) {
  std::string ending = std::filesystem::path(file).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  if (ending == ".stl") return readStl(contentOf(file));
  if (ending == ".obj") return readObj(contentOf(file));
  if (ending == ".dae") return readCollada(contentOf(file));
  throw ModelError(text("'", ending, "' is no ending of a mesh; valid: .stl, .obj, .dae"));
}

/// What the reader did not know: which file it was.
TriangleMesh readNamed(const std::string& file) {
  try {
    return readMesh(file);
  } catch (const ModelError& error) {
    throw ModelError(text("mesh '", file, "' cannot be read: ", error.what()));
  }
}

}  // namespace

MeshResolver packageResolver(std::map<std::string, std::string> folders) {
  return [folders = std::move(folders)](const std::string& uri) -> std::string {
    if (!startsWith(uri, kPackage)) return {};
    const std::string rest = uri.substr(sizeof(kPackage) - 1);
    const std::string package = rest.substr(0, rest.find('/'));
    const auto found = folders.find(package);
    if (found == folders.end()) throw UnknownNameError("package", package, keysOf(folders));
    return found->second + rest.substr(package.size());
  };
}

std::string resolveMesh(const std::string& uri, const MeshResolver& resolver) {
  std::string file = uri;
  if (startsWith(uri, kFile)) {
    file = uri.substr(sizeof(kFile) - 1);
  } else if (!startsWith(uri, "/")) {
    file = askResolver(uri, resolver);
  }
  if (!std::filesystem::is_regular_file(file))
    throw ModelError(text("mesh '", uri, "' is missing: no file '", file, "'"));
  return file;
}

TriangleMesh loadMesh(const std::string& file, const Eigen::Vector3d& scale) {
  if (!scale.allFinite() || (scale.array() == 0.0).any())
    throw ModelError(
        text("mesh '", file, "': scale is ", scale.transpose(), "; valid: numbers other than 0"));
  TriangleMesh mesh = readNamed(file);
  if (mesh.vertices.rows() == 0) throw ModelError(text("mesh '", file, "' is empty"));
  if (!mesh.vertices.allFinite()) throw ModelError(text("mesh '", file, "' has corners that are not finite"));
  mesh.vertices *= scale.asDiagonal();
  if (scale.prod() < 0.0) mesh.triangles.col(1).swap(mesh.triangles.col(2));  // mirrored: turned inside out
  return mesh;
}

Shape meshHull(const std::string& file, const Eigen::Vector3d& scale, const Eigen::Isometry3d& T_link_shape) {
  const Points vertices = loadMesh(file, scale).vertices;
  const double extent = (vertices.colwise().maxCoeff() - vertices.colwise().minCoeff()).maxCoeff();
  if (extent > kLargestLink)
    throw ModelError(text("mesh '", file, "' is ", extent, " m long; at most ", kLargestLink,
                          " m: if it is in millimetres, say scale=\"0.001 0.001 0.001\""));
  try {
    return Shape::convexHull(vertices, T_link_shape);
  } catch (const std::invalid_argument& error) {
    throw ModelError(text("mesh '", file, "': ", error.what()));
  }
}

}  // namespace fv_robot_model
