// Relations between a controller's model and a cell: what the controller may do differently.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/measure/controller/controller_sample.h"
#include "firmware-like/deflection/loaded_arm.h"

namespace plumbline::measure {

enum class RelationKind : std::uint8_t {
  kNominal,          ///< the cell's table, rigid
  kDeclaredFrame,    ///< poses are in the measurement frame of the cell, not in its base
  kFactoryTable,     ///< the table of a given file
  kRoundedTable,     ///< lengths rounded to a step
  kTableValue,       ///< one length of the table
  kAdjustedTable,    ///< small changes of all values: a calibration that is not given
  kLengthScale,      ///< all lengths of the table times one factor
  kCellDeflection,   ///< the deflection that this cell's model corrects
  kJointCompliance,  ///< joints that yield under gravity
  kHiddenTool,       ///< a constant transform at the flange
  kOtherTool,        ///< another tool of the cell
  kFlange,           ///< the flange instead of the tool tip
  kBase,             ///< a constant transform at the base
  kMirroredAxis,     ///< an axis of the reported position counted backwards
  kJointUnit,        ///< joints in degrees read as radians, or the reverse
  kLengthUnit,       ///< positions in another unit
  kAngleUnit,        ///< orientation in degrees read as radians, or the reverse
  kCoupling,         ///< a joint counted against another
  kZeroOffset,       ///< the zero of a joint
  kAxisSign,         ///< a joint counted backwards
  kJointOrder,       ///< joints exchanged
  kAngleConvention,  ///< three numbers of an orientation in another convention
  kInverseRotation,  ///< the orientation of the base in the tool
  kInversePose,      ///< the pose of the base in the tool
  kQuaternionOrder,  ///< scalar last instead of first
  kTimeShift,        ///< joints and pose of different times
};
inline constexpr int kRelationKinds = static_cast<int>(RelationKind::kTimeShift) + 1;

/// Stable name for JSON: "zero_offset".
const char* NameOf(RelationKind kind);

/// One relation, without its continuous parameters.
struct Relation {
  RelationKind kind = RelationKind::kNominal;
  int joint = -1, other = -1;  ///< 0-based: joint; the one it counts with, or a choice of the kind
  double value = 0;            ///< of kRoundedTable: step [m]; of the units: factor
  std::vector<int> order{};    ///< of kJointOrder: reading k belongs to joint order[k]

  bool operator==(const Relation&) const = default;
};

/// What a controller computes: a cell's robot with everything that relations change.
struct ControllerModel {
  model::Robot robot;
  Pose X_RB;                 ///< base in the frame of the reported poses
  Pose X_FH;                 ///< a hidden transform between flange and tool
  std::optional<Pose> X_FT;  ///< one tool in all postures; absent: that of each posture
  double joint_factor = 1;
  std::vector<int> order;         ///< empty: as they are
  double lead_s = 0;              ///< joints are older than the pose by this time
  model::JointVector compliance;  ///< [rad/(N m)]; empty: rigid
  bool cell_deflection = false;   ///< as deflection::LoadedArm has it
  // How its numbers are to be read.
  double length_factor = 1, angle_factor = 1;
  int convention = -1;  ///< -1: as stated
  int mirrored_axis = -1;
  bool inverse_rotation = false, inverse_pose = false, scalar_last = false;
};

/// Everything that relations are evaluated with.
struct RelationContext {
  explicit RelationContext(const model::CellModel& cell_in);
  model::CellModel cell;
  deflection::LoadedArm arm;
  std::optional<model::Robot> factory{};  ///< a table from a file
};

/// The relations that the sample could show, each alone.
std::vector<Relation> RelationsOf(const RelationContext& context, const ControllerSample& sample);

/// Parameters of a relation: their prior standard deviations, and values to start a fit from.
inline constexpr double kFixedValue = 1e-12;  ///< standard deviation of one that stays 0
struct RelationParameters {
  std::vector<double> prior_sd;
  std::vector<std::vector<double>> starts;  ///< at least one
};
RelationParameters ParametersOf(const Relation& relation, const RelationContext& context,
                                const ControllerSample& sample);

/// The controller's model without any relation.
ControllerModel NominalModel(const RelationContext& context);

/// The load of a posture, on its tool; no payload if it is unknown.
loads::Payload LoadOf(const ControllerPosture& posture);
/// The tool with which a posture is reported: identity, the controller's own, or the cell's.
Pose ToolOf(const ControllerPosture& posture, const RelationContext& context);

/// Adds a relation to a model.
/// @param values  of its parameters
void Apply(const Relation& relation, std::span<const double> values, const RelationContext& context,
           const ControllerSample& sample, ControllerModel& model);

/// "zero_offset 3, coupling 5 of 2": the relations without values; of choices, their number.
std::string RelationNames(const std::vector<Relation>& relations);

/// True if the two exclude each other or are of one kind that makes no sense twice.
bool Exclude(const Relation& a, const Relation& b);

}  // namespace plumbline::measure
