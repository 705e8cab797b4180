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
    : data_(data), frames_(data.frames_free()), tip_(data.tip_free()) {
  artefacts_ = static_cast<int>(data.cell.artefacts.size());
  of_sessions_ = size_ = per_session() * data.sessions_count();
  first_.front() = size_;
  for (int k = 0; k < artefacts_; ++k) {
    if (data.used_artefacts[ArtefactIndex(k)]) size_ += FreedomOf(Declared(data, k)).size();
    first_.push_back(size_);
  }
  for (const SessionIndex session : data.sessions.indices()) {
    if (tip_ && data.turned_sessions[session]) size_ += 3;
    first_.push_back(size_);
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
    group = GroupIndex(artefacts_ + data_.session_of[row].value());
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
  for (Model::Frames& frames : model.frames) {
    Eigen::Matrix<double, 9, 1> of_session = Eigen::Matrix<double, 9, 1>::Zero();
    if (frames_) of_session.head<6>() = Eigen::Map<const Eigen::Matrix<double, 6, 1>>(step);
    if (tip_) of_session.tail<3>() = Eigen::Map<const Vec3>(step + (frames_ ? 6 : 0));
    MoveFrames(frames, of_session);
    step += per_session();
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
    Model::Frames& frames = model.frames[SessionIndex(group.value() - artefacts_)];
    frames.R_FT = frames.R_FT * RotationFromVector(Eigen::Map<const Vec3>(step));
  }
}

void Nuisances::Move(const Eigen::VectorXd& step, Model& model) const {
  MoveSessions(step.data(), model);
  for (const GroupIndex group : component_.indices()) {
    MoveGroup(group, step.data() + FirstOf(group), model);
  }
}

RowResidual Nuisances::Change(const LinearRow& at, RowIndex row,
                              const Eigen::VectorXd& step) const {
  RowResidual change = RowResidual::Zero(at.residual.size());
  const double* of_session = step.data() + FirstOf(data_.session_of[row]);
  if (frames_) {
    change += at.frames.leftCols<6>() * Eigen::Map<const Eigen::Matrix<double, 6, 1>>(of_session);
  }
  if (tip_) {
    change += at.frames.rightCols<3>() * Eigen::Map<const Vec3>(of_session + (frames_ ? 6 : 0));
  }
  if (const auto group = GroupOf(row)) {
    change += at.own * step.segment(FirstOf(*group), CountOf(*group));
  }
  return change;
}

void Nuisances::Fill(const LinearRow& at, RowIndex row, Eigen::Ref<Eigen::MatrixXd> X) const {
  const int first = FirstOf(data_.session_of[row]);
  if (frames_) X.middleCols(first, 6) = at.frames.leftCols<6>();
  if (tip_) X.middleCols(first + (frames_ ? 6 : 0), 3) = at.frames.rightCols<3>();
  if (const auto group = GroupOf(row)) X.middleCols(FirstOf(*group), CountOf(*group)) = at.own;
}

void NuisanceEquations::Add(const Dataset& data, const Nuisances& nuisances, const LinearRow& at,
                            RowIndex row, double weight, const RowResidual& residual) {
  const auto count = at.frames.rows();
  const int per_session = nuisances.per_session();
  const auto group = nuisances.GroupOf(row);
  const int own = group ? nuisances.CountOf(*group) : 0;
  if (count == 0 || per_session + own == 0) return;
  const RowWhitening whitening(data.numbers[row], 1);
  Eigen::MatrixXd J(count, per_session + own), white(count, per_session + own);
  if (nuisances.frames()) J.leftCols<6>() = at.frames.leftCols<6>();
  if (nuisances.tip()) J.middleCols(nuisances.frames() ? 6 : 0, 3) = at.frames.rightCols<3>();
  if (group) J.rightCols(own) = at.own;
  whitening.Apply(J, white);
  RowResidual r(count);
  whitening.Apply(residual, r);
  const Eigen::MatrixXd square = weight * white.transpose() * white;
  const Eigen::VectorXd product = weight * white.transpose() * r;
  const int first = nuisances.FirstOf(data.session_of[row]);
  H.block(first, first, per_session, per_session) += square.topLeftCorner(per_session, per_session);
  g.segment(first, per_session) += product.head(per_session);
  if (!group) return;
  const int at_own = nuisances.FirstOf(*group);
  H.block(at_own, at_own, own, own) += square.bottomRightCorner(own, own);
  H.block(at_own, first, own, per_session) += square.bottomLeftCorner(own, per_session);
  H.block(first, at_own, per_session, own) += square.topRightCorner(per_session, own);
  g.segment(at_own, own) += product.tail(own);
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
