#include <catch2/catch.hpp>

#include "app/base/config/camera_config.h"
#include "app/base/config/daemon_config.h"
#include "app/base/config/named_files.h"
#include "firmware-like/image/image_size.h"

namespace plumbline::overlay_reader_test {

using namespace plumbline::config;

namespace {

/// The cameras that a configuration has.
VisionConfig Two() {
  VisionConfig vision;
  vision.cameras.resize(2);
  vision.cameras[0].name = status::CameraName::kSide;
  vision.cameras[1].name = status::CameraName::kRear;
  return vision;
}

struct Read {
  FaultList faults;
  OverlayConfig overlay;

  explicit Read(const std::string& lines) {
    TomlDocument document("[overlay]\n" + lines, "/etc/plumbline.toml", faults);
    REQUIRE(document.parsed());
    const FileSource files = [](const std::string&) {
      return Result<std::string>(Error{"none is opened"});
    };
    overlay = OverlayFromToml(*document.Root().RequiredTable("overlay"),
                              NamedFiles("/etc/plumbline.toml", files, "/data"), Two());
    document.ReportUnknownKeys();
  }
  bool Says(const std::string& what) const {
    return FaultsText(faults).find(what) != std::string::npos;
  }
};

}  // namespace

TEST_CASE("[overlay]: every key is read, in SI; file names are relative to the configuration") {
  const Read read(
      "display = \"kms\"\ndevice = \"/dev/dri/card1\"\nwidth_px = 640\nheight_px = 480\n"
      "objects = \"objects.toml\"\nbackground = false\nexaggeration = 10.0\n"
      "nominal = \"beside\"\nstress = true\nstress_full_MPa = 100.0\nnear_mm = 25.0\n");
  INFO(FaultsText(read.faults));
  CHECK(read.faults.All().empty());
  const OverlayConfig& overlay = read.overlay;
  CHECK(overlay.display == OverlayConfig::Display::kKms);
  CHECK(overlay.device == "/dev/dri/card1");
  REQUIRE(overlay.size);
  CHECK(*overlay.size == image::ImageSize{640, 480});
  CHECK(overlay.objects_file == "/etc/objects.toml");
  CHECK_FALSE(overlay.background);
  CHECK(overlay.exaggeration == 10);
  CHECK(overlay.nominal == OverlayConfig::Nominal::kBeside);
  CHECK(overlay.stress);
  CHECK(overlay.stress_full_Pa == Approx(100e6));
  CHECK(overlay.near_m == Approx(0.025));
}

TEST_CASE("[overlay] without keys: no display, nothing exaggerated") {
  const Read read("");
  CHECK(read.faults.All().empty());
  CHECK(read.overlay.display == OverlayConfig::Display::kNone);
  CHECK_FALSE(read.overlay.size);
  CHECK(read.overlay.objects_file.empty());
  CHECK(read.overlay.exaggeration == 1);
}

TEST_CASE("all faults of [overlay] are reported at once") {
  const Read read(
      "display = \"screen\"\ndevice = \"card0\"\nwidth_px = 320\nexaggeration = 0.0\n"
      "nominal = \"left\"\nexagerration = 2.0\n");
  CHECK(read.Says("overlay.display: \"screen\""));
  CHECK(read.Says("overlay.device: \"card0\" is not an absolute path"));
  CHECK(read.Says("overlay.width_px: 320 is outside 640..3840"));
  CHECK(read.Says("and height_px must be given together"));
  CHECK(read.Says("overlay.exaggeration: 0"));
  CHECK(read.Says("overlay.nominal: \"left\""));
  CHECK(read.Says("overlay.exagerration: unknown key"));
}

TEST_CASE("[overlay] camera: both by default, or one that is configured") {
  CHECK_FALSE(Read("").overlay.camera);
  CHECK_FALSE(Read("camera = \"both\"\n").overlay.camera);
  CHECK(Read("camera = \"rear\"\n").overlay.camera == status::CameraName::kRear);
  CHECK(Read("camera = \"top\"\n")
            .Says("overlay.camera: \"top\" is not the name of any [[camera]]; give a camera this "
                  "name, or write \"both\""));
  CHECK(Read("camera = \"left\"\n").Says("is not one of"));
}

}  // namespace plumbline::overlay_reader_test
