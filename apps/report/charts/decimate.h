#pragma once
/// Reduces the points of a chart; every point kept is one of the given points.
#include <Eigen/Dense>
#include <vector>

namespace sparflow {

/// Selects rows of a table of curves so that no peak is lost. The rows are cut into equal buckets; of each bucket and
/// column the rows of the smallest and largest finite value stay, and the first NaN where the bucket has both, so that
/// a gap stays a gap. The first and the last row stay.
/// @param columns curves over a common abscissa, all of one length
/// @param most    rows aimed at; at most `most` + 2 + (rows kept for gaps) are returned
/// @return ascending row numbers; all rows when they are not more than `most`
std::vector<Eigen::Index> decimate_rows(const std::vector<const Eigen::VectorXd*>& columns,
                                        Eigen::Index most);

/// Selects one point in each cell of a grid over the cloud's bounding box; the grid is as fine as `most` allows.
/// Outliers stay, since they have cells of their own; points that are not finite are removed.
/// @return ascending point numbers
std::vector<Eigen::Index> decimate_cloud(const Eigen::VectorXd& x, const Eigen::VectorXd& y,
                                         Eigen::Index most);

/// Trend of a cloud: median of y in `bins` bins of x with equally many points each. There are fewer bins where a bin
/// would have less than 20 points, and none with fewer than 40 finite points.
struct BinnedMedian {
  Eigen::VectorXd x;  ///< median of x in the bin
  Eigen::VectorXd y;
};
BinnedMedian binned_median(const Eigen::VectorXd& x, const Eigen::VectorXd& y, int bins);

}  // namespace sparflow
