#include "app/programs/flow/facts.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <utility>

namespace plumbline::programs {
namespace {

constexpr std::size_t kMostStarts = 16;  // previous motions of one motion that are followed

bool SameLoad(const LoadValue& a, const LoadValue& b) {
  return a.mass_kg == b.mass_kg && a.cog_F == b.cog_F && a.cog_in_tool == b.cog_in_tool;
}

bool SameLoad(const std::optional<LoadValue>& a, const std::optional<LoadValue>& b) {
  if (a.has_value() != b.has_value()) return false;
  return !a || SameLoad(*a, *b);
}

bool SameFrame(const FrameValue& a, const FrameValue& b) {
  return a.X.R == b.X.R && a.X.p == b.X.p && a.changes == b.changes && SameLoad(a.load, b.load);
}

double Coordinate(const FrameValue& frame) {
  return frame.X.p.x();
}

double Coordinate(const LoadValue& load) {
  return load.mass_kg.value_or(-1);
}

template <typename Value, typename Same>
std::unordered_map<std::string, int> ClassesOf(const std::map<std::string, Value>& values,
                                               const Same& same) {
  constexpr std::size_t kCompared = 64;
  // Sorted by a coordinate first, so that many frames do not have to be compared with each other.
  std::vector<std::pair<double, const std::pair<const std::string, Value>*>> order;
  for (const auto& entry : values) order.emplace_back(Coordinate(entry.second), &entry);
  std::stable_sort(order.begin(), order.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::unordered_map<std::string, int> classes;
  int next = 0;
  for (std::size_t k = 0; k < order.size(); ++k) {
    int found = kUnreached;
    for (std::size_t j = k; j-- > 0 && order[j].first == order[k].first && k - j <= kCompared;) {
      if (!same(order[j].second->second, order[k].second->second)) continue;
      found = classes.at(order[j].second->first);
      break;
    }
    classes[order[k].second->first] = found == kUnreached ? next++ : found;
  }
  return classes;
}

}  // namespace

const std::array<const char*, kFacts> kSlotNames = {"tool",
                                                    "base",
                                                    "load",
                                                    "extra load",
                                                    "displacement",
                                                    "posture of joint motions",
                                                    "posture of linear motions",
                                                    "previous motion"};

Facts::Facts(const Program& program) : program_(program) {
  const auto same_load = [](const LoadValue& a, const LoadValue& b) { return SameLoad(a, b); };
  classes_[static_cast<std::size_t>(Slot::kTool)] = ClassesOf(program.tools, SameFrame);
  classes_[static_cast<std::size_t>(Slot::kBase)] = ClassesOf(program.bases, SameFrame);
  for (const Slot slot : {Slot::kLoad, Slot::kExtra})
    classes_[static_cast<std::size_t>(slot)] = ClassesOf(program.loads, same_load);
}

int Facts::Add(Fact fact) {
  all_.push_back(std::move(fact));
  return static_cast<int>(all_.size()) - 1;
}

int Facts::Known(std::size_t slot, const std::string& key, const Place& place) {
  Classes& classes = classes_[slot];
  const auto at = classes.try_emplace(key, static_cast<int>(classes.size())).first;
  return Add({at->second, true, key, place});
}

int Facts::Previous(std::string text, const Place& place, std::vector<int> starts) {
  return Add({0, true, std::move(text), place, std::move(starts)});
}

int Facts::Unknown(std::string reason, const Place& place) {
  return Add({0, false, std::move(reason), place});
}

int Facts::MissingChanges(std::size_t slot, const Step& step) {
  return Unknown(
      fmt::format("{}: may be changed by {}, which {} starts and which is in none of "
                  "the files; --routine '{}=harmless' states that it changes nothing",
                  kSlotNames[slot], step.label, PlaceText(program_, step.place), step.label),
      step.place);
}

int Facts::FromSetting(std::size_t slot, const Setting& setting, const Place& place) {
  if (setting.unknown.empty()) return Known(slot, setting.key, place);
  return Unknown(slot == 4 ? fmt::format("{} since {}", setting.unknown, PlaceText(program_, place))
                           : fmt::format("{}: {} at {}", kSlotNames[slot], setting.unknown,
                                         PlaceText(program_, place)),
                 place);
}

int Facts::Join(std::size_t slot, int here, int other) {
  if (here == other || other == kUnreached) return here;
  if (here == kUnreached) return other;
  const Fact &a = (*this)[here], &b = (*this)[other];
  if (!a.known) return here;
  if (!b.known) return other;
  if (slot == kPrevious) return JoinStarts(here, other);
  if (a.value == b.value) return here;
  return Unknown(Conflict(slot, a, b), a.place);
}

int Facts::JoinStarts(int here, int other) {
  const Fact &a = (*this)[here], &b = (*this)[other];
  std::vector<int> both;
  std::ranges::set_union(a.starts, b.starts, std::back_inserter(both));
  if (both == a.starts) return here;
  if (both == b.starts) return other;
  std::string text = Conflict(kPrevious, a, b);
  const Place place = a.place;
  if (both.size() > kMostStarts) return Unknown(std::move(text), place);
  return Previous(std::move(text), place, std::move(both));
}

std::string Facts::Conflict(std::size_t slot, const Fact& a, const Fact& b) const {
  const std::string one = PlaceText(program_, a.place), other = PlaceText(program_, b.place);
  if (slot == kPrevious) {
    return fmt::format("reached from {} and from {}", one, other);
  }
  const auto name = [](const Fact& fact) {
    return fact.key.empty() ? std::string("none") : fact.key;
  };
  return fmt::format("{}: {} ({}) or {} ({}), depending on the path", kSlotNames[slot], name(a),
                     one, name(b), other);
}

}  // namespace plumbline::programs
