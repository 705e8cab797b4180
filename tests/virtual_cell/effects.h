// Effects of the virtual world that the cell does not declare, with the names of the cell formats.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace virtual_cell {

/// One effect with its parameters in file units.
struct Effect {
  std::string id;
  std::map<std::string, double> values;
  bool by_move = false;  ///< of backlash: the sign of the last move instead of the torque
};

/// Reads `NAME:key=value,key=value`, for example `joint_compliance:q2=1e-7` or
/// `backlash:q1=2e-4,by=move`. @throws std::runtime_error for an unknown name, key or value
Effect EffectFromText(const std::string& text);
std::vector<Effect> EffectsFromTexts(const std::vector<std::string>& texts);

/// All effects of a world, queried by name.
class Effects {
 public:
  Effects() = default;
  explicit Effects(std::vector<Effect> list) : list_(std::move(list)) {}

  bool Has(const std::string& id) const { return Find(id) != nullptr; }
  bool ByMove(const std::string& id) const;
  double Value(const std::string& id, const std::string& key, double otherwise = 0) const;
  /// The parameter of joint `index` (from 0): key `q<index+1>` and `suffix`.
  double OfJoint(const std::string& id, int index, const std::string& suffix = "") const;

 private:
  const Effect* Find(const std::string& id) const;
  std::vector<Effect> list_;
};

/// Names of all effects with their keys, one per line, for `--help`.
std::string EffectCatalogue();

}  // namespace virtual_cell
