#include "app/cli/status_devices.h"

#include <fmt/format.h>

#include <string>

#include "app/base/text/text.h"
#include "app/cli/rounded.h"
#include "firmware-like/correction/correct.h"

namespace plumbline::cli {
namespace {

/// "x 1.23, y 4.56, z 7.89 mm, ±0.42 mm (95 %)": a measured position with the digits that its
/// radius leaves.
std::string PositionText(const Vec3& p_mm, double radius_mm) {
  const int decimals = text::DecimalsFor({radius_mm}, 0);
  return fmt::format("x {:.{}f}, y {:.{}f}, z {:.{}f} mm, ±{:.{}f} mm (95 %)",
                     WithoutNegativeZero(p_mm.x(), decimals), decimals,
                     WithoutNegativeZero(p_mm.y(), decimals), decimals,
                     WithoutNegativeZero(p_mm.z(), decimals), decimals, radius_mm, decimals);
}

std::string Age(double age_ms) {
  return age_ms >= 65535 ? "never or long ago" : fmt::format("{:.0f} ms ago", age_ms);
}

/// "12 s", "5 min", "3.5 h".
std::string GaugeTimeText(double time_s) {
  if (time_s < 120) return fmt::format("{:.0f} s", time_s);
  return time_s < 7200 ? fmt::format("{:.0f} min", time_s / 60)
                       : fmt::format("{:.1f} h", time_s / 3600);
}

/// A tracked body of a camera, both counted from 0.
void PrintBody(const DaemonRegisters& daemon, int camera, int body, std::ostream& out) {
  const auto value = [&](const char* name) { return daemon.Body(name, camera, body); };
  const bool valid = (static_cast<int>(value("body_validity")) & plc::registers::kValid) != 0;
  const std::string text =
      valid ? fmt::format("{}, seen {}",
                          PositionText({value("body_x"), value("body_y"), value("body_z")},
                                       value("body_radius")),
                          Age(value("body_age")))
            : "not visible, or the lens is not valid";
  PrintStatusLine(out, "body", fmt::format("{:<5}  {}", body + 1, text));
}

}  // namespace

void PrintStatusLine(std::ostream& out, std::string_view topic, std::string_view text) {
  out << fmt::format("{:<12} {}\n", topic, text);
}

std::string BitsText(int word, std::span<const plc::BitMeaning> bits) {
  if (word == 0) return "none";
  std::string text = fmt::format("0x{:04X}:", word);
  const char* separator = " ";
  for (const plc::BitMeaning& bit : bits) {
    if ((word & bit.mask) == 0) continue;
    text += separator + std::string(bit.meaning);
    separator = ", ";
  }
  return text;
}

void PrintCamera(const DaemonRegisters& daemon, int camera, std::ostream& out) {
  const auto line = [&](std::string_view topic, std::string_view text) {
    PrintStatusLine(out, topic, text);
  };
  const auto value = [&](const char* name) { return daemon.Camera(name, camera); };
  const auto number = [&](const char* name) { return static_cast<int>(value(name)); };
  const int state = number("camera_state");
  const std::string called = daemon.CameraName(camera);
  line(called.empty() ? "camera" : "camera " + called,
       fmt::format("{}: {}", lens::ZoomStateText(static_cast<lens::ZoomState>(state - 1)),
                   lens::ZoomReasonText(static_cast<lens::ZoomReason>(number("camera_reason")))));
  line("", fmt::format("zoom {}, read {}; last frame {}; {}", number("zoom"),
                       Age(value("zoom_age")), Age(value("camera_age")),
                       number("lens") > 0 ? fmt::format("lens {} of the store", number("lens"))
                                          : std::string("no stored lens")));
  const int usable_px = number("lens_usable_radius");
  if (usable_px > 0 && usable_px != plc::registers::kWholeImage) {
    line("", fmt::format("lens usable up to {} px from the middle of the image; nothing is "
                         "measured beyond",
                         usable_px));
  }
  if (const int bits = number("camera_bits"); bits != 0) {
    line("", BitsText(bits, plc::registers::CameraBits()));
  }
  if (const int tags = number("contradicting_tags"); tags > 0) {
    line("", fmt::format("reference tag {}{} contradicts the others; the log names each",
                         number("contradicting_tag"),
                         tags > 1 ? fmt::format(" and {} more", tags - 1) : ""));
  }
  if (const int prompt = number("board_prompt"); prompt > 0) {
    line("board", fmt::format("{} ({} view{})",
                              lens::BoardPromptText(static_cast<lens::BoardPrompt>(prompt)),
                              number("board_views"), number("board_views") == 1 ? "" : "s"));
  }
  for (int k = 0; k < number("bodies"); ++k) PrintBody(daemon, camera, k, out);
  if ((number("tip_validity") & plc::registers::kValid) != 0) {
    line("tip", fmt::format("{}, measured by camera",
                            PositionText({value("tip_x"), value("tip_y"), value("tip_z")},
                                         value("tip_radius"))));
  }
}

void PrintMotionLink(const DaemonRegisters& daemon, std::ostream& out) {
  const auto value = [&](const char* name) { return daemon.MotionLink(name); };
  const auto state = static_cast<status::MotionLinkState>(value("motion_link_state"));
  if (state == status::MotionLinkState::kOff) return;
  const auto obstacle = static_cast<motion_offset::Obstacle>(value("motion_link_obstacle"));
  std::string text = Describe(state);
  if (state == status::MotionLinkState::kCorrecting) {
    text += fmt::format(", {:.3f} mm of {:.3f} mm", value("motion_link_offset"),
                        value("motion_link_wanted"));
  } else if (obstacle == motion_offset::Obstacle::kNoPackets && value("motion_link_ignored") > 0) {
    text +=
        ": packets arrive, but none from the controller's address and in the form of `kind`; "
        "the log says where they come from";
  } else {
    const std::string_view remedy = RemedyOf(obstacle);
    text += fmt::format(": {}{}{}", Describe(obstacle), remedy.empty() ? "" : "; ", remedy);
    if (value("motion_link_wanted") > 0) {
      text += fmt::format(". Wanted: {:.3f} mm", value("motion_link_wanted"));
    }
  }
  PrintStatusLine(out, "motion link", text);
  PrintStatusLine(out, "",
                  fmt::format("{:.0f} packets answered, {:.0f} lost, {:.0f} ignored; longest "
                              "answer {:.2f} ms; late by the controller's count: {:.0f}",
                              value("motion_link_answered"), value("motion_link_lost"),
                              value("motion_link_ignored"), 1e-3 * value("motion_link_longest"),
                              value("motion_link_late")));
}

std::string GaugeOutcomeText(const DaemonRegisters& daemon, int gauge) {
  using enum status::GaugeOutcome;
  const auto code = static_cast<unsigned>(daemon.Gauge("gauge_outcome", gauge));
  constexpr auto kFirstRefusal = static_cast<unsigned>(kRefused);
  if (code > kFirstRefusal) {
    return fmt::format("not recorded: {}",
                       Describe(static_cast<correction::CorrectionCode>(code - kFirstRefusal)));
  }
  switch (static_cast<status::GaugeOutcome>(code)) {
    case kNone:
      return "no press yet";
    case kRecorded:
      return "recorded";
    case kUnreadable:
      return "latest press not recorded: unreadable data (see `plumbline log`)";
    case kFault:
      return "latest press not recorded: the gauge reported a fault (see `plumbline log`)";
    case kContinuous:
      return "not recorded: it sends without a press";
    case kNoAnswer:
      return "not recorded: the control cycle did not answer";
    case kWaiting:
      return "not in the journal yet";
    case kNotKept:
      return "not recorded: monitoring was switched off or the arm was changed meanwhile";
    case kRefused:
      break;
  }
  return fmt::format("outcome {}", code);
}

void PrintGauge(const DaemonRegisters& daemon, int gauge, std::ostream& out) {
  const auto state = static_cast<status::GaugeState>(daemon.Gauge("gauge_state", gauge));
  const std::string reading =
      daemon.HasGaugeReading(gauge)
          ? fmt::format("{:.4f} mm, {} ago",
                        WithoutNegativeZero(daemon.Gauge("gauge_reading", gauge), 4),
                        GaugeTimeText(1e-3 * daemon.Gauge("gauge_age", gauge)))
          : "no reading yet";
  PrintStatusLine(out, "gauge " + daemon.GaugeName(gauge),
                  fmt::format("{}, for {}; {}", Describe(state),
                              GaugeTimeText(daemon.Gauge("gauge_state_age", gauge)),
                              daemon.Gauge("gauge_outcome", gauge) > 0
                                  ? reading + ", " + GaugeOutcomeText(daemon, gauge)
                                  : reading));
}

void PrintObjects(const DaemonRegisters& daemon, std::ostream& out) {
  const auto number = [&](const char* name) { return static_cast<int>(daemon.Scene(name)); };
  if (number("scene_age") >= 65535) return;
  std::string text = number("scene_state") == 2   ? "INTERFERENCE"
                     : number("scene_state") == 1 ? "apart"
                                                  : "unknown";
  if (number("scene_object_a") > 0) {
    text += fmt::format(", nearest: {} and {}, {:.2f} mm", number("scene_object_a"),
                        number("scene_object_b"), daemon.Scene("scene_distance"));
  }
  if (const int pairs = number("scene_near"); pairs > 0) {
    text += fmt::format(", {} pair{} near", pairs, pairs == 1 ? "" : "s");
  }
  if (const int pairs = number("scene_unmeasured"); pairs > 0) {
    text += fmt::format(", {} pairs not measured", pairs);
  }
  PrintStatusLine(out, "objects", text);
}

}  // namespace plumbline::cli
