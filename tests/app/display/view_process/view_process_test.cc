// plumbline-view and snapshot against the real daemon with a recorded camera; drawn off-screen by
// EGL, in software if there is no GPU.
#include <png.h>

#include <catch2/catch.hpp>
#include <cstdio>

#include "app/base/text/json_text.h"
#include "app/vision/lens_store/lens_store.h"
#include "drivers/display/gl_context.h"
#include "tests/app/cell/daemon/daemon_process.h"
#include "tests/app/cell/daemon/demo_config.h"
#include "tests/app/display/page/browser.h"
#include "tests/app/display/page/exposition.h"
#include "tests/app/display/page/page_client.h"
#include "tests/app/vision/camera/camera_scene.h"
#include "tests/virtual_cell/running_cell.h"

namespace plumbline::view_process_test {

using namespace plumbline::test;
using virtual_cell::RegisterClient;
using virtual_cell::RunningCell;

namespace {

/// Long timeout: three processes and a software renderer may share a loaded machine.
template <typename Condition>
bool Eventually(Condition holds) {
  for (int tries = 0; tries < 6; ++tries) {
    if (virtual_cell::Eventually(holds)) return true;
  }
  return false;
}

bool CanDraw() {
  static const bool can = [] {
    const auto context = display::GlContext::Create();
    if (!context) WARN("SKIPPED: " << context.error());
    return static_cast<bool>(context);
  }();
  return can;
}

virtual_cell::VirtualCellOptions Idle() {
  virtual_cell::VirtualCellOptions options;
  options.profile = virtual_cell::Profile::kUr;
  options.idle = true;
  options.time_scale = 4;
  return options;
}

constexpr const char* kObjects = R"(schema = 1
[[object]]
number = 1
name = "fixture"
file = "fixture.obj"
unit = "mm"
on = { body = "cell" }
colour = [1.0, 0.0, 1.0]
[[object]]
number = 2
name = "part"
file = "fixture.obj"
unit = "mm"
on = { body = "gripper" }
[[pair]]
objects = ["fixture", "part"]
near_mm = 5.0
[[point]]
name = "mark"
on = { frame = "world" }
xyz_mm = [10.0, 20.0, 30.0]
)";
constexpr const char* kCuboid =
    "v -60 -40 -30\nv 60 -40 -30\nv 60 40 -30\nv -60 40 -30\nv -60 -40 30\nv 60 -40 30\nv 60 40 "
    "30\n"
    "v -60 40 30\nf 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

/// A virtual cell, the daemon and a camera that sees the cell and the gripper.
struct Station {
  TemporaryFolder folder;
  ShownImage image{folder.path()};
  std::optional<ShownImage> rear;
  RunningCell cell{Idle()};
  std::optional<DaemonProcess> daemon;
  std::optional<RegisterClient> plc;

  explicit Station(const std::string& overlay = "", bool second = false) {
    const renderer::Camera camera = renderer::ZoomLens(1700);
    std::filesystem::create_directories(folder.path() + "/state");
    for (const char* const serial : {"test camera", "rear camera"}) {
      auto store = vision::LensStore::Open(folder.path() + "/state/lenses.sqlite");
      REQUIRE(store);
      vision::LensEntry entry;
      entry.key = {serial, "test mode", 0, 0};
      entry.lens = test::LensOfCamera(camera);
      entry.covariance.diagonal().head<9>() << 0.04, 0.04, 0.04, 0.04, 1e-9, 1e-9, 1e-12, 1e-12, 0;
      entry.size = {1920, 1080};
      entry.board = "none";
      entry.utc = "2026-01-01T00:00:00Z";
      REQUIRE(store.value().Append(entry));
    }
    image.Show(DrawCell(camera, CellInCamera(), GripperInCamera()));
    if (second) {  // from 0.35 m beside the first
      const Vec3 middle(0, 0, 1.4);
      const Mat3 R = RotationFromVector(Vec3(0.05, 0.25, 0));
      const Pose X_RS{R, middle - R * middle};
      rear.emplace(folder.path() + "/rear");
      rear->Show(DrawCell(camera, X_RS * CellInCamera(), X_RS * GripperInCamera()));
    }
    std::ofstream(folder.path() + "/bodies.toml") << TagsText();
    std::ofstream(folder.path() + "/objects.toml") << kObjects;
    std::ofstream(folder.path() + "/fixture.obj") << kCuboid;
    daemon.emplace(Config(overlay));
    plc.emplace("plumblined", daemon->Plc(), 1, 10);
  }
  std::string Camera(const std::string& serial, const ShownImage& shown,
                     const std::string& name) const {
    return (rear ? "[[camera]]\nname = \"" + name + "\"\n" : std::string("[camera]\n")) +
           "kind = \"recorded\"\npath = \"" + shown.path() + "\"\nrepeat = true\nserial = \"" +
           serial + "\"\nmode = \"test mode\"\nrate_hz = 20.0\n";
  }
  std::string Config(const std::string& overlay) const {
    return WithLine(DemoConfig(cell.robot(), "universal-robots-fine"), "", "state_directory",
                    "\"" + folder.path() + "/state\"") +
           "\n" + Camera("test camera", image, "side") +
           (rear ? Camera("rear camera", *rear, "rear") : "") + "[tags]\nfile = \"" +
           folder.path() +
           "/bodies.toml\"\ncell_xyz_mm = [2000.0, 100.0, 800.0]\n"
           "cell_rpy_deg = [5.729577951308232, 11.459155902616464, 17.188733853924695]\n"
           "[overlay]\nobjects = \"" +
           folder.path() + "/objects.toml\"\n" + overlay;
  }
  bool LensIsValid() {
    return Eventually([&] { return plc->Read(500, 24).Word(0) == 4; });
  }
};

struct Ran {
  int code = -1;
  std::string text;
};

Ran Run(const std::string& command) {
  Ran ran;
  FILE* const pipe = popen((command + " 2>&1").c_str(), "r");
  char line[512];
  while (fgets(line, sizeof line, pipe) != nullptr) ran.text += line;
  const int status = pclose(pipe);
  ran.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return ran;
}

struct Png {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;

  explicit Png(const std::string& file) {
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    REQUIRE(png_image_begin_read_from_file(&image, file.c_str()) != 0);
    image.format = PNG_FORMAT_RGB;
    rgb.resize(PNG_IMAGE_SIZE(image));
    REQUIRE(png_image_finish_read(&image, nullptr, rgb.data(), 0, nullptr) != 0);
    width = static_cast<int>(image.width);
    height = static_cast<int>(image.height);
  }
  /// Number of pixels of a colour.
  int Count(bool (*is)(int r, int g, int b)) const {
    int count = 0;
    for (std::size_t k = 0; k + 2 < rgb.size(); k += 3) count += is(rgb[k], rgb[k + 1], rgb[k + 2]);
    return count;
  }
};

bool IsMagenta(int r, int g, int b) {
  return r > 100 && b > 100 && 3 * g < r;
}
bool IsAmber(int r, int g, int b) {
  return r > 235 && g > 175 && g < 185 && b > 35 && b < 47;
}

std::string Snapshot(const std::string& config, const std::string& arguments) {
  return std::string(PLUMBLINE) + " snapshot " + config + " " + arguments;
}

/// Stores a picture for the manual if PLUMBLINE_KEEP_PICTURES names a folder.
void Keep(const std::string& picture, const std::string& name) {
  const char* const folder = std::getenv("PLUMBLINE_KEEP_PICTURES");
  if (folder == nullptr) return;
  std::filesystem::copy_file(picture, std::string(folder) + "/" + name,
                             std::filesystem::copy_options::overwrite_existing);
}

/// The viewer as a process.
class ViewProcess {
 public:
  ViewProcess(const std::string& config, std::string log) : log_(std::move(log)) {
    pid_ = fork();
    if (pid_ == 0) {
      const int out = open(log_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_APPEND, 0644);
      dup2(out, STDERR_FILENO);
      dup2(out, STDOUT_FILENO);
      const std::string ports = PortFile();
      execl(PLUMBLINE_VIEW, PLUMBLINE_VIEW, config.c_str(), "--port-file", ports.c_str(), nullptr);
      _exit(127);
    }
  }
  ~ViewProcess() {
    if (pid_ <= 0) return;
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  bool Says(const std::string& text) const {
    return Eventually([&] { return FileText(log_).find(text) != std::string::npos; });
  }
  void Signal(int number) const { kill(pid_, number); }
  int Wait() {
    int status = 0;
    if (!Eventually([&] { return waitpid(pid_, &status, WNOHANG) == pid_; })) return -1;
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  std::string Log() const { return FileText(log_); }
  std::string PortFile() const { return log_ + ".ports"; }

 private:
  const std::string log_;
  pid_t pid_ = -1;
};

}  // namespace

TEST_CASE("a snapshot of the running daemon writes the picture and its content as JSON") {
  if (!CanDraw()) return;
  Station station;
  INFO(station.daemon->Log());
  REQUIRE(station.LensIsValid());
  const std::string out = station.folder.path() + "/cell.png";
  const Ran ran =
      Run(Snapshot(station.daemon->ConfigFile(), "--out " + out + " --size 1920x1080 --json"));
  INFO(ran.text);
  REQUIRE(ran.code == 0);
  const Png png(out);
  CHECK(png.width == 1920);
  CHECK(png.height == 1080);
  CHECK(png.Count(IsMagenta) > 2000);  // the fixture is placed on the cell's tags
  CHECK(png.Count(IsAmber) < 500);     // no stale frame
  const auto json = text::JsonOrNull(ran.text);
  CHECK(json.at("stale_because").empty());
  CHECK(json.at("width_px") == 1920);
  CHECK(json.at("panels").at("Objects").back() == "2 of 2 placed");
  CHECK(json.at("panels").at("Lens")[0].get<std::string>().rfind("valid", 0) == 0);
  // Centres about 0.21 m apart; reported to 0.1 mm.
  const std::string distance = json.at("panels").at("Distances")[0];
  REQUIRE_THAT(distance, Catch::StartsWith("fixture / part: ") && !Catch::Contains("not measured"));
  CHECK(std::stod(distance.substr(16)) > 20);
  Keep(out, "cell-1920x1080.png");
  const std::string ask = std::string(PLUMBLINE) + " distance " + station.daemon->ConfigFile();
  const Ran all = Run(ask + " --json");
  INFO(all.text);
  REQUIRE(all.code == 0);
  const auto distances = text::JsonOrNull(all.text);
  CHECK(distances.at("pairs")[0].at("objects") == nlohmann::json{"fixture", "part"});
  CHECK(distances.at("pairs")[0].at("distance_mm").get<double>() > 20);
  CHECK(distances.at("pairs")[0].at("state") == "apart");
  const auto corner = distances.at("points")[0].at("xyz_W_mm");
  CHECK(distances.at("points")[0].at("name") == "mark");
  CHECK(corner[0].get<double>() == Approx(10).margin(1e-6));
  const Ran one = Run(ask + " mark");
  CHECK(one.code == 0);
  CHECK(one.text == "mark: at (10.00, 20.00, 30.00) mm\n");
  const Ran unknown = Run(ask + " mrak");
  CHECK(unknown.code == 1);
  CHECK_THAT(unknown.text,
             Catch::Contains("\"mrak\" is not in the object table; known are: fixture"));
  const std::string small = station.folder.path() + "/small.png";
  REQUIRE(Run(Snapshot(station.daemon->ConfigFile(), "--out " + small + " --size 640x480")).code ==
          0);
  CHECK(Png(small).width == 640);
  Keep(small, "cell-640x480.png");
  CHECK(Run(Snapshot(station.daemon->ConfigFile(), "--out /nonexistent/a.png")).code == 2);
}

TEST_CASE("a snapshot shows both cameras in one picture, or the named one") {
  if (!CanDraw()) return;
  Station station("", true);
  INFO(station.daemon->Log());
  REQUIRE(station.LensIsValid());
  REQUIRE(Eventually([&] { return station.plc->Read(700, 24).Word(0) == 4; }));
  const auto shot = [&](const std::string& name, const std::string& arguments) {
    const std::string out = station.folder.path() + "/" + name + ".png";
    nlohmann::json json;
    // On a loaded machine an image may be late; retry with the next one.
    REQUIRE(Eventually([&] {
      const Ran ran = Run(Snapshot(station.daemon->ConfigFile(),
                                   "--out " + out + " --size 1280x720 --json " + arguments));
      json = text::JsonOrNull(ran.text);
      return ran.code == 0 && json.at("stale_because").empty();
    }));
    Keep(out, name + ".png");
    CHECK(json.at("panels").at("Lens")[0].get<std::string>().rfind("side: valid", 0) == 0);
    CHECK(json.at("panels").at("Lens")[1].get<std::string>().rfind("rear: valid", 0) == 0);
    std::string names;
    for (const auto& camera : json.at("cameras"))
      names += camera.at("name").get<std::string>() + " ";
    return std::pair(names, Png(out).Count(IsMagenta));
  };
  const auto both = shot("both", ""), side = shot("side", "--camera side"),
             rear = shot("rear", "--camera rear");
  CHECK(both.first == "side rear ");
  CHECK(side.first == "side ");
  CHECK(rear.first == "rear ");
  // Both cameras see the cell's tags, which carry the fixture.
  CHECK(side.second > 1000);
  CHECK(rear.second > 1000);
  CHECK(both.second > 500);
  const Ran none = Run(Snapshot(station.daemon->ConfigFile(), "--out a.png --camera top"));
  CHECK(none.code == 2);
  CHECK_THAT(none.text,
             Catch::Contains("--camera top: no such camera; known are: both, side, rear"));
}

TEST_CASE("the example object table is drawn exaggerated and coloured by stress") {
  if (!CanDraw()) return;
  Station station(
      "exaggeration = 30.0\nnominal = \"behind\"\nstress = true\nstress_full_MPa = 20.0\n");
  station.cell.Tell("payload 60");
  REQUIRE(station.LensIsValid());
  for (const char* const name : {"objects.toml", "meshes"}) {
    std::filesystem::copy(std::string("config/") + name, station.folder.path() + "/" + name,
                          std::filesystem::copy_options::recursive |
                              std::filesystem::copy_options::overwrite_existing);
  }
  const std::string out = station.folder.path() + "/example.png";
  const Ran ran =
      Run(Snapshot(station.daemon->ConfigFile(), "--out " + out + " --size 1920x1080 --json"));
  INFO(ran.text);
  REQUIRE(ran.code == 0);
  const auto json = text::JsonOrNull(ran.text);
  CHECK(json.at("panels").at("Objects") == nlohmann::json{"3 of 3 placed"});
  CHECK(json.at("panels").at("Distances").size() == 5);
  for (const auto& line : json.at("panels").at("Distances")) {
    CHECK_THAT(line.get<std::string>(), !Catch::Contains("not measured"));
  }
  Keep(out, "example.png");
}

TEST_CASE("a snapshot with stale data is marked with the reason") {
  if (!CanDraw()) return;
  Station station;
  REQUIRE(station.LensIsValid());
  station.image.Hide();  // no more images
  REQUIRE(Eventually([&] { return (station.plc->Read(500, 24).Word(2) & 2) != 0; }));
  const std::string out = station.folder.path() + "/stale.png";
  const Ran ran = Run(Snapshot(station.daemon->ConfigFile(), "--out " + out));
  INFO(ran.text);
  REQUIRE(ran.code == 0);
  CHECK_THAT(ran.text, Catch::Contains("image"));
  CHECK(Png(out).Count(IsAmber) > 2000);
  CHECK(Png(out).Count(IsMagenta) == 0);
  Keep(out, "stale.png");
}

TEST_CASE("a snapshot fails without a daemon, with a faulty configuration or a wrong size") {
  const TemporaryFolder folder;
  const std::string file = folder.path() + "/plumbline.toml";
  const auto write = [&](const std::string& overlay) {
    std::ofstream(file) << WithLine(DemoConfig("127.0.0.1:1502", "universal-robots-fine"), "",
                                    "state_directory", "\"" + folder.path() + "\"") +
                               "\n[overlay]\n" + overlay;
  };
  write("");
  const Ran size = Run(Snapshot(file, "--out a.png --size 64x48"));
  CHECK(size.code == 2);
  CHECK_THAT(size.text, Catch::Contains("is not a size between 640x480 and 3840x2160"));
  CHECK(Run(Snapshot(file, "")).code == 2);
  CHECK(Run(Snapshot(folder.path() + "/none.toml", "--out a.png")).code == 1);
  if (CanDraw()) {
    const Ran none = Run(Snapshot(file, "--out " + folder.path() + "/a.png"));
    CHECK(none.code == 2);
    CHECK_THAT(none.text, Catch::Contains("plumblined is not running; systemctl start plumbline"));
    CHECK_FALSE(std::filesystem::exists(folder.path() + "/a.png"));
  }
  write("display = \"television\"\n[page]\nlisten = \"0.0.0.0\"\n");
  const Ran faults = Run(Snapshot(file, "--out a.png"));
  CHECK(faults.code == 1);
  CHECK_THAT(faults.text,
             Catch::Contains("overlay.display") && Catch::Contains("requires a token"));
}

TEST_CASE("the viewer follows the daemon's reload and end, and stores alarm pictures") {
  if (!CanDraw()) return;
  Station station;
  const std::string config = station.daemon->ConfigFile();
  ViewProcess view(config, station.folder.path() + "/view.log");
  INFO(view.Log());
  REQUIRE(view.Says("drawing with"));
  REQUIRE(station.daemon->Awaits("fixture.obj: 12 triangles"));
  REQUIRE(station.LensIsValid());
  REQUIRE(Eventually([&] { return station.plc->Read(640, 8).Word(0) == 1; }));
  const auto registers = station.plc->Read(640, 8);
  CHECK(registers.Word(2) == 1);
  CHECK(registers.Word(3) == 2);
  CHECK(registers.Float(4) > 20);
  // The viewer shows a new point of the daemon without a reload of its own.
  station.daemon->Write(station.Config("") +
                        "\n[[point]]\nid = 77\nxyz_mm = [2683.0, 0.0, 973.7]\n"
                        "rpy_deg = [0.0, 90.0, 0.0]\n");
  station.daemon->Signal(SIGHUP);
  REQUIRE(view.Says("plumblined has read its configuration again"));
  // A robot alarm stores the last pictures.
  REQUIRE(Eventually([&] { return (station.plc->Read(12, 1).Word(0)) == 0; }));
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));  // a picture a second is kept
  station.cell.Tell("fault nan on");
  REQUIRE(view.Says("pictures of an alarm stored"));

  // A faulty edit of the object table is reported.
  std::ofstream(station.folder.path() + "/objects.toml") << "schema = 1\nobjct = 1\n";
  REQUIRE(station.daemon->Awaits("objct"));

  view.Signal(SIGHUP);
  REQUIRE(view.Says("reloaded"));
  view.Signal(SIGSTOP);  // the registers do not depend on the viewer
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  CHECK(station.plc->Read(640, 8).Word(0) == 1);
  view.Signal(SIGCONT);
  station.daemon->Signal(SIGTERM);
  REQUIRE(station.daemon->Wait() == 0);
  REQUIRE(view.Says("plumblined closed the connection"));
  view.Signal(SIGTERM);
  CHECK(view.Wait() == 0);
}

TEST_CASE("the viewer's page serves the picture and the state, through reload and daemon loss") {
  if (!CanDraw()) return;
  Station station("exaggeration = 30.0\nnominal = \"behind\"\n[page]\nport = 0\n");
  station.cell.Tell("payload 60");
  for (const char* const name : {"objects.toml", "meshes"}) {
    std::filesystem::copy(std::string("config/") + name, station.folder.path() + "/" + name,
                          std::filesystem::copy_options::recursive |
                              std::filesystem::copy_options::overwrite_existing);
  }
  const std::string config = station.daemon->ConfigFile();
  ViewProcess view(config, station.folder.path() + "/view.log");
  const auto served_port = [&] { return PortIn(view.PortFile(), "page"); };
  REQUIRE(Eventually([&] { return served_port() > 0; }));
  const int port = served_port();
  REQUIRE(port > 0);
  REQUIRE(station.LensIsValid());
  const auto metrics = [&] { return Exposition(Request(port, "/metrics").body); };
  REQUIRE(Eventually([&] { return metrics().Value("plumbline_up") == 1; }));
  CHECK(metrics().problem.empty());
  REQUIRE(Eventually([&] { return metrics().Value("plumbline_cycles_total") > 10; }));
  REQUIRE(Eventually([&] { return metrics().Value("plumbline_payload_kilograms") == 60; }));
  const auto status = [&] { return text::JsonOrNull(Request(port, "/status.json").body); };
  CHECK(status().at("cell") == "KR 210 R2700 extra");
  CHECK(Eventually([&] { return status().at("cameras")[0].at("lens_valid") == true; }));
  CHECK(status().at("points").size() == 2);
  // Pictures are drawn on request of the page.
  PageConnection live(port);
  live.Send("GET /live.mjpg HTTP/1.1\r\nHost: localhost\r\n\r\n");
  CHECK_THAT(live.Read("\xff\xd9\r\n"), Catch::Contains("Content-Type: image/jpeg"));
  if (std::getenv("PLUMBLINE_KEEP_PICTURES") != nullptr && BrowserProgram()) {
    Browser browser(1280, 1100, false, false);
    browser.Open("http://127.0.0.1:" + std::to_string(port) + "/");
    CHECK(browser.Becomes("document.getElementById('picture').naturalWidth > 0"));
    CHECK(browser.Becomes("document.getElementById('panels').innerText.includes('3 of 3 placed')"));
    browser.Becomes("document.getElementById('head').className === 'healthy'");
    browser.Keep("page-real");
  }
  // A new token takes effect on SIGHUP.
  station.daemon->Write(FileText(config) + "token = \"0123456789abcdef\"\n");
  view.Signal(SIGHUP);
  REQUIRE(Eventually([&] { return served_port() != port; }));
  CHECK(view.Says("holds the page's token and is readable by every user of this computer"));
  CHECK(Request(served_port(), "/metrics").status == 401);
  const std::string bearer = "Authorization: Bearer 0123456789abcdef\r\n";
  CHECK(Request(served_port(), "/healthz", bearer).status == 200);
  station.daemon->Signal(SIGTERM);
  REQUIRE(station.daemon->Wait() == 0);
  CHECK(Eventually([&] { return Request(served_port(), "/healthz", bearer).status == 503; }));
  view.Signal(SIGTERM);
  CHECK(view.Wait() == 0);
}

}  // namespace plumbline::view_process_test
