#include "ompl_planner/config.h"

#include <cmath>
#include <stdexcept>
#include <utility>

namespace ompl_planner {
namespace {

struct NumberField {
  const char* name;
  double PlannerConfig::*member;
  double low;   // smallest valid value
  double high;  // largest valid value
};

const std::vector<NumberField>& numberFields() {
  using C = PlannerConfig;
  static const std::vector<NumberField> fields{
      {"time_budget_s", &C::time_budget_s, 1e-3, 3600.0},
      {"padding_m", &C::padding_m, 0.0, 0.5},
      {"search_margin_m", &C::search_margin_m, 0.0, 0.1},
      {"self_padding_m", &C::self_padding_m, 0.0, 0.5},
      {"self_search_margin_m", &C::self_search_margin_m, 0.0, 0.1},
      {"start_tolerance_m", &C::start_tolerance_m, 0.0, 0.2},
      {"joint_step_rad", &C::joint_step_rad, 1e-4, 0.2},
      {"search_step_rad", &C::search_step_rad, 1e-4, 0.5},
      {"field_cap_m", &C::field_cap_m, 0.02, 0.8},
      {"limit_tolerance_rad", &C::limit_tolerance_rad, 0.0, 0.2},
      {"position_tolerance_m", &C::position_tolerance_m, 1e-6, 1.0},
      {"angle_tolerance_rad", &C::angle_tolerance_rad, 1e-6, 3.15},
      {"quality_rounds", &C::quality_rounds, 1, 1e9},
      {"range_rad", &C::range_rad, 1e-2, 100.0},
      {"ik_rounds", &C::ik_rounds, 1, 10000},
      {"ik_step_rad", &C::ik_step_rad, 0.01, 3.2},
      {"ik_starts", &C::ik_starts, 1, 10000},
      {"max_goal_states", &C::max_goal_states, 1, 100000},
      {"detour_ratio", &C::detour_ratio, 1.0, 1e6},
      {"detour_searches", &C::detour_searches, 0, 1000},
      {"detour_rounds", &C::detour_rounds, 1, 1e9},
      {"shortcut_rounds", &C::shortcut_rounds, 0, 100000},
      {"blend_radius_rad", &C::blend_radius_rad, 0.0, 10.0},
      {"sample_period_s", &C::sample_period_s, 1e-3, 0.1},
      {"smoothing_time_s", &C::smoothing_time_s, 0.0, 1.0},
      {"limit_share", &C::limit_share, 0.01, 1.0},
      {"default_max_velocity", &C::default_max_velocity, 1e-3, 100.0},
      {"default_max_acceleration", &C::default_max_acceleration, 1e-3, 1000.0}};
  return fields;
}

struct TextField {
  const char* name;
  std::string PlannerConfig::*member;
};

constexpr TextField kTextFields[] = {{"planner", &PlannerConfig::planner},
                                     {"world_check", &PlannerConfig::world_check}};

std::string validNames() {
  std::string names = "planner, world_check";
  for (const auto& field : numberFields()) names += std::string(", ") + field.name;
  return names;
}

void setOne(PlannerConfig& config, const std::string& name, const ConfigValue& value) {
  for (const auto& field : kTextFields) {
    if (name != field.name) continue;
    const auto* text = std::get_if<std::string>(&value);
    if (text == nullptr) throw std::invalid_argument("parameter '" + name + "' must be a string");
    config.*(field.member) = *text;
    return;
  }
  for (const auto& field : numberFields()) {
    if (name != field.name) continue;
    const double* number = std::get_if<double>(&value);
    if (number == nullptr) throw std::invalid_argument("parameter '" + name + "' must be a number");
    config.*(field.member) = *number;
    return;
  }
  throw std::invalid_argument("unknown parameter '" + name + "'; valid: " + validNames());
}

}  // namespace

void PlannerConfig::set(const std::map<std::string, ConfigValue>& values) {
  PlannerConfig changed = *this;
  for (const auto& [name, value] : values) setOne(changed, name, value);
  changed.validate();
  *this = changed;
}

std::map<std::string, ConfigValue> PlannerConfig::values() const {
  std::map<std::string, ConfigValue> out;
  for (const auto& field : kTextFields) out[field.name] = this->*(field.member);
  for (const auto& field : numberFields()) out[field.name] = this->*(field.member);
  return out;
}

void PlannerConfig::validate() const {
  if (world_check != "distance_field" && world_check != "fcl_octree") {
    throw std::invalid_argument("parameter 'world_check' is '" + world_check +
                                "', valid: distance_field, fcl_octree");
  }
  for (const auto& field : numberFields()) {
    const double value = this->*(field.member);
    if (!(value >= field.low && value <= field.high)) {
      throw std::invalid_argument("parameter '" + std::string(field.name) + "' is " + std::to_string(value) +
                                  ", valid: " + std::to_string(field.low) + " to " +
                                  std::to_string(field.high));
    }
  }
}

TimingOptions PlannerConfig::timing() const {
  TimingOptions options;
  options.sample_period_s = sample_period_s;
  options.smoothing_time_s = smoothing_time_s;
  options.limit_share = limit_share;
  return options;
}

}  // namespace ompl_planner
