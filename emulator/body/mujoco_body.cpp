#include "emulator/body/mujoco_body.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "emulator/body/mujoco_model.hpp"
#include "emulator/core/text.hpp"

namespace lk::emulator {
namespace {

double seconds(SimTime time) { return static_cast<double>(time.count()) * 1e-9; }

/// Inertia reported for a joint of a frozen body: so large that no drive turns the joint by one
/// encoder count in a day.
constexpr double kImmovable_kg_m2 = 1e12;

std::size_t at(int index) { return static_cast<std::size_t>(index); }

std::string name_of(const mjModel& model, mjtObj kind, int index) {
  const char* const name = mj_id2name(&model, kind, index);
  return name != nullptr ? sanitized_line(name) : "";
}

/// Returns "joint NAME" or "body NAME" for the degree of freedom `dof`; empty without a name.
std::string mover(const mjModel& model, int dof) {
  if (dof < 0 || dof >= model.nv) return "";
  const std::string joint = name_of(model, mjOBJ_JOINT, model.dof_jntid[dof]);
  if (!joint.empty()) return "joint " + joint;
  const std::string body = name_of(model, mjOBJ_BODY, model.dof_bodyid[dof]);
  return body.empty() ? "" : "body " + body;
}

/// Returns the `mover` of the joint to which the coordinate `place` of qpos belongs.
std::string mover_of_coordinate(const mjModel& model, int place) {
  const int* const places = model.jnt_qposadr;
  const auto joint = std::upper_bound(places, places + model.njnt, place) - places - 1;
  return joint < 0 ? "" : mover(model, model.jnt_dofadr[joint]);
}

/// Returns the diagonal entry `dof` of A⁻¹ = L⁻ᵀ·L⁻¹: the squared norm of column `dof` of L⁻¹,
/// which is zero above row `dof`. `factor` is L; `work` is scratch of size nv.
double own_response(const std::vector<double>& factor, std::size_t dof, std::vector<double>& work) {
  const std::size_t nv = work.size();
  double sum = 0;
  for (std::size_t row = dof; row < nv; ++row) {
    const double* const l = factor.data() + row * nv;
    double left = row == dof ? 1.0 : 0.0;
    for (std::size_t n = dof; n < row; ++n) left -= l[n] * work[n];
    work[row] = left / l[row];
    sum += work[row] * work[row];
  }
  return sum;
}

/// Returns the first problem that MuJoCo has counted as a warning; nullopt if none. MuJoCo resets
/// the state when it finds an invalid number.
std::optional<std::string> trouble_of(const mjModel& model, const mjData& data) {
  struct Trouble {
    mjtWarning kind;
    const char* words;
    std::string (*where)(const mjModel&, int info);  // where it is; null: unknown
  };
  static constexpr std::array<Trouble, 5> kTroubles{{
      {mjWARN_BADQPOS, "a position is out of bounds", mover_of_coordinate},
      {mjWARN_BADQVEL, "a speed is out of bounds", mover},
      {mjWARN_BADQACC, "an acceleration is out of bounds", mover},
      {mjWARN_CONTACTFULL, "more contacts than the model has room for (its size: nconmax)",
       nullptr},
      {mjWARN_CNSTRFULL, "more constraints than the model has room for (its size: njmax)", nullptr},
  }};
  for (const Trouble& trouble : kTroubles) {
    const mjWarningStat& warning = data.warning[trouble.kind];
    if (warning.number == 0) continue;
    const std::string where = trouble.where ? trouble.where(model, warning.lastinfo) : "";
    return trouble.words + (where.empty() ? "" : ", at " + where);
  }
  return std::nullopt;
}

}  // namespace

MujocoBody::MujocoBody(const std::string& file, SimTime step)
    : model_(load_mujoco_model(file)), step_(step) {
  const double longest_s = model_->opt.timestep;
  if (!(longest_s >= 1e-6)) throw std::invalid_argument(file + ": its timestep is below 1 us");
  substeps_ = std::max(1, static_cast<int>(std::ceil(seconds(step) / longest_s - 1e-6)));
  model_->opt.timestep = seconds(step) / substeps_;
  model_->opt.disableflags |= mjDSBL_ACTUATION;
  find_joints();
  find_scene();
  if (names_.empty()) throw std::invalid_argument(file + ": it has no hinge joint with a name");
  data_.reset(mj_makeData(model_.get()));
  if (data_ == nullptr) throw std::invalid_argument(file + ": not enough memory for it");
  if (model_->nkey > 0) mj_resetDataKeyframe(model_.get(), data_.get(), 0);
  update();
  if (failure_) throw std::invalid_argument(file + ": " + *failure_ + " as it begins");
}

MujocoBody::MujocoBody(const MujocoBody& other)
    : Mechanism(other),
      model_(mj_copyModel(nullptr, other.model_.get())),
      data_(mj_copyData(nullptr, model_.get(), other.data_.get())),
      step_(other.step_),
      substeps_(other.substeps_),
      names_(other.names_),
      hinges_(other.hinges_),
      parts_(other.parts_),
      own_kg_(other.own_kg_),
      keyframes_(other.keyframes_),
      free_parts_(other.free_parts_),
      counts_as_fall_(other.counts_as_fall_),
      planes_(other.planes_),
      step_geom_(other.step_geom_),
      shape_changes_(other.shape_changes_),
      level_gravity_(other.level_gravity_),
      frozen_(other.frozen_),
      constants_changed_(other.constants_changed_),
      response_(other.response_),
      inertia_(other.inertia_),
      failure_(other.failure_) {}

void MujocoBody::find_joints() {
  for (int joint = 0; joint < model_->njnt; ++joint) {
    const std::string name = name_of(*model_, mjOBJ_JOINT, joint);
    if (model_->jnt_type[joint] != mjJNT_HINGE || name.empty()) continue;
    names_.push_back(name);
    hinges_.push_back(joint);
  }
  inertia_.resize(names_.size());
  for (int body = 0; body < model_->nbody; ++body) {
    parts_.push_back(body > 0 ? name_of(*model_, mjOBJ_BODY, body) : "");  // body 0 is the world
    own_kg_.push_back(model_->body_mass[body]);
  }
}

JointView MujocoBody::joint(std::size_t joint) const {
  const int dof = model_->jnt_dofadr[hinges_[joint]];
  JointView view;
  view.angle_rad = data_->qpos[model_->jnt_qposadr[hinges_[joint]]];
  if (frozen_) {
    view.inertia_kg_m2 = kImmovable_kg_m2;
    return view;
  }
  view.speed_rad_s = data_->qvel[dof];
  view.inertia_kg_m2 = inertia_[joint];
  view.body_torque_Nm = view.inertia_kg_m2 * data_->qacc[dof] - data_->qfrc_applied[dof];
  return view;
}

void MujocoBody::set_armature(std::size_t joint, double inertia_kg_m2) {
  double& armature = model_->dof_armature[model_->jnt_dofadr[hinges_[joint]]];
  constants_changed_ = constants_changed_ || armature != inertia_kg_m2;
  armature = inertia_kg_m2;
}

void MujocoBody::update() {
  if (failure_) return;
  try {
    if (constants_changed_) {
      // Recomputes derived constants, which scale the softness of constraints. mj_setConst puts its
      // data into the zero pose, so it gets separate data.
      const std::unique_ptr<mjData, FreeMujoco> scratch(mj_makeData(model_.get()));
      mj_setConst(model_.get(), scratch.get());
      constants_changed_ = false;
    }
    mj_forward(model_.get(), data_.get());
    mj_checkAcc(model_.get(), data_.get());
    failure_ = trouble_of(*model_, *data_);
    if (!failure_) find_response();
  } catch (const MujocoError& problem) {
    failure_ = mujoco_message(problem.what());
  }
}

void MujocoBody::find_response() {
  const mjModel* const m = model_.get();
  mjData* const d = data_.get();
  const std::size_t nv = at(m->nv);
  response_.resize(nv * nv);
  work_.resize(nv);
  mj_fullM(m, response_.data(), d->qM);
  const bool sparse = mj_isSparse(m) != 0;
  for (int row = 0; row < d->nefc; ++row) {
    if (d->efc_state[row] != mjCNSTRSTATE_QUADRATIC) continue;
    std::ranges::fill(work_, 0.0);
    if (sparse) {
      const int begin = d->efc_J_rowadr[row];
      for (int n = begin; n < begin + d->efc_J_rownnz[row]; ++n) {
        work_[at(d->efc_J_colind[n])] = d->efc_J[n];
      }
    } else {
      std::copy_n(d->efc_J + at(row) * nv, nv, work_.begin());
    }
    for (std::size_t i = 0; i < nv; ++i) {
      if (work_[i] == 0.0) continue;
      const double scaled = d->efc_D[row] * work_[i];
      for (std::size_t j = 0; j < nv; ++j) response_[i * nv + j] += scaled * work_[j];
    }
  }
  mju_cholFactor(response_.data(), m->nv, mjMINVAL);
  for (std::size_t joint = 0; joint < hinges_.size(); ++joint) {
    inertia_[joint] = 1.0 / own_response(response_, at(m->jnt_dofadr[hinges_[joint]]), work_);
  }
}

void MujocoBody::push(std::size_t part, const std::array<double, 3>& force_N,
                      const std::array<double, 3>& torque_Nm) {
  mjtNum* const applied = data_->xfrc_applied + 6 * part;
  std::ranges::copy(force_N, applied);
  std::ranges::copy(torque_Nm, applied + 3);
}

void MujocoBody::carry(std::size_t part, double mass_kg) {
  model_->body_mass[part] = own_kg_[part] + mass_kg;
  constants_changed_ = true;
}

void MujocoBody::freeze(bool on) {
  frozen_ = on;
  std::fill_n(data_->qvel, model_->nv, 0.0);
}

void MujocoBody::advance(std::span<const JointTorque> torques) {
  if (failure_ || frozen_) return;
  const double dt = model_->opt.timestep;
  try {
    for (int n = 0; n < substeps_ && !failure_; ++n) {
      if (n > 0) mj_forward(model_.get(), data_.get());
      substep(torques, (n - 0.5 * (substeps_ - 1)) * dt);
    }
  } catch (const MujocoError& problem) {
    failure_ = mujoco_message(problem.what());
  }
  // `update` assumes these torques until the next `advance` has new ones.
  for (std::size_t joint = 0; joint < torques.size(); ++joint) {
    data_->qfrc_applied[model_->jnt_dofadr[hinges_[joint]]] = torques[joint].mean_Nm;
  }
}

/// Steps with constant torques, those at the middle of the substep. Then corrects the positions for
/// torques that change linearly about this middle: by −slope·dt³/12 over the inertia.
void MujocoBody::substep(std::span<const JointTorque> torques, double from_middle_s) {
  mjData* const d = data_.get();
  const double dt = model_->opt.timestep;
  slopes_.assign(at(model_->nv), 0.0);
  bool changes = false;
  for (std::size_t joint = 0; joint < torques.size(); ++joint) {
    const int dof = model_->jnt_dofadr[hinges_[joint]];
    d->qfrc_applied[dof] = torques[joint].mean_Nm + torques[joint].slope_Nm_s * from_middle_s;
    slopes_[at(dof)] = torques[joint].slope_Nm_s;
    changes = changes || torques[joint].slope_Nm_s != 0.0;
  }
  if (model_->opt.integrator == mjINT_RK4) {
    mj_step(model_.get(), d);
  } else {
    mj_step2(model_.get(), d);  // mj_forward has computed the first half of the step
  }
  if (changes) {
    mju_cholSolve(slopes_.data(), response_.data(), slopes_.data(), model_->nv);
    mj_integratePos(model_.get(), d->qpos, slopes_.data(), -dt * dt * dt / 12.0);
  }
  mj_checkPos(model_.get(), d);
  mj_checkVel(model_.get(), d);
  failure_ = trouble_of(*model_, *d);
}

}  // namespace lk::emulator
