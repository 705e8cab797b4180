#include "tests/motion_robots/rsi_robot.h"

#include <cstdio>
#include <pugixml.hpp>
#include <utility>

namespace motion_robots {
namespace {

std::string Decimal(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.4f", value);
  return text;
}

}  // namespace

std::string RsiRobot::Packet(const std::vector<double>& joints, std::uint64_t ipoc) const {
  const int oddity = options_.oddity;
  const std::string space = oddity % 2 == 1 ? "  \r\n" : " ";
  const char quote = oddity % 4 >= 2 ? '\'' : '"';
  const auto attribute = [&](const std::string& name, const std::string& value) {
    return space + name + (oddity % 3 == 1 ? " = " : "=") + quote + value + quote;
  };
  std::string axes = "<AIPos";
  for (std::size_t k = 0; k < joints.size(); ++k) {
    const std::size_t at = oddity % 5 == 3 ? joints.size() - 1 - k : k;
    axes += attribute("A" + std::to_string(at + 1), Decimal(joints[at]));
  }
  axes += oddity % 3 == 2 ? "></AIPos>" : "/>";
  std::string pose = "<RIst";
  for (const char* name : {"X", "Y", "Z", "A", "B", "C"}) pose += attribute(name, "12.5000");
  pose += "/>";
  const std::string delay = "<Delay" + attribute("D", std::to_string(offset_.late())) + "/>";
  const std::string number = "<IPOC>" + std::to_string(ipoc) + "</IPOC>";
  const std::string more = oddity >= 6 ? "<Tech><C11>1.0</C11></Tech><Free A9='x&gt;y'/>" : "";
  std::string text = oddity >= 8 ? "<?xml version=\"1.0\"?>\r\n" : "";
  text += "<Rob" + attribute("Type", "KUKA") + ">";
  text +=
      oddity % 5 == 4 ? number + delay + axes + more + pose : pose + more + axes + delay + number;
  return text + "</Rob>" + (oddity % 7 == 6 ? "\r\n" : "");
}

std::string RsiRobot::BeginCycle() {
  answer_.reset();
  ipoc_ += options_.ipoc_step;
  return Packet(joints_deg, ipoc_);
}

void RsiRobot::Receive(const std::string& datagram) {
  pugi::xml_document document;
  const pugi::xml_node sen = document.load_buffer(datagram.data(), datagram.size())
                                 ? document.child("Sen")
                                 : pugi::xml_node();
  if (!sen || sen.attribute("Type").value() != options_.sen_type) {
    ++not_understood_;
    return;
  }
  if (sen.child("IPOC").text().as_ullong() != ipoc_) {
    ++wrong_ipoc_;
    return;
  }
  const pugi::xml_node correction = sen.child(options_.correction_tag.c_str());
  if (!correction) {  // an unknown tag is no value
    ++not_understood_;
    return;
  }
  const auto value = [&](const char* name) { return correction.attribute(name).as_double(); };
  answer_ = Correction{{value("X"), value("Y"), value("Z")}, {value("A"), value("B"), value("C")}};
}

void RsiRobot::EndCycle() {
  offset_.EndCycle(answer_);
}

void RsiRobot::Start() {
  answer_.reset();
  offset_.Start();
}

}  // namespace motion_robots
