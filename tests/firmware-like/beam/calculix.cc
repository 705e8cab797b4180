#include "tests/firmware-like/beam/calculix.h"

#include <fmt/format.h>

#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>

#include "tests/file_text.h"

namespace plumbline::test {
namespace {

std::string MaterialCards(const std::string& name, const model::Material& material) {
  return fmt::format("*MATERIAL,NAME={}\n*ELASTIC\n{:.10g},{:.10g}\n*DENSITY\n{:.10g}\n", name,
                     material.youngs_modulus_Pa, material.poisson_ratio, material.density_kg_m3);
}

std::string GravityCards(const std::string& element_set, const Vec3& g_F) {
  const double size = g_F.norm();
  if (size == 0) return "";
  const Vec3 along = g_F / size;
  return fmt::format("*DLOAD\n{},GRAV,{:.10g},{:.10g},{:.10g},{:.10g}\n", element_set, size,
                     along.x(), along.y(), along.z());
}

std::string ForceCards(int node, const Vec3& force) {
  std::string cards;
  for (int axis = 0; axis < 3; ++axis) {
    if (force[axis] != 0) {
      cards += fmt::format("*CLOAD\n{},{},{:.12g}\n", node, axis + 1, force[axis]);
    }
  }
  return cards;
}

constexpr const char* kPrintCards = "*NODE PRINT,NSET=AXIS\nU\n*END STEP\n";

std::string NodeCard(int node, const Vec3& p) {
  return fmt::format("{},{:.10g},{:.10g},{:.10g}\n", node, p.x(), p.y(), p.z());
}

/// Node numbers of the set AXIS and their z, from the deck's own comment lines "** z NODE Z".
std::map<int, double> AxisNodes(const std::string& deck) {
  std::map<int, double> z_of_node;
  std::istringstream lines(deck);
  for (std::string line; std::getline(lines, line);) {
    int node = 0;
    double z_m = 0;
    std::string stars, letter;
    std::istringstream words(line);
    if (words >> stars >> letter >> node >> z_m && stars == "**" && letter == "z") {
      z_of_node[node] = z_m;
    }
  }
  return z_of_node;
}

std::string AxisCards(const std::map<int, double>& axis) {
  std::string comments, set = "*NSET,NSET=AXIS\n";
  for (const auto& [node, z_m] : axis) {
    comments += fmt::format("** z {} {:.10g}\n", node, z_m);
    set += fmt::format("{},\n", node);
  }
  return comments + set;
}

}  // namespace

std::string BeamDeck(const std::vector<DeckSegment>& segments, const DeckLoad& load) {
  std::string nodes = "*NODE\n" + NodeCard(1, Vec3::Zero());
  std::string elements, sections, materials, gravity;
  std::map<int, double> axis;
  int node = 1, element = 0, segment_number = 0;
  double root_m = 0;
  for (const DeckSegment& segment : segments) {
    const std::string set = fmt::format("S{}", ++segment_number);
    const std::string material = fmt::format("M{}", segment_number);
    elements += fmt::format("*ELEMENT,TYPE=B32R,ELSET={}\n", set);
    for (int e = 0; e < segment.elements; ++e) {
      for (const double part : {0.5, 1.0}) {
        const double z_m = root_m + segment.length_m * (e + part) / segment.elements;
        nodes += NodeCard(++node, Vec3(0, 0, z_m));
        if (part == 1.0) axis[node] = z_m;
      }
      elements += fmt::format("{},{},{},{}\n", ++element, node - 2, node - 1, node);
    }
    root_m += segment.length_m;
    sections += fmt::format("*BEAM SECTION,ELSET={},MATERIAL={},SECTION={}\n", set, material,
                            segment.section);
    for (std::size_t i = 0; i < segment.dimensions.size(); ++i) {
      sections += fmt::format("{}{:.10g}", i == 0 ? "" : ",", segment.dimensions[i]);
    }
    sections += "\n1.,0.,0.\n";
    materials += MaterialCards(material, segment.material);
    gravity += GravityCards(set, load.g_F);
  }
  return nodes + elements + AxisCards(axis) + materials + sections +
         "*BOUNDARY\n1,1,6\n*STEP\n*STATIC\n" + ForceCards(node, load.tip_force_F) + gravity +
         kPrintCards;
}

std::string SolidDeck(double b_m, double h_m, double length_m, const model::Material& material,
                      const std::array<int, 3>& elements, const DeckLoad& load) {
  // Nodes lie on a grid of half elements: corners, and the middles of edges.
  const auto& [nx, ny, nz] = elements;
  std::map<std::array<int, 3>, int> number;
  std::map<int, double> axis;
  std::string nodes = "*NODE\n", fixed;
  std::vector<int> tip_nodes;
  for (int k = 0; k <= 2 * nz; ++k) {
    for (int j = 0; j <= 2 * ny; ++j) {
      for (int i = 0; i <= 2 * nx; ++i) {
        if (i % 2 + j % 2 + k % 2 > 1) continue;
        const int node = static_cast<int>(number.size()) + 1;
        number[{i, j, k}] = node;
        const Vec3 p(b_m * (i - nx) / (2 * nx), h_m * (j - ny) / (2 * ny), length_m * k / (2 * nz));
        nodes += NodeCard(node, p);
        if (i == nx && j == ny && k > 0) axis[node] = p.z();
        if (k == 0) fixed += fmt::format("{},3,3\n", node);
        if (k == 0 && i == nx) fixed += fmt::format("{},1,1\n", node);
        if (k == 0 && j == ny) fixed += fmt::format("{},2,2\n", node);
        if (k == 2 * nz) tip_nodes.push_back(node);
      }
    }
  }
  static constexpr int kCorners[20][3] = {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}, {0, 0, 2},
                                          {2, 0, 2}, {2, 2, 2}, {0, 2, 2}, {1, 0, 0}, {2, 1, 0},
                                          {1, 2, 0}, {0, 1, 0}, {1, 0, 2}, {2, 1, 2}, {1, 2, 2},
                                          {0, 1, 2}, {0, 0, 1}, {2, 0, 1}, {2, 2, 1}, {0, 2, 1}};
  std::string bricks = "*ELEMENT,TYPE=C3D20R,ELSET=S1\n";
  int element = 0;
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        bricks += fmt::format("{}", ++element);
        for (int n = 0; n < 20; ++n) {
          const auto& c = kCorners[n];
          bricks += fmt::format(",{}{}", n == 10 ? "\n" : "",
                                number.at({2 * i + c[0], 2 * j + c[1], 2 * k + c[2]}));
        }
        bricks += "\n";
      }
    }
  }
  std::string forces;
  for (const int node : tip_nodes) {
    forces += ForceCards(node, load.tip_force_F / static_cast<double>(tip_nodes.size()));
  }
  return nodes + bricks + AxisCards(axis) + MaterialCards("M1", material) +
         "*SOLID SECTION,ELSET=S1,MATERIAL=M1\n*BOUNDARY\n" + fixed + "*STEP\n*STATIC\n" + forces +
         GravityCards("S1", load.g_F) + kPrintCards;
}

bool CalculixInstalled() {
  return std::system("command -v ccx > /dev/null 2>&1") == 0;
}

std::vector<AxisNode> SolveWithCalculix(const std::string& deck) {
  std::string folder = (std::filesystem::temp_directory_path() / "plumbline-ccx-XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr) throw std::runtime_error("no temporary folder");
  const std::filesystem::path path(folder);
  std::ofstream(path / "beam.inp") << deck;
  const int status =
      std::system(fmt::format("cd '{}' && ccx beam > beam.log 2>&1", folder).c_str());
  const std::string log = FileText(path / "beam.log");
  std::istringstream lines(FileText(path / "beam.dat"));
  std::filesystem::remove_all(path);

  const std::map<int, double> z_of_node = AxisNodes(deck);
  std::vector<AxisNode> found;
  for (std::string line; std::getline(lines, line);) {
    int node = 0;
    Vec3 d_F = Vec3::Zero();
    std::istringstream words(line);
    if (words >> node >> d_F.x() >> d_F.y() >> d_F.z()) found.push_back({z_of_node.at(node), d_F});
  }
  if (status != 0 || found.size() != z_of_node.size()) {
    throw std::runtime_error("ccx gave no displacements; it said:\n" + log);
  }
  return found;
}

}  // namespace plumbline::test
