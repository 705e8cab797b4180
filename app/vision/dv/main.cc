// plumbline-dv: sandboxed decoder of DV frames. Started by plumbline and plumblined, which survive
// its crash; the only program that loads libavcodec.
//
//   plumbline-dv decode < FRAMES > ANSWERS
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <iostream>
#include <new>
#include <string_view>

#include "app/version.h"
#include "app/vision/dv/dv_codec.h"
#include "drivers/camera/dv_field.h"
#include "drivers/os/sandbox.h"

namespace {

using namespace plumbline;

/// It maps 163 MB, nearly all of it libraries.
constexpr std::uint64_t kMemory_bytes = std::uint64_t{512} << 20;

/// @return false at the end of the input
bool ReadAll(std::span<std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t got = read(STDIN_FILENO, bytes.data(), bytes.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    bytes = bytes.subspan(got);
  }
  return true;
}

bool WriteAll(std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t wrote = write(STDOUT_FILENO, bytes.data(), bytes.size());
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote <= 0) return false;
    bytes = bytes.subspan(wrote);
  }
  return true;
}

/// Reads one frame, whose first block states its size.
/// @return  nothing at the end of the input, or if it is not a frame
std::span<const std::uint8_t> ReadFrame(std::vector<std::uint8_t>& buffer) {
  buffer.resize(camera::kMaxDifFrameBytes);
  const auto header = std::span(buffer).first(camera::kDifBlockBytes);
  if (!ReadAll(header)) return {};
  const auto size = camera::DifFrameBytesOfHeader(header);
  if (!size || !ReadAll(std::span(buffer).subspan(header.size(), *size - header.size()))) return {};
  return std::span(buffer).first(*size);
}

/// Answers frames until the input ends.
int DecodeFrames(vision::DvCodec& codec) {
  std::vector<std::uint8_t> buffer, yuyv;
  for (;;) {
    const std::span<const std::uint8_t> frame = ReadFrame(buffer);
    if (frame.empty()) return 0;
    const auto format = camera::CheckDifFrame(frame);
    camera::DvAnswerHeader answer;
    if (format && codec.DecodeLowerField(frame, *format, yuyv)) {
      answer.rows = static_cast<std::uint32_t>(camera::FieldRows(*format));
    } else {
      yuyv.clear();
    }
    std::array<std::uint8_t, sizeof answer> header{};
    std::memcpy(header.data(), &answer, sizeof answer);
    if (!WriteAll(header) || !WriteAll(yuyv)) return 1;
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 || std::string_view(argv[1]) != "decode") {
    std::cerr << "plumbline-dv " PLUMBLINE_VERSION
                 ": started by plumbline and plumblined; see plumbline cameras --help\n";
    return 2;
  }
  const auto codec = vision::DvCodec::Load();
  if (!codec) return camera::kDvNoLibrary;
  std::set_new_handler([] { _exit(1); });
  if (!os::EnterSandbox(kMemory_bytes, std::nullopt)) return camera::kDvNoSandbox;
  // Skip destructors: those of a damaged state could take arbitrarily long.
  _exit(DecodeFrames(*codec));
}
