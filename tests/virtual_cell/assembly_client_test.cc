// PLC client against a fake daemon with corrections that are known to be right or wrong.
#include "tests/virtual_cell/assembly_client.h"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "tests/virtual_cell/running_cell.h"

namespace virtual_cell::assembly_client_test {
namespace {

/// The daemon's registers 2000+20k with given values; sequence numbers increase with time.
class StandInDaemon {
 public:
  explicit StandInDaemon(const std::vector<TaughtPoint>& points)
      : bank_(2000 + 20 * static_cast<int>(points.size())), server_("127.0.0.1", 0, bank_, 1, 0) {
    for (std::size_t k = 0; k < points.size(); ++k) SetPoint(static_cast<int>(k), points[k]);
    thread_ = std::thread([this] { Run(); });
  }
  ~StandInDaemon() {
    stop_ = true;
    thread_.join();
  }
  std::string where() const { return "127.0.0.1:" + std::to_string(server_.port()); }
  void SetValid(bool valid) { valid_ = valid; }

 private:
  void SetPoint(int k, const TaughtPoint& point) {
    const int base = 2000 + 20 * k;
    bank_.SetWord(base, point.id);
    const Motion command = CommandThatLands(point.X_BO * point.X_OP, point);
    const Vec3 r = VectorFromRotation(command.linear());
    for (int i = 0; i < 3; ++i) {
      bank_.SetFloat(base + 3 + 2 * i, command.translation()[i] * 1e3);
      bank_.SetFloat(base + 9 + 2 * i, DegFromRad(r[i]));
    }
    bank_.SetFloat(base + 15,
                   1e3 * (command.translation() - (point.X_BO * point.X_OP).translation()).norm());
    bank_.SetFloat(base + 17, 0.2);
  }

  /// Numerical inverse of the world: shifts the command by the negative error, iteratively.
  static Motion CommandThatLands(const Motion& wanted, const TaughtPoint& point) {
    const Eigen::Translation3d to_point(point.tool_point_T);
    const World world(DemoCell());
    Motion command = wanted;
    Controller controller(DemoCell(), DemoProgram().home);
    for (int pass = 0; pass < 6; ++pass) {
      REQUIRE(controller.MoveToPose(command * to_point.inverse()) == MoveAnswer::kAccepted);
      controller.Advance(1e3);
      const Motion landed = world.Settle({.q = controller.q(), .payload_kg = 60}).X_WT * to_point;
      command.translation() += wanted.translation() - landed.translation();
      command.linear() = wanted.linear() * landed.linear().transpose() * command.linear();
    }
    return command;
  }

  void Run() {
    for (int cycle = 0; !stop_; ++cycle) {
      for (int base = 2000; base + 20 <= bank_.size(); base += 20) {
        bank_.SetWord(base + 1, valid_ ? 1 : 0);
        if (valid_) bank_.SetWord(base + 19, cycle);
      }
      fd_set readable;
      FD_ZERO(&readable);
      int highest = -1;
      LinkFaults none;
      server_.Watch(readable, highest, 0, none);
      timeval wait{0, 2000};
      if (::select(highest + 1, &readable, nullptr, nullptr, &wait) < 0) FD_ZERO(&readable);
      server_.Serve(readable, 0, none);
    }
  }

  RegisterBank bank_;
  ModbusServer server_;
  std::atomic<bool> stop_ = false, valid_ = true;
  std::thread thread_;
};

AssemblyClientOptions OptionsFor(const RunningCell& cell, const StandInDaemon& daemon) {
  return {.robot = cell.robot(),
          .tracker = cell.tracker(),
          .daemon = daemon.where(),
          .patience_s = 10,
          .settle_s = 0.02,
          .samples = 3};
}

TEST_CASE("with correct corrections both assembly points are reached") {
  MotionProgram program = DemoProgram();
  program.points.resize(2);
  program.points[1].tool_point_T = {0, 0.05, 0.02};
  RunningCell cell({.idle = true, .time_scale = 50});
  StandInDaemon daemon(program.points);
  AssemblyClient client(OptionsFor(cell, daemon), program);
  CHECK(client.HasPoint(2));
  CHECK_FALSE(client.HasPoint(11));
  client.AttachPayload();
  std::vector<Landing> landings;
  for (const TaughtPoint& point : program.points) {
    landings.push_back(client.Visit(point));
    const Landing& landing = landings.back();
    CHECK((landing.wanted_mm - point.X_OP.translation() * 1e3).norm() < 1e-9);
    CHECK(landing.UncorrectedError() > 5);
    CHECK(landing.uncorrected_turn_deg > 0.1);
    CHECK(landing.CorrectedError() < 0.02);
    CHECK(landing.corrected_turn_deg < 0.001);
    CHECK(landing.uncertainty_mm == Approx(0.2));
  }
  CHECK_FALSE(RadiiHold(landings));  // the stand-in states no basis
  for (Landing& landing : landings) landing.basis = 3;
  CHECK(RadiiHold(landings));
  CHECK_THAT(RadiusLines(landings), Catch::Contains("95 % radius 0.20 mm (measured)\n"));
  landings[1].extrapolated = true;
  CHECK_FALSE(RadiiHold(landings));
  landings[1].extrapolated = false;
  const nlohmann::json result = nlohmann::json::parse(LandingJson(landings, 0.5));
  CHECK(result["passed"] == true);
  CHECK(result["points"].size() == 2);
  CHECK(nlohmann::json::parse(LandingJson(landings, 1e-9))["passed"] == false);
  CHECK_THAT(LandingTable(landings), Catch::Contains("assembly 1") && Catch::Contains("+433.0"));
  CHECK_THAT(LandingTable(landings), !Catch::Contains("fitted model"));
  std::vector<Landing> after = landings;
  AddDeclared(LandingJson(landings, 0.5), after);
  CHECK((after[1].declared_mm.value() - landings[1].corrected_mm).norm() < 1e-9);
  CHECK_THAT(LandingTable(after),
             Catch::Contains("declared model") && Catch::Contains("fitted model"));
  CHECK(nlohmann::json::parse(LandingJson(after, 0.5))["points"][0]["declared_error_mm"] ==
        Approx(landings[0].CorrectedError()));
  after[0].id = 77;
  after[0].declared_mm.reset();
  CHECK_THROWS_WITH(AddDeclared(LandingJson(landings, 0.5), after), Catch::Contains("no point 77"));
  CHECK_THROWS_WITH(AddDeclared("{", after), Catch::Contains("the earlier result"));
  CHECK_THAT(LandingCsv(landings), Catch::Contains("2,Z,-76.300,"));
}

TEST_CASE("a point that does not become valid is not commanded") {
  MotionProgram program = DemoProgram();
  program.points.resize(1);
  RunningCell cell({.idle = true, .time_scale = 50});
  StandInDaemon daemon(program.points);
  daemon.SetValid(false);
  AssemblyClientOptions options = OptionsFor(cell, daemon);
  options.patience_s = 1;
  AssemblyClient client(options, program);
  CHECK_THROWS_WITH(client.Visit(program.points[0]), Catch::Contains("did not become valid"));
}

TEST_CASE("an unreachable point is an error with the fault number") {
  MotionProgram program = DemoProgram();
  RunningCell cell({.idle = true, .time_scale = 50});
  StandInDaemon daemon({program.points[0]});
  AssemblyClient client(OptionsFor(cell, daemon), program);
  TaughtPoint far = program.points[0];
  far.X_OP.translation().x() = 9;
  CHECK_THROWS_WITH(client.Visit(far), Catch::Contains("refused with fault 1"));
}

}  // namespace
}  // namespace virtual_cell::assembly_client_test
