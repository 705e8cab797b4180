#include "tests/drivers/camera/dv_frames.h"

#include <algorithm>
#include <cmath>

extern "C" {
#include <libavcodec/avcodec.h>
}

namespace plumbline::test {

std::vector<std::uint8_t> BareDvFrame(bool lines_625, bool wide) {
  const int sequences = lines_625 ? 12 : 10;
  std::vector<std::uint8_t> frame;
  const auto add = [&](int section, int sequence, int number) {
    const std::size_t at = frame.size();
    frame.resize(at + 80);
    frame[at] = static_cast<std::uint8_t>(section << 5 | 0x1F);
    frame[at + 1] = static_cast<std::uint8_t>(sequence << 4 | 7);
    frame[at + 2] = static_cast<std::uint8_t>(number);
  };
  for (int s = 0; s < sequences; ++s) {
    add(0, s, 0);
    for (int n = 0; n < 2; ++n) add(1, s, n);
    for (int n = 0; n < 3; ++n) add(2, s, n);
    for (int group = 0; group < 9; ++group) {
      add(3, s, group);
      for (int n = 0; n < 15; ++n) add(4, s, 15 * group + n);
    }
  }
  for (int s = 0; s < sequences; ++s) {
    frame[static_cast<std::size_t>(s) * 12000 + 3] = lines_625 ? 0x80 : 0;
  }
  frame[453] = 0x61;  // video source control, in the third auxiliary block of the first sequence
  frame[455] = wide ? 2 : 0;
  return frame;
}

DvEncoder::DvEncoder(bool lines_625) {
  const AVCodec* const encoder = avcodec_find_encoder(AV_CODEC_ID_DVVIDEO);
  if (encoder == nullptr) return;
  context_ = avcodec_alloc_context3(encoder);
  context_->width = 720;
  context_->height = lines_625 ? 576 : 480;
  context_->pix_fmt = lines_625 ? AV_PIX_FMT_YUV420P : AV_PIX_FMT_YUV411P;
  context_->time_base = lines_625 ? AVRational{1, 25} : AVRational{1001, 30000};
  context_->flags |= AV_CODEC_FLAG_INTERLACED_DCT;
  context_->thread_count = 1;
  picture_ = av_frame_alloc();
  picture_->width = context_->width;
  picture_->height = context_->height;
  picture_->format = context_->pix_fmt;
  if (avcodec_open2(context_, encoder, nullptr) == 0 && av_frame_get_buffer(picture_, 0) == 0) {
    packet_ = av_packet_alloc();
  }
}

DvEncoder::~DvEncoder() {
  av_packet_free(&packet_);
  av_frame_free(&picture_);
  avcodec_free_context(&context_);
}

std::vector<std::uint8_t> DvEncoder::Encode(const Luma& luma, Colour colour) {
  if (av_frame_make_writable(picture_) != 0) return {};
  for (int line = 0; line < picture_->height; ++line) {
    for (int column = 0; column < picture_->width; ++column) {
      picture_->data[0][line * picture_->linesize[0] + column] =
          static_cast<std::uint8_t>(std::lround(std::clamp(luma(column, line), 16.0, 235.0)));
    }
  }
  const bool half = picture_->format == AV_PIX_FMT_YUV420P;
  const int rows = half ? picture_->height / 2 : picture_->height, columns = half ? 360 : 180;
  for (int row = 0; row < rows; ++row) {
    std::fill_n(picture_->data[1] + row * picture_->linesize[1], columns, colour.u);
    std::fill_n(picture_->data[2] + row * picture_->linesize[2], columns, colour.v);
  }
  if (avcodec_send_frame(context_, picture_) != 0 ||
      avcodec_receive_packet(context_, packet_) != 0) {
    return {};
  }
  std::vector<std::uint8_t> frame(packet_->data, packet_->data + packet_->size);
  av_packet_unref(packet_);
  return frame;
}

std::vector<std::uint8_t> DvEncoder::Uniform(int level) {
  return Encode([level](int, int) { return level; });
}

}  // namespace plumbline::test
