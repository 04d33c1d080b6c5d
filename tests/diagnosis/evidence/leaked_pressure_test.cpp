#include <gtest/gtest.h>

#include "diagnosis/evidence/evidence.h"
#include "models/effects/registry.h"
#include "tests/diagnosis/hidden_case.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing_support::hidden_case;
using testing_support::HiddenCase;

/// What passes the piston crosses the return edge beside the rod's flow: the learned laws of both chambers at that flow less those at the
/// rod's, by their definition.
TEST(LeakedPressure, ALeakPastThePistonChangesThePressuresByTheLearnedLaws) {
  const Machine machine = testing_support::drawn_machine("loader_crane");
  const HiddenCase logs = hidden_case(machine, {}, {5, 90.0});
  EvidenceOptions options;
  options.whole_motions = true;  // no filter
  const Evidence e =
      collect_evidence(CraneModel::untrained(machine), {make_signals(machine, logs.train)},
                       {make_signals(machine, logs.reference)}, nullptr, options);
  int returning = 0, supplied = 0;
  for (const EvidenceChannel& c : e.channels) {
    if (c.flow_slope.size() == 0 || c.baseline.cols() == 6)
      continue;  // no law below an anti-cavitation valve's pressure
    const bool extends =
        c.kind == EvidenceKind::kReturnExtend || c.kind == EvidenceKind::kSupplyExtend;
    const bool back =
        c.kind == EvidenceKind::kReturnExtend || c.kind == EvidenceKind::kReturnRetract;
    ASSERT_EQ(c.baseline.cols(), back ? 3 : 5) << c.text;
    (back ? returning : supplied) += 1;
    const Cylinder& cylinder = machine.cylinders[static_cast<std::size_t>(c.index)];
    const double supply = extends ? cylinder.area_piston() : cylinder.area_rod(),
                 out = extends ? cylinder.area_rod() : cylinder.area_piston();
    const VectorXd law = c.baseline.colPivHouseholderQr().solve(c.y);
    const EffectAt leak{find_effect("leakage"), c.index};
    EXPECT_EQ(e.columns(leak, std::vector{2.0}, c, {}, ActingLogs::kAll).size(), 0) << c.text;
    const MatrixXd columns = e.columns(leak, std::vector{3.0}, c, {}, ActingLogs::kAll);
    ASSERT_EQ(columns.rows(), c.rows()) << c.text;
    const double k = 1e-3 / 60.0 / 100e5;  // [m^3/s/Pa] 1 l/min at 100 bar
    for (std::size_t b = 0; b < c.blocks.size(); ++b) {
      const CylinderSeries& s =
          e.series[static_cast<std::size_t>(c.log[b])].cylinders[static_cast<std::size_t>(c.index)];
      for (Index r = c.blocks[b].first; r < c.blocks[b].last; ++r) {
        const Index at = c.sample[static_cast<std::size_t>(r)];
        const double across = s.pressure_a[at] - s.pressure_b[at];
        const double leaked = (extends ? 1.0 : -1.0) * k * across / 1e-3;  // in the baseline's unit
        const auto pressure = [&](double more) {
          Eigen::RowVectorXd row = c.baseline.row(r);
          const double q = row[1] + more * (back ? 1.0 : supply / out);
          row[1] = q;
          row[2] = q * q;
          if (!back) row[4] = row[3] * q;
          return row.dot(law);
        };
        const double twin = (pressure(1e-3 * leaked) - pressure(-1e-3 * leaked)) / 2e-3;
        // the laws are quadratic, so that central differences have rounding alone: 1e-16 of 100 bar over 1e-3
        EXPECT_NEAR(k * columns(r, 0), twin, 1e-4 + 1e-7 * std::abs(twin))
            << c.text << " row " << r;
      }
    }
  }
  EXPECT_GT(returning, 0);
  EXPECT_GT(supplied, 0);
}

}  // namespace
}  // namespace sparflow
