#include "mesh.h"

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>
#include <filesystem>
#include <vector>

#include "fv_robot_model/triangle_mesh.h"
#include "internal.h"

namespace fv_robot_model {
namespace {

constexpr char kFile[] = "file://";
constexpr char kPackage[] = "package://";
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

Points verticesOf(const aiScene& scene, const Eigen::Vector3d& scale) {
  Eigen::Index count = 0;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) count += scene.mMeshes[m]->mNumVertices;
  Points points(count, 3);
  Eigen::Index row = 0;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m)
    for (unsigned v = 0; v < scene.mMeshes[m]->mNumVertices; ++v) {
      const aiVector3D& vertex = scene.mMeshes[m]->mVertices[v];
      points.row(row++) << vertex.x * scale.x(), vertex.y * scale.y(), vertex.z * scale.z();
    }
  return points;
}

/// Faces as rows of verticesOf, faces with more corners as fans; points and lines are none.
TriangleMesh::Triangles trianglesOf(const aiScene& scene) {
  std::vector<Eigen::RowVector3i> rows;
  int first = 0;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[m];
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      const auto corner = [&](unsigned k) { return first + static_cast<int>(face.mIndices[k]); };
      for (unsigned k = 2; k < face.mNumIndices; ++k) rows.emplace_back(corner(0), corner(k - 1), corner(k));
    }
    first += static_cast<int>(mesh.mNumVertices);
  }
  TriangleMesh::Triangles triangles(static_cast<Eigen::Index>(rows.size()), 3);
  for (std::size_t i = 0; i < rows.size(); ++i) triangles.row(static_cast<Eigen::Index>(i)) = rows[i];
  return triangles;
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
  Assimp::Importer importer;
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  const aiScene* scene = importer.ReadFile(file, aiProcess_PreTransformVertices);
  if (scene == nullptr)
    throw ModelError(text("mesh '", file, "' cannot be read: ", importer.GetErrorString()));
  TriangleMesh mesh{verticesOf(*scene, scale), trianglesOf(*scene)};
  if (mesh.vertices.rows() == 0) throw ModelError(text("mesh '", file, "' is empty"));
  if (!mesh.vertices.allFinite()) throw ModelError(text("mesh '", file, "' has corners that are not finite"));
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
