// The gauge worker between a gauge and a stand-in for the cycle and the monitoring worker.
#include "app/cell/daemon/gauge_worker.h"

#include <catch2/catch.hpp>
#include <chrono>
#include <functional>
#include <mutex>
#include <thread>

#include "tests/drivers/gauge/fake_gauge.h"

namespace plumbline::gauge_worker_test {

using namespace plumbline::cell;
using namespace std::chrono_literals;

namespace {

constexpr const char* kName = "dial gauge at Le Carré 2";  // its 23rd byte is within a character

struct Working {
  test::FakeGauge device;
  GaugeMailbox mailbox;
  std::mutex mutex;
  std::string log;
  config::DaemonConfig config;
  GaugeWorker worker{mailbox, [this](const log::LogEntry& entry) {
                       const std::lock_guard lock(mutex);
                       log += entry.text + "\n";
                     }};

  Working() {
    model::Artefact artefact;
    artefact.name = kName;
    artefact.kind = model::ArtefactKind::kGauge;
    config.machine.cell.artefacts = {artefact};
    config::GaugeConfig gauge;
    gauge.artefact = kName;
    gauge.connection.device = device.device();
    gauge.connection.format = gauge::FindGaugeFormat("plain");
    config.gauges = {gauge};
    worker.Start(config);
    std::this_thread::sleep_for(400ms);  // the line must have been silent after the connection
  }

  /// Presses the button, and answers for the cycle. @return  the number of the press
  std::uint32_t Press(correction::CorrectionCode code) {
    const std::uint32_t before = mailbox.press.Read()->number;
    device.Send("0.125\r\n");
    REQUIRE(Eventually([&] { return mailbox.press.Read()->number > before; }));
    const std::uint32_t number = mailbox.press.Read()->number;
    mailbox.handled = std::uint64_t{number} << 8U | static_cast<std::uint8_t>(code);
    return number;
  }
  status::GaugeStatus Status() { return (*mailbox.status.Read())[0]; }
  bool HasOutcome(status::GaugeOutcome outcome) {
    return Eventually([&] { return Status().outcome == outcome; });
  }
  bool Logged(const std::string& words) {
    const std::lock_guard lock(mutex);
    return log.find(words) != std::string::npos;
  }
  static bool Eventually(const std::function<bool()>& what) {
    for (const auto end = std::chrono::steady_clock::now() + 20s; !what();) {
      if (std::chrono::steady_clock::now() > end) return false;
      std::this_thread::sleep_for(5ms);
    }
    return true;
  }
};

}  // namespace

TEST_CASE("a reading is logged as recorded when its row is in the journal, not before") {
  Working working;
  using enum status::GaugeOutcome;
  const std::uint32_t number = working.Press(correction::CorrectionCode::kOk);
  CHECK(working.HasOutcome(kWaiting));
  CHECK(working.Logged("0.1250 mm not in the journal yet"));
  CHECK_FALSE(working.Logged("0.1250 mm recorded"));
  working.mailbox.taken = number;
  CHECK(working.HasOutcome(kRecorded));
  CHECK(working.Logged("0.1250 mm recorded"));
  const std::uint32_t next = working.Press(correction::CorrectionCode::kOk);
  working.mailbox.dropped = next;
  working.mailbox.taken = next;
  CHECK(working.HasOutcome(kNotKept));
  working.Press(correction::CorrectionCode::kRobotMoving);
  CHECK(working.HasOutcome(static_cast<status::GaugeOutcome>(
      static_cast<unsigned>(kRefused) +
      static_cast<unsigned>(correction::CorrectionCode::kRobotMoving))));
  working.device.Send("x\r\n");
  CHECK(working.HasOutcome(kUnreadable));
}

TEST_CASE("a name that is too long for its registers ends before the character that is cut") {
  Working working;
  const auto name = working.Status().name;
  CHECK(std::string(name.data()) == "dial gauge at Le Carr");  // the rest is zeros
  CHECK(status::CutToSize("Carré", 6) == "Carré");
  CHECK(status::CutToSize("Carré", 5) == "Carr");
  CHECK(status::CutToSize("\x80\x80", 1).empty());  // not UTF-8
}

}  // namespace plumbline::gauge_worker_test
