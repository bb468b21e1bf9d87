// Compares the closed form of one period of the windings with a general matrix exponential (Eigen),
// without dq, series or 2×2 formulas (docs/internals/model.md §3).
#include <Eigen/Dense>
#include <random>
#include <unsupported/Eigen/MatrixFunctions>

#include "tests/model/support.hpp"

namespace lk::model::test {
namespace matrix_exponential_test {

/// d/dt [i; ∫i; u] = [A 0 I; I 0 0; 0 0 0]·[i; ∫i; u]: one exponential gives the final currents and
/// their integrals; u is the constant input.
Eigen::Matrix<double, 6, 6> augmented(double R, double L_d, double L_q, double omega_e) {
  Eigen::Matrix2d A;
  A << -R / L_d, omega_e * L_q / L_d, -omega_e * L_d / L_q, -R / L_q;
  Eigen::Matrix<double, 6, 6> M = Eigen::Matrix<double, 6, 6>::Zero();
  M.block<2, 2>(0, 0) = A;
  M.block<2, 2>(0, 4).setIdentity();
  M.block<2, 2>(2, 0).setIdentity();
  return M;
}

TEST(MatrixExponential, AgreesWithTheClosedFormForRandomMachines) {
  std::mt19937_64 random(7);  // any seed: the bound must always hold
  const auto draw = [&random](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  for (int n = 0; n < 2000; ++n) {
    const double R = draw(0.05, 3.0);
    const double T = 1.0 / 32e3;
    DriveParams d = ideal_drive();
    // L/R of 0.25 ms and more: T·R/L ≤ 0.125, the range stated for exp_small.
    d.motor.L_d = R * draw(0.25e-3, 2e-3);
    d.motor.L_q = d.motor.L_d * draw(1.0, 3.0);
    const double omega_e = draw(-8000.0, 8000.0);  // 0.25 rad a period
    const Dq<double> i{draw(-20, 20), draw(-20, 20)};
    const Dq<double> v{draw(-24, 24), draw(-24, 24)};
    const double psi = draw(0.001, 0.03);

    const double v_link = 24.0;
    const auto step = driven_windings<double>(
        plant_params(d), i, {{v.d / v_link, v.q / v_link}, {0.0, 0.0}}, v_link, R, psi, omega_e);

    const Eigen::Matrix<double, 6, 6> scaled = augmented(R, d.motor.L_d, d.motor.L_q, omega_e) * T;
    const Eigen::Matrix<double, 6, 6> transition = scaled.exp();
    Eigen::Matrix<double, 6, 1> x;
    x << i.d, i.q, 0.0, 0.0, v.d / d.motor.L_d, (v.q - omega_e * psi) / d.motor.L_q;
    const Eigen::Matrix<double, 6, 1> y = transition * x;

    // The truncated series have an error of 2e-8 of the currents at the ends of the drawn ranges.
    const double scale = 20.0 + x.tail<2>().norm() * T;
    EXPECT_NEAR(step.i_next.d, y(0), 5e-8 * scale) << "machine " << n;
    EXPECT_NEAR(step.i_next.q, y(1), 5e-8 * scale) << "machine " << n;
    // The mean divides this error by T·R/L or ω·T, at least 0.016.
    EXPECT_NEAR(step.i_mean.d, y(2) / T, 5e-6 * scale) << "machine " << n;
    EXPECT_NEAR(step.i_mean.q, y(3) / T, 5e-6 * scale) << "machine " << n;
  }
}

}  // namespace matrix_exponential_test
}  // namespace lk::model::test
