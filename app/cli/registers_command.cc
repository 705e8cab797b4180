#include "app/cli/registers_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <bit>
#include <iostream>
#include <nlohmann/json.hpp>

#include "app/cli/exit_codes.h"
#include "drivers/plc/register_map.h"

namespace plumbline {
namespace {

template <typename Field>
std::string Row(const Field& field, int base) {
  const int address = base + field.address;
  return fmt::format("| {} | {} | {} | {} | {} | {} |\n", address, 40001 + address,
                     NameOf(field.type), field.name, field.unit, field.meaning);
}

constexpr const char* kHead =
    "| address | 4xxxx | type | name | unit | meaning |\n|---|---|---|---|---|---|\n";

constexpr const char* kIntroduction = R"(# The register map

This page is written by `plumbline registers` from the table that drives the server
(`drivers/plc/register_map.cc`); a test holds the two together.

Addresses are zero-based, as they travel on the wire; the 4xxxx form is beside them. FC03 and FC04
read the same image. Every request is answered from one immutable snapshot, so that a block read in
one request is never torn. 32-bit values take two registers, high word first (ABCD), or low word
first (CDAB) by `plc.word_order`; check yours with registers 4-7. Unit ids 0, 1, 255 and the
configured one are answered. Function codes: 1-6, 15, 16, 22, 23, 43/14. Registers between two
entries of a window read as 0; addresses outside the windows answer exception 02, and so does
writing anything but the command window.

## A command

1. Write the parameters (1000-1037), then a new number to `command_sequence` (1039), or all of it
   in one FC16.
2. Read 100-139 in one FC03 until `result_echo` is your number.
3. Use the pose only where `result_begin` equals `result_end` and bit 0 of `result_validity` is set;
   otherwise `result_code` says why there is none.
4. The result stays as it is until you acknowledge it (command 5, or a rising edge of coil 1000) or
   give the next command; so a controller that reads register by register gets one result. Repeating
   a sequence changes nothing. When robot input becomes stale the valid bit clears and values stay.
   A refused command has no pose: 104-129 and 204-217 are 0.

There is one command window, for one master. Clients of two addresses that write it within 5 s of
each other, or two connections of one address that both go on writing, are reported by warning bit
15, in the log and by 425-427, which hold the ends of their addresses; nobody is locked out. A
master that reconnects is one, and the heartbeat (1030) is no command.

A configured point needs no command: its block is refreshed every cycle. Its pose is the one to
*command* for the tool point (the controller's TCP set to the unloaded tool), in the robot's base
frame, so that the loaded tool lands where the point is.

## A probe

With the robot standing, measure the loaded tip (a touch probe, a tracker) and give it by command 6
or 7. The result then holds the tip that the model predicts (104-115, base frame) and measured minus
predicted (116-121, base frame; its length in 216). Code 0 means: taken. It is on the disk when
`probes` (404) has counted it. Command 11 takes the tip as the camera sees it (514-519), while its
lens is valid and the tool stands. Of two cameras that see it (1016 is 0) it takes the mean, weighed
by their noise; code 16 where they contradict each other.

Code 17: 0, 0, 0, given in metres, or beyond the arm's reach; code 18: the robot moved (424 is 1
once it stands); code 11: the journal is being opened, give it again. None of these is recorded; 420
counts 17 and 18, 423 says which. Code 20: recorded, but in quarantine, for it contradicts the model
by more than any plausible effect; 104-121 hold prediction and difference without the valid bit.

## The camera

`camera_state` 4: what the camera measures may be used. In any other state bit 0 of `camera_bits` is
set, tip and bodies are not valid, and `camera_reason` says why; bit 3 asks a person for the
calibration board. Command 9 starts a calibration (a board that comes into view while it is asked
for starts it too), `board_prompt` then says what to show, command 10 cancels. The second camera has
the same blocks 200 registers further; `command_camera` (1016) says which one commands 9 to 11 mean.
)";

/// `text` with line ends in place of blanks, so that no line is longer than the house's 100.
std::string Wrapped(std::string text) {
  constexpr std::size_t kLongest = 100;
  std::size_t start = 0;
  while (text.size() - start > kLongest) {
    const std::size_t blank = text.rfind(' ', start + kLongest);
    if (blank == std::string::npos || blank <= start) break;
    text[blank] = '\n';
    start = blank + 1;
  }
  return text;
}

/// `Alarm word (register 12; ...): 0 nothing read from the robot, 1 ...`
std::string BitsParagraph(const std::string& word, std::span<const BitMeaning> bits) {
  std::string text = word + ":";
  for (const BitMeaning& bit : bits) {
    text += fmt::format("{} {} {}", &bit == bits.data() ? "" : ",", std::countr_zero(bit.mask),
                        bit.meaning);
  }
  return Wrapped(text + ".") + "\n\n";
}

/// `Health reasons (register 25): alarms 1 emergency stop, ...; attention ...; notices ...`
std::string HealthReasons() {
  std::string text = "Health reasons (register 25), the gravest first:";
  HealthSeverity severity = HealthSeverity::kGood;
  for (int number = 1; number <= static_cast<int>(kLastHealthReason); ++number) {
    const auto reason = static_cast<HealthReason>(number);
    const std::string meaning = Describe(reason);
    if (meaning.empty() || reason == HealthReason::kNoDaemon) continue;  // never in a register
    const bool first = SeverityOf(reason) != severity;
    severity = SeverityOf(reason);
    text += first ? fmt::format("{} {}:", number == 1 ? "" : ";", Describe(severity)) : ",";
    text += fmt::format(" {} {}", number, meaning);
  }
  return Wrapped(text + ".") + "\n\n";
}

std::string BitsAndCodes() {
  return "\n## Bits and codes\n\n" +
         BitsParagraph("Status word (register 11; discrete inputs 0-15)", plc_map::StatusBits()) +
         BitsParagraph("Alarm word (register 12; discrete inputs 16-31)", plc_map::AlarmBits()) +
         BitsParagraph("Warning word (register 14; discrete inputs 32-47)",
                       plc_map::WarningBits()) +
         BitsParagraph("Camera bits (registers 502 and 702)", plc_map::CameraBits()) +
         BitsParagraph(fmt::format("Posture bits (registers {} + {} k)", plc_map::kPostures + 24,
                                   plc_map::kPostureSize),
                       plc_map::PostureBits()) +
         "Coils: 1000 acknowledge the result (rising edge), 1001 operated by hand.\n\n";
}

}  // namespace

std::string RegisterMapMarkdown() {
  std::string page = kIntroduction;
  page += "\n## Fixed registers (read only)\n\n";
  page += kHead;
  for (const MapField& field : plc_map::Fields()) page += Row(field, 0);
  page += fmt::format(
      "\n## Camera (read only)\n\nThe first camera's; the second one's, and its bodies, begin {} "
      "further.\n\n",
      plc_map::kCameraStride);
  page += kHead;
  for (const MapField& field : plc_map::CameraFields()) page += Row(field, 0);
  page += fmt::format(
      "\n## Block of the first tracked body (read only)\n\nThe block of the k-th body of the "
      "tags' file (k from 0 to {}) begins at {} + {} k.\n\n",
      CameraStatus::kMostBodies - 1, plc_map::kBodies, plc_map::kBodySize);
  page += kHead;
  for (const MapField& field : plc_map::BodyFields()) page += Row(field, plc_map::kBodies);
  page += "\n## Virtual objects (read only)\n\n";
  page += kHead;
  for (const MapField& field : plc_map::SceneFields()) page += Row(field, 0);
  page += fmt::format(
      "\n## Block of the first configured point (read only)\n\nThe block of the k-th point (k from "
      "0) begins at {} + {} k.\n\n",
      plc_map::kPoints, plc_map::kPointSize);
  page += kHead;
  for (const MapField& field : plc_map::PointFields()) page += Row(field, plc_map::kPoints);
  page += fmt::format(
      "\n## Posture of the first configured point (read only)\n\nThe joints that the controller is "
      "commanded to for the k-th point (k from 0) begin at {} + {} k.\n\n",
      plc_map::kPostures, plc_map::kPostureSize);
  page += kHead;
  for (const MapField& field : plc_map::PostureFields()) page += Row(field, plc_map::kPostures);
  page += "\n## Command window (read and write)\n\n";
  page += kHead;
  for (const CommandField& field : plc_map::Commands()) page += Row(field, 0);
  page += BitsAndCodes();
  page += HealthReasons();
  page += "Result codes: ";
  for (int code = 0; code <= static_cast<int>(kLastCorrectionCode); ++code) {
    page += fmt::format("{}{} {}", code == 0 ? "" : ", ", code,
                        Describe(static_cast<CorrectionCode>(code)));
  }
  page += ".\n\nInput faults: ";
  for (int fault = 0; fault <= static_cast<int>(InputFault::kTcpMismatch); ++fault) {
    page += fmt::format("{}{} {}", fault == 0 ? "" : ", ", fault,
                        Describe(static_cast<InputFault>(fault)));
  }
  page += ".\n\nCamera reasons (registers 501 and 701): ";
  for (int reason = 0; reason <= static_cast<int>(ZoomReason::kBoardCancelled); ++reason) {
    page += fmt::format("{}{} {}", reason == 0 ? "" : ", ", reason,
                        ZoomReasonText(static_cast<ZoomReason>(reason)));
  }
  page += ".\n\nBoard prompts (registers 503 and 703): ";
  for (int prompt = 1; prompt < kBoardPrompts; ++prompt) {
    page += fmt::format("{}{} {}", prompt == 1 ? "0 none, " : ", ", prompt,
                        BoardPromptText(static_cast<BoardPrompt>(prompt)));
  }
  return page + ".\n";
}

namespace {

nlohmann::json AsJson() {
  nlohmann::json map = nlohmann::json::array();
  const auto add = [&map](const auto& field, int base, const char* window,
                          const std::string& of = "") {
    map.push_back({{"address", base + field.address},
                   {"type", NameOf(field.type)},
                   {"name", of + field.name},
                   {"unit", field.unit},
                   {"meaning", field.meaning},
                   {"window", window}});
  };
  for (const MapField& field : plc_map::Fields()) add(field, 0, "fixed");
  for (int k = 0; k < static_cast<int>(kMostCameras); ++k) {
    const int further = plc_map::kCameraStride * k;
    const char* const of = k == 0 ? "" : "second_";
    for (const MapField& field : plc_map::CameraFields()) add(field, further, "fixed", of);
    for (const MapField& field : plc_map::BodyFields()) {
      add(field, plc_map::kBodies + further, "body", of);
    }
  }
  for (const MapField& field : plc_map::SceneFields()) add(field, 0, "fixed");
  for (const MapField& field : plc_map::PointFields()) add(field, plc_map::kPoints, "point");
  for (const MapField& field : plc_map::PostureFields()) {
    add(field, plc_map::kPostures, "posture");
  }
  for (const CommandField& field : plc_map::Commands()) add(field, 0, "command");
  return map;
}

}  // namespace

void AddRegistersCommand(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("registers", "The Modbus register map as a document");
  auto json = std::make_shared<bool>(false);
  command->add_flag("--json", *json, "For programs that generate PLC tags");
  command->footer("Example:\n  plumbline registers > register-map.md");
  command->callback([json, &exit_code] {
    std::cout << (*json ? AsJson().dump(1) + "\n" : RegisterMapMarkdown());
    exit_code = kExitOk;
  });
}

}  // namespace plumbline
