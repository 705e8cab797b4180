// A cell file of an arm model, for tests of its prior.
#pragma once

#include <string>

namespace plumbline::siblings_test {

inline std::string PriorCell(const std::string& model = "KR 210",
                             const std::string& first_a_mm = "350.0") {
  return "schema = 1\n[robot]\nname = \"line 3\"\nmodel = \"" + model +
         "\"\nconvention = \"dh\"\ngravity_m_s2 = [0, 0, -9.81]\njoint = [\n"
         "  { a_mm = " +
         first_a_mm +
         ", alpha_deg = -90.0, d_mm = 675.0, link_mass_kg = 200.0, link_com_mm = [0, 0, 0] },\n"
         "  { a_mm = 1150.0, alpha_deg = 0.0, d_mm = 0.0, link_mass_kg = 100.0, link_com_mm = "
         "[-500, 0, 0] },\n"
         "  { a_mm = 40.0, alpha_deg = 0.0, d_mm = 0.0, link_mass_kg = 50.0, link_com_mm = "
         "[0, 0, 0] },\n]\n"
         "[tool]\nmodel = \"rigid\"\ntcp_mm = [0, 0, 100]\n[payload]\ncog_mm = [0, 0, 0]\n"
         "[measurement]\nkind = \"position\"\n";
}

}  // namespace plumbline::siblings_test
