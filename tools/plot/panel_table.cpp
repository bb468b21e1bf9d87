#include "tools/plot/panel_table.hpp"

namespace lk::emulator {
namespace {

using enum LineStyle;

// One row a line. What is true is broad and pale, so that what was measured can be seen on it.
// clang-format off
constexpr PlotQuantity kPosition[] = {
    {"true_rotor_deg", {"true, from the first one measured", "真实值（从首个测量值起）"}, kBroad, false, {}, "angle_deg"},
    {"true_angle_deg", {"true, output shaft", "真实值（输出轴）"}, kBroad, false, "true_rotor_deg"},
    {"angle_deg", {"measured", "测量值"}, kSolid},
    {"angle_ref_deg", {"reference", "给定"}, kDashed},
};
constexpr PlotQuantity kSpeed[] = {
    {"true_rotor_dps", {"true", "真实值"}, kBroad},
    {"true_speed_dps", {"true, output shaft", "真实值（输出轴）"}, kBroad, false, "true_rotor_dps"},
    {"speed_dps", {"measured", "测量值"}, kSolid},
    {"speed_ref_dps", {"reference", "给定"}, kDashed},
};
constexpr PlotQuantity kCurrent[] = {
    {"true_iq_A", {"iq, true", "iq 真实值"}, kBroad},
    {"true_id_A", {"id, true", "id 真实值"}, kDotted},
    {"iq_A", {"iq, measured", "iq 测量值"}, kSolid},
    {"iq_ref_A", {"iq, reference", "iq 给定"}, kDashed},
};
constexpr PlotQuantity kHeatAndSupply[] = {
    {"winding_C", {"winding, true", "绕组真实值"}, kBroad},
    {"temperature_C", {"motor", "电机温度"}, kSolid},
    {"driver_temperature_C", {"power stage", "驱动温度"}, kDotted},
    {"voltage_V", {"voltage (right)", "电压（右轴）"}, kDashDotted, true},
    {"true_voltage_V", {"voltage, true (right)", "电压真实值（右轴）"}, kDashDotted, true, "voltage_V"},
};
constexpr PlotSubject kSubjects[] = {
    {{"Position", "位置"}, {"position, °", "位置，°"}, 1, {}, 0, kPosition},
    {{"Speed", "转速"}, {"speed, °/s", "转速，°/s"}, 10, {}, 0, kSpeed},
    {{"Current", "电流"}, {"current, A", "电流，A"}, 0.5, {}, 0, kCurrent},
    {{"Temperature and voltage", "温度与电压"}, {"temperature, °C", "温度，°C"}, 4, {"voltage, V", "电压，V"}, 2, kHeatAndSupply},
};
// clang-format on

}  // namespace

std::span<const PlotSubject> plot_subjects() { return kSubjects; }

}  // namespace lk::emulator
