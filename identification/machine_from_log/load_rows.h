#pragma once
/// Rows in which a cylinder's load is nearly static, and the forces that unknown masses would give in them.
///
/// The static force of a cylinder is linear in mass and first moments (mass times centre of mass) of every link, so that its
/// derivatives are those of machines with one unit mass. Source: Gautier, Khalil (1990), IEEE Trans. Robotics Autom. 6(3).
#include <vector>

#include "identification/machine_from_log/sketch_samples.h"

namespace sparflow::from_log {

/// One unknown of the masses.
struct MassUnknown {
  int link = -1;
  int axis =
      -1;  ///< -1: the mass itself [kg]; 0, 1, 2: mass times that coordinate of its centre [kg m], link's frame
};

/// The unknowns of a sketch: a link whose mass and centre are open has four, one whose centre is open three, one whose mass
/// is open one.
std::vector<MassUnknown> mass_unknowns(const MachineSketch& sketch);

/// What the unknowns say about a link: its mass, and mass times centre.
struct LinkMoments {
  double mass = 0.0;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
};

/// Rows of one cylinder.
struct LoadRows {
  int cylinder = -1;
  bool load_cell = false;                  ///< force is measured, pressures are not used
  Eigen::VectorXd pressure_a, pressure_b;  ///< [Pa]
  Eigen::VectorXd force;                   ///< [N] of a load cell
  Eigen::VectorXd known;         ///< [N] static force of all that is known, payload included
  Eigen::MatrixXd masses;        ///< [rows x unknowns] [N] for each unit of an unknown
  Eigen::VectorXd direction;     ///< +1 extends, -1 retracts
  Eigen::VectorXd speed;         ///< [m/s]
  Eigen::VectorXd acceleration;  ///< [m/s^2]
  Eigen::VectorXi block;
  std::vector<Eigen::Index> row;  ///< of the samples
  Eigen::VectorXd inertia;        ///< [N] of a machine's masses, for add_inertia; zero at first
  Eigen::Index rows() const { return known.size(); }
};

/// @param known machine with linkages found; open masses are ignored  @param held_out which part of the rows
LoadRows load_rows(const Known& known, int cylinder, bool held_out);

/// Fills the inertial forces of a machine whose masses were found, so that what remains of accelerations biases no friction.
void add_inertia(const Machine& machine, const SketchRows& rows, LoadRows& load);

}  // namespace sparflow::from_log
