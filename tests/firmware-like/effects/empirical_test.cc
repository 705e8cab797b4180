#include "firmware-like/effects/empirical.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "firmware-like/effects/written.h"
#include "tests/firmware-like/effects/small_cell.h"

namespace plumbline::empirical_test {

using namespace plumbline::effects;

namespace {

using I = Influence<double>;

model::WrittenEffect Curve(const std::string& driver, const std::vector<std::string>& carriers,
                           const Eigen::MatrixXd& nodes, double factor = 1) {
  model::WrittenEffect written;
  written.id = "empirical";
  written.drivers = {driver};
  written.nodes = nodes;
  for (const std::string& carrier : carriers) {
    model::EffectParameter& parameter = written.parameters.emplace_back();
    parameter.name = carrier;
    parameter.value = factor;
    parameter.unit = "1";
  }
  return written;
}

I Sum(const model::WrittenEffect& written, const Conditions& moment) {
  const std::vector<ActiveEffect> effects = {ActiveFromWritten(written, SmallCell())};
  I influence;
  AddEffects(effects, moment, influence);
  return influence;
}

TEST_CASE("The curve is linear between nodes and constant beyond them") {
  Eigen::MatrixXd nodes(3, 2);
  nodes << 100, 1, 200, 3, 600, -1;
  const model::WrittenEffect written = Curve("t_s", {"base_z"}, nodes);
  const std::vector<std::pair<double, double>> cases = {{-5, 1},  {100, 1},  {150, 2}, {200, 3},
                                                        {400, 1}, {600, -1}, {1e6, -1}};
  for (const auto& [t_s, mm] : cases) {
    CAPTURE(t_s);
    Conditions moment;
    moment.t_s = t_s;
    CHECK(Sum(written, moment)[I::kBase + 2] == Approx(1e-3 * mm).epsilon(1e-14));
  }
}

TEST_CASE("Each carrier has its own unit, and the value is a factor") {
  Eigen::MatrixXd nodes(1, 8);
  nodes << 0, 2, -3, 1e-4, 0.5, 0.4, -0.6, 2e-4;
  const model::WrittenEffect written =
      Curve("air_hPa", {"base_x", "tip_y", "q3", "tool_bending", "a2", "d4", "tilt_y"}, nodes, 0.5);
  const I influence = Sum(written, KnownMoment());
  CHECK(influence[I::kBase] == Approx(1e-3));
  CHECK(influence[I::kTip + 1] == Approx(-1.5e-3));
  CHECK(influence.Joint(I::kTurn, 2) == Approx(0.5e-4));
  CHECK(influence[I::kBendRatio] == Approx(0.25));
  CHECK(influence.Joint(I::kLengthA, 1) == Approx(0.2e-3));
  CHECK(influence.Joint(I::kOffsetD, 3) == Approx(-0.3e-3));
  CHECK(influence[I::kBaseTilt + 1] == Approx(1e-4));
}

/// Base height as a function of temperature and payload: 0, 1, 2 mm at 20 C and 3, 5, 8 mm at 30 C.
model::WrittenEffect Surface() {
  Eigen::MatrixXd nodes(6, 3);
  nodes << 20, 0, 0, 20, 40, 1, 20, 80, 2, 30, 0, 3, 30, 40, 5, 30, 80, 8;
  model::WrittenEffect written = Curve("temp_C", {"base_z"}, nodes);
  written.drivers = {"temp_C", "payload_kg"};
  return written;
}

TEST_CASE("The surface over two drivers is bilinear between nodes and constant beyond them") {
  struct Case {
    double temp_C, payload_kg, mm;
  };
  for (const Case& of : {Case{20, 0, 0}, Case{20, 60, 1.5}, Case{25, 0, 1.5}, Case{30, 80, 8},
                         Case{25, 60, 4}, Case{10, 40, 1}, Case{40, 200, 8}, Case{25, -5, 1.5}}) {
    CAPTURE(of.temp_C, of.payload_kg);
    Conditions moment;
    moment.temp_C = of.temp_C;
    moment.payload_kg = of.payload_kg;
    CHECK(Sum(Surface(), moment)[I::kBase + 2] == Approx(1e-3 * of.mm).margin(1e-15));
  }
  Conditions without_temperature;
  without_temperature.payload_kg = 40;
  CHECK(Sum(Surface(), without_temperature)[I::kBase + 2] == 0);
}

TEST_CASE("Nodes of two drivers that do not form a full grid are rejected with the reason") {
  const auto fault = [](const Eigen::MatrixXd& nodes) {
    return EmpiricalFault({"temp_C", "payload_kg"}, nodes, 1);
  };
  const Eigen::MatrixXd good = Surface().nodes;
  CHECK(fault(good).empty());
  CHECK(fault(good.topRows(5)).find("full grid") != std::string::npos);
  Eigen::MatrixXd nodes = good;
  nodes(4, 1) = 41;
  CHECK(fault(nodes).find("same values of the second driver in every group; row 5 does not") !=
        std::string::npos);
  nodes = good;
  nodes(1, 1) = 0;
  CHECK(fault(nodes).find("rises within a group; row 2 does not") != std::string::npos);
  nodes = good;
  nodes.col(0).tail(3).setConstant(10);
  CHECK(fault(nodes).find("rises from group to group; row 4 does not") != std::string::npos);
}

TEST_CASE("Nothing is added if the driver is unknown or missing") {
  Eigen::MatrixXd nodes(1, 2);
  nodes << 0, 2;
  CHECK(Sum(Curve("wind_m_s", {"base_x"}, nodes), KnownMoment())[I::kBase] == 0);
  Conditions unread;
  unread.t_s = std::nan("");
  CHECK(Sum(Curve("t_s", {"base_x"}, nodes), unread)[I::kBase] == 0);
  model::WrittenEffect without = Curve("t_s", {"base_x"}, nodes);
  without.drivers.clear();
  CHECK(Sum(without, KnownMoment())[I::kBase] == 0);
  CHECK(Sum(Curve("t_s", {"base_x"}, {}), KnownMoment())[I::kBase] == 0);
}

TEST_CASE("Invalid drivers and nodes are rejected with the reason") {
  Eigen::MatrixXd rising(2, 2), falling(2, 2);
  rising << 0, 1, 1, 1;
  falling << 1, 1, 1, 1;
  CHECK(EmpiricalFault({"t_s"}, rising, 1).empty());
  CHECK(EmpiricalFault({}, rising, 1).find("one or two drivers") != std::string::npos);
  CHECK(EmpiricalFault({"t_s", "temp_C", "row"}, rising, 1).find("one or two drivers") !=
        std::string::npos);
  CHECK(EmpiricalFault({"t_s", "temp_C"}, rising, 1).find("3 in all") != std::string::npos);
  CHECK(EmpiricalFault({"t_s"}, {}, 1).find("needs nodes") != std::string::npos);
  CHECK(EmpiricalFault({"t_s"}, rising, 2).find("3 in all") != std::string::npos);
  CHECK(EmpiricalFault({"t_s"}, falling, 1).find("row 2 does not") != std::string::npos);
}

}  // namespace
}  // namespace plumbline::empirical_test
