// Fixture for view_bench: the real daemon, one or two recorded cameras that see reference tags and
// gripper, two meshes of 50,000 triangles, and the viewer in a separate process.
#pragma once

#include <cmath>
#include <csignal>
#include <filesystem>

#include "app/cell/view_link/view_client.h"
#include "app/vision/lens_store/lens_store.h"
#include "drivers/clock.h"
#include "tests/app/cell/scene/shapes.h"
#include "tests/app/vision/camera/camera_scene.h"
#include "tests/bench/daemon_start.h"

namespace plumbline::bench {

/// Placeholder in the configuration for the card.
inline constexpr std::string_view kCard = "/dev/dri/card0";
inline constexpr double kFrames_Hz = 30;

/// Times of a shown frame, relative to its capture [ms].
struct ShownFrame {
  double received = 0;   ///< its tags have been tracked and the state was received
  double begun = 0;      ///< drawing of its picture has started
  double committed = 0;  ///< the picture was passed to the card
  double flipped = 0;
};

/// Proportional set size [MB]. @return 0 if the process is gone
inline double PssMb(pid_t pid) {
  std::ifstream file(fmt::format("/proc/{}/smaps_rollup", pid));
  std::string word;
  double kb = 0;
  while (file >> word) {
    if (word == "Pss:" && file >> kb) return kb / 1024;
  }
  return 0;
}

/// Children of all threads of the process.
inline std::vector<pid_t> ChildrenOf(pid_t pid) {
  std::vector<pid_t> children;
  std::error_code error;
  const std::string tasks = fmt::format("/proc/{}/task", pid);
  for (const auto& task : std::filesystem::directory_iterator(tasks, error)) {
    std::ifstream file(task.path() / "children");
    for (pid_t child = 0; file >> child;) children.push_back(child);
  }
  return children;
}
inline bool HasChildren(pid_t pid) {
  return !ChildrenOf(pid).empty();
}

/// Proportional set size of the process and its children [MB].
inline double PssOfAllMb(pid_t pid) {
  double sum_mb = PssMb(pid);
  for (const pid_t child : ChildrenOf(pid)) sum_mb += PssMb(child);
  return sum_mb;
}

class ViewStation {
 public:
  ViewStation(const std::string& folder, const char* program, int cameras) : folder_(folder) {
    robot_.SetPayload(60000);
    std::filesystem::create_directories(folder + "/state");
    std::string tables;
    for (int k = 0; k < cameras; ++k) tables += AddCamera(k == 0 ? "side" : "rear", k);
    std::ofstream(folder + "/bodies.toml") << test::TagsText();
    std::ofstream(folder + "/ball.obj")
        << test::MeshFileText(test::Sphere(0.1F, 160, 158), cell::MeshFormat::kObj);
    std::ofstream(folder + "/objects.toml")
        << "schema = 1\n[[object]]\nnumber = 1\nname = \"fixture\"\nfile = \"ball.obj\"\n"
           "unit = \"m\"\non = { body = \"cell\" }\n[[object]]\nnumber = 2\nname = \"part\"\n"
           "file = \"ball.obj\"\nunit = \"m\"\non = { frame = \"flange\" }\nbends = true\n"
           "xyz_mm = [0.0, 0.0, 800.0]\n[[pair]]\nobjects = [\"fixture\", \"part\"]\n";
    std::ofstream(folder + "/profile.toml") << kProfile;
    std::ofstream(folder + "/plumbline.toml") << fmt::format(
        "cell = \"{1}/tests/virtual_cell/demo/cockpit-cell.toml\"\nstate_directory = "
        "\"{0}/state\"\n"
        "[robot]\nprofile = \"{0}/profile.toml\"\nhost = \"127.0.0.1\"\nport = {2}\n[payload]\n"
        "source = \"robot\"\n[plc]\nlisten = \"127.0.0.1\"\nport = 0\n[[point]]\nid = 1\n"
        "xyz_mm = [2683.0, -424.0, 973.7]\nrpy_deg = [0.0, 90.0, 0.0]\n{3}[tags]\nfile = "
        "\"{0}/bodies.toml\"\ncell_xyz_mm = [2000.0, 100.0, 800.0]\ncell_rpy_deg = [5.7, 11.4, "
        "17.1]\n[overlay]\nobjects = \"{0}/objects.toml\"\ndisplay = \"kms\"\ndevice = \"{4}\"\n",
        folder, std::filesystem::current_path().string(), robot_.port(), tables, kCard);
    daemon_ = StartDaemon(program, folder);
  }
  ~ViewStation() { daemon_.process.End(20, SIGTERM); }
  ViewStation(const ViewStation&) = delete;
  ViewStation& operator=(const ViewStation&) = delete;

  /// Starts this program as the viewer. @param nice  of the process; the systemd unit uses 10
  os::ChildProcess StartViewer(int nice) const {
    std::filesystem::remove(folder_ + "/shown");
    return StartProgram({"/proc/self/exe", "--viewer", folder_ + "/plumbline.toml"},
                        folder_ + "/view.log", {.output = folder_ + "/shown", .nice = nice});
  }
  static void Stop(os::ChildProcess& viewer) { viewer.End(20, SIGTERM); }
  /// Stops the viewer. @return the frames that it showed
  std::vector<ShownFrame> EndViewer(os::ChildProcess& viewer) const {
    Stop(viewer);
    std::ifstream file(folder_ + "/shown");
    std::vector<ShownFrame> shown;
    for (ShownFrame one; file >> one.received >> one.begun >> one.committed >> one.flipped;) {
      shown.push_back(one);
    }
    return shown;
  }

  /// Start lateness of the control cycle so far, as counted by the daemon. Connects only briefly.
  LatenessHistogram Starts() const {
    cell::ViewClient client(cell::ViewSocketOf(folder_ + "/state"), false);
    cell::View view;
    for (const double until_s = MonotonicSeconds() + 5; MonotonicSeconds() < until_s;) {
      if (client.Read(0.1, view)) return view.state.cycle.starts;
    }
    fmt::print(stderr, "the daemon reports no state; its log:\n{}",
               test::FileText(folder_ + "/log"));
    std::exit(1);
  }
  pid_t daemon() const { return daemon_.process.pid(); }
  const std::string& folder() const { return folder_; }

 private:
  /// The rear camera is 0.35 m beside the side one; both see the same scene.
  std::string AddCamera(const std::string& name, int k) {
    const renderer::Camera camera = renderer::ZoomLens(1700);
    const std::string serial = name + " camera";
    auto store = vision::LensStore::Open(folder_ + "/state/lenses.sqlite");
    vision::LensEntry lens;
    lens.key = {serial, "test mode", 0, 0};
    lens.lens = test::LensOfCamera(camera);
    lens.covariance.diagonal().head<9>() << 0.04, 0.04, 0.04, 0.04, 1e-9, 1e-9, 1e-12, 1e-12, 0;
    lens.size = {1920, 1080};
    lens.board = "none";
    lens.utc = "2026-01-01T00:00:00Z";
    if (!store || !store.value().Append(lens)) std::exit(1);
    Pose X_CS;
    if (k > 0) {
      const Vec3 middle(0, 0, 1.4);
      X_CS.R = RotationFromVector(Vec3(0.05, 0.25, 0));
      X_CS.p = middle - X_CS.R * middle;
    }
    const test::ShownImage image(folder_ + "/" + name);
    image.Show(test::DrawCell(camera, X_CS * test::CellInCamera(), X_CS * test::GripperInCamera()));
    return fmt::format(
        "[[camera]]\nname = \"{}\"\nkind = \"recorded\"\npath = \"{}\"\nrepeat = true\nserial = "
        "\"{}\"\nmode = \"test mode\"\nrate_hz = {:.1f}\n",
        name, image.path(), serial, kFrames_Hz);
  }

  const std::string folder_;
  BenchRobot robot_;
  StartedDaemon daemon_;
};

}  // namespace plumbline::bench
