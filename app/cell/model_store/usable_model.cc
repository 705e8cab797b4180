#include "app/cell/model_store/usable_model.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>

#include "app/base/config/cell_reader.h"
#include "app/cell/model_store/cell_difference.h"
#include "app/cell/model_store/model_store.h"
#include "drivers/files/text_file.h"
#include "firmware-like/effects/catalogue.h"
#include "firmware-like/effects/written.h"

namespace plumbline::cell {

namespace {

/// A signal that the effect depends on and the cycle does not have: a row number, a file column.
std::optional<std::string> UnknownDriver(const model::WrittenEffect& written) {
  for (const model::EffectParameter& parameter : written.parameters) {
    if (parameter.name == "row") return "row";
  }
  effects::Conditions known;  // the conditions of a point in the cycle
  known.t_s = known.temp_C = 0.0;
  known.q = model::JointVector::Zero(model::kMaxJoints);
  for (const std::string& driver : written.drivers) {
    if (!known.Signal(driver)) return driver;
  }
  return std::nullopt;
}

}  // namespace

std::optional<std::string> ModelUnusableReason(const model::CellModel& cell) {
  for (const model::WrittenEffect& written : cell.effects) {
    const effects::Effect* effect = effects::FindEffect(written.id);
    if (effect != nullptr) {
      const effects::EffectTerm term = effects::ActiveFromWritten(written, cell).term;
      if (effects::ReadsTime(term) && !(cell.domain && cell.domain->time_zero_s)) {
        return fmt::format(
            "its effect \"{}\" depends on time, but the model does not define when its t_s was 0 "
            "([domain] time_zero_utc; `plumbline diagnose --time-zero`)",
            written.id);
      }
      if (const auto unknown = UnknownDriver(written)) {
        return fmt::format("its effect \"{}\" depends on \"{}\", which the daemon does not measure",
                           written.id, *unknown);
      }
    }
    if (effect != nullptr && effect->traits().Needs(effects::Signal::kTilt)) {
      return fmt::format(
          "its effect \"{}\" depends on an inclinometer on the base, which the daemon does not "
          "read: fasten the base, or diagnose without tilt_x_deg and tilt_y_deg",
          written.id);
    }
    std::string word;
    for (const model::EffectParameter& parameter : written.parameters) {
      if (!parameter.word.empty()) word = parameter.word;
    }
    if (effect == nullptr || effect->traits().Needs(effects::Signal::kOrder, word)) {
      return fmt::format(
          "its effect \"{}\" depends on the robot's last moves, which are not known "
          "for a point that it has yet to reach",
          written.id);
    }
  }
  return std::nullopt;
}

void AppendChangedModelWarning(const config::FaultList& of_model, const std::string& model_file,
                               config::FaultList& faults) {
  for (config::Fault fault : of_model.All()) {
    if (fault.severity != config::Fault::Severity::kWarning || fault.key != config::kFingerprintKey)
      continue;
    fault.file = model_file;
    faults.Add(std::move(fault));
  }
}

namespace {

/// Checks whether the version in force in place of the cell file can be read and used.
/// @return  the model, if it has no faults
std::optional<model::CellModel> AddFaultsOfApplied(const ModelStore& store, const ModelState& state,
                                                   const std::string& state_directory,
                                                   config::FaultList& faults) {
  const std::string file = store.ModelFile(state.applied);
  const Result<std::string> text = store.Text(state.applied);
  config::FaultList own;
  std::optional<model::CellModel> cell;
  if (text) {
    cell = config::CellFromText(*text, file, own);
  } else {
    own.Add({config::Fault::Severity::kFault, file, 0, "", text.error()});
  }
  if (cell) {
    if (const auto why_not = ModelUnusableReason(*cell)) {
      own.Add({config::Fault::Severity::kFault, file, 0, "effect", *why_not});
    }
  }
  if (!own.HasFaults()) {
    AppendChangedModelWarning(own, file, faults);
    return cell;
  }
  faults.Append(own);
  faults.Add(
      {config::Fault::Severity::kFault, file, 0, "",
       fmt::format("version {} is in force, but cannot be used, and the cell file is not used in "
                   "its place; choose another version with {} or {}",
                   state.applied, ModelCommand("rollback", state_directory),
                   ModelCommand(state.declared != 0 ? fmt::format("apply {}", state.declared)
                                                    : std::string("apply N"),
                                state_directory))});
  return std::nullopt;
}

/// Warns of an edited cell file that the daemon has not loaded yet.
void WarnOfEdit(const ModelStore& store, const ModelState& state, const std::string& cell_file,
                config::FaultList& faults) {
  if (state.Accepted() == state.applied) return;  // an edit would set no version aside
  const Result<std::string> declared = store.Text(state.Accepted()),
                            now = files::ReadTextFile(cell_file);
  if (!declared || !now) return;
  const Result<std::string> refused = store.Text(state.declared);
  if (refused && CellTextDifferences(*refused, *now).empty()) return;  // stays refused
  std::vector<std::string> changes = CellTextDifferences(*declared, *now);
  if (changes.empty()) return;
  faults.Add(
      {config::Fault::Severity::kWarning, cell_file, 0, "",
       fmt::format("differs from the cell that model version {} was applied to ({}{}): at its next "
                   "start or reload the daemon sets version {} aside and corrects by this file",
                   state.applied, changes.front(),
                   changes.size() == 1 ? "" : fmt::format(", and {} more", changes.size() - 1),
                   state.applied)});
}

}  // namespace

std::optional<model::CellModel> CheckModelStore(const std::string& state_directory,
                                                const std::string& cell_file,
                                                config::FaultList& faults) {
  const std::string folder = state_directory + "/models", file = folder + "/state.json";
  std::error_code hidden;
  static_cast<void>(std::filesystem::directory_iterator(folder, hidden));
  if (hidden) return std::nullopt;
  if (access(file.c_str(), F_OK) == 0 && access(file.c_str(), R_OK) != 0 && errno == EACCES) {
    return std::nullopt;
  }
  const Result<ModelStore> store = ModelStore::Open(state_directory);
  if (!store) return std::nullopt;
  const Result<ModelState> state = store->State();
  if (!state) {
    faults.Add({config::Fault::Severity::kFault, folder, 0, "", state.error()});
    return std::nullopt;
  }
  if (state->set_aside) {
    faults.Add({config::Fault::Severity::kWarning, folder, 0, "",
                SupersededText(*state, state_directory)});
  }
  if (state->applied == state->declared) return std::nullopt;
  std::optional<model::CellModel> model =
      AddFaultsOfApplied(*store, *state, state_directory, faults);
  if (!cell_file.empty()) WarnOfEdit(*store, *state, cell_file, faults);
  return model;
}

}  // namespace plumbline::cell
