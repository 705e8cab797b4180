#include "app/cli/cameras_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <iostream>
#include <memory>
#include <set>
#include <vector>

#include "app/base/terminal/terminal_output.h"
#include "app/base/text/json_text.h"
#include "app/cli/commands.h"
#include "app/cli/failure.h"
#include "drivers/camera/v4l2_device.h"

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
  Json json = {{"format", camera::FourccText(mode.fourcc)}, {"readable", IsReadable(mode)}};
  if (mode.largest.width > 0) {  // not DV
    json["width"] = mode.largest.width;
    json["height"] = mode.largest.height;
  }
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
  if (mode.largest.width > 0) {
    text += fmt::format("{}x{}", mode.largest.width, mode.largest.height);
  } else {
    text += "in the size of its frames";  // DV
  }
  if (!mode.rates_hz.empty()) text += fmt::format(" at {:.4g} Hz", fmt::join(mode.rates_hz, ", "));
  return text + "\n";
}

/// Index of the camera that `which` selects: its place in the list, from 1, or a name.
Result<std::size_t> IndexOf(const std::string& which, const std::vector<Listed>& cameras) {
  const bool is_number = which.find_first_not_of("0123456789") == std::string::npos;
  std::size_t place = 0;
  std::from_chars(which.data(), which.data() + which.size(), place);
  if (is_number && place >= 1 && place <= cameras.size()) return place - 1;
  std::vector<camera::V4l2Device> devices;
  devices.reserve(cameras.size());
  for (const Listed& listed : cameras) devices.push_back(listed.device);
  const Result<camera::V4l2Device> named = camera::SelectV4l2Device(which, devices);
  if (!named && !is_number) return named.failure();
  const auto found = std::find_if(devices.begin(), devices.end(), [&](const auto& device) {
    return named && device.path == named->path;
  });
  if (found != devices.end()) return static_cast<std::size_t>(found - devices.begin());
  return Error{fmt::format(
      "there is no camera {}; `plumbline cameras` lists {}", which,
      cameras.empty() ? std::string("none: connect one") : fmt::format("1 to {}", cameras.size()))};
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

Result<std::string> CameraTable(const camera::DeviceTree& tree, const std::string& which) {
  const std::vector<Listed> cameras = List(tree);
  const Result<std::size_t> index = IndexOf(which, cameras);
  if (!index) return index.failure();
  const Listed& chosen = cameras[*index];
  if (!chosen.device.problem.empty()) {
    return Error{fmt::format("{}: {}", chosen.device.path, chosen.device.problem)};
  }
  const camera::V4l2Mode* best = nullptr;
  for (const camera::V4l2Mode& mode : chosen.offer.modes) {
    const auto area = [](const camera::V4l2Mode& of) {
      return static_cast<double>(of.largest.width) * of.largest.height;
    };
    if (IsReadable(mode) && (best == nullptr || area(mode) > area(*best))) best = &mode;
  }
  if (best == nullptr) {
    return Error{
        fmt::format("{}: delivers no format that Plumbline reads; `plumbline cameras` lists "
                    "its formats",
                    chosen.device.path)};
  }
  std::string text =
      fmt::format("[camera]{:18}# {}\ndevice = \"{}\"\n", "", chosen.device.name, chosen.select);
  if (best->largest.width > 0) {  // not DV
    text +=
        fmt::format("width_px = {}\nheight_px = {}\n", best->largest.width, best->largest.height);
  }
  if (!best->rates_hz.empty()) {
    text += fmt::format("rate_hz = {:.1f}\n",
                        *std::max_element(best->rates_hz.begin(), best->rates_hz.end()));
  }
  return text;
}

std::string CamerasText(const camera::DeviceTree& tree) {
  std::string text;
  int number = 0;
  for (const Listed& listed : List(tree)) {
    const camera::V4l2Device& device = listed.device;
    text += fmt::format("{}  {}  {}\n  --camera {}\n", ++number, device.path, device.name,
                        listed.select);
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
  auto chosen = std::make_shared<std::string>();
  CLI::Option* const as_json = command->add_flag("--json", *json, "Print JSON");
  command
      ->add_option("--choose", *chosen,
                   "Print the lines of plumbline.toml that select this camera: its number in the\n"
                   "list, or its name")
      ->check(CLI::Validator(
          [](const std::string& text) { return text.empty() ? "is empty" : std::string(); },
          "NUMBER|NAME"))
      ->excludes(as_json);
  command->footer(
      "Refer to a camera by the name printed after --camera: a device such as /dev/video0 may be "
      "a\n"
      "different camera after the next start. The port (@1-2) is part of the name if the serial\n"
      "number alone is not unique.\n\n"
      "Examples:\n  plumbline cameras\n"
      "  plumbline cameras --choose 2 >> plumbline.toml\n"
      "  plumbline cameras --choose A1B2C3\n"
      "  plumbline cameras --json\n"
      "  plumbline track --camera A1B2C3 --intrinsics lens.json --tag-size-mm 80\n\n"
      "Exit codes: 0, even if there is no camera; 1 with --choose if that camera does not exist or "
      "cannot\nbe used.");
  command->callback([json, chosen, &exit_code] {
    if (!chosen->empty()) {
      const Result<std::string> lines = CameraTable({}, *chosen);
      if (lines) std::cout << *lines;
      exit_code = lines ? kExitOk : Fail("plumbline cameras: " + lines.error());
      return;
    }
    if (!*json) std::cout << terminal::ForReading;
    std::cout << (*json ? CamerasJson({}) : CamerasText({}));
    exit_code = kExitOk;
  });
}

}  // namespace plumbline::cli
