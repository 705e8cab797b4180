#include "app/display/view_process/page_host.h"

#include <fcntl.h>
#include <fmt/format.h>

#include "drivers/clock.h"
#include "drivers/os/port_file.h"

namespace plumbline::display {

bool PageHost::Same(const Settings& a, const Settings& b) {
  // The page uses only the number of joints.
  return a.page == b.page && a.state_directory == b.state_directory &&
         a.joints.size() == b.joints.size();
}

void PageHost::Open(const config::DaemonConfig& config) {
  Settings settings{config.page, config.state_directory, config.machine.cell.robot.joints};
  if (page_ && Same(*settings_, settings)) return;
  page_.reset();
  settings_ = std::move(settings);
  problem_.clear();
  if (held_ || settings_->page.port) TryServe();
}

void PageHost::Poll(double now_s) {
  if (page_) {
    page_->CollectLog();
  } else if (!problem_.empty() && now_s - tried_s_ >= kRetry_s) {
    TryServe();
  }
}

void PageHost::TryServe() {
  tried_s_ = MonotonicSeconds();
  display::PageOptions options;
  options.config = settings_->page;
  options.state_directory = settings_->state_directory;
  options.joints = settings_->joints;
  os::Descriptor listener(held_ ? fcntl(held_.get(), F_DUPFD_CLOEXEC, 3) : -1);
  auto page = display::Page::Start(std::move(options), shown_, sink_, std::move(listener));
  if (!page) {
    if (problem_ != page.error()) {
      sink_({log::Event::kPageFault,
             fmt::format("the page is not served: {} (retrying every {:.0f} s)", page.error(),
                         kRetry_s)});
    }
    problem_ = page.error();
    return;
  }
  problem_.clear();
  page_ = std::move(page).value();
  sink_({log::Event::kPageServed,
         fmt::format("the page is served on http://{}/", page_->at().Text())});
  if (!port_file_.empty()) {
    if (const auto written = os::WritePortFile(port_file_, {{"page", page_->at().port}});
        !written) {
      sink_({log::Event::kPageFault, written.error()});
    }
  }
  const int port = settings_->page.port.value_or(0);
  if (held_ && port != 0 && port != page_->at().port) {
    sink_({log::Event::kPageFault,
           fmt::format("page.port is {}, but the service manager's socket listens on {}, which "
                       "is used; set the same port in both (systemctl edit plumbline-view.socket)",
                       port, page_->at().port)});
  }
}

}  // namespace plumbline::display
