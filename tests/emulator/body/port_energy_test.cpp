// Energy between drives and joints is conserved, also when limbs hit the floor.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "emulator/body/mujoco_body.hpp"
#include "emulator/config/scenario/config_scenario.hpp"
#include "emulator/core/scenario/scenario_run.hpp"
#include "tests/emulator/body/body_support.hpp"
#include "tests/support/profile.hpp"

namespace lk::test {
namespace port_energy_test {

using namespace emulator;

const std::string kConfigs = std::string(LKEMU_SOURCE_DIR) + "/configs/";

struct Books {
  double given_J = 0;   // ∫τ·dq with the joint motion of the drives
  double taken_J = 0;   // with the joint motion of MuJoCo
  double passed_J = 0;  // absolute value of taken_J, summed
  int contacts = 0;     // largest number in a step
};

/// Accounts for the energy of its ports.
class Audited : public MujocoBody {
 public:
  Audited(const std::string& file, SimTime step, std::shared_ptr<Books> books)
      : MujocoBody(file, step), books_(std::move(books)) {}
  std::unique_ptr<Mechanism> clone() const override { return std::make_unique<Audited>(*this); }
  void advance(std::span<const JointTorque> torques) override {
    std::vector<double> before;
    for (std::size_t n = 0; n < torques.size(); ++n) before.push_back(joint(n).angle_rad);
    MujocoBody::advance(torques);
    for (std::size_t n = 0; n < torques.size(); ++n) {
      if (torques[n].mean_Nm == 0) continue;
      books_->given_J += torques[n].mean_Nm * (torques[n].angle_rad - before[n]);
      const double taken = torques[n].mean_Nm * (joint(n).angle_rad - before[n]);
      books_->taken_J += taken;
      books_->passed_J += std::abs(taken);
    }
    books_->contacts = std::max(books_->contacts, data().ncon);
  }

 private:
  std::shared_ptr<Books> books_;
};

/// Returns the energies of a delivered scenario at its end.
Books energy_of(const std::string& scenario_name) {
  const auto books = std::make_shared<Books>();
  const LoadBody load = [&](const std::string& /*file*/, const std::string& model, SimTime step) {
    return std::make_shared<Audited>(kConfigs + "bodies/" + model + ".xml", step, books);
  };
  const ScenarioFiles files{.robot =
                                [&](const std::string& name, const Overrides& overrides) {
                                  const std::string file = kConfigs + "buses/" + name + ".toml";
                                  return parse_config(text_of(file), file, overrides, profile,
                                                      load);
                                },
                            .text = {}};
  const std::string file = kConfigs + "scenarios/" + scenario_name + ".toml";
  const Scenario scenario = parse_scenario(text_of(file), file, std::nullopt, files);
  ScenarioRun run(scenario);
  run.advance_to(scenario.duration);
  EXPECT_EQ(run.verdict().outcome, Outcome::kPassed) << scenario_name;
  return *books;
}

/// Two joints without contacts: 0.1 % of the transferred energy.
TEST(PortEnergy, GivenIsTaken) {
  const Books books = energy_of("arm_coupling_breaks");
  EXPECT_EQ(books.contacts, 0);
  EXPECT_GT(books.passed_J, 1);
  EXPECT_NEAR(books.given_J, books.taken_J, 1e-3 * books.passed_J);
}

/// Twelve joints in closed chains, each with the others' state of the previous step: the error is
/// 0.5 % (docs/guides/robots.md).
TEST(PortEnergy, OfContactsLittleIsLeftOver) {
  const Books books = energy_of("dog_misses_a_command");
  EXPECT_GE(books.contacts, 4);
  EXPECT_GT(books.passed_J, 10);
  EXPECT_NEAR(books.given_J, books.taken_J, 1e-2 * books.passed_J);
  RecordProperty("residual", std::to_string((books.given_J - books.taken_J) / books.passed_J));
}

}  // namespace port_energy_test
}  // namespace lk::test
