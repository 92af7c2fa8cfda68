#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "fv_robot_model/robot_model.h"

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

TEST_F(MeshTest, thatCannotBeUsedIsNamed) {
  expectError(write("broken.stl", "this is no mesh"), "broken.stl");
  expectError(write("empty.obj", ""), "empty.obj");
  expectError(write("flat.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 3 4\n"), "link 'a'");
  expectError((folder_ / "absent.obj").string(), "absent.obj");
  expectError(folder_.string(), "missing");
}

}  // namespace
}  // namespace fv_robot_model
