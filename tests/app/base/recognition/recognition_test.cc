#include "app/base/recognition/recognition.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <set>

#include "app/base/recognition/kinds.h"
#include "app/base/text/json_text.h"

namespace plumbline::recognition_test {

using namespace plumbline::recognition;

namespace {

const Fact* Find(const std::vector<Fact>& facts, std::string_view what) {
  const auto found = std::ranges::find(facts, what, &Fact::what);
  return found == facts.end() ? nullptr : &*found;
}

std::string Value(const Recognition& found, std::string_view what) {
  const Fact* const fact = Find(found.facts, what);
  return fact == nullptr ? "" : fact->value;
}

/// camera_info of ROS with the given distortion.
std::string CameraInfo(const std::string& model, const std::string& terms, int cols,
                       const std::string& skew = "0") {
  return "image_width: 640\nimage_height: 480\ncamera_matrix:\n  rows: 3\n  cols: 3\n"
         "  data: [500, " +
         skew + ", 320, 0, 500, 240, 0, 0, 1]\ndistortion_model: " + model +
         "\ndistortion_coefficients:\n  rows: 1\n  cols: " + std::to_string(cols) + "\n  data: [" +
         terms + "]\n";
}

}  // namespace

TEST_CASE("a lens file of ROS: size, model and terms with their lines") {
  const auto found = Recognise(CameraInfo("plumb_bob", "-0.1, 0.01, 0, 0, 0", 5), "ost.yaml");
  CHECK(found.kind == "ros-camera-info");
  CHECK(found.content == Content::kLens);
  CHECK(found.certainty == Certainty::kShown);
  CHECK(found.evidence.line == 7);
  CHECK(Value(found, "image size") == "640 x 480 px");
  CHECK(Value(found, "distortion") == "5: -0.1, 0.01, 0, 0, 0");
  REQUIRE(Find(found.facts, "distortion") != nullptr);
  CHECK(Find(found.facts, "distortion")->line == 11);
  CHECK(found.contradictions.empty());
  CHECK(found.command == "plumbline track --image IMAGE --intrinsics ost.yaml --tag-size-mm SIZE");
}

TEST_CASE("what contradicts itself in a lens file is named with its line") {
  const auto first = [](const std::string& text) {
    const auto found = Recognise(text, "ost.yaml");
    REQUIRE_FALSE(found.contradictions.empty());
    const Fact& fact = found.contradictions.front();
    return std::to_string(fact.line) + " " + fact.what + ": " + fact.value;
  };
  CHECK(first(CameraInfo("plumb_bob", "-0.1, 0.01, 0, 0, 0, 0.1, 0, 0", 8)) ==
        "11 distortion: 8 terms, but plumb_bob (line 7) has 4 or 5; one of the two is wrong");
  CHECK(first(CameraInfo("plumb_bob", "-0.1, 0.01, 0, 0, 0", 8)) ==
        "11 distortion_coefficients: 1 rows x 8 cols (line 10), but data has 5 numbers");
  CHECK(first(CameraInfo("plumb_bob", "-0.1, 0.01, 0, 0, 0", 5, "2.5")) ==
        "6 skew: 2.5 px; the lens models of OpenCV, ROS and Plumbline have none");
  CHECK(
      first(CameraInfo("plumb_bob", "-0.1, 0.01, 0, 0, 0", 5) + "binning_x: 2\n").find("binning") !=
      std::string::npos);
}

TEST_CASE("a polynomial that folds before the corner, of both models") {
  // k1 alone folds at r = 1 / sqrt(-3 k1), which is imaged at 2/3 of it: 385 px for k1 = -0.25.
  const auto folds = [](const std::string& model, const std::string& terms, int count) {
    const auto found = Recognise(CameraInfo(model, terms, count), "ost.yaml");
    const Fact* const fact = Find(found.contradictions, "distortion");
    return fact == nullptr ? std::string() : fact->value;
  };
  CHECK(folds("plumb_bob", "-0.25, 0, 0, 0, 0", 5).find("folds back 385 px") == 0);
  CHECK(folds("plumb_bob", "-0.2, 0, 0, 0, 0", 5).empty());  // at 430 px, the corner at 400
  // theta (1 + k1 theta^2) turns at theta = 1 / sqrt(-3 k1) = 0.745.
  CHECK(folds("equidistant", "-0.6, 0, 0, 0", 4).find("folds back 248 px") == 0);
  CHECK(folds("equidistant", "-0.05, 0, 0, 0", 4).empty());
  // Beyond 90 deg, where f = 150 px leaves the corner at 400 px: at 1.69 rad, 169 px.
  std::string wide = CameraInfo("equidistant", "-0.1167, 0, 0, 0", 4);
  for (auto at = wide.find("500"); at != std::string::npos; at = wide.find("500")) {
    wide.replace(at, 3, "150");
  }
  const auto beyond = Recognise(wide, "ost.yaml");
  REQUIRE(Find(beyond.contradictions, "distortion") != nullptr);
  CHECK(Find(beyond.contradictions, "distortion")->value.find("folds back 169 px") == 0);
}

TEST_CASE("the kind is shown by the content, whatever the name") {
  const auto kind = [](std::string_view bytes, std::string_view name = "file.txt") {
    return Recognise(bytes, name).kind;
  };
  CHECK(
      kind("%YAML:1.0\n---\nimage_width: 4\nimage_height: 3\ncamera_matrix: !!opencv-matrix\n"
           "   rows: 3\n   cols: 3\n   dt: d\n   data: [ 5., 0., 2., 0., 5., 1., 0., 0., 1. ]\n") ==
      "opencv-lens");
  CHECK(kind("header:\n  seq: 1\nheight: 480\nwidth: 640\ndistortion_model: plumb_bob\n"
             "D: [0, 0, 0, 0, 0]\nK: [5, 0, 2, 0, 5, 1, 0, 0, 1]\n") == "ros-camera-info-echo");
  CHECK(kind("cam0:\n  camera_model: pinhole\n  intrinsics: [5, 5, 2, 1]\n") == "kalibr-camchain");
  CHECK(kind("# mrcal\n{\n 'lensmodel': 'LENSMODEL_OPENCV8',\n 'intrinsics': [ 1, 2 ] }\n") ==
        "mrcal-cameramodel");
  CHECK(kind("# Camera list\n1 PINHOLE 640 480 500 500 320 240\n") == "colmap-cameras");
  CHECK(kind("<robot name='a'><link name='b'/></robot>") == "urdf");
  CHECK(kind("<robot><xacro:property name='a' value='1'/></robot>") == "xacro");
  CHECK(kind("<sdf version='1.7'><model/></sdf>") == "sdf");
  CHECK(kind("<mujoco model='a'/>") == "mjcf");
  CHECK(kind("kinematics:\n  shoulder:\n    x: 0\n") == "ur-kinematics");
  CHECK(kind("kinematics:\n  joint1:\n    x: 0\n") == "joint-frames");
  CHECK(kind("a,alpha,d,theta\n0,90,0.1,0\n0.4,0,0,0\n") == "dh-table");
  CHECK(kind("q1_deg,q2_deg,x_mm,y_mm,z_mm\n1,2,3,4,5\n") == "measured");
  CHECK(kind("image,x_mm,y_mm,z_mm,qw,qx,qy,qz\na.png,1,2,3,1,0,0,0\n") == "robot-poses");
  CHECK(kind("timestamp actual_q_0 actual_q_1\n1 2 3\n2 3 4\n") == "rtde");
  CHECK(kind("%time,field.position0,field.position1\n1,2,3\n2,3,4\n") == "ros-csv");
  CHECK(kind("#VRML V2.0 utf8\nShape { }\n", "a.wrl") == "vrml97");
  CHECK(kind("#VRML V1.0 ascii\nSeparator { }\n", "a.wrl") == "vrml1");
  CHECK(kind("#Inventor V2.1 ascii\nSeparator { }\n", "a.wrl") == "open-inventor");
  CHECK(kind("ISO-10303-21;\nHEADER;\n", "a.dat") == "step");
  CHECK(kind("&ACCESS RVP\nDEFDAT A PUBLIC\nENDDAT\n", "a.dat") == "krl-program");
  CHECK(kind("MODULE A\n PROC main()\n ENDPROC\nENDMODULE\n") == "rapid-program");
  CHECK(kind("/PROG A\n/ATTR\n/MN\n/POS\n/END\n") == "fanuc-program");
  CHECK(kind("/JOB\n//NAME A\n//POS\n") == "yaskawa-job");
  CHECK(kind("def a():\n  movel(p[0,0,0,0,0,0])\nend\n") == "urscript");
  CHECK(kind("target_type: 'aprilgrid'\ntagCols: 6\n") == "kalibr-target");
  CHECK(kind("cell = \"cells/ur10.toml\"\n[robot]\nhost = \"192.168.0.2\"\n") == "configuration");
  CHECK(kind("[robot]\nconvention = \"dh\"\n") == "cell");
  CHECK(kind("[[body]]\nname = \"a\"\n") == "tags");
  CHECK(kind(std::string("PK\x03\x04", 4) + "....xl/workbook.xml") == "xlsx");
  CHECK(kind("\x1F\x8B\x08") == "gzip");
  CHECK(kind("%PDF-1.4\n%%EOF\n") == "pdf");
  CHECK(kind("") == "empty");
  CHECK(kind(" \n\n") == "empty");
}

TEST_CASE("targets of programs: positions and joints are counted apart") {
  const auto counts = [](const std::string& text) {
    const auto found = Recognise(text, "program");
    return Value(found, "cartesian targets") + "/" + Value(found, "joint targets");
  };
  CHECK(counts("&ACCESS RVP\nDEFDAT W\nDECL E6POS XP1={X 1,Y 2,Z 3,A 0,B 90,C 0}\n"
               "DECL E6AXIS XP2={A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}\n"
               "DECL LOAD L1={M 5,CM {X 0,Y 0,Z 9},J {X 0,Y 0,Z 0}}\nENDDAT\n") == "1/1");
  CHECK(counts("DEF w( )\n$BASE={X 1,Y 2,Z 3,A 0,B 0,C 0}\n;PTP {X 5}\nPTP {A1 0,A2 -90}\n"
               "LIN {E6POS: X 1,Y 2}\nEND\n") == "1/1");
  CHECK(
      counts("MODULE M\n CONST robtarget p{2}:=[[[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,"
             "9E9]],\n  [[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]];\n"
             " CONST jointtarget j:=[[0,1,2,3,4,5],[9E9,9E9,9E9,9E9,9E9,9E9]]; ! [[0,1,2,3,4,5],\n"
             " PERS tooldata t:=[TRUE,[[0,0,9],[1,0,0,0]],[5,[0,0,6],[1,0,0,0],0,0,0]];\n"
             " PROC go(robtarget q)\n MoveL q,v100,fine,t;\n ENDPROC\nENDMODULE\n") == "2/1");
  CHECK(counts("def a():\n  set_tcp(p[0,0,0.1,0,0,0])\n  movej([0,-1,1,0,1,0], a=1)\n"
               "  movel(pose_trans(f, p[0,0,0,0,0,0]))\n  q = [0,-1,1,0,1,0]\n"
               "  force_mode(p[0,0,0,0,0,0], [0,0,1,0,0,0], [0,0,9,0,0,0], 2, [1,1,1,1,1,1])\n"
               "end\n") == "1/2");
  CHECK(counts("/PROG A\n/ATTR\n/MN\n 1:J P[1] 100% FINE ;\n/POS\nP[1]{\n GP1:\n J1= 0 deg,J2= 1 "
               "deg\n};\nP[2:\"a\"]{\n GP1:\n X = 1 mm,Y = 2 mm\n};\n/END\n") == "1/1");
}

TEST_CASE("names of points are no image and no G-code") {
  CHECK(Recognise("P1 100 200 300\nP2 101 200 300\n", "p.txt").content == Content::kTable);
  CHECK(Recognise("P1 100.5 200.0 300.0\n", "p.txt").content != Content::kImage);
  CHECK(Recognise("G1 1.5 2.5 3.5\nG2 1.5 2.5 3.5\nG3 2.5 3.5 4.5\n", "p.txt").content ==
        Content::kTable);
  CHECK(Recognise("P2\n4 3\n255\n1 2 3\n", "a.pgm").content == Content::kImage);
}

TEST_CASE("numbers without names leave their meaning open") {
  const auto six = Recognise("1,2,3,4,5,6\n2,3,4,5,6,7\n", "a.csv");
  CHECK(six.certainty == Certainty::kUndecided);
  CHECK(six.candidates.size() == 2);
  CHECK_FALSE(six.undecided.empty());
  CHECK(Recognise("a,b\n1,234\n5,678\n", "a.csv").undecided.size() <= 1);
}

TEST_CASE("units that no name states are named as not stated") {
  const auto open = [](const std::string& text) {
    std::string all;
    for (const std::string& one : Recognise(text, "a.csv").undecided) {
      if (one.starts_with("the units of ")) all += one.substr(13, one.find(':') - 13);
    }
    return all;
  };
  CHECK(open("Punkt;X;Y;Z\nP1;1,234;-0,300;0,800\nP2;1,235;-0,301;0,801\n") == "X, Y, Z");
  CHECK(open("q1,q2,q3\n0.1,-1.5,1.5\n0.2,-1.4,1.5\n") == "q1, q2, q3");
  CHECK(open("n x y\n1 0.5 2\n2 1.5 2\n") == "x, y");
  CHECK(open("No,X [mm],Y [mm],t\n1,2.5,3.5,7\n2,3.5,4.5,9\n") == "t");
  CHECK(open("i,a_i,alpha_i,d_i,theta_i\n1,0,1.5708,0.1,0\n2,1,0,0,0\n") ==
        "a_i, alpha_i, d_i, theta_i");
  CHECK(open("Joint  a[mm]  alpha[deg]  d[mm]  theta[deg]\n1 75 -90 0 0\n2 840 0 0 0\n").empty());
}

TEST_CASE("tables that contradict themselves") {
  const auto first = [](const std::string& text) {
    const auto found = Recognise(text, "a.csv");
    return found.contradictions.empty()
               ? std::string()
               : found.contradictions.front().what + ": " + found.contradictions.front().value;
  };
  CHECK(first("Joint  a[mm]  alpha[deg]  d[mm]  theta[deg]\n1 75 -1.5708 0 0\n2 840 0 0 0\n")
            .find("units: the angles are named as deg, but look like rad: -1.5708") == 0);
  CHECK(first("q1_deg,q2_deg\n0,-1.57\n0.1,1.2\n").find("look like rad") != std::string::npos);
  CHECK(first("q1_deg,q2_deg\n0,-1.57\n0.1,12.5\n").empty());
  CHECK(first("q1_deg,q2_deg,x_mm,y_mm,z_mm\n0,5,1.2,0.1,0.8\n9,5,1.1,0.2,0.8\n")
            .find("look like m") != std::string::npos);
  CHECK(first("q1_deg,x_mm,y_mm\n0,1000,2000\n") ==
        "columns: only x_mm, y_mm of x_mm, y_mm, z_mm: a point has all three");
  CHECK(
      first("image,x_mm,y_mm,z_mm,qw,qx,qy,qz\na.png,1,2,3,0.5,0.5,0.5,0.9\n") ==
      "rotation: the quaternion 0.5, 0.5, 0.5, 0.9 has the length 1.25, not 1: it is no rotation");
  CHECK(first("Name,X,Y,Z\nP1,1,234,-0,300,0,800\nP2,1,235,-0,301,0,801\n")
            .find("columns: 4 names, but 7 fields in line 2: commas separate") == 0);
}

TEST_CASE("faces, rotations and names that the content contradicts") {
  const auto first = [](const std::string& text, const char* name) {
    const auto found = Recognise(text, name);
    return found.contradictions.empty() ? std::string()
                                        : std::to_string(found.contradictions.front().line) + " " +
                                              found.contradictions.front().value;
  };
  const std::string obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1 2//4 -3\n";
  CHECK(first(obj, "a.obj").empty());
  CHECK(first(obj + "f 1 2 9\n", "a.obj") == "5 vertex 9 does not exist: the file has 3");
  CHECK(first(obj + "f 1 2 0/1\n", "a.obj") == "5 vertex 0 does not exist: the file has 3");
  const auto rapid = [](const std::string& rotation) {
    return "MODULE M\n CONST robtarget p:=[[1,2,3],[" + rotation +
           "],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\nENDMODULE\n";
  };
  CHECK(first(rapid("0.5,0.5,-0.5,0.5"), "a.mod").empty());
  CHECK(first(rapid("0.9,0.5,0.5,0.5"), "a.mod") ==
        "2 the quaternion 0.9, 0.5, 0.5, 0.5 has the length 1.25, not 1: it is no rotation");
  CHECK(first("", "a.yaml") == "0 there is none, though the name ends in .yaml");
}

TEST_CASE("a name alone is said to be only a name") {
  const auto found = Recognise("nothing of the kind", "arm.urdf");
  CHECK(found.certainty == Certainty::kName);
  CHECK(found.content == Content::kUnknown);
  CHECK(TextOf(found).find("perhaps a description of a robot (URDF)") != std::string::npos);
  CHECK(Recognise("nothing of the kind", "notes").certainty == Certainty::kUnknown);
}

TEST_CASE("two files in one, and files that are cut") {
  const auto contradicts = [](const std::string& text, std::string_view name) {
    return !Recognise(text, name).contradictions.empty();
  };
  const std::string urdf = "<robot name='a'><link name='b'/></robot>\n";
  CHECK_FALSE(contradicts(urdf, "a.urdf"));
  CHECK(contradicts(urdf + urdf, "a.urdf"));
  CHECK(contradicts("<robot name='a'><link name='b'/>", "a.urdf"));
  const std::string table = "q1_deg,x_mm,y_mm,z_mm\n1,2,3,4\n";
  CHECK(contradicts(table + table, "a.csv"));
  CHECK(contradicts("{\"schema\": 1, \"verdict\": \"unknown\", \"effects\": []} {}", "a.json"));
  const std::string info = CameraInfo("plumb_bob", "0, 0, 0, 0, 0", 5);
  CHECK(contradicts(info + info, "a.yaml"));
  CHECK(contradicts("a,b,c\n1,2,3\n4,5,6\n7\n", "a.csv"));
}

TEST_CASE("other encodings: import decodes UTF-16, other readers do not") {
  const auto wide = [](std::string_view text) {
    std::string bytes = "\xFF\xFE";
    for (const char c : text) bytes += {c, '\0'};
    return bytes;
  };
  const auto table = Recognise(wide("x;y;z\n1;2;3\n"), "a.csv");
  CHECK(table.content == Content::kTable);
  CHECK_FALSE(table.command.empty());
  const auto urdf = Recognise(wide("<robot><link name='a'/></robot>"), "my arm.urdf");
  CHECK(urdf.kind == "urdf");
  CHECK(urdf.command.empty());
  CHECK(urdf.conversion.find("iconv -f UTF-16 -t UTF-8 'my arm.urdf'") != std::string::npos);
  CHECK(Recognise(wide("plain text").substr(2), "a").kind == "bare-utf16");
}

TEST_CASE("JSON holds what the text says") {
  const auto json = text::JsonOrNull(
      JsonOf({Recognise("a b\n", "a\x1B.txt"), Recognise("#VRML V1.0 ascii\n{", "b.stl")}));
  REQUIRE(json["files"].size() == 2);
  CHECK(json["files"][0]["certainty"] == "unknown");
  CHECK(json["files"][1]["kind"] == "vrml1");
  CHECK(json["files"][1]["line"] == 1);
  CHECK(json["files"][1]["contradictions"].size() == 2);  // the ending, and the open brace
  CHECK(TextOf(Recognise("", "a\x1B.txt")).find('\x1B') == std::string::npos);
}

TEST_CASE("every kind is complete") {
  std::set<std::string_view> ids;
  for (const Kind& kind : AllKinds()) {
    INFO(kind.id);
    CHECK((ids.insert(kind.id).second || kind.id == "configuration"));
    CHECK_FALSE(kind.name.empty());
    CHECK(kind.content != Content::kUnknown);
    CHECK((!kind.command.empty() || !kind.conversion.empty()));
    CHECK((kind.command.empty() || kind.command.starts_with("plumbline ")));
  }
  CHECK(ids.size() > 70);
}

TEST_CASE("files of other programs are not taken for those that they resemble") {
  const auto kind = [](const std::string& text, const char* name) {
    return Recognise(text, name).kind;
  };
  CHECK(kind("{\"camera\": {\"fov\": 50}, \"setup\": {\"engine\": \"cycles\"}}", "a.json") ==
        "unknown");
  CHECK(kind("{\"verdict\": \"guilty\", \"effects\": [\"a\"]}", "a.json") == "unknown");
  CHECK(kind("{\"applied\": true, \"proposed\": [], \"history\": [1]}", "a.json") == "unknown");
  CHECK(kind("[body]\nmargin = 0\n[object]\nfit = \"cover\"\n", "a.toml") == "unknown");
  CHECK(kind("[read]\ntopic = \"x\"\nurl = \"y\"\n", "a.toml") == "unknown");
  CHECK(kind("[tool]\nmodel = \"z\"\n", "pyproject.toml") == "unknown");
  CHECK(kind("cell = \"A1\"\nvalue = 3\n", "a.toml") == "unknown");
  CHECK(kind("kinematics:\n  shoulder:\n    x: shoulder pain\n", "a.yaml") == "unknown");
  CHECK(kind("# Notes\n\nRun `movej([0, 0, 0])`.\n", "a.md") == "unknown");
  CHECK(kind("import rtde\n# movej([0, 0])\nc.moveJ([0, 0])\n", "a.py") == "unknown");
  CHECK(kind("def go():\n  # PTP HOME\n  set_tcp(p[0,0,0.1,0,0,0])\nend\n", "a.script") ==
        "urscript");
  CHECK(kind("BZhello everybody, this is text\n", "a.txt") == "unknown");
  CHECK(kind("the ftyp here\n", "a.txt") == "unknown");
  CHECK(kind("v 1 2 3\nv 4 5 6\nv 7 8 9\n", "points.txt") == "bare-table");
  CHECK(kind("module example.com/foo\n\ngo 1.21\n", "go.mod") == "unknown");
  CHECK(kind("image_width: 640\rimage_height: 480\r", "a.yaml") == "old-line-ends");
  CHECK(
      kind(
          "[image]\nwidth\n640\n[left]\ncamera matrix\n1 0 0\n0 1 0\n0 0 1\ndistortion\n0 0 0 0 0\n"
          "projection\n1 0 0 0\n0 1 0 0\n0 0 1 0\n",
          "left.ini") == "ros-ini-lens");
  // References to other files are nodes, not names or comments.
  for (const Fact& fact :
       Recognise("#VRML V2.0 utf8\nDEF InlineFour Shape { }  # Inline { }\n", "a.wrl")
           .contradictions) {
    CHECK(fact.what != "other files");
  }
}

}  // namespace plumbline::recognition_test
