#include "app/view/page_side.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

namespace plumbline {

void PageSide::WarnOfReaders(const DaemonConfig& config) const {
  struct stat file {};
  if (config.page.token.empty() || stat(config.file.c_str(), &file) != 0) return;
  if ((file.st_mode & S_IROTH) == 0) return;
  sink_(true,
        fmt::format("{0} holds the page's token, and every user of this computer may read it: "
                    "chown root:plumbline {0} && chmod 640 {0}",
                    config.file));
}

void PageSide::Open(const DaemonConfig& config) {
  if (config_ == config.page) return;
  config_ = config.page;
  page_.reset();
  if (held_fd_ < 0 && !config.page.port) return;
  PageOptions options;
  options.config = config.page;
  options.state_directory = config.state_directory;
  options.joints = config.machine.cell.robot.joints;
  if (held_fd_ >= 0) options.listen_fd = fcntl(held_fd_, F_DUPFD_CLOEXEC, 3);
  auto page = Page::Start(std::move(options), shown_, sink_);
  if (!page) {
    sink_(true, "the page is not served: " + page.error());
    return;
  }
  page_ = std::move(page).value();
  WarnOfReaders(config);
  sink_(false, fmt::format("the page is served on http://{}/", page_->at().Text()));
  const int port = config.page.port.value_or(0);
  if (held_fd_ >= 0 && port != 0 && port != page_->at().port) {
    sink_(true,
          fmt::format("page.port is {}, but the service manager's socket listens on {}, which "
                      "is served: set the same in both (systemctl edit plumbline-view.socket)",
                      port, page_->at().port));
  }
}

}  // namespace plumbline
