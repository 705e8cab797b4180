// Fuzzer: arbitrary bytes as a request to the page, through its parser and handlers. Without the
// token no cell state may be returned.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "app/base/http/http_message.h"
#include "app/base/http/request_parts.h"
#include "app/display/page/page.h"
#include "app/display/page/report_name.h"
#include "drivers/clock.h"

namespace {

using namespace plumbline;

constexpr const char* kToken = "0123456789abcdef";
constexpr const char* kSecret = "the cell nobody may know";

struct Served {
  display::DisplayMailbox shown;
  std::unique_ptr<display::Page> page;

  Served() {
    auto state = std::make_shared<cell::ViewState>();
    state->cell = kSecret;
    state->now_s = MonotonicSeconds() + 1e9;  // never stale
    auto now = std::make_shared<display::DisplayStatus>();
    now->state = state;
    shown.Publish(std::shared_ptr<const display::DisplayStatus>(now));
    display::PageOptions options;
    options.config.token = kToken;
    options.state_directory = "/nonexistent";
    auto started = display::Page::Start(options, shown, [](const log::LogEntry&) {});
    if (!started) std::abort();
    page = std::move(started).value();
  }

  std::string AnswerTo(std::string_view head) {
    http::ParsedRequest parsed = http::ParseRequest(head);
    if (parsed.refusal != 0) return parsed.why;
    const std::string& method = parsed.request.method;
    if (!parsed.request.path.starts_with('/') && (method == "GET" || method == "HEAD"))
      std::abort();
    parsed.request.peer = "192.0.2.1";
    http::HttpResponse response;
    page->Answer(parsed.request, response);
    const std::string answer = http::HeadOf(response);
    // A request must not inject a header.
    if (http::EndOfHead(answer) != answer.size()) std::abort();
    return answer + response.body;
  }
};

/// True if the bytes may contain the token: plain, as a cookie, or %-encoded.
bool MayKnow(const std::string& bytes) {
  return bytes.find(kToken) != std::string::npos ||
         bytes.find(http::CookieValueOf(kToken)) != std::string::npos ||
         bytes.find('%') != std::string::npos;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Served served;
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  if (const auto end = http::EndOfHead(bytes)) {
    if (*end > size || http::EndOfHead(bytes.substr(0, *end), *end - 1) != end) std::abort();
    const std::string written = served.AnswerTo(bytes.substr(0, *end));
    if (!MayKnow(bytes) && written.find(kSecret) != std::string::npos) std::abort();
    if (written.find(kToken) != std::string::npos) std::abort();
  }
  static_cast<void>(http::HostOf(bytes));
  if (const auto host = http::HostOf(bytes); host && host->find('/') != std::string::npos)
    std::abort();
  if (display::ReportKindOf(bytes) != display::ReportKind::kNone &&
      bytes.find('/') != std::string::npos)
    std::abort();
  if (const auto cookie = http::CookieOf(bytes, "plumbline"); cookie && cookie->size() > size)
    std::abort();
  if (const auto bearer = http::BearerToken(bytes); bearer && bearer->empty()) std::abort();
  return 0;
}
