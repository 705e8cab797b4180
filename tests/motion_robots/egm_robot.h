// An ABB controller's side of EGM over UDP.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/motion_robots/controller.h"

namespace motion_robots {

enum class MciState { kUndefined = 0, kError = 1, kStopped = 2, kRunning = 3 };

struct EgmOptions {
  AppliedOptions applied;
  bool guidance = false;    ///< position guidance: path corrections are refused
  bool packed = false;      ///< joints as a packed field
  bool more_fields = true;  ///< also those that nobody needs, and one that no version has
};

class EgmRobot final : public Controller {
 public:
  explicit EgmRobot(EgmOptions options) : Controller(options.applied), options_(options) {}

  std::string BeginCycle() override;
  void Receive(const std::string& datagram) override;
  void EndCycle() override;
  void Start() override;

  std::string Packet(const std::vector<double>& joints_deg, std::uint64_t seqno) const override;

  MciState state = MciState::kRunning;
  std::optional<unsigned> message_type = 2;
  std::uint64_t number() const override { return seqno_; }
  void Renumber(std::uint64_t seqno) override { seqno_ = static_cast<std::uint32_t>(seqno); }
  unsigned step() const override { return 1; }
  long refused() const { return refused_; }  ///< wrong type, or a path correction in guidance
  std::uint32_t answered_seqno() const { return answered_seqno_; }
  std::uint32_t age_ms() const { return age_ms_; }

 private:
  EgmOptions options_;
  std::uint32_t seqno_ = 100, answered_seqno_ = 0, age_ms_ = 0;
  std::optional<Correction> answer_;
  long refused_ = 0;
};

}  // namespace motion_robots
