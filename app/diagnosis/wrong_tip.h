// Errors of a declared tool as rivals of every explanation: the tip of one of several tools is
// wrong, or the measured orientation is turned on the tool.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/diagnosis/identify.h"

namespace plumbline::diagnosis {

/// An explanation with a constant offset of the tip of one tool, or a constant rotation of the
/// measured orientation, which may replace effects of the answer.
struct WrongTip {
  bool turned = false;  ///< a rotation of all measured orientations; otherwise an offset of a tip
  int tool_number = 0;  ///< of the offset
  /// True minus declared tip [m], or the rotation vector [rad], in the flange frame.
  Vec3 offset_F = Vec3::Zero();
  std::vector<BlockIndex> beside;      ///< effects of the answer that it needs
  std::vector<BlockIndex> instead_of;  ///< effects of the answer that it replaces, all or in part
  double evidence_gap = 0;             ///< its score minus the answer's
  bool within_noise = false;           ///< it leaves no more than the declared noise
  double sigma_m = 0;                  ///< noise on one axis

  /// True if the declaration is wrong: better than the answer by kMistakeMargin, and it leaves no
  /// more than the noise.
  bool certain() const;
};

/// The offset of the tip of one tool, or the rotation of the measured orientations, that fits best
/// beside the effects of the answer, or some of them. It costs as much as an effect with three
/// parameters, plus the choice of the tool.
/// @return  nullopt if the cell leaves the tip free; if the rows hold fewer than two tools and no
///          orientation; or if nothing is `certain` or explains effects of the answer so well that
///          it is not ruled out (kRivalGap)
std::optional<WrongTip> WrongTipOf(const Identified& found);

/// The mistake and its remedy.
std::string SentenceOf(const WrongTip& tip, const Identified& found);

/// True if the rows can show a wrong tip beside effects: the tip is declared as known, and they
/// hold several tools or orientations.
bool TestsTips(const Dataset& data);

/// Adds the check `tool_tips` of findings whose rows can show a wrong tip. If there is one, doubts
/// the findings that it would replace, and withholds the correction.
void CheckTips(const std::optional<WrongTip>& tip, const Identified& found, Diagnosis& diagnosis);

}  // namespace plumbline::diagnosis
