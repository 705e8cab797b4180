// Explanations of a capture that one lens and one board do not explain, and their wording.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "app/vision/lens/board_view.h"
#include "app/vision/lens/capture_change.h"
#include "app/vision/lens/capture_diagnosis.h"
#include "app/vision/lens/rival_fit.h"

namespace plumbline::vision {

struct Candidate {
  CaptureCause cause = CaptureCause::kNone;
  Rival rival;
  bool always = false;  ///< not covered by the score tests
};
/// A change of lens or board at its most likely time.
struct ChangeCandidate : Candidate {
  CaptureChange change;
};

/// Explanations that hold for the whole capture.
std::vector<Candidate> ConstantCandidates();
std::vector<ChangeCandidate> ChangeCandidates(const CaptureChangeTest& test,
                                              std::span<const BoardView> views);
/// A board whose points are all displaced, by unknown amounts.
/// @param bends  it also bends from view to view
Rival FreeBoard(const RivalBoard& board, bool bends);
/// Weights of the views that separate two states of the camera: 0 for those in the state of the
/// last view, -1 for the others. The zooms are split where that reduces their variance most.
std::vector<double> TwoStates(const RivalResult& varying);

/// Words and remedy of a fitted explanation. Words that are already there stay, if the cause is a
/// change.
void DescribeFinding(const Candidate& candidate, const RivalResult& result, const RivalBoard& board,
                     CaptureDiagnosis::Finding& finding);
std::string ChangeWords(const ChangeCandidate& candidate, const RivalResult& result,
                        std::span<const BoardView> views);

}  // namespace plumbline::vision
