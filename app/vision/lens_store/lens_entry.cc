#include "app/vision/lens_store/lens_entry.h"

#include <cmath>
#include <cstring>

#include "app/base/target/declared_facts.h"
#include "firmware-like/lens/lens_curve.h"

namespace plumbline::vision {
namespace {

class Hash {
 public:
  void Add(const void* data, std::size_t size) {
    const auto* bytes = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < size; ++i) {
      value_ ^= bytes[i];
      value_ *= 0x100000001b3;
    }
  }
  void Add(std::int64_t value) { Add(&value, sizeof value); }
  void Add(double value) {
    if (value == 0) value = 0;  // -0 and 0 hash alike: text storage may lose the sign
    Add(&value, sizeof value);
  }
  void Add(const std::string& text) {
    Add(static_cast<std::int64_t>(text.size()));
    Add(text.data(), text.size());
  }
  void Add(const std::optional<double>& value) {
    Add(std::int64_t{value.has_value()});
    Add(value.value_or(0));
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325;
};

}  // namespace

std::uint64_t ChecksumOf(const LensEntry& entry) {
  Hash hash;
  hash.Add(entry.key.camera_serial);
  hash.Add(entry.key.mode);
  hash.Add(std::int64_t{entry.key.zoom_counts});
  hash.Add(std::int64_t{entry.key.focus_counts.has_value()});
  hash.Add(std::int64_t{entry.key.focus_counts.value_or(0)});
  const bool usual = ModelOf(entry.lens) == lens::LensModel::kUsual;
  const Eigen::Index count = usual ? lens::kUsualParameters : lens::kLensParameters;
  const lens::LensVector parameters = lens::VectorOfLens(entry.lens);
  for (const double value : parameters.head(count)) hash.Add(value);
  for (const double value : entry.covariance.topLeftCorner(count, count).reshaped())
    hash.Add(value);
  if (!usual) hash.Add(std::int64_t{entry.lens.fisheye});
  if (std::isfinite(entry.usable_radius_px)) hash.Add(entry.usable_radius_px);
  hash.Add(std::int64_t{entry.size.width});
  hash.Add(std::int64_t{entry.size.height});
  hash.Add(entry.rms_px);
  hash.Add(entry.board);
  hash.Add(entry.pupil_shift_m);
  hash.Add(entry.uncertainty_px);
  hash.Add(entry.temp_C);
  hash.Add(entry.utc);
  hash.Add(std::string(entry.corners.begin(), entry.corners.end()));
  const std::string declared = TextOf(entry.declared);
  if (!declared.empty()) hash.Add(declared);
  return hash.value();
}

std::optional<std::string> FaultOf(const LensEntry& entry) {
  if (entry.key.camera_serial.empty()) return "no camera serial";
  if (entry.key.mode.empty()) return "no mode of the camera";
  if (!lens::VectorOfLens(entry.lens).allFinite()) return "a lens parameter is not finite";
  if (!(entry.lens.fx > 0 && entry.lens.fy > 0)) return "a focal length is not positive";
  if (!entry.covariance.allFinite()) return "the covariance is not finite";
  if (entry.covariance.diagonal().minCoeff() < 0) return "a variance is negative";
  const double scale = entry.covariance.cwiseAbs().maxCoeff();
  if (!((entry.covariance - entry.covariance.transpose()).cwiseAbs().maxCoeff() <= 1e-9 * scale)) {
    return "the covariance is not symmetric";
  }
  if (entry.size.width <= 0 || entry.size.height <= 0) return "the image size is not positive";
  const bool finite =
      std::isfinite(entry.rms_px) && std::isfinite(entry.pupil_shift_m.value_or(0)) &&
      std::isfinite(entry.temp_C.value_or(0)) && std::isfinite(entry.uncertainty_px.value_or(0));
  if (!finite || entry.rms_px < 0 || entry.uncertainty_px.value_or(0) < 0) {
    return "RMS, uncertainty, pupil shift or temperature is not a number";
  }
  if (!(entry.usable_radius_px > 0)) return "the usable region is empty";
  if (entry.utc.empty()) return "no date";
  return std::nullopt;
}

}  // namespace plumbline::vision
