// A toy language for tests of everything behind the grammars.
//
//   tool NAME x y z rx ry rz [kg x y z]     lengths in mm, rotation vectors in degrees
//   base NAME x y z rx ry rz
//   load NAME kg [x y z]                    kg "-" is not entered
//   point NAME x y z rx ry rz [posture=b..] [near q1..q6] [untaught] [accurate] [ext n]
//   joints NAME q1..q6
//   sub NAME [starts] .. end
// and in a sub:
//   use TOOL|? | in BASE|? | carry LOAD|? | grip LOAD|none|? | shift on|off
//   J|L|S TARGET [stop..]                   C VIA TARGET
//   TARGET: NAME, NAME+base:x,y,z, NAME+tool:x,y,z, NAME+?, or "computed"
//   search NAME | touch NAME reason.. | peek NAME | label X | jump X | branch X | call X | return |
//   wait
// A line that starts with # is a comment.
#pragma once

#include "app/programs/brand.h"

namespace plumbline::test {

/// @param decimals  of lengths and angles that are written
class ToyBrand : public programs::Brand {
 public:
  explicit ToyBrand(programs::NumberStyle style = {}, bool comments = true);

  std::string_view name() const override { return "toy"; }
  const programs::Conventions& conventions() const override { return conventions_; }
  bool Recognises(const programs::SourceFile& file) const override;
  programs::Reading Read(std::vector<programs::SourceFile> files) const override;
  bool Agrees(const programs::Configuration& stated, const kinematics::Chain& chain,
              const model::JointVector& q, programs::MotionKind kind) const override;
  std::vector<std::string> ConfigurationOf(const programs::Configuration& stated,
                                           const kinematics::Chain& chain,
                                           const model::JointVector& q) const override;
  std::optional<Insertion> Mark(const programs::SourceFile& file,
                                std::string_view mark) const override;
  std::optional<std::string> InsertedMotion(const programs::Program& program,
                                            const programs::Motion& motion,
                                            std::span<const double> numbers,
                                            double part_m) const override;

  /// Text of the posture of joints: the sign of each, "+-++-+".
  static std::string PostureText(const model::JointVector& q);

 private:
  programs::Conventions conventions_;
  bool comments_;
};

}  // namespace plumbline::test
