#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "drivers/modbus/word_order.h"
#include "drivers/plc/codec.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::plc_codec_test {

using namespace plumbline::plc;

namespace {

constexpr std::array<std::uint8_t, registers::kCoilsSize> kNoCoils{};

Snapshot SomeSnapshot() {
  Snapshot snapshot;
  snapshot.reading.q = model::JointVector::LinSpaced(6, -1, 1.5);
  snapshot.status = 0x0205;
  snapshot.points.resize(2);
  snapshot.points[1].valid = true;
  snapshot.points[1].code = correction::CorrectionCode::kOk;
  snapshot.points[1].sequence = 777;
  snapshot.points[1].correction.X_BP_command = {RotationFromRollPitchYaw({0.1, 0.2, 0.3}),
                                                Vec3(1.2345678, -0.4, 0.05)};
  snapshot.result.sequence = 4711;
  snapshot.result.valid = true;
  snapshot.result.unix_ms = 1790000000123;
  snapshot.result.correction = snapshot.points[1].correction;
  snapshot.result.correction.X_BP_command.p.y() = -5.0;
  return snapshot;
}

double Read(const std::vector<std::uint16_t>& image, const char* name, bool little = false) {
  for (const MapField& field : registers::Fields()) {
    if (std::string_view(field.name) == name) {
      return ValueOfField(field.type, image, field.address, little);
    }
  }
  FAIL("no field " << name);
  return 0;
}

/// Probability that a normal error with standard deviations (a, b, a) lies within radius r,
/// integrated by the midpoint rule:
///   P(|e| < r) = int phi(z) (1 - exp(-(r^2 - b^2 z^2) / (2 a^2))) dz, |z| < r / b,
/// where z is the error on the middle axis in standard deviations; the squared error on the other
/// two axes together is exponentially distributed.
double ProbabilityWithin(double r, double a, double b) {
  constexpr int kSteps = 10000;
  const double step = 2 * r / b / kSteps;
  double probability = 0;
  for (int k = 0; k < kSteps; ++k) {
    const double z = (k + 0.5) * step - r / b;
    const double density = std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi);
    probability += step * density * (1 - std::exp(-(r * r - b * b * z * z) / (2 * a * a)));
  }
  return probability;
}

}  // namespace

TEST_CASE("no two entries of the map overlap, and each lies in its window") {
  const auto check = [](auto fields, int first, int last) {
    int next = first;
    std::set<std::string_view> names;
    for (const auto& field : fields) {
      CAPTURE(field.name);
      CHECK(field.address >= next);
      const bool narrow = field.type == FieldType::kU16 || field.type == FieldType::kI16;
      next = field.address + (narrow ? 1 : field.type == FieldType::kU64 ? 4 : 2);
      CHECK(next <= last + 1);
      CHECK(names.insert(field.name).second);
    }
  };
  check(registers::Fields(), 0, registers::kMonitoring + registers::kMonitoringSize - 1);
  check(registers::CameraFields(), registers::kCamera,
        registers::kCamera + registers::kCameraSize - 1);
  check(registers::BodyFields(), 0, registers::kBodySize - 1);
  check(registers::PointFields(), 0, registers::kPointSize - 1);
  check(registers::PostureFields(), 0, registers::kPostureSize - 1);
  const auto bodies = registers::kBodySize * status::CameraStatus::kMaxBodies;
  CHECK(registers::kCamera + registers::kCameraSize <= registers::kBodies);
  CHECK(registers::kBodies + bodies <= registers::kScene);
  CHECK(registers::kScene + registers::kSceneSize <= registers::kCamera + registers::kCameraStride);
  CHECK(registers::kBodies + bodies + registers::kCameraStride * (model::kMaxCameras - 1) <=
        registers::kCommands);
  check(registers::SceneFields(), registers::kScene, registers::kScene + registers::kSceneSize - 1);
  CHECK(registers::kScene + registers::kSceneSize <= registers::kMotionLink);
  check(registers::MotionLinkFields(), registers::kMotionLink,
        registers::kMotionLink + registers::kMotionLinkSize - 1);
  CHECK(registers::kMotionLink + registers::kMotionLinkSize <=
        registers::kCamera + registers::kCameraStride);
  CHECK(registers::kCommands + registers::kCommandsSize <= registers::kGauges);
  CHECK(registers::kGauges + registers::kGaugeSize * status::kMaxGauges <= registers::kPoints);
  check(registers::GaugeFields(), 0, registers::kGaugeSize - 1);
  check(registers::Commands(), registers::kCommands,
        registers::kCommands + registers::kCommandsSize - 1);
}

TEST_CASE("a snapshot is encoded as documented in the register map, in both word orders") {
  for (const bool little : {false, true}) {
    PlcEncoder encoder({little, OrientationConvention::kRollPitchYaw}, {11, 12});
    const auto& image = encoder.Encode(SomeSnapshot(), {});
    CHECK(image[0] == 0x504C);
    CHECK(image[2] == (little ? 1 : 0));
    // 1.0f is 0x3F800000.
    CHECK(image[4] == (little ? 0x0000 : 0x3F80));
    CHECK(image[5] == (little ? 0x3F80 : 0x0000));
    CHECK(image[6] == (little ? 0x0304 : 0x0102));
    CHECK(image[11] == 0x0205);
    CHECK(image[100] == 4711);
    CHECK(image[101] == 4711);
    CHECK(image[139] == 4711);
    CHECK(Read(image, "result_x", little) == Approx(1234.5678).epsilon(1e-7));
    CHECK(Read(image, "result_time", little) == 1790000000123);
    CHECK(Read(image, "q1", little) == Approx(-57.29578).epsilon(1e-6));
    CHECK(image[2020] == 12);
    CHECK((image[2021] & registers::kValid) != 0);
    CHECK(image[2039] == 777);
    CHECK((image[2001] & registers::kValid) == 0);
    const auto block = std::span(image).subspan(2020, 20);
    CHECK(ValueOfField(FieldType::kFloat, block, 3, little) == Approx(1234.5678).epsilon(1e-7));
    CHECK(ValueOfField(FieldType::kFloat, block, 9, little) == Approx(0.1 * 180 / M_PI));
    CHECK(ValueOfField(FieldType::kFloat, block, 13, little) == Approx(0.3 * 180 / M_PI));
  }
}

TEST_CASE("a posture is encoded in its own block, in degrees and millimetres") {
  for (const bool little : {false, true}) {
    Snapshot snapshot = SomeSnapshot();
    snapshot.prismatic_joints = 1 << 1;
    PointResult& point = snapshot.points[1];
    point.correction.q = model::JointVector::LinSpaced(12, 0.1, 1.2);
    point.correction.singular_value = 0.25;
    point.posture = {true, true, {1, 0.75}};
    PlcEncoder encoder({little, OrientationConvention::kRollPitchYaw}, {11, 12});
    CHECK(encoder.size() == 22064);
    const auto image = encoder.Encode(snapshot, {});
    const auto block = std::span(image).subspan(22032, 32);
    const auto number = [&](std::size_t offset) {
      return ValueOfField(FieldType::kFloat, block, offset, little);
    };
    CHECK(number(0) == Approx(0.1 * 180 / M_PI));
    CHECK(number(2) == Approx(200));  // mm
    CHECK(number(22) == Approx(1.2 * 180 / M_PI));
    CHECK(block[24] == 7);
    CHECK(block[25] == 2);
    CHECK(number(26) == Approx(750));
    CHECK(number(28) == Approx(0.25));
    CHECK((image[2021] & registers::kPointPostureDiffers) != 0);
    CHECK((image[2001] & registers::kPointPostureDiffers) == 0);
    CHECK(image[22024] == 0);
  }
}

TEST_CASE("a posture is encoded again only if it or its validity has changed") {
  Snapshot snapshot = SomeSnapshot();
  PointResult& point = snapshot.points[1];
  point.correction.q = model::JointVector::Constant(6, 0.5);
  PlcEncoder encoder({}, {11, 12});
  const auto q1 = [&] {
    const auto& image = encoder.Encode(snapshot, {});
    return ValueOfField(FieldType::kFloat, std::span(image).subspan(22032, 32), 0, false);
  };
  CHECK(q1() == Approx(0.5 * 180 / M_PI));
  point.correction.q[0] = 0.7;  // without counting the change in `solutions`
  CHECK(q1() == Approx(0.5 * 180 / M_PI));
  ++point.solutions;
  CHECK(q1() == Approx(0.7 * 180 / M_PI));
  point.valid = false;
  CHECK((encoder.Encode(snapshot, {})[22056] & registers::kPostureValid) == 0);
}

TEST_CASE("an image is copied completely, the gap before the postures as zeros") {
  Snapshot snapshot = SomeSnapshot();
  snapshot.points[1].correction.q = model::JointVector::Constant(6, 0.5);
  PlcEncoder encoder({}, {11, 12});
  const auto image = encoder.Encode(snapshot, {});
  std::vector<std::uint16_t> copy;
  encoder.CopyTo(copy);
  CHECK(copy == image);
  PlcEncoder none({}, {});
  CHECK(none.size() == registers::kPoints);
  none.CopyTo(copy);
  CHECK(copy.size() == registers::kPoints);
}

TEST_CASE("a position beyond int16 saturates and clears its bit; the fine registers hold it") {
  PlcEncoder encoder({}, {1, 2});
  const auto& image = encoder.Encode(SomeSnapshot(), {});
  CHECK((image[202] & registers::kFitsInt16) == 0);
  CHECK(static_cast<std::int16_t>(image[205]) == -32768);
  CHECK(Read(image, "scaled_y_fine") == -5000000);
  CHECK(static_cast<std::int16_t>(image[204]) == 12346);
}

TEST_CASE("the checksum of the result is the Modbus CRC of its registers") {
  PlcEncoder encoder({}, {1, 2});
  Snapshot snapshot = SomeSnapshot();
  const auto image = encoder.Encode(snapshot, {});
  CHECK(image[138] == CrcOfRegisters(std::span(image).subspan(100, 38)));
  snapshot.result.correction.X_BP_command.p.x() += 1e-6;
  CHECK(encoder.Encode(snapshot, {})[138] != image[138]);
  // Published check value: CRC-16/MODBUS of "123456789" is 0x4B37; an even number of bytes here.
  const std::uint16_t registers[] = {0x3132, 0x3334, 0x3536, 0x3738};
  CHECK(CrcOfRegisters(registers) == 0x37DD);
}

TEST_CASE("a float register never holds a value that is not finite") {
  PlcEncoder encoder({}, {1, 2});
  const auto before = encoder.Encode(SomeSnapshot(), {});
  Snapshot broken = SomeSnapshot();
  const double nan = std::nan("");
  broken.result.correction.X_BP_command.p.setConstant(nan);
  broken.points[1].correction.X_BP_command.p.setConstant(std::numeric_limits<double>::infinity());
  broken.points[1].correction.uncertainty_m = 1e300;
  broken.reading.q.setConstant(nan);
  broken.reading.X_BT = Pose{Mat3::Constant(nan), Vec3::Constant(nan)};
  broken.reading.temp_C = nan;
  broken.data_age_s = nan;
  const auto after = encoder.Encode(broken, {});
  CHECK(Read(after, "result_x") == Read(before, "result_x"));
  CHECK(Read(after, "q1") == Read(before, "q1"));
  CHECK((static_cast<int>(Read(after, "input_validity")) & 10) == 0);
  for (const MapField& field : registers::Fields()) {
    if (field.type == FieldType::kFloat) {
      CHECK(std::isfinite(ValueOfField(FieldType::kFloat, after, field.address, false)));
    }
  }
}

TEST_CASE("the camera's registers: state, ages, tip and bodies") {
  PlcEncoder encoder({}, {1, 2});
  PlcEnvironment environment;
  environment.now_s = 100;
  CHECK(encoder.Encode(SomeSnapshot(), environment)[500] == 0);
  CHECK(encoder.Encode(SomeSnapshot(), environment)[527] == 0);
  status::CameraStatus& camera = environment.cameras[0];
  camera.configured = true;
  camera.state = lens::ZoomState::kValid;
  camera.reason = lens::ZoomReason::kTagsGood;
  camera.fiducial_moved = true;
  camera.opencv_prints = true;
  camera.contradicting_tags[0] = 7;
  camera.contradicting_tags[1] = 11;
  camera.contradicting_count = 2;
  camera.prompt = lens::BoardPrompt::kTiltLeft;
  camera.zoom_counts = -70000;
  camera.lens_id = 70001;
  camera.usable_radius_px = 812.9;
  camera.frame_time_s = 99.95;
  camera.tip_valid = true;
  camera.tip_W = Vec3(1.5, -0.25, 0.125);
  camera.tip_covariance_W.diagonal() << 1e-8, 1e-8, 1e-8;
  camera.tip_tag_covariance_W.diagonal() << 0, 3e-8, 0;  // the radius covers both
  camera.tip_time_s = 0;
  camera.bodies_configured = 2;
  camera.bodies[1] = {
      true, true, {RotationFromRollPitchYaw({0, 0, 0.1}), Vec3(0, 2, 0)}, 1e-4, 99.0};
  const auto& image = encoder.Encode(SomeSnapshot(), environment);
  const auto read = [&](const char* name) {
    for (const MapField& field : registers::CameraFields()) {
      if (std::string_view(field.name) == name) {
        return ValueOfField(field.type, image, field.address, false);
      }
    }
    FAIL("no field " << name);
    return 0.0;
  };
  CHECK(read("camera_state") == 4);
  CHECK(read("camera_reason") == static_cast<int>(lens::ZoomReason::kTagsGood));
  CHECK(read("camera_bits") == 32 + 128);
  CHECK(read("contradicting_tags") == 2);
  CHECK(read("contradicting_tag") == 7);
  CHECK(read("board_prompt") == 3);
  CHECK(read("zoom") == -70000);
  CHECK(read("lens") == 70001);
  CHECK(read("lens_usable_radius") == 812);  // rounded down
  CHECK(read("camera_age") == Approx(50).margin(1));
  CHECK(read("zoom_age") == 65535);
  CHECK(read("tip_age") == 65535);
  CHECK(read("tip_y") == -250);
  CHECK(ProbabilityWithin(read("tip_radius"), 0.1, 0.2) == Approx(0.95).margin(1e-3));
  CHECK(read("tip_validity") == 1);
  CHECK(image[540] == 0);
  CHECK(image[541] == 65535);
  CHECK(image[556] == 3);
  CHECK(image[557] == 1000);
  CHECK(ValueOfField(FieldType::kFloat, std::span(image).subspan(556, 16), 4, false) == 2000);
  CHECK(ValueOfField(FieldType::kFloat, std::span(image).subspan(556, 16), 14, false) ==
        Approx(0.1));
  camera.tip_W.x() = std::nan("");
  CHECK(std::isfinite(
      ValueOfField(FieldType::kFloat, encoder.Encode(SomeSnapshot(), environment), 514, false)));
}

TEST_CASE("the second camera has the same blocks 200 registers further, independent of the first") {
  PlcEncoder encoder({}, {1, 2});
  PlcEnvironment environment;
  for (std::size_t k = 0; k < model::kMaxCameras; ++k) {
    status::CameraStatus& camera = environment.cameras[k];
    camera.configured = true;
    camera.name = k == 0 ? status::CameraName::kSide : status::CameraName::kRear;
    camera.state = k == 0 ? lens::ZoomState::kValid : lens::ZoomState::kStale;
    camera.lens_id = static_cast<std::uint32_t>(11 + k);
    camera.bodies_configured = 6;
    camera.bodies[5] = {
        true, false, {Mat3::Identity(), Vec3(1.0 + static_cast<double>(k), 0, 0)}, 1e-4, 0};
  }
  const auto& image = encoder.Encode(SomeSnapshot(), environment);
  CHECK(image[500] == 4);
  CHECK(image[700] == 5);
  CHECK(image[511] == 11);
  CHECK(image[711] == 12);
  CHECK(image[524] == 1);
  CHECK(image[724] == 2);
  CHECK(image[525] == 0);
  CHECK(image[726] == 65535);
  CHECK(ValueOfField(FieldType::kFloat, image, 540 + 80 + 2, false) == 1000);
  CHECK(ValueOfField(FieldType::kFloat, image, 740 + 80 + 2, false) == 2000);
  CHECK(image[640] == 0);  // the virtual objects lie between the two
}

TEST_CASE("the command window is decoded") {
  for (const bool little : {false, true}) {
    const PlcConvention convention{little, OrientationConvention::kAbc};
    std::vector<std::uint16_t> window(registers::kCommandsSize);
    const auto put = [&](int address, float value) {
      const auto pair = modbus::RegistersFromFloat(
          value, little ? modbus::WordOrder::kCdab : modbus::WordOrder::kAbcd);
      window[static_cast<std::size_t>(address - 1000)] = pair[0];
      window[static_cast<std::size_t>(address - 999)] = pair[1];
    };
    window[0] = 2;
    window[1] = 12;
    put(1002, 1000);
    put(1004, -500);
    put(1006, 250);
    put(1008, 90);  // A: about z
    put(1014, 42.5F);
    window[30] = 5;
    window[31] = 1;
    window[39] = 99;
    model::PlcCommand command = PlcCommandFromRegisters(window, kNoCoils, convention);
    CHECK(command.code == model::PlcCommandCode::kCorrectPose);
    CHECK(command.sequence == 99);
    CHECK(command.heartbeat == 5);
    CHECK(command.manual);
    CHECK_FALSE(command.motion_enabled);
    window[31] = 2;
    CHECK(PlcCommandFromRegisters(window, kNoCoils, convention).motion_enabled);
    REQUIRE(command.pose_valid);
    CHECK((command.X_BP.p - Vec3(1, -0.5, 0.25)).norm() < 1e-9);
    CHECK((command.X_BP.R * Vec3::UnitX() - Vec3::UnitY()).norm() < 1e-6);
    CHECK(command.payload_kg == Approx(42.5));
    put(1004, std::numeric_limits<float>::quiet_NaN());
    CHECK_FALSE(PlcCommandFromRegisters(window, kNoCoils, convention).pose_valid);
    window[0] = 3;
    window[20] = static_cast<std::uint16_t>(-1234);
    window[25] = 1571;
    command = PlcCommandFromRegisters(window, kNoCoils, convention);
    REQUIRE(command.pose_valid);
    CHECK(command.X_BP.p.x() == Approx(-0.1234));
    CHECK((command.X_BP.R * Vec3::UnitX() - Vec3::UnitY()).norm() < 1e-3);
  }
}

TEST_CASE("orientations are exchanged as quaternions: x, y, z in place of the angles, w apart") {
  for (const bool little : {false, true}) {
    const PlcConvention convention{little, OrientationConvention::kQuaternion};
    // Turned by 200 degrees, so that the half angle's cosine is negative: the signs are exchanged.
    const Vec3 axis = Vec3(1, 2, -2) / 3;
    const Mat3 R = Eigen::AngleAxisd(200 * kRadPerDeg, axis).toRotationMatrix();
    const double sine = std::sin(100 * kRadPerDeg), w = std::abs(std::cos(100 * kRadPerDeg));
    Snapshot snapshot = SomeSnapshot();
    snapshot.result.correction.X_BP_command.R = R;
    for (PointResult& point : snapshot.points) point.correction.X_BP_command.R = R;
    PlcEncoder encoder(convention, {11, 12});
    const auto& image = encoder.Encode(snapshot, {});
    CHECK(image[3] == 3);
    CHECK(Read(image, "result_rx", little) == Approx(-sine / 3));
    CHECK(Read(image, "result_rz", little) == Approx(2 * sine / 3));
    CHECK(Read(image, "result_qw", little) == Approx(w));
    CHECK(ValueOfField(FieldType::kFloat, image, 2020 + 11, little) == Approx(-2 * sine / 3));
    CHECK(ValueOfField(FieldType::kFloat, image, 22032 + 30, little) == Approx(w));

    std::vector<std::uint16_t> window(registers::kCommandsSize);
    const auto put = [&](int address, double value) {
      const auto pair = modbus::RegistersFromFloat(
          static_cast<float>(value), little ? modbus::WordOrder::kCdab : modbus::WordOrder::kAbcd);
      window[static_cast<std::size_t>(address - 1000)] = pair[0];
      window[static_cast<std::size_t>(address - 999)] = pair[1];
    };
    window[0] = 2;
    put(1002, 1000);
    for (const double sign : {1.0, -1.0}) {  // both mean the same orientation
      put(1008, sign * sine / 3);
      put(1010, sign * sine * 2 / 3);
      put(1012, sign * sine * -2 / 3);
      put(1018, sign * -w);
      const model::PlcCommand command = PlcCommandFromRegisters(window, kNoCoils, convention);
      REQUIRE(command.pose_valid);
      CHECK((command.X_BP.R - R).norm() < 1e-6);
    }
    put(1018, 0.5);  // not of unit length
    CHECK_FALSE(PlcCommandFromRegisters(window, kNoCoils, convention).pose_valid);
    window[0] = 3;  // the scaled pose has a rotation vector in every convention
    CHECK(PlcCommandFromRegisters(window, kNoCoils, convention).pose_valid);
  }
}

TEST_CASE("a probe is decoded from floats and from micrometres, in both word orders") {
  for (const bool little : {false, true}) {
    CAPTURE(little);
    const auto order = little ? modbus::WordOrder::kCdab : modbus::WordOrder::kAbcd;
    std::vector<std::uint16_t> window(registers::kCommandsSize);
    const auto put = [&](int address, std::uint32_t word) {
      const auto pair = modbus::RegistersFromU32(word, order);
      const auto at = static_cast<std::size_t>(address - registers::kCommands);
      window[at] = pair[0];
      window[at + 1] = pair[1];
    };
    const PlcConvention convention{little, OrientationConvention::kRotationVector};
    const auto decoded = [&] { return PlcCommandFromRegisters(window, kNoCoils, convention); };
    window[0] = 6;
    put(1002, std::bit_cast<std::uint32_t>(1234.5F));
    put(1004, std::bit_cast<std::uint32_t>(-0.25F));
    put(1006, std::bit_cast<std::uint32_t>(3000.0F));
    REQUIRE(decoded().probe_W);
    CHECK((*decoded().probe_W - Vec3(1.2345, -0.00025, 3)).norm() < 1e-9);
    put(1004, std::bit_cast<std::uint32_t>(std::nanf("")));
    CHECK_FALSE(decoded().probe_W);

    window[0] = 7;
    put(1032, 1234500);
    put(1034, static_cast<std::uint32_t>(-250));
    put(1036, 3000000);
    REQUIRE(decoded().probe_W);
    CHECK((*decoded().probe_W - Vec3(1.2345, -0.00025, 3)).norm() < 1e-9);
    window[0] = 2;
    CHECK_FALSE(decoded().probe_W);
  }
}

TEST_CASE("a probe with any finite coordinates is passed on; the machine checks its plausibility") {
  std::vector<std::uint16_t> window(registers::kCommandsSize);
  window[0] = 6;
  for (std::size_t at = 2; at < 8; at += 2) {
    const auto words = modbus::RegistersFromU32(std::bit_cast<std::uint32_t>(2147483647.0F),
                                                modbus::WordOrder::kAbcd);
    window[at] = words[0];
    window[at + 1] = words[1];
  }
  const model::PlcCommand command = PlcCommandFromRegisters(window, kNoCoils, {});
  REQUIRE(command.probe_W);
  CHECK(command.probe_W->x() > 2e6);
  CHECK_FALSE(command.pose_valid);
}

TEST_CASE("a refused command clears the pose of the previous result from the registers") {
  PlcEncoder encoder({}, {1, 2});
  Snapshot snapshot = SomeSnapshot();
  snapshot.result.correction.translation_B = Vec3(1e-3, 2e-3, 3e-3);
  snapshot.result.correction.uncertainty_m = 1e-3;
  encoder.Encode(snapshot, {});
  ++snapshot.result.sequence;
  snapshot.result.valid = false;
  snapshot.result.code = correction::CorrectionCode::kProbeImplausible;
  snapshot.result.correction = {};
  const auto& image = encoder.Encode(snapshot, {});
  CHECK(image[101] == 4712);
  CHECK(image[102] == 17);
  CHECK(image[103] == 0);
  for (std::size_t at = 104; at < 130; ++at) CHECK(image[at] == 0);
  CHECK(image[202] == 0);
  for (std::size_t at = 204; at < 218; ++at) CHECK(image[at] == 0);
}

TEST_CASE("probe counters and masters are encoded in the monitoring registers") {
  Snapshot snapshot = SomeSnapshot();
  snapshot.probes.refused = 70001;
  snapshot.probes.fault = ProbeFault::kInMetres;
  snapshot.probes.standstill = true;
  PlcEnvironment environment;
  environment.monitoring.reference_refused = true;
  environment.monitoring.quarantined = 3;
  environment.masters = {0x000A, 49152, 0x0114};
  PlcEncoder encoder({}, {1, 2});
  const auto& image = encoder.Encode(snapshot, environment);
  CHECK(Read(image, "loop_state") == 0xC0);
  CHECK(Read(image, "probes_refused") == 70001);
  CHECK(Read(image, "probes_quarantined") == 3);
  CHECK(Read(image, "probe_fault") == 2);
  CHECK(Read(image, "robot_standstill") == 1);
  CHECK(Read(image, "master_address") == 10);
  CHECK(Read(image, "master_port") == 49152);
  CHECK(Read(image, "other_master") == 0x0114);
}

TEST_CASE("the monitoring status is encoded as floats and as integers") {
  Snapshot snapshot = SomeSnapshot();
  PlcEnvironment environment;
  status::MonitoringStatus& monitoring = environment.monitoring;
  monitoring.recording = monitoring.drift_alarm = true;
  monitoring.probes = 70000;
  monitoring.drift_statistic = 1.234;
  monitoring.residual_m = Vec3(1.25e-3, -0.5e-3, 0.01);
  monitoring.model.applied = 4;
  monitoring.model.declared = 3;
  PlcEncoder encoder({}, {1, 2});
  const auto& image = encoder.Encode(snapshot, environment);
  CHECK(Read(image, "loop_state") == 3);
  CHECK(Read(image, "model_applied") == 4);
  CHECK(Read(image, "result_model") == 4);
  CHECK(Read(image, "model_proposed") == 0);
  CHECK(Read(image, "model_declared") == 3);
  CHECK(Read(image, "probes") == 70000);
  CHECK(Read(image, "drift_statistic") == Approx(1.234));
  CHECK(Read(image, "drift_statistic_scaled") == 123);
  CHECK(Read(image, "residual_x") == Approx(1.25));
  CHECK(Read(image, "residual_x_scaled") == 125);
  CHECK(Read(image, "residual_y_scaled") == -50);
  CHECK(Read(image, "residual_z_scaled") == 1000);
  CHECK(Read(image, "model_fitted") == 0);
  CHECK(Read(image, "model_effects") == 0);
  monitoring.model.fitted = true;
  monitoring.model.effects = 3;
  monitoring.model.proposed = 5;
  const auto& fitted = encoder.Encode(snapshot, environment);
  CHECK(Read(fitted, "model_fitted") == 1);
  CHECK(Read(fitted, "model_effects") == 3);
  CHECK(Read(fitted, "model_proposed") == 5);
  CHECK(Read(fitted, "loop_state") == 7);
}

TEST_CASE(
    "monitoring and camera flags map to one bit each, and monitoring flags are decoded again") {
  using Flag = bool status::MonitoringStatus::*;
  const std::pair<Flag, int> flags[] = {{&status::MonitoringStatus::recording, 0},
                                        {&status::MonitoringStatus::drift_alarm, 1},
                                        {&status::MonitoringStatus::learning, 3},
                                        {&status::MonitoringStatus::diagnosing, 4},
                                        {&status::MonitoringStatus::fault, 5},
                                        {&status::MonitoringStatus::reference_refused, 7},
                                        {&status::MonitoringStatus::radius_contradicted, 9},
                                        {&status::MonitoringStatus::storage_unavailable, 8}};
  for (const auto& [flag, bit] : flags) {
    status::MonitoringStatus status;
    status.*flag = true;
    CHECK(registers::MonitoringWord(status) == 1 << bit);
    const status::MonitoringStatus back =
        registers::MonitoringFlagsFromWord(registers::MonitoringWord(status));
    for (const auto& [other, unused] : flags) CHECK(back.*other == status.*other);
  }
  status::CameraStatus camera;
  CHECK(registers::CameraWord(camera) == 0);
  camera.lens_stale = camera.zoom_unknown = camera.store_fault = true;
  CHECK(registers::CameraWord(camera) == 0x45);
  camera = {};
  camera.camera_lost = camera.board_wanted = camera.fiducials_hidden = true;
  CHECK(registers::CameraWord(camera) == 0x1A);
}

TEST_CASE("gauges: state, latest reading with its age, and name") {
  PlcEncoder encoder({false, OrientationConvention::kRollPitchYaw}, {});
  PlcEnvironment environment;
  environment.now_s = 100;
  status::GaugeStatus& gauge = environment.gauges[1];
  gauge.state = status::GaugeState::kConnecting;
  gauge.artefact = 4;
  gauge.since_s = 40.5;
  gauge.name = {'d', 'i', 'a'};
  const auto read = [&](const char* name, int k) {
    const auto& image = encoder.Encode(SomeSnapshot(), environment);
    for (const MapField& field : registers::GaugeFields()) {
      if (std::string_view(field.name) != name) continue;
      const int address = registers::kGauges + registers::kGaugeSize * k + field.address;
      return ValueOfField(field.type, image, static_cast<std::size_t>(address), false);
    }
    FAIL("no field " << name);
    return 0.0;
  };
  CHECK(read("gauge_state", 0) == 0);
  CHECK(read("gauge_state_age", 0) == 0);
  CHECK(read("gauge_state", 1) == 2);
  CHECK(read("gauge_artefact", 1) == 4);
  CHECK(read("gauge_state_age", 1) == 59);
  CHECK(read("gauge_age", 1) == 4294967295);
  CHECK(read("gauge_name_1", 1) == 0x6469);
  CHECK(read("gauge_name_2", 1) == 0x6100);
  CHECK(read("gauge_name_11", 1) == 0);
  CHECK(read("gauge_outcome", 1) == 0);
  gauge.state = status::GaugeState::kReconnecting;
  gauge.reading_m = -1.25e-4;
  gauge.reading_s = 98.75;
  CHECK(read("gauge_state", 1) == 3);
  CHECK(read("gauge_reading", 1) == Approx(-0.125));
  CHECK(read("gauge_age", 1) == 1250);
  gauge.outcome = status::GaugeOutcome::kRecorded;
  CHECK(read("gauge_outcome", 1) == 1);
}

TEST_CASE("the motion link: state, sizes in mm and counters") {
  PlcEncoder encoder({false, OrientationConvention::kRollPitchYaw}, {});
  PlcEnvironment environment;
  const auto read = [&](const char* name) {
    const auto& image = encoder.Encode(SomeSnapshot(), environment);
    for (const MapField& field : registers::MotionLinkFields()) {
      if (std::string_view(field.name) == name) {
        return ValueOfField(field.type, image, field.address, false);
      }
    }
    FAIL("no field " << name);
    return 0.0;
  };
  CHECK(read("motion_link_state") == 0);
  CHECK(read("motion_link_obstacle") == 1);
  environment.motion_link.state = status::MotionLinkState::kCorrecting;
  environment.motion_link.obstacle = motion_offset::Obstacle::kNone;
  environment.motion_link.offset_m = 0.00125;
  environment.motion_link.wanted_m = 0.0025;
  environment.motion_link.answered = 100000;
  environment.motion_link.foreign = 1;
  environment.motion_link.malformed = 2;
  environment.motion_link.out_of_order = 4;
  environment.motion_link.longest_answer_s = 0.00025;
  CHECK(read("motion_link_state") == 3);
  CHECK(read("motion_link_obstacle") == 0);
  CHECK(read("motion_link_offset") == Approx(1.25));
  CHECK(read("motion_link_wanted") == Approx(2.5));
  CHECK(read("motion_link_answered") == 100000);
  CHECK(read("motion_link_ignored") == 7);
  CHECK(read("motion_link_longest") == 250);
}

TEST_CASE("virtual objects: interference, smallest distance and stale status") {
  PlcEncoder encoder({false, OrientationConvention::kRollPitchYaw}, {});
  PlcEnvironment environment;
  environment.now_s = 100;
  const auto read = [&](const char* name) {
    const auto& image = encoder.Encode(SomeSnapshot(), environment);
    for (const MapField& field : registers::SceneFields()) {
      if (std::string_view(field.name) == name) {
        return ValueOfField(field.type, image, field.address, false);
      }
    }
    FAIL("no field " << name);
    return 0.0;
  };
  CHECK(read("scene_state") == 0);
  CHECK(read("scene_distance") == -1);
  CHECK(read("scene_age") == 65535);
  environment.scene = {.smallest_m = 0.0125, .object_a = 3, .object_b = 17, .time_s = 99.75};
  CHECK(read("scene_state") == 1);
  CHECK(read("scene_object_a") == 3);
  CHECK(read("scene_object_b") == 17);
  CHECK(read("scene_distance") == Approx(12.5));
  CHECK(read("scene_age") == 250);
  // With an unmeasured pair "apart" must not be reported.
  environment.scene.unmeasured = 1;
  CHECK(read("scene_state") == 0);
  CHECK(read("scene_distance") == Approx(12.5));
  CHECK(read("scene_unmeasured") == 1);
  environment.scene.near = 4;
  CHECK(read("scene_near") == 4);
  environment.scene.interferences = 2;
  environment.scene.smallest_m = 0;
  CHECK(read("scene_state") == 2);
  CHECK(read("scene_interferences") == 2);
  environment.now_s = 101;
  CHECK(read("scene_state") == 0);
  CHECK(read("scene_interferences") == 0);
  CHECK(read("scene_near") == 0);
  CHECK(read("scene_object_a") == 0);
  CHECK(read("scene_distance") == -1);
  CHECK(read("scene_age") == 1250);
}

}  // namespace plumbline::plc_codec_test
