// Fuzzer: arbitrary bytes as one of the camera files, chosen by the first byte: zoom recording,
// lens, tags and bodies, stored reference tags. The result is plausible values or a reason.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "app/base/config/body_reader.h"
#include "app/vision/camera/tag_baseline_store.h"
#include "app/vision/lens/lens_json.h"
#include "drivers/zoom/replay_zoom.h"
#include "firmware-like/lens/lens_curve.h"

namespace {

using namespace plumbline;  // NOLINT(google-build-using-namespace)

void Require(bool condition) {
  if (!condition) std::abort();
}

bool IsRotation(const Mat3& R) {
  return R.isUnitary(1e-6) && R.determinant() > 0;
}

void Zoom(std::string_view text) {
  const auto rows = zoom::ZoomRowsFromCsv(text);
  if (!rows) return Require(!rows.error().empty());
  bool ascend = true;
  for (std::size_t k = 0; k < rows->size(); ++k) {
    Require(std::isfinite((*rows)[k].t_s));
    ascend = ascend && (k == 0 || (*rows)[k].t_s > (*rows)[k - 1].t_s);
  }
  auto sensor = zoom::ReplayZoom::Create(*rows, [] { return 1000.0; });
  Require(sensor.ok() == (ascend && !rows->empty()));
  if (!sensor) return;
  lens::ZoomReading reading;
  const zoom::ZoomResult result = sensor.value()->Read(reading);
  Require(result == (rows->front().lost ? zoom::ZoomResult::kTimeout : zoom::ZoomResult::kOk));
}

void LensText(std::string_view text) {
  const auto file = vision::LensFromJson(text);
  if (!file) return Require(!file.error().empty());
  Require(file->size.width > 0 && file->size.height > 0);
  Require(lens::VectorOfLens(file->lens).allFinite() && file->lens.fx > 0 && file->lens.fy > 0);
  Require(file->covariance.allFinite() && file->covariance.diagonal().minCoeff() >= 0);
}

void Bodies(std::string_view text) {
  config::FaultList faults;
  const auto database = config::TagDatabaseFromText(text, "bodies.toml", faults);
  Require(database.has_value() != faults.HasFaults());
  if (!database) return;
  for (const target::Body& body : database->bodies) {
    Require(!body.name.empty());
    for (const target::BodyTag& tag : body.tags) {
      Require(tag.id >= 0 && tag.side_m > 0 && tag.X_KM.p.allFinite() && IsRotation(tag.X_KM.R));
    }
  }
}

void Marks(std::string_view text) {
  const target::Body cell{"cell",
                          {{3, 0.06, Pose()}, {4, 0.06, Pose{Mat3::Identity(), Vec3(0.5, 0, 0)}}}};
  const auto memories = vision::TagBaselinesFromJson(std::string(text), cell);
  if (!memories) return Require(!memories.error().empty());
  for (const auto& [lens, memory] : memories->by_lens) {
    Require(IsRotation(memory.X_CK.R) && memory.X_CK.p.allFinite());
    for (const auto& [id, tag] : memory.tags) {
      for (const lens::Vec2& residual : tag.residual_px) Require(residual.allFinite());
      Require(tag.covariance.allFinite() && tag.covariance.diagonal().minCoeff() >= 0);
    }
  }
  const auto again = vision::TagBaselinesFromJson(vision::TagBaselinesJson(*memories, cell), cell);
  Require(again.ok() && again->by_lens.size() == memories->by_lens.size() &&
          again->contradicted == memories->contradicted);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  constexpr void (*kReaders[])(std::string_view) = {Zoom, LensText, Bodies, Marks};
  kReaders[data[0] % 4](text);
  return 0;
}
