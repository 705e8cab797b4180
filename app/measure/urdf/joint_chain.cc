#include "app/measure/urdf/joint_chain.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>

namespace plumbline::measure {
namespace {

/// Largest number of links: the search for rings walks from each link to its root.
constexpr std::size_t kMaxLinks = 2000;

/// Joints by the links they connect.
struct Tree {
  explicit Tree(const UrdfFile& urdf) {
    for (const UrdfLink& link : urdf.links) links.emplace(link.name, &link);
    for (const UrdfJoint& joint : urdf.joints) {
      above.emplace(joint.child, &joint);
      below.emplace(joint.parent, &joint);
    }
  }
  std::map<std::string, const UrdfLink*> links;
  std::map<std::string, const UrdfJoint*> above;
  std::multimap<std::string, const UrdfJoint*> below;
};

/// Number of moving joints between `base` (empty: the root) and a link; nullopt if the link does
/// not hang on it, or if its parents form a ring.
std::optional<int> MovingAbove(const Tree& tree, const std::string& base, std::string link) {
  int moving = 0;
  for (std::size_t steps = 0; steps <= tree.above.size(); ++steps) {
    const auto joint = tree.above.find(link);
    const bool at_base = !base.empty() && link == base;
    if (at_base || joint == tree.above.end()) {
      return base.empty() || at_base ? std::optional(moving) : std::nullopt;
    }
    moving += joint->second->Moves() ? 1 : 0;
    link = joint->second->parent;
  }
  return std::nullopt;
}

class ChainBuilder {
 public:
  ChainBuilder(const UrdfFile& urdf, std::string file, Rising rising, config::FaultList& faults)
      : urdf_(urdf), tree_(urdf), file_(std::move(file)), rising_(rising), faults_(faults) {}

  std::optional<JointChain> Build(const std::string& base, const std::string& tip) {
    if (urdf_.links.size() > kMaxLinks) {
      Fault(urdf_.links[kMaxLinks].line, "link " + urdf_.links[kMaxLinks].name,
            fmt::format("the file has {} links; allowed are {}; keep the arm and remove the rest",
                        urdf_.links.size(), kMaxLinks));
      return std::nullopt;
    }
    if (!Known("--base", base) || !Known("--tip", tip)) return std::nullopt;
    const auto tip_name = tip.empty() ? End(base) : std::optional(tip);
    const auto base_name = !tip_name || !base.empty() ? std::optional(base) : RootAbove(*tip_name);
    if (!tip_name || !base_name) return UseAll();
    JointChain chain = ChainOf(*base_name, *tip_name);
    if (chain.joints.empty() && base.empty() && tip.empty()) return UseAll();
    if (faults_.HasFaults()) return std::nullopt;
    WarnOfUnused();
    return chain;
  }

 private:
  void Fault(int line, const std::string& key, const std::string& what) {
    faults_.Add({config::Fault::Severity::kFault, file_, line, key, what});
  }
  void Warn(int line, const std::string& key, const std::string& what) {
    faults_.Add({config::Fault::Severity::kWarning, file_, line, key, what});
  }

  /// True if an option names a link of the file, or nothing.
  bool Known(const char* option, const std::string& name) {
    if (name.empty() || tree_.links.contains(name)) return true;
    std::vector<std::string> names;
    for (const auto& [link, ignored] : tree_.links) names.push_back(link);
    Fault(0, option,
          fmt::format(
              "\"{}\" is not a link of this file; it has {}", name,
              fmt::join(names.begin(),
                        names.begin() + std::min<std::ptrdiff_t>(30, std::ssize(names)), ", ")));
    return false;
  }

  std::optional<std::string> RootAbove(std::string link) {
    const auto own = tree_.links.find(link);
    if (!MovingAbove(tree_, "", link)) {
      Fault(own->second->line, "link " + link,
            "is connected in a ring with its own parents; a robot is a tree, remove one joint");
      return std::nullopt;
    }
    while (tree_.above.contains(link)) link = tree_.above.at(link)->parent;
    return link;
  }

  std::optional<std::string> End(const std::string& base) {
    if (tree_.links.contains("tool0") && MovingAbove(tree_, base, "tool0")) return "tool0";
    int most = -1;
    std::vector<std::string> ends;
    for (const UrdfLink& link : urdf_.links) {
      const std::optional<int> moving = MovingAbove(tree_, base, link.name);
      if (!moving || tree_.below.contains(link.name)) continue;
      if (*moving > most) ends.clear();
      if (*moving >= most) ends.push_back(link.name), most = *moving;
    }
    if (ends.size() == 1) return ends.front();
    for (const UrdfLink& link : urdf_.links) {
      if (ends.empty() && !RootAbove(link.name)) return std::nullopt;
    }
    Fault(0, "--tip",
          ends.empty()
              ? "is needed: no chain has an end, each link carries a joint; name the flange"
              : fmt::format("is needed: the chain may end in {}; choose the flange",
                            fmt::join(ends, ", ")));
    return std::nullopt;
  }

  /// Takes over the faults of a link or joint that is part of the arm; `fixed_to` names the link
  /// that carries one beside the chain.
  template <typename Element>
  void Use(const Element& element, const std::string& fixed_to = "") {
    for (config::Fault fault : element.faults) {
      if (!taken_.insert(config::FaultText(fault)).second) continue;
      if (!fixed_to.empty()) fault.what += "; it moves with the arm, fixed to link " + fixed_to;
      faults_.Add(std::move(fault));
    }
    used_.insert(&element);
  }

  /// Without an arm, any element may be the reason.
  std::nullopt_t UseAll() {
    for (const UrdfJoint& joint : urdf_.joints) Use(joint);
    for (const UrdfLink& link : urdf_.links) Use(link);
    return std::nullopt;
  }

  /// One warning for the faults of everything that the arm does not need.
  void WarnOfUnused() {
    std::vector<config::Fault> unused;
    const auto collect = [&](const auto& elements) {
      for (const auto& element : elements) {
        if (element.faults.empty() || used_.contains(&element)) continue;
        for (const config::Fault& fault : element.faults) {
          if (taken_.insert(config::FaultText(fault)).second) unused.push_back(fault);
        }
      }
    };
    collect(urdf_.links);
    collect(urdf_.joints);
    if (unused.empty()) return;
    const config::Fault& first = unused.front();
    Warn(first.line, first.key,
         fmt::format("{} (outside the arm and not used{})", first.what,
                     unused.size() == 1 ? "" : fmt::format(", like {} more", unused.size() - 1)));
  }

  void CheckJoint(const UrdfJoint& joint);
  void AddMasses(const std::string& link, const Pose& X, const UrdfJoint* onwards,
                 ChainJoint& joint);
  JointChain ChainOf(const std::string& base, const std::string& tip);

  const UrdfFile& urdf_;
  Tree tree_;
  std::string file_;
  Rising rising_;
  config::FaultList& faults_;
  std::set<const void*> used_;   ///< links and joints of the arm, and everything fixed to it
  std::set<std::string> taken_;  ///< faults that are reported; two elements may share one
};

void ChainBuilder::CheckJoint(const UrdfJoint& joint) {
  const std::string key = "joint " + joint.name;
  if (joint.type == UrdfJoint::Type::kPlanar || joint.type == UrdfJoint::Type::kFloating) {
    Fault(joint.line, key + ".type",
          fmt::format("\"{}\" cannot be part of a serial arm; choose --base or --tip so that it "
                      "lies outside the chain, or make it fixed",
                      joint.type_name));
  }
  if (!joint.mimics.empty()) {
    Fault(joint.line, key + ".mimic",
          fmt::format("follows joint \"{}\": a coupled axis has no reading of its own; remove "
                      "<mimic> if the controller reports it, or choose another --tip",
                      joint.mimics));
  }
  if (joint.limits && joint.limits->low >= joint.limits->high) {
    Fault(joint.line, key + ".limit",
          fmt::format("lower {} is not less than upper {}; correct them", joint.limits->low,
                      joint.limits->high));
  }
  if (!joint.limits) {
    Warn(joint.line, key + ".limit",
         joint.type == UrdfJoint::Type::kContinuous
             ? "the joint is continuous: the cell has no limits for it"
             : "has no lower and upper: the cell has no limits for it");
  }
  if (joint.rising != 0 && rising_ == Rising::kIgnored) {
    Warn(joint.line, key + ".calibration.rising",
         fmt::format("{} is ignored; if it is an offset that the driver adds to the reading, as "
                     "robot_calibration writes it, give --apply-rising",
                     joint.rising));
  }
}

/// Adds the masses of `link` and of everything fixed to it; `onwards` is the next joint of the
/// chain.
void ChainBuilder::AddMasses(const std::string& start, const Pose& X_start,
                             const UrdfJoint* onwards, ChainJoint& joint) {
  struct Attached {
    std::string link;
    Pose X;
    std::string fixed_to;
  };
  std::vector<Attached> open{{start, X_start, ""}};
  while (!open.empty()) {
    const auto [name, X, fixed_to] = open.back();
    open.pop_back();
    const auto known = tree_.links.find(name);
    // A missing link, or one with two parents, is a fault of a joint already.
    if (known == tree_.links.end() || used_.contains(known->second)) continue;
    const UrdfLink& link = *known->second;
    Use(link, fixed_to);
    if (link.mass_kg) {
      const double before = joint.mass_kg.value_or(0), sum = before + *link.mass_kg;
      if (sum > 0) joint.com = (before * joint.com + *link.mass_kg * (X * link.com)) / sum;
      joint.mass_kg = sum;
    }
    const auto [first, last] = tree_.below.equal_range(name);
    for (auto at = first; at != last; ++at) {
      const UrdfJoint& next = *at->second;
      if (!next.Moves()) {
        const bool beside = !used_.contains(&next);
        if (beside) Use(next, next.parent);
        open.push_back({next.child, X * next.X_PJ, beside ? next.parent : ""});
      } else if (&next != onwards) {
        Warn(next.line, "joint " + next.name,
             fmt::format("moves beside the chain: the mass from link {} on is not part of the cell",
                         next.child));
      }
    }
  }
}

JointChain ChainBuilder::ChainOf(const std::string& base, const std::string& tip) {
  JointChain chain{urdf_.name, base, tip, {}, {}};
  const std::vector<const UrdfJoint*> path = PathOf(urdf_, base, tip);
  std::vector<const UrdfJoint*> moving;
  const auto root = tree_.links.find(base);
  if (root != tree_.links.end()) Use(*root->second);
  for (const UrdfJoint* joint : path) {
    Use(*joint);
    chain.X_last_tip = chain.X_last_tip * joint->X_PJ;
    if (!joint->Moves()) continue;
    CheckJoint(*joint);
    moving.push_back(joint);
    ChainJoint& added = chain.joints.emplace_back();
    added.name = joint->name;
    added.child = joint->child;
    added.type = joint->type == UrdfJoint::Type::kPrismatic ? model::JointType::kPrismatic
                                                            : model::JointType::kRevolute;
    if (rising_ == Rising::kAddedToReading) added.rising = joint->rising;
    added.X_prev = chain.X_last_tip * JointMotion(added.type, joint->axis, added.rising);
    added.axis = joint->axis;
    added.limits = joint->limits;
    chain.X_last_tip = Pose();
  }
  if (moving.empty() || std::ssize(moving) > model::kMaxJoints) {
    Fault(0, fmt::format("{} to {}", base, tip),
          path.empty()
              ? "there is no chain: the tip does not hang on the base; choose other --base "
                "and --tip"
              : fmt::format("the chain has {} moving joints; allowed are 1 to {}", moving.size(),
                            model::kMaxJoints));
    return chain;
  }
  for (std::size_t i = 0; i < moving.size(); ++i) {
    const UrdfJoint* onwards = i + 1 < moving.size() ? moving[i + 1] : nullptr;
    AddMasses(moving[i]->child, Pose(), onwards, chain.joints[i]);
  }
  return chain;
}

}  // namespace

std::vector<const UrdfJoint*> PathOf(const UrdfFile& urdf, const std::string& base,
                                     const std::string& tip) {
  const Tree tree(urdf);
  std::vector<const UrdfJoint*> path;
  std::string link = tip;
  while (link != base) {
    const auto joint = tree.above.find(link);
    if (joint == tree.above.end() || path.size() > urdf.joints.size()) return {};
    path.push_back(joint->second);
    link = joint->second->parent;
  }
  std::ranges::reverse(path);
  return path;
}

Pose JointMotion(model::JointType type, const Vec3& axis, double position) {
  if (type == model::JointType::kPrismatic) return {Mat3::Identity(), position * axis};
  return {Eigen::AngleAxisd(position, axis).toRotationMatrix(), Vec3::Zero()};
}

Pose TipPose(const JointChain& chain, const model::JointVector& q) {
  Pose X;
  for (std::size_t i = 0; i < chain.joints.size(); ++i) {
    const ChainJoint& joint = chain.joints[i];
    X = X * joint.X_prev * JointMotion(joint.type, joint.axis, q[static_cast<Eigen::Index>(i)]);
  }
  return X * chain.X_last_tip;
}

std::optional<JointChain> ChainFromUrdf(const UrdfFile& urdf, const std::string& file,
                                        const std::string& base, const std::string& tip,
                                        Rising rising, config::FaultList& faults) {
  config::FaultList own;
  std::optional<JointChain> chain = ChainBuilder(urdf, file, rising, own).Build(base, tip);
  faults.Append(own);
  return chain;
}

}  // namespace plumbline::measure
