#include "optimizer/nlp/chain_ldl_ipopt.h"

#include <HSLLoader.h>
#include <fmt/format.h>

#include <exception>

#include "models/math/error.h"

namespace sparflow::detail {
namespace {

ChainLdlSession* current_session = nullptr;

/// Above this front size the matrix is not a chain, and MUMPS with its blocked kernels is faster.
/// @threshold [rows] 50..5000; chosen: a chain's fronts hold a few knots and the border
constexpr int kLargestFront = 320;

// Entries of INFO that Ipopt 3.11 reads (IpMa27TSolverInterface.cpp), 0-based.
// no threshold: interface of MA27
constexpr int kFlag = 0, kRealsNeeded = 4, kIntegersNeeded = 5, kCompressedReals = 11,
              kCompressedIntegers = 12, kNegative = 14, kInfoSize = 20;
// no threshold: interface of MA27
constexpr int kSingularFlag = -5;  // Ipopt adds to the diagonal and tries again
constexpr int kFatalFlag = -1;     // Ipopt gives up

}  // namespace

/// Arguments as in MA27: indices (irn, icn) from 1, `a` their values at the factorisation. `ikeep` is passed from analysis
/// to factorisation and `iw` from there to the solution; their first entries hold the index of the ChainLdl object.
struct ChainLdlRoutines {
  static void defaults(ipfint* icntl, double* cntl) {
    // no threshold: sizes of the arrays of MA27
    for (int i = 0; i < 30; ++i) icntl[i] = 0;
    // no threshold: as above
    for (int i = 0; i < 5; ++i) cntl[i] = 0.0;
  }

  static void analyse(ipfint* n, ipfint* entries, const ipfint*, const ipfint*, ipfint*, ipfint*,
                      ipfint* ikeep, ipfint*, ipfint* steps, ipfint*, ipfint*, double*,
                      ipfint* info, double* operations) {
    for (int i = 0; i < kInfoSize; ++i) info[i] = 0;
    *steps = 1;
    *operations = 0.0;
    info[kRealsNeeded] = *entries;
    info[kIntegersNeeded] = *n;
    if (current_session == nullptr) {
      info[kFlag] = kFatalFlag;
      return;
    }
    // The analysis needs the first values, because the pattern does not show which diagonals are zero.
    ikeep[0] = static_cast<ipfint>(current_session->solvers_.size());
    current_session->solvers_.emplace_back();
  }

  static void factorise(ipfint* n, ipfint* entries, const ipfint* irn, const ipfint* icn, double* a,
                        ipfint*, ipfint* iw, ipfint*, ipfint* ikeep, ipfint*, ipfint* front,
                        ipfint*, ipfint*, double* cntl, ipfint* info) {
    for (int i = 0; i < kInfoSize; ++i) info[i] = 0;
    *front = 1;
    iw[0] = ikeep[0];
    info[kCompressedReals] = info[kCompressedIntegers] = 0;
    try {
      auto& solver = current_session->solvers_[static_cast<std::size_t>(ikeep[0])];
      if (solver == nullptr) {
        std::vector<int> row(irn, irn + *entries), column(icn, icn + *entries);
        for (int& i : row) --i;
        for (int& i : column) --i;
        solver = std::make_unique<ChainLdl>(*n, row, column, a);
        if (solver->statistics().largest_front > kLargestFront) {
          current_session->refusal_ =
              fmt::format("the KKT matrix is no chain: it has a front of {} rows",
                          solver->statistics().largest_front);
          info[kFlag] = kFatalFlag;
          return;
        }
      }
      if (solver->factorise(a, cntl[0]) == LdlOutcome::kSingular) {
        info[kFlag] = kSingularFlag;
        return;
      }
      info[kNegative] = solver->statistics().negative;
    } catch (const std::exception& error) {
      current_session->refusal_ = error.what();
      info[kFlag] = kFatalFlag;
    }
  }

  static void solve(ipfint*, double*, ipfint*, ipfint* iw, ipfint*, double*, ipfint*, double* rhs,
                    ipfint*, ipfint*, ipfint*, double*) {
    current_session->solvers_[static_cast<std::size_t>(iw[0])]->solve(rhs);
  }
};

ChainLdlSession::ChainLdlSession() {
  SPARFLOW_CHECK(current_session == nullptr, "only one Ipopt solve runs at a time");
  current_session = this;
  LSL_setMA27(ChainLdlRoutines::analyse, ChainLdlRoutines::factorise, ChainLdlRoutines::solve,
              ChainLdlRoutines::defaults);
}

ChainLdlSession::~ChainLdlSession() { current_session = nullptr; }

std::vector<std::pair<std::string, std::string>> ChainLdlSession::ipopt_options() {
  // ChainLdl scales the matrix itself (Ipopt's default for "ma27" would be another HSL routine). The pivot
  // threshold begins higher than Ipopt's 1e-8, because in a chain a delayed pivot costs little.
  // Ipopt checks every solution's residual anyway and refines where it exceeds 1e-10, so no refinement is forced.
  return {{"linear_solver", "ma27"},
          {"min_refinement_steps", "0"},
          {"linear_system_scaling", "none"},
          {"ma27_pivtol", "1e-4"},
          {"ma27_pivtolmax", "0.1"}};
}

}  // namespace sparflow::detail
