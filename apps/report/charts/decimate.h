#pragma once
/// Fewer points for the eye, none of them invented: every point kept is one of the given points.
#include <Eigen/Dense>
#include <vector>

namespace sparflow {

/// Rows of a table of curves to draw so that no peak is lost: the rows are cut into equal buckets, and of
/// each bucket and column the rows of the smallest and largest finite value stay, plus the first NaN of a
/// column that has both (so that a gap stays a gap); the first and last row of all stay.
/// @param columns curves over a common abscissa, all of one length
/// @param most    rows aimed at; at most `most` + 2 + (rows kept for gaps) come back
/// @return ascending row numbers; all rows when they are not more than `most`
std::vector<Eigen::Index> decimate_rows(const std::vector<const Eigen::VectorXd*>& columns,
                                        Eigen::Index most);

/// Points of a cloud to draw: one a cell of a grid over the cloud's bounding box, the grid chosen as fine as
/// `most` allows. Outliers stay since they have a cell of their own. Points that are not finite go.
/// @return ascending point numbers
std::vector<Eigen::Index> decimate_cloud(const Eigen::VectorXd& x, const Eigen::VectorXd& y,
                                         Eigen::Index most);

/// Median of y in `bins` bins of x holding equally many points each: the trend of a cloud.
/// Bins are fewer when there are less than 20 points a bin; empty with fewer than 40 finite points.
struct BinnedMedian {
  Eigen::VectorXd x;  ///< median of x in the bin
  Eigen::VectorXd y;
};
BinnedMedian binned_median(const Eigen::VectorXd& x, const Eigen::VectorXd& y, int bins);

}  // namespace sparflow
