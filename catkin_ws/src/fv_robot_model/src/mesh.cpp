#include "mesh.h"

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>
#include <filesystem>

#include "internal.h"

namespace fv_robot_model {
namespace {

constexpr char kFile[] = "file://";
constexpr char kPackage[] = "package://";

bool startsWith(const std::string& text, const std::string& start) { return text.rfind(start, 0) == 0; }

std::string askResolver(const std::string& uri, const MeshResolver& resolver) {
  if (!resolver)
    throw ModelError(
        text("mesh '", uri, "' needs a resolver: only file:// and absolute names are found without"));
  const std::string file = resolver(uri);
  if (file.empty()) throw ModelError(text("the resolver does not know where mesh '", uri, "' lies"));
  return file;
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

Points loadMeshVertices(const std::string& file, const Eigen::Vector3d& scale) {
  Assimp::Importer importer;
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  const aiScene* scene = importer.ReadFile(file, aiProcess_PreTransformVertices);
  if (scene == nullptr)
    throw ModelError(text("mesh '", file, "' cannot be read: ", importer.GetErrorString()));
  Eigen::Index count = 0;
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) count += scene->mMeshes[m]->mNumVertices;
  if (count == 0) throw ModelError(text("mesh '", file, "' is empty"));
  Points points(count, 3);
  Eigen::Index row = 0;
  for (unsigned m = 0; m < scene->mNumMeshes; ++m)
    for (unsigned v = 0; v < scene->mMeshes[m]->mNumVertices; ++v) {
      const aiVector3D& vertex = scene->mMeshes[m]->mVertices[v];
      points.row(row++) << vertex.x * scale.x(), vertex.y * scale.y(), vertex.z * scale.z();
    }
  return points;
}

}  // namespace fv_robot_model
