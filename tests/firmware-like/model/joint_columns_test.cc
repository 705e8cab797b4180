#include "firmware-like/model/joint_columns.h"

#include <catch2/catch.hpp>
#include <string>

#include "firmware-like/effects/influence.h"

namespace plumbline::joint_columns_test {

using namespace plumbline::model;

TEST_CASE("joint columns are named by quantity, joint number and unit") {
  using enum JointQuantity;
  CHECK(JointColumnName(kPosition, JointType::kRevolute, 2) == "q3_deg");
  CHECK(JointColumnName(kPosition, JointType::kPrismatic, 0) == "q1_mm");
  CHECK(JointColumnName(kVelocity, JointType::kRevolute, 6) == "qd7_deg_s");
  CHECK(JointColumnName(kVelocity, JointType::kPrismatic, 0) == "qd1_mm_s");
  CHECK(JointColumnName(kAcceleration, JointType::kRevolute, 0) == "qdd1_deg_s2");
  CHECK(JointColumnName(kAcceleration, JointType::kPrismatic, 11) == "qdd12_mm_s2");
  CHECK(JointColumnName(kTorque, JointType::kRevolute, 1) == "tau2_Nm");
  CHECK(JointColumnName(kTorque, JointType::kPrismatic, 1) == "tau2_N");
}

TEST_CASE("every generated name is parsed back to its column") {
  for (const JointColumnForm& form : kJointColumnForms) {
    CHECK(form.to_SI * form.from_SI == Approx(1));
    for (const int joint : {0, 8, 9, 11}) {
      const std::string name = JointColumnName(form.quantity, form.type, joint);
      CAPTURE(name);
      const auto column = JointColumnFromName(name);
      REQUIRE(column);
      CHECK(column->form == &form);
      CHECK(column->joint == joint);
      CHECK(ResemblesJointColumn(name));
    }
  }
}

TEST_CASE("names that only resemble a joint column are rejected") {
  for (const char* name :
       {"q3", "q3_rad", "q_deg", "q0_deg", "q-1_deg", "q3deg", "q3__deg", "qd3_deg", "tau3_deg",
        "x3_mm", "q99999999999_deg", "_deg", "q_", "", "q3_deg ", "Q3_deg"}) {
    CAPTURE(name);
    CHECK_FALSE(JointColumnFromName(name));
  }
  CHECK(ResemblesJointColumn("q3_rad"));
  CHECK(ResemblesJointColumn("tau7"));
  CHECK_FALSE(ResemblesJointColumn("q_step_deg"));
  CHECK_FALSE(ResemblesJointColumn("qw"));
  CHECK_FALSE(ResemblesJointColumn("tau"));
  CHECK_FALSE(ResemblesJointColumn(""));
}

TEST_CASE("the force on a prismatic joint is available under its column name, like a torque") {
  effects::Conditions moment;
  moment.tau = JointVector::Constant(2, 40);
  CHECK(moment.Signal("tau1_N") == 40);
  CHECK(moment.Signal("tau2_Nm") == 40);
  CHECK_FALSE(moment.Signal("tau3_N"));
}

}  // namespace plumbline::joint_columns_test
