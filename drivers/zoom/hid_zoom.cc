#include "drivers/zoom/hid_zoom.h"

#include <fmt/format.h>

#include <array>
#include <utility>

#include "drivers/zoom/registry.h"

namespace plumbline::zoom {
namespace {

constexpr ZoomOption kHidOptions[] = {
    {.key = "timeout_ms",
     .value = [](ZoomConnection& to) -> double& { return to.hid.timeout_s; },
     .min = 10,
     .max = 10000,
     .to_si = kSecondPerMs},
    {.key = "profile",
     .value = FileOption{},
     .description = "for \"hid\": a file in profiles/zoom",
     .example = "\"computar-lensconnect\""},
    {.key = "serial",
     .value = [](ZoomConnection& to) -> std::string& { return to.hid.serial; },
     .description = "for \"hid\": serial number, to distinguish identical devices",
     .example = "\"A1\""},
};

using Report = std::array<std::uint8_t, kMaxHidReportBytes + 1>;

}  // namespace

Result<std::unique_ptr<ZoomSensor>> HidZoom::Create(HidOptions options, Clock clock) {
  if (const auto fault = FaultOf(options.profile)) {
    return Error{fmt::format("HID profile \"{}\": {}", options.profile.name, *fault)};
  }
  if (!(options.timeout_s >= 0.01 && options.timeout_s <= 10)) {
    return Error{fmt::format("HID: timeout {} s is outside 0.01..10", options.timeout_s)};
  }
  return std::unique_ptr<ZoomSensor>(new HidZoom(std::move(options), clock));
}

HidZoom::HidZoom(HidOptions options, Clock clock) : options_(std::move(options)), clock_(clock) {}

hid::HidName HidZoom::Name() const {
  return {options_.profile.vendor_id, options_.profile.product_id, options_.serial};
}

ZoomResult HidZoom::Fail(ZoomResult result, const std::string& why) {
  device_.Close();
  back_off_.Failed(clock_());
  problem_ = fmt::format("{} ({}): {}", options_.profile.name, hid::NameText(Name()), why);
  return result;
}

bool HidZoom::Open() {
  has_received_ = false;
  if (device_.Open(Name())) return true;
  Fail(ZoomResult::kLost, hid::kOpenRemedy);
  return false;
}

ZoomResult HidZoom::Read(lens::ZoomReading& reading) {
  const double deadline_s = clock_() + options_.timeout_s;
  if (!device_) {
    if (!back_off_.Due(clock_())) return ZoomResult::kWaiting;
    if (!Open()) return ZoomResult::kLost;
  }
  lens::ZoomReading found;
  for (const HidExchange& exchange : options_.profile.exchanges) {
    const ZoomResult result = exchange.send.empty() ? Receive(exchange, deadline_s, found)
                                                    : Query(exchange, deadline_s, found);
    if (result != ZoomResult::kOk) return result;
  }
  back_off_.Well();
  found.time_s = clock_();
  reading = found;
  return ZoomResult::kOk;
}

ZoomResult HidZoom::Query(const HidExchange& exchange, double deadline_s,
                          lens::ZoomReading& reading) {
  Report report;
  int size = 0;
  while ((size = device_.Read(report, 0)) > 0) {
    if (clock_() > deadline_s) return Fail(ZoomResult::kProtocol, "sends reports without end");
  }
  if (size < 0) return Fail(ZoomResult::kLost, hid::kLostRemedy);
  for (const auto& send : exchange.send) {
    if (!device_.Write(send)) {
      return Fail(ZoomResult::kLost, "a report cannot be sent. Check its cable.");
    }
  }
  for (;;) {
    const double left_s = deadline_s - clock_();
    if (left_s <= 0) return Fail(ZoomResult::kTimeout, "no answer in time");
    size = device_.Read(report, left_s);
    if (size < 0) return Fail(ZoomResult::kLost, hid::kLostRemedy);
    if (size == 0) continue;
    switch (ReadingFromReport(exchange, {report.data(), static_cast<std::size_t>(size)}, reading)) {
      case HidAnswer::kRead:
        return ZoomResult::kOk;
      case HidAnswer::kOther:
        break;
      case HidAnswer::kShort:
        return Fail(ZoomResult::kProtocol, fmt::format("an answer of {} bytes is too short", size));
      case HidAnswer::kNotReady:  // repeat the last report, which requests the data
        if (!device_.Write(exchange.send.back())) {
          return Fail(ZoomResult::kLost, "a report cannot be sent. Check its cable.");
        }
        break;
    }
  }
}

/// Takes all pending reports; waits only for the first.
ZoomResult HidZoom::Receive(const HidExchange& exchange, double deadline_s,
                            lens::ZoomReading& reading) {
  bool received_now = false, moved = false;
  for (;;) {
    const double left_s = deadline_s - clock_();
    const bool wait = !received_now && left_s > 0;
    Report report;
    const int size = device_.Read(report, wait ? left_s : 0);
    if (size < 0) return Fail(ZoomResult::kLost, hid::kLostRemedy);
    if (size == 0 && (!wait || clock_() >= deadline_s)) break;
    if (size == 0) continue;
    const HidAnswer answer =
        ReadingFromReport(exchange, {report.data(), static_cast<std::size_t>(size)}, received_);
    if (answer == HidAnswer::kShort) {
      return Fail(ZoomResult::kProtocol, fmt::format("a report of {} bytes is too short", size));
    }
    if (answer == HidAnswer::kRead) {
      received_now = has_received_ = true;
      moved = moved || received_.moved;
    }
    if (clock_() > deadline_s) break;
  }
  if (!received_now && !(has_received_ && options_.profile.silence_is_unchanged)) {
    return Fail(ZoomResult::kTimeout, "sent no report in time");
  }
  reading = received_;
  reading.moved = moved;
  return ZoomResult::kOk;
}

const ZoomKind kHidKind{
    .name = "hid",
    .make = [](const ZoomConnection& to) { return HidZoom::Create(to.hid, to.clock); },
    .identity =
        [](const ZoomConnection& to) {
          return fmt::format("{:04x}:{:04x} {}", to.hid.profile.vendor_id,
                             to.hid.profile.product_id, to.hid.serial);
        },
    .device = [](const ZoomConnection&) { return Result<std::string>(""); },
    .period_s = kQuickZoomPeriod_s,
    .options = kHidOptions};

}  // namespace plumbline::zoom
