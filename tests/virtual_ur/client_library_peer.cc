// The RTDE client of Universal_Robots_Client_Library against the virtual UR: handshake, data and
// inputs as that library understands them. Built only where the library is installed.
#include <ur_client_library/rtde/rtde_client.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "tests/virtual_ur/running_ur.h"

namespace {

int g_failures = 0;

void Check(bool holds, const char* what) {
  std::printf("%s: %s\n", holds ? "ok" : "FAILED", what);
  if (!holds) ++g_failures;
}

}  // namespace

int main() {
  virtual_ur::RunningUr ur;
  ur.With([](virtual_ur::BareUr& server) {
    server.state().timestamp = 100;  // the library waits until a controller has run for 40 s
    server.state().actual_q = {0.1, -1.5, 1.0, 0.5, 0.25, 6.1};
    server.state().payload_cog = {0.01, 0.02, 0.03};
  });
  ur.Fault("text-between on");
  ur.Fault("missing tcp_offset");
  const std::vector<std::string> outputs{"timestamp",
                                         "actual_q",
                                         "actual_TCP_pose",
                                         "payload",
                                         "payload_cog",
                                         "tcp_offset",
                                         "robot_mode",
                                         "safety_status",
                                         "runtime_state",
                                         "input_int_register_24",
                                         "input_double_register_24"};
  const std::vector<std::string> inputs{"input_int_register_24", "input_double_register_24"};
  urcl::comm::INotifier notifier;
  urcl::rtde_interface::RTDEClient client("127.0.0.1", notifier, outputs, inputs, 500, true,
                                          static_cast<std::uint32_t>(ur.port()));
  Check(client.init(3), "the handshake succeeds, without the field that is missing");
  Check(client.start(false), "data packages start");
  auto package = std::make_unique<urcl::rtde_interface::DataPackage>(client.getOutputRecipe());
  Check(client.getDataPackageBlocking(package), "a package arrives");
  urcl::vector6d_t q{};
  Check(package->getData("actual_q", q) && q[5] == 6.1, "the joints are those of the controller");
  urcl::vector3d_t cog{};
  Check(package->getData("payload_cog", cog) && cog[2] == 0.03, "so is the centre of gravity");
  Check(client.getWriter().sendInputDoubleRegister(24, 0.125), "an input is sent");
  bool echoed = false;
  for (int k = 0; k < 500 && !echoed; ++k) {
    double value = 0;
    echoed = client.getDataPackageBlocking(package) &&
             package->getData("input_double_register_24", value) && value == 0.125;
  }
  Check(echoed, "and its echo comes back");
  return g_failures == 0 ? 0 : 1;
}
