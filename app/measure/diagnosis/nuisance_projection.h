// Projection of a least squares problem onto the complement of its nuisance parameters.
#pragma once

#include <vector>

#include "app/measure/diagnosis/nuisances.h"
#include "app/measure/diagnosis/whitener.h"

namespace plumbline::measure {

/// Orthonormal basis of the whitened nuisance columns of a fit, and the projection that removes
/// them. Each component of artefact positions has columns only at its own rows and is
/// orthogonalised there; the frames of the sessions are orthogonalised to all of them. Directions
/// that the rows do not determine are not in the basis.
class NuisanceProjection {
 public:
  /// The part of the basis that belongs to one component.
  struct Part {
    std::vector<FitRowIndex> rows;  ///< that depend on it
    std::vector<int> residuals;  ///< positions in the stacked vectors: of the rows, then equations
    Eigen::MatrixXd basis;       ///< shape (residuals, rank)
  };

  /// @param layout  of the fit, its equations included
  NuisanceProjection(const FitProblem& fit, const Linearisation& linear, const Model& model,
                     const Whitener& whitener, const FitLayout& layout);

  /// Removes the nuisances from columns of shape (residuals, any).
  void Project(Eigen::Ref<Eigen::MatrixXd> columns) const;
  const std::vector<Part>& parts() const { return parts_; }
  /// The part of the basis that belongs to the frames of the sessions, shape (residuals, any).
  const Eigen::MatrixXd& frames() const { return frames_; }
  Eigen::Index rank() const;
  /// Squared length of the projection of one residual's axis on the nuisances, 0..1: the share of
  /// the residual that they absorb.
  double Leverage(int residual) const;

 private:
  /// Whitened columns of the frames of the sessions, then of what floats with the artefact
  /// positions.
  Eigen::MatrixXd FrameColumns(const FitProblem& fit, const Linearisation& linear,
                               const Whitener& whitener, const FitLayout& layout) const;
  void ProjectParts(Eigen::Ref<Eigen::MatrixXd> columns) const;
  void AddPart(const FitProblem& fit, const Linearisation& linear, const Model& model,
               const Whitener& whitener, const FitLayout& layout, ComponentIndex component,
               const std::vector<FitRowIndex>& rows, int& equation);

  Nuisances nuisances_;
  std::vector<Part> parts_;
  Eigen::MatrixXd frames_;
};

}  // namespace plumbline::measure
