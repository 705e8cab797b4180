#include "app/measure/diagnosis/linear/nuisances.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "app/measure/diagnosis/linear/fit_problem.h"
#include "firmware-like/geometry/rotation.h"

namespace plumbline::measure {
namespace {

/// Standard deviation of what is declared as exact [m], so that its equation stays finite.
constexpr double kExact_m = 1e-6;

constexpr int kTagsFreedom = 6;  // shift and turn of the frame of the reference tags

const model::Artefact& Declared(const Dataset& data, int artefact) {
  return data.cell.artefacts[artefact];
}

/// Leader of a set in a union-find forest.
int LeaderOf(std::vector<int>& leader, int k) {
  while (leader[k] != k) k = leader[k];
  return k;
}

}  // namespace

Nuisances::Nuisances(const Dataset& data)
    : data_(data), frames_(data.frames_free()), tip_(data.tip_free()), tools_(data.cell.tools()) {
  artefacts_ = static_cast<int>(data.cell.artefacts.size());
  for (const SessionIndex session : data.sessions.indices()) {
    base_.push_back(size_);
    if (frames_) size_ += 6;
    for (const bool measured : data.measured_tools[session]) {
      tip_of_.push_back(tip_ && measured ? size_ : -1);
      if (tip_ && measured) size_ += 3;
    }
  }
  of_sessions_ = first_.front() = size_;
  for (int k = 0; k < artefacts_; ++k) {
    if (data.used_artefacts[ArtefactIndex(k)]) size_ += FreedomOf(Declared(data, k)).size();
    first_.push_back(size_);
  }
  for (const SessionIndex session : data.sessions.indices()) {
    for (int tool = 0; tool < tools_; ++tool) {
      if (data.turned_sessions[session] && TipOf(session, tool)) size_ += 3;
      first_.push_back(size_);
    }
  }
  const auto rows = data.row_indices();
  if (std::ranges::any_of(rows, [&](RowIndex k) { return data.rests_on_tags(k); })) {
    tags_ = GroupIndex(groups());
    size_ += kTagsFreedom;
    equations_ += kTagsFreedom;
    first_.push_back(size_);
  }
  std::vector<int> leader(static_cast<std::size_t>(groups()));
  std::iota(leader.begin(), leader.end(), 0);
  for (const model::KnownDistance& distance : data.cell.distances) {
    if (!Binds(distance)) continue;
    leader[LeaderOf(leader, distance.second)] = LeaderOf(leader, distance.first);
    ++equations_;
  }
  std::vector<int> number(leader.size(), -1);
  for (const GroupIndex group : FirstIndices<GroupIndex>(groups())) {
    int& own = number[LeaderOf(leader, group.value())];
    if (own < 0) own = components_++;
    component_.emplace_back(own);
    if (!IsPlace(group) || CountOf(group) == 0) continue;
    const model::Artefact& artefact = Declared(data, group.value());
    const ArtefactFreedom freedom = FreedomOf(artefact);
    if (artefact.place) equations_ += freedom.place;
    if (artefact.radius_m) equations_ += freedom.radius;
  }
}

bool Nuisances::Binds(const model::KnownDistance& distance) const {
  const GroupIndex first(distance.first), second(distance.second);
  return data_.used_artefacts[ArtefactIndex(distance.first)] &&
         data_.used_artefacts[ArtefactIndex(distance.second)] &&
         CountOf(first) + CountOf(second) > 0;
}

std::optional<GroupIndex> Nuisances::GroupOf(RowIndex row) const {
  const Observation& observation = data_.observations[row];
  GroupIndex group;
  if (OnArtefact(observation.kind)) {
    group = GroupIndex(observation.artefact.value());
  } else if (observation.kind == ObservationKind::kPose) {
    group =
        GroupIndex(artefacts_ + tools_ * data_.session_of[row].value() + data_.payloads[row].tool);
  } else if (data_.rests_on_tags(row)) {
    return tags_;
  } else {
    return std::nullopt;
  }
  return CountOf(group) > 0 ? std::optional(group) : std::nullopt;
}

std::vector<GroupIndex> Nuisances::GroupsOf(ComponentIndex component) const {
  std::vector<GroupIndex> own;
  for (const GroupIndex group : component_.indices()) {
    if (component_[group] == component && CountOf(group) > 0) own.push_back(group);
  }
  return own;
}

void Nuisances::AddPlaceEquations(const Model& model, GroupIndex group,
                                  std::vector<Equation>& all) const {
  const model::Artefact& artefact = Declared(data_, group.value());
  const PlacedArtefact& now = model.artefacts[ArtefactIndex(group.value())];
  const ArtefactFreedom freedom = FreedomOf(artefact);
  const double sd_m = std::max(artefact.sd_m, kExact_m);
  int at = FirstOf(group);
  const auto add = [&](double declared_m, double now_m, int nuisance) {
    all.push_back({(declared_m - now_m) / sd_m,
                   {{nuisance, 1 / sd_m}},
                   {std::nullopt, ArtefactIndex(group.value())},
                   declared_m,
                   sd_m});
  };
  if (artefact.place && freedom.place == 1) {
    add(now.direction.dot(*artefact.place), now.direction.dot(now.place), at);
  }
  for (int axis = 0; artefact.place && freedom.place == 3 && axis < 3; ++axis) {
    add((*artefact.place)[axis], now.place[axis], at + axis);
  }
  at += freedom.place + freedom.direction;
  if (artefact.radius_m && freedom.radius == 1) add(*artefact.radius_m, now.radius_m, at);
}

/// The frame of the tags is the rigid fit to their places, each with an error of its own: the
/// precision of shift and turn x is H = sum J^T J / sd^2, J = [1, d (turn x place) / d turn]. With
/// H = L L^T, the residuals -L^T x have unit covariance.
void Nuisances::AddTagsEquations(const Model& model, std::vector<Equation>& all) const {
  using Matrix6 = Eigen::Matrix<double, kTagsFreedom, kTagsFreedom>;
  const model::Measurement& measurement = data_.cell.measurement;
  Matrix6 H = Matrix6::Zero();
  for (const Vec3& place_W : measurement.reference_tags_W) {
    Eigen::Matrix<double, 3, kTagsFreedom> J;
    J.leftCols<3>().setIdentity();
    for (int axis = 0; axis < 3; ++axis) J.col(3 + axis) = Vec3::Unit(axis).cross(place_W);
    H += J.transpose() * J;
  }
  const Matrix6 L = H.llt().matrixL();
  const Matrix6 slopes = L.transpose() / std::max(measurement.reference_sd_m, kExact_m);
  Eigen::Matrix<double, kTagsFreedom, 1> x;
  x << model.tags_shift, model.tags_turn;
  for (int k = 0; k < kTagsFreedom; ++k) {
    Equation& equation = all.emplace_back();
    equation.residual = -slopes.row(k).dot(x);
    for (int j = k; j < kTagsFreedom; ++j) {
      equation.slopes.emplace_back(FirstOf(*tags_) + j, slopes(k, j));
    }
  }
}

void Nuisances::AddDistance(const Model& model, int number, std::vector<Equation>& all) const {
  const model::KnownDistance& distance = data_.cell.distances[number];
  const Vec3 apart = model.artefacts[ArtefactIndex(distance.second)].place -
                     model.artefacts[ArtefactIndex(distance.first)].place;
  const double length = apart.norm(), sd_m = std::max(distance.sd_m, kExact_m);
  const Vec3 unit = length > 0 ? Vec3(apart / length) : Vec3::UnitX();
  Equation& equation = all.emplace_back();
  equation.residual = (distance.value_m - length) / sd_m;
  equation.reference.distance = number;
  equation.declared_m = distance.value_m;
  equation.sd_m = sd_m;
  for (const auto& [artefact, sign] : {std::pair(distance.first, -1.0), {distance.second, 1.0}}) {
    const GroupIndex group(artefact);
    if (CountOf(group) == 0) continue;
    for (int axis = 0; axis < 3; ++axis) {
      equation.slopes.emplace_back(FirstOf(group) + axis, sign * unit[axis] / sd_m);
    }
  }
}

bool Nuisances::FloatWithBase() const {
  if (frames_ || data_.instrument_used()) return false;
  return std::ranges::all_of(data_.used_artefacts.indices(), [&](ArtefactIndex k) {
    const model::Artefact& artefact = Declared(data_, k.value());
    return !data_.used_artefacts[k] || artefact.in_base || (!artefact.place && !artefact.direction);
  });
}

std::vector<Equation> Nuisances::EquationsAt(const Model& model, ComponentIndex component) const {
  std::vector<Equation> all;
  for (const GroupIndex group : GroupsOf(component)) {
    if (IsPlace(group)) AddPlaceEquations(model, group, all);
    if (IsTags(group)) AddTagsEquations(model, all);
  }
  for (int k = 0; k < static_cast<int>(data_.cell.distances.size()); ++k) {
    const model::KnownDistance& distance = data_.cell.distances[k];
    if (!Binds(distance) || component_[GroupIndex(distance.first)] != component) continue;
    AddDistance(model, k, all);
  }
  return all;
}

std::vector<Equation> Nuisances::EquationsAt(const Model& model) const {
  std::vector<Equation> all;
  if (equations_ == 0) return all;
  for (const ComponentIndex component : FirstIndices<ComponentIndex>(components_)) {
    for (Equation& equation : EquationsAt(model, component)) all.push_back(std::move(equation));
  }
  return all;
}

void Nuisances::MoveSessions(const double* step, Model& model) const {
  for (const SessionIndex session : base_.indices()) {
    Model::Frames& frames = model.frames[session];
    if (frames_) {
      const Eigen::Map<const Eigen::Matrix<double, 6, 1>> of_base(step + BaseOf(session));
      MoveBase(frames.X_WB, of_base);
    }
    for (int tool = 0; tool < tools_; ++tool) {
      const auto tip = TipOf(session, tool);
      if (tip) frames.X_FT[tool].p += Eigen::Map<const Vec3>(step + *tip);
    }
  }
}

void Nuisances::MoveGroup(GroupIndex group, const double* step, Model& model) const {
  if (CountOf(group) == 0) return;
  if (IsPlace(group)) {
    MoveArtefact(FreedomOf(Declared(data_, group.value())), step,
                 model.artefacts[ArtefactIndex(group.value())]);
  } else if (IsTags(group)) {
    model.tags_shift += Eigen::Map<const Vec3>(step);
    model.tags_turn += Eigen::Map<const Vec3>(step + 3);
  } else {
    const int tip = group.value() - artefacts_;  // see TipIndex
    Mat3& R_FT = model.frames[SessionIndex(tip / tools_)].X_FT[tip % tools_].R;
    R_FT = R_FT * RotationFromVector(Eigen::Map<const Vec3>(step));
  }
}

void Nuisances::Move(const Eigen::VectorXd& step, Model& model) const {
  MoveSessions(step.data(), model);
  for (const GroupIndex group : component_.indices()) {
    MoveGroup(group, step.data() + FirstOf(group), model);
  }
}

void Nuisances::AddFrames(const LinearRow& at, RowIndex row, const double* step,
                          RowResidual& change) const {
  ForEachFrameBlock(at.frames, row, [&](const auto& block, int first) {
    change += block * Eigen::Map<const Eigen::VectorXd>(step + first, block.cols());
  });
}

RowResidual Nuisances::Change(const LinearRow& at, RowIndex row,
                              const Eigen::VectorXd& step) const {
  RowResidual change = RowResidual::Zero(at.residual.size());
  AddFrames(at, row, step.data(), change);
  if (const auto group = GroupOf(row)) {
    change += at.own * step.segment(FirstOf(*group), CountOf(*group));
  }
  return change;
}

void Nuisances::Fill(const LinearRow& at, RowIndex row, Eigen::Ref<Eigen::MatrixXd> X) const {
  ForEachFrameBlock(at.frames, row, [&](const auto& block, int first) {
    X.middleCols(first, block.cols()) = block;
  });
  if (const auto group = GroupOf(row)) X.middleCols(FirstOf(*group), CountOf(*group)) = at.own;
}

void NuisanceEquations::Add(const Dataset& data, const Nuisances& nuisances, const LinearRow& at,
                            RowIndex row, double weight, const RowResidual& residual) {
  struct Columns {
    Eigen::MatrixXd white;
    int first;
  };
  const auto count = at.frames.rows();
  if (count == 0) return;
  const RowWhitening whitening(data.numbers[row], 1);
  std::vector<Columns> blocks;
  const auto add = [&](const auto& derivative, int first) {
    Columns& block = blocks.emplace_back();
    block.first = first;
    block.white.resize(count, derivative.cols());
    whitening.Apply(derivative, block.white);
  };
  nuisances.ForEachFrameBlock(at.frames, row, add);
  if (const auto group = nuisances.GroupOf(row)) add(at.own, nuisances.FirstOf(*group));
  RowResidual r(count);
  whitening.Apply(residual, r);
  for (const Columns& a : blocks) {
    g.segment(a.first, a.white.cols()) += weight * a.white.transpose() * r;
    for (const Columns& b : blocks) {
      H.block(a.first, b.first, a.white.cols(), b.white.cols()) +=
          weight * a.white.transpose() * b.white;
    }
  }
}

void NuisanceEquations::Add(const std::vector<Equation>& equations, double weight) {
  for (const Equation& equation : equations) {
    for (const auto& [i, slope] : equation.slopes) {
      g[i] += weight * slope * equation.residual;
      for (const auto& [j, other] : equation.slopes) H(i, j) += weight * slope * other;
    }
  }
}

}  // namespace plumbline::measure
