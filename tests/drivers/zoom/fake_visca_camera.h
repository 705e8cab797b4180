// A camera at the far end of a pseudo-terminal; it knows bytes, and nothing of the codec.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace plumbline::test {

using Bytes = std::vector<std::uint8_t>;

/// One thread. Every request, cut at FF, is shown to `answer`, and what that returns is written as
/// it stands. CameraAnswers() is what an ordinary camera does.
class FakeViscaCamera {
 public:
  using Answer = std::function<Bytes(const Bytes& request)>;
  explicit FakeViscaCamera(Answer answer);
  ~FakeViscaCamera();
  FakeViscaCamera(const FakeViscaCamera&) = delete;
  FakeViscaCamera& operator=(const FakeViscaCamera&) = delete;

  const std::string& device() const { return device_; }
  void Say(const Bytes& bytes) const;  ///< unasked
  void Become(Answer answer);          ///< from now on
  int requests() const { return requests_; }
  /// How often a request with these first bytes came.
  int Heard(const Bytes& beginning) const;

 private:
  void Run();
  int fd_;
  std::string device_;
  std::atomic<bool> stop_{false};
  std::atomic<int> requests_{0};
  mutable std::mutex mutex_;  ///< guards both below
  Answer answer_;
  std::vector<Bytes> heard_;
  std::thread thread_;
};

/// A lens block as camera 1 sends it.
Bytes BlockOf(int zoom, int focus, bool digital, bool moving);
/// Addresses itself as cameras do; the lens block as given by `block`.
FakeViscaCamera::Answer CameraAnswers(std::function<Bytes()> block);

}  // namespace plumbline::test
