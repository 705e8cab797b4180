// Rows of two files without a common column: matched rightly or refused, never against evidence.
#include "app/measure/imports/row_order.h"

#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <functional>
#include <random>

namespace plumbline::row_order_test {

using namespace plumbline::measure;

namespace {

/// A session: posture k is taken at times_s[k] and has q1 = k and, when measured, x = 100 k.
struct Session {
  std::vector<double> times_s;
  std::vector<int> measured;  ///< postures in the order of the lines of each file
  std::vector<int> joints;
};

/// How a file shows which posture a line belongs to.
struct Columns {
  std::string number;  ///< "", "number", "name", "step"
  bool time = false;
};

std::string Lines(const Session& session, const std::vector<int>& order, const Columns& columns,
                  const std::string& head, double factor, double clock_s) {
  std::string text = head;
  if (!columns.number.empty()) text += columns.number == "name" ? ",Point" : ",Punkt-Nr.";
  if (columns.time) text += ",time [s]";
  text += '\n';
  for (const int k : order) {
    text += fmt::format("{},{},{}", factor * k + 0.25, 2 * factor + 0.5, 3 * factor + 0.0625);
    if (columns.number == "name") text += fmt::format(",P{:02}", k + 1);
    if (columns.number == "number") text += fmt::format(",{}", k + 1);
    if (columns.number == "step") text += fmt::format(",{}", 10 * (k + 1));
    const auto i = static_cast<std::size_t>(k);
    if (columns.time) text += fmt::format(",{:.4f}", session.times_s[i] + clock_s);
    text += '\n';
  }
  return text;
}

struct Outcome {
  bool refused = false;
  int wrong = 0;
  std::string text;
};

Outcome Match(const Session& session, const Columns& of_measured, const Columns& of_joints) {
  config::FaultList faults;
  ImportOptions options;
  const std::string points =
      Lines(session, session.measured, of_measured, "x_mm,y_mm,z_mm", 100, 5000);
  const std::string joints =
      Lines(session, session.joints, of_joints, "q1_deg,q2_deg,q3_deg", 1, 70);
  const auto rows = [&](const std::string& text, FileRole role, const char* name) {
    return RowsOf(Understand(text, name, role, {}, "", options, faults), options);
  };
  const ImportedTable matched =
      WithJoints(rows(points, FileRole::kMeasured, "points.csv"),
                 rows(joints, FileRole::kJoints, "joints.csv"), "joints.csv", faults);
  Outcome outcome{faults.HasFaults(), 0, config::FaultsText(faults) + points + joints};
  if (outcome.refused) return outcome;
  REQUIRE(matched.rows.size() == session.measured.size());
  for (const RejectedLine& line : matched.rejected) outcome.text += line.reason + '\n';
  INFO(outcome.text);
  for (const ImportedRow& row : matched.rows) {
    REQUIRE((row.numbers.contains("x_mm") && row.numbers.contains("q1_deg")));
    const double point = (row.numbers.at("x_mm") - 0.25) / 100;
    outcome.wrong += std::abs(point - (row.numbers.at("q1_deg") - 0.25)) > 1e-6 ? 1 : 0;
  }
  return outcome;
}

Session RandomSession(std::mt19937& random, int rows) {
  std::uniform_real_distribution<double> pause(5, 30);
  Session session;
  double t_s = 0;
  for (int k = 0; k < rows; ++k) {
    session.times_s.push_back(t_s += pause(random));
    session.measured.push_back(k);
    session.joints.push_back(k);
  }
  return session;
}

}  // namespace

TEST_CASE("lines in any order are matched by what both files show, or refused") {
  std::mt19937 random(21);
  const std::vector<Columns> kinds{{"", false}, {"number", false}, {"name", false}, {"step", false},
                                   {"", true},  {"number", true},  {"name", true},  {"step", true}};
  int tried = 0, refused = 0;
  for (const Columns& of_measured : kinds) {
    for (const Columns& of_joints : kinds) {
      for (int k = 0; k < 12; ++k) {
        Session session = RandomSession(random, 4 + k);
        // The lines of one file are sorted by something else, or rotated, or two are exchanged.
        auto& moved = k % 2 == 0 ? session.measured : session.joints;
        const bool shows = k % 2 == 0 ? !of_measured.number.empty() || of_measured.time
                                      : !of_joints.number.empty() || of_joints.time;
        if (k % 3 == 0) std::ranges::shuffle(moved, random);
        if (k % 3 == 1) std::rotate(moved.begin(), moved.begin() + 1, moved.end());
        if (k % 3 == 2) std::swap(moved[0], moved[2]);
        if (!shows) continue;  // nothing in the files could reveal it
        const Outcome outcome = Match(session, of_measured, of_joints);
        CAPTURE(of_measured.number, of_measured.time, of_joints.number, of_joints.time, k);
        INFO(outcome.text);
        CHECK(outcome.wrong == 0);
        ++tried;
        refused += outcome.refused ? 1 : 0;
        // Times in both files, or numbers of one kind in both, are enough to match; joints that
        // have names, and numbers of two kinds, are not.
        const bool same = of_measured.number == of_joints.number && of_measured.number != "";
        const bool one_kind = of_measured.number.empty() || of_joints.number.empty();
        const bool timed = of_measured.time && of_joints.time && of_joints.number != "name";
        if ((timed && one_kind) || same) {
          CHECK_FALSE(outcome.refused);
        }
      }
    }
  }
  CHECK(tried > 600);
  CHECK(refused > 100);
}

TEST_CASE("files in one order are matched by row where nothing contradicts it") {
  std::mt19937 random(22);
  for (const Columns& of_measured :
       {Columns{"", false}, {"number", false}, {"name", false}, {"", true}, {"step", true}}) {
    for (const Columns& of_joints : {Columns{"", false}, {"number", false}, {"", true}}) {
      if (of_measured.number == "step" && of_joints.number == "number") continue;  // two kinds
      const Outcome outcome = Match(RandomSession(random, 9), of_measured, of_joints);
      INFO(outcome.text);
      CHECK_FALSE(outcome.refused);
      CHECK(outcome.wrong == 0);
    }
  }
}

TEST_CASE("a contradiction names the lines and the ways out") {
  std::mt19937 random(23);
  Session session = RandomSession(random, 5);
  std::swap(session.measured[1], session.measured[3]);
  const Outcome numbers = Match(session, {"number", false}, {"", false});
  CHECK(numbers.refused);
  CHECK_THAT(numbers.text,
             Catch::Contains("joints.csv: the rows of the two files cannot be matched: by the "
                             "numbers of points.csv, which joints.csv lacks, line 3 of points.csv "
                             "belongs to line 5 of joints.csv, not to line 3, but nothing "
                             "confirms that. ") &&
                 Catch::Contains("Number the rows of both files alike") &&
                 Catch::Contains("map the column to \"ignore\""));
  const auto text = [&session](const Columns& of_measured, const Columns& of_joints) {
    return Match(session, of_measured, of_joints).text;
  };
  CHECK_THAT(text({"", true}, {"", false}),
             Catch::Contains("by the times of points.csv, which joints.csv lacks, line 3 of "
                             "points.csv belongs to line 5 of joints.csv, not to line 3, but "
                             "nothing confirms that. "));
  CHECK_THAT(text({"name", false}, {"number", false}),
             Catch::Contains("by the numbers of both files, line 3 of points.csv"));
  CHECK_THAT(text({"number", false}, {"", true}),
             Catch::Contains("but the times agree with the order of the lines. "));
  CHECK_THAT(text({"", true}, {"number", false}),
             Catch::Contains("but the numbers agree with the order of the lines. "));
  std::swap(session.joints[0], session.joints[2]);
  CHECK_THAT(text({"number", false}, {"", true}),
             Catch::Contains("by the numbers of points.csv, which joints.csv lacks, line 3") &&
                 Catch::Contains("but the times show a third order. "));
}

TEST_CASE("columns of joints are known by the names that programs give them") {
  for (const auto& [name, target] : {std::pair{"actual_q_0", ""},
                                     {"actual_q_1", "q1_deg"},
                                     {"iiwa_3_joint", "q3_deg"},
                                     {"panda_joint4", "q4_deg"},
                                     {"joint_2_position", "q2_deg"},
                                     {"Achse 5 Ist", "q5_deg"},
                                     {"joint_2_velocity", ""},
                                     {"target_q_1", ""},
                                     {"actual_qd_1", ""},
                                     {"joint_3_effort", ""},
                                     {"target_joint_1", ""},
                                     {"commanded axis 2", ""},
                                     {"Soll Achse 1", ""},
                                     {"torque joint 3", ""},
                                     {"temperature_joint_1", ""},
                                     {"joint_1_setpoint", ""},
                                     {"Error joint 2", ""},
                                     {"current_joint_2", ""},
                                     {"actual_TCP_pose_1", ""},
                                     {"Punkt-Nr.", "number"},
                                     {"x1", "x_mm"}}) {
    CAPTURE(name);
    CHECK(MeaningsOf({name}, {}).front().target == target);
  }
  const auto targets = [](const std::vector<std::string>& names) {
    std::string text;
    for (const ColumnMeaning& meaning : MeaningsOf(names, {})) text += meaning.target + ' ';
    return text;
  };
  // What distinguishes readings of the same joints is not the name of an arm.
  CHECK(targets({"wish_joint_1", "wish_joint_2", "joint_1", "joint_2"}) == "  q1_deg q2_deg ");
  CHECK(targets({"left_joint_1", "right_joint_1"}) == "  ");
  CHECK(targets({"target_joint_1", "panda_joint1"}) == " q1_deg ");
  CHECK(targets({"q0", "q1", "q2", "q3", "panda_joint1"}) == "qw qx qy qz q1_deg ");
  const auto from_zero = MeaningsOf({"actual_q_0", "actual_q_1"}, {});
  CHECK(from_zero[0].target == "q1_deg");
  CHECK(from_zero[1].target == "q2_deg");
}

TEST_CASE("a column of integers without a name is a number or a fault, not a joint") {
  const auto understand = [](const std::string& text) {
    config::FaultList faults;
    ImportOptions options;
    options.angle_unit = "rad";
    const UnderstoodFile file =
        Understand(text, "j.csv", FileRole::kJoints, {}, "", options, faults);
    return std::pair(file.meanings.front().target, config::FaultsText(faults));
  };
  CHECK(understand("7,0.1,0.2\n3,0.2,0.3\n12,0.3,0.4\n").first == "number");
  CHECK(understand("0,0.1,0.2\n1,0.2,0.3\n2,0.3,0.4\n").first == "number");
  CHECK(understand("1,2,3\n7,8,9\n").first == "q1_deg");  // whole degrees
  CHECK_THAT(understand("0.1,0.2,2\n0.2,0.3,2\n").second,
             Catch::Contains("j.csv:1 column 3: holds only integers (2)"));
  CHECK_THAT(understand("2,0.2,0.1\n2,0.3,0.2\n").second, Catch::Contains("column 1: holds only"));
  CHECK_THAT(understand("-7,0.1,0.2\n3,0.2,0.3\n").second, Catch::Contains("rather than a joint"));
  // A writer that drops trailing zeros writes a parked axis as 90, and one in whole degrees as 7.
  for (const char* parked : {"0.5,90,0.25\n0.75,90,0.125\n", "90,0.5,0.25\n90,0.75,0.125\n",
                             "0.5,0.25,0\n0.75,1.5,0\n", "-7,0.5,0.25\n3,0.75,0.125\n"}) {
    CAPTURE(parked);
    CHECK(understand(parked) == std::pair(std::string("q1_deg"), std::string()));
  }
  CHECK_THAT(understand("7,0.5,0.25\n3,0.75,0.125\n").second,
             Catch::Contains("it may number the rows, or be a joint in whole degrees"));
  CHECK(understand("1,0.5,0.25\n2,0.75,0.125\n").first == "number");
  CHECK(understand("P7,0.5,0.2\nP3,0.7,0.1\n").first == "name");
  CHECK(understand(",0.5,0.2\n3,0.7,0.1\n").first == "q1_deg");  // a reading is lacking
}

}  // namespace plumbline::row_order_test
