#include "app/measure/siblings/prior_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/base/config/cell_reader.h"
#include "app/base/text/json_integer.h"
#include "app/base/text/json_text.h"
#include "app/base/text/text.h"
#include "app/measure/diagnosis/output/model_writer.h"
#include "app/measure/siblings/repeated_rows.h"
#include "app/measure/siblings/sibling_folder.h"
#include "firmware-like/effects/catalogue.h"
#include "firmware-like/effects/parameter_name.h"

namespace plumbline::measure {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kSchema = 1;
constexpr const char* kArmFormat = "plumbline arm sizes";
constexpr const char* kSizesFormat = "plumbline agreed sizes";
constexpr const char* kPriorFormat = "plumbline fleet prior";
constexpr std::size_t kMaxLabel = 200;

/// Thrown and caught within this file, like the exceptions of the JSON library.
struct Refused : std::runtime_error {
  using std::runtime_error::runtime_error;
};

Json Head(const char* format) {
  return {{"format", format}, {"schema", kSchema}};
}

/// Reads an object of this format; every exception of `read` becomes an error.
template <typename Read>
auto Decoded(std::string_view text, const char* format, Read read)
    -> Result<decltype(read(Json()))> {
  const Result<Json> json = text::JsonFromText<Json>(text);
  if (!json) return json.failure();
  try {
    if (json->at("format") != format) throw Refused(fmt::format("is not of format {}", format));
    if (json->at("schema") != kSchema)
      throw Refused("was written by another version of Plumbline; use the same one on both sides");
    return read(*json);
  } catch (const Refused& refused) {
    return Error{refused.what()};
  } catch (const nlohmann::json::exception&) {
    return Error{fmt::format("is not a complete file of format {}; write it again", format)};
  }
}

double Number(const Json& json) {
  return json.get<double>();  // the reader of JSON refuses numbers that are not finite
}

int Count(const Json& json) {
  const auto count = text::IntegerFromJsonIfValid<int>(json);
  if (!count || *count < 0) throw Refused("has a count that is not a whole number");
  return *count;
}

/// A name to be shown in one line.
std::string Label(const Json& json) {
  auto label = json.get<std::string>();
  const bool control = std::ranges::any_of(
      label, [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; });
  if (label.empty() || label.size() > kMaxLabel || control)
    throw Refused("has a name that is empty, too long or not one line");
  return label;
}

model::CellModel CellOf(const std::string& text) {
  config::FaultList faults;
  auto cell = config::CellFromText(text, "cell", faults);
  if (!cell) throw Refused("contains a cell with faults: " + config::FaultsText(faults));
  return *std::move(cell);
}

Json JsonOf(const SizeKey& key) {
  return {{"effect", key.effect->traits().id},
          {"word", key.word},
          {"parameter", effects::NameFromParameter(key.effect->traits(), key.parameter)}};
}

/// The catalogue's copy of the word.
std::string_view WordOf(const effects::EffectTraits& traits, const std::string& word) {
  if (word.empty()) return {};
  for (const effects::ParameterSpec& spec : traits.parameters) {
    if (spec.role != effects::ParameterRole::kWord) continue;
    const auto choices = effects::Choices(spec.words);
    const auto found = std::ranges::find(choices, word);
    if (found != choices.end()) return *found;
  }
  throw Refused(fmt::format("has an unknown word of the effect {}", traits.id));
}

SizeKey KeyOf(const Json& json, int joints) {
  const auto id = json.at("effect").get<std::string>();
  const effects::Effect* effect = effects::FindEffect(id);
  if (effect == nullptr)
    throw Refused("has an effect that this version of Plumbline does not know; update Plumbline");
  const effects::EffectTraits& traits = effect->traits();
  const auto parameter =
      effects::ParameterFromName(traits, json.at("parameter").get<std::string>(), joints);
  SizeKey key{effect, WordOf(traits, json.at("word").get<std::string>()), {}};
  if (parameter) key.parameter = *parameter;
  effects::EffectTerm term;
  term.effect = effect;
  term.parameters = {key.parameter};
  const bool may_be_shared = !SharedSizes(term).empty() || traits.zero_mean_over_arms;
  if (!parameter || !may_be_shared ||
      traits.parameters[parameter->spec].role != effects::ParameterRole::kSize)
    throw Refused(fmt::format("has a parameter of {} that is not a size of an arm", id));
  return key;
}

Json JsonOfKeys(const std::vector<SizeKey>& keys) {
  Json json = Json::array();
  for (const SizeKey& key : keys) json.push_back(JsonOf(key));
  return json;
}

std::vector<SizeKey> KeysOf(const Json& json, int joints) {
  std::vector<SizeKey> keys;
  for (const Json& one : json) {
    keys.push_back(KeyOf(one, joints));
    if (std::ranges::count(keys, keys.back()) > 1) throw Refused("has a size twice");
  }
  return keys;
}

void PutAgreed(const AgreedSizes& agreed, Json& json) {
  json["common"] = agreed.common;
  json["sizes"] = JsonOfKeys(agreed.keys);
}

AgreedSizes AgreedOf(const Json& json, int joints) {
  AgreedSizes agreed{KeysOf(json.at("sizes"), joints),
                     static_cast<std::size_t>(Count(json.at("common")))};
  if (agreed.common > agreed.keys.size()) throw Refused("has more common sizes than sizes");
  return agreed;
}

void PutFit(const SizeFit& fit, Json& json) {
  json["determined"] = JsonOfKeys(fit.keys);
  json["values"] = Json::array();
  for (const double value : fit.values) json["values"].push_back(text::NumberJson(value));
  json["covariance"] = Json::array();
  for (const double value : fit.covariance.reshaped())
    json["covariance"].push_back(text::NumberJson(value));
}

SizeFit FitOf(const Json& json, int joints) {
  SizeFit fit;
  fit.keys = KeysOf(json.at("determined"), joints);
  const auto values = json.at("values").get<std::vector<double>>();
  const auto covariance = json.at("covariance").get<std::vector<double>>();
  const std::size_t count = fit.keys.size();
  if (values.size() != count || covariance.size() != count * count)
    throw Refused("has a fit with another number of values than sizes");
  const auto size = static_cast<Eigen::Index>(count);
  fit.values = Eigen::Map<const Eigen::VectorXd>(values.data(), size);
  fit.covariance = Eigen::Map<const Eigen::MatrixXd>(covariance.data(), size, size);
  return fit;
}

std::vector<std::string> SketchOf(const Json& json) {
  std::vector<std::string> sketch;
  for (const Json& digest : json) sketch.push_back(Label(digest));
  if (sketch.size() > kSketchRows) throw Refused("has too many digests of rows");
  return sketch;
}

ArmSizes ArmOf(const Json& json) {
  ArmSizes sizes;
  sizes.arm = Label(json.at("arm"));
  sizes.rows_sha256 = Label(json.at("rows_sha256"));
  sizes.row_sketch = SketchOf(json.at("row_sketch"));
  sizes.cell_text = json.at("cell").get<std::string>();
  sizes.found_text = json.at("found").get<std::string>();
  sizes.cell = CellOf(sizes.cell_text);
  const model::CellModel found = CellOf(sizes.found_text);
  const std::size_t declared = sizes.cell.effects.size();
  if (found.effects.size() < declared || found.robot.size() != sizes.cell.robot.size())
    throw Refused("has findings of another cell");
  sizes.found.effects = effects::ActiveEffectsOf(found);
  sizes.found.effects.erase(sizes.found.effects.begin(),
                            sizes.found.effects.begin() + static_cast<std::ptrdiff_t>(declared));
  sizes.found.sigma_m = Number(json.at("sigma_m"));
  for (const Json& row : json.at("weights")) {
    const double weight = Number(row.at(1));
    if (!(weight >= 0)) throw Refused("has a negative weight");
    sizes.found.weight_of_line[Count(row.at(0))] = weight;
  }
  if (!(sizes.found.sigma_m > 0)) throw Refused("has a sigma_m that is not positive");
  if (!json.at("fit").is_null()) {
    const int joints = sizes.cell.robot.size();
    sizes.fitted = {AgreedOf(json.at("fit"), joints), FitOf(json.at("fit"), joints)};
  }
  return sizes;
}

SizePrior SizePriorOf(const Json& json, int joints) {
  const Pooled pooled{Number(json.at("mean")), Number(json.at("between_sd")),
                      Number(json.at("mean_sd")), Count(json.at("arms"))};
  if (!(pooled.between_sd >= 0 && pooled.mean_sd >= 0 && pooled.next_sd() > 0))
    throw Refused("has a size without spread");
  return {KeyOf(json, joints), pooled};
}

FleetPrior FleetPriorOf(const Json& json) {
  FleetPrior prior;
  prior.model = Label(json.at("model"));
  prior.date = Label(json.at("date"));
  if (prior.date.size() != 10 || !text::UtcFromText(prior.date + "T00:00:00Z"))
    throw Refused("has a date that is not like 2026-11-30");
  prior.created = Label(json.at("created"));
  if (!text::UtcFromText(prior.created))
    throw Refused("has a time `created` that is not like 2026-11-30T07:30:00Z");
  for (const Json& one : json.at("left_out"))
    prior.left_out.push_back({Label(one.at("arm")), Label(one.at("reason"))});
  prior.cell_text = json.at("cell").get<std::string>();
  prior.cell = CellOf(prior.cell_text);
  const int joints = prior.cell.robot.size();
  prior.agreed = AgreedOf(json.at("agreed"), joints);
  for (const Json& arm : json.at("arms")) {
    prior.arms.push_back(
        {Label(arm.at("arm")), FitOf(arm, joints), SketchOf(arm.at("row_sketch"))});
  }
  if (prior.arms.size() < 2) throw Refused("was computed from fewer than two arms");
  KeysOf(json.at("sizes"), joints);  // none twice
  for (const Json& one : json.at("sizes")) prior.sizes.push_back(SizePriorOf(one, joints));
  if (prior.sizes.empty()) throw Refused("has no sizes");
  return prior;
}

}  // namespace

Result<ArmSizes> SizesOfArm(const std::string& arm, const std::string& rows_sha256,
                            std::vector<std::string> row_sketch, const std::string& cell_text,
                            const model::CellModel& cell, const Diagnosis& diagnosis,
                            const std::string& date) {
  Diagnosis found;
  found.findings = diagnosis.findings;
  const DataOrigin origin{arm, static_cast<int>(diagnosis.rows.size()), date};
  const Result<std::string> found_text = CorrectedCellText(cell_text, cell, found, origin);
  if (!found_text) return found_text.failure();
  return ArmSizes{arm,         rows_sha256, std::move(row_sketch), cell_text,
                  *found_text, cell,        FindingsOf(diagnosis), {}};
}

std::string JsonFrom(const ArmSizes& sizes) {
  Json json = Head(kArmFormat);
  json["arm"] = sizes.arm;
  json["model"] = sizes.cell.robot.identity.model;
  json["rows_sha256"] = sizes.rows_sha256;
  json["row_sketch"] = sizes.row_sketch;
  json["fit"] = nullptr;
  if (sizes.fitted) {
    PutAgreed(sizes.fitted->asked, json["fit"]);
    PutFit(sizes.fitted->fit, json["fit"]);
  }
  json["sigma_m"] = sizes.found.sigma_m;
  json["weights"] = Json::array();
  for (const auto& [line, weight] : sizes.found.weight_of_line)
    json["weights"].push_back({line, weight});
  json["cell"] = sizes.cell_text;
  json["found"] = sizes.found_text;
  return text::JsonText(json) + '\n';
}

Result<ArmSizes> ArmSizesFromJson(std::string_view text) {
  return Decoded(text, kArmFormat, ArmOf);
}

std::string JsonFrom(const AgreedSizes& agreed) {
  Json json = Head(kSizesFormat);
  PutAgreed(agreed, json);
  return text::JsonText(json, 1) + '\n';
}

Result<AgreedSizes> AgreedSizesFromJson(std::string_view text, int joints) {
  return Decoded(text, kSizesFormat, [joints](const Json& json) { return AgreedOf(json, joints); });
}

std::string JsonFrom(const FleetPrior& prior) {
  Json json = Head(kPriorFormat);
  json["model"] = prior.model;
  json["date"] = prior.date;
  json["created"] = prior.created;
  PutAgreed(prior.agreed, json["agreed"]);
  json["arms"] = Json::array();
  for (const ArmFit& one : prior.arms) {
    Json& arm = json["arms"].emplace_back(Json{{"arm", one.arm}, {"row_sketch", one.row_sketch}});
    PutFit(one.fit, arm);
  }
  json["left_out"] = Json::array();
  for (const LeftOutArm& one : prior.left_out)
    json["left_out"].push_back({{"arm", one.arm}, {"reason", one.reason}});
  json["sizes"] = Json::array();
  for (const SizePrior& one : prior.sizes) {
    Json& size = json["sizes"].emplace_back(JsonOf(one.key));
    size["mean"] = one.pooled.mean;
    size["between_sd"] = one.pooled.between_sd;
    size["mean_sd"] = one.pooled.mean_sd;
    size["arms"] = one.pooled.arms;
  }
  json["cell"] = prior.cell_text;
  return text::JsonText(json, 1) + '\n';
}

Result<FleetPrior> FleetPriorFromJson(std::string_view text) {
  return Decoded(text, kPriorFormat, FleetPriorOf);
}

std::vector<const ArmSizes*> ComparableArms(const std::vector<ArmSizes>& arms,
                                            const std::string& model,
                                            std::vector<LeftOutArm>& left_out) {
  const auto declared_like = [&arms](const ArmSizes& arm) {
    return std::ranges::count_if(
        arms, [&arm](const ArmSizes& other) { return DifferenceOf(arm.cell, other.cell).empty(); });
  };
  const ArmSizes* usual = nullptr;
  std::ptrdiff_t most = 0;
  for (const ArmSizes& arm : arms) {
    if (arm.cell.robot.identity.model != model) continue;
    const auto count = declared_like(arm);
    if (count <= most) continue;
    most = count;
    usual = &arm;
  }
  std::vector<const ArmSizes*> comparable;
  for (const ArmSizes& arm : arms) {
    std::string reason;
    if (arm.cell.robot.identity.model != model) {
      reason = "its cell names another arm model, or none";
    } else if (std::ranges::any_of(comparable,
                                   [&arm](const ArmSizes* one) { return one->arm == arm.arm; })) {
      reason = "another arm has the same name";
    } else {
      reason =
          usual == nullptr ? DifferenceOf(arm.cell, arm.cell) : DifferenceOf(usual->cell, arm.cell);
    }
    if (reason.empty()) {
      comparable.push_back(&arm);
    } else {
      left_out.push_back({arm.arm, reason});
    }
  }
  return comparable;
}

}  // namespace plumbline::measure
