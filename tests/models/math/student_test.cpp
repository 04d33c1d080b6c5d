/// Tail of Student's t against closed forms and tables.
#include "models/math/student.h"

#include <gtest/gtest.h>

namespace sparflow {
namespace {

/// The tolerances are those that the header states. One degree of freedom is Cauchy's distribution, two have a closed form, others stand in tables (Abramowitz and Stegun 1964, 26.10).
TEST(Student, TailAgreesWithTables) {
  struct Row {
    double t, freedom, tail;
  };
  for (const Row& r :
       {Row{6.314, 1, 0.05}, Row{63.66, 1, 0.005}, Row{2.920, 2, 0.05}, Row{9.925, 2, 0.005},
        Row{3.365, 5, 0.01}, Row{5.893, 5, 0.001}, Row{2.764, 10, 0.01}, Row{4.144, 10, 0.001},
        Row{2.457, 30, 0.01}, Row{3.385, 30, 0.001}})
    EXPECT_NEAR(student_tail(r.t, r.freedom), r.tail,
                (r.freedom < 2.0   ? 1.0
                 : r.freedom < 5.0 ? 0.25
                                   : 0.1) *
                    r.tail)
        << r.t << " " << r.freedom;
}

TEST(Student, IsSymmetricAndEndsInTheNormalDistribution) {
  EXPECT_DOUBLE_EQ(student_tail(0.0, 3.0), 0.5);
  EXPECT_DOUBLE_EQ(student_tail(1.3, 3.0) + student_tail(-1.3, 3.0), 1.0);
  EXPECT_NEAR(student_tail(1.96, 1e6), 0.025, 1e-5);
}

}  // namespace
}  // namespace sparflow
