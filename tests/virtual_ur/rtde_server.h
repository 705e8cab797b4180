// RTDE server of a virtual Universal Robots controller, with selectable faults.
//
// Written from the public description of the protocol; shares no code with the product.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <vector>

namespace virtual_ur {

/// What the controller knows; names and units as in RTDE.
struct UrState {
  double timestamp = 0;
  std::array<double, 6> actual_q{};
  std::array<double, 6> tcp_pose{};    ///< x, y, z [m], rotation vector [rad]
  std::array<double, 6> tcp_offset{};  ///< likewise
  double payload = 0;
  std::array<double, 3> payload_cog{};
  std::array<double, 6> joint_temperatures{};
  std::int32_t robot_mode = 7, safety_status = 1;
  std::uint32_t runtime_state = 2;
  double speed_slider_fraction = 1;
  std::uint32_t speed_slider_mask = 0;
  std::array<std::int32_t, 48> output_int{}, input_int{};
  std::array<double, 48> output_double{}, input_double{};
};

/// Faults, switched by SetFault().
struct RtdeFaults {
  int highest_version = 2;
  std::set<std::string> missing, in_use;           ///< fields answered NOT_FOUND or IN_USE
  std::map<std::string, std::string> wrong_types;  ///< field -> type that is claimed
  bool refuse_recipe = false, refuse_start = false;
  bool split = false;           ///< every message is sent in pieces of one to seven bytes
  int merge = 1;                ///< so many data packages are sent together
  bool text_between = false;    ///< a text message before each reply
  double text_every_s = 0;      ///< a text message this often; 0: none
  int drop_each = 0;            ///< every such output cycle is skipped; 0: none
  double jitter_s = 0;          ///< a package is delayed by up to this
  bool silent = false;          ///< connections stay open, nothing is sent
  bool garbage = false;         ///< the next bytes sent are not RTDE
  bool foreign_recipe = false;  ///< packages carry another recipe id
  bool emergency = false;
};

class RtdeServer {
 public:
  static constexpr double kCycle_s = 0.002;

  /// @param port  0: chosen by the kernel. @throws std::runtime_error if it cannot listen
  explicit RtdeServer(int port = 0, std::string address = "127.0.0.1");
  ~RtdeServer();
  RtdeServer(const RtdeServer&) = delete;
  RtdeServer& operator=(const RtdeServer&) = delete;

  int port() const { return port_; }
  UrState& state() { return state_; }
  int clients() const { return static_cast<int>(clients_.size()); }
  int connections() const { return connections_; }    ///< accepted so far
  int slow_readers() const { return slow_readers_; }  ///< connections closed for that

  /// Serves requests for at most until `until_s` (CLOCK_MONOTONIC).
  void Serve(double until_s);
  /// One controller cycle: sends data packages to the clients that are due.
  void Cycle();
  /// Cycle() with the time of the controller advanced by kCycle_s.
  void Advance();

  /// "missing FIELD", "in-use FIELD", "version 1", "refuse-start on".. (README.md).
  /// @return  an error message, or empty
  std::string SetFault(const std::string& words);

  /// Called when a client has written its input fields.
  std::function<void()> on_inputs;
  /// Called before data packages are sent.
  std::function<void()> on_outputs;

 private:
  struct Client;
  struct Recipe {
    std::vector<std::string> fields;
    double frequency = 125;
  };

  void Accept();
  bool ReadFrom(Client& client);
  bool Answer(Client& client, std::uint8_t type, const std::vector<std::uint8_t>& payload);
  bool SetUp(Client& client, std::uint8_t type, const std::vector<std::uint8_t>& payload);
  bool TakeInputs(Client& client, const std::vector<std::uint8_t>& payload);
  bool SendData(Client& client);
  bool Send(Client& client, std::uint8_t type, const std::vector<std::uint8_t>& payload);
  bool SendText(Client& client, const std::string& text);
  bool Write(Client& client, const std::uint8_t* bytes, std::size_t size);
  bool Flush(Client& client);
  bool OwnedByOther(const Client& client, const std::string& field) const;
  void CloseAll();

  int listener_ = -1;
  int port_ = 0;
  UrState state_;
  RtdeFaults faults_;
  std::vector<std::unique_ptr<Client>> clients_;
  int connections_ = 0, slow_readers_ = 0;
  std::uint64_t cycle_ = 0;
  double text_due_s_ = 0;
  std::mt19937 random_{1};
};

double MonotonicNow();

}  // namespace virtual_ur
