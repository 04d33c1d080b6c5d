#pragma once
/// L D L^T factors of sparse symmetric indefinite matrices that are chains: many small groups of unknowns, each coupled to
/// its neighbours (the knots of a motion), and a few unknowns coupled to all (durations of phases).
///   P S A S P^T = L D L^T      S powers of two that bring A's rows near 1, D blocks of one or two rows
/// The method is multifrontal with threshold pivoting: a pivot smaller than `threshold` times the largest entry in its
/// column is delayed to the parent front. So D has the inertia of A (Sylvester) for every elimination order.
/// Sources: Duff & Reid (1983), ACM TOMS 9, 302-325; Duff (2004), ACM TOMS 30, 118-144 (the tests of pivots);
/// Bunch & Kaufman (1977), Math. Comp. 31, 163-179. Reasons for the design: docs/kkt_solver.md.
#include <cstddef>
#include <vector>

namespace sparflow {

/// Result of a factorisation.
enum class LdlOutcome {
  kRegular,
  kSingular,  ///< a column is zero to rounding, or a value is not finite; there are no factors
};

/// Statistics of the last analysis and factorisation.
struct LdlStatistics {
  int order = 0;
  int fronts = 0;
  int largest_front = 0;     ///< rows of the largest dense front, predicted
  long factor_entries = 0;   ///< entries of L, predicted
  double multiply_adds = 0;  ///< of a factorisation, predicted
  int delayed = 0;           ///< delayed pivots (summed over the fronts they left)
  int pairs = 0;             ///< pivots of two rows
  int negative = 0;          ///< negative eigenvalues of A
};

/// A mutable workspace for one matrix pattern and one thread.
class ChainLdl {
 public:
  /// Analyses the pattern: elimination order, fronts and storage.
  /// @param row,column [entries] 0-based indices of the values, either triangle; values with equal indices are added
  /// @param value [entries] of a typical matrix: a row whose diagonal is zero here is paired with a neighbour
  ChainLdl(int order, const std::vector<int>& row, const std::vector<int>& column,
           const double* value);

  /// Allocates only if delayed pivots need more storage than was reserved.
  /// @param value [entries] in the pattern's order
  /// @param threshold in (0, 0.5]: a pivot is at least this share of the largest other entry of its column
  LdlOutcome factorise(const double* value, double threshold);
  /// @param x [order] right-hand side in, solution of A x = b out; only after kRegular
  void solve(double* x);

  const LdlStatistics& statistics() const { return statistics_; }
  bool same_pattern(int order, int entries, const int* row, const int* column, int base) const;

 private:
  /// A dense front: some of its unknowns are eliminated in it, the others only updated.
  struct Front {
    int parent = -1, children = 0;
    int own = 0;          ///< number of unknowns to be eliminated here, without delayed ones
    int rows = 0;         ///< number of own and updated unknowns
    int first_row = 0;    ///< in rows_
    int first_entry = 0;  ///< in entry_*; ends where the next front's begin
    // of the factorisation
    int size = 0, eliminated = 0, first_pivot = 0;
    std::size_t factor = 0, index = 0;  ///< in factor_, index_
  };
  struct Waiting {  ///< a front's contribution to its parent, on the stack
    int front = 0, size = 0, delayed = 0;
    std::size_t value = 0, index = 0;
  };
  struct Tree;
  struct Storage;

  std::vector<int> pair_up(const double* value) const;
  void make_fronts(const Tree& tree);
  void place_unknowns(const Tree& tree);
  void set_places(const Front& front, std::vector<int>& place) const;
  void place_entries();
  void place_contributions();
  Storage predicted_storage();
  void reserve(const Storage& storage);
  void scale(const double* value);
  void assemble(int number, int delayed, const double* value);
  int take_contributions(const Front& front);
  bool eliminate(int candidates, int size, double threshold, bool last);
  /// Pivot of one or two rows, or why there is none: no candidate passes the threshold, or one has a zero column.
  enum class Pivot { kOne, kPair, kNone, kVanished };
  Pivot choose_pivot(int k, int candidates, int size, double threshold);
  void swap(int a, int b, int size);
  void keep_panel(Front& front);
  void push_contribution(int number, int delayed);

  int order_;
  std::vector<int> row_, column_;
  std::vector<Front> fronts_;
  std::vector<int> rows_;         ///< unknowns of every front, own first
  std::vector<int> place_;        ///< index in the parent front of every front's updated rows
  std::vector<int> first_place_;  ///< [front]
  std::vector<int> entry_;        ///< values of the pattern, front by front
  std::vector<int> entry_row_, entry_column_;  ///< their row and column in the front
  LdlStatistics statistics_;

  std::vector<double> scale_, largest_;
  std::vector<double> work_, product_;  ///< the dense front; rows of L D below its candidates
  std::vector<int> unknown_;            ///< of the front's rows
  int stride_ = 0, eliminated_ = 0;
  std::vector<Waiting> waiting_;
  std::vector<double> waiting_value_;
  std::vector<int> waiting_index_;
  std::vector<double> factor_;  ///< panels of L
  std::vector<int> index_;      ///< unknowns of the panels' rows
  std::vector<double>
      pivot_;  ///< [2 x order] inverse of D, diagonal and off-diagonal, in order of elimination
  std::vector<int> width_;  ///< [order] 1, or 2 at the first of a pair
  std::size_t factor_used_ = 0, index_used_ = 0;
  std::vector<double> local_;  ///< a front's rows of the solution
};

}  // namespace sparflow
