#include "tests/drivers/zoom/fake_visca_camera.h"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace plumbline::test {

FakeViscaCamera::FakeViscaCamera(Answer answer)
    : fd_(posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)), answer_(std::move(answer)) {
  if (fd_ < 0 || grantpt(fd_) != 0 || unlockpt(fd_) != 0) std::abort();
  device_ = ptsname(fd_);
  thread_ = std::thread([this] { Run(); });
}

FakeViscaCamera::~FakeViscaCamera() {
  stop_ = true;
  thread_.join();
  close(fd_);
}

void FakeViscaCamera::SendBytes(const Bytes& bytes) const {
  if (write(fd_, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size())) std::abort();
}

void FakeViscaCamera::SetAnswer(Answer answer) {
  const std::lock_guard lock(mutex_);
  answer_ = std::move(answer);
}

int FakeViscaCamera::RequestCount(const Bytes& prefix) const {
  const std::lock_guard lock(mutex_);
  return static_cast<int>(
      std::count_if(received_.begin(), received_.end(), [&prefix](const Bytes& request) {
        return request.size() >= prefix.size() &&
               std::equal(prefix.begin(), prefix.end(), request.begin());
      }));
}

void FakeViscaCamera::Run() {
  Bytes request;
  while (!stop_) {
    pollfd wait{.fd = fd_, .events = POLLIN, .revents = 0};
    if (poll(&wait, 1, 5) <= 0) continue;
    std::uint8_t byte = 0;
    if (read(fd_, &byte, 1) != 1) {  // the line is not open
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      continue;
    }
    request.push_back(byte);
    if (byte != 0xFF) continue;
    Bytes answer;
    {
      const std::lock_guard lock(mutex_);
      received_.push_back(request);
      answer = answer_(request);
    }
    ++requests_;
    request.clear();
    if (!answer.empty()) SendBytes(answer);
  }
}

Bytes BlockOf(int zoom, int focus, bool digital, bool moving) {
  const auto nibble = [](int value, int place) {
    return static_cast<std::uint8_t>(value >> (4 * place) & 0x0F);
  };
  return {0x90,
          0x50,
          nibble(zoom, 3),
          nibble(zoom, 2),
          nibble(zoom, 1),
          nibble(zoom, 0),
          0,
          0,
          nibble(focus, 3),
          nibble(focus, 2),
          nibble(focus, 1),
          nibble(focus, 0),
          0,
          static_cast<std::uint8_t>(digital ? 2 : 0),
          static_cast<std::uint8_t>(moving ? 1 : 0),
          0xFF};
}

FakeViscaCamera::Answer CameraAnswers(std::function<Bytes()> block) {
  return [block = std::move(block)](const Bytes& request) -> Bytes {
    if (request == Bytes{0x88, 0x30, 0x01, 0xFF}) return {0x88, 0x30, 0x02, 0xFF};
    if (request == Bytes{0x81, 0x09, 0x7E, 0x7E, 0x00, 0xFF}) return block();
    return {0x90, 0x60, 0x02, 0xFF};
  };
}

}  // namespace plumbline::test
