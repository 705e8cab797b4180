// plumbline prior: computes, signs and shows what the arms of one model have in common.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <memory>

#include "app/base/terminal/terminal_output.h"
#include "app/base/text/sha256.h"
#include "app/base/text/signed_text.h"
#include "app/base/text/text.h"
#include "app/cli/commands.h"
#include "app/cli/failure.h"
#include "app/cli/number_option.h"
#include "app/cli/output_file.h"
#include "app/measure/siblings/installed_prior.h"
#include "app/measure/siblings/prior_json.h"
#include "app/measure/table/csv.h"
#include "drivers/files/open_failure.h"
#include "drivers/files/text_file.h"
#include "firmware-like/effects/parameter_name.h"

namespace plumbline::cli {
namespace {

struct PriorOptions {
  std::string model, date, arm, rows, sizes, prior, key, out, json;
  std::vector<std::string> arms;
  std::string keys = measure::kPriorKeyFolder;
  int threads = 2;
};

Result<std::string> ReadText(const std::string& path) {
  Result<std::string> text = files::ReadFileUpTo(files::kTableSize, path);
  if (!text) return Error{fmt::format("{}: {}", path, files::ReadErrorText(path, text.error()))};
  return text;
}

Result<measure::ArmSizes> ReadArmSizes(const std::string& path) {
  const Result<std::string> text = ReadText(path);
  if (!text) return text.failure();
  return measure::ArmSizesFromJson(*text).transform_error(
      [&](const std::string& why) { return path + ": " + why; });
}

/// The arms of one model.
struct Fleet {
  std::vector<measure::ArmSizes> arms;
  std::vector<const measure::ArmSizes*> comparable;  ///< into `arms`
  std::vector<measure::LeftOutArm> left_out;
};

/// Fills in `fleet`, sorted by name; prints every arm that is left out.
Result<void> ReadFleet(const PriorOptions& options, Fleet& fleet) {
  for (const std::string& path : options.arms) {
    Result<measure::ArmSizes> arm = ReadArmSizes(path);
    if (arm) {
      fleet.arms.push_back(std::move(arm).value());
    } else {
      std::cerr << "left out: " << arm.error() << '\n';
    }
  }
  std::ranges::sort(fleet.arms, {}, &measure::ArmSizes::arm);
  fleet.comparable = measure::ComparableArms(fleet.arms, options.model, fleet.left_out);
  for (const measure::LeftOutArm& one : fleet.left_out)
    std::cerr << terminal::ForReading << "left out: " << one.arm << ": " << one.reason << '\n';
  if (fleet.comparable.size() < 2)
    return Error{fmt::format("{}: no prior: at least two arms are needed", options.model)};
  return {};
}

int Written(const PriorOptions& options, const std::string& text) {
  return PrintOrWriteOutput(options.out, text, "--out") ? kExitOk : kExitUsage;
}

int AgreeOnSizes(const PriorOptions& options) {
  Fleet fleet;
  if (const Result<void> read = ReadFleet(options, fleet); !read) return Fail(read.error());
  std::vector<const measure::ArmFindings*> found;
  for (const measure::ArmSizes* arm : fleet.comparable) found.push_back(&arm->found);
  const Result<measure::AgreedSizes> agreed =
      measure::AgreeOnSizes(found, fleet.comparable.front()->cell);
  if (!agreed) return Fail(fmt::format("{}: no prior: {}", options.model, agreed.error()));
  return Written(options, measure::JsonFrom(*agreed));
}

int FitArm(const PriorOptions& options) {
  Result<measure::ArmSizes> arm = ReadArmSizes(options.arm);
  if (!arm) return Fail(arm.error());
  measure::ArmSizes& sizes = arm.value();
  const Result<std::string> rows_text = ReadText(options.rows);
  const Result<std::string> sizes_text = ReadText(options.sizes);
  if (!rows_text) return Fail(rows_text.error());
  if (!sizes_text) return Fail(sizes_text.error());
  if (text::Sha256Hex(*rows_text) != sizes.rows_sha256) {
    return Fail(fmt::format("{}: is not the file that {} was written for; diagnose again",
                            options.rows, options.arm));
  }
  Result<measure::AgreedSizes> agreed =
      measure::AgreedSizesFromJson(*sizes_text, sizes.cell.robot.size());
  if (!agreed) return Fail(options.sizes + ": " + agreed.error());
  config::FaultList faults;
  auto rows = measure::TableFromCsv(*rows_text, options.rows, sizes.cell.robot.joints, faults);
  if (!rows) return Fail(config::FaultsText(faults));
  const measure::Arm measured{sizes.arm, sizes.cell, *std::move(rows), sizes.found};
  const std::vector<double> start(agreed->keys.size(), 0.0);
  Result<measure::SizeFit> fit = measure::FitSizes(measured, agreed->keys, start,
                                                   measure::OwnFindings::kFitted, options.threads);
  if (!fit) return Fail(fmt::format("{}: {}", options.rows, fit.error()));
  sizes.fitted = {std::move(agreed).value(), std::move(fit).value()};
  return Written(options, measure::JsonFrom(sizes));
}

/// The sizes that were fitted to most of the arms; nullptr: to none.
const measure::AgreedSizes* FittedSizes(const std::vector<const measure::ArmSizes*>& arms) {
  const measure::AgreedSizes* fitted = nullptr;
  std::ptrdiff_t most = 0;
  for (const measure::ArmSizes* arm : arms) {
    if (!arm->fitted) continue;
    const auto count = std::ranges::count_if(arms, [arm](const measure::ArmSizes* other) {
      return other->fitted && other->fitted->asked == arm->fitted->asked;
    });
    if (count <= most) continue;
    most = count;
    fitted = &arm->fitted->asked;
  }
  return fitted;
}

int Pool(const PriorOptions& options) {
  Fleet fleet;
  if (const Result<void> read = ReadFleet(options, fleet); !read) return Fail(read.error());
  const measure::AgreedSizes* agreed = FittedSizes(fleet.comparable);
  if (agreed == nullptr) {
    return Fail(fmt::format(
        "{}: no prior: no arm has a fit of the agreed sizes; run `plumbline prior fit` for each",
        options.model));
  }
  std::vector<measure::ArmFit> fits;
  for (const measure::ArmSizes* arm : fleet.comparable) {
    if (arm->fitted && arm->fitted->asked == *agreed) {
      fits.push_back({arm->arm, arm->fitted->fit, arm->row_sketch});
    } else {
      fleet.left_out.push_back({arm->arm, "the agreed sizes were not fitted to its rows"});
    }
  }
  Result<measure::FleetPrior> pooled = measure::PoolFits(*agreed, std::move(fits));
  if (!pooled) return Fail(fmt::format("{}: no prior: {}", options.model, pooled.error()));
  measure::FleetPrior& prior = pooled.value();
  prior.model = options.model;
  prior.created = text::TextOfUtcNow();
  prior.date = options.date.empty() ? prior.created.substr(0, 10) : options.date;
  prior.left_out.insert(prior.left_out.begin(), fleet.left_out.begin(), fleet.left_out.end());
  prior.cell_text = fleet.comparable.front()->cell_text;
  const std::string json = measure::JsonFrom(prior);
  if (const auto again = measure::FleetPriorFromJson(json); !again)
    return Fail("the prior cannot be written: it " + again.error());
  return Written(options, json);
}

int Sign(const PriorOptions& options) {
  const Result<std::string> prior = ReadText(options.prior);
  const Result<std::string> key = ReadText(options.key);
  if (!prior) return Fail(prior.error());
  if (!key) return Fail(key.error());
  const auto read = measure::FleetPriorFromJson(*prior);
  if (!read) return Fail(options.prior + ": " + read.error());
  if (!measure::IsOfPast(*read, 0)) {
    return Fail(
        fmt::format("{}: its date {} is in the future, so that no later prior would replace "
                    "it; check the clock, and pool again",
                    options.prior, read->date));
  }
  const Result<std::string> signed_text = text::SignedText(*prior, *key);
  if (!signed_text) return Fail(options.key + ": " + signed_text.error());
  return Written(options, *signed_text);
}

/// A line per size, in SI units.
std::string SizeLine(const measure::SizePrior& one) {
  const effects::EffectTraits& traits = one.key.effect->traits();
  std::string word(one.key.word);
  if (!word.empty()) word = " (" + word + ")";
  return fmt::format("{:<28} {:<14} {:>12.4g} {:>12.3g} {:>12.2g} {:>5}\n",
                     std::string(traits.id) + word,
                     effects::NameFromParameter(traits, one.key.parameter), one.pooled.mean,
                     one.pooled.between_sd, one.pooled.mean_sd, one.pooled.arms);
}

int Show(const PriorOptions& options) {
  const Result<measure::FleetPrior> read = measure::ReadPrior(options.prior, options.keys);
  if (!read) return Fail(read.error());
  const measure::FleetPrior& prior = *read;
  if (!options.json.empty()) {
    return PrintOrWriteOutput(options.json, measure::JsonFrom(prior), "--json") ? kExitOk
                                                                                : kExitUsage;
  }
  std::cout << terminal::ForReading << prior.Source() << '\n'
            << fmt::format("arms: {}\n", fmt::join(prior.ArmNames(), ", "));
  for (const measure::LeftOutArm& one : prior.left_out)
    std::cout << fmt::format("left out: {}: {}\n", one.arm, one.reason);
  std::cout << fmt::format("\n{:<28} {:<14} {:>12} {:>12} {:>12} {:>5}\n", "effect", "size (SI)",
                           "mean", "arms' sd", "mean's sd", "arms");
  for (const measure::SizePrior& one : prior.sizes) std::cout << SizeLine(one);
  return kExitOk;
}

}  // namespace

void AddPriorCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<PriorOptions>();
  CLI::App* prior =
      app.add_subcommand("prior", "Compute, sign and show what arms of one model have in common");
  prior->require_subcommand(1);
  prior->footer(
      "The plant computes a prior from all arms of a model, in steps that any number of computers\n"
      "can share; `plumbline diagnose` of a further arm uses the signed file.\n\n"
      "Example:\n"
      "  for arm in arm-1 arm-2 arm-3; do \\\n"
      "    plumbline diagnose $arm/cell.toml $arm/measured.csv \\\n"
      "      --arm-out $arm.json --arm-name $arm; done\n"
      "  plumbline prior sizes \"KR 210 R2700-2\" arm-*.json --out sizes.json\n"
      "  for arm in arm-1 arm-2 arm-3; do \\\n"
      "    plumbline prior fit $arm.json $arm/measured.csv sizes.json \\\n"
      "      --out $arm.json; done\n"
      "  plumbline prior pool \"KR 210 R2700-2\" arm-*.json --out prior.json\n"
      "  plumbline prior sign prior.json --key plant.key --out kr210.prior");
  const auto add = [&](const char* name, const char* what, int (*run)(const PriorOptions&),
                       const char* footer) {
    CLI::App* command = prior->add_subcommand(name, what);
    command->footer(footer);
    command->callback([options, run, &exit_code] { exit_code = run(*options); });
    return command;
  };
  const auto add_fleet = [&](CLI::App& command) {
    command.add_option("model", options->model, "Arm model, as [robot] model names it")->required();
    command.add_option("arms", options->arms, "Files of --arm-out, one of each arm")->required();
  };
  const auto add_out = [&](CLI::App& command) {
    command.add_option("--out", options->out, "File to write; - is standard output")->required();
  };
  CLI::App* sizes = add(
      "sizes", "Agree on the sizes to be fitted in every arm", AgreeOnSizes,
      "Agreed are the sizes that at least two, and at least half, of the arms show, and those "
      "that\nevery arm has of its own. An arm of another model, or declared otherwise than most, "
      "is left out.\n\n"
      "Example:\n  plumbline prior sizes \"KR 210 R2700-2\" arm-*.json --out sizes.json\n\n"
      "Exit codes: 0 written, 1 the arms have nothing in common or a file cannot be read,\n"
      "2 wrong arguments, or a file cannot be written.");
  add_fleet(*sizes);
  add_out(*sizes);
  CLI::App* fit =
      add("fit", "Fit the agreed sizes to the rows of one arm", FitArm,
          "Example:\n  plumbline prior fit arm-1.json arm-1/measured.csv sizes.json --out "
          "arm-1.json\n\n"
          "Exit codes: 0 written, 1 a file cannot be read or does not belong to the arm,\n"
          "2 wrong arguments, or a file cannot be written.");
  fit->add_option("arm", options->arm, "File of --arm-out")->required();
  fit->add_option("measured", options->rows, "The rows that it was written for")->required();
  fit->add_option("sizes", options->sizes, "The agreed sizes")->required();
  fit->add_option("--threads", options->threads, "Number of threads")
      ->capture_default_str()
      ->check(WholeNumberWithin(1, 256));
  add_out(*fit);
  CLI::App* pool =
      add("pool", "Pool the fitted sizes of the arms to their prior", Pool,
          "An arm that differs from the prior of all others (1 % over all arms) is left out, and "
          "so is\n"
          "one without a fit of the sizes that most arms were fitted with.\n\n"
          "Example:\n  plumbline prior pool \"KR 210 R2700-2\" arm-*.json --out prior.json\n\n"
          "Exit codes: 0 written, 1 the arms have nothing in common or a file cannot be read,\n"
          "2 wrong arguments, or a file cannot be written.");
  add_fleet(*pool);
  pool->add_option("--date", options->date, "Date of the prior, YYYY-MM-DD (default: today, UTC)");
  add_out(*pool);
  CLI::App* sign =
      add("sign", "Sign a prior for delivery to the cells", Sign,
          "The key is made by\n"
          "  openssl genpkey -algorithm ed25519 -out plant.key\n"
          "  openssl pkey -in plant.key -pubout -out plant.pem\n"
          "Keep plant.key at the plant; plant.pem goes to every cell.\n\n"
          "Example:\n  plumbline prior sign prior.json --key plant.key --out kr210.prior\n\n"
          "Exit codes: 0 written, 1 a file cannot be read or is no prior or key,\n"
          "2 wrong arguments, or a file cannot be written.");
  sign->add_option("prior", options->prior, "Prior, of `plumbline prior pool`")->required();
  sign->add_option("--key", options->key, "Ed25519 private key, PEM")->required();
  add_out(*sign);
  CLI::App* show =
      add("show", "Verify a signed prior and print it", Show,
          "Example:\n  plumbline prior show /etc/plumbline/priors/kr210.prior\n\n"
          "Exit codes: 0 verified and printed, 1 it cannot be read or no key verifies it,\n"
          "2 wrong arguments, or a file cannot be written.");
  show->add_option("prior", options->prior, "Signed prior")->required();
  show->add_option("--prior-keys", options->keys, "Folder of the plant's public keys, *.pem")
      ->capture_default_str();
  show->add_option("--json", options->json, "Write it as JSON; - is standard output");
}

}  // namespace plumbline::cli
