#pragma once
/// L D L^T factors of sparse symmetric indefinite matrices that are chains: many small groups of unknowns, each coupled to
/// its neighbours (the knots of a motion), and a few unknowns coupled to all (durations of phases). No solver in sight.
///   P S A S P^T = L D L^T      S powers of two that bring A's rows near 1, D blocks of one or two rows
/// Multifrontal, with threshold pivoting: a pivot column no larger than `threshold` times the largest entry beside it
/// waits for the front above. So D's signs are A's (Sylvester), whatever the order found beforehand.
/// Sources: Duff & Reid (1983), ACM TOMS 9, 302-325; Duff (2004), ACM TOMS 30, 118-144 (the tests of pivots);
/// Bunch & Kaufman (1977), Math. Comp. 31, 163-179. Why it is built so: docs/kkt_solver.md.
#include <cstddef>
#include <vector>

namespace sparflow {

/// What a factorisation came to.
enum class LdlOutcome {
  kRegular,
  kSingular,  ///< a column vanished to rounding, or a value is not finite; there are no factors
};

/// Of the last analysis and factorisation.
struct LdlStatistics {
  int order = 0;
  int fronts = 0;
  int largest_front = 0;     ///< rows of the largest dense front, as foreseen
  long factor_entries = 0;   ///< of L, as foreseen
  double multiply_adds = 0;  ///< of a factorisation, as foreseen
  int delayed =
      0;          ///< pivots that had to wait for a front above (summed over the fronts they left)
  int pairs = 0;  ///< pivots of two rows
  int negative = 0;  ///< negative eigenvalues of A
};

/// An object is a workspace: one matrix pattern, one thread.
class ChainLdl {
 public:
  /// Finds order, fronts and storage once.
  /// @param row,column [entries] 0-based places of the values, either triangle; a place named twice is a sum
  /// @param value [entries] of a typical matrix: rows whose diagonal vanishes here are eliminated beside a neighbour
  ChainLdl(int order, const std::vector<int>& row, const std::vector<int>& column,
           const double* value);

  /// Allocates only where delayed pivots need more room than was set aside.
  /// @param value [entries] in the pattern's order
  /// @param threshold in (0, 0.5]: a pivot is at least this share of the largest entry beside it
  LdlOutcome factorise(const double* value, double threshold);
  /// @param x [order] right-hand side in, solution of A x = b out; only after kRegular
  void solve(double* x);

  const LdlStatistics& statistics() const { return statistics_; }
  bool same_pattern(int order, int entries, const int* row, const int* column, int base) const;

 private:
  /// A dense front: some unknowns eliminated in it, some only updated.
  struct Front {
    int parent = -1, children = 0;
    int own = 0;          ///< unknowns that may be eliminated here (delayed ones come on top)
    int rows = 0;         ///< own and updated ones
    int first_row = 0;    ///< in rows_
    int first_entry = 0;  ///< in entry_*; ends where the next front's begin
    // of the factorisation
    int size = 0, eliminated = 0, first_pivot = 0;
    std::size_t factor = 0, index = 0;  ///< in factor_, index_
  };
  struct Waiting {  ///< a front's contribution to the one above, on the stack
    int front = 0, size = 0, delayed = 0;
    std::size_t value = 0, index = 0;
  };
  struct Tree;

  std::vector<int> pair_up(const double* value) const;
  void make_fronts(const Tree& tree);
  void scale(const double* value);
  void assemble(int number, int delayed, const double* value);
  int take_contributions(const Front& front);
  bool eliminate(int candidates, int size, double threshold, bool last);
  bool choose_pivot(int k, int candidates, int size, double threshold, int& width, bool& vanished);
  void swap(int a, int b, int size);
  void keep_panel(Front& front);
  void push_contribution(int number, int delayed);

  int order_;
  std::vector<int> row_, column_;
  std::vector<Front> fronts_;
  std::vector<int> rows_;         ///< unknowns of every front, own first
  std::vector<int> place_;        ///< of every front's updated rows: place in the front above
  std::vector<int> first_place_;  ///< [front]
  std::vector<int> entry_;        ///< values of the pattern, front by front
  std::vector<int> entry_row_, entry_column_;  ///< where in the front
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
      pivot_;  ///< [2 x order] inverse of D, diagonal and beside it, in order of elimination
  std::vector<int> width_;  ///< [order] 1, or 2 at the first of a pair
  std::size_t factor_used_ = 0, index_used_ = 0;
  std::vector<double> local_;  ///< a front's rows of the solution
};

}  // namespace sparflow
