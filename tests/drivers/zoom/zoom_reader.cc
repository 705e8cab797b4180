// Reads a VISCA camera in the network for its test: one line for each Read(), with the time before
// and after it.
#include <fmt/core.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>

#include "drivers/zoom/visca_zoom.h"

int main(int argc, char** argv) {
  using namespace plumbline;  // NOLINT(google-build-using-namespace)
  if (argc != 5) {
    fmt::print(stderr, "zoom_reader DEVICE TRANSPORT TIMEOUT_MS READS\n");
    return 2;
  }
  zoom::ViscaOptions options;
  options.device = argv[1];
  options.transport = argv[2];
  options.timeout_s = 1e-3 * std::atof(argv[3]);
  const auto sensor = zoom::ViscaZoom::Create(options, MonotonicSeconds);
  if (!sensor) {
    fmt::print(stderr, "{}\n", sensor.error());
    return 1;
  }
  for (int left = std::atoi(argv[4]); left > 0; --left) {
    lens::ZoomReading reading;
    const double before_s = MonotonicSeconds();
    const zoom::ZoomResult result = (*sensor)->Read(reading);
    fmt::print("{:.6f}\t{:.6f}\t{}\t{}\t{}\n", before_s, MonotonicSeconds(),
               zoom::ZoomResultText(result), reading.zoom_counts.value_or(-1),
               result == zoom::ZoomResult::kOk ? "" : (*sensor)->problem());
    std::fflush(stdout);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}
