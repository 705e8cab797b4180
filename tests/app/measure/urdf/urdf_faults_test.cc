// Faulty URDF files: each fault is named with its line, value and remedy.
#include <catch2/catch.hpp>

#include "app/measure/urdf/joint_chain.h"

namespace plumbline::urdf_faults_test {
namespace {

std::string Link(const std::string& name) {
  return "<link name=\"" + name + "\"/>\n";
}
std::string Joint(const std::string& name, const std::string& type, const std::string& parent,
                  const std::string& child, const std::string& rest) {
  return "<joint name=\"" + name + "\" type=\"" + type + "\"><parent link=\"" + parent +
         "\"/><child link=\"" + child + "\"/>" + rest + "</joint>\n";
}
const std::string kLimit = "<limit lower=\"-1\" upper=\"1\"/>";

std::string FaultsOf(const std::string& text, const std::string& base = "",
                     const std::string& tip = "") {
  config::FaultList faults;
  const auto file = measure::UrdfFromText(text, "r.urdf", faults);
  if (file) measure::ChainFromUrdf(*file, "r.urdf", base, tip, measure::Rising::kIgnored, faults);
  return config::FaultsText(faults);
}
std::string WithJoint(const std::string& rest, const std::string& type = "revolute") {
  return "<robot>\n" + Link("a") + Link("b") + Joint("j", type, "a", "b", rest) + "</robot>";
}

}  // namespace

TEST_CASE("a faulty URDF is refused with line, value and remedy") {
  using Catch::Contains;
  CHECK(FaultsOf(WithJoint(kLimit)) == "");
  CHECK_THAT(FaultsOf("<robot>\n<link name=\"a\">\n</robot>"),
             Contains("r.urdf:3") && Contains("not well-formed XML"));
  CHECK_THAT(FaultsOf("<!DOCTYPE robot [<!ENTITY a \"aaaa\"><!ENTITY b \"&a;&a;&a;\">]>\n<robot>" +
                      Link("&b;") + "</robot>"),
             Contains("document type declaration") && Contains("remove it"));
  CHECK_THAT(FaultsOf("<sdf/>"), Contains("<sdf>; a URDF has <robot>"));
  CHECK_THAT(FaultsOf(""), Contains("well-formed"));
  CHECK_THAT(FaultsOf("<robot/>"), Contains("has no <link>"));
  CHECK_THAT(FaultsOf("<robot>\n<xacro:include filename=\"x\"/></robot>"),
             Contains("r.urdf:2") && Contains("xacro FILE > robot.urdf"));
  CHECK_THAT(FaultsOf(WithJoint(kLimit + "<origin xyz=\"0 nan 0\"/>")),
             Contains("r.urdf:4 joint j.origin.xyz: \"0 nan 0\" is not 3 finite numbers"));
  CHECK_THAT(FaultsOf(WithJoint(kLimit + "<origin rpy=\"0 1e999 0\"/>")), Contains("finite"));
  CHECK_THAT(FaultsOf(WithJoint(kLimit + "<origin xyz=\"0 0 0 1\"/>")), Contains("3 finite"));
  CHECK_THAT(FaultsOf(WithJoint(kLimit + "<origin xyz=\"0 0 850\"/>")),
             Contains("850 is outside -100..100; a URDF is in metres"));
  CHECK_THAT(FaultsOf(WithJoint(kLimit + "<origin xyz=\"0 0 ${h}\"/>")), Contains("xacro"));
  CHECK_THAT(FaultsOf(WithJoint(kLimit + "<axis xyz=\"0 0 2\"/>")),
             Contains("has the length 2; an axis is a unit vector: write 0 0 1"));
  CHECK_THAT(FaultsOf(WithJoint(kLimit + "<axis xyz=\"0 0 0\"/>")), Contains("is zero"));
  CHECK_THAT(FaultsOf(WithJoint("<limit lower=\"1\" upper=\"1\"/>")),
             Contains("lower 1 is not less than upper 1"));
  CHECK_THAT(FaultsOf(WithJoint(kLimit + "<mimic joint=\"k\"/>")), Contains("follows joint \"k\""));
  CHECK_THAT(FaultsOf(WithJoint("", "planar")), Contains("\"planar\" cannot be part"));
  CHECK_THAT(FaultsOf(WithJoint("", "hinge")), Contains("\"hinge\" is not a joint type"));
  CHECK_THAT(FaultsOf(WithJoint("", "fixed")), Contains("0 moving joints"));
  CHECK_THAT(FaultsOf(WithJoint("", "continuous")), Contains("warning") && Contains("continuous"));
  CHECK_THAT(FaultsOf("<robot>" + Link("a") + Joint("j", "fixed", "a", "c", "") + "</robot>"),
             Contains("refers to link \"c\""));
  CHECK_THAT(FaultsOf("<robot>" + Link("a") + Link("a") + "</robot>"), Contains("same name"));
  CHECK_THAT(FaultsOf("<robot>" + Link("a") + Link("b") + Joint("j", "revolute", "a", "b", kLimit) +
                      Joint("k", "revolute", "b", "a", kLimit) + "</robot>"),
             Contains("ring"));
  CHECK_THAT(FaultsOf("<robot>" + Link("a") + Link("b") + Link("c") +
                      Joint("j", "revolute", "a", "b", kLimit) +
                      Joint("k", "revolute", "c", "b", kLimit) + "</robot>"),
             Contains("already hangs on joint j"));
  CHECK_THAT(FaultsOf(WithJoint(kLimit), "", "x"),
             Contains("\"x\" is not a link") && Contains("a, b"));
  CHECK_THAT(FaultsOf(WithJoint(kLimit), "b", "a"), Contains("the tip does not hang on the base"));
}

TEST_CASE("each fault is named once, and only those that may be the reason") {
  using Catch::Contains;
  const std::string faulty = WithJoint(kLimit + "<axis xyz=\"0 0 2\"/>");
  CHECK_THAT(FaultsOf(faulty, "", "b"), Contains("has the length 2"));
  CHECK_THAT(FaultsOf(faulty, "", "c"), Contains("\"c\" is not a link") && !Contains("length"));
  CHECK_THAT(FaultsOf(faulty, "c", ""), Contains("\"c\" is not a link") && !Contains("length"));
  const std::string endless =
      FaultsOf("<robot>" + Link("a") + Joint("j", "fixed", "a", "c", "") + "</robot>");
  CHECK_THAT(endless, Contains("no chain has an end") && !Contains("end in ;"));
  const std::string same = FaultsOf("<robot>" + Link("a") + Link("a") + Link("b") +
                                    Joint("j", "revolute", "a", "b", kLimit) +
                                    Joint("j", "revolute", "b", "a", kLimit) + "</robot>");
  INFO(same);
  for (const char* name : {"link a: has the same name", "joint j: has the same name"}) {
    CHECK(same.find(name) != std::string::npos);
    CHECK(same.find(name) == same.rfind(name));
  }
}

TEST_CASE("a chain of too many joints, and two ends of equal rank") {
  std::string text = "<robot>" + Link("l0");
  for (int i = 1; i <= 13; ++i) {
    text += Link("l" + std::to_string(i)) + Joint("j" + std::to_string(i), "revolute",
                                                  "l" + std::to_string(i - 1),
                                                  "l" + std::to_string(i), kLimit);
  }
  CHECK_THAT(FaultsOf(text + "</robot>"), Catch::Contains("13 moving joints; allowed are 1 to 12"));
  CHECK_THAT(FaultsOf("<robot>" + Link("a") + Link("b") + Link("c") + Link("d") +
                      Joint("j", "revolute", "a", "b", kLimit) + Joint("k", "fixed", "b", "c", "") +
                      Joint("m", "fixed", "b", "d", "") + "</robot>"),
             Catch::Contains("may end in c, d"));
}

TEST_CASE("masses beside the chain are reported") {
  const std::string text = "<robot>" + Link("a") + Link("b") + Link("finger") + Link("tool0") +
                           Joint("j", "revolute", "a", "b", kLimit) +
                           Joint("k", "fixed", "b", "tool0", "") +
                           Joint("grip", "prismatic", "b", "finger", kLimit) + "</robot>";
  CHECK_THAT(FaultsOf(text), Catch::Contains("joint grip: warning: moves beside the chain"));
}

TEST_CASE("a URDF with thousands of links is refused at once") {
  std::string text = "<robot>\n" + Link("l0");
  for (int i = 1; i < 2001; ++i) {
    const std::string name = "l" + std::to_string(i);
    text +=
        Link(name) + Joint("j" + std::to_string(i), "fixed", "l" + std::to_string(i - 1), name, "");
  }
  CHECK_THAT(FaultsOf(text + "</robot>"),
             Catch::Contains("the file has 2001 links; allowed are 2000"));
}

}  // namespace plumbline::urdf_faults_test
