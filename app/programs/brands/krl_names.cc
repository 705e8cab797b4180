#include "app/programs/brands/krl_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <unordered_set>

namespace plumbline::programs::krl {

Names::Names(Reading& reading, const std::vector<LineIndex>& lines) : reading_(reading) {
  FindModules(lines);
  ReadDeclarations(lines);
  ReadAssignments(lines);
  MarkUntouchable();
}

std::string Names::Shown(const Place& place) const {
  return fmt::format("{}:{}", reading_.program.files[place.file].name, place.line);
}

std::size_t Names::Declare(std::string_view name, std::size_t module,
                           std::optional<std::size_t> routine) {
  auto& names = routine ? locals_[*routine] : modules_[module].variables;
  const auto [entry, added] = names.try_emplace(Lowered(name), variables_.size());
  if (added) {
    variables_.emplace_back();
    variables_.back().name = name;
    variables_.back().module = module;
  }
  return entry->second;
}

std::optional<std::size_t> Names::Find(std::string_view name, std::size_t module,
                                       std::optional<std::size_t> routine) const {
  const std::string key = Lowered(name);
  if (routine) {
    if (const auto found = locals_[*routine].find(key); found != locals_[*routine].end()) {
      return found->second;
    }
  }
  const auto& own = modules_[module].variables;
  if (const auto found = own.find(key); found != own.end()) return found->second;
  if (const auto found = globals_.find(key); found != globals_.end()) return found->second;
  return std::nullopt;
}

std::optional<std::size_t> Names::Global(std::string_view name) const {
  const auto found = globals_.find(Lowered(name));
  return found == globals_.end() ? std::nullopt : std::optional(found->second);
}

std::optional<std::size_t> Names::FindRoutine(std::size_t module, std::string_view name) const {
  const std::string key = Lowered(name);
  const auto& local = modules_[module].local_routines;
  if (const auto found = local.find(key); found != local.end()) return found->second;
  const auto found = global_routines_.find(key);
  return found == global_routines_.end() ? std::nullopt : std::optional(found->second);
}

std::string Names::TypeAt(const Variable& variable, std::string_view path) const {
  std::string type = variable.type;
  while (!path.empty()) {
    const std::string_view part = FirstPart(path);
    path.remove_prefix(part.size());
    if (!part.starts_with('.')) continue;
    const auto structure = structures_.find(type);
    if (structure == structures_.end()) return "";
    const auto member = structure->second.find(std::string(part.substr(1)));
    if (member == structure->second.end()) return "";
    type = member->second;
  }
  return type;
}

Reference Names::TakeReference(const Statement& statement, std::size_t module,
                               std::optional<std::size_t> routine, std::size_t& at) const {
  Reference reference;
  reference.name = statement.tokens[at].text;
  reference.variable = Find(reference.name, module, routine);
  ++at;
  while (at < statement.size()) {
    std::string part;
    if (statement.Has(at, '[')) {
      const std::size_t behind = statement.Behind(at, statement.size());
      part = IndexPath(statement, at, behind);
      if (part == "[*]" && behind > at + 2 && behind <= statement.size()) {
        const auto index = WholeNumber(statement, module, routine, at + 1, behind - 1);
        if (index) part = fmt::format("[{}]", *index);
      }
      at = behind;
    } else if (statement.Has(at, '.') && statement.HasAnyWord(at + 1)) {
      part = "." + Lowered(statement.tokens[at + 1].text);
      at += 2;
      const std::string_view component = std::string_view(part).substr(1);
      const std::string type =
          reference.variable ? TypeAt(variables_[*reference.variable], reference.path) : "";
      const bool number =
          (IsPoseType(type) && (IndexIn(kPoseComponents, component) || component == "s" ||
                                component == "t" || IndexIn(kExternalComponents, component))) ||
          (IsJointType(type) &&
           (IndexIn(kJointComponents, component) || IndexIn(kExternalComponents, component)));
      if (number || !reference.component.empty()) {
        reference.component = component;
        continue;
      }
    } else {
      break;
    }
    reference.path += part;
  }
  return reference;
}

std::vector<const Value*> Names::ValuesAt(const Reference& reference) const {
  std::vector<const Value*> found;
  if (!reference.variable) return found;
  const auto& values = variables_[*reference.variable].values;
  if (!HasUnknownIndex(reference.path)) {
    // The paths of parts begin with the path of the whole.
    for (auto at = values.lower_bound(reference.path);
         at != values.end() && at->first.starts_with(reference.path) && matches_left_ > 0; ++at) {
      --matches_left_;
      if (Overlap(reference.path, at->first)) found.push_back(&at->second);
    }
    return found;
  }
  for (const auto& [path, value] : values) {
    if (matches_left_ == 0) break;
    --matches_left_;
    if (Overlap(reference.path, path)) found.push_back(&value);
  }
  return found;
}

const Value* Names::ValueAt(std::size_t variable, const std::string& path) const {
  const auto found = variables_[variable].values.find(path);
  return found == variables_[variable].values.end() ? nullptr : &found->second;
}

const Value* Names::GlobalValue(std::string_view name, const std::string& path) const {
  const auto variable = Global(name);
  return variable ? ValueAt(*variable, path) : nullptr;
}

const Write* Names::WriteTo(std::size_t variable, const std::string& path) const {
  for (const Write& write : variables_[variable].writes) {
    if (matches_left_ == 0) return &write;
    --matches_left_;
    if (Overlap(write.path, path)) return &write;
  }
  return nullptr;
}

const Value* Names::ConstantValueOf(const Reference& reference, const Write*& write) const {
  write = nullptr;
  if (!reference.variable || !reference.component.empty()) return nullptr;
  const Variable& variable = variables_[*reference.variable];
  const Value* const value = ValueAt(*reference.variable, reference.path);
  if (value == nullptr || variable.parameter) return nullptr;
  for (const Write& one : variable.writes) {
    if (matches_left_ == 0) return nullptr;
    --matches_left_;
    if (!Overlap(one.path, reference.path) || one.Makes(reference.path, *value)) continue;
    write = &one;
    return nullptr;
  }
  return value;
}

std::optional<std::int64_t> Names::WholeNumber(const Statement& statement, std::size_t module,
                                               std::optional<std::size_t> routine,
                                               std::size_t begin, std::size_t end) const {
  if (end != begin + 1) return std::nullopt;
  const Token& token = statement.tokens[begin];
  if (token.kind != Token::Kind::kWord) return WholeNumberIn(token.text);
  const Reference variable{Find(token.text, module, routine), std::string(token.text), "", ""};
  const Write* write = nullptr;
  const Value* const value = ConstantValueOf(variable, write);
  return value == nullptr ? std::nullopt : WholeNumberIn(value->text);
}

}  // namespace plumbline::programs::krl
