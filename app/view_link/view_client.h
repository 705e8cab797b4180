// The viewer's side: the newest state and its image.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/view_link/view_state.h"
#include "drivers/back_off.h"
#include "drivers/os/descriptor.h"
#include "firmware-like/result.h"
#include "firmware-like/status/scene_status.h"

namespace plumbline {

/// A state with its pixels, the viewer's own copy.
struct View {
  ViewState state;
  /// Of each camera of the state, as its image says; empty: none.
  struct Pixels {
    std::vector<std::uint8_t> bytes;
    std::uint32_t stamp = 0;  ///< of the image that they are of
    int memory = 0;           ///< that it lay in, as the client counts them
  };
  std::vector<Pixels> pixels;
};

/// Connects by itself, again after a pause that grows. Always the newest state: older ones that
/// wait are passed over. Used by one thread.
class ViewClient {
 public:
  /// @param images  false: states alone, nothing is copied and View::pixels stays empty
  explicit ViewClient(std::string path, bool images = true)
      : path_(std::move(path)), images_(images) {}
  ~ViewClient();
  ViewClient(const ViewClient&) = delete;
  ViewClient& operator=(const ViewClient&) = delete;

  /// Waits at most `timeout_s` for a state newer than the last. @return  false: none came
  bool Read(double timeout_s, View& view);

  /// Says what was measured, where the daemon listens to this user; it is not waited for.
  void Tell(const SceneStatus& scene);

  bool connected() const { return static_cast<bool>(socket_); }
  /// Why there is no state, in words that say what to do; empty while they come.
  const std::string& problem() const { return problem_; }

 private:
  bool Connect();
  void Disconnect(std::string problem);
  bool TakeMemory(const Descriptor& memory, std::size_t slot_bytes);
  bool CopyImages(View& view) const;
  bool CopyImage(const ViewImage& image, View::Pixels& pixels) const;

  const std::string path_;
  const bool images_;
  Descriptor socket_;
  const std::uint8_t* at_ = nullptr;
  std::size_t bytes_ = 0, slot_bytes_ = 0;
  int memory_ = 0;  ///< counts up with each that was handed over
  BackOff back_off_;
  std::vector<char> message_;
  View fresh_;  ///< what comes is put together here: state and pixels belong together
  std::string problem_ = "not connected yet";
};

}  // namespace plumbline
