#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "fv_robot_model/robot_model.h"
#include "triangle_mesh.h"

namespace fv_robot_model {
namespace {

namespace fs = std::filesystem;

/// A folder that goes away with the test.
class MeshTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "fv_mesh_XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string write(const std::string& name, const std::string& content) const {
    std::ofstream(folder_ / name) << content;
    return (folder_ / name).string();
  }
  static RobotModel robotWith(const std::string& mesh, const MeshResolver& resolver = {}) {
    return RobotModel::fromXml("<robot name='r'><link name='a'><collision><geometry><mesh filename='" + mesh +
                                   "' scale='1 2 0.5'/></geometry></collision></link></robot>",
                               "", resolver);
  }
  static void expectError(const std::string& mesh, const std::string& part) {
    try {
      robotWith(mesh);
      ADD_FAILURE() << "no error";
    } catch (const ModelError& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  }

  fs::path folder_;
};

const char kTetrahedron[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
const char kStl[] =
    "solid t\nfacet normal 0 0 -1\nouter loop\nvertex 0 0 0\nvertex 0 1 0\nvertex 1 0 0\nendloop\nendfacet\n"
    "facet normal 0 -1 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 0 1\nendloop\nendfacet\nendsolid "
    "t\n";

TEST_F(MeshTest, becomesItsScaledHull) {
  for (const std::string& file : {write("t.obj", kTetrahedron), write("t.stl", kStl)}) {
    const RobotModel model = robotWith(file);
    const Shape& shape = model.shapes(0).front();
    EXPECT_EQ(shape.kind, Shape::Kind::Convex);
    EXPECT_EQ(shape.vertices.rows(), 4);
    EXPECT_TRUE(shape.vertices.colwise().maxCoeff().isApprox(Eigen::RowVector3d(1.0, 2.0, 0.5)));
    EXPECT_TRUE(shape.vertices.colwise().minCoeff().isZero(1e-12));
  }
}

TEST_F(MeshTest, isFoundByFileUrlAndByResolver) {
  const std::string file = write("t.obj", kTetrahedron);
  EXPECT_EQ(robotWith("file://" + file).shapes(0).size(), 1U);
  EXPECT_EQ(robotWith("package://p/t.obj", packageResolver({{"p", folder_.string()}})).shapes(0).size(), 1U);
  EXPECT_EQ(robotWith("t.obj", [&](const std::string&) { return file; }).shapes(0).size(), 1U);
  EXPECT_THROW(robotWith("t.obj", [](const std::string&) { return std::string(); }), ModelError);
}

/// The tetrahedron of kTetrahedron, (4, 3, 3) corners of its faces.
std::string binaryStl() {
  const float corners[4][9] = {{0, 0, 0, 0, 1, 0, 1, 0, 0},
                               {0, 0, 0, 1, 0, 0, 0, 0, 1},
                               {0, 0, 0, 0, 0, 1, 0, 1, 0},
                               {1, 0, 0, 0, 1, 0, 0, 0, 1}};
  std::string bytes = "solid but not text";  // as some programs begin binary files
  bytes.resize(80, ' ');
  bytes += std::string("\4\0\0\0", 4);
  for (const auto& face : corners) {
    bytes += std::string(12, '\0');
    bytes.append(reinterpret_cast<const char*>(face), sizeof(face));
    bytes += std::string(2, '\0');
  }
  return bytes;
}

/// The same in millimetres with y up: the unit counts, the up axis does not.
std::string collada() {
  return R"(<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="millimeter" meter="0.001"/><up_axis>Y_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh><source id="p"><float_array id="a" count="12">0 0 0 1000 0 0 0 1000 0 0 0 1000
</float_array><technique_common><accessor source="#a" count="4" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/><p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles></mesh>
</geometry></library_geometries><library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"/></node>
</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>)";
}

TEST_F(MeshTest, isTheSameFromEveryFormat) {
  const Shape expected = robotWith(write("t.obj", kTetrahedron)).shapes(0).front();
  for (const std::string& file :
       {write("text.stl", kStl), write("binary.stl", binaryStl()), write("t.dae", collada())}) {
    const Shape shape = robotWith(file).shapes(0).front();
    EXPECT_TRUE(boundingBox(shape).isApprox(boundingBox(expected), 1e-6)) << file;
    EXPECT_EQ(shape.vertices.rows(), 4) << file;
    EXPECT_EQ(loadMesh(file).triangles.rows(), file.find("text") == std::string::npos ? 4 : 2) << file;
  }
}

TEST_F(MeshTest, mirroredByItsScaleStaysRightSideOut) {
  const TriangleMesh mesh = loadMesh(write("t.obj", kTetrahedron), {-1.0, 1.0, 1.0});
  double volume = 0.0;  // by the divergence theorem: negative for a mesh that is inside out
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    const auto corner = [&](int k) -> Eigen::Vector3d {
      return mesh.vertices.row(mesh.triangles(t, k)).transpose();
    };
    volume += corner(0).dot(corner(1).cross(corner(2))) / 6.0;
  }
  EXPECT_NEAR(volume, 1.0 / 6.0, 1e-9);
  EXPECT_NEAR(mesh.vertices.col(0).minCoeff(), -1.0, 1e-9);
}

TEST_F(MeshTest, thatCannotBeUsedIsNamed) {
  EXPECT_THROW(loadMesh(write("t.obj", kTetrahedron), {1.0, 0.0, 1.0}), ModelError);
  expectError(write("mm.obj", "v 0 0 0\nv 90 0 0\nv 0 9 0\nv 0 0 9\nf 1 3 2\nf 1 2 4\n"), "millimetres");
  expectError(write("broken.stl", "this is no mesh"), "broken.stl");
  expectError(write("empty.obj", ""), "empty.obj");
  expectError(write("flat.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 3 4\n"), "link 'a'");
  expectError((folder_ / "absent.obj").string(), "absent.obj");
  expectError(folder_.string(), "missing");
}

}  // namespace
}  // namespace fv_robot_model
