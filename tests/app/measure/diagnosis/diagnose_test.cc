// Diagnosis of data from the simulator, which shares no code with it, and of the shared examples.
#include "app/measure/diagnosis/diagnose.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <set>

#include "app/measure/diagnosis/linear/candidates.h"
#include "app/measure/diagnosis/output/summary.h"
#include "app/measure/diagnosis/preparation/dataset_preparation.h"
#include "app/measure/diagnosis/result/diagnosis.h"
#include "tests/app/measure/diagnosis/simulated.h"

namespace plumbline::diagnose_test {

using namespace plumbline::measure;
namespace fs = std::filesystem;

namespace {

using Data = MeasuredCell;

Result<Diagnosis> Answer(const Data& data) {
  return Diagnose(data.cell, data.table, {});
}

std::vector<std::string> Ids(const Diagnosis& diagnosis) {
  std::vector<std::string> ids;
  for (const Finding& finding : diagnosis.findings) {
    ids.emplace_back(finding.effect.term.effect->traits().id);
  }
  return ids;
}

}  // namespace

TEST_CASE("simulated effects are identified with their values") {
  for (const char* family :
       {"joint_compliance", "thermal_growth", "backlash_move", "gear_periodic"}) {
    CAPTURE(family);
    const auto diagnosis =
        Answer(Simulated(std::string("--family ") + family + " --seed 3 --signal 20"));
    REQUIRE(diagnosis);
    CHECK(diagnosis->verdict == Verdict::kExplained);
    const std::string id = std::string(family) == "backlash_move" ? "backlash" : family;
    CHECK(Ids(*diagnosis) == std::vector<std::string>{id});
    CHECK(diagnosis->rms_after_m < 1.3 * diagnosis->noise_floor_m);
    CHECK(diagnosis->held_out.after_m < 1.5 * diagnosis->noise_floor_m);
    CHECK(diagnosis->held_out.before_m > 3 * diagnosis->held_out.after_m);
  }
}

TEST_CASE("three and four simultaneous effects are identified from few rows") {
  struct Case {
    std::string options;
    std::set<std::string> ids;
  };
  const Case cases[] = {
      {"--family payload_mass+thermal_growth+payload_cog --seed 31000 --signal 8.505 --rows "
       "60 --repeats 10",
       {"payload_mass", "thermal_growth", "payload_cog"}},
      {"--family link_geometry+step_event+backlash_load+backlash_move --seed 31004 --signal "
       "16.734 --rows 60 --repeats 10",
       {"link_geometry", "step_event", "backlash"}}};
  for (const Case& of : cases) {
    CAPTURE(of.options);
    const auto diagnosis = Answer(Simulated(of.options));
    REQUIRE(diagnosis);
    const std::vector<std::string> ids = Ids(*diagnosis);
    CHECK(std::set<std::string>(ids.begin(), ids.end()) == of.ids);
  }
}

TEST_CASE("errors of a measuring camera are identified with any seed") {
  for (const std::string family : {"camera_tag_size", "camera_zoom", "camera_lens"}) {
    for (int seed = 1; seed <= 4; ++seed) {  // two of the camera_zoom data are zoomed half way
      CAPTURE(family, seed);
      const auto diagnosis =
          Answer(Simulated("--family " + family + " --signal 8 --seed " + std::to_string(seed)));
      REQUIRE(diagnosis);
      CHECK(diagnosis->verdict == Verdict::kExplained);
      CHECK(Ids(*diagnosis) == std::vector<std::string>{family});
      CHECK(diagnosis->rms_after_m < 1.3 * diagnosis->noise_floor_m);
    }
  }
}

TEST_CASE("tag size and instrument scale are indistinguishable if the base is free") {
  for (const std::string family : {"camera_tag_size", "measurement_scale"}) {
    CAPTURE(family);
    const auto diagnosis =
        Answer(Simulated("--camera --unaligned --signal 20 --seed 2 --family " + family));
    REQUIRE(diagnosis);
    CHECK(diagnosis->verdict == Verdict::kAmbiguous);
    std::vector<std::string> named = Ids(*diagnosis);
    for (const Rival& rival : diagnosis->rivals) named.push_back(rival.id);
    for (const char* id : {"camera_tag_size", "measurement_scale"}) {
      CAPTURE(id);
      CHECK(std::find(named.begin(), named.end(), id) != named.end());
    }
  }
}

TEST_CASE("with more rows than are searched, every trace belongs to its row") {
  const Data data =
      Simulated("--family tool_stiffness --seed 5 --signal 20 --rows 2600 --repeats 0");
  REQUIRE(data.table.rows.size() == 2600);
  DiagnosisOptions options;
  options.bootstrap = 20;
  const auto diagnosis = Diagnose(data.cell, data.table, options);
  REQUIRE(diagnosis);
  REQUIRE(diagnosis->rows.size() == data.table.rows.size());
  int joints_seen = 0;
  for (const SignalTrace& signal : diagnosis->signals) {
    CAPTURE(signal.name);
    REQUIRE(signal.values.size() == diagnosis->rows.size());
    if (signal.name != "q2_deg") continue;
    ++joints_seen;
    const double scale = signal.values.front() / data.table.rows[0].q[1];
    for (std::size_t k = 0; k < signal.values.size(); ++k) {
      REQUIRE(signal.values[RowIndex(k)] == Approx(scale * data.table.rows[k].q[1]));
    }
  }
  CHECK(joints_seen == 1);
  std::size_t held_out = 0;
  for (const RowTrace& row : diagnosis->rows) {
    CHECK((row.fold >= 0) == row.held_out_after.has_value());
    held_out += row.held_out_after ? 1 : 0;
  }
  CHECK(held_out > 2000);
  CHECK(held_out < diagnosis->rows.size());
  for (const Rival& rival : diagnosis->rivals) {
    CHECK(rival.rows.size() == rival.shift_W.size());
    CHECK(rival.rows.back() < RowIndex(2600));
  }
}

TEST_CASE("effects of the order of moves are excluded if the moves are not recorded") {
  const Data data = Simulated("--family backlash_move --seed 3 --signal 20");
  DiagnosisOptions options;
  options.order_unknown = true;
  const auto diagnosis = Diagnose(data.cell, data.table, options);
  REQUIRE(diagnosis);
  int refused = 0;
  for (const CandidateOutcome& one : diagnosis->considered) {
    if (one.id != "approach_lag" && one.id != "backlash (move)") continue;
    CAPTURE(one.id);
    CHECK_FALSE(one.taken);
    CHECK_THAT(one.reason, Catch::Contains("moves between the probes are not recorded"));
    ++refused;
  }
  CHECK(refused == 2);
  const std::vector<std::string> ids = Ids(*diagnosis);
  CHECK(std::find(ids.begin(), ids.end(), "approach_lag") == ids.end());
  for (const Finding& finding : diagnosis->findings) CHECK(finding.effect.term.word != "move");
  CHECK(std::any_of(
      diagnosis->not_recorded.begin(), diagnosis->not_recorded.end(),
      [](const std::string& what) { return what.find("moves between") != std::string::npos; }));
}

TEST_CASE("camera effects are neither candidates nor counted if no camera measures") {
  Data data = Simulated("--family camera_zoom --signal 10 --seed 1");
  auto dataset = DatasetFrom(data.cell, data.table);
  REQUIRE(dataset);
  const double with_camera = EffectsConsidered(*dataset);
  data.cell.measurement.X_WC.reset();
  dataset = DatasetFrom(data.cell, data.table);
  REQUIRE(dataset);
  CHECK(EffectsConsidered(*dataset) == with_camera - 3);
  const Candidates candidates = CandidatesFor(*dataset);
  const auto refused = std::count_if(
      candidates.excluded.begin(), candidates.excluded.end(), [](const ExcludedCandidate& one) {
        return one.id.find("camera_") == 0 && one.reason.find("camera_xyz_mm") != std::string::npos;
      });
  CHECK(refused == 3);
}

TEST_CASE("a zoom is searched only where recorded counts changed") {
  Data data;
  std::optional<double> moment;
  for (int seed = 1; !moment && seed < 20; ++seed) {  // first data set that is zoomed half way
    data = Simulated("--family camera_zoom --signal 10 --seed " + std::to_string(seed));
    const auto diagnosis = Answer(data);
    REQUIRE(diagnosis);
    REQUIRE(Ids(*diagnosis) == std::vector<std::string>{"camera_zoom"});
    if (diagnosis->findings[0].effect.values.size() == 2)
      moment = diagnosis->findings[0].effect.values.front();
  }
  REQUIRE(moment);
  for (measure::MeasuredRow& row : data.table.rows)
    row.further.push_back(row.t_s < *moment ? 5000 : 5040);
  data.table.further.emplace_back("zoom_counts");
  const auto with_counts = Answer(data);
  REQUIRE(with_counts);
  CHECK(Ids(*with_counts) == std::vector<std::string>{"camera_zoom"});
  CHECK(with_counts->findings[0].effect.values.front() == Approx(*moment));
  // Constant counts rule out a zoom; the answer must be another explanation.
  for (measure::MeasuredRow& row : data.table.rows) row.further.back() = 5000;
  const auto still = Answer(data);
  REQUIRE(still);
  for (const Finding& finding : still->findings)
    CHECK_FALSE((finding.effect.term.effect->traits().id == "camera_zoom" &&
                 finding.effect.values.size() == 2));
}

TEST_CASE("clean data give no effect, also with outliers and heavy tails") {
  for (const char* options : {"", " --outliers 0.05", " --heavy-tails"}) {
    CAPTURE(options);
    const auto diagnosis = Answer(Simulated(std::string("--family none --seed 5") + options));
    REQUIRE(diagnosis);
    CHECK(diagnosis->verdict == Verdict::kNoEffect);
    CHECK(diagnosis->minimum_detectable_m.size() > 12);
    for (const auto& [id, least_m] : diagnosis->minimum_detectable_m) {
      CAPTURE(id);
      CHECK(least_m > 0);
      CHECK(least_m < 1e-3);
    }
  }
}

TEST_CASE("runs of outliers are not reported as events, and an event among them is") {
  const std::string runs = " --robot kr210 --sigma-mm 0.05 --outliers 0.15 --outlier-runs";
  for (const char* seed : {"5510000", "5510001"}) {
    CAPTURE(seed);
    const auto nothing = Answer(Simulated(std::string("--family none --seed ") + seed + runs));
    REQUIRE(nothing);
    CHECK(nothing->verdict == Verdict::kNoEffect);
    const auto event =
        Answer(Simulated(std::string("--family step_event --signal 25 --seed ") + seed + runs));
    REQUIRE(event);
    const std::vector<std::string> ids = Ids(*event);
    CHECK(std::count(ids.begin(), ids.end(), "step_event") == 1);
  }
}

/// The data with joint readings rounded to 1 mrad.
Data ReadCoarsely(Data data) {
  constexpr double kStep_rad = 1e-3;
  data.table.recorded.q_step = true;
  for (measure::MeasuredRow& row : data.table.rows) {
    row.q_step_rad = kStep_rad;
    for (double& q : row.q) q = kStep_rad * std::round(q / kStep_rad);
  }
  return data;
}

TEST_CASE("effects below the joint resolution are not identified, and a note says so") {
  int named = 0;
  for (int seed = 1; seed <= 6; ++seed) {
    const auto diagnosis = Answer(ReadCoarsely(Simulated(
        "--family joint_offset --signal 5 --sigma-mm 0.01 --seed " + std::to_string(seed))));
    REQUIRE(diagnosis);
    CHECK(diagnosis->sigma_m > 2e-4);
    named += diagnosis->verdict == Verdict::kNoEffect ? 0 : 1;
    const auto noted = [&](const char* words) {
      return std::any_of(
          diagnosis->notes.begin(), diagnosis->notes.end(),
          [&](const std::string& note) { return note.find(words) != std::string::npos; });
    };
    CHECK(noted("have a resolution of 1 mrad"));
    CHECK(noted("can be detected"));
  }
  CHECK(named == 0);
}

TEST_CASE("effects above the joint resolution are identified despite the rounding") {
  const auto diagnosis = Answer(
      ReadCoarsely(Simulated("--family joint_compliance --signal 300 --sigma-mm 0.05 --seed 3")));
  REQUIRE(diagnosis);
  CHECK(Ids(*diagnosis) == std::vector<std::string>{"joint_compliance"});
}

TEST_CASE("a time-dependent effect is written with the time span of its data and the time zero") {
  Data data = Simulated("--family thermal_drift --signal 20 --seed 3");
  DiagnosisOptions options;
  options.time_zero_s = 1.8e9;
  const auto diagnosis = Diagnose(data.cell, data.table, options);
  REQUIRE(diagnosis);
  REQUIRE(Ids(*diagnosis) == std::vector<std::string>{"thermal_drift"});
  REQUIRE(diagnosis->findings[0].effect.seen_t_s);
  const auto [first, last] = std::minmax_element(
      data.table.rows.begin(), data.table.rows.end(),
      [](const measure::MeasuredRow& a, const measure::MeasuredRow& b) { return a.t_s < b.t_s; });
  CHECK(diagnosis->findings[0].effect.seen_t_s->low == first->t_s);
  CHECK(diagnosis->findings[0].effect.seen_t_s->high == last->t_s);
  CHECK(diagnosis->domain.time_zero_s == 1.8e9);
  // The residual of held-out rows is at least the noise, and here not larger.
  REQUIRE(diagnosis->domain.residual_sigma_m);
  CHECK(*diagnosis->domain.residual_sigma_m >= diagnosis->sigma_m);
  CHECK(*diagnosis->domain.residual_sigma_m < 1.2 * diagnosis->sigma_m);
}

TEST_CASE("two drifts with time constants far apart are explained as two") {
  Data data = Simulated("--family none --seed 3 --robot ur10");
  Remeasure(data,
            {EffectWith(data.cell, "thermal_drift", {{"x", 8e-4}, {"time_constant", 250}}),
             EffectWith(data.cell, "thermal_drift", {{"z", 1e-3}, {"time_constant", 2500}})},
            5e-5, 4);
  const auto diagnosis = Answer(data);
  REQUIRE(diagnosis);
  CHECK(diagnosis->verdict == Verdict::kExplained);
  CHECK(Ids(*diagnosis) == std::vector<std::string>{"thermal_drift", "thermal_drift"});
}

TEST_CASE("a cause outside the catalogue is unknown, and its driver signal is reported") {
  const auto diagnosis = Answer(Simulated("--family air_pressure --seed 2 --signal 15"));
  REQUIRE(diagnosis);
  CHECK(diagnosis->verdict == Verdict::kUnknown);
  CHECK(diagnosis->drivers == std::vector<std::string>{"air_pressure_bar"});
  CHECK(diagnosis->held_out.after_m < 0.5 * diagnosis->held_out.before_m);
}

TEST_CASE("a link that warms up is unknown, follows the time and changes the length of a link") {
  const MeasuredCell data = Simulated("--family link_warmup --seed 3 --signal 8 --robot ur10");
  const auto diagnosis = Answer(data);
  REQUIRE(diagnosis);
  CHECK(diagnosis->verdict == Verdict::kUnknown);
  CHECK(diagnosis->drivers == std::vector<std::string>{"t_s"});
  REQUIRE(diagnosis->findings.size() == 1);
  const std::string summary = SummaryText(*diagnosis, {.cell = data.cell, .details = true});
  CHECK_THAT(summary, Catch::Contains(" of link "));
  CHECK_THAT(summary, Catch::Contains(" mm along t_s"));
}

TEST_CASE("an unknown cause of two signals and their product is reported with both signals") {
  const auto diagnosis = Answer(Simulated(
      "--family temperature_payload --seed 700101 --signal 9.644 --robot kr210 --sigma-mm 0.05"));
  REQUIRE(diagnosis);
  CHECK(diagnosis->verdict == Verdict::kUnknown);
  CHECK(std::set<std::string>(diagnosis->drivers.begin(), diagnosis->drivers.end()) ==
        std::set<std::string>{"temp_C", "payload_kg"});
  REQUIRE(diagnosis->findings.size() == 1);
  CHECK(diagnosis->findings.front().effect.term.drivers.size() == 2);
  CHECK(diagnosis->held_out.after_m < 0.25 * diagnosis->held_out.before_m);
}

TEST_CASE("an unknown cause is ambiguous if time and temperature rose together") {
  const auto diagnosis = Answer(Simulated(
      "--family temperature_squared --seed 700101 --signal 10.771 --robot kr210 --sigma-mm 0.05 "
      "--steady-rise"));
  REQUIRE(diagnosis);
  CHECK(diagnosis->verdict == Verdict::kAmbiguous);
  CHECK(std::set<std::string>(diagnosis->drivers.begin(), diagnosis->drivers.end()) ==
        std::set<std::string>{"t_s", "temp_C"});
  REQUIRE(diagnosis->rivals.size() == 1);
  CHECK(diagnosis->rivals.front().id == "empirical");
  CHECK(diagnosis->rivals.front().word != diagnosis->rivals.front().instead_of_word);
}

TEST_CASE("the discrepancy model corrects many lines of a joint; clean data have none") {
  Data data = Simulated("--family none --seed 8 --rows 250 --robot ur10");
  const auto clean = Answer(data);
  REQUIRE(clean);
  CHECK(clean->discrepancy.empty());
  // The first joint has 24 lines of equal amplitude and different phases.
  for (measure::MeasuredRow& row : data.table.rows) {
    double turn = 0;
    for (int k = 1; k <= 24; ++k) turn += 1.3e-4 * std::sin(k * row.q[0] + k * k);
    const Pose& X_WB = data.cell.robot.X_WB;
    const Vec3 arm_B = X_WB.R.transpose() * (*row.measured_W - X_WB.p);
    const Vec3 turned_B = Eigen::AngleAxisd(turn, Vec3::UnitZ()) * arm_B;
    row.measured_W = X_WB.p + X_WB.R * turned_B;
  }
  const auto rough = Answer(data);
  REQUIRE(rough);
  CHECK(rough->rms_before_m > 4 * rough->noise_floor_m);
  CHECK(rough->rms_after_m < 1.3 * rough->noise_floor_m);
  CHECK(rough->held_out.after_m < 2 * rough->noise_floor_m);
}

TEST_CASE(
    "payload mass and tool stiffness need a proposed pose if one payload and rigid joints were "
    "measured") {
  const auto diagnosis = Answer(
      Simulated("--family tool_stiffness --seed 1 --signal 15 --one-payload --rigid-joints"));
  REQUIRE(diagnosis);
  CHECK(diagnosis->verdict == Verdict::kAmbiguous);
  CHECK_FALSE(diagnosis->rivals.empty());
  REQUIRE_FALSE(diagnosis->next_poses.empty());
  CHECK(diagnosis->next_poses.front().separation_m > 10 * diagnosis->sigma_m);
}

TEST_CASE("one row with another payload separates mass from stiffness and is not an outlier") {
  constexpr double kUsual_kg = 40;
  const Data all =
      Simulated("--family payload_mass --seed 1 --signal 15 --rigid-joints --rows 150");
  Data few = all;
  const auto usual = [&](const measure::MeasuredRow& row) { return row.payload_kg == kUsual_kg; };
  std::erase_if(few.table.rows, [&](const measure::MeasuredRow& row) { return !usual(row); });
  REQUIRE(few.table.rows.size() > 20);
  const auto before = Answer(few);
  REQUIRE(before);
  CHECK(before->verdict == Verdict::kAmbiguous);
  const auto other = std::find_if_not(
      all.table.rows.begin(), all.table.rows.end(), [&](const measure::MeasuredRow& row) {
        return usual(row) || row.payload_kg == 20 || row.payload_kg == 60;
      });
  REQUIRE(other != all.table.rows.end());
  few.table.rows.push_back(*other);
  const auto after = Answer(few);
  REQUIRE(after);
  // Two loads leave open which function of the load it is, but not that it is one.
  CHECK(after->verdict == Verdict::kAmbiguous);
  CHECK(std::ranges::all_of(after->rivals,
                            [](const Rival& rival) { return rival.along == "payload_kg"; }));
  CHECK(Ids(*after) == std::vector<std::string>{"payload_mass"});
  CHECK(after->outlier_rows.empty());
}

TEST_CASE(
    "another payload is proposed, with a note, if no pose at the measured payload separates") {
  const auto diagnosis = Answer(
      Simulated("--family tool_stiffness --seed 1 --signal 15 --one-payload --rigid-joints"));
  REQUIRE(diagnosis);
  CHECK(std::any_of(diagnosis->next_poses.begin(), diagnosis->next_poses.end(),
                    [](const NextPose& pose) { return pose.payload_kg == 0; }));
  CHECK(std::any_of(diagnosis->notes.begin(), diagnosis->notes.end(), [](const std::string& note) {
    return note.find("without payload") != std::string::npos;
  }));
}

TEST_CASE("a diagnosis of few rows by two threads") {
  Data data = Simulated("--family joint_compliance --seed 6 --signal 20 --robot ur10");
  DiagnosisOptions options;
  options.bootstrap = 20;
  const auto diagnosis = Diagnose(data.cell, data.table, options);
  REQUIRE(diagnosis);
  CHECK(diagnosis->verdict == Verdict::kExplained);
}

TEST_CASE("the same input gives the same answer") {
  const Data data = Simulated("--family pedestal_compliance --seed 4 --signal 10");
  const auto first = Answer(data), second = Answer(data);
  REQUIRE(first);
  REQUIRE(second);
  REQUIRE(first->findings.size() == second->findings.size());
  for (std::size_t k = 0; k < first->findings.size(); ++k) {
    CHECK(first->findings[k].effect.values == second->findings[k].effect.values);
  }
  CHECK(first->held_out.after_m == second->held_out.after_m);
}

TEST_CASE("mistakes in the data are rejected with advice") {
  const Data clean = Simulated("--family none --seed 8");
  const auto refused = [](Data data, const std::function<void(measure::MeasuredRow&)>& spoil) {
    for (measure::MeasuredRow& row : data.table.rows) spoil(row);
    const auto diagnosis = Answer(data);
    REQUIRE_FALSE(diagnosis);
    return diagnosis.error();
  };
  CHECK(refused(clean, [](measure::MeasuredRow& row) {
          row.q[2] = -row.q[2];
        }).find("the sign of joint q3 is reversed") != std::string::npos);
  CHECK(refused(clean, [](measure::MeasuredRow& row) { row.q *= kRadPerDeg; }).find("radians") !=
        std::string::npos);
  CHECK(refused(clean, [](measure::MeasuredRow& row) {
          row.q[1] += 90 * kRadPerDeg;
        }).find("theta_offset_deg") != std::string::npos);
  CHECK(refused(clean, [](measure::MeasuredRow& row) {
          *row.measured_W += Vec3(1, 0, 0);
        }).find("the robot's base is (") != std::string::npos);
  CHECK(refused(clean, [](measure::MeasuredRow& row) {
          row.measured_W = Vec3(row.q[0], row.q[1], row.q[2]);
        }).find("check the DH table") != std::string::npos);
}

TEST_CASE("radians are recognised on an arm with a linear joint, whose column is in millimetres") {
  Data data = Simulated("--family none --robot ur10 --rows 40 --seed 8");
  data.cell.robot.joints[0].type = model::JointType::kPrismatic;
  data.cell.robot.joints[0].min = -5;
  data.cell.robot.joints[0].max = 5;
  Remeasure(data, {}, 5e-5, 4);
  for (measure::MeasuredRow& row : data.table.rows) {
    for (int i = 1; i < row.q.size(); ++i) row.q[i] *= kRadPerDeg;
  }
  const auto refused = Answer(data);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().find("radians") != std::string::npos);
}

TEST_CASE(
    "few rows, repeated rows or a joint that never moved give an answer or say what is missing") {
  Data few = Simulated("--family none --seed 8");
  few.table.rows.resize(3);
  const auto too_few = Answer(few);
  REQUIRE_FALSE(too_few);
  CHECK(too_few.error().find("at least 4 are needed") != std::string::npos);

  few = Simulated("--family none --seed 8");
  few.table.rows.resize(6);
  CHECK(Answer(few));

  Data repeated = Simulated("--family none --seed 9");
  const auto rows = repeated.table.rows;
  repeated.table.rows.insert(repeated.table.rows.end(), rows.begin(), rows.end());
  const auto of_repeated = Answer(repeated);
  REQUIRE(of_repeated);
  CHECK(of_repeated->verdict == Verdict::kNoEffect);

  Data nothing = Simulated("--family none --seed 9");
  nothing.table.recorded.position = false;
  const auto unmeasured = Answer(nothing);
  REQUIRE_FALSE(unmeasured);
  CHECK(unmeasured.error().find("nothing was measured") != std::string::npos);
}

TEST_CASE("a diagnosis can be interrupted") {
  DiagnosisOptions options;
  options.interrupted = [] { return true; };
  const Data data = Simulated("--family none --seed 9");
  const auto diagnosis = Diagnose(data.cell, data.table, options);
  REQUIRE_FALSE(diagnosis);
  CHECK(diagnosis.error() == "interrupted");
}

TEST_CASE("the shared examples are diagnosed", "[measured]") {
  const char* folder = std::getenv("PLUMBLINE_MEASURED");
  const fs::path measured = folder != nullptr ? folder : "../shared/measured";
  if (!fs::exists(measured / "example-01")) {
    WARN("SKIPPED: " << measured << " is not there (set PLUMBLINE_MEASURED)");
    return;
  }
  struct Expected {
    const char* set;
    Verdict verdict;
    std::vector<std::string> ids, drivers;
  };
  const std::vector<Expected> expected = {
      {"example-01", Verdict::kUnknown, {"empirical"}, {"t_s"}},
      {"example-02", Verdict::kExplained, {"thermal_growth"}, {}},
      {"example-03", Verdict::kNoEffect, {}, {}},
      {"example-04", Verdict::kExplained, {"joint_compliance"}, {}}};
  for (const Expected& of : expected) {
    CAPTURE(of.set);
    const auto diagnosis = Answer(ReadMeasuredCell((measured / of.set).string()));
    REQUIRE(diagnosis);
    CHECK(diagnosis->verdict == of.verdict);
    CHECK(Ids(*diagnosis) == of.ids);
    CHECK(diagnosis->drivers == of.drivers);
    CHECK(diagnosis->rms_after_m < 1.2 * diagnosis->noise_floor_m);
  }
}

}  // namespace plumbline::diagnose_test
