#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "tests/simulator/artefacts.h"
#include "tests/simulator/families.h"
#include "tests/simulator/fit.h"
#include "tests/simulator/noise.h"

namespace {

using namespace simulator;
using nlohmann::json;

struct Options {
  std::string family = "none", robot = "kr210", out;
  std::uint64_t seed = 1;
  double sigma_mm = 0.05, declared_sigma = 1.0, signal = 10.0;
  bool unaligned = false, rigid_joints = false, camera = false, masses_unknown = false;
  Design design;
  Noise noise;
  double sigma_deg = 0.0;
  bool range = false;
  std::string artefacts;
  int places = 6;
  bool tool_unknown = false;
  std::string declared_cell, design_poses;
  std::string cell, measured, tests, with, columns;
  bool fit = false;
  std::vector<double> cycles = {1, 2};
};

json ReadJson(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error("cannot read " + path);
  return json::parse(file);
}

/// Pose of an unaligned instrument and actual tip position, per session.
Effects Nuisances(const Design& design, Generator& random) {
  const auto uniform = [&](double size) {
    return std::uniform_real_distribution<double>(-size, size)(random);
  };
  Effects list;
  for (int k = 1; k <= design.sessions; ++k) {
    const std::string session = design.sessions > 1 ? std::to_string(k) : "";
    Effect base{.id = "base_frame",
                .scope = {},
                .parameters = {},
                .by = {},
                .frame = {},
                .session = session};
    for (const char* axis : {"x", "y", "z"}) base.parameters.push_back({axis, uniform(3000), "mm"});
    for (const char* angle : {"roll", "pitch"}) {
      base.parameters.push_back({angle, uniform(0.3), "deg"});
    }
    base.parameters.push_back({"yaw", uniform(180), "deg"});
    Effect tip{.id = "tool_frame",
               .scope = {},
               .parameters = {},
               .by = {},
               .frame = {},
               .session = session};
    for (const char* axis : {"x", "y", "z"}) tip.parameters.push_back({axis, uniform(20), "mm"});
    list.push_back(base);
    list.push_back(tip);
  }
  return list;
}

/// Effects that are equivalent for these rows.
json Equivalents(const Cell& cell, const Cell& declared, const Effects& effects,
                 const std::vector<Row>& rows) {
  json list = json::array();
  const Changes changes(effects, int(cell.joints.size()));
  const Arm arm(cell, changes);
  const bool weighed = std::all_of(declared.joints.begin(), declared.joints.end(),
                                   [](const Joint& joint) { return joint.mass_known; });
  for (const Effect& effect : effects) {
    if (effect.id == "joint_compliance" && !weighed) {
      list.push_back({{"instead_of", effect.id}, {"id", "gravity_sag"}, {"scope", effect.scope}});
    }
    if (effect.id == "counterbalance") {
      list.push_back({{"instead_of", effect.id}, {"id", "gear_periodic"}, {"scope", {"q2"}}});
    }
    if (effect.id == "gear_periodic" && effect.scope == std::vector<std::string>{"q2"} &&
        effect.parameters[1].value == 1.0) {
      list.push_back({{"instead_of", effect.id}, {"id", "counterbalance"}, {"scope", {"q2"}}});
    }
    if (effect.id != "backlash") continue;
    bool constant = true;
    for (const std::string& name : effect.scope) {
      const int joint = std::stoi(name.substr(1)) - 1;
      double first = 0.0;
      for (const Row& row : rows) {
        const double driver =
            effect.by == "move" ? row.last_move_rad[joint] : arm.Torques(row)[joint];
        if (driver == 0.0) continue;
        if (first == 0.0) first = driver;
        constant = constant && driver * first > 0.0;
      }
    }
    if (constant) {
      list.push_back({{"instead_of", "backlash"}, {"id", "joint_offset"}, {"scope", effect.scope}});
    }
  }
  return list;
}

/// Recorded signals that are indistinguishable in this design.
json InterchangeableDrivers(const Design& design, const Hidden& hidden) {
  const bool of_warmth = hidden.drivers == std::vector<std::string>{"temp_C"};
  return design.steady_rise && of_warmth ? json{"t_s", "temp_C"} : json::array();
}

/// Removes the link masses from a cell.
void Unweigh(Cell& cell) {
  for (Joint& joint : cell.joints) {
    joint.mass_kg = 0.0;
    joint.mass_known = false;
  }
}

/// Converts measured positions to ranges from the anchor.
void ToRanges(const Cell& cell, const Effects& effects, Table& measured) {
  const Changes changes(effects, int(cell.joints.size()));
  const Arm arm(cell, changes);
  for (Row& row : measured.rows) row.range_m = arm.Range(row.xyz_m);
  measured.xyz = false;
  measured.range = true;
}

/// Appends the artefacts to a cell file, whose schema becomes 2.
void AppendArtefacts(const Artefacts& artefacts, const std::string& path) {
  std::ifstream file(path);
  std::string text((std::istreambuf_iterator<char>(file)), {});
  text.replace(0, std::string("schema = 1").size(), "schema = 2");
  std::ofstream(path) << text << ArtefactsText(artefacts);
}

/// Places and directions as they are, for judging.
json ArtefactsJson(const Artefacts& artefacts) {
  json list = json::array();
  for (const Artefact& artefact : artefacts.all) {
    const Eigen::Vector3d at_mm = 1e3 * artefact.at_m;
    list.push_back(
        {{"name", artefact.name},
         {"kind", artefact.kind},
         {"xyz_mm", {at_mm.x(), at_mm.y(), at_mm.z()}},
         {"direction", {artefact.direction.x(), artefact.direction.y(), artefact.direction.z()}}});
  }
  return list;
}

void Generate(Options options) {
  Cell cell =
      options.declared_cell.empty() ? ReadyCell(options.robot) : ReadCell(options.declared_cell);
  cell.sigma_m = options.sigma_mm * 1e-3;
  cell.sigma_rad = options.sigma_deg * kDeg;
  cell.unaligned = options.unaligned;
  cell.tool_unknown = options.unaligned || options.tool_unknown;
  if (options.camera || NeedsCamera(options.family)) cell.camera = CameraBeside(cell);
  if (options.range || NeedsRange(options.family)) cell.anchor_m = AnchorBeside(cell);
  if (options.rigid_joints || options.masses_unknown || NeedsUnknownMasses(options.family)) {
    for (Joint& joint : cell.joints) joint.compliance_rad_per_Nm.reset();
  }
  if (NeedsUnknownMasses(options.family)) Unweigh(cell);
  options.design.tilt = options.design.tilt || NeedsTilt(options.family);
  options.design.dynamic = options.design.dynamic || NeedsVelocities(options.family);
  options.design.pressure = options.design.pressure || NeedsPressure(options.family);
  std::uint64_t seed = options.seed * 1000003;
  for (const char letter : options.family) seed = seed * 31 + std::uint64_t(letter);
  Generator random(seed);
  Tables tables = options.design_poses.empty() ? DrawDesign(cell, options.design, random)
                                               : DesignAt(ReadTable(options.design_poses, cell),
                                                          cell, options.design, random);
  Artefacts artefacts;
  if (!options.artefacts.empty()) {
    artefacts =
        DrawArtefacts(options.artefacts, options.places, cell, tables.measured.rows, random);
    TouchArtefacts(artefacts, cell, {}, tables.measured, random);  // so that effects can be scaled
  }
  Hidden hidden = DrawFamily(options.family, cell, random);
  if (hidden.rigid_declared) {
    for (Joint& joint : cell.joints) joint.compliance_rad_per_Nm.reset();
  } else {
    ScaleTo(options.signal, cell, tables.measured.rows, hidden.effects);
  }
  const Effects nuisances = options.unaligned ? Nuisances(options.design, random) : Effects();
  Effects all = nuisances;
  all.insert(all.end(), hidden.effects.begin(), hidden.effects.end());
  std::vector<int> outliers;
  if (artefacts.all.empty()) {
    outliers = Measure(cell, options.noise, Tips(cell, all, tables.measured.rows), tables.measured,
                       random);
    if (cell.sigma_rad > 0.0) {
      MeasureAxes(cell, TipsAxes(cell, all, tables.measured.rows), tables.measured, random);
    }
  } else {
    TouchArtefacts(artefacts, cell, all, tables.measured, random);
  }
  if (cell.anchor_m) ToRanges(cell, all, tables.measured);
  const auto truth = Tips(cell, all, tables.tests.rows);
  const auto before = Tips(cell, nuisances, tables.tests.rows);
  double square = 0.0;
  for (std::size_t k = 0; k < truth.size(); ++k) square += (truth[k] - before[k]).squaredNorm();

  std::filesystem::create_directories(options.out);
  cell.name = options.family;
  Cell declared = cell;
  declared.sigma_m *= options.declared_sigma;
  if (options.masses_unknown) {
    WriteCell(declared, options.out + "/true_cell.toml");
    Unweigh(declared);
  }
  WriteCell(declared, options.out + "/cell.toml");
  if (!artefacts.all.empty()) AppendArtefacts(artefacts, options.out + "/cell.toml");
  WriteTable(tables.measured, options.out + "/measured.csv");
  WriteTable(tables.tests, options.out + "/test_poses.csv");
  WritePoints(truth, options.out + "/test_truth.csv");
  json by_id = json::object();
  for (const Effect& effect : hidden.effects) {
    for (const Parameter& p : effect.parameters) by_id[effect.id][p.name] = p.value;
  }
  const json truth_json = {
      {"name", options.family},
      {"seed", options.seed},
      {"robot", options.robot},
      {"sigma", cell.sigma_m},
      {"declared_sigma", declared.sigma_m},
      {"n_train", options.design.rows},
      {"n_test", options.design.tests},
      {"family", options.family},
      {"dyn", options.design.dynamic},
      {"vertical", options.design.vertical},
      {"unaligned", options.unaligned},
      {"tool_unknown", cell.tool_unknown},
      {"artefacts", ArtefactsJson(artefacts)},
      {"truth", by_id},
      {"effects", ToJson(hidden.effects)},
      {"nuisances", ToJson(nuisances)},
      {"equivalents", Equivalents(cell, declared, all, tables.measured.rows)},
      {"in_catalogue", hidden.in_catalogue},
      {"drivers", hidden.drivers},
      {"interchangeable_drivers", InterchangeableDrivers(options.design, hidden)},
      {"signal", Signal(cell, hidden.effects, tables.measured.rows)},
      {"outlier_rows", outliers},
      {"before_test_rms_mm",
       std::sqrt(square / double(std::max<std::size_t>(1, truth.size()))) * 1e3}};
  std::ofstream(options.out + "/truth.json") << truth_json.dump(1) << "\n";
}

Effects With(const Options& options) {
  if (options.with.empty()) return {};
  const json given = ReadJson(options.with);
  Effects effects = EffectsFromJson(given.value("nuisances", json::array()));
  for (const Effect& effect : EffectsFromJson(given.at("effects"))) effects.push_back(effect);
  return effects;
}

/// Writes columns as a JSON header and a binary file of doubles, column by column.
void WriteColumns(const Options& options) {
  const Cell cell = ReadCell(options.cell);
  const Table table = ReadTable(options.measured, cell);
  std::ofstream values(options.out + ".bin", std::ios::binary);
  json heads = json::array();
  for (const Column& column : Columns(cell, With(options), table, options.cycles)) {
    heads.push_back(
        {{"id", column.id}, {"name", column.name}, {"unit", column.unit}, {"scope", column.scope}});
    values.write(reinterpret_cast<const char*>(column.slope_mm.data()),
                 std::streamsize(column.slope_mm.size()) * 8);
  }
  std::ofstream(options.out + ".json") << heads.dump(1) << "\n";
}

void FitAndPredict(const Options& options) {
  const Cell cell = ReadCell(options.cell);
  Effects effects = With(options);
  if (options.fit) {
    const FitResult fit = Fit(cell, effects, ReadTable(options.measured, cell));
    effects = fit.effects;
    std::ofstream(options.out + ".json")
        << json{{"effects", ToJson(effects)}, {"rms_mm", fit.rms_m * 1e3}}.dump(1) << "\n";
  }
  const Table poses = ReadTable(options.tests, cell);
  if (poses.range) {
    const Eigen::VectorXd ranges = Readings(cell, effects, poses.rows);
    std::ofstream file(options.out);
    file << "range_mm\n";
    for (const double range : ranges) file << fmt::format("{:.5f}\n", range);
    return;
  }
  WritePoints(Tips(cell, effects, poses.rows), options.out);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Generates measured data with hidden effects, and fits with known effect form");
  Options o;
  bool list = false;
  app.add_flag("--list", list, "List the families and exit");
  app.add_option("--family", o.family, "Hidden effects; A+B@q2,q3+C for several");
  app.add_option("--seed", o.seed);
  app.add_option("--out", o.out,
                 "Output folder; with --fit or --predict the file of predicted points");
  app.add_option("--robot", o.robot, "kr210, ur10, arm6 or lift");
  app.add_option("--rows", o.design.rows, "Poses");
  app.add_option("--repeats", o.design.repeats, "Number of repeated visits among them");
  app.add_option("--tests", o.design.tests, "Number of noise-free test poses");
  app.add_option("--sigma-mm", o.sigma_mm);
  app.add_option("--sigma-deg", o.sigma_deg, "Measure orientations, too, with this noise");
  app.add_option("--signal", o.signal, "RMS displacement of each effect divided by sqrt(3) sigma");
  app.add_option("--sessions", o.design.sessions);
  app.add_option("--outliers", o.noise.outliers,
                 "Fraction of the rows displaced by 10 to 100 sigma");
  app.add_flag("--heavy-tails", o.noise.heavy_tails, "Student's t with 3 degrees of freedom");
  app.add_flag("--outlier-runs", o.noise.runs, "Outliers in 3 to 7 consecutive rows at a time");
  app.add_option("--ar1", o.noise.ar1, "Correlation of the noise of consecutive rows")
      ->check(CLI::Range(0.0, 0.99));
  app.add_flag("--tracker-noise", o.noise.tracker, "Noise that grows with the tracker's distance");
  app.add_option("--declared-sigma", o.declared_sigma, "Ratio of declared to true sigma");
  app.add_flag("--steady-rise", o.design.steady_rise, "Temperature that rises linearly with time");
  app.add_option("--tests-warmer-K", o.design.tests_warmer_K,
                 "Test poses warmer than the measured range by this much");
  app.add_option("--declared-cell", o.declared_cell, "Cell file instead of --robot");
  app.add_option("--design-poses", o.design_poses,
                 "Use the poses of a file instead of random ones");
  app.add_flag("--dyn", o.design.dynamic, "Record velocities and accelerations");
  app.add_flag("--vertical", o.design.vertical, "Tool straight down, one payload");
  app.add_flag("--one-payload", o.design.one_payload, "The same payload in every row");
  app.add_flag("--rigid-joints", o.rigid_joints, "Rigid joints, declared as such");
  app.add_flag("--masses-unknown", o.masses_unknown,
               "Omit link masses from the cell file; joints are rigid except for hidden effects");
  app.add_flag("--range", o.range, "Measure distances from an anchor");
  app.add_option("--artefacts", o.artefacts,
                 "Measure with sockets, gauges or wires instead of an instrument");
  app.add_option("--places", o.places, "Number of places of sockets, or of wires");
  app.add_flag("--tool-unknown", o.tool_unknown, "The cell declares the tip as a guess");
  app.add_flag("--inclinometer", o.design.tilt, "Record the tilt of the base");
  app.add_flag("--camera", o.camera, "Measure with a camera beside the arm");
  app.add_flag("--unaligned", o.unaligned, "Unknown instrument and tool frames");
  bool predict = false;
  app.add_flag("--fit", o.fit, "Fit the effects of --with to --measured, predict --poses");
  app.add_flag("--predict", predict, "Predict --poses with the effects of --with");
  app.add_option("--with", o.with, "truth.json or a similar file: effects (and nuisances)");
  app.add_option("--cell", o.cell);
  app.add_option("--measured", o.measured);
  app.add_option("--poses", o.tests, "Poses to predict");
  bool columns = false;
  app.add_flag("--columns", columns,
               "Write the design-matrix columns of every effect for --measured");
  app.add_option("--cycles", o.cycles, "Cycles per turn for the periodic columns")->delimiter(',');
  CLI11_PARSE(app, argc, argv);
  try {
    if (list) {
      for (const std::string& name : Families()) fmt::print("{}\n", name);
    } else if (o.out.empty()) {
      throw std::runtime_error("--out is missing");
    } else if (columns) {
      WriteColumns(o);
    } else if (o.fit || predict) {
      FitAndPredict(o);
    } else {
      Generate(o);
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "plumbline-simulate: {}\n", error.what());
    return 1;
  }
  return 0;
}
