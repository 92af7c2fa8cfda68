/// The readers of STL, OBJ and Collada: what formats allow, and files that lie.
#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <random>
#include <vector>

#include "fv_robot_model/robot_model.h"
#include "mesh_formats.h"

namespace fv_robot_model {
namespace {

std::string refusal(const std::function<void()>& read) {
  try {
    read();
  } catch (const ModelError& error) {
    return error.what();
  }
  return "nothing";
}

std::string replaced(std::string text, const std::string& old, const std::string& fresh) {
  const std::size_t at = text.find(old);
  EXPECT_NE(at, std::string::npos) << old;
  return text.replace(at, old.size(), fresh);
}

/// Twice the mesh's area vector, by corners: what triangulation must not change.
Eigen::Vector3d areaOf(const TriangleMesh& mesh) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    const Eigen::RowVector3d a = mesh.vertices.row(mesh.triangles(t, 0));
    const Eigen::RowVector3d ab = mesh.vertices.row(mesh.triangles(t, 1)) - a;
    const Eigen::RowVector3d ac = mesh.vertices.row(mesh.triangles(t, 2)) - a;
    sum += ab.transpose().cross(ac.transpose());
  }
  return sum;
}

const std::string kSquare =
    "<COLLADA><asset><unit meter='0.5'/></asset><library_geometries><geometry id='g'><mesh><source id='p'>"
    "<float_array id='a' count='12'>0 0 0 <!-- a comment --> 2 0 0 2 2 0 0 2 "
    "0</float_array><technique_common>"
    "<accessor source='#a' count='4' stride='3'/></technique_common></source>"
    "<vertices id='v'><input semantic='POSITION' source='#p'/></vertices>"
    "<triangles count='2'><input semantic='VERTEX' source='#v' offset='0'/><p>0 1 2 0 2 3</p></triangles>"
    "</mesh></geometry></library_geometries><library_visual_scenes><visual_scene id='s'><node>"
    "<translate>0 0 4</translate><instance_geometry url='#g'/></node></visual_scene></library_visual_scenes>"
    "<scene><instance_visual_scene url='#s'/></scene></COLLADA>";
const std::string kTriangles =
    "<triangles count='2'><input semantic='VERTEX' source='#v' offset='0'/><p>0 1 2 0 2 3</p></triangles>";

TEST(Collada, ReadsEveryKindOfFacesInMetresWhereItsNodesPutThem) {
  const std::string input =
      "<input semantic='VERTEX' source='#v' offset='1'/><input semantic='NORMAL' source='#n' offset='0'/>";
  const std::vector<std::string> kinds{
      kTriangles, "<polylist count='1'>" + input + "<vcount>4</vcount><p>9 0 9 1 9 2 9 3</p></polylist>",
      "<polygons count='1'>" + input + "<p>9 0 9 1 9 2 9 3</p></polygons>",
      "<trifans count='1'>" + input + "<p>9 0 9 1 9 2 9 3</p></trifans>",
      "<tristrips count='1'>" + input + "<p>9 1 9 2 9 0 9 3</p></tristrips>"};
  for (const std::string& kind : kinds) {
    const TriangleMesh mesh = readCollada(replaced(kSquare, kTriangles, kind));
    EXPECT_EQ(mesh.triangles.rows(), 2) << kind;
    EXPECT_TRUE(areaOf(mesh).isApprox(Eigen::Vector3d(0, 0, 2))) << kind << areaOf(mesh).transpose();
    EXPECT_TRUE(mesh.vertices.colwise().maxCoeff().isApprox(Eigen::RowVector3d(1, 1, 2))) << kind;
  }
}

TEST(Collada, AppliesTransformsInTheirOrderAndInstancesOfNodes) {
  const std::string node = "<translate>0 0 4</translate>";
  const TriangleMesh turned = readCollada(
      replaced(kSquare, node, "<rotate>0 0 1 90</rotate><translate>1 0 0</translate><scale>1 2 1</scale>"));
  EXPECT_NEAR(turned.vertices.col(1).minCoeff(), 0.5, 1e-9);
  EXPECT_NEAR(turned.vertices.col(0).minCoeff(), -2.0, 1e-9);
  const TriangleMesh matrix =
      readCollada(replaced(kSquare, node, "<matrix>0 -2 0 0 1 0 0 1 0 0 1 0 0 0 0 1</matrix>"));
  EXPECT_TRUE(matrix.vertices.isApprox(turned.vertices, 1e-9));
  const std::string two = replaced(kSquare, "<node>", "<node id='n'>");
  EXPECT_EQ(
      readCollada(replaced(two, "</node>", "</node><node><instance_node url='#n'/></node>")).triangles.rows(),
      4);
}

TEST(Collada, BelievesNoCountAndFollowsNoCircle) {
  const std::vector<std::array<std::string, 3>> lies{
      {"count='4'", "count='4000000000'", "there are 12"},
      {"stride='3'", "stride='999999999'", "there are 12"},
      {"stride='3'", "stride='0'", "there are 12"},
      {"stride='3'", "stride='18446744073709551615'", "there are 12"},
      {"count='4'", "count='-1'", "'-1' is no count"},
      {"offset='0'", "offset='999999999'", "offset is 999999999; valid: up to 64"},
      {"0 2 3", "0 2 4", "vertex 4 of 4"},
      {"0 2 3", "0 2 -3", "'-3' is no vertex number"},
      {"2 2 0", "2 nan 0", "not finite"},
      {"2 2 0", "2 x 0", "'x' is no coordinate"},
      {"url='#g'", "url='#s'", "'#s' is no <geometry> of this file"},
      {"url='#g'", "url='http://elsewhere'", "is no <geometry> of this file"},
      {"<translate>0 0 4", "<translate>0 4", "<translate> has 2 numbers; valid: 3"},
      {"<translate>0 0 4</translate>", "<skew>1 2</skew>", "<skew> is not read"},
      {"<node>", "<node id='n'><instance_node url='#n'/>", "or hold themselves"},
      {"<scene>", "<scenes>", "not XML"},
      {"<COLLADA>", "<!DOCTYPE x [<!ENTITY a 'b'>]><COLLADA>", "document type"}};
  for (const auto& [old, fresh, told] : lies) {
    const std::string text = replaced(kSquare, old, fresh);
    const std::string error = refusal([&] {
      if (!readCollada(text).vertices.allFinite()) throw ModelError("not finite");
    });
    EXPECT_NE(error.find(told), std::string::npos) << fresh << ": " << error;
  }
  // The counts of arrays and faces are not needed: they may say anything.
  EXPECT_EQ(readCollada(replaced(kSquare, "count='12'", "count='4000000000'")).triangles.rows(), 2);
  EXPECT_EQ(readCollada(replaced(kSquare, "<triangles count='2'", "<triangles count='4294967295'"))
                .triangles.rows(),
            2);
}

TEST(Collada, RefusesInstancesThatGrowWithoutEnd) {
  std::string library = "<library_nodes><node id='n0'><instance_geometry url='#g'/></node>";
  for (int i = 1; i < 40; ++i) {
    const std::string below = "<instance_node url='#n" + std::to_string(i - 1) + "'/>";
    library += "<node id='n" + std::to_string(i) + "'>" + below + below + "</node>";
  }
  std::string text =
      replaced(kSquare, "<library_visual_scenes>", library + "</library_nodes><library_visual_scenes>");
  text = replaced(text, "<instance_geometry url='#g'/></node></visual",
                  "<instance_node url='#n39'/></node></visual");
  EXPECT_NE(refusal([&] { readCollada(text); }).find("more than 100000"), std::string::npos);
  EXPECT_NE(refusal([&] {
              std::string nested = kSquare;
              for (int i = 0; i < 100'000; ++i) nested += "<a>";
              readCollada(nested);
            }).find("not XML"),
            std::string::npos);
}

TEST(Obj, ReadsPolygonsBackwardNumbersAndLinesThatGoOn) {
  const TriangleMesh mesh = readObj(
      "# a square\nmtllib none.mtl\nv 0 0 0 1 0 0\r\nv +1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\n"
      "f 1/1/1 2//1 \\\n3/1 -1 # to the end\n");
  EXPECT_EQ(mesh.triangles.rows(), 2);
  EXPECT_TRUE(areaOf(mesh).isApprox(Eigen::Vector3d(0, 0, 2)));
  EXPECT_EQ(readObj("v 0 0 0\nv 1 0 0\n").vertices.rows(), 2) << "bare points";
  for (const char* face :
       {"f 1 2 5", "f 0 1 2", "f -5 1 2", "f 1 2 4000000000", "f 1 2 9223372036854775808", "f a b c"})
    EXPECT_NE(refusal([&] { readObj(std::string("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n") + face); }),
              "nothing")
        << face;
  EXPECT_EQ(refusal([] { readObj("v 1 2"); }), "ends where coordinate should follow");
}

TEST(Stl, TellsBinaryFromTextBySizeAndRefusesWhatDoesNotFit) {
  std::string binary =
      "solid, but binary" + std::string(63, ' ') + std::string("\2\0\0\0", 4) + std::string(100, '\0');
  EXPECT_EQ(readStl(binary).triangles.rows(), 2);
  binary[83] = '\x7f';  // two thousand million facets
  EXPECT_NE(refusal([&] { readStl(binary); }), "nothing");
  EXPECT_EQ(readStl("solid\nendsolid").triangles.rows(), 0);
  EXPECT_NE(refusal([] {
              readStl("solid facet outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0");
            }).find("cut off"),
            std::string::npos);
  EXPECT_NE(refusal([] { readStl("solid vertex 0 0 0 endfacet"); }).find("has 1 corners"), std::string::npos);
}

TEST(Meshes, DamagedAnywhereAreReadOrRefused) {
  std::mt19937 random(7);
  const std::string obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf -1/2/3 2 3\n";
  for (int round = 0; round < 3000; ++round) {
    for (const std::string& whole : {kSquare, obj}) {
      std::string text = whole.substr(0, round % 3 == 0 ? random() % whole.size() : whole.size());
      for (unsigned k = random() % 4; k > 0 && !text.empty(); --k)
        text[random() % text.size()] = static_cast<char>(random() % 256);
      try {
        const TriangleMesh mesh = whole == obj ? readObj(text) : readCollada(text);
        const int last = mesh.triangles.size() > 0 ? mesh.triangles.maxCoeff() : -1;
        EXPECT_LT(last, mesh.vertices.rows());
      } catch (const ModelError&) {
      }
    }
  }
}

TEST(Urdf, WhatIsNotUtf8IsRefusedBeforeAParserRunsOverItsEnd) {
  const std::string right = "<robot name='r'><link name='\xC3\xA9\xE2\x82\xAC\xF0\x9F\xA4\x96'/></robot>";
  EXPECT_EQ(RobotModel::fromXml(right, "").linkNames().size(), 1U);
  for (const std::string bad :
       {"\xE5", "\xE5 x", "\xC0\x80", "\xF0\x9F\xA4", "\x80", "\xFF", "\xF8\x88\x80\x80\x80"}) {
    const std::string inside = "<robot name='r'><link name='" + bad + "'/></robot>";
    EXPECT_NE(refusal([&] { RobotModel::fromXml(inside, ""); }).find("not UTF-8: byte 28"),
              std::string::npos);
    EXPECT_NE(refusal([&] { RobotModel::fromXml("<robot name='r'><link name='a'/></robot>" + bad, ""); }),
              "nothing");
  }
}

}  // namespace
}  // namespace fv_robot_model
