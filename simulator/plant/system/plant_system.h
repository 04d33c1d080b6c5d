#pragma once
/// The plant as a system of ordinary differential equations: rigid bodies, chambers, friction, spools, counterbalance
/// valves, pumps, load-sensing lines, tank line and oil temperature, with the power of every part, so that the energies can
/// be balanced. Flows are mass flows counted as volume at one atmosphere (components/oil.h).
#include <array>
#include <vector>

#include "models/machine/machine.h"
#include "simulator/plant/bodies/flexible_booms.h"
#include "simulator/plant/parameters/plant_parameters.h"

namespace sparflow::plant {

/// Where a cylinder turns energy into heat.
enum class Loss {
  kMeterIn,
  kMeterOut,
  kCounterbalance,  ///< flow out of a chamber through its counterbalance valve
  kLine,            ///< hose, and the valve's check on the way in
  kLeakage,
  kAntiCavitation,
  kPortRelief,  ///< relief valves of the chambers' ports
  kFriction,
  kEndStop
};
inline constexpr int kLosses = 9;
/// Keys of files.
inline constexpr std::array<const char*, kLosses> kLossNames = {
    "meter_in",        "meter_out",   "counterbalance", "line",    "leakage",
    "anti_cavitation", "port_relief", "friction",       "end_stop"};
/// Words for people.
inline constexpr std::array<const char*, kLosses> kLossWords = {"meter-in edge",
                                                                "meter-out edge",
                                                                "counterbalance valve",
                                                                "line",
                                                                "leakage",
                                                                "anti-cavitation valve",
                                                                "port relief valve",
                                                                "friction",
                                                                "end stop and cushion"};

/// Places of the parts in the state vector.
struct StateLayout {
  int coordinates = 0;  ///< positions at 0.., rates at coordinates..
  int cylinders = 0, pumps = 0;
  static constexpr int kPerCylinder = 10, kPerPump = 5;
  enum Cyl {
    kPressureA,
    kPressureB,
    kHoseA,
    kHoseB,
    kBristle,
    kPlay,
    kSpool,
    kSpoolRate,
    kPilotA,
    kPilotB
  };
  enum Pmp { kSupply, kDisplacement, kIntegral, kLineEntry, kLineEnd };

  int cylinder(int c, Cyl part) const { return 2 * coordinates + kPerCylinder * c + part; }
  int pump(int p, Pmp part) const {
    return 2 * coordinates + kPerCylinder * cylinders + kPerPump * p + part;
  }
  int tank() const { return 2 * coordinates + kPerCylinder * cylinders + kPerPump * pumps; }
  int temperature() const { return tank() + 1; }
  int size() const { return tank() + 2; }
};

/// One cylinder at one instant. Flows [m^3/s], pressures [Pa], powers [W].
struct CylinderInstant {
  double length = 0.0, rate = 1.0, speed = 0.0;  ///< [m] pin to pin, dx/dq, [m/s]
  double force = 0.0;                            ///< [N] on the joint's side, positive extends
  double opening_a = 0.0, opening_b = 0.0;       ///< [-] supply edges to bore and rod side
  double asked = 0.0;                     ///< [Pa] what the section tells the load-sensing line
  double in_a = 0.0, in_b = 0.0;          ///< supply to hose
  double out_a = 0.0, out_b = 0.0;        ///< hose to tank line
  double port_a = 0.0, port_b = 0.0;      ///< hose to chamber
  double leak = 0.0;                      ///< bore side to rod side
  double refill_a = 0.0, refill_b = 0.0;  ///< tank line to chamber, anti-cavitation valves
  double relief_a = 0.0, relief_b = 0.0;  ///< chamber to tank line, port relief valves
  std::array<double, kLosses> loss{};     ///< [W]
  double stored = 0.0;                    ///< [J] bristles and stops
  double bristle_rate = 0.0;              ///< [m/s]
  double drive_power = 0.0;               ///< [W] of a drive without hydraulics
};

struct PumpInstant {
  double flow = 0.0, leak = 0.0, relief = 0.0,
         taken = 0.0;    ///< [m^3/s]; taken: into the valve sections
  double highest = 0.0;  ///< [Pa] of the sections
};

/// All of one instant, from which rates and powers follow.
struct Instant {
  std::vector<CylinderInstant> cylinders;
  std::vector<PumpInstant> pumps;
  double tank_flow = 0.0;   ///< [m^3/s] out of the tank line
  double tank_loss = 0.0;   ///< [W]
  double swing_loss = 0.0;  ///< [W] pendulum and bending booms
  double heat = 0.0;        ///< [W] into the oil
};

/// Not thread-safe; one object for each thread.
class PlantSystem {
 public:
  /// @param machine as its file tells it @param payload [kg]
  PlantSystem(const Machine& machine, const PlantParameters& parameters, double payload);

  const Machine& machine() const { return booms_.machine; }  ///< with the hinges of bending booms
  const FlexibleBooms& booms() const { return booms_; }
  const PlantParameters& parameters() const { return parameters_; }
  const StateLayout& layout() const { return layout_; }
  RigidBodies& bodies() { return bodies_; }
  void set_payload(double payload);

  /// The machine at rest at these joint positions (as the file's joints), valves closed, pumps at standby.
  std::vector<double> rest(const std::vector<double>& q);
  /// @param command [-1..1] by cylinder
  /// @throws std::domain_error where the kinematics end (RigidBodies::update)
  void evaluate(const double* state, const std::vector<double>& command, Instant& at);
  /// d state / dt. @param at of the same state and command
  void rates(const double* state, const std::vector<double>& command, const Instant& at,
             double* rate);
  /// Energy stored in oil, hoses, bristles, stops, bending, motion and height [J]. @param at of the same state
  double stored_energy(const double* state, const Instant& at);
  /// Way from the cylinder to its nearer stop [m], negative inside it.
  double gap(int cylinder, double length) const;
  /// What is left of the rope's second angle before its description ends, 1 hanging, 0 at the end; 1 without a rope. [-]
  double rope_margin(const double* state) const;
  /// Absolute tolerance of each state for a relative tolerance `relative`.
  std::vector<double> tolerances(double relative) const;
  /// Gauge pressure's properties of the plant's oil.
  const Oil& oil() const { return oil_; }

 private:
  struct Fixed;
  Chamber chamber_a(int c, double length) const;
  Chamber chamber_b(int c, double length) const;
  Chamber hose(int c) const;
  Chamber supply(int p) const;
  Chamber tank() const;
  void evaluate_sections(const double* state, Instant& at);
  void evaluate_hydraulics(const double* state, int c, double viscosity, Instant& at);
  void evaluate_force(const double* state, int c, double viscosity, double command,
                      CylinderInstant& i) const;
  void evaluate_supplies(const double* state, Instant& at);
  void hydraulic_rates(const double* state, const std::vector<double>& command, const Instant& at,
                       double* rate) const;
  void motion_rates(const double* state, const Instant& at, double* rate);

  /// What of a cylinder does not change.
  struct Constants {
    double area_a = 0.0, area_b = 0.0;      // [m^2]
    double shortest = 0.0, longest = 0.0;   // [m] length at the stops
    double reference_speed = 0.1;           // [m/s] at full extending command
    double stiffness = 1e7;                 // [N/m] of the stops
    double full_a = 0.0, full_b = 0.0;      // [m^3/s] largest flow of each port
    double return_a = 0.0, return_b = 0.0;  // [m^3/s] out of each side at full command
    double top_speed = 0.0;                 // [m/s] of a drive without hydraulics
    int pump = -1;
  };
  FlexibleBooms booms_;
  PlantParameters parameters_;
  Oil oil_;
  RigidBodies bodies_;
  StateLayout layout_;
  std::vector<Constants> constants_;
  std::vector<PumpGains> pump_gains_;
  std::vector<bool> locked_;  // by joint: no drive moves it
  double tank_full_flow_ = 0.0;
  Eigen::MatrixXd mass_;
  Eigen::VectorXd force_;
};

}  // namespace sparflow::plant
