#include "app/programs/brands/urscript_functions.h"

#include <algorithm>
#include <string>

namespace plumbline::programs::urscript {

namespace {

constexpr std::string_view kServo = "servo motion: the point is the set point of a running loop";
constexpr std::array<MotionFunction, 6> kMotions = {{
    {"movej", MotionKind::kJoint, {"q", ""}, 4, ""},
    {"movel", MotionKind::kLinear, {"pose", ""}, 4, ""},
    {"movep", MotionKind::kLinear, {"pose", ""}, 3, ""},
    {"movec", MotionKind::kCircular, {"pose_via", "pose_to"}, 4, ""},
    {"servoj", MotionKind::kJoint, {"q", ""}, 0, kServo},
    {"servoc", MotionKind::kCircular, {"pose", ""}, 0, kServo},
}};

constexpr std::array<ShiftFunctions, 6> kShifts = {{
    {"force_mode", "end_force_mode", "force control moves the robot off its targets"},
    {"path_offset_enable", "path_offset_disable", "path offsets are added while it runs"},
    {"path_offset_set", "path_offset_disable", "path offsets are added while it runs"},
    {"track_conveyor_linear", "stop_conveyor_tracking", "the targets follow a conveyor"},
    {"track_conveyor_circular", "stop_conveyor_tracking", "the targets follow a conveyor"},
    {"screw_driving", "end_screw_driving", "the robot follows a screw"},
}};

constexpr std::array<std::string_view, 5> kSettings = {"set_tcp", "set_payload", "set_payload_mass",
                                                       "set_payload_cog", "set_target_payload"};

constexpr std::array<std::string_view, 10> kMoves = {
    "speedj",    "speedl",        "freedrive_mode",     "teach_mode",
    "set_pos",   "direct_torque", "force_mode_example", "tool_contact_examples",
    "optimovej", "optimovel"};

/// Functions of the language that move nothing and set neither tool nor load: Universal Robots, The
/// URScript Programming Language. Full names, in order; a blank around each.
constexpr std::string_view kHarmless =
    " abs acos and asin assert atan atan2 binary_list_to_integer ceil conveyor_pulse_decode cos "
    "d2r disable_external_ft_sensor eip_reader_factory eip_writer_factory "
    "enable_external_ft_sensor encoder_enable_pulse_decode encoder_enable_set_tick_count "
    "encoder_get_tick_count encoder_set_tick_count encoder_unwind_delta_tick_count "
    "end_freedrive_mode end_teach_mode enter_critical exit_critical exp floor force "
    "force_mode_set_damping force_mode_set_gain_scaling ft_rtde_input_enable "
    "get_actual_joint_positions get_actual_joint_positions_history get_actual_joint_speeds "
    "get_actual_tcp_pose get_actual_tcp_speed get_actual_tool_flange_pose get_analog_in "
    "get_analog_out get_configurable_digital_in get_configurable_digital_out get_controller_temp "
    "get_conveyor_tick_count get_coriolis_and_centrifugal_torques get_digital_in get_digital_out "
    "get_euromap_input get_euromap_output get_flag get_forward_kin get_freedrive_status "
    "get_inverse_kin get_inverse_kin_has_solution get_jacobian get_jacobian_time_derivative "
    "get_joint_positions get_joint_temp get_joint_torques get_list_length get_mass_matrix "
    "get_rtde_value get_standard_analog_in get_standard_analog_out get_standard_digital_in "
    "get_standard_digital_out get_steptime get_target_joint_accelerations "
    "get_target_joint_positions get_target_joint_speeds get_target_payload "
    "get_target_payload_cog get_target_payload_inertia get_target_tcp_pose "
    "get_target_tcp_pose_along_path get_target_tcp_speed get_target_tcp_speed_along_path "
    "get_target_waypoint get_tcp_force get_tcp_offset get_tool_accelerometer_reading "
    "get_tool_analog_in get_tool_current get_tool_digital_in get_tool_digital_out "
    "high_holding_torque_disable high_holding_torque_enable integer_to_binary_list "
    "interpolate_pose inv is_steady is_within_safety_limits length log make_list "
    "modbus_add_rw_signal modbus_add_signal modbus_delete_signal modbus_get_error "
    "modbus_get_signal_status modbus_get_time_since_signal_invalid modbus_send_custom_command "
    "modbus_set_digital_input_action modbus_set_output_register modbus_set_output_signal "
    "modbus_set_runstate_dependent_choice modbus_set_signal_update_frequency "
    "modbus_set_signal_update_period modbus_set_signal_watchdog norm normalize not or "
    "path_offset_get path_offset_set_alpha_filter path_offset_set_max_offset pause_on_error_code "
    "point_dist popup pose_add pose_dist pose_inv pose_sub pose_trans position_deviation_warning "
    "pow powerdown r2d random read_input_boolean_register read_input_float_register "
    "read_input_integer_register read_output_boolean_register read_output_float_register "
    "read_output_integer_register read_port_bit read_port_register "
    "request_boolean_from_primary_client request_float_from_primary_client "
    "request_integer_from_primary_client request_string_from_primary_client "
    "reset_revolution_counter reset_world_model rotvec2rpy rpc_factory rpy2rotvec "
    "rtde_set_watchdog set_analog_inputrange set_analog_out set_analog_outputdomain "
    "set_configurable_digital_input_action set_configurable_digital_out set_conveyor_tick_count "
    "set_digital_out set_euromap_output set_euromap_runstate_dependent_choice set_flag "
    "set_gp_boolean_input_action set_gravity set_input_actions_to_default "
    "set_runstate_configurable_digital_output_to_value set_runstate_gp_boolean_output_to_value "
    "set_runstate_standard_analog_output_to_value set_runstate_standard_digital_output_to_value "
    "set_runstate_tool_digital_output_to_value set_safety_mode_transition_hardness "
    "set_standard_analog_input_domain set_standard_analog_out set_standard_digital_input_action "
    "set_standard_digital_out set_tool_analog_input_domain set_tool_communication "
    "set_tool_digital_input_action set_tool_digital_out set_tool_digital_output_mode "
    "set_tool_output_mode set_tool_voltage sin size sleep socket_close socket_get_var "
    "socket_open socket_read_ascii_float socket_read_binary_integer socket_read_byte_list "
    "socket_read_line socket_read_string socket_send_byte socket_send_int socket_send_line "
    "socket_send_string socket_set_var sqrt stop stopj stopl str_at str_cat str_empty str_find "
    "str_len str_sub struct sync tan textmsg to_num to_str tool_contact transpose wrench_trans "
    "write_output_boolean_register write_output_float_register write_output_integer_register "
    "write_port_bit write_port_register xor zero_ftsensor ";

}  // namespace

const MotionFunction* FindMotion(std::string_view function) {
  for (const MotionFunction& motion : kMotions) {
    if (motion.name == function) return &motion;
  }
  return nullptr;
}

const ShiftFunctions* FindShift(std::string_view function) {
  for (const ShiftFunctions& shift : kShifts) {
    if (shift.begins == function || shift.ends == function) return &shift;
  }
  return nullptr;
}

FunctionKind KindOf(std::string_view function) {
  const auto is = [&](const auto& names) {
    return std::find(names.begin(), names.end(), function) != names.end();
  };
  if (FindMotion(function) != nullptr) return FunctionKind::kMotion;
  if (FindShift(function) != nullptr) return FunctionKind::kShift;
  if (is(kSettings)) return FunctionKind::kSetting;
  if (is(kMoves)) return FunctionKind::kMoves;
  // A method of an object, rpc.name(..), runs outside the robot program.
  const bool harmless = function.find('.') != std::string_view::npos ||
                        kHarmless.find(" " + std::string(function) + " ") != std::string_view::npos;
  return harmless ? FunctionKind::kHarmless : FunctionKind::kOther;
}

}  // namespace plumbline::programs::urscript
