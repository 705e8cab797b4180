// Next view of the calibration board: the one that adds most to what is known about the lens.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "app/vision/lens/board_view.h"
#include "app/vision/lens/lens_model.h"
#include "firmware-like/image/image_size.h"
#include "firmware-like/lens/board_prompt.h"

namespace plumbline::vision {

/// What the views of a capture say about lens and board.
struct LensKnowledge {
  SharedVector shared = SharedVector::Zero();
  /// Fisher information: that of the views, each after elimination of its pose, and of a weak
  /// prior, so that it has an inverse from the start.
  SharedMatrix information = SharedMatrix::Zero();
  double sigma_px = 0;  ///< standard deviation of a corner's coordinate

  LensMatrix covariance() const {
    return information.inverse().topLeftCorner<kLensCount, kLensCount>();
  }
};

/// Knowledge from the fit of the views. As long as they do not suffice for one, it is that of a
/// lens of a usual angle of view whose focal length is hardly known.
LensKnowledge KnowledgeFrom(const target::Board& board, std::span<const BoardView> views,
                            image::ImageSize size);

/// Fisher information about the shared parameters from a view of the board at X_CK, whose pose is
/// estimated too:
///   (sum J_s^T J_s - J_s^T J_p (J_p^T J_p)^-1 J_p^T J_s) / sigma^2
/// @return  nullopt if a corner is behind the camera
std::optional<SharedMatrix> InformationOfView(const target::Board& board,
                                              const SharedVector& shared, const Pose& X_CK,
                                              double sigma_px);

/// Poses X_CK in which a hand can hold the board, with its outline inside the image: places x
/// tilts x distances.
std::vector<Pose> CandidatePoses(const target::Board& board, const lens::Lens& lens,
                                 image::ImageSize size);

/// Outline of the board's pattern, one step beyond its outermost points, as it appears at X_CK: a
/// closed polyline from the top left corner along the upper edge [px]. A distorted edge is curved.
std::vector<lens::Vec2> OutlineOf(const target::Board& board, const lens::Lens& lens,
                                  const Pose& X_CK);

/// Chooses views by their gain: the logarithm of the factor by which a view reduces the mean
/// variance of the projection over the image (I-optimal design), tr(W C) with C the covariance of
/// the lens and W = ProjectionWeight() [F. Pukelsheim, Optimal Design of Experiments, ch. 5].
class NextViewChoice {
 public:
  NextViewChoice(const target::Board& board, LensKnowledge knowledge, image::ImageSize size,
                 std::optional<double> distance_m);

  /// Pose X_CK of the view with the largest gain.
  const Pose& X_CK() const { return candidates_[best_].X_CK; }
  double gain() const { return candidates_[best_].gain; }
  /// Chooses the next best pose elsewhere: the present one does not come about.
  void ChooseAnother();

  /// Gain of a view at a pose; negative if the board is not in front of the camera.
  double GainAt(const Pose& X_CK) const;
  /// Pose of the board as it is seen; nullopt if too little of it is.
  std::optional<Pose> SeenAt(const BoardView& view) const;
  /// Number of views, each the best one, until the standard deviation of the projection is nowhere
  /// larger than acceptable_px; at most `limit`.
  int ViewsUntil(double acceptable_px, int limit) const;
  const LensKnowledge& knowledge() const { return knowledge_; }
  lens::Lens lens() const { return LensFromShared(knowledge_.shared); }

 private:
  struct Candidate {
    Pose X_CK;
    SharedMatrix information;
    double gain;
  };
  double MeanVariance(const SharedMatrix& information) const;

  const target::Board board_;
  const LensKnowledge knowledge_;
  const image::ImageSize size_;
  const std::optional<double> distance_m_;
  const LensMatrix weight_;
  const double variance_;
  std::vector<Candidate> candidates_;  ///< not empty
  std::size_t best_ = 0;
};

/// What a person has to change so that the board comes from one pose to another, each in units of
/// what a hand does not notice.
struct HandCorrection {
  double right = 0, down = 0;             ///< of the board's centre in the image
  double farther = 0;                     ///< of the distance
  double right_edge = 0, upper_edge = 0;  ///< tilt that brings the edge towards the camera
  double clockwise = 0;                   ///< turn in the image
};
HandCorrection CorrectionTowards(const Pose& X_wanted, const Pose& X_seen,
                                 const target::Board& board, const lens::Lens& lens,
                                 image::ImageSize size);

/// A part of a correction: its instruction, and its size in the same unit.
struct HandPart {
  lens::BoardPrompt instruction;
  double size;
};
/// Move in the image, distance, tilt of the right and of the upper edge, turn.
std::array<HandPart, 5> PartsOf(const HandCorrection& correction);

/// The part to correct next: the largest one, but the previous one until it is done.
std::size_t PartToCorrect(const HandCorrection& correction, std::optional<std::size_t> previous);

}  // namespace plumbline::vision
