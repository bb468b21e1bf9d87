#include "tools/commands/commands.hpp"

namespace lk::emulator {
namespace {

constexpr Command kCommands[] = {
    {"campaign", "run many cases of a scenario with faults, and report the results", run_campaigns,
     campaign_app},
    {"ctl", "inspect and control a running lk-emu", run_ctl, ctl_app},
    {"decode", "explain the frames of a bus, from candump's output", run_decode, decode_app},
    {"demo", "show a robot that walks or draws, in the browser", run_demo, demo_app},
    {"faults", "list the faults that can be injected, or show one of them", run_faults, faults_app},
    {"identify", "estimate a motor's parameters from its logs, and write a motor file",
     run_identify, identify_app},
    {"motors", "list the motor profiles, or show one of them", run_motors, motors_app},
    {"plot", "draw a CSV file of a run as SVG or PNG", run_plot, plot_app},
    {"replay", "run a recording again and compare, or compare a real robot's log", run_replay,
     replay_app},
    {"run", "run scenarios in simulated time, without a CAN bus", run_scenarios, scenarios_app},
};

}  // namespace

std::span<const Command> commands() { return kCommands; }

}  // namespace lk::emulator
