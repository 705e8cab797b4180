// Wording of what a lens calibration finds: reasons to refuse it, and advice.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "app/vision/lens/board_view.h"
#include "app/vision/lens/capture_change.h"
#include "app/vision/lens/capture_diagnosis.h"
#include "app/vision/lens/residual_parts.h"

namespace plumbline::vision {

/// Peak-to-valley deviation of the board from its plane [m].
/// @param bow  kBowX, kBowY, kBowXY
double LargestBow(const Vec3& bow, const target::Board& board);

/// Rounded up to two digits, so that the printed value suffices as a limit.
double RoundedUp(double value_px);

/// What changed by more than chance: "the lens moved while the frames were taken: .."; empty:
/// nothing.
std::string ChangeReason(const CaptureChangeTest& test, const LensFit& fit,
                         std::span<const BoardView> views, const target::Board& board,
                         const target::DeclaredFacts& declared);

/// Largest effect on the projection of the changes that ChangeReason() names [px]; zero without
/// one.
/// @param lens  that of the fit
RadiusErrors EffectOfChanges(const CaptureChangeTest& test, const lens::Lens& lens,
                             image::ImageSize size);

/// The words of a finding, and that it contradicts a declaration.
std::string WordsOf(const CaptureDiagnosis::Finding& finding,
                    const target::DeclaredFacts& declared);

/// One reason for a capture that one lens and one board do not explain.
std::string ReasonOf(const CaptureDiagnosis& diagnosis, const target::DeclaredFacts& declared);

/// Residuals that neither noise nor any explanation accounts for.
std::string UnexplainedWords(const ResidualParts& parts);

/// What to do about displacements that are fixed in the image. @param field_px  the largest
std::string FieldAdvice(double field_px);

/// What to do about pixels that seem not to be square.
std::string AspectAdvice(const lens::Lens& lens);

/// Effects that are not excluded, with what would exclude each of them.
std::string UnprovedAdvice(const std::vector<UnprovedEffect>& effects,
                           const target::DeclaredFacts& declared);

/// Advice on views that would determine the lens better.
std::string AdviceOnViews(const LensFit& fit, std::span<const BoardView> views,
                          image::ImageSize size);

std::string UncertaintyReason(double uncertain_px, double acceptable_px, const std::string& advice);

/// What is left to a lens that a finding makes uncertain: see RegionChoice::least_px.
std::string LeastUncertaintyReason(double least_px, double acceptable_px);

/// Note on a lens that is accepted for a part of the image.
/// @param beyond_px  largest uncertainty outside that part
std::string RegionNote(const lens::KnownLens& lens, double beyond_px, const std::string& advice);

}  // namespace plumbline::vision
