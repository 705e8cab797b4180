#include "app/model_store/usable_model.h"

#include <fmt/format.h>

#include <filesystem>

#include "app/config/cell_reader.h"
#include "app/model_store/model_store.h"
#include "firmware-like/effects/catalogue.h"
#include "firmware-like/effects/written.h"

namespace plumbline {

namespace {

/// What the effect follows and the cycle does not know: a row's number, a column of a file.
std::optional<std::string> UnknownDriver(const WrittenEffect& written) {
  for (const EffectParameter& parameter : written.parameters) {
    if (parameter.name == "row") return "row";
  }
  Conditions known;  // as of a point
  known.t_s = known.temp_C = 0.0;
  known.q = JointVector::Zero(kMaxJoints);
  for (const std::string& driver : written.drivers) {
    if (!known.Signal(driver)) return driver;
  }
  return std::nullopt;
}

}  // namespace

std::optional<std::string> WhyNotUsable(const CellModel& cell) {
  for (const WrittenEffect& written : cell.effects) {
    const Effect* effect = FindEffect(written.id);
    if (effect != nullptr) {
      const EffectTerm term = ActiveFromWritten(written, cell).term;
      if (ReadsTime(term) && !(cell.domain && cell.domain->time_zero_s)) {
        return fmt::format(
            "its effect \"{}\" reads the time, and the model does not say when its t_s was 0 "
            "([domain] time_zero_utc; `plumbline diagnose --time-zero`)",
            written.id);
      }
      if (const auto unknown = UnknownDriver(written)) {
        return fmt::format("its effect \"{}\" follows \"{}\", which the daemon does not know",
                           written.id, *unknown);
      }
    }
    std::string word;
    for (const EffectParameter& parameter : written.parameters) {
      if (!parameter.word.empty()) word = parameter.word;
    }
    if (effect == nullptr || effect->traits().Needs(Signal::kOrder, word)) {
      return fmt::format(
          "its effect \"{}\" depends on the robot's last moves, which are not known "
          "of a point it has yet to go to",
          written.id);
    }
  }
  return std::nullopt;
}

void AddFaultsOfAppliedModel(const std::string& state_directory, FaultList& faults) {
  AppliedModel(state_directory, faults);
}

std::optional<CellModel> AppliedModel(const std::string& state_directory, FaultList& faults) {
  std::error_code hidden;
  if (!std::filesystem::exists(state_directory + "/models/state.json", hidden)) return std::nullopt;
  const Result<ModelStore> store = ModelStore::Open(state_directory);
  const Result<ModelState> state = store ? store->State() : Error{store.error()};
  if (!state) {
    faults.Add({Fault::Severity::kWarning, state_directory, 0, "",
                "models are not kept, the cell file is in force: " + state.error()});
    return std::nullopt;
  }
  if (state->applied == state->declared) return std::nullopt;
  const std::string file = store->ModelFile(state->applied);
  const Result<std::string> text = store->Text(state->applied);
  FaultList own;
  std::optional<CellModel> cell;
  if (text) {
    cell = CellFromText(*text, file, own);
  } else {
    own.Add({Fault::Severity::kFault, file, 0, "", text.error()});
  }
  if (cell) {
    if (const auto why_not = WhyNotUsable(*cell)) {
      own.Add({Fault::Severity::kFault, file, 0, "effect", *why_not});
    }
  }
  if (!own.HasFaults()) return cell;
  faults.Append(own);
  faults.Add(
      {Fault::Severity::kFault, file, 0, "",
       fmt::format("version {} is in force, but cannot be used; choose another by {} or {}",
                   state->applied, ModelCommand("rollback", state_directory),
                   ModelCommand(fmt::format("apply {}", state->declared), state_directory))});
  return std::nullopt;
}

}  // namespace plumbline
