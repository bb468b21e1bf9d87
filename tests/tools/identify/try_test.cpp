#include <gtest/gtest.h>
#include <cstdio>
#include "tests/tools/identify/planted.hpp"
#include "tools/identify/position_loop_fit.hpp"
#include "model/control/motion_loops.hpp"
#include "emulator/core/servo/registers.hpp"
namespace lk::test {
TEST(Try, It) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const Planted made = planted(seed);
    const auto limits = emulator::plan_limits(made.base);
    const auto log = plan_log(made, seed, emulator::plan_steps(limits), 2 * limits.speed_dps);
    const auto tracks = emulator::read_tracks(log, {.base = made.base, .generation = {}, .id = {}});
    if (tracks.empty()) { std::printf("none\n"); continue; }
    const auto fit = emulator::fit_balance(tracks[0]);
    if (!fit) { std::printf("nofit\n"); continue; }
    const auto show = [](const char* name, const emulator::Estimate& e, double truth) {
      std::printf(" %s %+.1f%% ±%.1f%%%s", name, (e.value / truth - 1) * 100, e.half_width / truth * 100, std::abs(e.value - truth) > e.half_width ? "!" : "");
    };
    std::printf("%2u %s %.0fHz n%zu I%.2f:", seed, made.base.name.c_str(), made.rate_Hz, tracks[0].samples.size(), limits.current_A);
    show("J", fit->inertia_A_s2, made.inertia_A_s2());
    show("C", fit->coulomb_A, made.coulomb_A());
    show("B", fit->viscous_A_s, made.viscous_A_s());
    const auto loops = emulator::fit_speed_loop(tracks[0], *fit);
    const auto pos = emulator::fit_position_loop(tracks[0], *fit, loops);
    const auto p = model::motion_params(made.servo.profile.drive, emulator::control_settings(made.servo.rom));
    if (loops.kp_A_s) show("Kp", *loops.kp_A_s, p.speed_kp);
    if (loops.ki_A) show("Ki", *loops.ki_A, p.speed_ki);
    if (pos) { show("Ka", pos->angle_kp_per_s, p.angle_kp); show("Kp", pos->speed_kp_A_s, p.speed_kp); show("Ki", pos->speed_ki_A, p.speed_ki); std::printf(" %.2g deg", pos->rms_rad * 57.3); }
    std::erase_if(const_cast<emulator::BalanceFit&>(*fit).cogging, [&](const auto& c) { return c.order == made.base.drive.motor.pole_pairs; });
    if (fit->cogging.empty()) std::printf(" nocog");
    else { show("cog", fit->cogging[0].amplitude_A, made.cogging_A()); std::printf(" n%d/%d (%zu)", fit->cogging[0].order, made.cogging_order(), fit->cogging.size()); }
    std::printf(" delay %.2f ms w%zu/%zu rms %.4f held %.2f ac %.2f\n", fit->delay_s * 1e3, fit->check.windows, fit->check.commanded, fit->check.rms_A, fit->check.held_out_ratio, fit->check.autocorrelation);
  }
}
}
