#include "simulator/plant/run/plant_run.h"

#include <cvodes/cvodes.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "models/math/error.h"

namespace sparflow::plant {
namespace {

constexpr int kPumpPowers = 3;         // quadratures of a pump: work, delivered, loss
constexpr int kCommonPowers = 3;       // tank, swing, drives
constexpr double kPayloadStep = 0.02;  // [s] between two steps of a payload that is being taken
constexpr long kMostSteps = 200000;    // in one sample; far beyond what any sample needs

void silent(int, const char*, const char*, char*, void*) {}  // the status says what happened

}  // namespace

double EnergyLedger::total_loss() const {
  double sum = tank_loss + swing_loss + std::accumulate(pump_loss.begin(), pump_loss.end(), 0.0);
  for (const auto& c : cylinder_loss) sum = std::accumulate(c.begin(), c.end(), sum);
  return sum;
}

double EnergyLedger::input() const {
  return std::accumulate(pump_work.begin(), pump_work.end(), drive_work + payload_exchange);
}

struct PlantRun::Integrator {
  Integrator(const Machine& machine, const PlantParameters& parameters, std::vector<double> q,
             double payload_kg, RunOptions o)
      : system(machine, parameters, payload_kg),
        options(o),
        payload(payload_kg),
        payload_goal(payload_kg) {
    state = system.rest(q);
    const auto n = static_cast<sunindextype>(state.size());
    y = N_VMake_Serial(n, state.data(), context);
    tolerance = N_VNew_Serial(n, context);
    quadratures = N_VNew_Serial(powers(), context);
    N_VConst(0.0, quadratures);
    command.assign(static_cast<std::size_t>(system.layout().cylinders), 0.0);
    const std::vector<double> absolute = system.tolerances(options.relative_tolerance);
    std::copy(absolute.begin(), absolute.end(), N_VGetArrayPointer(tolerance));
    matrix = SUNDenseMatrix(n, n, context);
    solver = SUNLinSol_Dense(y, matrix, context);
    memory = CVodeCreate(CV_BDF, context);
    int e = CVodeInit(memory, right_hand_side, 0.0, y);
    e |= CVodeSVtolerances(memory, options.relative_tolerance, tolerance);
    e |= CVodeSetUserData(memory, this);
    e |= CVodeSetLinearSolver(memory, solver, matrix);
    e |= CVodeSetErrHandlerFn(memory, silent, nullptr);
    e |= CVodeSetMaxNumSteps(memory, kMostSteps);
    e |= CVodeSetMaxStep(memory, options.longest_step);
    e |= CVodeQuadInit(memory, power_function, quadratures);
    e |= CVodeRootInit(memory, roots(), root_function);
    SPARFLOW_CHECK(e == CV_SUCCESS, "CVODES refused its settings");
    system.evaluate(state.data(), command, instant);
    stored_at_start = system.stored_energy(state.data(), instant);
    ledger.pump_work.assign(static_cast<std::size_t>(system.layout().pumps), 0.0);
    ledger.delivered = ledger.pump_loss = ledger.pump_work;
    ledger.cylinder_loss.resize(static_cast<std::size_t>(system.layout().cylinders));
    write_record();
  }

  ~Integrator() {
    CVodeFree(&memory);
    SUNLinSolFree(solver);
    SUNMatDestroy(matrix);
    N_VDestroy(quadratures);
    N_VDestroy(tolerance);
    N_VDestroy(y);
  }
  Integrator(const Integrator&) = delete;
  Integrator& operator=(const Integrator&) = delete;

  sunindextype powers() const {
    return kPumpPowers * system.layout().pumps + kLosses * system.layout().cylinders +
           kCommonPowers;
  }
  /// One for each cylinder's stops, one for the rope.
  int roots() const { return system.layout().cylinders + 1; }

  static int right_hand_side(double, N_Vector at, N_Vector rate, void* self) {
    auto& i = *static_cast<Integrator*>(self);
    const double* s = N_VGetArrayPointer(at);
    double* r = N_VGetArrayPointer(rate);
    try {
      i.system.evaluate(s, i.command, i.instant);
      i.system.rates(s, i.command, i.instant, r);
    } catch (const std::domain_error& e) {
      i.message = e.what();
      return 1;  // the integrator tries a shorter step
    }
    for (int k = 0; k < i.system.layout().size(); ++k)
      if (!std::isfinite(r[k])) return 1;
    return 0;
  }

  static int power_function(double, N_Vector at, N_Vector power, void* self) {
    auto& i = *static_cast<Integrator*>(self);
    const double* s = N_VGetArrayPointer(at);
    double* w = N_VGetArrayPointer(power);
    try {
      i.system.evaluate(s, i.command, i.instant);
    } catch (const std::domain_error&) {
      return 1;
    }
    const StateLayout& layout = i.system.layout();
    const Oil& oil = i.system.oil();
    const double at_tank = oil.at(s[layout.tank()]).flow_work;
    for (int p = 0; p < layout.pumps; ++p) {
      const PumpInstant& pump = i.instant.pumps[static_cast<std::size_t>(p)];
      const double pressure = s[layout.pump(p, StateLayout::kSupply)];
      const double per_volume = oil.at(pressure).flow_work;
      *w++ = pump.flow * per_volume;
      *w++ = pump.taken * pressure;
      *w++ = pump.leak * per_volume + pump.relief * (per_volume - at_tank);
    }
    double drives = 0.0;
    for (const CylinderInstant& c : i.instant.cylinders) {
      w = std::copy(c.loss.begin(), c.loss.end(), w);
      drives += c.drive_power;
    }
    *w++ = i.instant.tank_loss;
    *w++ = i.instant.swing_loss;
    *w = drives;
    return 0;
  }

  /// The way left to a stop, whose sign changes where it begins to act, and the rope's to the end of its angles.
  static int root_function(double, N_Vector at, double* root, void* self) {
    auto& i = *static_cast<Integrator*>(self);
    try {
      i.system.evaluate(N_VGetArrayPointer(at), i.command, i.instant);
    } catch (const std::domain_error&) {
      return 1;
    }
    const int cylinders = i.system.layout().cylinders;
    root[cylinders] = i.system.rope_margin(N_VGetArrayPointer(at));
    for (int c = 0; c < cylinders; ++c)
      root[c] = i.system.gap(c, i.instant.cylinders[static_cast<std::size_t>(c)].length);
    return 0;
  }

  /// Begins anew behind a discontinuity. The quadratures go on from where they are.
  void restart() {
    SPARFLOW_CHECK(CVodeReInit(memory, t, y) == CV_SUCCESS, "CVODES refused a new start");
    SPARFLOW_CHECK(CVodeQuadReInit(memory, quadratures) == CV_SUCCESS, "CVODES refused a start");
    ++starts;
    accumulate();
    collected = Counts{};
  }

  /// CVODES counts from its last start.
  void accumulate() {
    total.steps += collected.steps;
    total.evaluations += collected.evaluations;
    total.jacobians += collected.jacobians;
  }
  void collect() {
    long linear = 0;
    CVodeGetNumSteps(memory, &collected.steps);
    CVodeGetNumRhsEvals(memory, &collected.evaluations);
    CVodeGetNumLinRhsEvals(memory, &linear);
    CVodeGetNumJacEvals(memory, &collected.jacobians);
    collected.evaluations += linear;
  }

  void advance(const std::vector<double>& u, double duration) {
    if (status != RunStatus::kRunning) return;
    double jump = 0.0;
    for (std::size_t c = 0; c < command.size(); ++c)
      jump = std::max(jump, std::abs(u[c] - command[c]));
    command = u;
    if (jump > options.command_jump) restart();
    const double end = t + duration;
    while (payload != payload_goal && t < end - 1e-12 && status == RunStatus::kRunning) {
      const double next = std::min(end, t + kPayloadStep);
      step_payload(next - t);
      integrate_to(next);
    }
    integrate_to(end);
    system.evaluate(state.data(), command, instant);
    write_record();
    write_ledger();
  }

  void integrate_to(double end) {
    while (status == RunStatus::kRunning && t < end - 1e-12) {
      CVodeSetStopTime(memory, end);
      const int flag = CVode(memory, end, y, &t, CV_NORMAL);
      collect();
      double reached = t;
      if (flag >= 0) CVodeGetQuad(memory, &reached, quadratures);
      if (flag == CV_ROOT_RETURN) {
        if (system.rope_margin(state.data()) < 1e-6) {
          status = RunStatus::kKinematicsEnd;
          message = "the payload's rope is nearly horizontal";
          break;
        }
        restart();
      } else if (flag < 0) {
        const bool kinematics = flag == CV_REPTD_RHSFUNC_ERR || flag == CV_UNREC_RHSFUNC_ERR ||
                                flag == CV_FIRST_RHSFUNC_ERR;
        status = kinematics && !message.empty() ? RunStatus::kKinematicsEnd
                                                : RunStatus::kIntegratorFailed;
        char* name = CVodeGetReturnFlagName(flag);
        message = message.empty() ? std::string("the integrator ended with ") + name : message;
        free(name);  // NOLINT: CVODES allocates it with malloc
        break;
      }
    }
  }

  void set_payload(double kg) {
    if (kg == payload_goal) return;
    payload_goal = kg;
    payload_rate = (kg - payload) / std::max(options.payload_time, kPayloadStep);
  }

  /// The next small step of a payload on its way. The error control follows it without a new start of the integrator.
  void step_payload(double seconds) {
    system.evaluate(state.data(), command, instant);
    const double before = system.stored_energy(state.data(), instant);
    const double left = payload_goal - payload, step = payload_rate * seconds;
    payload = std::abs(left) <= std::abs(step) ? payload_goal : payload + step;
    system.set_payload(payload);
    system.evaluate(state.data(), command, instant);
    exchanged += system.stored_energy(state.data(), instant) - before;
  }

  void write_record() {
    const StateLayout& l = system.layout();
    record.t = t;
    record.payload = payload;
    record.command = command;
    record.q.clear();
    record.qd.clear();
    for (const int j : system.booms().joint_of) {
      record.q.push_back(state[static_cast<std::size_t>(j)]);
      record.qd.push_back(state[static_cast<std::size_t>(l.coordinates + j)]);
    }
    const auto cylinders = static_cast<std::size_t>(l.cylinders);
    for (auto* v :
         {&record.spool, &record.pressure_a, &record.pressure_b, &record.force, &record.flow})
      v->assign(cylinders, 0.0);
    for (int c = 0; c < l.cylinders; ++c) {
      const auto k = static_cast<std::size_t>(c);
      const CylinderInstant& at = instant.cylinders[k];
      const auto value = [&](StateLayout::Cyl part) {
        return state[static_cast<std::size_t>(l.cylinder(c, part))];
      };
      record.force[k] = at.force;
      if (!system.machine().cylinders[k].hydraulic()) continue;
      record.spool[k] = value(StateLayout::kSpool);
      record.pressure_a[k] = value(StateLayout::kPressureA);
      record.pressure_b[k] = value(StateLayout::kPressureB);
      record.flow[k] = at.in_a - at.in_b;
    }
    record.pump_pressure.clear();
    record.pump_flow.clear();
    for (int p = 0; p < l.pumps; ++p) {
      record.pump_pressure.push_back(
          state[static_cast<std::size_t>(l.pump(p, StateLayout::kSupply))]);
      record.pump_flow.push_back(instant.pumps[static_cast<std::size_t>(p)].taken);
    }
    record.tank_pressure = state[static_cast<std::size_t>(l.tank())];
    record.oil_temperature = state[static_cast<std::size_t>(l.temperature())];
    if (system.bodies().hanging()) {
      record.swing_1 = state[static_cast<std::size_t>(l.coordinates - 2)];
      record.swing_2 = state[static_cast<std::size_t>(l.coordinates - 1)];
    }
  }

  void write_ledger() {
    const double* w = N_VGetArrayPointer(quadratures);
    for (std::size_t p = 0; p < ledger.pump_work.size(); ++p) {
      ledger.pump_work[p] = *w++;
      ledger.delivered[p] = *w++;
      ledger.pump_loss[p] = *w++;
    }
    for (auto& c : ledger.cylinder_loss) {
      std::copy(w, w + kLosses, c.begin());
      w += kLosses;
    }
    ledger.tank_loss = *w++;
    ledger.swing_loss = *w++;
    ledger.drive_work = *w;
    ledger.payload_exchange = exchanged;
    ledger.stored = system.stored_energy(state.data(), instant) - stored_at_start;
  }

  sundials::Context context;
  PlantSystem system;
  RunOptions options;
  double payload = 0.0, payload_goal = 0.0, payload_rate = 0.0;  // [kg], [kg], [kg/s]
  double t = 0.0, stored_at_start = 0.0, exchanged = 0.0;
  std::vector<double> state, command;
  Instant instant;
  N_Vector y = nullptr, tolerance = nullptr, quadratures = nullptr;
  SUNMatrix matrix = nullptr;
  SUNLinearSolver solver = nullptr;
  void* memory = nullptr;
  Record record;
  EnergyLedger ledger;
  RunStatus status = RunStatus::kRunning;
  std::string message;
  Counts collected, total;
  long starts = 0;
};

PlantRun::PlantRun(const Machine& machine, const PlantParameters& parameters, std::vector<double> q,
                   double payload, RunOptions options)
    : i_(std::make_unique<Integrator>(machine, parameters, std::move(q), payload, options)) {}
PlantRun::~PlantRun() = default;
PlantRun::PlantRun(PlantRun&&) noexcept = default;

RunStatus PlantRun::advance(const std::vector<double>& command) {
  return advance(command, i_->options.sample_time);
}
RunStatus PlantRun::advance(const std::vector<double>& command, double duration) {
  SPARFLOW_CHECK(command.size() == i_->command.size(), "one command for each cylinder");
  i_->advance(command, duration);
  return i_->status;
}
void PlantRun::set_payload(double payload) { i_->set_payload(payload); }
const Record& PlantRun::record() const { return i_->record; }
const EnergyLedger& PlantRun::ledger() const { return i_->ledger; }
double PlantRun::time() const { return i_->t; }
RunStatus PlantRun::status() const { return i_->status; }
const std::string& PlantRun::message() const { return i_->message; }
const std::vector<double>& PlantRun::state() const { return i_->state; }
PlantSystem& PlantRun::system() { return i_->system; }

PlantRun::Counts PlantRun::counts() const {
  Counts c = i_->total;
  c.steps += i_->collected.steps;
  c.evaluations += i_->collected.evaluations;
  c.jacobians += i_->collected.jacobians;
  c.starts = i_->starts;
  return c;
}

RunResult run_plant(PlantRun& plant, const CommandSource& source, double duration) {
  RunResult r;
  r.records.push_back(plant.record());
  const double end = plant.time() + duration - 1e-9;
  while (plant.time() < end && plant.status() == RunStatus::kRunning) {
    const std::vector<double> command = source(plant.record());
    if (command.empty()) break;
    plant.advance(command);
    r.records.push_back(plant.record());
  }
  r.ledger = plant.ledger();
  r.status = plant.status();
  r.message = plant.message();
  return r;
}

}  // namespace sparflow::plant
