// Any bytes as a request to the page: cpp-httplib's parser and all that is ours behind it. Without
// the token nothing of the cell's state may come out.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include "app/page/page.h"
#include "app/page/request_parts.h"
#include "drivers/clock.h"

namespace {

using namespace plumbline;

constexpr const char* kToken = "0123456789abcdef";
constexpr const char* kSecret = "the cell nobody may know";

/// The bytes as a connection brings them; keeps what is written.
class BytesStream final : public httplib::Stream {
 public:
  explicit BytesStream(std::string bytes) : bytes_(std::move(bytes)) {}
  bool is_readable() const override { return at_ < bytes_.size(); }
  bool is_writable() const override { return false; }
  ssize_t read(char* to, size_t size) override {
    const std::size_t count = std::min(size, bytes_.size() - at_);
    std::memcpy(to, bytes_.data() + at_, count);
    at_ += count;
    return static_cast<ssize_t>(count);
  }
  ssize_t write(const char* from, size_t size) override {
    written.append(from, size);
    return static_cast<ssize_t>(size);
  }
  void get_remote_ip_and_port(std::string& ip, int& port) const override {
    ip = "192.0.2.1";
    port = 1;
  }
  void get_local_ip_and_port(std::string& ip, int& port) const override {
    ip.clear();
    port = 0;
  }
  socket_t socket() const override { return -1; }

  std::string written;

 private:
  const std::string bytes_;
  std::size_t at_ = 0;
};

struct Served {
  Shown shown;
  std::unique_ptr<Page> page;
  std::unique_ptr<HttpFormat> format;

  Served() {
    auto state = std::make_shared<ViewState>();
    state->cell = kSecret;
    state->now_s = MonotonicSeconds() + 1e9;  // never old
    auto now = std::make_shared<ShownNow>();
    now->state = state;
    shown.Put(std::shared_ptr<const ShownNow>(now));
    PageOptions options;
    options.config.token = kToken;
    options.state_directory = "/nonexistent";
    auto started = Page::Start(options, shown, [](const LogEntry&) {});
    if (!started) std::abort();
    page = std::move(started).value();
    format = std::make_unique<HttpFormat>(
        [this](const httplib::Request& request, httplib::Response& response) {
          page->Answer(request, response);
        });
  }
};

/// Whether the bytes may hold the token in any of its forms: plain, as a cookie, or %-encoded.
bool MayKnow(const std::string& bytes) {
  return bytes.find(kToken) != std::string::npos ||
         bytes.find(CookieValueOf(kToken)) != std::string::npos ||
         bytes.find('%') != std::string::npos;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Served served;
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  BytesStream stream(bytes);
  served.format->Serve(stream);
  if (!MayKnow(bytes) && stream.written.find(kSecret) != std::string::npos) std::abort();
  if (stream.written.find(kToken) != std::string::npos) std::abort();
  static_cast<void>(HostOf(bytes));
  if (const auto host = HostOf(bytes); host && host->find('/') != std::string::npos) std::abort();
  if (ReportKindOf(bytes) != ReportKind::kNone && bytes.find('/') != std::string::npos)
    std::abort();
  if (const auto cookie = CookieOf(bytes, "plumbline"); cookie && cookie->size() > size)
    std::abort();
  if (const auto bearer = BearerOf(bytes); bearer && bearer->empty()) std::abort();
  return 0;
}
