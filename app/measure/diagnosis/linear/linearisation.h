// Linearisation of the model at all rows: predictions, residuals and gradients.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>

#include "app/measure/diagnosis/data/dataset.h"
#include "firmware-like/deflection/sensitivity.h"
#include "firmware-like/model/artefact.h"

namespace plumbline::measure {

/// An artefact with all its constants, in the frame in which it is declared.
struct PlacedArtefact {
  Vec3 place = Vec3::Zero();
  Vec3 direction = Vec3::UnitZ();
  double radius_m = 0;
};

/// Number of estimated constants of an artefact: those that are not declared, or declared with a
/// standard deviation.
struct ArtefactFreedom {
  int place = 0;      ///< 3: a vector; 1: along the direction; 0: exactly known
  int direction = 0;  ///< 2: rotations about two axes across the direction
  int radius = 0;     ///< 1: of a sphere

  int size() const { return place + direction + radius; }
};

ArtefactFreedom FreedomOf(const model::Artefact& artefact);

/// The artefact as declared; what is absent is a placeholder.
PlacedArtefact DeclaredPlace(const model::Artefact& artefact);

/// Two unit vectors that are perpendicular to a direction and to each other, shape (3, 2).
Eigen::Matrix<double, 3, 2> AcrossDirection(const Vec3& direction);

/// Applies a step of the estimated constants, in the order of ArtefactFreedom.
void MoveArtefact(const ArtefactFreedom& freedom, const double* step, PlacedArtefact& artefact);

/// The adjustable part of the model: frames of each session, positions of artefacts, the frame of
/// the reference tags, and added effects.
struct Model {
  struct Frames {
    Pose X_WB;
    /// Measured TCP of each tool of the cell (CellModel::ToolAt) on the unloaded arm's flange.
    std::vector<Pose> X_FT;
  };
  Indexed<SessionIndex, Frames> frames;
  Indexed<ArtefactIndex, PlacedArtefact> artefacts;
  /// Error of the frame that the reference tags define: rows that rest on them read
  /// p + shift + turn x p for the tip p in W. Shift [m], turn [rad].
  Vec3 tags_shift = Vec3::Zero(), tags_turn = Vec3::Zero();
  std::vector<effects::ActiveEffect> effects;  ///< in addition to those of the cell

  /// The cell as declared, for every session.
  static Model Declared(const Dataset& data);
};

/// The cell with the frames of a session. Effects of `model` are not added.
model::CellModel CellOf(const Dataset& data, const Model& model, SessionIndex session);

/// d prediction / d influence of one row, shape (its residuals, influences).
using Gradient = Eigen::Matrix<double, Eigen::Dynamic, effects::Influence<double>::kSize>;
/// d prediction / d (base translation, base rotation, tip of the row's tool) of one row, shape (its
/// residuals, 9).
/// The arm is treated as rigid: the change of gravity deflection with the base rotation is
/// neglected, about a thousandth of the effect.
using FrameGradient = Eigen::Matrix<double, Eigen::Dynamic, 9>;

/// Residual of a row, and its gradients with respect to the nuisances.
struct LinearRow {
  RowResidual residual;
  Vec3 p_W = Vec3::Zero();  ///< predicted tip
  FrameGradient frames;
  /// d prediction / d (parameters of its own group of nuisances, see nuisances.h), shape (its
  /// residuals, 0..6).
  Eigen::MatrixXd own;
};

class BlockColumns;

struct Linearisation {
  PerRow<LinearRow> rows;
  PerRow<Gradient> gradients;  ///< empty if not requested
  RowLayout layout;
  /// Cache of block columns from these gradients; shared by copies.
  std::shared_ptr<BlockColumns> columns;
};

/// Evaluation of the model one row at a time, without storing gradients.
class ModelAtRows {
 public:
  /// Both arguments must outlive this object.
  ModelAtRows(const Dataset& data, const Model& model);

  /// @param wanted    entries of the influence whose gradient is needed
  /// @param scratch   one per thread
  /// @param gradient  zero except for the wanted entries; not changed if none is wanted
  /// @return          false if the deflected posture does not converge
  [[nodiscard]] bool At(RowIndex row, const deflection::InfluenceSet& wanted,
                        deflection::Sensitivity& scratch, LinearRow& result,
                        Gradient& gradient) const;

 private:
  const Dataset& data_;
  const Model& model_;
  Indexed<SessionIndex, deflection::LoadedArm> arms_;
};

/// Evaluates the model at every row.
/// @param gradients  whether to store gradients (4.5 kB per row)
/// @return  an error with the line of a row whose deflected posture does not converge
Result<Linearisation> Linearise(const Dataset& data, const Model& model, bool gradients,
                                int threads);
/// Like Linearise, with the gradients of some entries of the influence only.
Result<Linearisation> Linearise(const Dataset& data, const Model& model,
                                const deflection::InfluenceSet& wanted, int threads);

PerRow<RowResidual> ResidualsOf(const Linearisation& linear);
/// The residuals as vectors [m] (LengthsOf).
PerRow<Vec3> ErrorsOf(const Linearisation& linear);

/// Displacement of a row's prediction by effects, to first order [m].
/// @param linear  with gradients
RowResidual DisplacementBy(const std::vector<effects::ActiveEffect>& effects, const Dataset& data,
                           const Linearisation& linear, RowIndex row);

/// Derivative of one entry of the influence with respect to one parameter of a term.
struct TermSlope {
  int entry = 0;   ///< of the influence
  int column = 0;  ///< index into the requested parameters
  double slope = 0;
};

/// Appends the non-zero derivatives d influence / d parameter of one term at `values`.
/// @param which  requested parameters
void AddTermSlopes(const effects::EffectTerm& term, std::span<const double> values,
                   std::span<const int> which, const effects::Conditions& conditions,
                   std::vector<TermSlope>& slopes);

/// Computes the columns d prediction / d parameter of one term at `values` on one row.
/// @param which  requested parameters
/// @param out    shape (residuals of the row, which.size())
void TermColumns(const effects::EffectTerm& term, std::span<const double> values,
                 std::span<const int> which, const effects::Conditions& conditions,
                 const Gradient& gradient, Eigen::Ref<Eigen::MatrixXd> out);

/// Runs f(first, last) on `threads` contiguous parts of [0, count) in parallel.
void InParallel(int count, int threads, const std::function<void(int, int)>& f);

/// Copies the base pose of each session from the model to the conditions of its rows: effects need
/// the direction of gravity that an aligned instrument defines.
void CopyBasePosesToRows(const Model& model, Dataset& data);

/// Applies a step to the base of a session: translation [m], rotation (rotation vector in W, about
/// the origin of the base) [rad].
void MoveBase(Pose& X_WB, const Eigen::Matrix<double, 6, 1>& step);

}  // namespace plumbline::measure
