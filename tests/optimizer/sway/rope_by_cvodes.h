#pragma once
/// The load on its rope by another way than optimizer/sway/pendulum.h: two angles, Lagrange's equations, the tip's acceleration by
/// Taylor series of the kinematics in time, integrated by CVODES. Shared by the tests of the sway.
#include <cvodes/cvodes.h>
#include <gtest/gtest.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <cmath>

#include "models/machine/kinematics.h"
#include "models/machine/trajectory.h"
#include "models/math/taylor.h"

namespace sparflow::test_support {

struct RopeByCvodes {
  const Machine* machine;
  const Trajectory* motion;
  double cable;
  Eigen::Index interval = 0;
  Eigen::Vector3d down, east, north;

  Eigen::Vector3d apparent(double t) const {
    using Series = TaylorSeries<2>;
    const double dt = t - motion->t[interval];
    Eigen::Matrix<Series, Eigen::Dynamic, 1> q(motion->q.cols());
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      const double qdd = motion->qdd(interval, j), qd = motion->qd(interval, j);
      q[j].coefficient[0] = motion->q(interval, j) + dt * (qd + 0.5 * dt * qdd);
      q[j].coefficient[1] = qd + dt * qdd;
      q[j].coefficient[2] = 0.5 * qdd;
    }
    const auto p = tip_position<Series>(*machine, q);
    return machine->gravity -
           2.0 * Eigen::Vector3d(p[0].coefficient[2], p[1].coefficient[2], p[2].coefficient[2]);
  }

  static int right_hand_side(sunrealtype t, N_Vector y, N_Vector rate, void* self) {
    const auto& r = *static_cast<RopeByCvodes*>(self);
    const double* s = N_VGetArrayPointer(y);
    double* d = N_VGetArrayPointer(rate);
    const double sa = std::sin(s[0]), ca = std::cos(s[0]), sb = std::sin(s[1]), cb = std::cos(s[1]);
    const Eigen::Vector3d g = r.apparent(t);
    const Eigen::Vector3d along_a = -sa * cb * r.down + ca * cb * r.east;
    const Eigen::Vector3d along_b = -ca * sb * r.down - sa * sb * r.east + cb * r.north;
    d[0] = s[2];
    d[1] = s[3];
    d[2] = (g.dot(along_a) / r.cable + 2.0 * sb * cb * s[2] * s[3]) / (cb * cb);
    d[3] = g.dot(along_b) / r.cable - s[2] * s[2] * sb * cb;
    return 0;
  }
};

/// Largest angle of the rope at `parts` instants of every interval, the load hanging still at first. [rad]
inline double largest_angle_by_cvodes(const Machine& machine, const Trajectory& motion,
                                      double cable, int parts = 16) {
  RopeByCvodes rope{&machine, &motion, cable, 0, machine.gravity.normalized(), {}, {}};
  rope.east = rope.down.unitOrthogonal();
  rope.north = rope.down.cross(rope.east);
  SUNContext context = nullptr;
  SUNContext_Create(nullptr, &context);
  N_Vector y = N_VNew_Serial(4, context);
  N_VConst(0.0, y);
  void* memory = CVodeCreate(CV_ADAMS, context);
  SUNMatrix matrix = SUNDenseMatrix(4, 4, context);
  SUNLinearSolver solver = SUNLinSol_Dense(y, matrix, context);
  EXPECT_EQ(CVodeInit(memory, RopeByCvodes::right_hand_side, motion.t[0], y), CV_SUCCESS);
  EXPECT_EQ(CVodeSStolerances(memory, 1e-10, 1e-12), CV_SUCCESS);
  EXPECT_EQ(CVodeSetUserData(memory, &rope), CV_SUCCESS);
  EXPECT_EQ(CVodeSetLinearSolver(memory, solver, matrix), CV_SUCCESS);
  double largest = 0.0;
  for (Eigen::Index k = 0; k + 1 < motion.size(); ++k) {
    // The acceleration jumps at a knot, so the integration begins anew there.
    rope.interval = k;
    EXPECT_EQ(CVodeReInit(memory, motion.t[k], y), CV_SUCCESS);
    CVodeSetStopTime(memory, motion.t[k + 1]);
    for (int part = 1; part <= parts; ++part) {
      double t = 0.0;
      const double until = motion.t[k] + (motion.t[k + 1] - motion.t[k]) * part / parts;
      EXPECT_GE(CVode(memory, until, y, &t, CV_NORMAL), 0);
      const double* s = N_VGetArrayPointer(y);
      largest = std::max(largest, std::acos(std::min(1.0, std::cos(s[0]) * std::cos(s[1]))));
    }
  }
  CVodeFree(&memory);
  SUNLinSolFree(solver);
  SUNMatDestroy(matrix);
  N_VDestroy(y);
  SUNContext_Free(&context);
  return largest;
}

}  // namespace sparflow::test_support
