// The present model over all rows: predictions, residuals, and how both follow every influence.
#pragma once

#include <functional>
#include <memory>

#include "app/diagnosis/dataset.h"
#include "firmware-like/deflection/sensitivity.h"

namespace plumbline {

/// What is adjusted to the data: frames of each session, and the effects added.
struct Model {
  struct Frames {
    Pose X_WB;
    Vec3 tip_F = Vec3::Zero();
  };
  Indexed<SessionIndex, Frames> frames;
  std::vector<ActiveEffect> effects;  ///< beside those that the cell already has

  /// The cell as declared, for every session.
  static Model Declared(const Dataset& data);
};

/// The cell with a session's frames; it keeps the effects that it has already.
CellModel CellOf(const Dataset& data, const Model& model, SessionIndex session);

/// d prediction / d influence of one row, shape (its residuals, influences).
using Gradient = Eigen::Matrix<double, Eigen::Dynamic, Influence<double>::kSize>;
/// d prediction / d (base shift, base turn, tip) of one row, shape (its residuals, 9). The arm
/// moves rigidly: that gravity turns in it with the base is left out, a thousandth of the turn.
using FrameGradient = Eigen::Matrix<double, Eigen::Dynamic, 9>;

/// A row at the present model.
struct LinearRow {
  RowResidual residual;
  Vec3 p_W = Vec3::Zero();  ///< predicted tip
  FrameGradient frames;
};

class BlockColumns;

struct Linearisation {
  PerRow<LinearRow> rows;
  PerRow<Gradient> gradients;  ///< empty where none were asked for
  RowLayout layout;
  /// Of these gradients; copies share it.
  std::shared_ptr<BlockColumns> columns;
};

/// The model evaluated one row at a time, where gradients need not be kept.
class ModelAtRows {
 public:
  /// Both must outlive it.
  ModelAtRows(const Dataset& data, const Model& model);

  /// @param wanted    influences whose gradient is needed
  /// @param scratch   one a thread
  /// @param gradient  zero but for the wanted ones; left as it is where none are wanted
  /// @return          false where the sagged posture does not settle
  [[nodiscard]] bool At(RowIndex row, const InfluenceSet& wanted, Sensitivity& scratch,
                        LinearRow& result, Gradient& gradient) const;

 private:
  const Dataset& data_;
  const Model& model_;
  Indexed<SessionIndex, LoadedArm> arms_;
};

/// Evaluates the model at every row.
/// @param gradients  whether they are kept: 4.5 kB a row
/// @return  an error naming the row where the sagged posture does not settle
Result<Linearisation> Linearise(const Dataset& data, const Model& model, bool gradients,
                                int threads);
/// The same with the gradients of some influences only.
Result<Linearisation> Linearise(const Dataset& data, const Model& model, const InfluenceSet& wanted,
                                int threads);

PerRow<RowResidual> ResidualsOf(const Linearisation& linear);
/// The residuals in space [m] (LengthsOf).
PerRow<Vec3> ErrorsOf(const Linearisation& linear);

/// How one parameter of a term moves one influence.
struct TermSlope {
  int entry = 0;   ///< of the influence
  int column = 0;  ///< index into the parameters asked for
  double slope = 0;
};

/// Appends d influence / d parameter of one term at `values`, for the parameters asked for; only
/// those that are not zero.
void AddTermSlopes(const EffectTerm& term, std::span<const double> values,
                   std::span<const int> which, const Conditions& conditions,
                   std::vector<TermSlope>& slopes);

/// Columns d prediction / d parameter of one term at `values`, for the parameters asked for, on one
/// row.
/// @param out  shape (residuals of the row, which.size())
void TermColumns(const EffectTerm& term, std::span<const double> values, std::span<const int> which,
                 const Conditions& conditions, const Gradient& gradient,
                 Eigen::Ref<Eigen::MatrixXd> out);

/// Runs f(first, last) over 0..count in `threads` pieces.
void InParallel(int count, int threads, const std::function<void(int, int)>& f);

/// Lets the effects of every row see the base of its session as the model has it: an aligned
/// instrument says where down is.
void ShowBases(const Model& model, Dataset& data);

/// The model after a step of a session's frames: base shift [m], base turn (rotation vector in W,
/// about the base's origin) [rad], tip shift in F [m].
void MoveFrames(Model::Frames& frames, const Eigen::Matrix<double, 9, 1>& step);

}  // namespace plumbline
