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
  std::vector<Frames> frames;         ///< one a session
  std::vector<ActiveEffect> effects;  ///< beside those that the cell already has

  /// The cell as declared, for every session.
  static Model Declared(const Dataset& data);
};

/// The cell with a session's frames; it keeps the effects that it has already.
CellModel CellOf(const Dataset& data, const Model& model, int session);

/// A row's residual and gradient, on the axes that are measured.
struct LinearRow {
  Vec3 residual = Vec3::Zero();  ///< measured minus predicted in W [m]; of a range (r, 0, 0)
  Vec3 p_W = Vec3::Zero();       ///< predicted tip
  Sensitivity::Gradient dp;      ///< d prediction / d influence; of a range the first row only
  Eigen::Matrix<double, 3, 9> frames;  ///< d prediction / d (base shift, base turn, tip)
};

class BlockColumns;

struct Linearisation {
  std::vector<LinearRow> rows;
  int axes = 3;
  /// Of these gradients; copies share it.
  std::shared_ptr<BlockColumns> columns;
};

/// Evaluates the model at every row. Gradients are left zero where `gradients` is false.
/// @return  an error naming the row where the sagged posture does not settle
Result<Linearisation> Linearise(const Dataset& data, const Model& model, bool gradients,
                                int threads);

/// Columns d prediction / d parameter of one term at `values`, for the parameters asked for, on row
/// k.
/// @param out  shape (3, which.size())
void TermColumns(const EffectTerm& term, std::span<const double> values, std::span<const int> which,
                 const Conditions& conditions, const LinearRow& row,
                 Eigen::Ref<Eigen::MatrixXd> out);

/// Runs f(first, last) over 0..count in `threads` pieces.
void InParallel(int count, int threads, const std::function<void(int, int)>& f);

/// The model after a step of a session's frames: base shift [m], base turn (rotation vector in W,
/// about the base's origin) [rad], tip shift in F [m].
void MoveFrames(Model::Frames& frames, const Eigen::Matrix<double, 9, 1>& step);

}  // namespace plumbline
