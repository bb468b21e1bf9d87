#include "model/control/life.hpp"

namespace lk::model {

bool live(const LogicParams& p, double v_link, double T, LifeState& s) {
  const Life before = s.life;
  if (v_link < p.v_reset) {
    s.life = Life::kInReset;
    return before == Life::kAlive;
  }
  switch (s.life) {
    case Life::kAlive:
      return false;
    case Life::kInReset:
      if (v_link >= p.v_reset + p.v_reset_hysteresis) {
        s = {Life::kBooting, p.boot_time};
      }
      return false;
    case Life::kBooting:
      s.boot_left -= T;
      if (s.boot_left <= 0.0) {
        s.life = Life::kAlive;
      }
      return s.life == Life::kAlive;
  }
  return false;
}

}  // namespace lk::model
