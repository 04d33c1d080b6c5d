#pragma once
/// Conversion rules of MDF channels: from the stored number to the physical value.
/// Source: ASAM MDF 4.2.0, section on the CC block (cc_type 0 to 11).
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "identification/log/recordings/mdf/mdf_block.h"
#include "models/expression/expression.h"

namespace sparflow {

class MdfConversion {
 public:
  /// @return the physical value; NaN where the rule gives a text or is not defined
  /// @param whole the stored number is an integer: ranges then include their upper end
  double value(double raw, bool whole) const;
  bool identity() const { return kind_ == Kind::kIdentity; }
  bool linear() const { return kind_ == Kind::kLinear; }
  const std::string& unit() const { return unit_; }
  /// A sentence's end when the rule cannot give numbers ("its values are texts"), else "".
  const std::string& refusal() const { return refusal_; }
  /// The rule names some states by texts, which are ignored.
  bool has_texts() const { return has_texts_; }

 private:
  friend class MdfConversions;
  enum class Kind {
    kIdentity,
    kLinear,
    kRational,
    kFormula,
    kTable,
    kNearest,
    kRange,
    kKeys,
    kKeyRanges
  };
  double nearest(double raw) const;
  double interpolated(double raw) const;
  double range(double raw, bool whole) const;
  double state(double raw, bool whole) const;

  Kind kind_ = Kind::kIdentity;
  std::vector<double> numbers_;
  std::vector<std::shared_ptr<const MdfConversion>>
      rules_;  ///< of kKeys and kKeyRanges; null: a text
  Expression formula_;
  std::string unit_, refusal_;
  bool has_texts_ = false;
};

/// Reads each rule once, however many channels share it.
class MdfConversions {
 public:
  explicit MdfConversions(const MdfFile& file) : file_(file) {}
  /// @param at of a CC block; 0 is the identity  @throws InputError for a damaged block
  std::shared_ptr<const MdfConversion> read(std::uint64_t at) { return read(at, 0); }

 private:
  std::shared_ptr<const MdfConversion> read(std::uint64_t at, int depth);
  void read_states(const MdfBlock& block, int depth, MdfConversion* rule);
  void read_formula(const MdfBlock& block, MdfConversion* rule);

  const MdfFile& file_;
  std::map<std::uint64_t, std::shared_ptr<const MdfConversion>> known_;
};

}  // namespace sparflow
