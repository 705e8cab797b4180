#include <catch2/catch.hpp>

#include "app/base/config/body_reader.h"
#include "app/base/config/camera_config.h"
#include "app/base/config/named_files.h"
#include "firmware-like/image/image_size.h"

namespace plumbline::camera_reader_test {

using namespace plumbline::config;

namespace {

constexpr const char* kTags = R"(schema = 1
[[body]]
name = "cell"
size_mm = 60.0
[[body.tag]]
id = 1
xyz_mm = [0.0, 0.0, 0.0]
[[body.tag]]
id = 2
xyz_mm = [500.0, 0.0, 0.0]
[[body]]
name = "gripper"
size_mm = 40.0
place_sd_mm = 0.05
[[body.tag]]
id = 3
xyz_mm = [0.0, 0.0, 0.0]
)";

Result<std::string> File(const std::string& path) {
  if (path == "/etc/bodies.toml") return std::string(kTags);
  return Error{"No such file or directory"};
}

struct Read {
  FaultList faults;
  VisionConfig vision;

  explicit Read(const std::string& text) {
    TomlDocument document(text, "/etc/plumbline.toml", faults);
    REQUIRE(document.parsed());
    const FileSource files = File;
    vision =
        VisionFromToml(document.Root(), NamedFiles("/etc/plumbline.toml", files, "/data"), faults);
    document.ReportUnknownKeys();
  }
  bool Says(const std::string& what) const {
    return FaultsText(faults).find(what) != std::string::npos;
  }
};

constexpr const char* kLeast = "[camera]\ndevice = \"cam\"\n[tags]\nfile = \"bodies.toml\"\n";

}  // namespace

TEST_CASE("keys that a DV camcorder cannot obey are named") {
  const std::string tags = "[tags]\nfile = \"bodies.toml\"\n";
  const Read dv(
      "[camera]\nkind = \"dv\"\ndevice = \"/run/fifo\"\nserial = \"A\"\nrate_hz = 25\n"
      "exposure_ms = 8\n" +
      tags);
  CHECK(dv.Says("camera.exposure_ms: warning: 8 is not used for kind = \"dv\""));
  CHECK(dv.Says("camera.rate_hz: warning: 25 is not used"));
  CHECK_FALSE(dv.Says("serial: warning"));
  CHECK_FALSE(Read(std::string(kLeast) + "").Says("not used"));
}

TEST_CASE("without [camera] there is no camera, and its dependent tables are faults") {
  CHECK(Read("").vision.cameras.empty());
  CHECK(Read("").faults.All().empty());
  const Read alone("[zoom]\nkind = \"none\"\n[tags]\nfile = \"bodies.toml\"\n");
  CHECK(alone.Says("zoom"));
  CHECK(alone.Says("requires a [camera] with a key"));
  CHECK(alone.faults.All().size() == 2);
}

TEST_CASE("a DV camcorder needs the FIFO of its frames") {
  const std::string tags = "[tags]\nfile = \"bodies.toml\"\n";
  const Read read("[camera]\nkind = \"dv\"\ndevice = \"/run/dv\"\nserial = \"A\"\n" + tags);
  CHECK(read.faults.All().empty());
  REQUIRE(read.vision.cameras.size() == 1);
  CHECK(read.vision.cameras[0].connection.dv.fifo == "/run/dv");
  CHECK(read.vision.cameras[0].connection.dv.serial == "A");
  CHECK(Read("[camera]\nkind = \"dv\"\n" + tags).Says("device"));
}

TEST_CASE("a minimal camera configuration and its defaults") {
  const Read read(kLeast);
  INFO(FaultsText(read.faults));
  CHECK(read.faults.All().empty());
  REQUIRE(read.vision.cameras.size() == 1);
  CHECK(read.vision.cameras[0].kind == "v4l2");
  CHECK(read.vision.cameras[0].connection.v4l2.device == "cam");
  CHECK(read.vision.cameras[0].zoom.kind.empty());
  CHECK(read.vision.cameras[0].declared == target::DeclaredFacts{});  // nothing is assumed
  CHECK(read.vision.board.board.columns == 17);
  CHECK(read.vision.board.board.kind == target::BoardKind::kChessboard);
  CHECK(read.vision.board.by_itself);
  CHECK(read.vision.tags.cell == "cell");
  CHECK(read.vision.tags.database.bodies.size() == 2);
  CHECK(read.vision.tags.tool.empty());
}

TEST_CASE("all keys are read, in SI") {
  const Read read(
      "[camera]\ndevice = \"cam\"\nwidth_px = 1920\nheight_px = 1080\nrate_hz = 25.0\n"
      "no_window = true\nfixed_focus = true\nexposure_ms = 8.0\ngain_counts = 3\nwhite_balance_K = "
      "5000.0\nfocus_counts = 7\n"
      "[zoom]\nkind = \"visca\"\ndevice = \"/dev/ttyUSB0\"\nbaud = 38400\naddress = 2\n"
      "timeout_ms = 80\noptical_max_counts = 12000\nzoom_band_counts = 5\nfocus_band_counts = 6\n"
      "settle_ms = 500\nlost_after_ms = 2000\nverify_patience_s = 3.0\nperiod_ms = 150\n"
      "[board]\ncolumns = 9\nrows = 6\nsquare_mm = 25.0\nviews = 15\nmost_views = 40\n"
      "patience_s = 60.0\nacceptable_px = 0.3\ndistance_mm = 1500.0\nby_itself = false\n"
      "[tags]\nfile = \"bodies.toml\"\nfamily = \"36h11\"\nthreshold = 90\ncell = \"cell\"\n"
      "cell_xyz_mm = [1000.0, 0.0, 0.0]\ncell_rpy_deg = [0.0, 0.0, 90.0]\nplace_sd_mm = 0.1\n"
      "tool = \"gripper\"\ntip_mm = [0.0, 0.0, 120.0]\n");
  INFO(FaultsText(read.faults));
  REQUIRE(read.faults.All().empty());
  const VisionConfig& vision = read.vision;
  REQUIRE(vision.cameras.size() == 1);
  const CameraConfig& camera = vision.cameras[0];
  CHECK(camera.connection.v4l2.mode.size == image::ImageSize{1920, 1080});
  CHECK(*camera.connection.v4l2.settings.exposure_s == Approx(0.008));
  CHECK(camera.declared == target::DeclaredFacts{true, true});
  CHECK(camera.zoom.connection.visca.baud == 38400);
  CHECK(camera.zoom.connection.visca.timeout_s == Approx(0.08));
  CHECK(camera.zoom.period_s == Approx(0.15));
  CHECK(camera.zoom.supervision.zoom_band_counts == 5);
  CHECK(camera.zoom.supervision.settle_s == Approx(0.5));
  CHECK(vision.board.board.square_m == Approx(0.025));
  CHECK(*vision.board.distance_m == Approx(1.5));
  CHECK_FALSE(vision.board.by_itself);
  CHECK(vision.tags.X_WK.p.x() == Approx(1));
  CHECK(vision.tags.X_WK.R(1, 0) == Approx(1));
  CHECK(vision.tags.place_sd_m == Approx(1e-4));
  CHECK(*vision.tags.database.bodies[0].place_sd_m == Approx(1e-4));  // it does not say
  CHECK(*vision.tags.database.bodies[1].place_sd_m == Approx(5e-5));
  std::string silent(kTags);
  silent.erase(silent.find("place_sd_mm = 0.05\n"), 19);
  FaultList faults;
  CHECK_FALSE(TagDatabaseFromText(silent, "bodies.toml", faults)->bodies[1].place_sd_m);
  CHECK(vision.tags.tip_T.z() == Approx(0.12));
}

TEST_CASE("each fault has its own message") {
  struct Case {
    std::string text, words;
  };
  const std::string camera = "[camera]\ndevice = \"cam\"\n",
                    tags = "[tags]\nfile = \"bodies.toml\"\n";
  const Case cases[] = {
      {"[camera]\nkind = \"v4l2\"\n" + tags, "device"},
      {camera, "tags"},
      {camera + "width_px = 640\n" + tags, "must be given together"},
      {camera + "colour = true\n" + tags, "colour"},
      {"[camera]\nkind = \"webcam\"\n" + tags, "webcam"},
      {"[camera]\nkind = \"recorded\"\n" + tags, "path"},
      {camera + "[tags]\nfile = \"nothing.toml\"\n", "cannot be read"},
      {camera + tags + "cell = \"table\"\n", "\"table\" is not a [[body]] in the tag file"},
      {camera + tags + "cell = \"gripper\"\n", "has 1 tags; 2 are needed"},
      {camera + tags + "tool = \"hand\"\ntip_mm = [0.0, 0.0, 1.0]\n", "\"hand\" is not a [[body]]"},
      {camera + tags + "tool = \"gripper\"\n", "tip_mm"},
      {camera + "[zoom]\nkind = \"visca\"\n" + tags, "device"},
      {camera + "[zoom]\nkind = \"visca\"\ndevice = \"/dev/t\"\nbaud = 19200\n" + tags,
       "is not 9600 or 38400"},
      {camera + "[zoom]\nkind = \"visca\"\ndevice = \"ttyUSB0\"\n" + tags,
       "write it with its folder"},
      {camera + "[zoom]\nkind = \"visca\"\ndevice = \"/dev/t\"\ntransport = \"tcp\"\n" + tags,
       "zoom.transport: \"tcp\" does not suit device: /dev/t is a serial line"},
      {camera + "[zoom]\nkind = \"visca\"\ndevice = \"192.168.1.9:0\"\n" + tags,
       "\"192.168.1.9:0\" has a port outside 1..65535"},
      {camera + "[zoom]\nkind = \"hid\"\n" + tags, "profile"},
      {camera + "[zoom]\nkind = \"gpio\"\nchip = \"/dev/gpiochip0\"\n" + tags, "line"},
      {camera + "[zoom]\nkind = \"none\"\nperiod_ms = 900\n" + tags, "always be lost"},
      {camera + "[zoom]\nkind = \"radio\"\ndevice = \"x\"\n" + tags, "radio"},
      {camera + "[board]\nviews = 50\nmost_views = 20\n" + tags, "is below views"},
      {camera + "[board]\nsquare_mm = 0.0\n" + tags, "square_mm"},
      {camera + "[board]\nkind = \"hexagons\"\n" + tags, "hexagons"},
      {camera + "[board]\nkind = \"charuco\"\n" + tags, "board.mark_mm: missing"},
      {camera + "[board]\nkind = \"charuco\"\nmark_mm = 12.0\n" + tags, "2 to 9.2 mm for"},
      {camera + "[board]\nkind = \"charuco\"\nmark_mm = 7.0\nfamily = \"aruco-4x4-50\"\n" + tags,
       "has only 50 tags, but a board of 17 x 11"},
      {camera + "[board]\nkind = \"circles\"\nmark_mm = 9.5\n" + tags, "1.5 to 8.5 mm for"},
  };
  for (const Case& one : cases) {
    CAPTURE(one.text);
    const Read read(one.text);
    INFO(FaultsText(read.faults));
    CHECK(read.faults.HasFaults());
    CHECK(read.Says(one.words));
    CHECK(read.faults.All().size() == 1);
  }
}

TEST_CASE("required_for names what a camera's lens must be valid for") {
  CHECK_FALSE(Read(kLeast).vision.cameras[0].RequiredForPoints());
  const std::string tags = "[tags]\nfile = \"bodies.toml\"\n";
  const std::string camera = "[camera]\ndevice = \"cam\"\n";
  const Read points(camera + "required_for = [\"points\"]\n" + tags);
  CHECK(points.faults.All().empty());
  CHECK(points.vision.cameras[0].RequiredForPoints());
  CHECK_FALSE(Read(camera + "required_for = []\n" + tags).vision.cameras[0].RequiredForPoints());
  const Read other(camera + "required_for = [\"probes\"]\n" + tags);
  CHECK(other.Says("contains \"probes\"; it may contain \"points\" only"));
  CHECK(Read(camera + "required_for = \"points\"\n" + tags).faults.HasFaults());
}

TEST_CASE("boards of the other kinds") {
  const std::string camera = "[camera]\ndevice = \"cam\"\n[tags]\nfile = \"bodies.toml\"\n";
  const Read charuco(camera +
                     "[board]\nkind = \"charuco\"\ncolumns = 9\nrows = 6\nsquare_mm = 20.0\n"
                     "mark_mm = 15.0\nfamily = \"aruco-5x5-100\"\n");
  INFO(FaultsText(charuco.faults));
  CHECK(charuco.faults.All().empty());
  CHECK(WordsOf(charuco.vision.board.board) == "charuco 9x6, 20 mm, mark 15 mm, aruco-5x5-100");
  const Read circles(camera +
                     "[board]\nkind = \"acircles\"\ncolumns = 4\nrows = 11\nsquare_mm = 20.0\n"
                     "mark_mm = 15.0\n");
  CHECK(circles.faults.All().empty());
  CHECK(WordsOf(circles.vision.board.board) == "acircles 4x11, 20 mm, mark 15 mm");

  const Read same(camera + "[board]\nkind = \"charuco\"\nmark_mm = 7.0\nfamily = \"36h11\"\n");
  CHECK_FALSE(same.faults.HasFaults());
  CHECK(same.Says("may be mistaken for the cell's"));
}

TEST_CASE("the text compared at a reload contains the four tables and the tag file") {
  CHECK(Read(kLeast).vision.text == Read(kLeast).vision.text);
  CHECK(Read(kLeast).vision.text != Read(std::string(kLeast) + "place_sd_mm = 0.3\n").vision.text);
}

namespace {

constexpr const char* kTwo = R"([[camera]]
name = "side"
device = "A1"
[camera.zoom]
kind = "visca"
device = "/dev/ttyUSB0"
[[camera]]
name = "rear"
device = "B2"
[camera.zoom]
kind = "visca"
device = "/dev/ttyUSB1"
[board]
columns = 9
[tags]
file = "bodies.toml"
)";

std::string With(std::string text, const std::string& good, const std::string& wrong) {
  const std::size_t at = text.find(good);
  REQUIRE(at != std::string::npos);
  return text.replace(at, good.size(), wrong);
}

}  // namespace

TEST_CASE("two cameras: each with its device and zoom; board and tags are shared") {
  const Read two(kTwo);
  INFO(FaultsText(two.faults));
  CHECK(two.faults.All().empty());
  REQUIRE(two.vision.cameras.size() == 2);
  CHECK(two.vision.cameras[0].name == status::CameraName::kSide);
  CHECK(two.vision.cameras[1].name == status::CameraName::kRear);
  CHECK(two.vision.cameras[0].connection.v4l2.device == "A1");
  CHECK(two.vision.cameras[1].zoom.connection.visca.device == "/dev/ttyUSB1");
  CHECK(two.vision.board.board.columns == 9);
  CHECK(two.vision.text != Read(With(kTwo, "ttyUSB1", "ttyUSB2")).vision.text);
}

TEST_CASE("one camera: [camera.zoom] or [zoom], not both; the name is optional") {
  const Read below(std::string(kLeast) + "[camera.zoom]\nkind = \"v4l2\"\n");
  CHECK(below.faults.All().empty());
  CHECK(below.vision.cameras[0].zoom.connection.v4l2.device == "cam");
  const Read list("[[camera]]\ndevice = \"cam\"\n[zoom]\nkind = \"v4l2\"\n" +
                  With(kLeast, "[camera]\ndevice = \"cam\"\n", ""));
  CHECK(list.faults.All().empty());
  CHECK(list.vision.cameras[0].zoom.kind == "v4l2");
  CHECK(Read(std::string(kLeast) + "[camera.zoom]\nkind = \"none\"\n[zoom]\nkind = \"none\"\n")
            .Says("camera.zoom: is given in addition to [zoom]; keep only one"));
  CHECK(Read(With(kLeast, "[camera]\n", "[camera]\nname = \"top\"\n")).faults.All().empty());
  CHECK(Read("camera = 3\n[tags]\nfile = \"bodies.toml\"\n").Says("write [[camera]]"));
}

TEST_CASE("two conflicting cameras: one fault with its line and remedy") {
  struct Clash {
    const char *good, *wrong, *fault;
  };
  const Clash clashes[] = {
      {"\"rear\"", "\"side\"",
       "/etc/plumbline.toml:8 camera[2].name: \"side\" is used for two cameras; give each its own: "
       "\"side\", \"rear\", \"front\" or \"top\""},
      {"name = \"rear\"\n", "",
       "/etc/plumbline.toml:7 camera[2].name: missing; expected \"side\", \"rear\", \"front\" or "
       "\"top\""},
      {"\"rear\"", "\"left\"", "/etc/plumbline.toml:8 camera[2].name: \"left\" is not one of"},
      {"\"B2\"", "\"A1\"",
       "/etc/plumbline.toml:9 camera[2].device: \"A1\" is used for two cameras; `plumbline "
       "cameras` prints the name of each, with its port if two have the same serial number"},
      {"ttyUSB1", "ttyUSB0",
       "/etc/plumbline.toml:10 camera[2].zoom: uses the same sensor as another camera, "
       "/dev/ttyUSB0; each camera needs its own"},
      {"[board]", "[zoom]\nkind = \"none\"\n[board]",
       "/etc/plumbline.toml:13 zoom: is allowed for a single camera only; write [camera.zoom] "
       "below each [[camera]]"},
      {"[board]", "[[camera]]\nname = \"top\"\ndevice = \"C3\"\n[board]",
       "/etc/plumbline.toml:13 camera[3]: is one camera too many; at most 2 cameras"},
  };
  for (const Clash& clash : clashes) {
    CAPTURE(clash.wrong);
    const Read read(With(kTwo, clash.good, clash.wrong));
    INFO(FaultsText(read.faults));
    CHECK(read.faults.All().size() == 1);
    CHECK(read.Says(clash.fault));
  }
}

TEST_CASE("two recordings need different serial numbers, because lenses are stored by them") {
  const std::string one = "[[camera]]\nkind = \"recorded\"\n";
  const std::string tags = "[tags]\nfile = \"bodies.toml\"\n";
  const std::string side = one + "name = \"side\"\npath = \"a\"\n";
  const std::string rear = one + "name = \"rear\"\npath = \"b\"\n";
  CHECK(Read(side + rear + tags).Says("camera[2].serial: is used for two cameras"));
  CHECK(Read(side + "serial = \"S\"\n" + rear + "serial = \"S\"\n" + tags)
            .Says("\"S\" is used for two cameras"));
  CHECK(Read(side + "serial = \"S\"\n" + rear + tags).faults.All().empty());
}

}  // namespace plumbline::camera_reader_test
