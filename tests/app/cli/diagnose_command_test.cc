// plumbline diagnose with a fake engine: files, exit codes, interruption.
#include "app/cli/diagnose_command.h"

#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <utility>

#include "app/base/config/cell_reader.h"
#include "app/base/config/model_fingerprint.h"
#include "app/base/text/json_text.h"
#include "app/base/text/sha256.h"
#include "app/cli/failure.h"
#include "app/cli/output_file.h"
#include "app/measure/diagnosis/diagnose.h"
#include "app/measure/diagnosis/output/summary.h"
#include "app/measure/report/pdf.h"
#include "app/measure/siblings/prior_json.h"
#include "drivers/files/text_file.h"
#include "tests/app/measure/diagnosis/example_diagnosis.h"

namespace plumbline::diagnose_command_test {

using namespace plumbline::cli;
namespace fs = std::filesystem;

namespace {

constexpr const char* kCell = "config/cells/kr210.toml";

/// A folder with measured.csv, and the command's arguments in it.
class Desk {
 public:
  Desk() : path_(fs::temp_directory_path() / ("plumbline-diagnose-" + std::to_string(getpid()))) {
    fs::create_directories(path_);
    std::ofstream(File("measured.csv")) << "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,"
                                           "z_mm\n0,-90,90,0,0,0,1565,0,1825\n";
    arguments.cell = kCell;
    arguments.measured = File("measured.csv");
  }
  ~Desk() { fs::remove_all(path_); }
  Desk(const Desk&) = delete;
  Desk& operator=(const Desk&) = delete;

  std::string File(const std::string& name) const { return (path_ / name).string(); }
  bool Has(const std::string& name) const { return fs::exists(path_ / name); }
  std::ptrdiff_t Files() const {
    return std::distance(fs::directory_iterator(path_), fs::directory_iterator());
  }

  int Run(const DiagnosisEngine& engine) {
    out.str("");
    err.str("");
    return RunDiagnose(arguments, engine, out, err);
  }
  int Run(measure::Verdict verdict) {
    return Run([verdict](const model::CellModel&, const measure::MeasuredTable&,
                         const measure::DiagnosisOptions&) {
      return Result<measure::Diagnosis>(test::ExampleDiagnosis(verdict));
    });
  }

  DiagnoseArguments arguments;
  std::ostringstream out, err;

 private:
  fs::path path_;
};

}  // namespace

TEST_CASE("every verdict has exit code 0 and a short summary; --details has the rest") {
  const std::pair<measure::Verdict, const char*> cases[] = {
      {measure::Verdict::kNoEffect, "NO EFFECT: no effect detected above the noise of 0.087 mm"},
      {measure::Verdict::kExplained,
       "EXPLAINED: joint compliance on axes 2 and 3 (93 % of the residual)"},
      {measure::Verdict::kAmbiguous,
       "AMBIGUOUS: tool stiffness or payload mass: these points cannot distinguish them"},
      {measure::Verdict::kUnknown,
       "UNKNOWN: an effect outside the catalogue that follows air_pressure_bar"}};
  for (const auto& [verdict, words] : cases) {
    for (const bool details : {false, true}) {
      Desk desk;
      desk.arguments.details = details;
      CHECK(desk.Run(verdict) == kExitOk);
      const std::string text = desk.out.str();
      INFO(text);
      CHECK(text.starts_with(words));
      CHECK(text.find("\nNext: ") != std::string::npos);
      CHECK(text.find("lines 17, 54") != std::string::npos);
      CHECK((text.find("Not recorded: velocities") != std::string::npos) == details);
      CHECK(desk.Files() == 1);
    }
  }
}

TEST_CASE("what only the report states is refused without one, before the diagnosis starts") {
  const std::pair<const char*, measure::CertificateDetails> cases[] = {
      {"--certificate-number", {.number = "2026-117"}},
      {"--robot-serial", {.robot_serial = "KR 871"}},
      {"--site", {.site = "Hall 4"}},
      {"--measured-on", {.measured_on = "2026-11-20"}},
      {"--instrument", {.instrument = "laser tracker"}},
      {"--serial", {.instrument_serial = "1234"}},
      {"--calibration", {.calibration = "D-K-15070"}},
      {"--approved-by", {.approved_by = "A. N. Other"}}};
  for (const auto& [option, details] : cases) {
    Desk desk;
    desk.arguments.certificate_details = details;
    CHECK(desk.Run(measure::Verdict::kExplained) == kExitUsage);
    CHECK(desk.err.str() ==
          std::string(option) + " is stated in the report only; add --report or --pdf\n");
    CHECK(desk.out.str().empty());
  }
}

TEST_CASE(
    "a prior that cannot be used is named in every answer, and is a fault if it was asked for") {
  Desk desk;
  std::string cell = files::ReadTextFile(kCell).value();
  cell.replace(cell.find("[robot]\n"), 8, "[robot]\nmodel = \"KR 210\"\n");
  desk.arguments.cell = desk.File("cell.toml");
  std::ofstream(desk.arguments.cell) << cell;
  fs::create_directory(desk.File("priors"));
  std::ofstream(desk.File("priors/kr210.prior")) << "{}";
  desk.arguments.prior = desk.File("priors");
  desk.arguments.prior_keys = desk.File("keys");
  desk.arguments.json = desk.File("d.json");
  CHECK(desk.Run(measure::Verdict::kExplained) == kExitOk);
  const std::string words = "not used: " + desk.File("priors/kr210.prior") +
                            ": cannot be verified without the plant's public key; put it into ";
  CHECK(desk.out.str().find("\nOther arms: " + words) != std::string::npos);
  const auto json = text::JsonOrNull(files::ReadTextFile(desk.File("d.json")).value());
  CHECK(json["siblings"]["used"] == false);
  CHECK(json["siblings"]["in_words"].get<std::string>().starts_with(words));
  CHECK(json["notes"][0].get<std::string>().find(words) != std::string::npos);

  desk.arguments.prior = desk.File("priors/kr210.prior");
  CHECK(desk.Run(measure::Verdict::kExplained) == kExitFault);
  CHECK(desk.err.str().starts_with(desk.File("priors/kr210.prior") + ": cannot be verified"));
  desk.arguments.prior = desk.File("nosuch.prior");
  CHECK(desk.Run(measure::Verdict::kExplained) == kExitFault);
  CHECK(desk.err.str().starts_with(desk.File("nosuch.prior") + ": does not exist"));
  fs::create_directory(desk.File("empty"));
  desk.arguments.prior = desk.File("empty");
  CHECK(desk.Run(measure::Verdict::kExplained) == kExitOk);
  CHECK(desk.out.str().find("not used: " + desk.File("empty") + ": holds no prior of KR 210") !=
        std::string::npos);
  const std::string named = std::exchange(desk.arguments.cell, kCell);
  CHECK(desk.Run(measure::Verdict::kExplained) == kExitOk);
  CHECK(desk.out.str().find("the cell file names no arm model") != std::string::npos);
  desk.arguments.cell = named;
  desk.arguments.prior.clear();  // --no-prior
  CHECK(desk.Run(measure::Verdict::kExplained) == kExitOk);
  CHECK(desk.out.str().find("Other arms") == std::string::npos);

  desk.arguments.prior = desk.File("priors");
  desk.arguments.arm_out = desk.File("arm.json");
  CHECK(desk.Run(measure::Verdict::kExplained) == kExitOk);
  CHECK(desk.out.str().find("Other arms") == std::string::npos);
  const auto arm = measure::ArmSizesFromJson(files::ReadTextFile(desk.File("arm.json")).value());
  REQUIRE(arm);
  CHECK(arm->cell.robot.identity.model == "KR 210");
  CHECK(arm->found.effects.size() ==
        test::ExampleDiagnosis(measure::Verdict::kExplained).findings.size());
  CHECK(arm->row_sketch.size() == 1);

  desk.arguments.model = desk.File("corrected.toml");
  CHECK(desk.Run(measure::Verdict::kExplained) == kExitOk);
  desk.arguments.model.clear();
  desk.arguments.cell = desk.File("corrected.toml");  // as it was before its correction
  CHECK(desk.Run(measure::Verdict::kExplained) == kExitOk);
  const auto again = measure::ArmSizesFromJson(files::ReadTextFile(desk.File("arm.json")).value());
  REQUIRE(again);
  CHECK(again->cell.effects.empty());
  CHECK(again->found.effects.size() == arm->found.effects.size());
}

TEST_CASE("a summary is always short") {
  measure::Diagnosis diagnosis = test::ExampleDiagnosis(measure::Verdict::kAmbiguous);
  for (int k = 0; k < 4; ++k) {
    const measure::Rival rival = diagnosis.rivals[0];
    const measure::NextPose pose = diagnosis.next_poses[0];
    diagnosis.rivals.push_back(rival);
    diagnosis.next_poses.push_back(pose);
    diagnosis.notes.emplace_back("a note");
    diagnosis.not_recorded.emplace_back("a signal");
    for (int i = 0; i < 20; ++i) diagnosis.outlier_rows.push_back(100 + i);
    const measure::Finding finding =
        test::ExampleDiagnosis(measure::Verdict::kExplained).findings[0];
    diagnosis.findings.push_back(finding);
  }
  Desk desk;
  CHECK(desk.Run([&](const auto&, const auto&, const auto&) {
    return Result<measure::Diagnosis>(diagnosis);
  }) == kExitOk);
  const std::string text = desk.out.str();
  INFO(text);
  CHECK(std::count(text.begin(), text.end(), '\n') <= 18);
}

TEST_CASE("every file is written, and the JSON refers to the poses file beside it") {
  Desk desk;
  desk.arguments.json = desk.File("d.json");
  desk.arguments.model = desk.File("corrected.toml");
  desk.arguments.report = desk.File("r.html");
  CHECK(desk.Run(measure::Verdict::kAmbiguous) == kExitOk);
  CHECK(desk.Files() == 5);
  const auto json = text::JsonOrNull(files::ReadTextFile(desk.File("d.json")).value());
  CHECK(json["next_poses"] == "next_poses.csv");
  CHECK(desk.Has("next_poses.csv"));
  config::FaultList faults;
  const auto cell = config::ReadCell(desk.File("corrected.toml"), faults);
  REQUIRE(cell);
  CHECK(cell->effects[0].id == "tool_stiffness");
  CHECK(cell->effects[0].from_file == "measured.csv");
  CHECK(cell->effects[0].from_rows == 1);
  CHECK(files::ReadFileUpTo(files::kTableSize, desk.File("r.html"))->find("</html>") !=
        std::string::npos);

  desk.arguments.next_poses = desk.File("other.csv");
  CHECK(desk.Run(measure::Verdict::kAmbiguous) == kExitOk);
  CHECK(text::JsonOrNull(files::ReadTextFile(desk.File("d.json")).value())["next_poses"] ==
        "other.csv");
  CHECK(desk.Run(measure::Verdict::kExplained) == kExitOk);
  CHECK(text::JsonOrNull(files::ReadTextFile(desk.File("d.json")).value())["next_poses"].is_null());
}

TEST_CASE("the report carries its particulars, and digests of the files as they were read") {
  Desk desk;
  desk.arguments.report = desk.File("r.html");
  desk.arguments.model = desk.File("corrected.toml");
  desk.arguments.certificate_details = {.tolerance_m = 0.5e-3,
                                        .robot_serial = "KR 871",
                                        .site = "Hall 4",
                                        .measured_on = "2026-11-20",
                                        .instrument = "laser tracker",
                                        .instrument_serial = "SN 4711",
                                        .approved_by = "A. Approver"};
  CHECK(desk.Run(measure::Verdict::kExplained) == kExitOk);
  const std::string html = files::ReadFileUpTo(files::kTableSize, desk.File("r.html")).value();
  const std::string data = files::ReadTextFile(desk.arguments.measured).value(),
                    cell = files::ReadTextFile(kCell).value();
  const auto fingerprint = [](const std::string& text) {
    config::FaultList ignored;
    return config::ModelFingerprint(config::TomlDocument(text, "", ignored));
  };
  for (const std::string& part :
       {std::string("laser tracker"), std::string("SN 4711"), std::string("A. Approver"),
        std::string("KR 871"), std::string("Hall 4"), std::string("2026-11-20"),
        std::string("0.50 mm"), text::Sha256Hex(data), text::Sha256Hex(cell), fingerprint(cell),
        fingerprint(files::ReadTextFile(desk.File("corrected.toml")).value())}) {
    CAPTURE(part);
    CHECK(html.find(part) != std::string::npos);
  }
}

TEST_CASE("--pdf writes a PDF, or says what is missing before the diagnosis starts") {
  Desk desk;
  desk.arguments.pdf = desk.File("r.pdf");
  if (measure::WhyNoPdf().empty()) {
    CHECK(desk.Run(measure::Verdict::kNoEffect) == kExitOk);
    CHECK(files::ReadTextFile(desk.File("r.pdf"))->starts_with("%PDF-"));
    fs::remove(desk.File("r.pdf"));
  } else {
    WARN("SKIPPED: weasyprint is not installed");
  }
  const char* known = std::getenv("PATH");
  const std::string path = known != nullptr ? known : "";
  setenv("PATH", "/nonexistent", 1);
  bool started = false;
  CHECK(desk.Run([&started](const auto&, const auto&, const auto&) -> Result<measure::Diagnosis> {
    started = true;
    return Error{"not expected"};
  }) == kExitUsage);
  setenv("PATH", path.c_str(), 1);
  CHECK_FALSE(started);
  CHECK(desk.err.str().find("--pdf: weasyprint is not installed (Debian package weasyprint)") !=
        std::string::npos);
  CHECK(desk.Files() == 1);
  // A PDF that would overwrite the report is refused.
  desk.arguments.report = desk.arguments.pdf;
  CHECK(desk.Run(measure::Verdict::kNoEffect) == kExitUsage);
  CHECK(desk.err.str().find("--pdf would overwrite") != std::string::npos);
}

TEST_CASE("--json - is alone on standard output") {
  Desk desk;
  desk.arguments.json = "-";
  CHECK(desk.Run(measure::Verdict::kAmbiguous) == kExitOk);
  CHECK(text::JsonOrNull(desk.out.str())["verdict"] == "ambiguous");
  CHECK(desk.err.str().find("these points cannot distinguish them") != std::string::npos);
  CHECK(desk.Files() == 1);
  desk.arguments.quiet = true;
  CHECK(desk.Run(measure::Verdict::kAmbiguous) == kExitOk);
  CHECK(desk.err.str().find("cannot distinguish") == std::string::npos);
}

TEST_CASE("exit code 1 for faulty or unreadable input, 2 for unwritable output") {
  struct Case {
    const char* name;
    std::function<void(Desk&)> spoil;
    int exit_code;
    const char* says;
  };
  const Case cases[] = {
      {"no cell", [](Desk& desk) { desk.arguments.cell = desk.File("absent.toml"); }, kExitFault,
       "absent.toml: cannot be read: No such file"},
      {"no data", [](Desk& desk) { desk.arguments.measured = desk.File("absent.csv"); }, kExitFault,
       "absent.csv: cannot be read"},
      {"faulty cell",
       [](Desk& desk) {
         std::ofstream(desk.File("bad.toml")) << "schema = 1\n";
         desk.arguments.cell = desk.File("bad.toml");
       },
       kExitFault, "robot"},
      {"faulty data", [](Desk& desk) { std::ofstream(desk.File("measured.csv")) << "q1_deg\n1\n"; },
       kExitFault, "measured.csv"},
      {"unwritable report", [](Desk& desk) { desk.arguments.report = desk.File("absent/r.html"); },
       kExitUsage, "choose another --report"},
      {"a folder in place of the model", [](Desk& desk) { desk.arguments.model = desk.File(""); },
       kExitUsage, "choose another --write-model"}};
  for (const Case& c : cases) {
    CAPTURE(c.name);
    Desk desk;
    c.spoil(desk);
    CHECK(desk.Run(measure::Verdict::kExplained) == c.exit_code);
    INFO(desk.err.str());
    CHECK(desk.err.str().find(c.says) != std::string::npos);
    CHECK(desk.out.str().empty());
  }
}

TEST_CASE("an output that is an input, or another output, is refused") {
  struct Case {
    const char* name;
    std::function<void(Desk&)> ask;
    const char* says;
  };
  const Case cases[] = {
      {"the cell", [](Desk& desk) { desk.arguments.model = kCell; },
       "--write-model would overwrite"},
      {"the data", [](Desk& desk) { desk.arguments.report = desk.File("./measured.csv"); },
       "--report would overwrite"},
      {"poses proposed beside the JSON",
       [](Desk& desk) {
         fs::rename(desk.File("measured.csv"), desk.File("next_poses.csv"));
         desk.arguments.measured = desk.File("next_poses.csv");
         desk.arguments.json = desk.File("d.json");
       },
       "--next-poses would overwrite"},
      {"two outputs",
       [](Desk& desk) { desk.arguments.json = desk.arguments.report = desk.File("new"); },
       "--report would overwrite"}};
  for (const Case& c : cases) {
    CAPTURE(c.name);
    Desk desk;
    c.ask(desk);
    const std::string before = files::ReadTextFile(desk.arguments.measured).value();
    CHECK(desk.Run(measure::Verdict::kAmbiguous) == kExitUsage);
    CHECK(desk.err.str().find(c.says) != std::string::npos);
    CHECK(desk.Files() == 1);
    CHECK(files::ReadTextFile(desk.arguments.measured).value() == before);
  }
}

TEST_CASE("different spellings of a new file's path are recognised as the same file") {
  const std::string here = fs::current_path().string();
  for (const std::string& other : {std::string("./no-such.x"), here + "/no-such.x",
                                   std::string("config/../no-such.x"), here + "/./no-such.x"}) {
    CAPTURE(other);
    CHECK(SameFile("no-such.x", other));
    CHECK(SameFile(other, "no-such.x"));
  }
  CHECK_FALSE(SameFile("no-such.x", "config/no-such.x"));
  CHECK_FALSE(SameFile("", ""));
}

TEST_CASE("an engine error is a fault of the input") {
  Desk desk;
  desk.arguments.json = desk.File("d.json");
  CHECK(desk.Run([](const auto&, const auto&, const auto&) -> Result<measure::Diagnosis> {
    return Error{"6 rows are too few; measure at least 20"};
  }) == kExitFault);
  CHECK(desk.err.str().find("measured.csv: 6 rows are too few") != std::string::npos);
  CHECK_FALSE(desk.Has("d.json"));
}

TEST_CASE("a signal cancels with exit code 130, and no file is changed") {
  for (const int signal : {SIGINT, SIGTERM}) {
    CAPTURE(signal);
    Desk desk;
    desk.arguments.json = desk.File("d.json");
    desk.arguments.model = desk.File("c.toml");
    std::ofstream(desk.File("c.toml")) << "as it was";
    CHECK(
        desk.Run([signal](const auto&, const auto&,
                          const measure::DiagnosisOptions& options) -> Result<measure::Diagnosis> {
          if (options.interrupted()) return Error{"interrupted too early"};
          std::raise(signal);
          if (!options.interrupted()) return Error{"not told"};
          return Error{"interrupted"};
        }) == kExitInterrupted);
    CHECK_FALSE(desk.Has("d.json"));
    CHECK(files::ReadTextFile(desk.File("c.toml")).value() == "as it was");
    CHECK(desk.Files() == 2);
    CHECK(desk.err.str().find("no file was changed") != std::string::npos);
  }
}

TEST_CASE("a signal while the files are being replaced is ignored") {
  Desk desk;
  desk.arguments.json = desk.File("d.json");
  const auto late = [](const auto&, const auto&, const measure::DiagnosisOptions&) {
    return Result<measure::Diagnosis>(test::ExampleDiagnosis(measure::Verdict::kExplained));
  };
  CHECK(desk.Run(late) == kExitOk);
  CHECK(desk.Has("d.json"));
  for (const int signal : {SIGINT, SIGTERM}) std::raise(signal);  // the process lives on
  CHECK(desk.Run(late) == kExitOk);
  CHECK(desk.Run([](const auto&, const auto&, const auto&) -> Result<measure::Diagnosis> {
    std::raise(SIGINT);  // the next work can be interrupted again
    return Error{"interrupted"};
  }) == kExitInterrupted);
}

TEST_CASE("a refusal names the file once, and a linear joint is proposed in millimetres") {
  Desk desk;
  CHECK(desk.Run(measure::Diagnose) == kExitFault);
  const std::string refusal = desk.err.str();
  INFO(refusal);
  CHECK(refusal.find("has 1 usable rows") != std::string::npos);
  CHECK(refusal.find("measured.csv") == refusal.rfind("measured.csv"));

  measure::Diagnosis ambiguous = test::ExampleDiagnosis(measure::Verdict::kAmbiguous);
  REQUIRE_FALSE(ambiguous.next_poses.empty());
  model::CellModel cell = test::ExampleCell();
  cell.robot.joints[0].type = model::JointType::kPrismatic;
  ambiguous.next_poses[0].q[0] = 1.2345;
  const std::string text = measure::SummaryText(ambiguous, {cell});
  INFO(text);
  CHECK(text.find("linear joints in mm") != std::string::npos);
  CHECK(text.find("1:  1234.5") != std::string::npos);
}

}  // namespace plumbline::diagnose_command_test
