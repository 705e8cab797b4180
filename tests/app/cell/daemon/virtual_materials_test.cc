// The virtual cell has its materials from its own table: both must mean the same by a name.
#include <catch2/catch.hpp>
#include <fstream>

#include "firmware-like/model/materials.h"
#include "tests/app/cell/daemon/daemon_process.h"
#include "tests/virtual_cell/cell_description.h"

namespace plumbline::virtual_materials_test {

TEST_CASE("the virtual cell knows every material by the product's name and value") {
  const plumbline::test::TemporaryFolder folder;
  const std::string file = folder.path() + "/cell.toml";
  for (const plumbline::model::NamedMaterial& named : plumbline::model::NamedMaterials()) {
    CAPTURE(std::string(named.name));
    std::ofstream(file) << "schema = 1\n[robot]\nconvention = \"dh\"\n[[robot.joint]]\na_mm = 0\n"
                           "alpha_deg = 0\nd_mm = 100\n[tool]\nmodel = \"timoshenko\"\n"
                           "length_mm = 100\nsection = \"rectangle\"\nb_mm = 1000\nh_mm = 1000\n"
                           "material = \""
                        << named.name << "\"\n";
    const virtual_cell::RodSegment rod = virtual_cell::ReadCellFile(file).rod.at(0);
    CHECK(rod.EA == Approx(named.material.youngs_modulus_Pa));
    CHECK(rod.EA / rod.GA == Approx(2 * (1 + named.material.poisson_ratio)));
    CHECK(rod.weight_kg_m == Approx(named.material.density_kg_m3));
  }
}

}  // namespace plumbline::virtual_materials_test
