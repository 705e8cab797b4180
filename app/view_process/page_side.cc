#include "app/view_process/page_side.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include "drivers/clock.h"

namespace plumbline {

bool PageSide::Same(const Used& a, const Used& b) {
  // Of the joints a page uses their number.
  return a.page == b.page && a.state_directory == b.state_directory &&
         a.joints.size() == b.joints.size();
}

void PageSide::WarnOfReaders() const {
  struct stat file {};
  if (used_->page.token.empty() || stat(file_.c_str(), &file) != 0) return;
  if ((file.st_mode & S_IROTH) == 0) return;
  sink_({Event::kPageFault,
         fmt::format("{0} holds the page's token, and every user of this computer may read it: "
                     "chown root:plumbline {0} && chmod 640 {0}",
                     file_)});
}

void PageSide::Open(const DaemonConfig& config) {
  Used used{config.page, config.state_directory, config.machine.cell.robot.joints};
  if (page_ && Same(*used_, used)) return;
  page_.reset();
  used_ = std::move(used);
  file_ = config.file;
  problem_.clear();
  if (held_ || used_->page.port) Try();
}

void PageSide::Round(double now_s) {
  if (page_) {
    page_->Remember();
  } else if (!problem_.empty() && now_s - tried_s_ >= kRetry_s) {
    Try();
  }
}

void PageSide::Try() {
  tried_s_ = MonotonicSeconds();
  PageOptions options;
  options.config = used_->page;
  options.state_directory = used_->state_directory;
  options.joints = used_->joints;
  Descriptor listener(held_ ? fcntl(held_.get(), F_DUPFD_CLOEXEC, 3) : -1);
  auto page = Page::Start(std::move(options), shown_, sink_, std::move(listener));
  if (!page) {
    if (problem_ != page.error()) {
      sink_(
          {Event::kPageFault, fmt::format("the page is not served: {} (tried again every {:.0f} s)",
                                          page.error(), kRetry_s)});
    }
    problem_ = page.error();
    return;
  }
  problem_.clear();
  page_ = std::move(page).value();
  WarnOfReaders();
  sink_({Event::kPageServed, fmt::format("the page is served on http://{}/", page_->at().Text())});
  const int port = used_->page.port.value_or(0);
  if (held_ && port != 0 && port != page_->at().port) {
    sink_({Event::kPageFault,
           fmt::format("page.port is {}, but the service manager's socket listens on {}, which "
                       "is served: set the same in both (systemctl edit plumbline-view.socket)",
                       port, page_->at().port)});
  }
}

}  // namespace plumbline
