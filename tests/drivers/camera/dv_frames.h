// DV frames for tests: bare block structure, and pictures encoded by libavcodec's DV encoder, which
// shares no code with the driver. Decoder and encoder of libavcodec are separate code.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

struct AVCodecContext;
struct AVFrame;
struct AVPacket;

namespace plumbline::test {

/// A frame with valid blocks and no picture.
std::vector<std::uint8_t> BareDvFrame(bool lines_625, bool wide = false);

/// Encodes whole pictures of 720 x 576 or 720 x 480.
class DvEncoder {
 public:
  /// @param column, line  of the frame; the lower field has the odd lines
  using Luma = std::function<double(int column, int line)>;
  struct Colour {
    int u = 128, v = 128;
  };

  explicit DvEncoder(bool lines_625);
  ~DvEncoder();
  DvEncoder(const DvEncoder&) = delete;
  DvEncoder& operator=(const DvEncoder&) = delete;

  /// False if this libavcodec has no DV encoder.
  bool usable() const { return packet_ != nullptr; }
  std::vector<std::uint8_t> Encode(const Luma& luma) { return Encode(luma, {128, 128}); }
  std::vector<std::uint8_t> Encode(const Luma& luma, Colour colour);
  /// A uniform picture.
  std::vector<std::uint8_t> Uniform(int level);

 private:
  AVCodecContext* context_ = nullptr;
  AVFrame* picture_ = nullptr;
  AVPacket* packet_ = nullptr;
};

}  // namespace plumbline::test
