#include "app/measure/siblings/fleet_prior.h"

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>

#include "app/base/config/cell_reader.h"
#include "app/base/text/signed_text.h"
#include "app/measure/siblings/installed_prior.h"
#include "app/measure/siblings/prior_json.h"
#include "app/measure/siblings/repeated_rows.h"
#include "firmware-like/effects/catalogue.h"
#include "firmware-like/effects/parameter_name.h"
#include "tests/app/base/text/test_keys.h"
#include "tests/app/measure/siblings/prior_cell.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::siblings_test {

using namespace plumbline::measure;

namespace {

SizeKey Key(const std::string& effect, const std::string& parameter) {
  const effects::Effect* found = effects::FindEffect(effect);
  REQUIRE(found != nullptr);
  const auto parsed = effects::ParameterFromName(found->traits(), parameter, 3);
  REQUIRE(parsed);
  return {found, {}, *parsed};
}

AgreedSizes ThreeSizes() {
  AgreedSizes agreed{
      {Key("joint_compliance", "q2"), Key("joint_compliance", "q3"), Key("gear_ratio", "q2"),
       Key("joint_offset", "q2"), Key("joint_offset", "q3")},
      3};
  return agreed;
}

/// Fits of arms with sizes of 2e-6, 3e-6 and 4e-4 that differ by `spread`, and offsets of 1e-4.
std::vector<ArmFit> Fits(int arms, double spread, std::mt19937_64& generator) {
  std::normal_distribution<double> normal(0, 1);
  const AgreedSizes agreed = ThreeSizes();
  const Eigen::VectorXd means = (Eigen::VectorXd(5) << 2e-6, 3e-6, 4e-4, 0, 0).finished();
  std::vector<ArmFit> fits;
  for (int arm = 0; arm < arms; ++arm) {
    SizeFit fit{agreed.keys, means, Eigen::MatrixXd::Zero(5, 5)};
    for (int k = 0; k < 5; ++k) {
      const double sd = k < 3 ? 0.02 * means[k] : 2e-5;
      fit.values[k] += (k < 3 ? spread * means[k] : 1e-4) * normal(generator);
      fit.values[k] += sd * normal(generator);
      fit.covariance(k, k) = sd * sd;
    }
    fits.push_back({"arm " + std::to_string(arm), fit});
  }
  return fits;
}

FleetPrior SomePrior(const std::string& model = "KR 210", const std::string& date = "2025-11-30") {
  std::mt19937_64 generator(3);
  FleetPrior prior = PoolFits(ThreeSizes(), Fits(5, 0.03, generator)).value();
  prior.model = model;
  prior.date = date;
  prior.created = date + "T08:00:00Z";
  prior.cell_text = PriorCell(model);
  return prior;
}

model::CellModel CellFrom(const std::string& text) {
  config::FaultList faults;
  const auto cell = config::CellFromText(text, "cell.toml", faults);
  INFO(config::FaultsText(faults));
  REQUIRE(cell);
  return *cell;
}

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  INFO(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

}  // namespace

TEST_CASE("an arm that differs is left out of the prior, and hardly one that does not") {
  std::mt19937_64 generator(7);
  for (const double spread : {0.03, 0.15}) {
    int left_out = 0, found = 0;
    constexpr int kFleets = 60, kArms = 8;
    for (int fleet = 0; fleet < kFleets; ++fleet) {
      std::vector<ArmFit> fits = Fits(kArms, spread, generator);
      const auto alike = PoolFits(ThreeSizes(), fits);
      REQUIRE(alike);
      left_out += static_cast<int>(alike->left_out.size());
      fits[3].fit.values.head(3) *= -1;  // another arm
      const auto prior = PoolFits(ThreeSizes(), fits);
      REQUIRE(prior);
      for (const LeftOutArm& one : prior->left_out) found += one.arm == "arm 3" ? 1 : 0;
      REQUIRE(prior->arms.size() + prior->left_out.size() == kArms);
    }
    CAPTURE(spread, left_out, found);
    CHECK(left_out <= 4);  // 1 % of the fleets: 0.6 expected
    CHECK(found >= kFleets - 1);
  }
}

TEST_CASE("sizes are pooled with their spread; those of each arm have mean zero") {
  std::mt19937_64 generator(9);
  const auto prior = PoolFits(ThreeSizes(), Fits(40, 0.15, generator));
  REQUIRE(prior);
  REQUIRE(prior->sizes.size() == 5);
  CHECK(prior->arms.size() >= 39);
  const double means[] = {2e-6, 3e-6, 4e-4};
  for (int k = 0; k < 3; ++k) {
    const Pooled& pooled = prior->sizes[k].pooled;
    CHECK(std::abs(pooled.mean - means[k]) < 3 * pooled.mean_sd);
    CHECK(pooled.between_sd > 0.1 * means[k]);
    CHECK(pooled.between_sd < 0.25 * means[k]);
  }
  for (int k = 3; k < 5; ++k) {
    CHECK(prior->sizes[k].pooled.mean == 0);
    CHECK(prior->sizes[k].pooled.between_sd > 7e-5);
    CHECK(prior->sizes[k].pooled.between_sd < 1.5e-4);
  }
}

TEST_CASE("one arm, or a fleet that does not agree, gives no prior but the reason") {
  std::mt19937_64 generator(1);
  CHECK(PoolFits(ThreeSizes(), Fits(1, 0.03, generator)).error() == "at least two arms are needed");
  const ArmFindings none;
  const auto agreed = AgreeOnSizes({&none, &none}, CellFrom(PriorCell()));
  REQUIRE_FALSE(agreed);
  CHECK(agreed.error().find("no size of an effect of the arm was found") == 0);
}

TEST_CASE("the agreed sizes do not depend on the order of the arms") {
  std::vector<ArmFindings> arms(3);
  const auto show = [](ArmFindings& arm, const std::string& effect, const std::string& joint) {
    effects::ActiveEffect& found = arm.effects.emplace_back();
    const SizeKey key = Key(effect, joint);
    found.term.effect = key.effect;
    found.term.parameters = {key.parameter};
  };
  for (const char* joint : {"q3", "q2"}) {
    for (const std::size_t arm : {0, 2}) show(arms[arm], "joint_compliance", joint);
    for (const std::size_t arm : {1, 2}) show(arms[arm], "gear_ratio", joint);
  }
  show(arms[1], "joint_compliance", "q2");
  const model::CellModel cell = CellFrom(PriorCell());
  const auto agreed = AgreeOnSizes({&arms[0], &arms[1], &arms[2]}, cell);
  const auto again = AgreeOnSizes({&arms[2], &arms[1], &arms[0]}, cell);
  REQUIRE(agreed);
  CHECK(*agreed == *again);
  CHECK(agreed->common == 4);
}

TEST_CASE("an arm whose rows are in the prior is left out of it, and the answer says so") {
  FleetPrior prior = SomePrior();
  prior.cell = CellFrom(prior.cell_text);
  std::mt19937_64 generator(4);
  std::uniform_real_distribution<double> any(-1, 1);
  const auto some_rows = [&](int count) {
    MeasuredTable table;
    for (int k = 0; k < count; ++k) {
      MeasuredRow& row = table.rows.emplace_back();
      row.q = Vec3(any(generator), any(generator), any(generator));
      row.measured_W = Vec3(any(generator), any(generator), any(generator));
    }
    return table;
  };
  std::vector<MeasuredTable> tables;
  for (ArmFit& one : prior.arms) {
    tables.push_back(some_rows(300));
    one.row_sketch = RowSketch(tables.back(), prior.cell.robot.joints);
    CHECK(one.row_sketch.size() == kSketchRows);
  }
  CHECK(WithoutArmOf(some_rows(300), prior)->Source() == "5 arms of KR 210, 2025-11-30");
  MeasuredTable some =
      some_rows(100);  // with half of the rows of arm 3, as another file states them
  for (std::size_t k = 0; k < 150; ++k) {
    MeasuredRow row = tables[3].rows[2 * k];
    row.q[0] += 2 * std::numbers::pi;
    row.q *= 1 + 1e-14;
    some.rows.push_back(row);
  }
  const auto read = FleetPriorFromJson(JsonFrom(prior));
  REQUIRE(read);
  const auto without = WithoutArmOf(some, *read);
  REQUIRE(without);
  CHECK(without->Source() == "4 arms of KR 210, 2025-11-30, without this arm itself");
  CHECK(without->ArmNames() == std::vector<std::string>{"arm 0", "arm 1", "arm 2", "arm 4"});
  CHECK(without->sizes[0].pooled.arms == 4);
  CHECK(without->sizes[0].pooled.mean != prior.sizes[0].pooled.mean);
  prior.arms.resize(2);
  const auto alone = WithoutArmOf(tables[1], prior);
  REQUIRE_FALSE(alone);
  CHECK(alone.error() ==
        "the prior of KR 210, 2025-11-30, without this arm itself: at least two arms are needed");
}

TEST_CASE("a prior survives writing and reading, and a damaged one is refused with the reason") {
  FleetPrior prior = SomePrior();
  prior.left_out.push_back({"line 7", "it differs from the others (p = 1e-09)"});
  const std::string json = JsonFrom(prior);
  const auto read = FleetPriorFromJson(json);
  INFO((read ? "" : read.error()));
  REQUIRE(read);
  CHECK(JsonFrom(*read) == json);
  CHECK(read->Source() == "5 arms of KR 210, 2025-11-30");
  CHECK(read->sizes[1].key == prior.sizes[1].key);
  CHECK(read->sizes[1].pooled.mean == prior.sizes[1].pooled.mean);
  CHECK(read->cell.robot.size() == 3);
  const std::pair<const char*, const char*> damages[] = {
      {"plumbline fleet prior", "some format"},
      {"\"schema\": 1", "\"schema\": 2"},
      {"2025-11-30", "yesterday"},
      {"2025-11-30T", "then"},
      {"\"gear_ratio\"", "\"new_effect\""},
      {"\"gear_ratio\"", "\"tool_frame\""},
      {"\"parameter\": \"q2\"", "\"parameter\": \"q9\""},
      {"\"word\": \"\"", "\"word\": \"x\""},
      {"\"parameter\": \"q3\"", "\"parameter\": \"q2\""},
      {"\"between_sd\": ", "\"between_sd\": -"},
      {"\"arm 1\"", "\"arm\\n1\""},
      {"convention", "conventions"},
      {"\"sizes\"", "\"size\""}};
  for (const auto& [from, to] : damages) {
    CAPTURE(from, to);
    const auto refused = FleetPriorFromJson(Replaced(json, from, to));
    REQUIRE_FALSE(refused);
    CHECK_FALSE(refused.error().empty());
  }
}

TEST_CASE("an arm's sizes survive writing and reading") {
  const std::string cell_text = PriorCell();
  const model::CellModel cell = CellFrom(cell_text);
  Diagnosis diagnosis;
  diagnosis.sigma_m = 5e-5;
  for (const auto& [line, weight] : {std::pair(2, 1.0), std::pair(3, 0.25)}) {
    RowTrace row;
    row.line = line;
    row.weight = weight;
    diagnosis.rows.push_back(row);
  }
  Finding& finding = diagnosis.findings.emplace_back();
  finding.effect.term.effect = effects::FindEffect("joint_compliance");
  finding.effect.term.parameters = {Key("joint_compliance", "q2").parameter};
  finding.effect.values = {2e-6};
  finding.covariance = Eigen::MatrixXd::Constant(1, 1, 1e-16);
  auto sizes = SizesOfArm("line 3", std::string(64, 'a'), {"0a", "1b"}, cell_text, cell, diagnosis,
                          "2026-11-30");
  INFO((sizes ? "" : sizes.error()));
  REQUIRE(sizes);
  std::mt19937_64 generator(2);
  sizes.value().fitted = {ThreeSizes(), Fits(1, 0.03, generator).front().fit};
  const std::string json = JsonFrom(*sizes);
  const auto read = ArmSizesFromJson(json);
  INFO((read ? "" : read.error()));
  REQUIRE(read);
  CHECK(JsonFrom(*read) == json);
  CHECK(read->found.weight_of_line == std::map<int, double>{{2, 1}, {3, 0.25}});
  REQUIRE(read->found.effects.size() == 1);
  CHECK(read->found.effects[0].values[0] == Approx(2e-6));
  CHECK(read->fitted->asked == ThreeSizes());
  CHECK(read->fitted->fit.covariance == sizes->fitted->fit.covariance);
  const auto agreed = AgreedSizesFromJson(JsonFrom(ThreeSizes()), 3);
  REQUIRE(agreed);
  CHECK(*agreed == ThreeSizes());
  CHECK_FALSE(
      AgreedSizesFromJson(Replaced(JsonFrom(ThreeSizes()), "\"common\": 3", "\"common\": 9"), 3));
  for (const auto& [from, to] : {std::pair("[2,1.0]", "[2,-1.0]"), std::pair("5e-05", "0.0"),
                                 std::pair("\"values\":[", "\"values\":[1,"),
                                 std::pair("\"arm\":\"line 3\"", "\"arm\":\"\"")}) {
    CAPTURE(from);
    CHECK_FALSE(ArmSizesFromJson(Replaced(json, from, to)));
  }
}

TEST_CASE("arms of another model or declared otherwise than most are left out") {
  std::vector<ArmSizes> arms(6);
  const std::string texts[] = {PriorCell("KR 210", "390.0"), PriorCell(),         PriorCell(),
                               PriorCell("KR 120"),          PriorCell("KR 210"), PriorCell()};
  for (std::size_t k = 0; k < arms.size(); ++k) {
    arms[k].arm = k == 5 ? "arm 1" : "arm " + std::to_string(k);
    arms[k].cell = CellFrom(texts[k]);
  }
  std::vector<LeftOutArm> left_out;
  const std::vector<const ArmSizes*> comparable = ComparableArms(arms, "KR 210", left_out);
  CHECK(comparable == std::vector<const ArmSizes*>{&arms[1], &arms[2], &arms[4]});
  REQUIRE(left_out.size() == 3);
  CHECK(left_out[0].reason == "its nominal joint 1 differs");
  CHECK(left_out[1].reason == "its cell names another arm model, or none");
  CHECK(left_out[2].reason == "another arm has the same name");
}

TEST_CASE("the newest prior of the arm's model is found, and why one cannot be used is said") {
  const test::TemporaryFolder folder;
  const std::string priors = folder.path() + "/priors", keys = folder.path() + "/keys";
  const model::CellModel cell = CellFrom(PriorCell());
  CHECK(FindPrior(priors, keys, cell).problems ==
        std::vector{priors + ": does not exist; give a signed prior, or a folder of *.prior"});
  std::filesystem::create_directories(priors);
  std::filesystem::create_directories(keys);
  CHECK(FindPrior(priors, keys, cell).problems.empty());
  const auto deliver = [&](const std::string& name, const FleetPrior& prior) {
    std::ofstream(priors + "/" + name)
        << text::SignedText(JsonFrom(prior), test::kPrivateKey).value();
  };
  const auto problem = [&](const std::string& path) {
    const InstalledPrior found = FindPrior(path, keys, cell);
    CHECK_FALSE(found.prior);
    REQUIRE(found.problems.size() == 1);
    return found.problems.front();
  };
  deliver("a.prior", SomePrior());
  CHECK(problem(priors).find("a.prior: cannot be verified without the plant's public key") !=
        std::string::npos);
  std::ofstream(keys + "/plant.pem") << test::kOtherPublicKey;
  CHECK(problem(priors).find("no installed key verifies its signature") != std::string::npos);
  std::ofstream(keys + "/plant.pem") << test::kPublicKey;
  std::ofstream(keys + "/foreign.pem") << "no key";
  std::filesystem::create_directory(keys + "/unreadable.pem");
  deliver("b.prior", SomePrior("KR 120", "2026-01-01"));
  deliver("c.prior", SomePrior("KR 210", "2025-12-24"));
  const InstalledPrior found = FindPrior(priors, keys, cell);
  REQUIRE(found.prior);
  CHECK(found.prior->date == "2025-12-24");
  CHECK(found.problems.empty());
  FleetPrior later = SomePrior("KR 210", "2025-12-24");
  later.created = "2025-12-24T09:00:00Z";
  deliver("a.prior", later);
  CHECK(FindPrior(priors, keys, cell).prior->created == later.created);
  deliver("f.prior", SomePrior("KR 210", "2999-01-01"));
  const InstalledPrior past = FindPrior(priors, keys, cell);
  CHECK(past.prior->created == later.created);
  REQUIRE(past.problems.size() == 1);
  CHECK(past.problems[0].find("f.prior: was created at 2999-01-01T08:00:00Z, in the future") !=
        std::string::npos);
  std::filesystem::remove(priors + "/f.prior");
  CHECK(problem(priors + "/b.prior").find("is the prior of KR 120; the cell file names KR 210") !=
        std::string::npos);
  const InstalledPrior other = FindPrior(priors, keys, CellFrom(PriorCell("KR 210", "390.0")));
  CHECK_FALSE(other.prior);
  REQUIRE(other.problems.size() == 2);
  CHECK(other.problems[0].find("its nominal joint 1 differs") != std::string::npos);
  std::ofstream(priors + "/d.prior") << "{}";
  const InstalledPrior beside = FindPrior(priors, keys, cell);
  CHECK(beside.prior);
  REQUIRE(beside.problems.size() == 1);
  CHECK(beside.problems[0].find("d.prior: is not signed") != std::string::npos);
}

}  // namespace plumbline::siblings_test
