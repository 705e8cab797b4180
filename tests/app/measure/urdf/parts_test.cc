// Faulty parts of a URDF: they refuse an arm that they belong to, and no other.
#include <functional>

#include "tests/app/measure/urdf/imported.h"

namespace plumbline::urdf_parts_test {
namespace {

/// What people's files have wrong in one joint with its child link; `key` is how a fault names it.
struct Part {
  const char* key;
  std::function<std::string(const std::string& parent, const std::string& name)> xml;
};

std::string Joint(const std::string& type, const std::string& parent, const std::string& name,
                  const std::string& rest, const std::string& link = "") {
  return "<link name=\"" + name + "\">" + link + "</link><joint name=\"to_" + name + "\" type=\"" +
         type + "\"><parent link=\"" + parent + "\"/><child link=\"" + name + "\"/>" + rest +
         "</joint>\n";
}
std::string Mass(const std::string& value) {
  return "<inertial><mass value=\"" + value + "\"/></inertial>";
}
const std::string kLimit = "<limit lower=\"-1\" upper=\"1\"/>";
const std::string kAxis = "<axis xyz=\"0 0 1\"/>";

const std::vector<Part>& MovingParts() {
  static const auto with = [](std::string type, std::string rest) {
    return [=](const std::string& parent, const std::string& name) {
      return Joint(type, parent, name, rest);
    };
  };
  static const std::vector<Part> kParts{
      {"limit.lower", with("revolute", kAxis + "<limit lower=\"-999999\" upper=\"999999\"/>")},
      {"limit.upper", with("prismatic", kAxis + "<limit lower=\"0\" upper=\"1e9\"/>")},
      {"limit.lower", with("revolute", kAxis + "<limit lower=\"-inf\" upper=\"inf\"/>")},
      {"limit", with("revolute", kAxis + "<limit lower=\"1\" upper=\"-1\"/>")},
      {"axis.xyz", with("continuous", "<axis xyz=\"0 -2 0\"/>")},
      {"axis.xyz", with("revolute", "<axis xyz=\"0 0 0\"/>" + kLimit)},
      {"axis.xyz", with("revolute", "<axis xyz=\"0 1\"/>" + kLimit)},
      {"type", with("ball", kAxis)},
      {"type", with("", kAxis + kLimit)},
      {"type", with("planar", kAxis)},
      {"type", with("floating", "")},
      {"mimic", with("revolute", kAxis + kLimit + "<mimic joint=\"other\" multiplier=\"-1\"/>")},
      {"mimic", with("revolute", kAxis + kLimit + "<mimic/>")},
      {"origin.xyz", with("revolute", kAxis + kLimit + "<origin xyz=\"0 0 850\"/>")},
      {"origin.rpy", with("revolute", kAxis + kLimit + "<origin rpy=\"0 nan 0\"/>")},
      {"calibration", with("revolute", kAxis + kLimit + "<calibration rising=\"zero\"/>")}};
  return kParts;
}

const std::vector<Part>& FixedParts() {
  static const auto massive = [](std::string mass) {
    return [=](const std::string& parent, const std::string& name) {
      return Joint("fixed", parent, name, "", Mass(mass));
    };
  };
  static const std::vector<Part> kParts{
      {"mass.value", massive("56143.06")},
      {"mass.value", massive("-0.5")},
      {"mass.value", massive("nan")},
      {"mass.value", massive("1 kg")},
      {"inertial.origin.xyz",
       [](const std::string& parent, const std::string& name) {
         return Joint("fixed", parent, name, "",
                      "<inertial><origin xyz=\"0 0 5000\"/><mass value=\"1\"/></inertial>");
       }},
      {"origin.xyz",
       [](const std::string& parent, const std::string& name) {
         return Joint("fixed", parent, name, "<origin xyz=\"a b c\"/>");
       }},
      {"refers to link", [](const std::string& parent, const std::string& name) {
         return "<joint name=\"to_" + name + "\" type=\"fixed\"><parent link=\"" + parent +
                "\"/><child link=\"lost\"/></joint>\n";
       }}};
  return kParts;
}

/// An arm l0 - l1 - .. - l6 - tip on a platform, with parts put in by the link they hang on.
/// @param instead  parts that take the place of the joint of link l3
std::string ArmWith(const std::string& parts, const Part* instead = nullptr) {
  std::string xml = "<robot name=\"r\">\n<link name=\"world\"/>\n";
  xml += Joint("planar", "world", "platform", kAxis) + Joint("fixed", "platform", "l0", "");
  for (int i = 1; i <= 6; ++i) {
    const std::string parent = "l" + std::to_string(i - 1), name = "l" + std::to_string(i);
    xml += i == 3 && instead
               ? instead->xml(parent, name)
               : Joint("revolute", parent, name,
                       std::string(i % 2 ? "<axis xyz=\"0 0 1\"/>" : "<axis xyz=\"0 1 0\"/>") +
                           "<origin xyz=\"0.1 0 0.2\"/>" + kLimit,
                       Mass("2"));
  }
  return xml + Joint("fixed", "l6", "tip", "<origin xyz=\"0 0 0.1\"/>") +
         Joint("prismatic", "tip", "finger", kAxis + kLimit) + parts + "</robot>\n";
}

struct Outcome {
  bool converted = false;
  std::string faults;
};

Outcome Convert(const std::string& xml) {
  config::FaultList faults;
  const auto file = measure::UrdfFromText(xml, "r.urdf", faults);
  const bool converted = file && measure::ChainFromUrdf(*file, "r.urdf", "l0", "tip",
                                                        measure::Rising::kIgnored, faults);
  return {converted, config::FaultsText(faults)};
}

}  // namespace

TEST_CASE("a fault beside the arm never refuses it, and leaves its numbers alone") {
  std::mt19937 random(11);
  const std::string plain = ArmWith("");
  std::vector<Part> all = MovingParts();
  for (const Part& part : FixedParts()) {
    all.push_back(part);  // behind a moving joint: neither carried nor fixed
  }
  for (std::size_t k = 0; k < all.size(); ++k) {
    for (const char* parent : {"world", "platform", "l0", "l3", "l6", "tip", "finger"}) {
      const bool moving = k < MovingParts().size();
      const std::string joint = moving ? "" : Joint("continuous", parent, "between", kAxis);
      const std::string xml = ArmWith(joint + all[k].xml(moving ? parent : "between", "odd"));
      CAPTURE(k, parent);
      const Outcome outcome = Convert(xml);
      INFO(outcome.faults);
      CHECK(outcome.converted);
      CHECK(outcome.faults.find("warning") != std::string::npos);
      test::CheckAgainstXml(plain, test::Import(xml, "l0"), 5, random);
    }
  }
}

TEST_CASE("a fault of the arm itself is refused with its name") {
  for (const Part& part : MovingParts()) {
    CAPTURE(part.key);
    const Outcome outcome = Convert(ArmWith("", &part));
    INFO(outcome.faults);
    CHECK_FALSE(outcome.converted);
    CHECK(outcome.faults.find(std::string("joint to_l3.") + part.key) != std::string::npos);
  }
}

TEST_CASE("a fault of what is fixed to a moving link is refused with its name and its carrier") {
  for (const Part& part : FixedParts()) {
    for (const char* parent : {"l1", "l3", "l6", "tip"}) {
      CAPTURE(part.key, parent);
      const Outcome outcome = Convert(ArmWith(part.xml(parent, "odd")));
      INFO(outcome.faults);
      CHECK_FALSE(outcome.converted);
      CHECK(outcome.faults.find(part.key) != std::string::npos);
      CHECK(outcome.faults.find("odd") != std::string::npos);
      CHECK(outcome.faults.find(std::string("moves with the arm, fixed to link ") + parent) !=
            std::string::npos);
    }
  }
}

TEST_CASE("rings, second parents and names given twice refuse only the arm that has them") {
  const auto fixed = [](const std::string& name, const std::string& parent,
                        const std::string& child) {
    return "<joint name=\"" + name + "\" type=\"fixed\"><parent link=\"" + parent +
           "\"/><child link=\"" + child + "\"/></joint>\n";
  };
  const std::string two = "<link name=\"x\"/><link name=\"y\"/>\n";
  CHECK(Convert(ArmWith(two + fixed("a", "x", "y") + fixed("b", "y", "x"))).converted);
  CHECK(Convert(ArmWith("<link name=\"stray\"/><link name=\"stray\"/>")).converted);
  CHECK(Convert(ArmWith(two + fixed("a", "world", "x") + fixed("a", "world", "y"))).converted);
  const auto refused = [&](const std::string& parts, const char* text) {
    const Outcome outcome = Convert(ArmWith(parts));
    INFO(outcome.faults);
    CHECK_FALSE(outcome.converted);
    CHECK(outcome.faults.find(text) != std::string::npos);
  };
  refused(fixed("a", "world", "l3"), "already hangs on joint to_l3");
  refused("<link name=\"l3\"/>", "link l3: has the same name");
  refused(two + fixed("to_l3", "world", "x"), "joint to_l3: has the same name");
  refused(two + fixed("a", "l3", "x") + fixed("b", "x", "y") + fixed("c", "y", "x"),
          "already hangs on joint a");
}

}  // namespace plumbline::urdf_parts_test
