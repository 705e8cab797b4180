// plumbline calibrate-hand-eye on rendered images and on faulty input.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <random>
#include <sstream>

#include "app/base/text/json_text.h"
#include "app/cli/commands.h"
#include "tests/app/cli/board_sheet.h"
#include "tests/app/cli/run_command.h"
#include "tests/app/temporary_folder.h"
#include "tests/renderer/pgm.h"

namespace plumbline::calibrate_hand_eye_command_test {

using namespace plumbline::cli;
using test::Answer;
using test::RunCommand;

namespace {

Eigen::Isometry3d Placed(const Eigen::Vector3d& turn, const Eigen::Vector3d& place) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  X.translation() = place;
  return X;
}

/// A board of 9 x 6 corners 20 mm apart on the flange, before a camera in the cell. The board looks
/// the same when it is turned by half a turn.
struct Files {
  test::TemporaryFolder folder;
  Eigen::Isometry3d X_BC = Placed({0.3, 2, -0.2}, {0.9, -0.4, 1.2});
  Eigen::Isometry3d X_FK = Placed({0.2, -0.1, 0.4}, {0.05, -0.03, 0.12});
  std::string header = "image,x_mm,y_mm,z_mm,qw,qx,qy,qz\n";
  std::vector<std::string> rows;

  Files() {
    const renderer::Camera camera = renderer::Pinhole(800, 600, 1000);
    std::filesystem::create_directory(Path("frames"));
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> draw(-1, 1);
    for (int k = 0; k < 12; ++k) {
      renderer::Sheet sheet = test::BoardSheet();
      sheet.X_CK = Placed({0.5 * draw(random), 0.5 * draw(random), 2.5 * draw(random)}, {0, 0, 0});
      sheet.X_CK.translation() =
          Eigen::Vector3d(0.05 * draw(random), 0.03 * draw(random), 0.5 + 0.05 * draw(random)) -
          sheet.X_CK.linear() * Eigen::Vector3d(0.08, 0.05, 0);
      const auto shot = renderer::Render(camera, {sheet}, {}, 100 + static_cast<std::uint64_t>(k));
      const std::string name = "shot" + std::to_string(k) + ".pgm";
      renderer::WritePgm(Path("frames/" + name), shot);
      const Eigen::Isometry3d X_BF = X_BC * sheet.X_CK * X_FK.inverse();
      const Eigen::Quaterniond q(X_BF.linear());
      const Eigen::Vector3d p = 1e3 * X_BF.translation();
      std::ostringstream row;
      row << std::setprecision(10) << name << ',' << p.x() << ',' << p.y() << ',' << p.z() << ','
          << q.w() << ',' << q.x() << ',' << q.y() << ',' << q.z() << '\n';
      rows.push_back(row.str());
    }
    Write(Path("lens.json"),
          text::JsonText(nlohmann::json{{"schema", 1},
                                        {"accepted", true},
                                        {"image_size", {800, 600}},
                                        {"fx", 1000.0},
                                        {"fy", 1000.0},
                                        {"cx", 399.5},
                                        {"cy", 299.5},
                                        {"distortion", {0.0, 0.0, 0.0, 0.0, 0.0}}}));
  }
  std::string Path(const std::string& name) const { return folder.path() + "/" + name; }
  static void Write(const std::string& path, const std::string& text) {
    std::ofstream(path, std::ios::binary) << text;
  }
  Answer Calibrate(const std::string& more, const std::string& board = "9x6") const {
    std::string text = header;
    for (const std::string& row : rows) text += row;
    Write(Path("poses.csv"), text);
    return RunCommand(AddCalibrateHandEyeCommand,
                      "calibrate-hand-eye --images " + Path("frames") + " --poses " +
                          Path("poses.csv") + " --intrinsics " + Path("lens.json") + " --board " +
                          board + " --square-mm 20 " + more);
  }
};

}  // namespace

TEST_CASE("A camera in the cell is calibrated from rendered images; wrong pairs are named") {
  Files files;
  // Image 4 gets the place of image 9; image 7 has no row; one row has no image.
  const auto fields = [](const std::string& row) { return row.substr(row.find(',')); };
  files.rows[4] = "shot4.pgm" + fields(files.rows[9]);
  files.rows[7] = "gone.pgm" + fields(files.rows[7]);
  const Answer answer = files.Calibrate("--json - --quiet");
  INFO(answer.err);
  REQUIRE(answer.exit_code == 0);
  const auto json = text::JsonOrNull(answer.out);
  CAPTURE(text::JsonText(json, 1));
  CHECK(json["accepted"] == true);
  CHECK(json["setup"] == "eye-to-hand");
  CHECK(json["camera"]["in"] == "base");
  CHECK(json["target"]["in"] == "flange");
  for (int axis = 0; axis < 3; ++axis) {
    const double sd = std::sqrt(json["camera"]["covariance"]["matrix"][axis][axis].get<double>());
    CHECK(sd < 0.5);
    CHECK(json["camera"]["xyz_mm"][axis].get<double>() ==
          Approx(1e3 * files.X_BC.translation()[axis]).margin(0.1 + 4 * sd));
  }
  CHECK(json["held_out"]["adjusted"]["rms_px"].get<double>() < 0.3);
  CHECK(json["held_out"]["adjusted"]["position_mm"].get<double>() < 0.3);
  CHECK(json["target_size_ratio"]["value"].get<double>() == Approx(1).margin(2e-3));
  CHECK(json["lens"].is_null());
  std::vector<std::string> refused;
  for (const auto& one : json["images_refused"]) refused.push_back(one["name"]);
  std::sort(refused.begin(), refused.end());
  CHECK(refused == std::vector<std::string>{"gone.pgm", "shot4.pgm", "shot7.pgm"});
  CHECK(json["images_used"].size() == 10);
  const Answer text = files.Calibrate("--free-lens --free-size");
  CHECK(text.out.find("camera in the base") != std::string::npos);
}

TEST_CASE("Too few images, no board and faulty pose tables are reported") {
  Files files;
  const std::vector<std::string> rows = files.rows;
  files.rows.resize(5);
  Answer answer = files.Calibrate("--json -");
  REQUIRE(answer.exit_code == 0);
  CHECK(text::JsonOrNull(answer.out)["accepted"] == false);
  CHECK(answer.err.find("too few") != std::string::npos);
  answer = files.Calibrate("", "7x5");
  REQUIRE(answer.exit_code == 0);
  CHECK(answer.out.find("refused") == 0);
  files.rows = rows;
  files.rows[2] = "shot2.pgm,1,2,x,1,0,0,0\n";
  answer = files.Calibrate("");
  CHECK(answer.exit_code == 1);
  CHECK(answer.err.find("poses.csv:4") != std::string::npos);
  CHECK(answer.err.find("z_mm") != std::string::npos);
  files.rows[2] = "shot2.pgm,1,2,3,2,0,0,0\n";
  CHECK(files.Calibrate("").err.find("not a unit quaternion") != std::string::npos);
  files.rows[2] = "shot2.pgm,1,-2000000,3,1,0,0,0\n";
  files.rows[3] = "shot3.pgm,1,2000000,3,1,0,0,0\n";
  answer = files.Calibrate("");
  CHECK(answer.err.find("poses.csv:4: y_mm is -2e+06: no robot") != std::string::npos);
  CHECK(answer.err.find("are the positions in micrometres?") != std::string::npos);
  CHECK(answer.err.find("poses.csv:5") == std::string::npos);  // once for all rows
  files.rows[3] = rows[3];
  files.rows[2] = rows[1];
  CHECK(files.Calibrate("").err.find("is listed twice") != std::string::npos);
  files.header = "image,x_mm,y_mm,qw,qx,qy,qz\n";
  CHECK(files.Calibrate("").err.find("no column z_mm") != std::string::npos);
  files.header = "image,q1_deg\n";
  CHECK(files.Calibrate("").err.find("--cell") != std::string::npos);
  files.header.clear();
  files.rows.clear();
  CHECK(files.Calibrate("").exit_code == 1);
}

}  // namespace plumbline::calibrate_hand_eye_command_test
