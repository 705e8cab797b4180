#include "app/measure/diagnosis/linear/candidates.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>

#include "app/measure/diagnosis/linear/shape_search.h"
#include "firmware-like/effects/catalogue.h"
#include "firmware-like/effects/parameter_name.h"

namespace plumbline::measure {
namespace {

/// Signals that depend on the instruments alone, not on what was recorded beside the measurement.
constexpr std::array kInstrumentSignals = {effects::Signal::kCamera, effects::Signal::kRange,
                                           effects::Signal::kCameras};

bool Varies(const Dataset& data, std::string_view column) {
  return std::ranges::any_of(data.signals,
                             [&](const RecordedSignal& signal) { return signal.column == column; });
}

/// True if positions are of different cameras, or of a camera and another instrument.
bool OfDifferentInstruments(const Dataset& data) {
  const effects::Conditions* first = nullptr;
  for (const RowIndex row : data.row_indices()) {
    if (OnArtefact(data.observations[row].kind)) continue;
    const effects::Conditions& of_row = data.conditions[row];
    if (first == nullptr) first = &of_row;
    if (of_row.camera_name != first->camera_name) return true;
  }
  return false;
}

/// The choices of an effect's word; one empty word if it has none. Of an effect of one camera, the
/// cameras that measured a row.
std::vector<std::string_view> WordsOf(const Dataset& data, const effects::EffectTraits& traits) {
  std::vector<std::string_view> words = {""};
  for (const effects::ParameterSpec& parameter : traits.parameters) {
    if (parameter.role == effects::ParameterRole::kWord) words = effects::Choices(parameter.words);
  }
  if (!traits.of_one_camera) return words;
  const auto measured_nothing = [&](std::string_view word) {
    return std::ranges::none_of(data.conditions, [&](const effects::Conditions& of_row) {
      return of_row.camera_name == word;
    });
  };
  words.erase(std::remove_if(words.begin(), words.end(), measured_nothing), words.end());
  return words;
}

bool Has(const Dataset& data, effects::Signal signal) {
  const RecordedColumns& recorded = data.table.recorded;
  switch (signal) {
    case effects::Signal::kTime:
      return recorded.time;
    case effects::Signal::kTemperature:
      return recorded.temperature && data.cell.measurement.reference_temperature_C.has_value();
    case effects::Signal::kVelocity:
      return recorded.qd;
    case effects::Signal::kAcceleration:
      return recorded.qdd;
    case effects::Signal::kOrder:
      return recorded.order && data.rows() > 2;
    case effects::Signal::kPayload:
      return data.loads_modelled();
    case effects::Signal::kTorques:
      return data.torques_known;
    case effects::Signal::kWeight:
      return data.weight_known;
    case effects::Signal::kNoTorques:
      return !data.torques_known;
    case effects::Signal::kBeam:
      return data.cell.any_tool_bends();
    case effects::Signal::kCamera:
      return data.cell.measurement.X_WC.has_value();
    case effects::Signal::kRange:
      return data.reads_ranges();
    case effects::Signal::kTilt:
      return Varies(data, "tilt_x_deg") && Varies(data, "tilt_y_deg");
    case effects::Signal::kCameras:
      return OfDifferentInstruments(data);
  }
  return false;
}

const char* MissingSignalReason(const Dataset& data, effects::Signal signal) {
  switch (signal) {
    case effects::Signal::kTime:
      return data.table.recorded.clock_restarted ? "the clock of t_s was restarted"
                                                 : "t_s was not recorded";
    case effects::Signal::kTemperature:
      return "temp_C was not recorded, or the cell does not declare reference_temperature_C";
    case effects::Signal::kVelocity:
      return "qd was not recorded";
    case effects::Signal::kAcceleration:
      return "qdd was not recorded";
    case effects::Signal::kOrder:
      return data.table.recorded.order ? "too few rows for effects of the order of execution"
                                       : "the robot's moves between the probes are not recorded";
    case effects::Signal::kPayload:
      return "payload_kg was not recorded, or the cell has no [payload] cog_mm";
    case effects::Signal::kTorques:
      return "link masses are not declared and joint torques are not measured";
    case effects::Signal::kWeight:
      return "link masses are not declared";
    case effects::Signal::kNoTorques:
      return "joint torques are known: see joint_compliance";
    case effects::Signal::kBeam:
      return "the declared tool is rigid";
    case effects::Signal::kCamera:
      return "no camera measures, or the cell does not declare camera_xyz_mm and camera_rpy_deg";
    case effects::Signal::kRange:
      return "no ranges are measured";
    case effects::Signal::kTilt:
      return "no inclinometer on the base was recorded (tilt_x_deg and tilt_y_deg), or its "
             "readings did not change";
    case effects::Signal::kCameras:
      return "the rows do not name different cameras (column camera)";
  }
  return "";
}

/// True if an effect may act although the rows lack this signal.
bool MayActWithout(effects::Signal signal) {
  switch (signal) {
    case effects::Signal::kTime:
    case effects::Signal::kTemperature:
    case effects::Signal::kVelocity:
    case effects::Signal::kAcceleration:
    case effects::Signal::kOrder:
    case effects::Signal::kBeam:  // a tool that is declared as rigid
      return true;
    default:
      return false;
  }
}

}  // namespace

Candidates CandidatesFor(const Dataset& data) {
  Candidates candidates;
  for (const effects::Effect* effect : effects::Catalogue()) {
    const effects::EffectTraits& traits = effect->traits();
    const std::string id(traits.id);
    if (traits.nuisance == effects::Nuisance::kBaseFrame && data.frames_free()) {
      candidates.excluded.push_back(
          {id, "already estimated, since the frame is declared as unaligned"});
      continue;
    }
    if (traits.nuisance == effects::Nuisance::kToolFrame && data.tip_free()) {
      candidates.excluded.push_back(
          {id, "already estimated, since the tool is declared as unknown"});
      continue;
    }
    const auto lacking = std::ranges::find_if(
        traits.needs, [&](effects::Signal signal) { return !Has(data, signal); });
    if (lacking != traits.needs.end()) {
      candidates.excluded.push_back(
          {id, MissingSignalReason(data, *lacking), MayActWithout(*lacking)});
      continue;
    }
    if (const ShapeSearch* search = ShapeSearchOf(*effect)) {
      if (search->DependsOnResidual()) candidates.searched.push_back(effect);
      for (Block& block : search->Fixed(data)) candidates.blocks.push_back(std::move(block));
      continue;
    }
    for (const std::string_view word : WordsOf(data, traits)) {
      const auto lacking_word =
          std::ranges::find_if(traits.word_needs, [&](const effects::VariantSignal& need) {
            return need.word == word && !Has(data, need.signal);
          });
      if (lacking_word != traits.word_needs.end()) {
        candidates.excluded.push_back(
            {fmt::format("{} ({})", id, word), MissingSignalReason(data, lacking_word->signal)});
        continue;
      }
      Block block = WholeBlock(data, *effect, word);
      if (block.columns.empty()) {
        candidates.excluded.push_back({id, "the arm has no joint of the required type"});
        continue;
      }
      candidates.blocks.push_back(std::move(block));
    }
  }
  return candidates;
}

std::vector<Block> BlocksOf(const Dataset& data,
                            const std::vector<effects::ActiveEffect>& effects) {
  std::vector<Block> blocks;
  for (const effects::ActiveEffect& effect : effects) {
    const ShapeSearch* search = ShapeSearchOf(*effect.term.effect);
    if (search == nullptr) continue;
    for (Block& block : search->Refitted(data, effect)) blocks.push_back(std::move(block));
  }
  return blocks;
}

double EffectsConsidered(const Dataset& data) {
  const auto catalogue = effects::Catalogue();
  return static_cast<double>(
      std::ranges::count_if(catalogue, [&data](const effects::Effect* effect) {
        return std::ranges::all_of(kInstrumentSignals, [&](effects::Signal signal) {
          return !effect->traits().Needs(signal) || Has(data, signal);
        });
      }));
}

std::vector<std::string> ScopeOf(const effects::EffectTerm& term) {
  std::set<int> joints;
  for (const effects::TermParameter& parameter : term.parameters) {
    if (parameter.joint >= 0) joints.insert(parameter.joint);
  }
  std::vector<std::string> scope;
  scope.reserve(joints.size());
  for (const int joint : joints) scope.push_back(fmt::format("q{}", joint + 1));
  return scope;
}

}  // namespace plumbline::measure
