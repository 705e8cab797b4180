// The report is well-formed, self-contained and escaped, and states why figures are missing.
#include "app/measure/report/report.h"

#include <unistd.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <tuple>

#include "app/base/text/sha256.h"
#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "app/measure/report/certificate.h"
#include "app/measure/report/figures.h"
#include "app/measure/report/html.h"
#include "app/measure/report/pdf.h"
#include "app/measure/report/sections.h"
#include "app/measure/report/words.h"
#include "tests/app/measure/diagnosis/example_diagnosis.h"

namespace plumbline::report_test {

using namespace plumbline::measure;
using test::ExampleCell;
using test::ExampleDiagnosis;

namespace {

namespace fs = std::filesystem;

const ReportSource kSource{.cell_file = "cell.toml",
                           .data_file = "measured.csv",
                           .rows = 96,
                           .unreadable_lines = {7},
                           .version = "0.1.0",
                           .utc = "2026-11-21T07:30:00Z",
                           .cell_sha256 = "5e",
                           .data_sha256 = "da7a",
                           .declared_fingerprint = "0123456789abcdef"};

std::string Report(const measure::Diagnosis& diagnosis) {
  return ReportHtml(diagnosis, ExampleCell(), kSource);
}

bool Has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

std::size_t Count(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

bool HasGnuplot() {
  return DrawSvgs("").ok();
}

/// Temporary folder of this process.
class Folder {
 public:
  Folder() : path_(fs::temp_directory_path() / ("plumbline-report-" + std::to_string(getpid()))) {
    fs::create_directories(path_);
  }
  ~Folder() { fs::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::string File(const std::string& name) const { return (path_ / name).string(); }

 private:
  fs::path path_;
};

// Checks that tags are closed in order, ids are unique, and references stay within the file.
constexpr const char* kChecker = R"python(
import sys
from html.parser import HTMLParser
void = {'meta', 'br', 'img', 'hr', 'link', 'input'}
class Checker(HTMLParser):
    def __init__(self):
        super().__init__()
        self.open, self.ids, self.uses, self.faults = [], set(), [], []
    def attributes(self, tag, attrs):
        if tag in ('script', 'link', 'iframe', 'object', 'img'): self.faults.append('tag ' + tag)
        for name, value in attrs:
            if name.startswith('on'): self.faults.append('handler ' + name)
            if name == 'id':
                if value in self.ids: self.faults.append('id twice: ' + value)
                self.ids.add(value)
            if name in ('href', 'src', 'xlink:href'):
                if not value.startswith('#'): self.faults.append('reference ' + value)
                self.uses.append(value[1:])
    def handle_starttag(self, tag, attrs):
        self.attributes(tag, attrs)
        if tag not in void: self.open.append(tag)
    def handle_startendtag(self, tag, attrs):
        self.attributes(tag, attrs)
    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag: self.faults.append('closes %s at %s' % (tag, self.getpos()))
text = open(sys.argv[1], encoding='utf-8').read()
checker = Checker()
checker.feed(text)
checker.close()
faults = checker.faults + ['open: ' + tag for tag in checker.open]
faults += ['no id ' + use for use in checker.uses if use not in checker.ids]
faults += ['address ' + word for word in ('http:', 'https:', '@import', 'url(//') if word in text]
print('\n'.join(faults[:20]))
sys.exit(1 if faults else 0)
)python";

}  // namespace

TEST_CASE("the report is well-formed and self-contained for every verdict") {
  const Folder folder;
  std::ofstream(folder.File("check.py")) << kChecker;
  for (const measure::Verdict verdict :
       {measure::Verdict::kNoEffect, measure::Verdict::kExplained, measure::Verdict::kAmbiguous,
        measure::Verdict::kUnknown}) {
    CAPTURE(Describe(verdict));
    const std::string file = folder.File("report.html");
    std::ofstream(file) << Report(ExampleDiagnosis(verdict));
    const std::string command = "python3 '" + folder.File("check.py") + "' '" + file + "'";
    CHECK(std::system(command.c_str()) == 0);
  }
}

TEST_CASE("the checker itself finds faults") {
  const Folder folder;
  std::ofstream(folder.File("check.py")) << kChecker;
  for (const char* bad : {"<p><b>x</p>", "<p id=\"a\"></p><p id=\"a\"></p>", "<a href=\"#b\"></a>",
                          "<a href=\"http://example.org\"></a>", "<script></script>"}) {
    CAPTURE(bad);
    std::ofstream(folder.File("bad.html")) << bad;
    const std::string command =
        "python3 '" + folder.File("check.py") + "' '" + folder.File("bad.html") + "' > /dev/null";
    CHECK(std::system(command.c_str()) != 0);
  }
}

TEST_CASE("the report has the sections that belong to its verdict") {
  struct Case {
    measure::Verdict verdict;
    std::vector<std::string> says, does_not_say;
  };
  const Case cases[] = {
      {measure::Verdict::kNoEffect,
       {"No effect detected above the noise of 0.087 mm", "and detection limits"},
       {"Effects found", "What to measure next", "Held out, corrected"}},
      {measure::Verdict::kExplained,
       {"Joint compliance on axes 2 and 3 (93 % of the residual) and thermal growth (6 %)",
        "5.100&thinsp;&times;&thinsp;10<sup>&minus;7</sup>", "Correlation", "Held out, corrected"},
       {"Alternative explanations"}},
      {measure::Verdict::kAmbiguous,
       {"Either tool stiffness or payload mass: these rows cannot separate them",
        "Alternative explanations", "What to measure next"},
       {"Correlation of"}},
      {measure::Verdict::kUnknown,
       {"An effect outside the catalogue that follows air pressure",
        "the unknown part is not corrected"},
       {"What to measure next"}}};
  for (const Case& c : cases) {
    CAPTURE(Describe(c.verdict));
    const std::string html = Report(ExampleDiagnosis(c.verdict));
    for (const std::string& part : c.says) {
      CAPTURE(part);
      CHECK(Has(html, part));
    }
    for (const std::string& part : c.does_not_say) {
      CAPTURE(part);
      CHECK_FALSE(Has(html, part));
    }
    for (const char* always :
         {"measured.csv", "2026-11-21 07:30 UTC", "Effects considered", "Outliers",
          "<td class=\"number\">54</td>", "latency cannot be seen"}) {
      CAPTURE(always);
      CHECK(Has(html, always));
    }
  }
}

TEST_CASE("the report has figures if gnuplot is installed") {
  if (!HasGnuplot()) {
    WARN("SKIPPED: gnuplot is not installed (Debian package gnuplot-nox)");
    return;
  }
  const std::string html = Report(ExampleDiagnosis(measure::Verdict::kAmbiguous));
  CHECK_FALSE(Has(html, "no figures"));
  // 4 or 6 residual panels, 6 signals, 6 joints, 2 for the poses, 1 for the rival; the certificate.
  CHECK(Count(html, "<svg") >= 4 + 6 + 6 + 2 + 1 + 2);
  // The signal of the strongest remaining dependence is drawn.
  CHECK(Has(Report(ExampleDiagnosis(measure::Verdict::kUnknown)),
            "aria-label=\"air pressure (bar)\""));
}

TEST_CASE("without gnuplot the report has its tables and a note") {
  GnuplotOptions absent;
  absent.program = "gnuplot-that-is-not-installed";
  const std::string html =
      ReportHtml(ExampleDiagnosis(measure::Verdict::kExplained), ExampleCell(), kSource, absent);
  CHECK(Has(html, "no figures"));
  CHECK(Has(html, "gnuplot-nox"));
  CHECK_FALSE(Has(html, "<svg"));
  CHECK_FALSE(Has(html, "<h2>Residuals in the cell"));
  CHECK(Has(html, "Held out, corrected model"));
}

TEST_CASE("failures of gnuplot are reported") {
  const Folder folder;
  struct Case {
    const char* script;
    const char* says;
  };
  const Case cases[] = {{"#!/bin/sh\ncat > /dev/null; echo broken >&2; exit 3\n", "broken"},
                        {"#!/bin/sh\nexec sleep 60\n", "did not end within 0.7 s"},
                        {"#!/bin/sh\nexec < /dev/null; echo '<svg></svg>'\n", ""}};
  for (const Case& c : cases) {
    CAPTURE(c.script);
    GnuplotOptions options;
    options.program = folder.File("gnuplot");
    options.limit = std::chrono::milliseconds(700);
    std::ofstream(options.program) << c.script;
    fs::permissions(options.program, fs::perms::owner_all);
    // Larger than a pipe's buffer: a child that does not read must not block the writer.
    const auto drawn = DrawSvgs(std::string(300000, '#'), options);
    CHECK(drawn.ok() == std::string(c.says).empty());
    if (!drawn) CHECK(Has(drawn.error(), c.says));
    fs::remove(options.program);
  }
}

TEST_CASE("texts from files are escaped, in HTML and in gnuplot") {
  const Folder folder;
  const std::string trace = folder.File("trace");
  measure::Diagnosis diagnosis = ExampleDiagnosis(measure::Verdict::kUnknown);
  const std::string evil[] = {
      "<script>alert(1)</script>",           "\"&'",         "`touch " + trace + "`",
      "'; system('touch " + trace + "'); '", "@x\nplot 1\n", "\xff\xfe_%s{}"};
  for (std::size_t k = 0; k < std::size(evil); ++k) diagnosis.signals[k].name = evil[k];
  diagnosis.drivers = {evil[0], evil[5]};
  diagnosis.notes = {evil[0]};
  diagnosis.not_recorded = {evil[1]};
  diagnosis.considered[0].reason = evil[0];
  diagnosis.rows[measure::RowIndex(15)].session = evil[0];
  diagnosis.held_out_by = evil[1];
  model::CellModel cell = ExampleCell();
  cell.robot.name = "</title>" + evil[0];
  ReportSource source = kSource;
  source.cell_file = source.data_file = evil[0];
  const std::string html = ReportHtml(diagnosis, cell, source);
  CHECK_FALSE(Has(html, "<script"));
  CHECK(Count(html, "</title>") == 1);
  CHECK(Has(html, "&lt;script&gt;alert(1)&lt;/script&gt;"));
  CHECK(ValidUtf8(html) == html);
  CHECK_FALSE(fs::exists(trace));
  if (HasGnuplot()) CHECK_FALSE(Has(html, "no figures"));
}

TEST_CASE("an effect that no listed explanation contains has a lower bound as its gap, or none") {
  measure::Diagnosis diagnosis = ExampleDiagnosis(measure::Verdict::kExplained);
  measure::CandidateOutcome& last = diagnosis.considered.emplace_back();
  last.id = "latency";
  last.chi2_drop = 5;
  last.evidence_gap = 123;
  last.gap_is_lower_bound = true;
  CHECK(Has(Report(diagnosis), "&gt; 123"));
  const std::size_t zeros = Count(Report(diagnosis), ">0.0<");
  diagnosis.considered.back().evidence_gap = 0;
  diagnosis.considered.back().gap_is_lower_bound = false;
  CHECK_FALSE(Has(Report(diagnosis), "&gt; 123"));
  CHECK(Count(Report(diagnosis), ">0.0<") == zeros);
}

TEST_CASE("figures and numbers belong to the right rows if only some rows were searched") {
  // 3000 rows, of which every second one took part in the search and was held out.
  measure::Diagnosis diagnosis = ExampleDiagnosis(measure::Verdict::kAmbiguous);
  const measure::RowTrace row = diagnosis.rows.front();
  diagnosis.rows.assign(3000, row);
  diagnosis.outlier_rows.clear();
  measure::SignalTrace signal{"k", {}, 0.01, 0.5};
  measure::Rival& rival = diagnosis.rivals.front();
  rival.shift_W.clear();
  rival.rows.clear();
  for (std::size_t k = 0; k < diagnosis.rows.size(); ++k) {
    measure::RowTrace& of = diagnosis.rows[measure::RowIndex(k)];
    signal.values.push_back(static_cast<double>(k));
    of.before = Vec3(0, 0, 1e-6 * static_cast<double>(k));
    of.after = 0.5 * of.before;
    of.held_out_before.reset();
    of.held_out_after.reset();
    if (k % 2 == 1) continue;
    of.fold = 0;
    of.held_out_before = Vec3(4e-3, 0, 0);
    of.held_out_after = Vec3(k == 2000 ? 9e-3 : 3e-3, 0, 0);
    rival.rows.emplace_back(k);
    rival.shift_W.emplace_back(0, 0, 1e-6 * static_cast<double>(k));
  }
  diagnosis.rows[measure::RowIndex(2000)].weight = 0.3;  // low enough to count as an outlier
  diagnosis.rows[measure::RowIndex(2000)].outlier = true;
  diagnosis.outlier_rows = {2002};
  diagnosis.signals = {signal};

  const std::string panel = SignalFigures(diagnosis).panels.at(0).script;
  // Of 2999 rows every fourth is drawn: value, before and after [mm].
  CHECK(Has(panel, "\n1200 1.2 0.6 \n"));
  CHECK(Has(panel, "\n2997 2.997 1.4985 \n"));
  CHECK_FALSE(Has(panel, "\n2000 "));
  // Of the 1500 compared rows every second one is drawn; the last number is the arrow's length
  // [mm].
  const PanelGroup pictures = RivalFigures(diagnosis, ExampleCell());
  REQUIRE(pictures.panels.size() == 1);
  CHECK(Has(pictures.panels[0].script, " 2 \n"));
  CHECK_FALSE(Has(pictures.panels[0].script, " 2.002 \n"));
  CHECK(Has(RivalsTable(diagnosis), ">" + measure::MillimetreText(2.998e-3) + "<"));

  const std::string table = ErrorTable(diagnosis);
  const auto held_out = table.find("Held out, corrected model");
  REQUIRE(held_out != std::string::npos);
  // Median, 95th percentile and maximum exclude rows that were not held out, and the outlier.
  const std::string of_row = table.substr(held_out, table.find("</tr>", held_out) - held_out);
  CHECK(Count(of_row, measure::MillimetreText(3e-3)) == 3);
  CHECK_FALSE(Has(of_row, measure::MillimetreText(9e-3)));
  CHECK(Has(table, "1500 of 3000 rows"));
}

TEST_CASE("only correlations that matter are listed, the strongest of them first") {
  measure::Diagnosis diagnosis = ExampleDiagnosis(measure::Verdict::kExplained);
  CHECK(Has(CorrelationBlock(diagnosis), "No two parameters are correlated by more than 0.5"));
  diagnosis.correlation(0, 1) = diagnosis.correlation(1, 0) = -0.93;
  diagnosis.correlation(1, 2) = diagnosis.correlation(2, 1) = 0.6;
  const std::string html = CorrelationBlock(diagnosis);
  CHECK(html.find("&minus;0.93") < html.find("0.60"));
  CHECK(Count(html, "<tr") == 3);
}

TEST_CASE("effects that were not considered are grouped by reason, limits are beside the others") {
  measure::Diagnosis diagnosis = ExampleDiagnosis(measure::Verdict::kExplained);
  diagnosis.minimum_detectable_m = {{"backlash", 0.0314e-3}};
  const std::string html = ConsideredTable(diagnosis);
  CHECK(Count(html, "cannot be offered: velocities") == 1);
  CHECK(Has(html, " (cannot be offered: velocities (joint speed) were not recorded)"));
  const auto backlash = html.find("<td>Backlash</td>");
  REQUIRE(backlash != std::string::npos);
  CHECK(html.find(">0.031<", backlash) < html.find("</tr>", backlash));
}

TEST_CASE("a remark that repeats a reservation is left out") {
  measure::Diagnosis diagnosis = ExampleDiagnosis(measure::Verdict::kUnknown);
  diagnosis.checks.push_back({"p_value", "", false, 1, 1, "the residual follows q3_deg"});
  diagnosis.notes = {"the residual follows q3_deg", "another remark"};
  CHECK(RemarksList(diagnosis) == ListHtml({"another remark"}));
}

TEST_CASE("an empty diagnosis, a single row and NaN still give a report") {
  CHECK(Has(Report(measure::Diagnosis{}), "</html>"));
  measure::Diagnosis one = ExampleDiagnosis(measure::Verdict::kExplained);
  one.rows.resize(1);
  for (measure::SignalTrace& signal : one.signals) signal.values.resize(1);
  one.rows.front().after = Vec3::Constant(std::nan(""));
  one.held_out.after_m = std::nan("");
  one.findings[0].covariance.setConstant(std::nan(""));
  const std::string html = Report(one);
  CHECK(Has(html, "</html>"));
  CHECK(Has(html, "unknown"));
}

TEST_CASE("texts and numbers are formatted for HTML") {
  CHECK(Escape("a<b>&\"'\x01") == "a&lt;b&gt;&amp;&quot;&#39; ");
  CHECK(ValidUtf8("\xC3\xA4\xC3") == "\xC3\xA4\xEF\xBF\xBD");
  CHECK(ValidUtf8("\xED\xA0\x80") == "\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBD");
  CHECK(NumberHtml("-1.5e-07") == "&minus;1.5&thinsp;&times;&thinsp;10<sup>&minus;7</sup>");
  CHECK(NumberHtml("2e+10") == "2&thinsp;&times;&thinsp;10<sup>10</sup>");
  CHECK(NumberHtml("-0.180") == "&minus;0.180");
  CHECK(NumberHtml("none") == "none");
  CHECK(UtcInWords("2026-11-21T07:30:00Z") == "2026-11-21 07:30 UTC");
  CHECK(GnuplotQuoted("it's\n`x`") == "'it\u2019s `x`'");
}

TEST_CASE("columns, joints and parameters are in words, keys of the cell file are not") {
  measure::Diagnosis diagnosis;
  diagnosis.signals.push_back({"air_pressure_bar", {}, 1, 0});
  const std::pair<const char*, const char*> texts[] = {
      {"follows t_s or temp_C", "follows time or temperature"},
      {"follows air_pressure_bar and oil_bar", "follows air pressure and oil_bar"},
      {"q3_deg, tau5_Nm; q6.", "joint 3, torque of joint 5; joint 6."},
      {"qd1_deg_s..: latency", "joint speed: latency"},
      {"qdd was not recorded", "joint acceleration was not recorded"},
      {"axis coupling (q6_of_q1)", "axis coupling (joint 6 of joint 1)"},
      {"correct base_xyz_mm, q_step_deg", "correct base_xyz_mm, q_step_deg"}};
  for (const auto& [text, words] : texts) CHECK(InWords(text, diagnosis) == words);
  const std::pair<const char*, const char*> parameters[] = {
      {"q2", "joint 2"},
      {"q3_2_phase", "joint 3, line 2, phase"},
      {"q3_of_q2", "joint 3 of joint 2"},
      {"q2_link3_x", "joint 2, link 3, x"},
      {"alpha3", "alpha of axis 3"},
      {"tool_bending", "tool bending"}};
  for (const auto& [name, words] : parameters) CHECK(ParameterInWords(name) == words);
}

TEST_CASE("numbers of a column are aligned at the decimal point, uncertainties too") {
  HtmlTable table({"Text", "Number"}, {0});
  table.AddRow({"a", "12.5 &plusmn; 0.25"});
  table.AddRow({"b", "&minus;0.125 &plusmn; 10"});
  table.AddRow({"c", "3&thinsp;&times;&thinsp;10<sup>7</sup>"});
  const std::string html = table.Html();
  CHECK(Has(html, ">12.5\u2007\u2007 &plusmn; \u20070.25<"));
  CHECK(Has(html, ">&minus;0.125 &plusmn; 10\u2008\u2007\u2007<"));
  CHECK(Has(html, ">3&thinsp;&times;&thinsp;10<sup>7</sup><"));
  CHECK(Has(html, "<td>a</td>"));
}

namespace {

constexpr measure::Verdict kVerdicts[] = {measure::Verdict::kNoEffect, measure::Verdict::kExplained,
                                          measure::Verdict::kAmbiguous, measure::Verdict::kUnknown};

/// A cell whose instrument is declared.
model::CellModel DeclaredCell() {
  model::CellModel cell = ExampleCell();
  cell.measurement.sigma_m = 0.05e-3;
  return cell;
}

/// An example whose rows are replicates, `cycles` of each pose; without outliers if so requested.
measure::Diagnosis WithReplicates(measure::Verdict verdict, int cycles, bool outliers) {
  measure::Diagnosis diagnosis = ExampleDiagnosis(verdict);
  int at = 0;
  for (measure::RowTrace& row : diagnosis.rows) {
    row.pose = measure::ClusterIndex(at++ / cycles);
    if (!outliers) row.outlier = false;
  }
  if (!outliers) diagnosis.outlier_rows.clear();
  return diagnosis;
}

std::string FirstPage(const std::string& html) {
  const auto start = html.find("<section class=\"certificate\">");
  return html.substr(start, html.find("<h2 class=\"appendix\">") - start);
}

/// Output of a command; empty if it cannot be run.
std::string OutputOf(const std::string& command) {
  std::string output;
  FILE* const pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return output;
  char bytes[4096];
  for (std::size_t n; (n = fread(bytes, 1, sizeof bytes, pipe)) > 0;) output.append(bytes, n);
  pclose(pipe);
  return output;
}

/// Distance from the top of the first page to the end of its last digest [pt].
double LastLine_pt(const std::string& pdf) {
  const std::string words = OutputOf("pdftotext -f 1 -l 1 -bbox '" + pdf + "' -");
  const auto digest = words.rfind(">SHA-256<"), end = words.rfind("yMax=\"", digest);
  return end == std::string::npos ? 0 : std::atof(words.c_str() + end + 6);
}

}  // namespace

TEST_CASE("the first page names what was measured, with what, where, when and by which model") {
  ReportSource source = kSource;
  source.certificate_details = {.tolerance_m = 0.5e-3,
                                .number = "2026-117",
                                .robot_serial = "KR 871",
                                .site = "Hall 4",
                                .measured_on = "2026-11-20",
                                .instrument = "laser tracker",
                                .instrument_serial = "SN 4711",
                                .calibration = "D-K-15070, March",
                                .approved_by = "A. Approver"};
  const std::string page =
      FirstPage(ReportHtml(ExampleDiagnosis(measure::Verdict::kExplained), DeclaredCell(), source));
  for (const char* part :
       {"Written 2026-11-21 07:30 UTC", "number: 2026-117", "KR 871", "Hall 4", "2026-11-20",
        "laser tracker", "SN 4711", "D-K-15070, March", "A. Approver", "0.050 mm per axis",
        "22 to 31 \u00b0C", "0123456789abcdef", "measured.csv da7a", "cell.toml 5e", "Signature",
        "coverage 95.45 %", "Not tested", "(5.100 &plusmn; 0.", "<td>joint 2</td>"}) {
    CAPTURE(part);
    CHECK(Has(page, part));
  }
  CHECK_FALSE(Has(page, "not stated"));
}

TEST_CASE("what was not stated is reported as such, and nothing takes its place") {
  const std::string page =
      FirstPage(ReportHtml(ExampleDiagnosis(measure::Verdict::kExplained), ExampleCell(), kSource));
  CHECK(Count(page, "class=\"blank\"") == 3);  // name, date, signature
  for (const char* name : {"Robot serial no.", "Site", "Measured", "Instrument", "Its serial no.",
                           "Its calibration", "Its uncertainty"}) {
    CAPTURE(name);
    CHECK(Has(page, std::string(name) + "</th><td>not stated<"));
  }
  CHECK(Has(page, "Accuracy certificate, number: not stated"));
  CHECK(Has(page, "makes no statement of conformity"));
  CHECK_FALSE(Has(page, "Conforms"));
}

TEST_CASE("the date of the measurement is that of the rows if the origin of their time is known") {
  measure::Diagnosis diagnosis = ExampleDiagnosis(measure::Verdict::kExplained);
  const CertificateDetails details{.measured_on = "spring"};
  CHECK(MeasuredText(diagnosis, {}).empty());
  CHECK(MeasuredText(diagnosis, details) == "spring");
  measure::SignalTrace time{"t_s", {}, 1, 0};
  for (const measure::RowTrace& row : diagnosis.rows) time.values.push_back(60.0 * row.line);
  diagnosis.signals = {time};
  CHECK(MeasuredText(diagnosis, details) == "spring");
  diagnosis.domain.time_zero_s = 1795246200;  // 2026-11-21T07:30:00Z
  CHECK_THAT(MeasuredText(diagnosis, details), Catch::StartsWith("2026-11-21 07:3") &&
                                                   Catch::Contains(" to 09:0") &&
                                                   Catch::EndsWith(" UTC"));
  diagnosis.signals.front().values[measure::RowIndex(0)] = -86400;
  CHECK_THAT(MeasuredText(diagnosis, details),
             Catch::StartsWith("2026-11-20 07:30 to 2026-11-21 09:0"));
}

TEST_CASE("with a tolerance, conformity is the headline and the verdict is second") {
  ReportSource source = kSource;
  const auto page = [&](double tolerance_m) {
    source.certificate_details.tolerance_m = tolerance_m;
    return FirstPage(
        ReportHtml(WithReplicates(measure::Verdict::kExplained, 4, false), DeclaredCell(), source));
  };
  const std::tuple<double, const char*, const char*> cases[] = {
      {1e-1, "Conforms", "good"},
      {2e-3, "Would conform if corrected", "caution"},
      {0.15e-3, "Undecided", "caution"},
      {1e-6, "Does not conform", "bad"}};
  for (const auto& [tolerance_m, word, state] : cases) {
    CAPTURE(word);
    const std::string html = page(tolerance_m);
    const auto headline = html.find(std::string("class=\"headline ") + state + "\""),
               conformity = html.find(std::string(" ") + word + "</p>"),
               second = html.find("class=\"second good\"");
    REQUIRE(second != std::string::npos);
    CHECK(headline < conformity);
    CHECK(conformity < second);
    CHECK(second < html.find("Explained</p>"));
  }
}

TEST_CASE("each verdict has its own colour and word on the first page") {
  const char* const words[] = {"No effect", "Explained", "Ambiguous", "Unknown cause"};
  const char* const states[] = {"neutral", "good", "caution", "bad"};
  for (std::size_t k = 0; k < std::size(kVerdicts); ++k) {
    CAPTURE(words[k]);
    const std::string page =
        FirstPage(ReportHtml(ExampleDiagnosis(kVerdicts[k]), ExampleCell(), kSource));
    CHECK(Has(page, std::string("class=\"headline ") + states[k] + "\""));
    CHECK(Has(page, words[k]));
    CHECK(Has(page, "Rests on 96 rows in 2 sessions (2 rejected)"));
  }
}

TEST_CASE("the first page counts checks in words, and names doubts beside them") {
  const auto page = [](int passed, int failed, int doubts) {
    measure::Diagnosis diagnosis = ExampleDiagnosis(measure::Verdict::kAmbiguous);
    diagnosis.checks.clear();
    for (int k = 0; k < passed + failed; ++k) {
      diagnosis.checks.push_back({"p_value", "", k < passed, 1, 1, "a sentence"});
    }
    diagnosis.doubts.clear();
    for (int k = 0; k < doubts; ++k) {
      diagnosis.doubts.push_back({"backlash", {"q" + std::to_string(k + 1)}, "a reason"});
      diagnosis.doubts.push_back({"backlash", {"q" + std::to_string(k + 1)}, "another reason"});
    }
    return FirstPage(ReportHtml(diagnosis, ExampleCell(), kSource));
  };
  CHECK(Has(page(1, 0, 0), "; the one check passed;"));
  CHECK(Has(page(0, 1, 0), "; the one check failed;"));
  CHECK(Has(page(4, 0, 0), "; all 4 checks passed;"));
  CHECK(Has(page(3, 1, 0), "; 3 of 4 checks passed;"));
  CHECK(Has(page(1, 0, 2), "; the one check passed, but 2 effects are in doubt;"));
  CHECK(Has(page(3, 1, 1), "; 3 of 4 checks passed, and 1 effect is in doubt;"));
  CHECK(Has(page(0, 0, 1), "; 1 effect is in doubt;"));
}

TEST_CASE("an ambiguous first page says which two explanations and what to measure") {
  const std::string page =
      FirstPage(ReportHtml(ExampleDiagnosis(measure::Verdict::kAmbiguous), ExampleCell(), kSource));
  CHECK(Has(page, "Either tool stiffness or payload mass: these rows cannot separate them"));
  CHECK(Has(page, "with 80.0 kg, where the explanations differ by 1.20 mm."));
  CHECK(Has(page, "measure joint 1 "));
}

TEST_CASE("an unknown cause opens with the plot of its driver, other verdicts with the figures") {
  if (!HasGnuplot()) {
    WARN("SKIPPED: gnuplot is not installed (Debian package gnuplot-nox)");
    return;
  }
  for (const measure::Verdict verdict : kVerdicts) {
    CAPTURE(Describe(verdict));
    const std::string page =
        FirstPage(ReportHtml(ExampleDiagnosis(verdict), ExampleCell(), kSource));
    const auto plot = page.find("class=\"plot deciding\""), table = page.find("ISO 9283");
    REQUIRE(plot != std::string::npos);
    REQUIRE(table != std::string::npos);
    CHECK((plot < table) == (verdict == measure::Verdict::kUnknown));
    if (verdict == measure::Verdict::kUnknown) {
      CHECK(Has(page, "against air pressure (bar)"));
    }
  }
}

TEST_CASE("the deciding figure shows the signal that explains the residual, with its slope") {
  measure::Diagnosis diagnosis = ExampleDiagnosis(measure::Verdict::kExplained);
  measure::SignalTrace load{"load_N", {}, 0.5, 0};
  for (measure::RowTrace& row : diagnosis.rows) {
    const double load_N = static_cast<double>(row.line % 7);
    load.values.push_back(load_N);
    row.after = Vec3(1e-6, 0, 0);
    row.before = Vec3(0, 2e-4 * load_N, 0);
    row.outlier = false;
  }
  diagnosis.signals.push_back(load);
  const CertificateFigure figure = DecidingFigure(diagnosis, ExampleCell());
  CHECK(figure.title == "Residual in y against load (N)");
  REQUIRE(figure.panels.size() == 2);
  CHECK(Has(figure.sentence, "Before correction, load explains"));
  CHECK(Has(figure.sentence, "mm per N"));
  CHECK(Has(figure.sentence, "0.2"));
  CHECK(Has(figure.panels[1].script, "after correction"));
  // Not corrected: one panel, no slope.
  diagnosis.withheld = "too few rows";
  const CertificateFigure before_only = DecidingFigure(diagnosis, ExampleCell());
  CHECK(before_only.panels.size() == 1);
  CHECK_FALSE(Has(before_only.sentence, "mm per N"));
}

TEST_CASE("rejected rows of an unknown cause are in its plot") {
  const CertificateFigure figure =
      DecidingFigure(ExampleDiagnosis(measure::Verdict::kUnknown), ExampleCell());
  CHECK(Has(figure.sentence, "Crosses: rows rejected as outliers."));
  CHECK(Has(figure.panels.at(0).script, "$rejected << EOD"));
  CHECK_FALSE(Has(DecidingFigure(ExampleDiagnosis(measure::Verdict::kExplained), ExampleCell())
                      .panels.at(0)
                      .script,
                  "$rejected"));
}

TEST_CASE("conformity needs a tolerance, a declared instrument and no rejected row") {
  using Outcome = Conformity::Outcome;
  struct Case {
    bool declared, outliers;
    double tolerance_m;
    Outcome outcome;
    const char* says;
  };
  const Case cases[] = {
      {true, false, 1e-1, Outcome::kConforms, "As measured: kept at all"},
      {true, false, 2e-3, Outcome::kWouldConform, "not yet measured with it"},
      {true, true, 2e-3, Outcome::kNotDecided, "Rejected rows, not assessed: 2."},
      {false, false, 2e-3, Outcome::kNotDecided, "uncertainty of the instrument is not declared"},
      {true, false, 0.15e-3, Outcome::kNotDecided, "the others are too uncertain"},
      {true, false, 1e-6, Outcome::kDoesNotConform, "exceeded at"}};
  for (const Case& c : cases) {
    CAPTURE(c.says, c.tolerance_m);
    const Conformity conformity =
        ConformityOf(AchievedAccuracyOf(WithReplicates(measure::Verdict::kExplained, 4, c.outliers),
                                        c.declared ? DeclaredCell() : ExampleCell()),
                     c.tolerance_m);
    CHECK(conformity.outcome == c.outcome);
    CHECK(Has(conformity.sentence, c.says));
  }
  measure::Diagnosis noisy = WithReplicates(measure::Verdict::kExplained, 4, false);
  noisy.declared_noise_too_small = true;
  CHECK(ConformityOf(AchievedAccuracyOf(noisy, DeclaredCell()), 1e-1).outcome ==
        Outcome::kNotDecided);
  // Far outside the tolerance, as before a correction that was withheld.
  measure::Diagnosis withheld = WithReplicates(measure::Verdict::kExplained, 4, false);
  withheld.withheld = "the correction predicts held-out rows worse";
  const Conformity before = ConformityOf(AchievedAccuracyOf(withheld, DeclaredCell()), 1e-4);
  CHECK(before.outcome == Outcome::kDoesNotConform);
  CHECK(Has(before.sentence, "Tolerance 0.10 mm. As measured: exceeded at"));
}

TEST_CASE("conformity names what was fitted, and needs rows that measure a position") {
  model::CellModel cell = DeclaredCell();
  cell.measurement.frame_known = cell.measurement.tool_known = false;
  measure::Diagnosis measured = WithReplicates(measure::Verdict::kExplained, 4, 0);
  const Conformity fitted = ConformityOf(AchievedAccuracyOf(measured, cell), 1e-2);
  CHECK(Has(fitted.sentence, "with the instrument's frame and the tool's tip fitted to"));
  const Conformity exceeded = ConformityOf(AchievedAccuracyOf(measured, cell), 1e-7);
  CHECK_FALSE(Has(exceeded.sentence, ",:"));
  CHECK_FALSE(Has(exceeded.sentence, " :"));
  for (measure::RowTrace& row : measured.rows) row.kind = measure::ObservationKind::kGauge;
  const AchievedAccuracy touches = AchievedAccuracyOf(measured, cell);
  CHECK_FALSE(touches.before);
  CHECK(ConformityOf(touches, 1e-2).outcome == Conformity::Outcome::kNotDecided);
  CHECK(Has(touches.why_none, "touch artefacts"));
}

TEST_CASE("characteristics come from held-out rows and state what the rows do not show") {
  const AchievedAccuracy single =
      AchievedAccuracyOf(ExampleDiagnosis(measure::Verdict::kExplained), DeclaredCell());
  CHECK(single.held_out);
  CHECK(single.rows == 94);
  REQUIRE(single.after);
  // All rows of the example belong to pose 0 unless a test assigns them to others.
  CHECK(single.after->characteristics.poses.size() == 1);
  measure::Diagnosis apart = WithReplicates(measure::Verdict::kExplained, 1, true);
  const AchievedAccuracy poses = AchievedAccuracyOf(apart, DeclaredCell());
  const std::string table = CharacteristicsTable(poses);
  CHECK(Has(table, "no repeated poses"));
  CHECK(Has(table, "no pose visited again"));
  CHECK(Has(BudgetTable(poses, apart), "scatter of the residual instead"));
  CHECK(Has(CharacteristicsTable(AchievedAccuracyOf(
                WithReplicates(measure::Verdict::kExplained, 4, true), DeclaredCell())),
            "Repeatability RP, 4 cycles"));
  model::CellModel ranges = DeclaredCell();
  ranges.measurement.kind = model::MeasurementKind::kRange;
  const AchievedAccuracy none = AchievedAccuracyOf(apart, ranges);
  CHECK_FALSE(none.before);
  CHECK(Has(CharacteristicsTable(none), "measures ranges"));
  CHECK(ConformityOf(none, 1e-3).outcome == Conformity::Outcome::kNotDecided);
}

TEST_CASE("the digest is SHA-256") {
  // FIPS 180-4, example of a one-block message; and the empty message.
  CHECK(text::Sha256Hex("abc") ==
        "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  CHECK(text::Sha256Hex("") == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

TEST_CASE("colours of an embedded drawing are written where they are used") {
  const std::string svg = InlineSvg(
      "<svg viewBox=\"0 0 9 9\"><defs><circle id='gpPt5' stroke='currentColor' r='1'/><use "
      "xlink:href='#gpPt5' id='gpPt6' fill='currentColor' stroke='none'/></defs><g fill=\"none\" "
      "color=\"black\" stroke=\"currentColor\"><use xlink:href='#gpPt6' color='red'/><use "
      "xlink:href='#gpPt5' color='green'/></g></svg>",
      "p1", "t");
  CHECK_FALSE(Has(svg, "currentColor"));
  CHECK(Has(svg, "<g fill=\"none\" stroke=\"black\">"));
  CHECK(Has(svg, "<use href='#p1-gpPt6' fill='red' stroke='red'/>"));
  CHECK(Has(svg, "<use href='#p1-gpPt5' stroke='green'/>"));
}

TEST_CASE("without WeasyPrint the PDF's error names the package and another way") {
  const PdfOptions absent{.program = "weasyprint-that-is-not-installed"};
  CHECK(Has(WhyNoPdf(absent), "Debian package weasyprint"));
  const auto pdf = PdfFromHtml("<p>x</p>", absent);
  REQUIRE_FALSE(pdf);
  CHECK(Has(pdf.error(), "print it from a browser"));
}

TEST_CASE("a program that prints no PDF is reported") {
  const Folder folder;
  const PdfOptions broken{.program = folder.File("weasyprint")};
  std::ofstream(broken.program) << "#!/bin/sh\ncat > /dev/null; echo no fonts >&2; exit 1\n";
  fs::permissions(broken.program, fs::perms::owner_all);
  const auto pdf = PdfFromHtml("<p>x</p>", broken);
  REQUIRE_FALSE(pdf);
  CHECK(Has(pdf.error(), "no fonts"));
  fs::remove(broken.program);
}

TEST_CASE("the certificate is exactly the first page of the PDF, also with long texts") {
  if (!WhyNoPdf().empty() || OutputOf("command -v pdftotext").empty()) {
    WARN("SKIPPED: weasyprint or pdftotext is not installed");
    return;
  }
  const Folder folder;
  const std::string file = folder.File("report.pdf");
  for (const bool crowded : {false, true}) {
    for (const measure::Verdict verdict : kVerdicts) {
      CAPTURE(Describe(verdict), crowded);
      measure::Diagnosis diagnosis = WithReplicates(verdict, 3, true);
      model::CellModel cell = DeclaredCell();
      ReportSource source = kSource;
      source.certificate_details.tolerance_m = 0.2e-3;
      source.cell_sha256 = source.data_sha256 = text::Sha256Hex("x");
      // Only the first page matters here, and it prints faster without the others' figures.
      diagnosis.signals.erase(diagnosis.signals.begin(), diagnosis.signals.end() - 1);
      diagnosis.spectrum.clear();
      if (crowded) {
        std::string word, sentence;
        for (int k = 0; k < 8; ++k) word += "Measured_";
        for (int k = 0; k < 20; ++k) sentence += "a sentence that goes on and on, ";
        cell.robot.name = word + word;
        source.data_file = source.cell_file = word + ".csv";
        source.certificate_details = {0.2e-3, word, word, word, word, word, word, word, word};
        diagnosis.withheld = sentence;
        diagnosis.not_recorded.assign(9, sentence);
        for (int k = 0; k < 3; ++k) {
          diagnosis.doubts.push_back({"backlash", {"q1"}, sentence});
          diagnosis.checks.push_back({"held_out_error", "", false, 1, 1, sentence});
        }
        diagnosis.held_out_by = sentence;
        diagnosis.drivers = {word, word};
        if (!diagnosis.findings.empty()) {
          for (int k = 0; k < 3; ++k) diagnosis.findings.push_back(diagnosis.findings.front());
        }
      }
      const auto pdf = PdfFromHtml(ReportHtml(diagnosis, cell, source));
      REQUIRE(pdf);
      std::ofstream(file) << *pdf;
      const std::string first = OutputOf("pdftotext -f 1 -l 1 -layout '" + file + "' -"),
                        second = OutputOf("pdftotext -f 2 -l 2 -layout '" + file + "' -");
      CHECK(Has(first, "Signature"));
      CHECK(Count(first, "SHA-256") == 2);
      CHECK(second.find("Appendix") < 20);
      // The last line is near the end of the page (842 pt).
      if (HasGnuplot() && !crowded) CHECK(LastLine_pt(file) > 0.8 * 842);
    }
  }
}

TEST_CASE("the report of about a hundred rows has at most six pages") {
  if (!WhyNoPdf().empty() || OutputOf("command -v pdfinfo").empty() || !HasGnuplot()) {
    WARN("SKIPPED: weasyprint, pdfinfo or gnuplot is not installed");
    return;
  }
  const Folder folder;
  const std::string file = folder.File("report.pdf");
  for (const measure::Verdict verdict : kVerdicts) {
    CAPTURE(Describe(verdict));
    measure::Diagnosis diagnosis = WithReplicates(verdict, 1, true);
    for (const measure::CandidateOutcome& one : diagnosis.considered) {
      diagnosis.minimum_detectable_m[one.id] = 0.05e-3;
    }
    if (!diagnosis.rivals.empty()) diagnosis.rivals.resize(4, diagnosis.rivals.front());
    diagnosis.notes.resize(6,
                           "a remark that is as long as those on what the rows cannot show, "
                           "with an example for each joint, and with what to do about it");
    ReportSource source = kSource;
    source.certificate_details.tolerance_m = 0.2e-3;
    const auto pdf = PdfFromHtml(ReportHtml(diagnosis, DeclaredCell(), source));
    REQUIRE(pdf);
    std::ofstream(file) << *pdf;
    const std::string pages = OutputOf("pdfinfo '" + file + "' | sed -n 's/^Pages: *//p'");
    CHECK(std::atoi(pages.c_str()) >= 2);
    CHECK(std::atoi(pages.c_str()) <= 6);
  }
}

}  // namespace plumbline::report_test
