// A drive's bits depend only on its parameters, seed and commands.
#include <gtest/gtest.h>

#include <functional>

#include "model/tick.hpp"
#include "tests/model/mixed_run.hpp"

namespace lk::model::test {
namespace determinism_test {

const std::vector<int> kCompany{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};

TEST(Determinism, DrivesOfTheRunDiffer) {
  // Otherwise the tests below would also pass for drives that do nothing.
  const auto bits = mixed_run(kCompany, best_lane_kernel());
  for (std::size_t a = 0; a < bits.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      EXPECT_NE(bits[a], bits[b]) << a << ' ' << b;
    }
  }
}

TEST(Determinism, CompanyChangesNoBit) {
  const auto together = mixed_run(kCompany, best_lane_kernel());
  for (std::size_t n = 0; n < kCompany.size(); ++n) {
    // A single drive uses the scalar tick, so this also compares lanes with `double`.
    EXPECT_EQ(mixed_run({kCompany[n]}, best_lane_kernel()).front(), together[n]) << "drive " << n;
  }
  // Changed order, neighbours and lane.
  const auto reversed = mixed_run({12, 3, 3, 7, 0}, best_lane_kernel());
  EXPECT_EQ(reversed[0], together[12]);
  EXPECT_EQ(reversed[1], together[3]);
  EXPECT_EQ(reversed[2], together[3]);
  EXPECT_EQ(reversed[3], together[7]);
  EXPECT_EQ(reversed[4], together[0]);
}

TEST(Determinism, SlicesOfTimeChangeNoBit) {
  const auto whole = mixed_run({1, 2, 5, 9}, best_lane_kernel());
  for (const std::int64_t slice : {1, 3, 7, 100}) {
    EXPECT_EQ(mixed_run({1, 2, 5, 9}, best_lane_kernel(), slice), whole) << slice;
    EXPECT_EQ(mixed_run({5}, best_lane_kernel(), slice).front(), whole[2]) << slice;
  }
}

/// Returns the bits of the first of eight drives after each of four stretches. `change` changes the
/// start of the other seven; `act(bank, drive, stretch)` acts on them.
template <class Change, class Act>
std::vector<std::uint64_t> bits_beside(int kind, Change change, Act act) {
  std::vector<DriveInit> inits(kLanes, mixed_drive(kind));
  for (std::size_t n = 1; n < inits.size(); ++n) change(inits[n].params);
  DriveBank bank(inits);
  std::vector<std::uint64_t> bits;
  for (int stretch = 0; stretch < 4; ++stretch) {
    for (std::size_t n = 0; n < inits.size(); ++n) {
      bank.command(n, Speed{20.0 - 15.0 * stretch});
      if (n > 0) act(bank, n, stretch);
    }
    bank.advance(1000);
    const auto words = bits_of(bank, 0);
    bits.insert(bits.end(), words.begin(), words.end());
  }
  return bits;
}
const auto kUnchanged = [](DriveParams&) {};
const auto kNoAct = [](DriveBank&, std::size_t, int) {};

/// A block runs the parts of the tick that any of its drives needs (tick.hpp, Parts).
TEST(Determinism, NeighboursParametersChangeNoBit) {
  const auto expected = bits_beside(0, kUnchanged, kNoAct);
  const std::vector<std::function<void(DriveParams&)>> changes{
      [](DriveParams& d) { d.load.tau_gravity = 0.3; },
      [](DriveParams& d) { d.load.theta_max = 0.5; },
      [](DriveParams& d) { d.mechanics = mixed_drive(2).params.mechanics; },  // a springy gear
      [](DriveParams& d) { d.mechanics.tau_cogging = 0.01, d.encoder.inl_1 = 2e-3; }};
  for (std::size_t n = 0; n < changes.size(); ++n) {
    EXPECT_EQ(bits_beside(0, changes[n], kNoAct), expected) << "change " << n;
  }
}

TEST(Determinism, NeighbourThatIsOffChangesNoBit) {
  const auto off_later = [](DriveBank& bank, std::size_t drive, int stretch) {
    if (stretch > 1) bank.command(drive, Off{});
  };
  EXPECT_EQ(bits_beside(0, kUnchanged, off_later), bits_beside(0, kUnchanged, kNoAct));
}

TEST(Determinism, ScalarAndVectorGiveEqualBits) {
  NamedKernel plain = lane_kernel("baseline");
  plain.run_single = run_block<double>;
  for (const int kind : {0, 1, 2, 5}) {
    EXPECT_EQ(mixed_run({kind}, plain), mixed_run({kind}, best_lane_kernel())) << kind;
  }
}

TEST(Determinism, CompanyChangesNoBitOfFaultyDrives) {
  const auto broken = [](const std::vector<int>& kinds, std::int64_t slice = kStretchTicks) {
    return mixed_run(kinds, best_lane_kernel(), slice, true);
  };
  const auto together = broken(kCompany);
  const auto whole = mixed_run(kCompany, best_lane_kernel());
  for (std::size_t n = 0; n < kCompany.size(); ++n) {
    EXPECT_EQ(broken({kCompany[n]}).front(), together[n]) << "drive " << n;
    EXPECT_NE(whole[n], together[n]) << "drive " << n;
  }
  EXPECT_EQ(broken({12, 3, 7, 0})[2], together[7]);
  EXPECT_EQ(broken(kCompany, 7), together);
}

TEST(Determinism, NeighboursFaultsChangeNoBit) {
  const auto expected = bits_beside(1, kUnchanged, kNoAct);
  for (int kind = 0; kind < 24; kind += 3) {
    const auto spoil = [kind](DriveBank& bank, std::size_t drive, int stretch) {
      bank.set_faults(drive,
                      stretch == 2 ? Faults{} : mixed_faults(kind + static_cast<int>(drive)));
    };
    EXPECT_EQ(bits_beside(1, kUnchanged, spoil), expected) << kind;
  }
}

TEST(Determinism, FaultsBetweenTwoTicksChangeNoBit) {
  const std::vector<DriveInit> inits(3, mixed_drive(0));
  DriveBank bank(inits);
  DriveBank untouched(inits);
  for (DriveBank* b : {&bank, &untouched}) {
    b->command(1, Speed{30.0});
    b->advance(1001);
  }
  bank.set_faults(1, {.encoder_noise = 0.1,
                      .v_bus_stuck = 3.0,
                      .legs = {LegFault::kPhaseOpen, LegFault::kHighShorted},
                      .jam = 1.0,
                      .v_source_max = 3.0,
                      .clock_ratio = 2.0});
  bank.set_faults(1, {});
  bank.advance(1000);
  untouched.advance(1000);
  EXPECT_EQ(bits_of(bank, 1), bits_of(untouched, 1));
}

class Kernels : public testing::TestWithParam<const char*> {};

TEST_P(Kernels, GiveEqualBits) {
  const NamedKernel kernel = lane_kernel(GetParam());
  if (kernel.run == nullptr) {
    GTEST_SKIP() << "not run: this processor or build has no " << GetParam();
  }
  EXPECT_EQ(mixed_run(kCompany, kernel), mixed_run(kCompany, lane_kernel("baseline")));
  EXPECT_EQ(mixed_run({4}, kernel), mixed_run({4}, lane_kernel("baseline"))) << "alone";
  const auto broken = [](const NamedKernel& with) {
    return mixed_run(kCompany, with, kStretchTicks, true);
  };
  EXPECT_EQ(broken(kernel), broken(lane_kernel("baseline"))) << "faulty";
}

INSTANTIATE_TEST_SUITE_P(Determinism, Kernels, testing::Values("avx2", "avx512"),
                         [](const auto& name) { return std::string(name.param); });

/// Merges drives of several banks, some faulty, into one bank, and some of these into another.
TEST(Determinism, MovingToAnotherBankChangesNoBit) {
  for (const char* const name : {"baseline", "avx2", "avx512"}) {
    const NamedKernel kernel = lane_kernel(name);
    if (kernel.run == nullptr) continue;
    std::vector<DriveBank> banks;
    for (const std::vector<int>& kinds : {std::vector{0, 2}, {5}, {1, 3, 4, 6, 7, 8, 9, 10, 11}}) {
      std::vector<DriveInit> inits;
      for (const int kind : kinds) inits.push_back(mixed_drive(kind));
      banks.emplace_back(inits, kernel);
      for (std::size_t n = 0; n < kinds.size(); ++n) {
        banks.back().command(n, Speed{20.0});
        if (n == 1) banks.back().set_faults(n, mixed_faults(kinds[n]));
      }
      banks.back().advance(1001);
    }
    const std::vector<DriveOf> all{{&banks[2], 8}, {&banks[0], 0}, {&banks[1], 0},
                                   {&banks[2], 1}, {&banks[0], 1}, {&banks[2], 5}};
    DriveBank together(all);
    DriveBank one({{DriveOf{&together, 3}}});
    EXPECT_EQ(one.ticks(), 1001);
    together.advance(1500);
    one.advance(1500);
    for (DriveBank& bank : banks) bank.advance(1500);
    for (std::size_t n = 0; n < all.size(); ++n) {
      EXPECT_EQ(bits_of(together, n), bits_of(*all[n].bank, all[n].drive)) << name << ' ' << n;
    }
    EXPECT_EQ(bits_of(one, 0), bits_of(together, 3)) << name;
    EXPECT_EQ(one.inputs(0).faults, banks[2].inputs(1).faults) << name;
  }
}

TEST(Determinism, CopyContinuesLikeTheOriginal) {
  const std::vector<int> kinds{4, 8, 11};
  std::vector<DriveInit> inits;
  for (const int kind : kinds) {
    inits.push_back(mixed_drive(kind));
  }
  DriveBank bank(inits);
  for (std::size_t n = 0; n < kinds.size(); ++n) {
    bank.command(n, Speed{20.0});
  }
  bank.advance(1001);  // not a multiple of the motion loops' period
  DriveBank copy = bank;
  copy.advance(500);
  const DriveBank later = copy;
  bank.advance(500);
  for (std::size_t n = 0; n < kinds.size(); ++n) {
    EXPECT_EQ(bits_of(bank, n), bits_of(later, n));
  }
  copy.command(0, Off{});
  copy.advance(500);
  EXPECT_NE(bits_of(bank, 0), bits_of(copy, 0));
  EXPECT_EQ(bits_of(bank, 0), bits_of(later, 0));  // not affected by its copy
}

TEST(Determinism, SeedChangesOnlyTheNoise) {
  DriveInit a = mixed_drive(1);
  DriveInit b = a;
  b.seed += 1;
  DriveBank bank(std::vector<DriveInit>{a, b});
  bank.advance(3200);
  EXPECT_NE(bank.telemetry(0).i_a, bank.telemetry(1).i_a);
  EXPECT_NEAR(bank.truth(0).theta_m, bank.truth(1).theta_m, 1e-2);

  a.params.encoder.noise = b.params.encoder.noise = 0.0;
  a.params.current_sensor.noise = b.params.current_sensor.noise = 0.0;
  a.params.slow_sensor.v_noise = b.params.slow_sensor.v_noise = 0.0;
  DriveBank silent(std::vector<DriveInit>{a, b});
  silent.command(0, Speed{10.0});
  silent.command(1, Speed{10.0});
  silent.advance(3200);
  EXPECT_EQ(bits_of(silent, 0), bits_of(silent, 1));
}

}  // namespace determinism_test
}  // namespace lk::model::test
