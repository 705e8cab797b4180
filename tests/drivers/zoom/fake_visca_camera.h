// Fake VISCA camera at the far end of a pseudo-terminal; works on bytes, independent of the codec.
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

/// Runs one thread. Every request, split at FF, is passed to `answer`, whose result is written
/// unchanged. CameraAnswers() behaves like an ordinary camera.
class FakeViscaCamera {
 public:
  using Answer = std::function<Bytes(const Bytes& request)>;
  explicit FakeViscaCamera(Answer answer);
  ~FakeViscaCamera();
  FakeViscaCamera(const FakeViscaCamera&) = delete;
  FakeViscaCamera& operator=(const FakeViscaCamera&) = delete;

  const std::string& device() const { return device_; }
  void SendBytes(const Bytes& bytes) const;  ///< unsolicited
  void SetAnswer(Answer answer);             ///< replaces the behaviour
  int requests() const { return requests_; }
  /// Number of requests with these first bytes.
  int RequestCount(const Bytes& prefix) const;

 private:
  void Run();
  int fd_;
  std::string device_;
  std::atomic<bool> stop_{false};
  std::atomic<int> requests_{0};
  mutable std::mutex mutex_;  ///< guards both below
  Answer answer_;
  std::vector<Bytes> received_;
  std::thread thread_;
};

/// Lens block as sent by camera 1.
Bytes BlockOf(int zoom, int focus, bool digital, bool moving);
/// Behaviour of an ordinary camera with the lens block given by `block`.
FakeViscaCamera::Answer CameraAnswers(std::function<Bytes()> block);

}  // namespace plumbline::test
