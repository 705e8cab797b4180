// Tool, base and load of a motion: from the keys of a program to the model of the cell.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <unordered_map>

#include "app/programs/flow/flow.h"
#include "app/programs/program.h"
#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/result.h"

namespace plumbline::programs {

/// A payload as Plumbline counts it: what is carried beside the tool that the cell declares.
struct StatedPayload {
  double mass_kg = 0;
  std::optional<Vec3> cog_F;  ///< [m]; absent: that of the cell's [payload]
};

/// What the user states about a program beside its files.
struct StatedContext {
  /// Number of the cell's tool by key of the program, and for a program that sets no tool.
  std::map<std::string, int> tool_numbers;
  std::optional<int> tool_number;
  /// Payload by key of a load or of a tool, and wherever the program states none.
  std::map<std::string, StatedPayload> payloads;
  std::optional<StatedPayload> payload;
  /// Loads of the program do not contain the mass of the cell's tool.
  bool loads_without_tool = false;
};

/// Everything by which the target of a motion is corrected. Motions with equal values agree.
struct MotionContext {
  int tool = 0;  ///< index, CellModel::ToolAt
  Pose X_TP;     ///< the programmed tool point P in the frame of the cell's tool tip T
  Pose X_BU;     ///< the base of the program, user frame U, in the robot's base B
  loads::Payload payload;
  std::string tool_text, base_text, load_text;  ///< for the report
  std::string tool_assumption;  ///< why this tool, if only the number in its key names it

  bool Agrees(const MotionContext& other) const;
};

/// Finds the contexts of motions; each combination of keys is resolved once.
///
/// Tool: the one that the user states for the key, else the one whose tip is at the position of the
/// program's tool point (within kSameTip_m), else, if the files contain no values, the one with the
/// number at the end of the key. The tool point may be any point on a stated tool.
///
/// Load: controllers count everything at the flange. The payload is
///   m = m_set + m_extra - m_cell,   m c = sum of the m_i c_i - m_cell c_cell
/// with m_set the load that is set, or, where none is, the one that the tool is declared with, and
/// m_cell the mass of the cell's tool, body and mount; the daemon's payload likewise excludes
/// it. A tool that the cell declares rigid has no mass, so that it stays in the payload.
class ContextResolver {
 public:
  /// Differences of the tool point within which it is the tip of a tool of the cell [m].
  static constexpr double kSameTip_m = 5e-4;

  /// The arguments must outlive the object.
  ContextResolver(const Program& program, const model::CellModel& cell,
                  const deflection::LoadedArm& arm, const StatedContext& stated)
      : program_(program), cell_(cell), arm_(arm), stated_(stated) {}

  /// @param point  the target, whose own statement of tool and base counts where none is set
  /// @return       the context, owned by the resolver, or why there is none and what to do
  Result<const MotionContext*> Of(const MotionAt& motion, const Point& point);

 private:
  Result<MotionContext> Resolve(const SettingAt& tool, const SettingAt& base, const SettingAt& load,
                                const SettingAt& extra) const;
  Result<void> AddTool(const SettingAt& tool, MotionContext& context) const;
  Result<void> AddBase(const SettingAt& base, MotionContext& context) const;
  Result<void> AddLoad(const SettingAt& tool, const SettingAt& load, const SettingAt& extra,
                       MotionContext& context) const;
  Vec3 CogInFlange(const LoadValue& load, const MotionContext& context) const;
  Result<loads::Payload> PayloadOf(const StatedPayload& stated) const;

  const Program& program_;
  const model::CellModel& cell_;
  const deflection::LoadedArm& arm_;
  const StatedContext& stated_;
  std::unordered_map<std::string, Result<MotionContext>> known_;
};

}  // namespace plumbline::programs
