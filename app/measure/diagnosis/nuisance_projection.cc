#include "app/measure/diagnosis/nuisance_projection.h"

#include <Eigen/QR>
#include <algorithm>

namespace plumbline::measure {
namespace {

constexpr double kThreshold = 1e-9;  // of the largest column; a smaller remainder is undetermined

/// Orthonormal basis of columns whose lengths were up to `scale` before other columns were
/// projected out of them.
Eigen::MatrixXd OrthonormalBasis(const Eigen::MatrixXd& columns, double scale) {
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(columns);
  if (!(qr.maxPivot() > kThreshold * scale)) return Eigen::MatrixXd(columns.rows(), 0);
  qr.setThreshold(kThreshold * scale / qr.maxPivot());
  return qr.householderQ() * Eigen::MatrixXd::Identity(columns.rows(), qr.rank());
}

double LargestColumn(const Eigen::MatrixXd& columns) {
  return columns.size() == 0 ? 0 : std::sqrt(columns.colwise().squaredNorm().maxCoeff());
}

}  // namespace

NuisanceProjection::NuisanceProjection(const FitProblem& fit, const Linearisation& linear,
                                       const Model& model, const Whitener& whitener,
                                       const FitLayout& layout)
    : nuisances_(fit.data) {
  std::vector<std::vector<FitRowIndex>> of_component(
      static_cast<std::size_t>(nuisances_.components()));
  for (const FitRowIndex j : fit.rows.indices()) {
    const auto group = nuisances_.GroupOf(fit.rows[j]);
    if (group) of_component[nuisances_.ComponentOf(*group).offset()].push_back(j);
  }
  int equation = layout.first(FitRowIndex(fit.rows.count()));
  for (std::size_t c = 0; c < of_component.size(); ++c) {
    AddPart(fit, linear, model, whitener, layout, ComponentIndex(c), of_component[c], equation);
  }
  frames_ = FrameColumns(fit, linear, whitener, layout);
  if (frames_.cols() == 0) return;
  const double scale = LargestColumn(frames_);
  ProjectParts(frames_);
  frames_ = OrthonormalBasis(frames_, scale);
}

Eigen::Index NuisanceProjection::rank() const {
  Eigen::Index rank = frames_.cols();
  for (const Part& part : parts_) rank += part.basis.cols();
  return rank;
}

double NuisanceProjection::Leverage(int residual) const {
  double leverage = frames_.cols() > 0 ? frames_.row(residual).squaredNorm() : 0;
  for (const Part& part : parts_) {
    const auto found = std::ranges::find(part.residuals, residual);
    if (found == part.residuals.end()) continue;
    leverage += part.basis.row(found - part.residuals.begin()).squaredNorm();
  }
  return leverage;
}

Eigen::MatrixXd NuisanceProjection::FrameColumns(const FitProblem& fit, const Linearisation& linear,
                                                 const Whitener& whitener,
                                                 const FitLayout& layout) const {
  const int per_session = nuisances_.per_session(), of_sessions = nuisances_.of_sessions();
  const bool base = nuisances_.FloatWithBase();
  const int columns = of_sessions + (base ? 6 : 0);
  Eigen::MatrixXd frames = Eigen::MatrixXd::Zero(layout.total(), columns);
  if (columns == 0) return frames;
  for (const FitRowIndex j : fit.rows.indices()) {
    const RowIndex row = fit.rows[j];
    const SessionIndex session = fit.data.session_of[row];
    const FrameGradient& derivative = linear.rows[row].frames;
    auto of_row = layout.PartOf(frames, j);
    auto block = of_row.middleCols(nuisances_.FirstOf(session), per_session);
    if (nuisances_.frames()) whitener[j].Apply(derivative.leftCols<6>(), block.leftCols(6));
    if (nuisances_.tip()) whitener[j].Apply(derivative.rightCols<3>(), block.rightCols(3));
    if (base) whitener[j].Apply(derivative.leftCols<6>(), of_row.middleCols(of_sessions, 6));
  }
  return frames;
}

void NuisanceProjection::AddPart(const FitProblem& fit, const Linearisation& linear,
                                 const Model& model, const Whitener& whitener,
                                 const FitLayout& layout, ComponentIndex component,
                                 const std::vector<FitRowIndex>& rows, int& equation) {
  const std::vector<Equation> equations = nuisances_.EquationsAt(model, component);
  Part part;
  part.rows = rows;
  std::vector<int> column_of(static_cast<std::size_t>(nuisances_.size()), -1);
  int columns = 0;
  for (const GroupIndex group : nuisances_.GroupsOf(component)) {
    const auto first = static_cast<std::size_t>(nuisances_.FirstOf(group));
    const auto count = static_cast<std::size_t>(nuisances_.CountOf(group));
    for (std::size_t k = 0; k < count; ++k) column_of[first + k] = columns++;
  }
  for (const FitRowIndex j : rows) {
    for (int k = 0; k < layout.count(j); ++k) part.residuals.push_back(layout.first(j) + k);
  }
  for (std::size_t k = 0; k < equations.size(); ++k) part.residuals.push_back(equation++);
  if (part.residuals.empty()) return;
  Eigen::MatrixXd X =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(part.residuals.size()), columns);
  Eigen::Index at = 0;
  for (const FitRowIndex j : rows) {
    const GroupIndex group = nuisances_.GroupOf(fit.rows[j]).value();
    const int first = column_of[nuisances_.FirstOf(group)];
    whitener[j].Apply(linear.rows[fit.rows[j]].own,
                      X.block(at, first, layout.count(j), nuisances_.CountOf(group)));
    at += layout.count(j);
  }
  for (const Equation& further : equations) {
    for (const auto& [nuisance, slope] : further.slopes) {
      X(at, column_of[nuisance]) = slope;
    }
    ++at;
  }
  part.basis = OrthonormalBasis(X, LargestColumn(X));
  parts_.push_back(std::move(part));
}

void NuisanceProjection::ProjectParts(Eigen::Ref<Eigen::MatrixXd> columns) const {
  Eigen::MatrixXd local;
  for (const Part& part : parts_) {
    local = columns(part.residuals, Eigen::all);
    local -= part.basis * (part.basis.transpose() * local).eval();
    columns(part.residuals, Eigen::all) = local;
  }
}

void NuisanceProjection::Project(Eigen::Ref<Eigen::MatrixXd> columns) const {
  ProjectParts(columns);
  if (frames_.cols() > 0) columns -= frames_ * (frames_.transpose() * columns).eval();
}

}  // namespace plumbline::measure
