// A controller with a sensor interface, as the wire and the tests see it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/motion_robots/applied_offset.h"

namespace motion_robots {

class Controller {
 public:
  explicit Controller(const AppliedOptions& options) : offset_(options) {}
  virtual ~Controller() = default;

  /// Begins a cycle. @return  its packet
  virtual std::string BeginCycle() = 0;
  /// A datagram from the client, within a cycle.
  virtual void Receive(const std::string& datagram) = 0;
  virtual void EndCycle() = 0;
  /// Switches the interface on again, after a stop.
  virtual void Start() = 0;
  /// A packet with these joints and number, as the controller writes it.
  virtual std::string Packet(const std::vector<double>& joints_deg, std::uint64_t number) const = 0;
  virtual std::uint64_t number() const = 0;  ///< of this cycle
  virtual void Renumber(std::uint64_t number) = 0;
  virtual unsigned step() const = 0;  ///< of the number, per cycle

  const AppliedOffset& offset() const { return offset_; }
  AppliedOffset& offset() { return offset_; }

  bool active = true;  ///< corrections are applied; only EGM tells the client
  std::vector<double> joints_deg = {0, -90, 90, 0, 45, 0};

 protected:
  AppliedOffset offset_;
};

}  // namespace motion_robots
