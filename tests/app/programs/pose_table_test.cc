#include "app/programs/brands/pose_table.h"

#include <catch2/catch.hpp>

namespace plumbline::pose_table_test {

using namespace plumbline::programs;

const Brand& BrandFor(const SourceFile& file) {
  const auto brand = BrandOf({file});
  REQUIRE(brand);
  return **brand;
}

Reading Read(const std::string& name, const std::string& bytes) {
  const SourceFile file{name, bytes};
  return BrandFor(file).Read({file});
}

TEST_CASE("a table of poses is understood by its header, and its numbers stay where they are") {
  const std::string bytes =
      "name,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg,tool\r\n"
      "p1, 100.5 ,\"-2\",3,10,20,30,2\r\np2,1,2,3,4,5,x,2";
  const Reading reading = Read("path.csv", bytes);
  CHECK(reading.refusals.empty());
  REQUIRE(reading.program.points.size() == 2);
  const Point& point = reading.program.points[0];
  CHECK(point.name == "p1");
  REQUIRE(point.numbers.size() == 6);
  const std::vector<std::string> written = {"100.5", "-2", "3", "10", "20", "30"};
  for (std::size_t i = 0; i < 6; ++i) {
    const Span& span = point.numbers[i]->span;
    CHECK(bytes.substr(span.begin, span.end - span.begin) == written[i]);
  }
  CHECK_FALSE(reading.program.points[1].untouchable.empty());
  REQUIRE(reading.program.routines.size() == 1);
  const Step& step = reading.program.routines[0].steps.at(0);
  CHECK(step.motion.kind == MotionKind::kLinear);
  CHECK(step.motion.tool->key == "tool 2");
  CHECK(step.place.line == 2);
}

TEST_CASE("each way to write a pose has its own conventions") {
  const auto brand = [](const char* header, const char* row) -> const Brand& {
    return BrandFor({"a.csv", std::string(header) + "\n" + row + "\n"});
  };
  const Brand& metres = brand("x_m,y_m,z_m,qw,qx,qy,qz", "0.1,0.2,0.3,1,0,0,0");
  CHECK(metres.conventions().m_per_unit == 1);
  CHECK(metres.conventions().orientation_numbers == 4);
  const Brand& vectors =
      brand("x_mm;y_mm;z_mm;rotvec_x_rad;rotvec_y_rad;rotvec_z_rad", "1.5;2.5;3.5;0.1;0.2;0.3");
  CHECK(vectors.conventions().m_per_unit == 1e-3);
  const auto R = vectors.conventions().rotation(std::vector<double>{0, 0, 1.5707963267948966});
  REQUIRE(R);
  CHECK((*R)(1, 0) == Approx(1));
  const Brand& radians = brand("x [mm]\ty [mm]\tz [mm]\troll [rad]\tpitch [rad]\tyaw [rad]",
                               "1.5\t2.5\t3.5\t0.1\t0.2\t0.3");
  CHECK(&radians != &vectors);
  CHECK((*radians.conventions().rotation(std::vector<double>{0, 0, 1.5707963267948966}))(1, 0) ==
        Approx(1));
}

TEST_CASE("A, B, C of KUKA and W, P, R of FANUC are angles in their own order") {
  const Point abc =
      Read("a.csv", "x_mm,y_mm,z_mm,a_deg,b_deg,c_deg\n1,2,3,40,50,60\n").program.points.at(0);
  CHECK(abc.numbers[3]->value == 60);
  CHECK(abc.numbers[5]->value == 40);
  const Point wpr =
      Read("a.csv", "x_mm,y_mm,z_mm,w_deg,p_deg,r_deg\n1,2,3,40,50,60\n").program.points.at(0);
  CHECK(wpr.numbers[3]->value == 40);
}

TEST_CASE("a table without a header, or with an ambiguous one, is refused with the header to add") {
  for (const std::string bytes :
       {"1,2,3,4,5,6\n7,8,9,1,2,3\n", "x_mm,y_mm,z_mm,rx_deg,ry_deg,rz_deg\n1,2,3,4,5,6\n",
        "x,y,z,roll_deg,pitch_deg,yaw_deg\n1,2,3,4,5,6\n", "x_mm,y_mm,z_mm\n1,2,3\n",
        "x_mm;y_mm;z_mm;roll_deg;pitch_deg;yaw_deg\n1,5;2,5;3,5;4,5;5,5;6,5\n"}) {
    CAPTURE(bytes);
    const Reading reading = Read("a.csv", bytes);
    CHECK(reading.program.points.empty());
    REQUIRE(reading.refusals.size() == 1);
    CHECK_FALSE(reading.refusals[0].remedy.empty());
  }
}

TEST_CASE("joints beside a pose are the posture near which it is reached") {
  const Reading reading =
      Read("a.csv", "x_mm,y_mm,z_mm,qw,qx,qy,qz,j1_deg,j2_deg\n1,2,3,1,0,0,0,90,-45\n");
  REQUIRE(reading.program.points.size() == 1);
  REQUIRE(reading.program.points[0].near_q.size() == 2);
  CHECK(reading.program.points[0].near_q[0] == Approx(1.5707963267948966));
}

TEST_CASE("columns separated by blanks, lines with LF, empty lines") {
  const std::string bytes =
      "# path\nx_mm  y_mm  z_mm  roll_deg  pitch_deg  yaw_deg\n\n 1.0  2.0 3.0  4.0 5.0  6.0\n";
  const Reading reading = Read("a.txt", bytes);
  REQUIRE(reading.program.points.size() == 1);
  const Span& span = reading.program.points[0].numbers[1]->span;
  CHECK(bytes.substr(span.begin, span.end - span.begin) == "2.0");
  CHECK(reading.program.points[0].place.line == 4);
}

TEST_CASE("orientations of tables stay nearest to the old numbers") {
  for (const Brand* const brand : PoseTables()) {
    CAPTURE(brand->name());
    const Conventions& conventions = brand->conventions();
    const std::vector<double> old = conventions.orientation_numbers == 4
                                        ? std::vector<double>{-0.5, 0.5, -0.5, 0.5}
                                        : std::vector<double>{2.5, 2.0, -2.2};
    const auto R = conventions.rotation(old);
    REQUIRE(R);
    const std::vector<double> again = conventions.numbers(*R, old);
    for (std::size_t i = 0; i < old.size(); ++i) CHECK(again[i] == Approx(old[i]));
  }
}

}  // namespace plumbline::pose_table_test
