#pragma once
/// ChainLdl as the linear solver of a running Ipopt. Private to optimizer/nlp.
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "optimizer/nlp/chain_ldl.h"

namespace sparflow::detail {

/// While an object lives, Ipopt's linear solver "ma27" is ChainLdl. Only one may exist, under the lock of Ipopt's solves.
///
/// Ipopt 3.11 takes the routines of a sparse symmetric indefinite solver by function pointer (HSLLoader.h); the published
/// argument list of MA27 (analyse, factorise, solve) is used, because Ipopt distinguishes its error returns. The routines
/// are this project's own: no HSL code is used, linked or loaded.
class ChainLdlSession {
 public:
  ChainLdlSession();
  ~ChainLdlSession();
  ChainLdlSession(const ChainLdlSession&) = delete;
  ChainLdlSession& operator=(const ChainLdlSession&) = delete;

  /// Ipopt options that this solver needs, name and value.
  static std::vector<std::pair<std::string, std::string>> ipopt_options();
  /// Why a matrix was not factorised (too large a front, out of memory); empty = all were.
  const std::string& refusal() const { return refusal_; }

 private:
  friend struct ChainLdlRoutines;
  std::vector<std::unique_ptr<ChainLdl>> solvers_;  ///< one for each analysis Ipopt asked for
  std::string refusal_;
};

}  // namespace sparflow::detail
