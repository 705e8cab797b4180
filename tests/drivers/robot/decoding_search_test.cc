// Search for the decoding of unknown registers: what decides, and what must stay open.
#include "drivers/robot/decoding_search.h"

#include <bit>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <limits>

#include "firmware-like/geometry/units.h"

namespace plumbline::robot {
namespace {

using State = DecodingVerdict::State;

model::Robot Arm(double limit_deg = 360) {
  model::Robot robot;
  const double rows[6][3] = {{0, 90, 0.1273}, {-0.612, 0, 0},   {-0.5723, 0, 0},
                             {0, 90, 0.1639}, {0, -90, 0.1157}, {0, 0, 0.0922}};
  for (const auto& row : rows) {
    model::Joint joint;
    joint.a_m = row[0];
    joint.alpha_rad = row[1] * kRadPerDeg;
    joint.d_m = row[2];
    joint.min = -limit_deg * kRadPerDeg;
    joint.max = limit_deg * kRadPerDeg;
    robot.joints.push_back(joint);
  }
  return robot;
}

model::JointVector Deg(std::initializer_list<double> values) {
  model::JointVector q(static_cast<int>(values.size()));
  int j = 0;
  for (const double value : values) q[j++] = value * kRadPerDeg;
  return q;
}

const model::JointVector kPosture = Deg({12.53, -95.27, 88.4, -61.71, -90.56, 170.13});

void SetFloat(RegisterImage& image, int address, double value, modbus::WordOrder order) {
  image.Set(address, modbus::RegistersFromFloat(static_cast<float>(value), order));
}

RegisterImage FloatImage(const model::JointVector& q, modbus::WordOrder order, int first,
                         double unit = kRadPerDeg, int size = 60) {
  RegisterImage image;
  for (int a = 0; a < size; ++a) image.words[a] = 0;
  for (int j = 0; j < q.size(); ++j) SetFloat(image, first + 2 * j, q[j] / unit, order);
  return image;
}

void SetPose(RegisterImage& image, const kinematics::Chain& chain, const model::JointVector& q,
             int first, modbus::WordOrder order) {
  kinematics::Posture posture;
  chain.Evaluate(q, posture);
  const Vec3 angles = VectorFromRotation(posture.X_BF().R);
  for (int k = 0; k < 3; ++k) {
    SetFloat(image, first + 2 * k, 1e3 * posture.X_BF().p[k], order);
    SetFloat(image, first + 6 + 2 * k, angles[k], order);
  }
}

}  // namespace

TEST_CASE("plausible numbers alone decide nothing") {
  const kinematics::Chain chain(Arm());
  const DecodingVerdict verdict =
      SearchDecoding(chain, {{FloatImage(kPosture, modbus::WordOrder::kCdab, 8)}});
  REQUIRE(verdict.state == State::kUndecided);
  CHECK_THAT(verdict.open, Catch::Contains("--joints") && Catch::Contains("--confirm"));
  CHECK_THAT(TextOf(verdict.candidates.front().joints), Catch::Contains("float32"));
}

TEST_CASE("a pose that moves with its joints decides place, order and unit") {
  const kinematics::Chain chain(Arm());
  for (const modbus::WordOrder order : {modbus::WordOrder::kAbcd, modbus::WordOrder::kCdab,
                                        modbus::WordOrder::kBadc, modbus::WordOrder::kDcba}) {
    for (const double unit : {1.0, kRadPerDeg}) {
      DecodingEvidence evidence;
      const model::JointVector before = kPosture.array() + 8 * kRadPerDeg;
      for (const model::JointVector& q : {before, kPosture}) {
        evidence.images.push_back(FloatImage(q, order, 7, unit));
        SetPose(evidence.images.back(), chain, q, 21, order);
      }
      const DecodingVerdict verdict = SearchDecoding(chain, evidence);
      REQUIRE(verdict.state == State::kDecided);
      const DecodingCandidate& found = verdict.candidates.front();
      CHECK(found.joints.addresses == std::vector{7, 9, 11, 13, 15, 17});
      CHECK(found.joints.order == order);
      CHECK((found.q - kPosture).cwiseAbs().maxCoeff() < 1e-6);
      REQUIRE(found.pose);
      CHECK(found.pose->position == std::array{21, 23, 25});
      CHECK(found.pose->convention == ReportedOrientation::kRotationVector);
      CHECK(found.pose->of_flange);
    }
  }
}

TEST_CASE("joints and pose at standstill may be a stored point") {
  const kinematics::Chain chain(Arm());
  const model::JointVector taught = Deg({-40.2, -70.1, 60.3, -30.5, -88.2, 15.7});
  RegisterImage image = FloatImage(kPosture, modbus::WordOrder::kAbcd, 0, kRadPerDeg, 200);
  for (int j = 0; j < 6; ++j)
    SetFloat(image, 100 + 2 * j, taught[j] / kRadPerDeg, modbus::WordOrder::kAbcd);
  SetPose(image, chain, taught, 112, modbus::WordOrder::kAbcd);
  DecodingEvidence evidence;
  evidence.images = {image, image};
  const DecodingVerdict still = SearchDecoding(chain, evidence);
  CHECK(still.state == State::kUndecided);
  CHECK_THAT(still.open, Catch::Contains("stored point") && Catch::Contains("--watch"));
  REQUIRE_FALSE(still.candidates.empty());
  CHECK(still.candidates.front().joints.addresses.front() == 100);
  evidence.pendant = {{0, kPosture, 0.02}};
  const DecodingVerdict shown = SearchDecoding(chain, evidence);
  REQUIRE(shown.state == State::kDecided);
  CHECK(shown.candidates.front().joints.addresses.front() == 0);
  CHECK_FALSE(shown.candidates.front().pose);
  // The robot stands at the stored point: its joints and the actual ones are equal.
  evidence.images = {image};
  for (int j = 0; j < 6; ++j)
    SetFloat(evidence.images[0], 2 * j, taught[j] / kRadPerDeg, modbus::WordOrder::kAbcd);
  evidence.pendant = {{0, taught, 0.02}};
  const DecodingVerdict reached = SearchDecoding(chain, evidence);
  CHECK(reached.state == State::kUndecided);
  CHECK_THAT(reached.open, Catch::Contains("two places"));
}

TEST_CASE("joints that lead or lag their pose are commanded ones") {
  const kinematics::Chain chain(Arm());
  // A path that turns back; the pose of an arm whose lengths differ from the cell's by `off_m`.
  const auto watched = [&](double lead_s, double off_m, bool known_times = true) {
    model::Robot real = Arm();
    real.joints[1].a_m += off_m;
    real.joints[2].a_m -= off_m;
    const kinematics::Chain other(real);
    const auto at = [](double time_s) {
      model::JointVector q = kPosture;
      for (int j = 0; j < 6; ++j) q[j] += 20 * kRadPerDeg * std::sin(0.3 * time_s + j);
      return q;
    };
    DecodingEvidence evidence;
    evidence.moving = true;
    for (double time_s = 0; time_s < 15; time_s += 0.55) {
      RegisterImage image = FloatImage(at(time_s + lead_s), modbus::WordOrder::kAbcd, 0);
      SetPose(image, other, at(time_s), 20, modbus::WordOrder::kAbcd);
      if (known_times) image.read_s[0] = time_s;
      evidence.images.push_back(image);
    }
    return SearchDecoding(chain, evidence);
  };
  CHECK(watched(0, 0).state == State::kDecided);
  CHECK(watched(0, 0, false).state == State::kDecided);
  CHECK(watched(0, 0.002).state == State::kDecided);  // a calibrated arm
  CHECK(watched(0.005, 0.001).state == State::kDecided);
  for (const double lead_s : {0.05, 0.06, -0.05}) {
    for (const double off_m : {0.0, 0.001}) {
      const DecodingVerdict verdict = watched(lead_s, off_m);
      CAPTURE(lead_s, off_m, verdict.open);
      CHECK(verdict.state == State::kUndecided);
      CHECK_THAT(verdict.open,
                 Catch::Contains(lead_s > 0 ? "joints lead the pose by 0.0" : "joints lag"));
    }
  }
  const DecodingVerdict unknown = watched(0.05, 0, false);
  CHECK(unknown.state == State::kUndecided);
  CHECK_THAT(unknown.open, Catch::Contains("does not show"));
}

TEST_CASE("the time between two requests is no lead") {
  const kinematics::Chain chain(Arm());
  DecodingEvidence evidence;
  evidence.moving = true;
  const auto at = [](double time_s) {
    model::JointVector q = kPosture;
    for (int j = 0; j < 6; ++j) q[j] += 20 * kRadPerDeg * std::sin(0.3 * time_s + j);
    return q;
  };
  for (double time_s = 0; time_s < 15; time_s += 0.55) {
    RegisterImage image = FloatImage(at(time_s), modbus::WordOrder::kAbcd, 0);
    SetPose(image, chain, at(time_s + 0.05), 20, modbus::WordOrder::kAbcd);
    image.read_s = {{0, time_s}, {20, time_s + 0.05}};
    evidence.images.push_back(image);
  }
  CHECK(SearchDecoding(chain, evidence).state == State::kDecided);
}

TEST_CASE("the teach pendant decides, unless its values agree with nothing") {
  const kinematics::Chain chain(Arm());
  DecodingEvidence evidence;
  evidence.images = {FloatImage(kPosture, modbus::WordOrder::kDcba, 3)};
  evidence.pendant = {{0, kPosture, 0.02}};
  CHECK(SearchDecoding(chain, evidence).state == State::kDecided);
  evidence.pendant[0].q[2] += 0.1;
  const DecodingVerdict none = SearchDecoding(chain, evidence);
  CHECK(none.state == State::kNone);
  CHECK_THAT(none.open, Catch::Contains("stated values"));
}

TEST_CASE("without a joint below zero it is open how negative angles are counted") {
  const kinematics::Chain chain(Arm());
  const model::JointVector q = Deg({12.5, 95.3, 88.4, 61.7, 90.6, 170.1});
  DecodingEvidence evidence;
  evidence.images = {FloatImage(q, modbus::WordOrder::kAbcd, 0)};
  evidence.pendant = {{0, q, 0.02}};
  const DecodingVerdict verdict = SearchDecoding(chain, evidence);
  CHECK(verdict.state == State::kUndecided);
  CHECK_THAT(verdict.open, Catch::Contains("below zero"));
}

TEST_CASE("angles modulo one turn, with the registers of whole turns") {
  const kinematics::Chain chain(Arm());
  RegisterImage image;
  for (int a = 0; a < 200; ++a) image.words[a] = 0;
  for (int j = 0; j < 6; ++j) {
    const double turn = 2 * std::numbers::pi;
    const double turns = std::floor(kPosture[j] / turn);
    image.words[70 + j] =
        static_cast<std::uint16_t>(std::lround(1e3 * (kPosture[j] - turns * turn)));
    image.words[120 + j] = static_cast<std::uint16_t>(static_cast<std::int16_t>(turns));
  }
  DecodingEvidence evidence;
  evidence.images = {image};
  evidence.pendant = {{0, kPosture, 0.02}};
  const DecodingVerdict verdict = SearchDecoding(chain, evidence);
  REQUIRE(verdict.state == State::kDecided);
  const JointDecoding& joints = verdict.candidates.front().joints;
  CHECK(joints.addresses.front() == 70);
  CHECK(joints.wrap == JointWrap::kRevolutions);
  CHECK(joints.revolutions.front() == 120);
  CHECK(joints.type == RegisterType::kUint16);
}

TEST_CASE("registers that leave out whole turns do not equal the teach pendant") {
  model::JointVector shown = kPosture;
  shown[5] = 200 * kRadPerDeg;
  model::JointVector counted = shown;
  counted[5] -= 2 * std::numbers::pi;
  const kinematics::Chain chain(Arm());
  DecodingEvidence evidence;
  evidence.images = {FloatImage(counted, modbus::WordOrder::kAbcd, 0)};
  evidence.pendant = {{0, shown, 0.02}};
  const DecodingVerdict verdict = SearchDecoding(chain, evidence);
  CHECK(verdict.state == State::kUndecided);
  CHECK_THAT(verdict.open, Catch::Contains("modulo one turn"));
}

TEST_CASE("angles modulo one turn need one row of whole turns, or an arm within half a turn") {
  const auto scan = [](double limit_deg, const std::vector<int>& rows, bool flags = false) {
    const kinematics::Chain chain(Arm(limit_deg));
    RegisterImage image;
    for (int a = 0; a < 200; ++a) image.words[a] = 0;
    for (int j = 0; j < 6; ++j) {
      const double turn = 2 * std::numbers::pi;
      const double turns = std::floor(kPosture[j] / turn);
      image.words[70 + j] =
          static_cast<std::uint16_t>(std::lround(1e3 * (kPosture[j] - turns * turn)));
      for (const int row : rows)
        image.words[row + j] = static_cast<std::uint16_t>(static_cast<std::int16_t>(turns));
    }
    for (int a = 130; flags && a < 136; ++a) image.words[a] = 1;
    DecodingEvidence evidence;
    evidence.images = {image};
    evidence.pendant = {{0, kPosture, 0.06}};
    return SearchDecoding(chain, evidence);
  };
  CHECK(scan(360, {120}).state == State::kDecided);
  CHECK(scan(360, {120, 140}).state == State::kUndecided);
  CHECK(scan(360, {}).state == State::kUndecided);
  CHECK(scan(360, {120}, true).state == State::kUndecided);
  const DecodingVerdict within = scan(178, {});
  REQUIRE(within.state == State::kDecided);
  CHECK(within.candidates.front().joints.wrap == JointWrap::kPi);
}

namespace {

model::Robot Gantry() {
  model::Robot robot;
  for (const double alpha : {90.0, -90.0, 0.0}) {
    model::Joint joint;
    joint.type = model::JointType::kPrismatic;
    joint.alpha_rad = alpha * kRadPerDeg;
    joint.min = 0;
    joint.max = 2;
    robot.joints.push_back(joint);
  }
  return robot;
}

}  // namespace

TEST_CASE("an arm whose joints cannot be below zero is decided by the pendant, in millimetres") {
  const kinematics::Chain chain(Gantry());
  model::JointVector q(3), off(3);
  q << 0.5125, 1.25025, 0.803;
  off << 0.500, 1.240, 0.790;
  DecodingEvidence evidence;
  evidence.images = {FloatImage(q, modbus::WordOrder::kAbcd, 4, 1e-3)};
  evidence.pendant = {{0, q, 0.02}};
  const DecodingVerdict verdict = SearchDecoding(chain, evidence);
  INFO(verdict.open);
  REQUIRE(verdict.state == State::kDecided);
  CHECK(verdict.candidates.front().joints.addresses.front() == 4);
  evidence.pendant = {{0, off, 1.1}};
  CHECK(SearchDecoding(chain, evidence).state == State::kNone);
}

TEST_CASE("a search is bounded, and ends when it is stopped") {
  const kinematics::Chain chain(Arm());
  RegisterImage image;
  for (int a = 0; a < 4000; ++a) image.words[a] = static_cast<std::uint16_t>(37 * a % 3600 + 1);
  DecodingEvidence evidence;
  evidence.images = {image};
  CHECK(SearchDecoding(chain, evidence, {1000, 50000, {}}).open.starts_with("too many registers"));
  int polls = 0;
  const auto stop = [&polls] { return ++polls > 3; };
  CHECK_THAT(SearchDecoding(chain, evidence, {16384, 50000, stop}).open,
             Catch::Contains("--range"));
  CHECK(polls < 100);
}

TEST_CASE("moves of every axis find joints at addresses without a rule") {
  const kinematics::Chain chain(Arm());
  const int places[] = {3, 6, 12, 15, 22, 24};
  DecodingEvidence evidence;
  model::JointVector q = kPosture;
  const auto add = [&] {
    RegisterImage image;
    for (int a = 0; a < 40; ++a) image.words[a] = static_cast<std::uint16_t>(37 * a);
    for (int j = 0; j < 6; ++j) {
      const auto count = static_cast<std::int32_t>(std::lround(1e3 * kDegPerRad * q[j]));
      image.Set(places[j], modbus::RegistersFromU32(static_cast<std::uint32_t>(count),
                                                    modbus::WordOrder::kCdab));
    }
    evidence.images.push_back(image);
  };
  add();
  for (int j = 0; j < 6; ++j) {
    evidence.moves.push_back({evidence.images.size() - 1, j, 10 * kRadPerDeg});
    q[j] += 10.1 * kRadPerDeg;
    add();
  }
  const DecodingVerdict verdict = SearchDecoding(chain, evidence);
  INFO(verdict.open);
  REQUIRE(verdict.state == State::kDecided);
  const JointDecoding& joints = verdict.candidates.front().joints;
  CHECK(joints.addresses == std::vector<int>(std::begin(places), std::end(places)));
  CHECK(joints.order == modbus::WordOrder::kCdab);
  CHECK(joints.unit->text == std::string("0.001 deg"));
}

TEST_CASE("two rows with the same joints stay open") {
  const kinematics::Chain chain(Arm());
  DecodingEvidence evidence;
  RegisterImage image = FloatImage(kPosture, modbus::WordOrder::kAbcd, 0);
  for (int j = 0; j < 6; ++j)
    SetFloat(image, 30 + 2 * j, kPosture[j] / kRadPerDeg, modbus::WordOrder::kAbcd);
  evidence.images = {image};
  evidence.pendant = {{0, kPosture, 0.02}};
  const DecodingVerdict verdict = SearchDecoding(chain, evidence);
  CHECK(verdict.state == State::kUndecided);
  CHECK_THAT(verdict.open, Catch::Contains("two places"));
}

TEST_CASE("round values read one register earlier are the same place") {
  const kinematics::Chain chain(Arm());
  const model::JointVector home = Deg({12.5, -35, -20, 30, -40, 60});
  for (const auto& [order, first] :
       {std::pair(modbus::WordOrder::kAbcd, 10), std::pair(modbus::WordOrder::kCdab, 11)}) {
    DecodingEvidence evidence;
    evidence.images = {FloatImage(home, order, first)};
    evidence.pendant = {{0, home, 0.02}};
    const DecodingVerdict still = SearchDecoding(chain, evidence);
    REQUIRE(still.state == State::kUndecided);
    CHECK_THAT(still.open, Catch::Contains("not round") && Catch::Contains("float32 ABCD") &&
                               Catch::Contains("float32 CDAB"));
    CHECK(still.candidates.size() == 2);

    const auto confirmed = [&](double by_deg) {
      DecodingEvidence moves;
      model::JointVector q = home;
      moves.images = {FloatImage(q, order, first)};
      for (int j = 0; j < 6; ++j) {
        moves.moves.push_back({moves.images.size() - 1, j, 10 * kRadPerDeg});
        q[j] += by_deg * kRadPerDeg;
        moves.images.push_back(FloatImage(q, order, first));
      }
      return SearchDecoding(chain, moves);
    };
    const DecodingVerdict by_round = confirmed(10);
    CHECK(by_round.state == State::kUndecided);
    CHECK_THAT(by_round.open, Catch::Contains("not round"));
    const DecodingVerdict moved = confirmed(10.013);
    INFO(moved.open);
    REQUIRE(moved.state == State::kDecided);
    CHECK(moved.candidates.front().joints.addresses.front() == first);
    CHECK(moved.candidates.front().joints.order == order);
  }
}

TEST_CASE("empty registers hold no joints") {
  const kinematics::Chain chain(Arm());
  RegisterImage image;
  for (int a = 0; a < 300; ++a) image.words[a] = 0;
  CHECK(SearchDecoding(chain, {{image}}).state == State::kNone);
  CHECK(SearchDecoding(chain, {}).state == State::kNone);
}

namespace {

RobotProfile Profile() {
  RobotProfile profile;
  profile.blocks = {{RegisterTable::kHolding, 0, 12}};
  for (int j = 0; j < 6; ++j) {
    JointSignal joint;
    joint.value = {RegisterTable::kHolding,  2 * j,      RegisterType::kFloat32,
                   modbus::WordOrder::kAbcd, kRadPerDeg, 0};
    profile.joints.push_back(joint);
  }
  return profile;
}

}  // namespace

TEST_CASE("the smallest change of a profile that makes its joints plausible") {
  const kinematics::Chain chain(Arm());
  struct Case {
    RegisterImage image;
    const char *what, *change;
  };
  const Case cases[] = {
      {FloatImage(kPosture, modbus::WordOrder::kCdab, 0), "words are swapped: word order CDAB",
       "word_order = \"CDAB\""},
      {FloatImage(kPosture, modbus::WordOrder::kDcba, 0), "word order DCBA gives",
       "word_order = \"DCBA\""},
  };
  for (const Case& one : cases) {
    const auto remedies = RemediesOf(Profile(), chain, one.image, {});
    REQUIRE_FALSE(remedies.empty());
    CHECK_THAT(remedies.front().what, Catch::Contains(one.what) &&
                                          Catch::Contains("plausible joints (12.53, -95.27, 88.4"));
    CHECK(remedies.front().change == one.change);
  }
  CHECK(RemediesOf(Profile(), chain, RegisterImage{}, {}).empty());
}

TEST_CASE("a profile that gives most joints rightly is not changed for the others") {
  const auto remedies = [](const model::JointVector& q, double limit_deg) {
    const kinematics::Chain chain(Arm(limit_deg));
    return RemediesOf(Profile(), chain, FloatImage(q, modbus::WordOrder::kAbcd, 0), {});
  };
  const model::JointVector q = Deg({12.5, -95.25, 88, -61.75, -90.5, 170.125});
  model::JointVector without = q, beyond = q;
  without[2] = std::numeric_limits<double>::quiet_NaN();
  beyond[5] = 380 * kRadPerDeg;
  CHECK(remedies(without, 360).empty());
  CHECK(remedies(beyond, 360).empty());
  CHECK(remedies(q, 120).empty());  // joint 6 beyond the limits of a smaller arm
}

TEST_CASE("a remedy never changes the type: any word is an integer") {
  const kinematics::Chain chain(Arm());
  RobotProfile profile = Profile();
  for (JointSignal& joint : profile.joints) joint.value.type = RegisterType::kInt32;
  const auto remedies =
      RemediesOf(profile, chain, FloatImage(kPosture, modbus::WordOrder::kAbcd, 0), {});
  for (const ProfileRemedy& one : remedies) CHECK_THAT(one.change, !Catch::Contains("type ="));
}

TEST_CASE("no other integers are proposed where the registers hold floats") {
  const kinematics::Chain chain(Arm());
  RobotProfile profile = Profile();
  for (JointSignal& joint : profile.joints) {
    joint.value.type = RegisterType::kInt32;
    joint.value.scale = 1e-3;
  }
  // Round floats in swapped words are small integers: 12.5 is 16712.
  for (const auto order : {modbus::WordOrder::kCdab, modbus::WordOrder::kAbcd}) {
    for (const auto& q : {Deg({12.5, -35, -20, 30, -40, 60}), kPosture})
      CHECK(RemediesOf(profile, chain, FloatImage(q, order, 0), {}).empty());
  }
  RegisterImage swapped;
  for (int j = 0; j < 6; ++j) {
    const auto count = static_cast<std::int32_t>(std::lround(1e3 * kPosture[j]));
    swapped.Set(2 * j, modbus::RegistersFromU32(static_cast<std::uint32_t>(count),
                                                modbus::WordOrder::kCdab));
  }
  const auto remedies = RemediesOf(profile, chain, swapped, {});
  REQUIRE_FALSE(remedies.empty());
  CHECK(remedies.front().change == "word_order = \"CDAB\"");
}

TEST_CASE("a reported pose decides between changes of a profile") {
  const kinematics::Chain chain(Arm());
  RegisterImage image = FloatImage(kPosture, modbus::WordOrder::kAbcd, 1);
  SetPose(image, chain, kPosture, 20, modbus::WordOrder::kAbcd);
  RobotProfile profile = Profile();
  PoseSignal pose;
  for (int k = 0; k < 3; ++k) {
    const auto place = static_cast<std::size_t>(k);
    pose.position[place] = {RegisterTable::kHolding,  20 + 2 * k, RegisterType::kFloat32,
                            modbus::WordOrder::kAbcd, 1e-3,       0};
    pose.orientation[place] = {RegisterTable::kHolding,  26 + 2 * k, RegisterType::kFloat32,
                               modbus::WordOrder::kAbcd, 1,          0};
  }
  profile.tcp = pose;
  profile.blocks[0].count = 32;
  const auto remedies = RemediesOf(profile, chain, image, {});
  REQUIRE(remedies.size() == 1);
  CHECK_THAT(remedies.front().what, Catch::Contains("address + 1 gives plausible joints") &&
                                        Catch::Contains("agree with the tool pose"));
}

TEST_CASE("blocks stay within what one request may read") {
  RegisterImage image;
  for (int a = 0; a < 40; ++a) image.words[a] = 0;
  image.words.erase(20);
  image.starts.insert(30);
  const auto blocks = BlocksFor({{0, 2}, {2, 2}, {18, 2}, {22, 2}, {28, 2}, {30, 2}}, image, 12);
  CHECK(blocks == std::vector<RegisterBlock>{{RegisterTable::kHolding, 0, 4},
                                             {RegisterTable::kHolding, 18, 2},
                                             {RegisterTable::kHolding, 22, 8},
                                             {RegisterTable::kHolding, 30, 2}});
}

}  // namespace plumbline::robot
