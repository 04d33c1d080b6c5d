#pragma once
/// Distance of the machine to the obstacles: exact for checking, as smooth rows for optimising.
#include <Eigen/Dense>
#include <string>
#include <vector>

#include "models/machine/kinematics.h"
#include "models/machine/trajectory.h"
#include "problems/obstacle_distance.h"
#include "problems/problem.h"

namespace sparflow {

/// Radius of the machine's capsules [m]: the problem's clearance, or 0.1 m where it asks for none.
double capsule_radius(const MotionProblem& problem);

struct ClearanceOptions {
  /// Largest excess over the capsule's radius that the smooth rows demand of a sample point [m]
  /// (plus the box's bias, problems/obstacle_distance.h). Smaller = closer passes, more rows.
  double inflation = 0.05;
};

/// Nearest approach of the machine at one configuration.
struct Nearest {
  double distance =
      0.0;        ///< signed distance less the capsule's radius [m]; +infinity without obstacles
  int part = -1;  ///< index for part_name(), -1 = no obstacle
  int obstacle = -1;  ///< index in the problem, -1 = none
};

/// The machine as capsules of one radius r: each link from its joint to the next one (or to the tip), each
/// telescope from its mount to where the prismatic joint stands. Parts that no joint moves (a slewing
/// column) are left out: no motion changes their distance.
///
/// Smooth rows. A part is cut into pieces no longer than 2h and a row stands at every cut:
/// g = SmoothObstacle(point; level) with level = sqrt(r^2 + h^2) for a box,
/// level = sqrt((R + r)^2 + h^2) - R for a sphere of radius R, and level = r at the ends alone for a
/// half-space. All rows >= 0 imply distance >= 0 at that configuration: let k be any point of the obstacle
/// (a sphere: its centre) and D the distance both ends of a piece keep from it; a chord of length 2h
/// with both ends outside the ball of radius D around k stays sqrt(D^2 - h^2) away from k. h follows from
/// `inflation`. Rows of points that cannot reach the obstacle within the limits, or that no joint moves, are left
/// out; next to an immovable point pieces are shortened so that the bound holds without its row,
/// see cover_complete().
///
/// A part whose immovable end lies in a half-space (a column on the ground) is checked at its other end only.
///
/// A mutable workspace; each thread needs its own. No evaluation allocates.
class ClearanceModel {
 public:
  explicit ClearanceModel(const MotionProblem& problem, const ClearanceOptions& options = {});

  double radius() const { return radius_; }
  /// Name of the joint whose link (or telescope) the part is.
  const std::string& part_name(int part) const;
  const std::string& obstacle_name(int obstacle) const;
  /// "jib is 0.03 m inside the clearance of wall" and the like, for messages.
  std::string describe(const Nearest& nearest) const;

  /// Exact least distance. @param q joint coordinates in the machine's order
  Nearest nearest(const double* q);
  bool clear(const double* q) { return nearest(q).distance >= 0.0; }

  /// Share of the straight joint line from -> to that is clear, 1 = all of it; negative when `from` is not.
  /// Conservative advancement by part: between two tests no point moves further than its part's last distance, or 2 mm
  /// where that is less. A violation that is missed is thus at most 1 mm deep.
  double clear_share(const double* from, const double* to);
  bool motion_clear(const double* from, const double* to) { return clear_share(from, to) >= 1.0; }
  /// The same along a polyline. @param path waypoints x joints
  bool path_clear(const Eigen::MatrixXd& path);

  /// Nearest approach of a motion, tested at `factor` instants in every interval. @param when set to its time [s]
  Nearest nearest_on(const Trajectory& motion, int factor, double* when = nullptr);

  /// Replaces the smooth rows by planes, of which each posture has its own: between every part and every obstacle that come
  /// nearer than `within` [m] in one of the postures, the plane at a right angle to their shortest connection there
  /// (separating_plane()), with a row for each moving end of the part: its distance from the plane less the radius. The rows
  /// are exact in the posture itself and imply clearance in every other one.
  /// @param postures one in each row, which at_posture() selects
  void use_planes(const Eigen::MatrixXd& postures, double within);
  /// Selects the planes of a posture for the rows; without planes it does nothing.
  void at_posture(int posture) { posture_ = static_cast<std::size_t>(posture); }

  int rows() const { return static_cast<int>(rows_.size()); }
  /// False when an obstacle is so near to an immovable point that the bound of the rows does not hold there; then
  /// rows >= 0 does not imply clearance, and only the exact check decides.
  bool cover_complete() const { return cover_complete_; }
  /// g [rows], feasible when >= 0. [m]
  void values(const double* q, double* g);
  /// g [rows] and jacobian [rows x n, row-major]
  void jacobian(const double* q, double* g, double* jacobian);
  /// Adds sum_row multiplier[row] Hessian(row) to hessian [n x n].
  void add_hessian(const double* q, const double* multiplier, double* hessian);
  std::string row_name(int row) const;

 private:
  /// A point of the machine: fixed in link `joint`, or `fraction` of joint `slide`'s travel beyond it.
  struct Point {
    int joint = -1;
    Eigen::Vector3d local = Eigen::Vector3d::Zero();
    int slide = -1;
    double fraction = 0.0;
  };
  struct Part {
    Point from, to;
    int name = 0;         ///< joint index
    double length = 0.0;  ///< longest [m]
    bool from_moves = true;
    bool to_moves = true;
  };
  struct Row {
    Point point;
    SmoothObstacle smooth;
    int part = 0;
    int obstacle = 0;
  };
  double part_distance(const Part& part, const Obstacle& obstacle, const Eigen::Vector3d& from,
                       const Eigen::Vector3d& to) const;
  const SmoothObstacle& smooth(std::size_t row) const {
    return planes_.empty() ? rows_[row].smooth : planes_[posture_ * rows_.size() + row];
  }
  void build_parts();
  void build_rows(double inflation);
  /// Longest allowed half piece h of a part before this obstacle [m].
  double half_piece(const Part& part, const Obstacle& obstacle, double kept, double inflation);
  Eigen::Vector3d position(const Point& point, const double* q) const;
  /// Writes the columns of the point's Jacobian into columns_. @return number of joints that move it
  int update_columns(const Point& point, const Eigen::Vector3d& position);
  bool moves(const Point& point);
  /// Largest displacement of the point per unit of joint `k`. [m/rad] or [-]
  double travel_radius(const Point& point, int k) const;
  double reach(const Point& point) const;

  Machine machine_;
  std::vector<Range> limits_;
  std::vector<Obstacle> obstacles_;
  double radius_ = 0.0;
  bool cover_complete_ = true;
  std::vector<Part> parts_;
  std::vector<Row> rows_;
  std::vector<SmoothObstacle> planes_;  ///< [posture][row] of use_planes()
  std::size_t posture_ = 0;             ///< of the planes selected
  /// parts x joints: largest displacement of the part per unit of the joint [m/rad] or [-]
  Eigen::MatrixXd travel_radius_;
  ChainGeometry chain_;
  std::vector<Eigen::Vector3d> columns_;
  Eigen::VectorXd between_;
  Eigen::VectorXd part_distance_;  ///< of the last nearest() [m]
};

}  // namespace sparflow
