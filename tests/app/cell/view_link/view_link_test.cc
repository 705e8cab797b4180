// View link tests over a real socket.
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstring>
#include <fstream>
#include <iterator>

#include "app/cell/view_link/view_client.h"
#include "app/cell/view_link/view_json.h"
#include "app/cell/view_link/view_publisher.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::view_link_test {

using namespace plumbline::cell;

namespace {

/// A state with a non-default value in every field.
ViewState FullState() {
  ViewState state;
  state.now_s = 12.5;
  state.utc_s = 1.7e9;
  state.version = "0.1.0";
  state.cell = "KR 210 \"left\"";
  state.generation = 1'700'000'000'123;
  state.model_version = 3;
  state.status = 0x1009;
  state.alarms = 2;
  state.warnings = 0x100;
  state.health = HealthOf({.alarms = 2, .warnings = 0x100});
  state.data_age_s = 0.004;
  state.q = model::JointVector::LinSpaced(6, -1.5, 2.25);
  state.motion.state = motion::MotionState::kMoving;
  state.motion.age_s = 0.06;
  state.motion.sag = model::JointVector::LinSpaced(6, -1e-4, 2e-4);
  state.motion.acceleration_F = {1, -2, 0.5};
  state.motion.angular_acceleration_F = {0.1, 0.2, 0.3};
  state.motion.tip_acceleration = 3.5;
  state.motion.tip_W = {1e-3, 0, -5e-4};
  state.motion.radius_m = 2e-4;
  state.payload_kg = 80;
  state.temp_C = 31.5;
  state.payload_cog_F = {0.01, -0.02, 0.4};
  ViewPoint point;
  point.id = 7;
  point.valid = point.extrapolated = true;
  point.code = correction::CorrectionCode::kSingular;
  point.X_BP_command.R << 0, 0, 1, 1, 0, 0, 0, 1, 0;  // exact as a quaternion, too
  point.X_BP_command.p = {1.2, -0.4, 0.9};
  point.translation_B = {0.001, 0, 0.004};
  point.uncertainty_m = 2e-4;
  point.basis = model::RadiusBasis::kPropagated;
  point.q = model::JointVector::LinSpaced(6, -1, 1);
  point.taught = point.differs = true;
  state.points = {point};
  status::MonitoringStatus& monitoring = state.monitoring;
  monitoring.recording = monitoring.reference_refused = true;
  monitoring.probes = 120;
  monitoring.quarantined = 2;
  monitoring.reference_learned = 7;
  monitoring.reference_wanted = 20;
  monitoring.drift_statistic = 0.6;
  monitoring.residual_m = Vec3(1e-4, 0, -2e-4);
  monitoring.model.applied = 3;
  monitoring.model.proposed = 4;
  monitoring.model.declared = 1;
  state.cameras.resize(1);
  state.cameras[0].status.name = status::CameraName::kRear;
  state.cameras[0].status.configured = state.cameras[0].status.tip_valid = true;
  state.cameras[0].status.state = lens::ZoomState::kCalibrating;
  state.cameras[0].status.reason = lens::ZoomReason::kBoardStarted;
  state.cameras[0].status.lens_stale = state.cameras[0].status.board_wanted = true;
  state.cameras[0].status.prompt = lens::BoardPrompt::kTiltUpper;
  state.cameras[0].status.board_views = 11;
  state.cameras[0].status.zoom_counts = 4096;
  state.cameras[0].status.lens_id = 2;
  state.cameras[0].status.zoom_time_s = 12.4;
  state.cameras[0].status.tip_W = {1, 2, 3};
  state.cameras[0].status.tip_covariance_W = Vec3(1e-8, 2e-8, 3e-8).asDiagonal();
  state.cycle = {12.5, 0.0007, 1250, 3, {{1200, 40, 10}, 0.03}};
  state.cameras[0].serial = "A-1";
  state.cameras[0].mode = "GREY 8x4@30";
  state.cameras[0].lens = lens::Lens{1700, 1701, 960, 540, -0.1, 0.02, 1e-4, -2e-4, 0.003};
  state.cameras[0].lens->k4 = 0.01;
  state.cameras[0].usable_radius_px = 812.5;
  state.cameras[0].guidance =
      lens::BoardGuidance{{{1, 2}, {3, 4}, {1, 2}}, {{5, 6}}, true, 3, 8, 2, 1, {0.5F, 2}};
  ViewTag tag;
  tag.id = 17;
  tag.corners_px = {lens::Vec2(1, 2), lens::Vec2(3, 2), lens::Vec2(3, 4), lens::Vec2(1, 4)};
  tag.X_CM = point.X_BP_command;
  tag.ambiguous = true;
  state.cameras[0].tags = {tag, {18, tag.corners_px, {}, false}};
  state.cameras[0].bodies = {{"gripper", point.X_BP_command, true}};
  SceneMeasurements& scene = state.scene.emplace();
  scene.time_s = 12.4;
  scene.pairs = {{"gripper", "fixture", 3, 17, scene::Proximity::kInterference,
                  Separation{true, false, 0, {1, 2, 3}, {1, 2, 3}, 0.002, {0, 0, 1}}},
                 {"gripper", "part", 3, 4, scene::Proximity::kApart, {}}};
  scene.distances = {{"gap", 0.25, {1, 2, 3}, {1, 2, 3.25}}};
  scene.points = {{"corner", Vec3(1, 2, 3.25)}, {"hidden", {}}};
  scene.sweeps = {{"approach", SweepResult{true, 0.4, 0, 0, {1, 2, 3}}, "fixture"}};
  state.lines = {{41, 1.7e9, 4, "robot link lost: no answer"}};
  return state;
}

std::vector<std::uint8_t> Ramp(int width, int height) {
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(width * height));
  for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = static_cast<std::uint8_t>(7 * i);
  return pixels;
}

struct Link {
  test::TemporaryFolder folder;
  std::string path = folder.path() + "/view";
  std::unique_ptr<ViewPublisher> publisher = ViewPublisher::Open(path).value();
  ViewClient client{path};

  /// The client connects while it waits for its first state.
  Link() {
    View none;
    REQUIRE_FALSE(client.Read(0, none));
    REQUIRE(publisher->PollViewers());
  }
  void Publish(const std::vector<std::uint8_t>& pixels, int width, std::uint64_t sequence) {
    ViewState state = FullState();
    const int height = static_cast<int>(pixels.size()) / width;
    state.cameras[0].image = publisher->Share(0, {pixels.data(), width, height, width}, nullptr);
    REQUIRE(state.cameras[0].image);
    state.cameras[0].image->sequence = sequence;
    publisher->Send(state);
  }
};

}  // namespace

TEST_CASE("a state is unchanged after encoding and decoding") {
  const ViewState state = FullState();
  const std::string text = JsonOfView(state);
  const auto back = ViewOfJson(text);
  REQUIRE(back);
  CHECK(JsonOfView(*back) == text);
  CHECK(back->cameras[0].tags[1].id == 18);
  CHECK_FALSE(back->cameras[0].tags[1].X_CM);
  const std::string points = JsonOfPoints(state.points);
  const auto points_back = PointsOfJson(points);
  REQUIRE(points_back);
  CHECK(JsonOfPoints(*points_back) == points);
  CHECK(points_back->at(0).X_BP_command.R.isApprox(state.points[0].X_BP_command.R, 1e-12));
  CHECK(points_back->at(0).q == state.points[0].q);
  CHECK(points_back->at(0).basis == model::RadiusBasis::kPropagated);
  CHECK(points_back->at(0).differs);
  CHECK(back->health == state.health);
  CHECK(back->cycle.cycles == 1250);
  CHECK(back->cycle.late == 3);
  CHECK(back->cycle.starts.counts == state.cycle.starts.counts);
  CHECK(back->cycle.starts.sum_s == 0.03);
  CHECK(back->cameras[0].status.frame_time_s == status::CameraStatus::kNever);
  CHECK(back->cameras[0].status.tip_covariance_W == state.cameras[0].status.tip_covariance_W);
}

TEST_CASE("the fuzzer's seeds are a state and points of the present schema") {
  const auto seed = [](const char* name) {
    std::ifstream file(std::string(VIEW_LINK_SEEDS) + name);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  const auto state = ViewOfJson(seed("state"));
  INFO((state ? std::string() : state.error()));
  REQUIRE(state);
  CHECK(JsonOfView(*state) == seed("state"));
  const auto points = PointsOfJson(seed("points"));
  REQUIRE(points);
  CHECK(JsonOfPoints(*points) == seed("points"));
}

TEST_CASE("a malformed text is refused with the reason") {
  std::string text = JsonOfView(FullState());
  using Catch::Contains;
  CHECK_THAT(ViewOfJson("").error(), Contains("cannot be read"));
  const std::string points = JsonOfPoints(FullState().points);
  CHECK_THAT(PointsOfJson(points.substr(0, points.size() / 2)).error(), Contains("cannot be read"));
  CHECK_THAT(PointsOfJson(text).error(), Contains("not a list"));
  CHECK_THAT(ViewOfJson(text.substr(0, text.size() / 2)).error(), Contains("cannot be read"));
  std::string other = text;
  other.replace(other.find("\"schema\":10"), 11, "\"schema\":7");
  CHECK_THAT(ViewOfJson(other).error(), Contains("different versions"));
  std::string senseless = text;
  senseless.replace(senseless.find("\"prompt\":5"), 10, "\"prompt\":99");
  CHECK_THAT(ViewOfJson(senseless).error(), Contains("99 is outside 0..18"));
  for (const char* number : {"4e80", "-1", "0.5", "1000000000000000000000", "\"3\""}) {
    std::string beyond = text;
    beyond.replace(beyond.find("\"late\":3"), 8, std::string("\"late\":") + number);
    INFO(number);
    CHECK_THAT(ViewOfJson(beyond).error(), Contains("whole number"));
  }
}

TEST_CASE("the client receives the newest state with its image") {
  Link link;
  const auto first = Ramp(8, 4);
  auto second = first;
  second[5] = 200;
  link.Publish(first, 8, 1);
  link.Publish(second, 8, 2);
  View view;
  REQUIRE(link.client.Read(1, view));
  CHECK(view.state.cameras[0].image->sequence == 2);
  CHECK(view.pixels[0].bytes == second);
  CHECK(link.client.problem().empty());
  CHECK_FALSE(link.client.Read(0.01, view));  // nothing newer
}

TEST_CASE("a client without images receives states only") {
  Link link;
  ViewClient states(link.path, false);
  View view;
  CHECK_FALSE(states.Read(0, view));
  REQUIRE(link.publisher->PollViewers());
  link.Publish(Ramp(8, 4), 8, 1);
  REQUIRE(states.Read(1, view));
  CHECK(view.state.cameras[0].image->sequence == 1);
  CHECK(view.pixels.empty());
  link.Publish(Ramp(320, 240), 320, 2);
  REQUIRE(states.Read(1, view));
  CHECK(view.state.cameras[0].image->sequence == 2);
  CHECK(view.pixels.empty());
}

TEST_CASE("a larger image needs a new shared memory, which viewers receive") {
  Link link;
  link.Publish(Ramp(8, 4), 8, 1);
  View view;
  REQUIRE(link.client.Read(1, view));
  const auto large = Ramp(320, 240);
  link.Publish(large, 320, 2);
  REQUIRE(link.client.Read(1, view));
  CHECK(view.pixels[0].bytes == large);
}

TEST_CASE("an overwritten image is detected") {
  Link link;
  ViewState state = FullState();
  const auto pixels = Ramp(8, 4);
  const image::LumaView luma{pixels.data(), 8, 4, 8};
  state.cameras[0].image = link.publisher->Share(0, luma, nullptr);
  for (int k = 0; k < ViewPublisher::kSlotsPerCamera; ++k)
    (void)link.publisher->Share(0, luma, nullptr);
  link.publisher->Send(state);
  View view;
  CHECK_FALSE(link.client.Read(0.2, view));
}

TEST_CASE("each camera has its own slots: its image stays valid while the other camera's change") {
  Link link;
  const auto side = Ramp(8, 4);
  auto rear = Ramp(16, 2);
  ViewState state = FullState();
  state.cameras.push_back(state.cameras[0]);
  state.cameras[0].image = link.publisher->Share(0, {side.data(), 8, 4, 8}, nullptr);
  const int memory = link.publisher->memory_number();
  View view;
  for (int k = 0; k < 2 * ViewPublisher::kSlotsPerCamera; ++k) {
    rear[3] = static_cast<std::uint8_t>(100 + k);
    state.cameras[1].image = link.publisher->Share(1, {rear.data(), 16, 2, 16}, nullptr);
    link.publisher->Send(state);
    REQUIRE(link.client.Read(1, view));
    REQUIRE(view.pixels.size() == 2);
    CHECK(view.pixels[0].bytes == side);
    CHECK(view.pixels[1].bytes == rear);
    CHECK(view.state.cameras[1].image->width == 16);
  }
  CHECK(link.publisher->memory_number() == memory);
  // A larger image needs a new memory; images in the previous one are no longer valid.
  const auto large = Ramp(320, 240);
  state.cameras[1].image = link.publisher->Share(1, {large.data(), 320, 240, 320}, nullptr);
  CHECK(link.publisher->memory_number() != memory);
  state.cameras[0].image.reset();
  link.publisher->Send(state);
  REQUIRE(link.client.Read(1, view));
  CHECK(view.pixels[0].bytes.empty());
  CHECK(view.pixels[1].bytes == large);
  state.cameras.push_back(state.cameras[0]);
  CHECK_THAT(ViewOfJson(JsonOfView(state)).error(), Catch::Contains("too many cameras"));
}

TEST_CASE("a viewer cannot write to the shared memory") {
  Link link;
  link.Publish(Ramp(8, 4), 8, 1);
  const int other = socket(AF_UNIX, SOCK_SEQPACKET, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  link.path.copy(address.sun_path, sizeof address.sun_path - 1);
  REQUIRE(connect(other, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0);
  REQUIRE(link.publisher->PollViewers());
  link.Publish(Ramp(8, 4), 8, 2);
  ViewMessage message;
  iovec part{&message, sizeof message};
  alignas(cmsghdr) char control[CMSG_SPACE(ViewMessage::kMaxDescriptors * sizeof(int))] = {};
  msghdr header{};
  header.msg_iov = &part;
  header.msg_iovlen = 1;
  header.msg_control = control;
  header.msg_controllen = sizeof control;
  REQUIRE(recvmsg(other, &header, 0) == sizeof message);
  std::array<int, ViewMessage::kMaxDescriptors> descriptors{};
  REQUIRE(CMSG_FIRSTHDR(&header)->cmsg_len == CMSG_LEN(sizeof descriptors));
  std::memcpy(descriptors.data(), CMSG_DATA(CMSG_FIRSTHDR(&header)), sizeof descriptors);
  for (const int descriptor : descriptors) {  // the state's text, the points', the images
    CHECK(mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0) == MAP_FAILED);
    CHECK(ftruncate(descriptor, 0) != 0);
    CHECK(pwrite(descriptor, "x", 1, 0) < 0);
    close(descriptor);
  }
  close(other);
}

TEST_CASE("a state of any size arrives, whatever the size of a socket's buffer") {
  Link link;
  ViewState state = FullState();
  for (const std::size_t count : {std::size_t{1000}, std::size_t{5000}, std::size_t{20000}}) {
    ViewPoint point = state.points.front();
    state.points.clear();
    for (std::size_t k = 0; k < count; ++k) {
      point.id = static_cast<int>(k + 1);
      state.points.push_back(point);
    }
    state.lines.assign(4000, {1, 1.7e9, 4, std::string(200, 'x')});
    ++state.points_number;
    link.publisher->Send(state);
    View view;
    REQUIRE(link.client.Read(10, view));
    CHECK(view.state.points.size() == count);
    CHECK(view.state.points.back().id == static_cast<int>(count));
    CHECK(view.state.lines.size() == 4000);
  }
}

TEST_CASE("points are sent when they change, to a viewer that came later as well") {
  Link link;
  ViewState state = FullState();
  View view;
  link.publisher->Send(state);
  REQUIRE(link.client.Read(1, view));
  CHECK(view.state.points.at(0).id == 7);
  const std::uint64_t number = view.state.points_number;
  state.alarms = 5;
  state.points[0].id = 8;  // without a new number: neither encoded nor sent
  link.publisher->Send(state);
  REQUIRE(link.client.Read(1, view));
  CHECK(view.state.alarms == 5);
  CHECK(view.state.points.at(0).id == 7);
  CHECK(view.state.points_number == number);
  ViewClient late(link.path);
  View seen;
  CHECK_FALSE(late.Read(0, seen));
  REQUIRE(link.publisher->PollViewers());
  link.publisher->Send(state);
  REQUIRE(late.Read(1, seen));
  CHECK(seen.state.points.at(0).id == 7);
  ++state.points_number;
  link.publisher->Send(state);
  REQUIRE(late.Read(1, seen));
  CHECK(seen.state.points.at(0).id == 8);
  REQUIRE(link.client.Read(1, view));
  CHECK(view.state.points.at(0).id == 8);
  // The lists of two clients are distinguished, also in one View.
  REQUIRE_FALSE(view.state.points_number == seen.state.points_number);
}

TEST_CASE("a viewer that does not read misses states only; a disconnected viewer is dropped") {
  Link link;
  for (std::uint64_t k = 0; k < 5000; ++k) link.Publish(Ramp(8, 4), 8, k);
  CHECK(link.publisher->PollViewers());
  // States that wait in its socket keep few memories open in the system.
  View view;
  ViewClient states(link.path, false);
  CHECK_FALSE(states.Read(0, view));
  REQUIRE(link.publisher->PollViewers());
  ViewState state = FullState();
  for (state.tool = 0; state.tool < 100; ++state.tool) {
    link.publisher->Send(state);
  }
  REQUIRE(states.Read(1, view));
  CHECK(view.state.tool < 10);
  link.Publish(Ramp(8, 4), 8, 5001);
  REQUIRE(states.Read(1, view));
  CHECK(view.state.cameras[0].image->sequence == 5001);
  {
    ViewClient passing(link.path);
    CHECK_FALSE(passing.Read(0, view));
    CHECK(link.publisher->PollViewers());
  }
  CHECK(link.publisher->PollViewers());  // the first one is still connected
}

TEST_CASE("the client reports a missing daemon and reconnects") {
  test::TemporaryFolder folder;
  const std::string path = folder.path() + "/view";
  ViewClient client(path);
  View view;
  CHECK_FALSE(client.Read(0, view));
  CHECK_THAT(client.problem(), Catch::Contains("plumblined is not running"));
  auto publisher = ViewPublisher::Open(path).value();
  for (int k = 0; k < 100 && !client.connected(); ++k) client.Read(0.05, view);
  REQUIRE(publisher->PollViewers());
  publisher->Send(FullState());
  REQUIRE(client.Read(1, view));
  CHECK(view.state.cell == FullState().cell);
  CHECK(view.pixels.at(0).bytes.empty());
  publisher.reset();
  CHECK_FALSE(client.Read(1, view));
  CHECK_FALSE(client.connected());
}

TEST_CASE("an invalid socket path is refused") {
  CHECK_FALSE(ViewPublisher::Open("/no/such/folder/view"));
  CHECK_FALSE(ViewPublisher::Open("/tmp/" + std::string(200, 'x')));
}

}  // namespace plumbline::view_link_test
