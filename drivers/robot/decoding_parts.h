// Parts of the search for a decoding: encodings, what a joint can be, and agreement with each kind
// of evidence. Internal to decoding_search.
#pragma once

#include <limits>
#include <numbers>

#include "drivers/robot/decoding_search.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/plausibility_filter.h"

namespace plumbline::robot {

inline constexpr double kWholeTurn = 2 * std::numbers::pi;
inline constexpr PlausibilityLimits kLimits{};  // what the daemon will judge the readings by
inline constexpr double kOffZero = 0.5;         // [deg] or [mm]
// Misfits of a pose that count as equal. What a person states decides only whether a decoding
// agrees: commanded joints may lie nearer to rounded or unmoved numbers than noisy actual ones.
inline constexpr double kRivalRatio = 3, kRivalFloor = 0.02;
inline constexpr int kStrides[] = {1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 32};

/// Type and word order of a number.
struct Encoding {
  RegisterType type;
  modbus::WordOrder order;
};

/// int16, uint16, and int32 and float32 in each word order.
std::vector<Encoding> Encodings();

/// False if controllers do not count in this unit with this type.
bool Uses(const Encoding& encoding, const JointUnit& unit);

/// The numbers of one encoding at every address of an image; NaN where a register is missing.
class RawValues {
 public:
  RawValues(const RegisterImage& image, const Encoding& encoding)
      : values_(image.words.empty() ? 0 : static_cast<std::size_t>(image.words.rbegin()->first + 2),
                std::numeric_limits<double>::quiet_NaN()) {
    for (const auto& [address, word] : image.words) {
      if (const auto raw = RawAt(image, encoding.type, encoding.order, address))
        values_[static_cast<std::size_t>(address)] = *raw;
    }
  }
  double operator[](int address) const {
    const auto place = static_cast<std::size_t>(address);
    return place < values_.size() ? values_[place] : std::numeric_limits<double>::quiet_NaN();
  }

 private:
  std::vector<double> values_;
};

/// Limits of a joint with the margin of the plausibility filter; those that the cell does not
/// declare are two turns.
double Lower(const kinematics::Chain& chain, int joint);
double Upper(const kinematics::Chain& chain, int joint);

/// A value that the joint can have, as it is or as the part of a turn.
bool CanBe(const kinematics::Chain& chain, int joint, double q, bool unsigned_words);

/// One step of the registers [rad] or [m]; 0 for floats.
double StepOf(const JointDecoding& decoding, const kinematics::Chain& chain, int joint);

/// Difference of two joint values; of revolute joints, whole turns do not count.
double Difference(const kinematics::Chain& chain, int joint, double a, double b);

/// SI value of the unit of a teach pendant: one degree, or one millimetre.
double PendantUnit(const kinematics::Chain& chain, int joint);

/// Decodings with joints at a common distance.
struct PlausibleDecodings {
  std::vector<JointDecoding> agreeing{};  ///< plausible in each image, and not contradicted
  std::size_t plausible = 0;              ///< number of those within the arm's limits
  bool complete = true;                   ///< false: stopped, or too many agree
};

/// Tries every decoding. A decoding is contradicted if the pendant shows other values, or if its
/// joints stay constant while the robot moves.
PlausibleDecodings FindPlausible(const kinematics::Chain& chain, const DecodingEvidence& evidence,
                                 const SearchBounds& bounds);

// Agreement with the teach pendant.

/// Largest difference in tolerances; more than 1: contradicts. 0 without pendant values.
/// @param whole_turns  whether a difference of whole turns counts
double PendantMisfit(const JointDecoding& decoding, const kinematics::Chain& chain,
                     const DecodingEvidence& evidence, bool whole_turns);

/// Probability that random joints within the limits agree with the pendant; joints at zero do not
/// count, because zeros are everywhere.
double PendantChance(const kinematics::Chain& chain, const DecodingEvidence& evidence);

// Agreement with moves of single axes.

/// In tolerances, how much the joints changed that were not moved; nullopt if a move contradicts.
std::optional<double> MoveMisfit(const JointDecoding& decoding, const kinematics::Chain& chain,
                                 const DecodingEvidence& evidence);

bool EveryAxisMoved(const kinematics::Chain& chain, const DecodingEvidence& evidence);

/// The joints of a decoding that fits if they were moved the other way than stated; empty if there
/// is none.
std::string ReversedJoints(const std::vector<JointDecoding>& decodings,
                           const kinematics::Chain& chain, const DecodingEvidence& evidence);

/// Decodings whose joints lie at addresses without a common distance, each found by its own move.
std::vector<JointDecoding> FreeDecodings(const kinematics::Chain& chain,
                                         const DecodingEvidence& evidence,
                                         const SearchBounds& bounds);

// Agreement of forward kinematics with a pose in the registers.

/// For each decoding that agrees with a pose, the candidate with the pose that fits best.
/// @param expected  agreements of the best candidate that chance would give
std::vector<DecodingCandidate> WithPoses(const std::vector<DecodingCandidate>& all,
                                         const kinematics::Chain& chain,
                                         const DecodingEvidence& evidence,
                                         const SearchBounds& bounds, double& expected);

}  // namespace plumbline::robot
