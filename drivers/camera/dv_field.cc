#include "drivers/camera/dv_field.h"

#include <cstring>
#include <opencv2/imgproc.hpp>

#include "drivers/camera/pixel_format.h"

namespace plumbline::camera {
namespace {

RawImage FieldImage(const DvField& field) {
  return {PixelFormat::kYuyv,
          {kDvWidth_px, FieldRows(field.format)},
          static_cast<std::ptrdiff_t>(kDvRowBytes),
          field.yuyv};
}

/// @param type  of OpenCV, of both images
void ScaleToSquare(const DvField& field, int type, std::uint8_t* from, std::uint8_t* to) {
  const auto [width, height] = SquareSize(field.format);
  cv::Mat square(height, width, type, to);
  cv::resize(cv::Mat(FieldRows(field.format), kDvWidth_px, type, from), square, square.size(), 0, 0,
             cv::INTER_LINEAR);
}

}  // namespace

std::optional<std::size_t> DvAnswerBytes(
    const std::array<std::uint8_t, sizeof(DvAnswerHeader)>& header, const DifFormat& format) {
  DvAnswerHeader answer;
  std::memcpy(&answer, header.data(), sizeof answer);
  if (answer.magic != DvAnswerHeader::kMagic) return std::nullopt;
  if (answer.rows == 0) return 0;
  if (answer.rows != static_cast<std::uint32_t>(FieldRows(format))) return std::nullopt;
  return kDvRowBytes * answer.rows;
}

image::LumaView SquareLuma(const DvField& field, std::vector<std::uint8_t>& field_luma,
                           std::vector<std::uint8_t>& buffer) {
  const auto [width, height] = SquareSize(field.format);
  // Cannot fail: the size of the field was checked by DvAnswerBytes().
  if (!LumaOf(FieldImage(field), field_luma)) return {};
  buffer.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  ScaleToSquare(field, CV_8UC1, field_luma.data(), buffer.data());
  return {buffer.data(), width, height, width};
}

void SquareBgr(const DvField& field, std::vector<std::uint8_t>& bgr) {
  const auto [width, height] = SquareSize(field.format);
  std::vector<std::uint8_t> narrow;
  bgr.clear();
  if (!BgrOf(FieldImage(field), narrow)) return;
  bgr.resize(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  ScaleToSquare(field, CV_8UC3, narrow.data(), bgr.data());
}

}  // namespace plumbline::camera
