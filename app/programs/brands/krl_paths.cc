#include "app/programs/brands/krl_paths.h"

#include <fmt/format.h>

#include <algorithm>

namespace plumbline::programs::krl {
namespace {

bool ContainsWord(std::string_view words, std::string_view word) {
  const std::string lowered = " " + Lowered(word) + " ";
  return words.find(lowered) != std::string_view::npos;
}

}  // namespace

std::optional<std::size_t> IndexIn(const std::array<std::string_view, 6>& names,
                                   std::string_view name) {
  const auto found = std::ranges::find(names, name);
  if (found == names.end()) return std::nullopt;
  return static_cast<std::size_t>(found - names.begin());
}

bool IsPoseType(std::string_view type) {
  return type == "e6pos" || type == "pos" || type == "frame";
}

bool IsJointType(std::string_view type) {
  return type == "e6axis" || type == "axis";
}
bool IsPoint(const Aggregate& aggregate) {
  return std::ranges::any_of(aggregate.members, [](const Aggregate::Member& member) {
    return IndexIn(kPoseComponents, member.name) || IndexIn(kJointComponents, member.name);
  });
}

bool IsJoints(const Aggregate& aggregate) {
  return IsJointType(aggregate.type) ||
         std::ranges::any_of(aggregate.members, [](const Aggregate::Member& member) {
           return IndexIn(kJointComponents, member.name).has_value();
         });
}

std::string_view FirstPart(std::string_view path) {
  const std::size_t next = path.find_first_of("[.", 1);
  return path.substr(0, next);
}

bool Overlap(std::string_view pattern, std::string_view path) {
  while (!pattern.empty() && !path.empty()) {
    const std::string_view a = FirstPart(pattern), b = FirstPart(path);
    if (a != b && !(a.starts_with('[') && b.starts_with('[') && (a == "[*]" || b == "[*]"))) {
      return false;
    }
    pattern.remove_prefix(a.size());
    path.remove_prefix(b.size());
  }
  return true;
}

bool HasUnknownIndex(std::string_view path) {
  return path.find("[*]") != std::string_view::npos;
}
std::string IndexPath(const Statement& statement, std::size_t open, std::size_t behind) {
  std::string path = "[";
  for (std::size_t at = open + 1; at + 1 < behind; ++at) {
    const Token& token = statement.tokens[at];
    if (token.Is(',')) {
      path += ',';
      continue;
    }
    const auto number = WholeNumberIn(token.text);
    if (!number) return "[*]";
    path += fmt::format("{}", *number);
  }
  return path.size() == 1 ? "[*]" : path + "]";
}

bool IsSystemRoutine(std::string_view name) {
  return ContainsWord(
      " bas ir_stopm abs sqrt sin cos tan acos asin atan2 exp log round b_and b_or b_exor "
      "b_not "
      "cast_to cast_from copen cclose cread cwrite sread swrite cioctl varstate inverse "
      "forward "
      "inv_pos ek eb lk strlen strcopy stradd strclear strcomp strfind strtoint strtoreal "
      "set_torque_limits reset_torque_limits set_sys_data get_sys_data pulse err_raise err_clear "
      "sigm msgnotify msgquit msgdialog "
      "msgloop clear_msg set_kk maximize p00 tm_bib msg_log user_grp svel_joint svel_cp "
      "sacc_joint "
      "sacc_cp sgear_jerk sapo sapo_ptp sjerk sori_typ sipo_mode stool stool2 sbase sload "
      "frames tool base invertframe set_krlmsg clear_krlmsg exists_krlmsg set_krldlg "
      "exists_krldlg "
      "is_key_pressed mbx_rec sync eo eb_test eb_abs get_collmon_set test_brake md_cmd "
      "md_setstate "
      "md_getstate getsysstate ismessageset ",
      name);
}

bool IsKeyword(std::string_view word) {
  return ContainsWord(
      " if then else endif for to step endfor while endwhile repeat until loop endloop exit "
      "switch "
      "case default endswitch goto return halt wait sec continue interrupt brake resume "
      "trigger "
      "and or not exor b_and b_or b_exor b_not true false with do when prio distance delay "
      "path "
      "onstart on off ",
      word);
}

bool IsType(std::string_view word) {
  return ContainsWord(
      " int real bool char e6pos pos frame e6axis axis fdat pdat ldat load inertia ", word);
}

}  // namespace plumbline::programs::krl
