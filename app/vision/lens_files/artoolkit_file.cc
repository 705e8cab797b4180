#include "app/vision/lens_files/artoolkit_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

namespace plumbline::vision {
namespace {

constexpr std::size_t kHeadBytes = 8, kMatrixNumbers = 12, kNumberBytes = 8;
constexpr std::size_t kFactors4 = 9, kFactors5 = 17;
constexpr int kLargestSide_px = 65536;

constexpr std::size_t SizeOfFile(std::size_t factors) {
  return kHeadBytes + kNumberBytes * (kMatrixNumbers + factors);
}
constexpr std::array kOldSizes = {SizeOfFile(4), SizeOfFile(5), SizeOfFile(6)};

std::uint64_t BigEndian(std::string_view bytes, std::size_t at, std::size_t count) {
  std::uint64_t value = 0;
  for (std::size_t k = 0; k < count; ++k) {
    value = value << 8U | static_cast<std::uint8_t>(bytes[at + k]);
  }
  return value;
}

int SideAt(std::string_view bytes, std::size_t at) {
  return static_cast<int>(static_cast<std::int32_t>(BigEndian(bytes, at, 4)));
}

void Append(std::uint64_t value, std::size_t count, std::string& bytes) {
  for (std::size_t k = count; k-- > 0;) bytes += static_cast<char>(value >> (8 * k) & 0xFFU);
}

}  // namespace

bool IsArToolKitFile(std::string_view bytes) {
  const bool old = std::ranges::find(kOldSizes, bytes.size()) != kOldSizes.end();
  if (!old && bytes.size() != SizeOfFile(kFactors4) && bytes.size() != SizeOfFile(kFactors5)) {
    return false;
  }
  // The first byte of a plausible width is zero, which no text starts with.
  return bytes.front() == 0;
}

Result<lens::KnownLens> LensFromArToolKit(std::string_view bytes) {
  if (std::ranges::find(kOldSizes, bytes.size()) != kOldSizes.end()) {
    return Error{
        "a parameter file of ARToolKit 1 to 3, whose distortion model cannot be converted; "
        "calibrate the camera again"};
  }
  const bool version5 = bytes.size() == SizeOfFile(kFactors5);
  if (!version5 && bytes.size() != SizeOfFile(kFactors4)) {
    return Error{
        fmt::format("{} bytes are not a parameter file of ARToolKit 4 or 5, which has {} "
                    "or {}; copy the file again",
                    bytes.size(), SizeOfFile(kFactors4), SizeOfFile(kFactors5))};
  }
  std::array<double, kFactors5> factors{};
  const std::size_t count = version5 ? kFactors5 : kFactors4;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t at = kHeadBytes + kNumberBytes * (kMatrixNumbers + k);
    factors.at(k) = std::bit_cast<double>(BigEndian(bytes, at, kNumberBytes));
    if (!std::isfinite(factors.at(k))) {
      return Error{
          fmt::format("distortion factor {} is not finite; calibrate the camera again", k + 1)};
    }
  }
  constexpr std::size_t kDistortion5 = 12;
  const std::size_t focal = version5 ? kDistortion5 : 4;
  lens::KnownLens known;
  known.size = {SideAt(bytes, 0), SideAt(bytes, 4)};
  known.lens.fx = factors.at(focal);
  known.lens.fy = factors.at(focal + 1);
  known.lens.cx = factors.at(focal + 2);
  known.lens.cy = factors.at(focal + 3);
  std::vector<double> terms(factors.begin(), factors.begin() + static_cast<std::ptrdiff_t>(focal));
  if (!version5) terms.push_back(0);
  lens::SetDistortion(terms, false, known.lens);
  const auto sound = [](int side) { return side >= 1 && side <= kLargestSide_px; };
  if (!sound(known.size.width) || !sound(known.size.height)) {
    return Error{fmt::format("the image size {} x {} is not that of an image; copy the file again",
                             known.size.width, known.size.height)};
  }
  if (!(known.lens.fx > 0) || !(known.lens.fy > 0)) {
    return Error{"its focal length is not positive; calibrate the camera again"};
  }
  return known;
}

Result<std::string> ArToolKitBytes(const lens::KnownLens& known) {
  const lens::Lens& lens = known.lens;
  if (lens.fisheye) {
    return Error{"ARToolKit has no fisheye model; write the lens as .xml or .yaml"};
  }
  if (!UsableEverywhere(known)) {
    return Error{
        "the lens is known in a part of the image only, which this format cannot state; write it "
        "as .xml or .yaml"};
  }
  std::string bytes;
  Append(static_cast<std::uint32_t>(known.size.width), 4, bytes);
  Append(static_cast<std::uint32_t>(known.size.height), 4, bytes);
  const auto put = [&bytes](double value) {
    Append(std::bit_cast<std::uint64_t>(value), kNumberBytes, bytes);
  };
  for (const double value :
       {lens.fx, 0.0, lens.cx, 0.0, 0.0, lens.fy, lens.cy, 0.0, 0.0, 0.0, 1.0, 0.0}) {
    put(value);
  }
  const bool further = lens.k3 != 0 || ModelOf(lens) != lens::LensModel::kUsual;
  for (const double value : {lens.k1, lens.k2, lens.p1, lens.p2}) put(value);
  for (const double value :
       {lens.k3, lens.k4, lens.k5, lens.k6, lens.s1, lens.s2, lens.s3, lens.s4}) {
    if (further) put(value);
  }
  for (const double value : {lens.fx, lens.fy, lens.cx, lens.cy, 1.0}) put(value);
  return bytes;
}

}  // namespace plumbline::vision
