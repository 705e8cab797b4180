#include "app/cli/cameras_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <set>
#include <vector>

#include "app/cli/exit_codes.h"
#include "app/cli/terminal_output.h"
#include "app/text/json_text.h"
#include "drivers/camera/v4l2_capabilities.h"

namespace plumbline::cli {
namespace {

using Json = nlohmann::ordered_json;

/// A device with its capabilities; if they cannot be queried, device.problem is set.
struct Listed {
  camera::V4l2Device device;
  std::string select;
  camera::V4l2Capabilities offer;
};

std::vector<Listed> List(const camera::DeviceTree& tree) {
  std::vector<Listed> cameras;
  const std::vector<camera::V4l2Device> devices = camera::ListV4l2Devices(tree);
  for (const camera::V4l2Device& device : devices) {
    Listed camera{device, camera::StableName(device, devices), {}};
    if (camera.device.problem.empty()) {
      auto offer = camera::QueryV4l2Capabilities(device);
      if (offer) {
        camera.offer = std::move(offer).value();
      } else {
        camera.device.problem = offer.error();
      }
    }
    cameras.push_back(std::move(camera));
  }
  return cameras;
}

bool IsReadable(const camera::V4l2Mode& mode) {
  return camera::PixelFormatOfFourcc(mode.fourcc).has_value();
}

Json ModeJson(const camera::V4l2Mode& mode) {
  Json json = {{"format", camera::FourccText(mode.fourcc)},
               {"readable", IsReadable(mode)},
               {"width", mode.largest.width},
               {"height", mode.largest.height}};
  if (mode.smallest != mode.largest) {
    json["smallest"] = {mode.smallest.width, mode.smallest.height};
    json["step"] = {mode.step.width, mode.step.height};
  }
  json["rates_hz"] = mode.rates_hz;
  return json;
}

std::string ModeLine(const camera::V4l2Mode& mode) {
  std::string text = fmt::format("  {} ", camera::FourccText(mode.fourcc));
  if (mode.smallest != mode.largest) {
    text += fmt::format("{}x{} to ", mode.smallest.width, mode.smallest.height);
  }
  text += fmt::format("{}x{}", mode.largest.width, mode.largest.height);
  if (!mode.rates_hz.empty()) text += fmt::format(" at {:.4g} Hz", fmt::join(mode.rates_hz, ", "));
  return text + "\n";
}

}  // namespace

std::string CamerasJson(const camera::DeviceTree& tree) {
  Json cameras = Json::array();
  for (const Listed& listed : List(tree)) {
    const camera::V4l2Device& device = listed.device;
    Json modes = Json::array(), controls = Json::array();
    for (const camera::V4l2Mode& mode : listed.offer.modes) modes.push_back(ModeJson(mode));
    for (const camera::V4l2Control& control : listed.offer.controls) {
      controls.push_back({{"name", control.name},
                          {"smallest", control.smallest},
                          {"largest", control.largest},
                          {"standard", control.standard},
                          {"value", control.value}});
    }
    cameras.push_back({{"device", device.path},
                       {"select", listed.select},
                       {"name", device.name},
                       {"driver", device.driver},
                       {"serial", device.serial},
                       {"port", device.port},
                       {"problem", device.problem.empty() ? Json(nullptr) : Json(device.problem)},
                       {"modes", modes},
                       {"controls", controls}});
  }
  // A name from a device need not be UTF-8.
  return text::JsonText(Json{{"cameras", cameras}}, 2) + "\n";
}

std::string CamerasText(const camera::DeviceTree& tree) {
  std::string text;
  for (const Listed& listed : List(tree)) {
    const camera::V4l2Device& device = listed.device;
    text += fmt::format("{}  {}\n  --camera {}\n", device.path, device.name, listed.select);
    if (device.serial.empty()) text += "  no serial number: identified by its port\n";
    if (!device.problem.empty()) text += fmt::format("  {}\n", device.problem);
    std::set<std::string> unreadable;
    for (const camera::V4l2Mode& mode : listed.offer.modes) {
      if (IsReadable(mode)) {
        text += ModeLine(mode);
      } else {
        unreadable.insert(camera::FourccText(mode.fourcc));
      }
    }
    if (!unreadable.empty()) {
      text +=
          fmt::format("  formats not supported by Plumbline: {}\n", fmt::join(unreadable, ", "));
    }
    for (const camera::V4l2Control& control : listed.offer.controls) {
      text += fmt::format("  {} {:g} ({:g}..{:g}, default {:g})\n", control.name, control.value,
                          control.smallest, control.largest, control.standard);
    }
  }
  return text.empty() ? "no cameras\n" : text;
}

void AddCamerasCommand(CLI::App& app, int& exit_code) {
  auto json = std::make_shared<bool>(false);
  CLI::App* command =
      app.add_subcommand("cameras", "List the connected cameras: names, modes, settings");
  command->add_flag("--json", *json, "Print JSON");
  command->footer(
      "Refer to a camera by the name printed after --camera: a device such as /dev/video0 may be "
      "a\n"
      "different camera after the next start. The port (@1-2) is part of the name if the serial\n"
      "number alone is not unique.\n\n"
      "Examples:\n  plumbline cameras\n"
      "  plumbline cameras --json\n"
      "  plumbline track --camera A1B2C3 --intrinsics lens.json --tag-size-mm 80\n\n"
      "Exit code: 0, even if there is no camera.");
  command->callback([json, &exit_code] {
    if (!*json) std::cout << ForReading;
    std::cout << (*json ? CamerasJson({}) : CamerasText({}));
    exit_code = kExitOk;
  });
}

}  // namespace plumbline::cli
