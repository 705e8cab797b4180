// Errors of declarations as rivals of every explanation: the tip of one of several tools or the
// mass of a payload item is wrong, the measured orientation is turned on the tool, or an artefact
// moved while it was measured.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/measure/diagnosis/hypotheses/declared_error_columns.h"
#include "app/measure/diagnosis/result/opinion.h"
#include "app/measure/diagnosis/search/identify.h"

namespace plumbline::measure {

/// An explanation with one such error, which may replace effects of the answer.
struct DeclaredError {
  DeclaredErrorKind kind;
  /// True minus declared tip [m] or the rotation vector [rad], in the flange frame; or the shift of
  /// the artefact [m], in the frame in which it is declared.
  Vec3 offset = Vec3::Zero();
  double mass_kg = 0;                 ///< of an item: true minus declared mass
  std::vector<EffectKey> beside;      ///< effects of the answer that it needs
  std::vector<EffectKey> instead_of;  ///< effects of the answer that it replaces, all or in part
  double evidence_gap = 0;            ///< its score minus the answer's
  bool within_noise = false;          ///< it leaves no more than the declared noise
  double sigma_m = 0;                 ///< noise on one axis

  /// True if the declaration is wrong: better than the answer by kMistakeMargin, and it leaves no
  /// more than the noise.
  bool certain() const;
};

/// Outcome of the search for errors of declarations.
struct DeclaredErrorSearch {
  std::optional<DeclaredError> likeliest{};
  bool tested_items = false;  ///< the rows can show the wrong mass of a payload item
  bool tested_moves = false;  ///< moves of artefacts were tested
};

/// The error that fits best in addition to the effects of the answer, or to some of them. It costs
/// as much as an effect with as many parameters (three, or one for a mass), plus the choice of the
/// tool, the item, or the artefact and the moment.
/// @param with_moves  also moves of artefacts; false if a declared distance contradicts the other
///                    data, which imitates a move of one of its artefacts
/// @return  without `likeliest` if the rows can show no such error, or if nothing is `certain` or
///          explains effects of the answer so well that it is not ruled out (kRivalGap)
DeclaredErrorSearch SearchDeclaredErrors(const Identified& found, bool with_moves, int threads);

/// The mistake and its remedy.
std::string SentenceOf(const DeclaredError& error, const Identified& found);

/// The checks `tool_tips`, `payload_items` and `artefact_moves` of findings whose rows can show
/// such an error. If there is one: only the check that it fails, a doubt of each finding that it
/// would replace, and the correction is withheld.
Opinion OpinionOnDeclarations(const DeclaredErrorSearch& search, const Identified& found,
                              const std::vector<Finding>& findings);

}  // namespace plumbline::measure
