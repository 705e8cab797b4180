#include "app/display/page/report_name.h"

#include <catch2/catch.hpp>

namespace plumbline::report_name_test {

using namespace plumbline::display;

TEST_CASE("only names of reports are accepted") {
  CHECK(ReportKindOf("0007.html") == ReportKind::kModel);
  CHECK(ReportKindOf("12345.html") == ReportKind::kModel);
  CHECK(ReportKindOf("diagnosis.html") == ReportKind::kDiagnosis);
  CHECK(ReportKindOf("alarm-20261121T120000Z-0041-1.png") == ReportKind::kAlarmPicture);
  for (const char* const none :
       {"", "..", "../0007.html", "0007.toml", "007.html", "1234567890.html", "0007.html/..",
        "/etc/passwd", "alarm-.png", "alarm-../x.png", "alarm-a/b.png", "alarm-a.b.png",
        "x-alarm-1.png", "0007.HTML", "00\n7.html", "report.html", "journal.sqlite"}) {
    INFO(none);
    CHECK(ReportKindOf(none) == ReportKind::kNone);
  }
  CHECK(ReportKindOf("alarm-" + std::string(200, 'a') + ".png") == ReportKind::kNone);
  CHECK(ReportKindOf(std::string_view("0007.html\0", 10)) == ReportKind::kNone);
}

}  // namespace plumbline::report_name_test
