#include "app/plant/publish/change_detector.h"

#include <bit>
#include <cmath>

#include "app/base/text/json_text.h"
#include "firmware-like/snapshot.h"

namespace plumbline::plant {
namespace {

constexpr int kMemorySchema = 1;
/// Status bits that change in normal operation and are irrelevant to a plant.
constexpr std::uint16_t kVolatileBits = status::kToggle | status::kBusy | status::kResultValid;

std::int64_t Milliseconds(double utc_s) {
  return std::llround(1e3 * utc_s);
}

bool Differs(const cell::ViewPoint& a, const cell::ViewPoint& b, double change_m) {
  return a.valid != b.valid || a.extrapolated != b.extrapolated || a.code != b.code ||
         (a.valid && !((a.translation_B - b.translation_B).norm() <= change_m));
}

}  // namespace

ChangeDetector::ChangeDetector(const config::MqttConfig& config, FleetCell cell,
                               const std::string& memory)
    : config_(config), cell_(std::move(cell)) {
  const auto json = text::JsonOrNull(memory);
  if (!json.is_object() || json.value("schema", 0) != kMemorySchema) return;
  alarms_ = json.value("alarms", std::uint16_t{0});
  warnings_ = json.value("warnings", std::uint16_t{0});
  silent_ = json.value("silent", false);
  model_version_ = json.value("model", kNotReported);
  lenses_ = json.value("lenses", std::vector<int>());
}

std::string ChangeDetector::Memory() const {
  return text::JsonText(nlohmann::ordered_json{{"schema", kMemorySchema},
                                               {"alarms", alarms_},
                                               {"warnings", warnings_},
                                               {"silent", silent_},
                                               {"model", model_version_},
                                               {"lenses", lenses_}});
}

void ChangeDetector::UpdateWord(const char* word, std::uint16_t bits,
                                std::span<const plc::BitMeaning> meanings, std::uint16_t& reported,
                                std::map<std::uint16_t, TimedBit>& timed,
                                const cell::ViewState& state, double now_s,
                                std::vector<Message>& messages) {
  for (const plc::BitMeaning& meaning : meanings) {
    TimedBit& bit = timed[meaning.mask];
    const bool set = (bits & meaning.mask) != 0, was = (reported & meaning.mask) != 0;
    if (set || bit.seen_s < -1e299) {  // reported by a previous run: its time starts now
      bit.seen_s = now_s;
      bit.seen_utc_s = state.utc_s;
    }
    if (set == was || (was && now_s - bit.seen_s < kAlarmOff_s)) continue;
    reported = static_cast<std::uint16_t>(reported ^ meaning.mask);
    messages.push_back({MessageKind::kAlarm, Milliseconds(bit.seen_utc_s),
                        AlarmBody(word, std::countr_zero(meaning.mask), meaning.meaning, set)});
  }
}

void ChangeDetector::UpdatePoints(const cell::ViewState& state, double now_s,
                                  std::vector<Message>& messages) {
  for (const cell::ViewPoint& point : state.points) {
    if (point.code == correction::CorrectionCode::kPending) continue;
    const auto known = points_.find(point.id);
    if (known != points_.end() && (now_s - known->second.at_s < config_.change_period_s ||
                                   !Differs(point, known->second.point, config_.point_change_m))) {
      continue;
    }
    points_[point.id] = {point, now_s};
    messages.push_back({MessageKind::kPoint, Milliseconds(state.utc_s),
                        PointBody(point, cell_, state.model_version)});
  }
}

void ChangeDetector::UpdateState(const cell::ViewState& state, double now_s,
                                 std::vector<Message>& messages) {
  std::vector<int> summary = {state.status & ~kVolatileBits, state.alarms, state.warnings,
                              state.model_version,
                              plc::registers::MonitoringWord(state.monitoring)};
  summary.insert(summary.end(), lenses_.begin(), lenses_.end());
  const double since_s = now_s - state_s_;
  if (since_s < config_.change_period_s) return;
  if (since_s < config_.state_period_s && summary == summary_) return;
  state_s_ = now_s;
  summary_ = std::move(summary);
  messages.push_back({MessageKind::kState, Milliseconds(state.utc_s), StateBody(state, cell_)});
}

void ChangeDetector::UpdateLenses(const cell::ViewState& state, std::vector<Message>& messages) {
  lenses_.resize(state.cameras.size(), kNotReported);
  for (std::size_t k = 0; k < lenses_.size(); ++k) {
    const status::CameraStatus& status = state.cameras[k].status;
    const int lens = status.configured ? static_cast<int>(status.state) : kNotReported;
    if (lens == lenses_[k]) continue;
    lenses_[k] = lens;
    if (!status.configured) continue;
    messages.push_back({MessageKind::kLens, Milliseconds(state.utc_s), LensBody(status)});
  }
}

std::vector<Message> ChangeDetector::Update(const cell::ViewState& state, double now_s) {
  std::vector<Message> messages;
  received_s_ = now_s;
  if (silent_) {
    silent_ = false;
    messages.push_back({MessageKind::kAlarm, Milliseconds(state.utc_s),
                        AlarmBody("fleet", 0, "no data from plumblined", false)});
  }
  if (state.model_version != model_version_) {
    messages.push_back(
        {MessageKind::kModel, Milliseconds(state.utc_s), ModelBody(state, model_version_)});
    model_version_ = state.model_version;
  }
  UpdateLenses(state, messages);
  UpdateWord("alarms", state.alarms, plc::registers::AlarmBits(), alarms_, alarm_times_, state,
             now_s, messages);
  UpdateWord("warnings", state.warnings, plc::registers::WarningBits(), warnings_, warning_times_,
             state, now_s, messages);
  UpdatePoints(state, now_s, messages);
  UpdateState(state, now_s, messages);
  return messages;
}

std::vector<Message> ChangeDetector::UpdateWithoutState(double now_s, double utc_s) {
  if (received_s_ < -1e299) received_s_ = now_s;
  if (silent_ || now_s - received_s_ < kSilent_s) return {};
  silent_ = true;
  state_s_ = -1e300;  // report the next state at once
  return {{MessageKind::kAlarm, Milliseconds(utc_s),
           AlarmBody("fleet", 0, "no data from plumblined", true)}};
}

}  // namespace plumbline::plant
