// Command `plumbline registers`: prints the register map as a document.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <bit>
#include <iostream>

#include "app/base/text/json_text.h"
#include "app/cli/commands.h"
#include "app/cli/failure.h"
#include "app/cli/registers_scan.h"
#include "drivers/plc/register_map.h"

namespace plumbline::cli {
namespace {

template <typename Field>
std::string Row(const Field& field, int base) {
  const int address = base + field.address;
  // Numbers that do not fit in five digits have six.
  const int number = address < 9999 ? 40001 + address : 400001 + address;
  return fmt::format("| {} | {} | {} | {} | {} | {} |\n", address, number, NameOf(field.type),
                     field.name, field.unit, field.meaning);
}

constexpr const char* kHead =
    "| address | 4xxxx | type | name | unit | meaning |\n|---|---|---|---|---|---|\n";

constexpr const char* kIntroduction = R"(# The register map

With this page you can read and write every register of the Modbus server. `plumbline registers`
prints it from the tables that drive the server (`drivers/plc/*_registers.cc`), with `--json` for
programs that generate PLC tags.

Addresses are zero-based, as on the wire; the 4xxxx form is given beside them. FC03 and FC04 read
the same image. Every request is answered from one immutable snapshot, so a block that is read in
one request is always consistent. Unit ids 0, 1, 255 and the configured one are answered. Function
codes: 1-6, 15, 16, 22, 23, 43/14. Registers between two entries of a block read as 0. Addresses
outside the blocks, and writes outside the command window, are answered with exception 02.

## Types, ranges and invalid values

| type | registers | range | out of range |
|---|---|---|---|
| u16 | 1 | 0 to 65535 | saturates, unless it is a counter |
| i16 | 1 | -32768 to 32767 | saturates |
| u32 | 2 | 0 to 4294967295 | saturates |
| i32 | 2 | -2147483648 to 2147483647 | saturates |
| float32 | 2 | IEEE 754, always finite | keeps its previous value |
| u64 | 4 | 0 to 18446744073709551615 | never |

Values of more than one register are sent high word first (ABCD) or low word first (CDAB), as
configured by `plc.word_order`; registers 4-7 let you check your setting. A scaled integer counts the
unit that is given for it: 123 in a register with unit 0.1 mm is 12.3 mm.

NaN and infinity never occur. Use the values of a block only if bit 0 of its validity register is
set (`input_validity`, `result_validity`, `scaled_validity`, `point_validity`, `posture_validity`,
`tip_validity`, `body_validity`). While it is clear, a configured point shows its last valid pose
and a refused command shows 0. Where a special number means "unknown", the table says so: an age of
65535 ms is "older than that, or never", a `scene_distance` of -1 is unknown. A row without a
meaning continues the row above it.

## A command

1. Write the parameters (1000-1037), then a new number to `command_sequence` (1039), or all of it
   in one FC16.
2. Read 100-139 (100-143 for quaternions or an arm of fewer than six axes) in one FC03 until
   `result_echo` is your number.
3. Use the pose only if `result_begin` equals `result_end` and bit 0 of `result_validity` is set;
   otherwise `result_code` gives the reason.
4. The result is held until you acknowledge it (command 5, or a rising edge of coil 1000) or send
   the next command, so a controller that reads single registers still gets one consistent result.
   Writing the same sequence again has no effect. If the robot input becomes stale the valid bit is
   cleared and the values stay. For a refused command 104-129 and 204-217 are 0.

There is one command window, for one master. Two masters are reported by warning bit 15, in the log
and in registers 425-427, which identify them by the last two bytes of their addresses; neither is
locked out. Two masters are clients with different addresses that write commands within 5 s of each
other, or two connections from one address that both keep writing. A master that reconnects counts
as one, and writing the heartbeat (1030) does not count as a command.

A configured point needs no command: its block is refreshed in every cycle. Its pose is the command
pose of the TCP (set to the unloaded tool in the controller) in the robot base frame: command it,
and the loaded tool lands on the point.

## A probe

With the robot at standstill, measure the loaded tip (with a touch probe or a tracker) and report
it with command 6 or 7. The result then holds the tip predicted by the model (104-115, base frame)
and the residual, measured minus predicted (116-121, base frame; its magnitude in 216). Code 0
means that the probe was accepted; it is on the disk once `probes` (404) has counted it. Command 11
takes the tip as measured by camera (514-519); the lens must be valid and the tool at standstill.
If two cameras see the tip (and 1016 is 0) their mean is taken, weighted by their noise; code 16
reports that they contradict each other.

| code | meaning | recorded | what to do |
|---|---|---|---|
| 11 | the journal is still being opened | no | send the probe again |
| 17 | all zero, given in metres, or beyond the arm's reach; 423 says which | no | fix the unit |
| 18 | the robot moved | no | wait until 424 is 1, measure again |
| 20 | contradicts the model by more than any plausible effect | in quarantine | see plumbline journal |

Register 420 counts codes 17 and 18. With code 20, 104-121 hold the prediction and the residual,
but the valid bit is clear.

## The camera

In `camera_state` 4 the measurements of the camera may be used. In every other state bit 0 of
`camera_bits` is set, tip and bodies are not valid, and `camera_reason` gives the reason; bit 3
means that an operator must show the calibration board. If the camera is configured with
`required_for = ["points"]`, the configured points are not valid either (code 14), and commands 1
to 3 are refused with that code. Command 9 starts a calibration (so does a
board that comes into view while it is required), `board_prompt` then says how to hold the board,
and command 10 cancels. The second camera has the same blocks 200 registers further;
`command_camera` (1016) selects the camera for commands 9 to 11.
)";

/// Heading and table of the values of a code, given as a function from code to text.
template <typename Text>
std::string CodeTable(const std::string& heading, int first, int last, Text text) {
  std::string table = fmt::format("\n### {}\n\n| code | meaning |\n|---|---|\n", heading);
  for (int code = first; code <= last; ++code)
    table += fmt::format("| {} | {} |\n", code, text(code));
  return table;
}

std::string BitTable(const std::string& heading, std::span<const plc::BitMeaning> bits) {
  std::string table = fmt::format("\n### {}\n\n| bit | meaning |\n|---|---|\n", heading);
  for (const plc::BitMeaning& bit : bits) {
    table += fmt::format("| {} | {} |\n", std::countr_zero(bit.mask), bit.meaning);
  }
  return table;
}

std::string HealthReasonTable() {
  std::string table =
      "\n### Health reasons (register 25), most severe first\n\n"
      "| code | severity | meaning |\n|---|---|---|\n";
  for (int code = 1; code <= static_cast<int>(kLastHealthReason); ++code) {
    const auto reason = static_cast<HealthReason>(code);
    const std::string meaning = Describe(reason);
    if (meaning.empty() || reason == HealthReason::kNoDaemon) continue;  // not used in a register
    table += fmt::format("| {} | {} | {} |\n", code, Describe(SeverityOf(reason)), meaning);
  }
  return table;
}

std::string BitsAndCodes() {
  return "\n## Bits and codes\n\n"
         "Coils: 1000 acknowledge the result (rising edge), 1001 manual operation, 1002 "
         "corrections inside the motion are allowed (while it is 1 and register 1030 changes).\n" +
         BitTable("Status word (register 11; discrete inputs 0-15)", plc::registers::StatusBits()) +
         BitTable("Alarm word (register 12; discrete inputs 16-31)", plc::registers::AlarmBits()) +
         BitTable("Warning word (register 14; discrete inputs 32-47)",
                  plc::registers::WarningBits()) +
         BitTable("Camera word (registers 502 and 702)", plc::registers::CameraBits()) +
         BitTable(fmt::format("Posture validity (registers {} + {} k)",
                              plc::registers::kPostures + 24, plc::registers::kPostureSize),
                  plc::registers::PostureBits()) +
         HealthReasonTable() +
         CodeTable(
             "Result codes (registers 13, 102, 201 and 2002 + 20 k)", 0,
             static_cast<int>(correction::kLastCorrectionCode),
             [](int code) { return Describe(static_cast<correction::CorrectionCode>(code)); }) +
         CodeTable("Input faults (register 301)", 0, static_cast<int>(kLastInputFault),
                   [](int code) { return Describe(static_cast<InputFault>(code)); }) +
         CodeTable(
             "Camera reasons (registers 501 and 701)", 0, static_cast<int>(lens::kLastZoomReason),
             [](int code) { return lens::ZoomReasonText(static_cast<lens::ZoomReason>(code)); }) +
         CodeTable(
             "Board prompts (registers 503 and 703)", 0, lens::kBoardPrompts - 1, [](int code) {
               return code == 0 ? "none"
                                : std::string(
                                      lens::BoardPromptText(static_cast<lens::BoardPrompt>(code)));
             });
}

/// Text of docs/reference/registers.md, generated from the table that drives the server.
std::string RegisterMapMarkdown() {
  std::string page = kIntroduction;
  page += "\n## Fixed registers (read only)\n\n";
  page += kHead;
  for (const plc::MapField& field : plc::registers::Fields()) page += Row(field, 0);
  page += fmt::format(
      "\n## Camera (read only)\n\nThe first camera. The second camera and its bodies have the same "
      "registers {} further.\n\n",
      plc::registers::kCameraStride);
  page += kHead;
  for (const plc::MapField& field : plc::registers::CameraFields()) page += Row(field, 0);
  page += fmt::format(
      "\n## Block of the first tracked body (read only)\n\nThe block of the k-th body of the "
      "bodies file (k from 0 to {}) starts at {} + {} k.\n\n",
      status::CameraStatus::kMaxBodies - 1, plc::registers::kBodies, plc::registers::kBodySize);
  page += kHead;
  for (const plc::MapField& field : plc::registers::BodyFields())
    page += Row(field, plc::registers::kBodies);
  page += "\n## Virtual objects (read only)\n\n";
  page += kHead;
  for (const plc::MapField& field : plc::registers::SceneFields()) page += Row(field, 0);
  page += "\n## Corrections inside the motion (read only)\n\n";
  page += kHead;
  for (const plc::MapField& field : plc::registers::MotionLinkFields()) page += Row(field, 0);
  page += fmt::format(
      "\n## Block of the first dial gauge (read only)\n\nThe block of the k-th `[[gauge]]` (k from "
      "0 to {}) starts at {} + {} k.\n\n",
      status::kMaxGauges - 1, plc::registers::kGauges, plc::registers::kGaugeSize);
  page += kHead;
  for (const plc::MapField& field : plc::registers::GaugeFields())
    page += Row(field, plc::registers::kGauges);
  page += fmt::format(
      "\n## Block of the first configured point (read only)\n\nThe block of the k-th point (k from "
      "0) starts at {} + {} k.\n\n",
      plc::registers::kPoints, plc::registers::kPointSize);
  page += kHead;
  for (const plc::MapField& field : plc::registers::PointFields())
    page += Row(field, plc::registers::kPoints);
  page += fmt::format(
      "\n## Posture of the first configured point (read only)\n\nThe joint values of the command "
      "pose of the k-th point (k from 0) start at {} + {} k.\n\n",
      plc::registers::kPostures, plc::registers::kPostureSize);
  page += kHead;
  for (const plc::MapField& field : plc::registers::PostureFields())
    page += Row(field, plc::registers::kPostures);
  page += "\n## Command window (read and write)\n\n";
  page += kHead;
  for (const plc::CommandField& field : plc::registers::Commands()) page += Row(field, 0);
  return page + BitsAndCodes();
}

nlohmann::json AsJson() {
  nlohmann::json map = nlohmann::json::array();
  const auto add = [&map](const auto& field, int base, const char* window,
                          const std::string& prefix = "") {
    map.push_back({{"address", base + field.address},
                   {"type", NameOf(field.type)},
                   {"name", prefix + field.name},
                   {"unit", field.unit},
                   {"meaning", field.meaning},
                   {"window", window}});
  };
  for (const plc::MapField& field : plc::registers::Fields()) add(field, 0, "fixed");
  for (int k = 0; k < static_cast<int>(model::kMaxCameras); ++k) {
    const int offset = plc::registers::kCameraStride * k;
    const char* const prefix = k == 0 ? "" : "second_";
    for (const plc::MapField& field : plc::registers::CameraFields())
      add(field, offset, "fixed", prefix);
    for (const plc::MapField& field : plc::registers::BodyFields()) {
      add(field, plc::registers::kBodies + offset, "body", prefix);
    }
  }
  for (const plc::MapField& field : plc::registers::SceneFields()) add(field, 0, "fixed");
  for (const plc::MapField& field : plc::registers::MotionLinkFields()) add(field, 0, "fixed");
  for (const plc::MapField& field : plc::registers::GaugeFields())
    add(field, plc::registers::kGauges, "gauge");
  for (const plc::MapField& field : plc::registers::PointFields())
    add(field, plc::registers::kPoints, "point");
  for (const plc::MapField& field : plc::registers::PostureFields()) {
    add(field, plc::registers::kPostures, "posture");
  }
  for (const plc::CommandField& field : plc::registers::Commands()) add(field, 0, "command");
  return map;
}

}  // namespace

void AddRegistersCommand(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand(
      "registers",
      "Print Plumbline's register map; `scan` identifies a robot controller's registers");
  auto json = std::make_shared<bool>(false);
  command->add_flag("--json", *json, "For programs that generate PLC tags");
  command->footer("Example:\n  plumbline registers > register-map.md");
  command->require_subcommand(0, 1);
  AddRegistersScan(*command, exit_code);
  command->callback([command, json, &exit_code] {
    if (!command->get_subcommands().empty()) return;
    std::cout << (*json ? text::JsonText(AsJson(), 1) + "\n" : RegisterMapMarkdown());
    exit_code = kExitOk;
  });
}

}  // namespace plumbline::cli
