// Registers 1000..1039, which clients write: the table that gives every command register its
// address.
#pragma once

#include <array>
#include <stdexcept>
#include <string_view>

#include "drivers/plc/register_map.h"

namespace plumbline {

inline constexpr std::array kCommandFields = {
    CommandField{
        1000, FieldType::kU16, "command_code", "code",
        "1 correct a configured point, 2 correct the pose in 1002-1013, 3 correct the "
        "pose in 1020-1025, 4 tell where the pose in 1002-1013 lands, 5 acknowledge, 6 record a "
        "probe (measured tip in 1002-1007, measurement frame), 7 likewise from 1032-1037, "
        "8 restart the drift monitor, 9 start a calibration of the lens, 10 cancel it, 11 record a "
        "probe by camera"},
    CommandField{1001, FieldType::kU16, "command_point", "", "id of the point, for code 1"},
    CommandField{1002, FieldType::kFloat, "command_x", "mm",
                 "wanted pose of the tool point, robot base frame"},
    CommandField{1004, FieldType::kFloat, "command_y", "mm", ""},
    CommandField{1006, FieldType::kFloat, "command_z", "mm", ""},
    CommandField{1008, FieldType::kFloat, "command_rx", "deg",
                 "orientation, convention of register 3"},
    CommandField{1010, FieldType::kFloat, "command_ry", "deg", ""},
    CommandField{1012, FieldType::kFloat, "command_rz", "deg", ""},
    CommandField{1014, FieldType::kFloat, "command_payload", "kg",
                 "mass to compute with; 0 or less: what the robot carries now"},
    CommandField{1016, FieldType::kU16, "command_camera", "",
                 "for codes 9 to 11: 1 the first camera, 2 the second; 0: 9 those that ask for "
                 "the board (all, where none does), 10 all, 11 all that see the tip"},
    CommandField{1020, FieldType::kI16, "command_x_scaled", "0.1 mm", "wanted pose for code 3"},
    CommandField{1021, FieldType::kI16, "command_y_scaled", "0.1 mm", ""},
    CommandField{1022, FieldType::kI16, "command_z_scaled", "0.1 mm", ""},
    CommandField{1023, FieldType::kI16, "command_rx_scaled", "mrad", "rotation vector, always"},
    CommandField{1024, FieldType::kI16, "command_ry_scaled", "mrad", ""},
    CommandField{1025, FieldType::kI16, "command_rz_scaled", "mrad", ""},
    CommandField{1030, FieldType::kU16, "plc_heartbeat", "", "change it at least every 2 s"},
    CommandField{1031, FieldType::kU16, "plc_flags", "bits", "bit 0: operated by hand"},
    CommandField{1032, FieldType::kI32, "probe_x_fine", "0.001 mm",
                 "measured tip for code 7, measurement frame"},
    CommandField{1034, FieldType::kI32, "probe_y_fine", "0.001 mm", ""},
    CommandField{1036, FieldType::kI32, "probe_z_fine", "0.001 mm", ""},
    CommandField{1039, FieldType::kU16, "command_sequence", "",
                 "write it last; a new value executes, once"},
};

/// The register of that name; a name that is not in the table does not compile.
consteval CommandField CommandNamed(std::string_view name) {
  for (const CommandField& field : kCommandFields) {
    if (name == field.name) return field;
  }
  throw std::invalid_argument("no such command register");
}

}  // namespace plumbline
