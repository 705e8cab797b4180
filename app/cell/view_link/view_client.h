// Viewer's end of the view link: receives the daemon's newest state and images.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/cell/view_link/view_state.h"
#include "drivers/back_off.h"
#include "drivers/os/descriptor.h"
#include "firmware-like/result.h"

namespace plumbline::cell {

/// A state with the viewer's own copy of its images.
struct View {
  ViewState state;
  /// Image of one camera, in the format that its ViewImage states; empty if there is no image.
  struct Pixels {
    std::vector<std::uint8_t> bytes;
    std::uint32_t stamp = 0;  ///< stamp of the image
    int memory = 0;           ///< number of the shared memory that it was copied from
  };
  std::vector<Pixels> pixels;
};

/// problem() if the socket exists, but not for this process's user.
inline constexpr const char* kMayNotConnect = "this user may not connect to plumblined";
/// problem() if nobody listens at the socket.
inline constexpr const char* kNotRunning = "plumblined is not running";

/// Connects and reconnects automatically, with growing pauses. Always returns the newest state;
/// older ones in the socket are discarded, without being read. Used by one thread.
class ViewClient {
 public:
  /// @param images  if false, only states are read: nothing is copied and View::pixels stays empty
  explicit ViewClient(std::string path, bool images = true)
      : path_(std::move(path)), images_(images) {}
  ~ViewClient();
  ViewClient(const ViewClient&) = delete;
  ViewClient& operator=(const ViewClient&) = delete;

  /// Waits up to `timeout_s` for a state newer than the last.
  /// @return  false if none arrived; `view` is then unchanged
  bool Read(double timeout_s, View& view);

  bool connected() const { return static_cast<bool>(socket_); }
  /// Why no states arrive; empty while they do.
  const std::string& problem() const { return problem_; }
  const std::string& path() const { return path_; }

 private:
  bool Connect();
  void Disconnect(std::string problem);
  /// What arrived since the last call; descriptors are invalid where nothing did.
  struct Arrived {
    os::Descriptor state, points;
  };
  /// Receives one message. @return  false if there is none, or the connection has ended
  bool Receive(Arrived& arrived);
  /// Parses what arrived into fresh_, or sets problem_.
  bool Take(const Arrived& arrived);
  bool MapMemory(const os::Descriptor& memory, std::size_t slot_bytes);
  bool CopyImages(View& view) const;
  bool CopyImage(const ViewImage& image, View::Pixels& pixels) const;

  const std::string path_;
  const bool images_;
  os::Descriptor socket_;
  const std::uint8_t* at_ = nullptr;
  std::size_t bytes_ = 0, slot_bytes_ = 0;
  int memory_ = 0;  ///< number of the shared memory, counted by this client
  BackOff back_off_;
  std::vector<ViewPoint> points_;    ///< received last
  std::uint64_t points_number_ = 1;  ///< of that list
  View fresh_;  ///< assembled here, so that the caller's state and pixels always match
  std::string problem_ = "waiting for plumblined";
};

}  // namespace plumbline::cell
