// A KUKA controller's side of RSI over Ethernet.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/motion_robots/controller.h"

namespace motion_robots {

struct RsiOptions {
  AppliedOptions applied;
  unsigned ipoc_step = 4;  ///< per cycle
  std::string sen_type = "ImFree", correction_tag = "RKorr";
  int oddity = 0;  ///< other orders of elements and attributes, quotes, spaces, further elements
};

class RsiRobot final : public Controller {
 public:
  explicit RsiRobot(RsiOptions options)
      : Controller(options.applied), options_(std::move(options)) {}

  /// Begins a cycle. @return  its packet
  std::string BeginCycle() override;
  /// A datagram from the client. Only one that answers the packet of this cycle counts.
  void Receive(const std::string& datagram) override;
  void EndCycle() override;

  void Start() override;

  std::string Packet(const std::vector<double>& joints_deg, std::uint64_t ipoc) const override;

  std::uint64_t number() const override { return ipoc_; }
  void Renumber(std::uint64_t ipoc) override { ipoc_ = ipoc; }
  unsigned step() const override { return options_.ipoc_step; }
  long wrong_ipoc() const { return wrong_ipoc_; }
  long not_understood() const { return not_understood_; }

 private:
  RsiOptions options_;
  std::uint64_t ipoc_ = 4208163634;
  std::optional<Correction> answer_;
  long wrong_ipoc_ = 0, not_understood_ = 0;
};

}  // namespace motion_robots
