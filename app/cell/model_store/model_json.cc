#include "app/cell/model_store/model_json.h"

#include <fmt/format.h>

#include "app/base/text/json_integer.h"
#include "app/base/text/json_text.h"

namespace plumbline::cell {
namespace {

using nlohmann::json;

template <typename T>
void Put(json& into, const char* name, const std::optional<T>& value) {
  if (value) into[name] = *value;
}

/// A numeric member; nullopt if it is absent or of another type.
std::optional<double> NumberIn(const json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end() || !found->is_number()) return std::nullopt;
  return found->get<double>();
}

std::optional<int> WholeIn(const json& object, const char* name) {
  const auto found = object.find(name);
  return found == object.end() ? std::nullopt : text::IntegerFromJsonIfValid<int>(*found);
}

/// The strings in an array; empty if it is absent.
std::vector<std::string> TextsIn(const json& object, const char* name) {
  std::vector<std::string> texts;
  const auto found = object.find(name);
  if (found == object.end() || !found->is_array()) return texts;
  for (const json& text : *found) {
    if (text.is_string()) texts.push_back(text.get<std::string>());
  }
  return texts;
}

std::string TextIn(const json& object, const char* name) {
  const auto found = object.find(name);
  return found != object.end() && found->is_string() ? found->get<std::string>() : "";
}

}  // namespace

int SchemaInJson(const std::string& text) {
  const json object = text::JsonOrNull(text);
  if (!object.is_object()) return 0;
  return WholeIn(object, "schema").value_or(0);
}

std::string JsonFrom(const ModelFacts& facts) {
  json object = {{"schema", kModelSchema},   {"origin", NameOf(facts.origin)},
                 {"date", facts.date},       {"from", facts.from},
                 {"verdict", facts.verdict}, {"effects", facts.effects},
                 {"report", facts.report}};
  Put(object, "based_on", facts.based_on);
  Put(object, "rms_before_mm", facts.rms_before_mm);
  Put(object, "rms_after_mm", facts.rms_after_mm);
  Put(object, "change_mm", facts.change_mm);
  Put(object, "points_change_mm", facts.points_change_mm);
  if (!facts.implausible.empty()) object["implausible"] = facts.implausible;
  Put(object, "discrepancy_share", facts.discrepancy_share);
  return text::JsonText(object, 1) + "\n";
}

std::string JsonFrom(const ModelState& state) {
  json object = {{"schema", kModelSchema},
                 {"declared", state.declared},
                 {"applied", state.applied},
                 {"proposed", state.proposed},
                 {"history", state.history}};
  if (state.confirmed) object["confirmed"] = true;
  if (const auto& aside = state.set_aside) {
    object["set_aside"] = {{"version", aside->version},
                           {"declared", aside->declared},
                           {"changes", aside->changes},
                           {"withdrawn", aside->withdrawn}};
  }
  if (state.edit) {
    object["edit"] = {{"withdrawn", state.edit->withdrawn}, {"accepted", state.edit->accepted}};
  }
  return text::JsonText(object, 1) + "\n";
}

std::optional<ModelFacts> ModelFactsFromJson(const std::string& text) {
  const json object = text::JsonOrNull(text);
  if (!object.is_object()) return std::nullopt;
  ModelFacts facts;
  const std::string origin = TextIn(object, "origin");
  if (origin == "declared") {
    facts.origin = ModelFacts::Origin::kDeclared;
  } else if (origin == "diagnosis") {
    facts.origin = ModelFacts::Origin::kDiagnosis;
  } else if (origin != "manual") {
    return std::nullopt;
  }
  facts.date = TextIn(object, "date");
  facts.from = TextIn(object, "from");
  facts.verdict = TextIn(object, "verdict");
  facts.report = TextIn(object, "report");
  facts.effects = TextsIn(object, "effects");
  facts.implausible = TextsIn(object, "implausible");
  facts.discrepancy_share = NumberIn(object, "discrepancy_share");
  facts.based_on = WholeIn(object, "based_on");
  facts.rms_before_mm = NumberIn(object, "rms_before_mm");
  facts.rms_after_mm = NumberIn(object, "rms_after_mm");
  facts.change_mm = NumberIn(object, "change_mm");
  facts.points_change_mm = NumberIn(object, "points_change_mm");
  return facts;
}

std::optional<ModelState> ModelStateFromJson(const std::string& text) {
  const json object = text::JsonOrNull(text);
  if (!object.is_object()) return std::nullopt;
  ModelState state;
  for (const auto& [name, into] :
       {std::pair("declared", &state.declared), std::pair("applied", &state.applied),
        std::pair("proposed", &state.proposed)}) {
    const auto number = WholeIn(object, name);
    if (!number) return std::nullopt;
    *into = *number;
  }
  const auto history = object.find("history");
  if (history == object.end() || !history->is_array()) return std::nullopt;
  for (const json& number : *history) {
    const auto version = text::IntegerFromJsonIfValid<int>(number);
    if (!version) return std::nullopt;
    state.history.push_back(*version);
  }
  if (const auto aside = object.find("set_aside"); aside != object.end()) {
    const auto version = WholeIn(*aside, "version"), declared = WholeIn(*aside, "declared");
    if (!version || !declared) return std::nullopt;
    state.set_aside = SupersededVersion{*version, *declared, TextsIn(*aside, "changes"),
                                        WholeIn(*aside, "withdrawn").value_or(0)};
  }
  if (const auto edit = object.find("edit"); edit != object.end()) {
    const auto withdrawn = WholeIn(*edit, "withdrawn"), accepted = WholeIn(*edit, "accepted");
    if (!withdrawn || !accepted || *withdrawn < 0 || *accepted < 0) return std::nullopt;
    state.edit = CellEdit{*withdrawn, *accepted};
  }
  const auto confirmed = object.find("confirmed");
  state.confirmed = confirmed != object.end() && *confirmed == true;
  // Numbers written by the store are consistent; otherwise something else has changed the file.
  const int in_force = state.history.empty() ? 0 : state.history.back();
  if (state.applied != in_force || state.declared < 0 || state.proposed < 0) return std::nullopt;
  return state;
}

Result<ModelFacts> ModelFactsFromDiagnosis(const std::string& text) {
  const Result<json> read = text::JsonFromText(text);
  if (!read) return Error{"the diagnosis: " + read.error()};
  const json& object = *read;
  if (!object.is_object()) return Error{"the diagnosis is not a JSON object"};
  ModelFacts facts;
  facts.origin = ModelFacts::Origin::kDiagnosis;
  facts.verdict = TextIn(object, "verdict");
  if (facts.verdict != "no_effect" && facts.verdict != "explained" &&
      facts.verdict != "ambiguous" && facts.verdict != "unknown") {
    return Error{fmt::format("the diagnosis has the unknown verdict \"{}\"", facts.verdict)};
  }
  if (const auto effects = object.find("effects"); effects != object.end()) {
    for (const json& effect : *effects) {
      if (effect.is_object()) facts.effects.push_back(TextIn(effect, "id"));
    }
  }
  facts.implausible = TextsIn(object, "implausible");
  const auto discrepancy = object.find("discrepancy_model");
  if (discrepancy != object.end() && !discrepancy->is_null()) {
    // Counts regardless of its size: such a model is not explained by named effects alone.
    facts.discrepancy_share = discrepancy->is_object()
                                  ? NumberIn(*discrepancy, "share_of_correction").value_or(1.0)
                                  : 1.0;
  }
  const auto rms = object.find("rms_mm");
  if (rms == object.end() || !rms->is_object()) return Error{"the diagnosis has no rms_mm"};
  facts.rms_before_mm = NumberIn(*rms, "before_held_out");
  facts.rms_after_mm = NumberIn(*rms, "after_held_out");
  return facts;
}

}  // namespace plumbline::cell
