// Nuisance parameters: free frames of the sessions, positions of artefacts, orientations of tools,
// and the frame of the reference tags.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "app/measure/diagnosis/data/dataset.h"
#include "app/measure/diagnosis/linear/linearisation.h"

namespace plumbline::measure {

using GroupIndex = TypedIndex<struct GroupTag>;          ///< group of nuisances
using ComponentIndex = TypedIndex<struct ComponentTag>;  ///< groups that equations connect

/// Prior knowledge of the nuisances, as one more residual: a known distance, a position declared
/// with a standard deviation, or, with an empty `of`, one of the six equations for the frame of the
/// reference tags. In units of its standard deviation.
struct Equation {
  double residual = 0;
  std::vector<std::pair<int, double>> slopes;  ///< nuisance, and d prediction / d nuisance
  Reference reference;
  double declared_m = 0, sd_m = 0;
};

/// Positions of all nuisances in one vector: for each session its free frames (base translation,
/// base rotation, the tip of each tool), then groups. A row depends on the base of its session, on
/// the tip of its tool there, and on at most one group: the constants of its artefact, for a pose
/// the orientation of that tool in that session, or for a position measured by a named camera the
/// error of the frame of the reference tags (shift and turn).
class Nuisances {
 public:
  explicit Nuisances(const Dataset& data);

  int size() const { return size_; }
  bool frames() const { return frames_; }
  bool tip() const { return tip_; }
  int of_sessions() const { return of_sessions_; }
  /// First of the six of a session's base; only if bases are free.
  int BaseOf(SessionIndex session) const { return base_[session]; }
  /// First of the three of a tool's tip in a session; nullopt if tips are known, or the session did
  /// not measure that tool.
  std::optional<int> TipOf(SessionIndex session, int tool) const {
    const int first = tip_of_[TipIndex(session, tool)];
    return first < 0 ? std::nullopt : std::optional(first);
  }

  /// Adds the prediction's change by a row's part of `step`, the frames of the sessions only.
  /// @param step  shape (of_sessions())
  void AddFrames(const LinearRow& at, RowIndex row, const double* step, RowResidual& change) const;
  /// Calls `write(block, first)` for each block of a row's derivatives by free frames: shape
  /// (residuals of the row, 6) and (.., 3), and their first position.
  template <typename Write>
  void ForEachFrameBlock(const FrameGradient& derivative, RowIndex row, const Write& write) const {
    const SessionIndex session = data_.session_of[row];
    if (frames_) write(derivative.leftCols<6>(), BaseOf(session));
    if (const auto tip = TipOf(session, data_.payloads[row].tool))
      write(derivative.rightCols<3>(), *tip);
  }

  /// The group of a row; nullopt if it has none, or a group without free parameters.
  std::optional<GroupIndex> GroupOf(RowIndex row) const;
  int groups() const { return static_cast<int>(first_.size()) - 1; }
  int FirstOf(GroupIndex group) const { return first_[group.offset()]; }
  int CountOf(GroupIndex group) const { return first_[group.offset() + 1] - FirstOf(group); }

  int components() const { return components_; }
  ComponentIndex ComponentOf(GroupIndex group) const { return component_[group]; }
  /// The groups of a component with free parameters, ascending.
  std::vector<GroupIndex> GroupsOf(ComponentIndex component) const;
  /// Components of artefact positions, without orientations of tools.
  bool IsPlace(GroupIndex group) const { return group.value() < artefacts_; }
  /// The frame of the reference tags; it exists if rows rest on them.
  bool IsTags(GroupIndex group) const { return group == tags_; }

  /// True if nothing relates the robot's base to W, although the cell calls it known: moving the
  /// base moves all positions with it. The base then stays as declared, and no effect that only
  /// moves it is seen. To first order its columns do not vanish where the rows of one artefact
  /// scatter, so that a search must project them out, too.
  bool FloatWithBase() const;

  /// Number of equations, and the equations of each component at a model.
  int equations() const { return equations_; }
  std::vector<Equation> EquationsAt(const Model& model, ComponentIndex component) const;
  /// All of them, ascending by component.
  std::vector<Equation> EquationsAt(const Model& model) const;

  /// Applies a step of all nuisances to a model.
  void Move(const Eigen::VectorXd& step, Model& model) const;
  void MoveSessions(const double* step, Model& model) const;
  void MoveGroup(GroupIndex group, const double* step, Model& model) const;

  /// Change of a row's prediction caused by a step of all nuisances, to first order.
  RowResidual Change(const LinearRow& at, RowIndex row, const Eigen::VectorXd& step) const;

  /// Writes d prediction / d nuisance of a row; other columns of `X` are not touched.
  /// @param X  shape (residuals of the row, size())
  void Fill(const LinearRow& at, RowIndex row, Eigen::Ref<Eigen::MatrixXd> X) const;

 private:
  std::size_t TipIndex(SessionIndex session, int tool) const {
    return static_cast<std::size_t>(tools_ * session.value() + tool);
  }
  void AddTagsEquations(const Model& model, std::vector<Equation>& all) const;
  void AddPlaceEquations(const Model& model, GroupIndex group, std::vector<Equation>& all) const;
  void AddDistance(const Model& model, int number, std::vector<Equation>& all) const;
  bool Binds(const model::KnownDistance& distance) const;

  const Dataset& data_;
  bool frames_, tip_;
  int tools_;
  int artefacts_ = 0, of_sessions_ = 0, size_ = 0, components_ = 0, equations_ = 0;
  Indexed<SessionIndex, int> base_;  ///< positions of the bases
  std::vector<int> tip_of_;          ///< positions of the tips, by TipIndex; -1 if not measured
  std::vector<int> first_ = {0};
  std::optional<GroupIndex> tags_;
  Indexed<GroupIndex, ComponentIndex> component_;
};

/// Normal equations H step = g of the nuisances.
struct NuisanceEquations {
  explicit NuisanceEquations(const Nuisances& nuisances)
      : H(Eigen::MatrixXd::Zero(nuisances.size(), nuisances.size())),
        g(Eigen::VectorXd::Zero(nuisances.size())) {}

  /// Adds a row with this weight and residual; whitened by its own covariance only.
  void Add(const Dataset& data, const Nuisances& nuisances, const LinearRow& at, RowIndex row,
           double weight, const RowResidual& residual);
  /// Adds equations, each with this weight.
  void Add(const std::vector<Equation>& equations, double weight);

  Eigen::MatrixXd H;
  Eigen::VectorXd g;
};

}  // namespace plumbline::measure
