// A two-link arm in Simbody whose joints are driven by lk-emu:
//
//     g++ -std=c++17 -I/usr/include/simbody simbody.cpp -o simbody_arm -lSimTK{simbody,math,common}
//     lk-emu --config two_drives.toml --shafts unix:/tmp/shafts &
//     ./simbody_arm /tmp/shafts 2 > angles.csv
//
// Simbody computes the mass matrix and the torques of gravity and velocity. Its joints have no
// armature. Therefore this program adds the armature to the matrix and integrates with the
// fourth-order Runge-Kutta method.
#include <Simbody.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "lk_shafts.h"

namespace {

constexpr double kStep_s = 0.001;
constexpr std::uint32_t kJoints = 2;
using Two = std::array<double, kJoints>;
using Bytes = std::vector<unsigned char>;

/// The arm of two_joints.xml: two links that rotate about y and hang down at 0.
class Arm {
 public:
  Arm() : matter_(system_), forces_(system_), gravity_(forces_, matter_, SimTK::Vec3(0, 0, -9.81)) {
    using namespace SimTK;
    const Vec3 middle(0, 0, -0.125);
    const Inertia about_middle(0.0016, 0.0016, 0.00003);
    const Body::Rigid link(
        MassProperties(0.3, middle, about_middle.shiftFromMassCenter(middle, 0.3)));
    // A pin rotates about z of its frame; this rotation maps z to y.
    const Rotation z_along_y(-Pi / 2, XAxis);
    MobilizedBody::Pin upper(matter_.Ground(), Transform(z_along_y, Vec3(0, 0, 1)), link,
                             Transform(z_along_y, Vec3(0)));
    MobilizedBody::Pin fore(upper, Transform(z_along_y, Vec3(0, 0, -0.25)), link,
                            Transform(z_along_y, Vec3(0)));
    state_ = system_.realizeTopology();
  }

  struct Equations {
    SimTK::Matrix M;  // including armature
    Two torque;       // gravity and velocity terms
  };
  Equations at(const Two& q, const Two& v, const Two& armature) {
    for (int n = 0; n < 2; ++n) {
      const auto joint = static_cast<std::size_t>(n);
      state_.updQ()[n] = q[joint];
      state_.updU()[n] = v[joint];
    }
    system_.realize(state_, SimTK::Stage::Dynamics);
    Equations here;
    matter_.calcM(state_, here.M);
    here.M(0, 0) += armature[0];
    here.M(1, 1) += armature[1];
    const SimTK::Vector no_torque(2, 0.0);
    const SimTK::Vector no_acceleration(2, 0.0);
    SimTK::Vector missing;
    matter_.calcResidualForceIgnoringConstraints(
        state_, no_torque, system_.getRigidBodyForces(state_, SimTK::Stage::Dynamics),
        no_acceleration, missing);
    here.torque = {-missing[0], -missing[1]};
    return here;
  }

  Two acceleration(const Two& q, const Two& v, const Two& armature, const Two& given) {
    const Equations e = at(q, v, armature);
    const double f0 = e.torque[0] + given[0];
    const double f1 = e.torque[1] + given[1];
    const double det = e.M(0, 0) * e.M(1, 1) - e.M(0, 1) * e.M(1, 0);
    return {(e.M(1, 1) * f0 - e.M(0, 1) * f1) / det, (e.M(0, 0) * f1 - e.M(1, 0) * f0) / det};
  }

 private:
  SimTK::MultibodySystem system_;
  SimTK::SimbodyMatterSubsystem matter_;
  SimTK::GeneralForceSubsystem forces_;
  SimTK::Force::UniformGravity gravity_;
  SimTK::State state_;
};

Two plus(const Two& x, double s, const Two& y) { return {x[0] + s * y[0], x[1] + s * y[1]}; }

void step(Arm& arm, const Two& armature, const Two& given, Two& q, Two& v) {
  const double h = kStep_s;
  const Two a1 = arm.acceleration(q, v, armature, given);
  const Two v2 = plus(v, h / 2, a1);
  const Two a2 = arm.acceleration(plus(q, h / 2, v), v2, armature, given);
  const Two v3 = plus(v, h / 2, a2);
  const Two a3 = arm.acceleration(plus(q, h / 2, v2), v3, armature, given);
  const Two v4 = plus(v, h, a3);
  const Two a4 = arm.acceleration(plus(q, h, v3), v4, armature, given);
  for (std::size_t n = 0; n < kJoints; ++n) {
    q[n] += h / 6 * (v[n] + 2 * v2[n] + 2 * v3[n] + v4[n]);
    v[n] += h / 6 * (a1[n] + 2 * a2[n] + 2 * a3[n] + a4[n]);
  }
}

int connect_to(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
  const int fd = ::socket(AF_UNIX, SOCK_STREAM, 0);
  if (fd < 0 || ::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
    throw std::runtime_error(path + ": " + std::strerror(errno));
  }
  return fd;
}

void read_all(int fd, unsigned char* to, std::size_t size) {
  while (size > 0) {
    const ssize_t got = ::read(fd, to, size);
    if (got <= 0) throw std::runtime_error("lk-emu closed the connection");
    to += got;
    size -= static_cast<std::size_t>(got);
  }
}

Bytes next(int fd, std::uint32_t kind, lk_shafts_head& head) {
  Bytes bytes(LK_SHAFTS_HEAD_BYTES);
  read_all(fd, bytes.data(), bytes.size());
  if (const char* wrong = lk_shafts_get_head(bytes.data(), &head)) {
    throw std::runtime_error(std::string("lk-emu's message ") + wrong);
  }
  bytes.resize(head.bytes);
  read_all(fd, bytes.data() + LK_SHAFTS_HEAD_BYTES, head.bytes - LK_SHAFTS_HEAD_BYTES);
  if (head.kind == LK_SHAFTS_END) {
    throw std::runtime_error("lk-emu: " +
                             std::string(bytes.begin() + LK_SHAFTS_HEAD_BYTES,
                                         bytes.begin() + LK_SHAFTS_HEAD_BYTES + head.what));
  }
  if (head.kind != kind) throw std::runtime_error("lk-emu sent another message than was due");
  return bytes;
}

Bytes message(std::uint32_t kind, std::uint32_t what, std::uint64_t number) {
  Bytes bytes(lk_shafts_bytes(kind, kJoints));
  const lk_shafts_head head = {kind, static_cast<std::uint32_t>(bytes.size()), kJoints, what,
                               number};
  lk_shafts_put_head(bytes.data(), &head);
  return bytes;
}

void write_all(int fd, const Bytes& bytes) {
  if (::write(fd, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size())) {
    throw std::runtime_error("lk-emu closed the connection");
  }
}

void run(const std::string& path, double seconds) {
  const int fd = connect_to(path);
  lk_shafts_head head;
  Bytes bytes = next(fd, LK_SHAFTS_OFFER, head);
  if (head.joints != kJoints) throw std::runtime_error("the arm has two joints");
  Two q{};
  Two v{};
  Two given{};
  Two armature{};
  Bytes accept = message(LK_SHAFTS_ACCEPT, LK_SHAFTS_TIME_IS_SIMULATORS,
                         static_cast<std::uint64_t>(kStep_s * 1e9));
  for (std::uint32_t n = 0; n < kJoints; ++n) {
    lk_shafts_offer offer;
    lk_shafts_get_offer(&bytes[lk_shafts_at(LK_SHAFTS_OFFER, n)], &offer);
    armature[n] = offer.armature_kg_m2;
    const lk_shafts_accept terms = {LK_SHAFTS_SIMULATOR, 0};
    lk_shafts_put_accept(&accept[lk_shafts_at(LK_SHAFTS_ACCEPT, n)], &terms);
  }
  write_all(fd, accept);

  Arm arm;
  std::uint64_t number = 0;
  const int steps = static_cast<int>(seconds / kStep_s + 0.5);
  std::puts("time_s,shoulder,elbow");
  for (int k = 0; k <= steps; ++k) {
    std::printf("%.6f,%.12g,%.12g\n", k * kStep_s, q[0], q[1]);
    if (k == steps) break;
    const Two a = arm.acceleration(q, v, armature, given);
    const SimTK::Matrix M = arm.at(q, v, armature).M;
    const double det = M(0, 0) * M(1, 1) - M(0, 1) * M(1, 0);
    const Two inertia = {det / M(1, 1), det / M(0, 0)};  // 1 / diagonal of the inverse
    Bytes states = message(LK_SHAFTS_STATES, 0, number);
    for (std::uint32_t n = 0; n < kJoints; ++n) {
      const lk_shafts_state state = {q[n], v[n], inertia[n], inertia[n] * a[n] - given[n]};
      lk_shafts_put_state(&states[lk_shafts_at(LK_SHAFTS_STATES, n)], &state);
    }
    write_all(fd, states);
    bytes = next(fd, LK_SHAFTS_TORQUES, head);
    number = head.number;
    for (std::uint32_t n = 0; n < kJoints; ++n) {
      lk_shafts_torque torque;
      lk_shafts_get_torque(&bytes[lk_shafts_at(LK_SHAFTS_TORQUES, n)], &torque);
      given[n] = torque.torque_Nm;
      armature[n] = torque.armature_kg_m2;
    }
    step(arm, armature, given, q, v);
  }
  ::close(fd);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc != 3) throw std::runtime_error("usage: simbody_arm SOCKET SECONDS");
    run(argv[1], std::atof(argv[2]));
  } catch (const std::exception& problem) {
    std::fprintf(stderr, "simbody_arm: %s\n", problem.what());
    return 1;
  }
  return 0;
}
