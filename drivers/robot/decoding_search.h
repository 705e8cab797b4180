// Search for the decoding of a robot's registers: every address, type, word order and unit is
// tried, and what contradicts the arm or the observations is discarded. Pure.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "drivers/robot/profile.h"
#include "firmware-like/kinematics/chain.h"

namespace plumbline::robot {

/// Words of one table as far as they could be read, nearly of one instant.
struct RegisterImage {
  RegisterTable table = RegisterTable::kHolding;
  std::map<int, std::uint16_t> words{};  ///< by address
  std::set<int> starts{};                ///< addresses that no request may cross
  /// By the first address of each request, when it was answered; empty if that is not known.
  std::map<int, double> read_s{};

  void Set(int first, std::span<const std::uint16_t> read);
  /// True if the registers are known, and one request may read all of them.
  bool Has(int first, int count) const;
  /// When the request was answered that gave this register; nullopt if that is not known.
  std::optional<double> TimeOf(int address) const;
};

/// A unit in which controllers count joint values.
struct JointUnit {
  const char* unit;     ///< of a profile: "deg"
  double scale;         ///< of a profile, units per count: 0.1
  double rad, m;        ///< SI value of one count
  const char* text;     ///< "0.1 deg"
  bool real, in16bits;  ///< used with float32; used with 16 bits
};
std::span<const JointUnit> JointUnits();

/// One way to read joint values.
struct JointDecoding {
  RegisterTable table = RegisterTable::kHolding;
  std::vector<int> addresses{};  ///< one per joint
  RegisterType type = RegisterType::kInt16;
  modbus::WordOrder order = modbus::WordOrder::kAbcd;
  const JointUnit* unit = nullptr;
  JointWrap wrap = JointWrap::kNone;
  std::vector<int> revolutions{};  ///< registers of whole turns, for kRevolutions
  double revolutions_scale = 1;

  bool operator==(const JointDecoding&) const = default;
};

// Words of a profile.
const char* NameOf(RegisterType type);
const char* NameOf(modbus::WordOrder order);
const char* NameOf(RegisterTable table);
const char* NameOf(ReportedOrientation convention);

/// The number in one or two registers, before its scale; `second` is not used of 16 bits.
double RawValue(RegisterType type, modbus::WordOrder order, std::uint16_t first,
                std::uint16_t second);
std::optional<double> RawAt(const RegisterImage& image, RegisterType type, modbus::WordOrder order,
                            int address);

/// "float32 CDAB in deg at holding 0, 2, 4, 6, 8, 10".
std::string TextOf(const JointDecoding& decoding);

/// "12.5, -95.25, 88 deg": what a person compares with the teach pendant; prismatic joints in mm.
std::string JointsText(const kinematics::Chain& chain, const model::JointVector& q);

/// True if every joint is within its limits (or its part of a turn is), none is smaller than the
/// plausibility filter lets a number be, and enough of them are not at zero to tell a posture from
/// empty registers.
bool IsPlausible(const kinematics::Chain& chain, const model::JointVector& q,
                 bool unsigned_words = false);

/// Joint values [rad] or [m]; nullopt if a register is missing.
std::optional<model::JointVector> Decoded(const JointDecoding& decoding,
                                          const kinematics::Chain& chain,
                                          const RegisterImage& image);

/// How the pose of the tool or the flange is read.
struct PoseDecoding {
  std::array<int, 3> position{}, orientation{};  ///< addresses
  RegisterType type = RegisterType::kInt16;
  modbus::WordOrder order = modbus::WordOrder::kAbcd;
  const char* length_unit = "mm";
  double length_scale = 1, length_m = 1e-3;  ///< units and metres per count
  const char* angle_unit = "rad";
  double angle_scale = 1, angle_rad = 1;
  ReportedOrientation convention = ReportedOrientation::kRotationVector;
  bool of_flange = false;

  bool operator==(const PoseDecoding&) const = default;
};

/// "pose of the flange, int16 in 0.1 mm and mrad at 400 and 403, rotation_vector".
std::string TextOf(const PoseDecoding& pose);

// What a person, or the arm, contributes.

/// All joints of one moment as the teach pendant shows them.
struct PendantValues {
  std::size_t image = 0;  ///< index of the image of that moment
  model::JointVector q;   ///< [rad] or [m]
  double tolerance = 0;   ///< of the display [deg] or [mm]
};

/// Joint `joint` alone was moved between the images `before` and `before` + 1.
struct AxisMove {
  std::size_t before = 0;
  int joint = 0;
  double by = 0;  ///< [rad] or [m]
};

struct DecodingEvidence {
  std::vector<RegisterImage> images{};  ///< of one table, in the order of time
  std::vector<PendantValues> pendant{};
  std::vector<AxisMove> moves{};
  std::vector<Pose> tools{};  ///< X_FT of the cell's tools
  bool moving = false;        ///< the robot moved from image to image: joints that did not are none
};

/// Bounds of a search. Without them, a device whose registers all hold small numbers takes minutes
/// and gigabytes, because nearly every decoding of them is plausible.
struct SearchBounds {
  std::size_t max_words = 16384;      ///< of an image
  std::size_t max_decodings = 50000;  ///< that agree with what is known
  std::function<bool()> stop{};       ///< polled; true ends the search, undecided
};

struct DecodingCandidate {
  JointDecoding joints{};
  /// A pose that agrees with the joints by forward kinematics; nullopt also if its angles can be
  /// read in several conventions.
  std::optional<PoseDecoding> pose{};
  bool with_pose = false;  ///< a pose agrees with the joints
  bool moved = false;      ///< both moved, further than a stored pose could agree
  double misfit = 0;       ///< of the pose, in tolerances; comparable within one search
  double unrest = 0;       ///< change of the joints that were not moved, in tolerances
  double distance_m = 0;   ///< largest, of forward kinematics from the pose
  /// Time by which the joints are ahead of the pose; 0 if a difference is not due to the motion, or
  /// below the resolution of the registers; nullopt if the motion does not show that.
  std::optional<double> lead_s = 0.0;
  model::JointVector q{};  ///< in the last image
};

/// Result of a search.
struct DecodingVerdict {
  enum class State : std::uint8_t {
    kNone,       ///< nothing gives plausible joints
    kUndecided,  ///< `candidates` are plausible; `open` says what would decide between them
    kDecided,    ///< `candidates.front()` is the only one that the evidence leaves
  };
  State state = State::kNone;
  std::vector<DecodingCandidate> candidates{};  ///< best first
  std::size_t plausible = 0;                    ///< number of decodings within the arm's limits
  std::string evidence{};                       ///< what decided
  std::string open{};                           ///< what is open, and what would decide
};

/// Tries every decoding. Decisive are: a pose in the registers that equals the forward kinematics
/// of the joints while both move, the values of the teach pendant, or the moves of every axis; each
/// only where chance cannot produce the agreement, and where no other decoding agrees nearly as
/// well. Joints and pose that do not move may be those of a stored point.
DecodingVerdict SearchDecoding(const kinematics::Chain& chain, const DecodingEvidence& evidence,
                               const SearchBounds& bounds = {});

/// A change to a profile that makes its joints plausible.
struct ProfileRemedy {
  std::string what{};    ///< "words are swapped: word order CDAB gives 12.5, .. deg"
  std::string change{};  ///< "word_order = \"CDAB\""
  bool agrees = false;   ///< forward kinematics agrees with the profile's [tcp]
};

/// The smallest changes of the [[joints]] of a profile that give plausible joints, best first: word
/// order, address, unit. Several only if the words cannot tell them apart; where the image holds
/// the profile's [tcp], those whose forward kinematics agree with it. Empty if none does, or if the
/// joints of the profile are decoded in several ways. If most joints are plausible as they are,
/// only changes that agree with [tcp] are proposed.
/// @param image  the profile's registers and, where known, those around them
/// @param tools  X_FT of the cell's tools
std::vector<ProfileRemedy> RemediesOf(const RobotProfile& profile, const kinematics::Chain& chain,
                                      const RegisterImage& image, const std::vector<Pose>& tools);

/// Blocks that read `addresses` with few requests of at most `max_count` registers, without an
/// address that `image` does not have. `words` registers at each address stay together.
std::vector<RegisterBlock> BlocksFor(const std::vector<std::pair<int, int>>& address_and_words,
                                     const RegisterImage& image, int max_count);

}  // namespace plumbline::robot
