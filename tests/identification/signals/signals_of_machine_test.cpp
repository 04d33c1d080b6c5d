// A log belongs to the machine that it was read for: its channels are numbered by that machine's parts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "identification/signals/signals.h"
#include "models/files/machine_file.h"
#include "models/math/error.h"
#include "problems/bundled.h"

namespace sparflow {
namespace {

TEST(MakeSignals, ALogReadForAnotherMachineIsRefused) {
  const Machine crane = load_machine(bundled_file("machines/loader_crane.yaml"));
  const Log log = load_log(bundled_file("logs/loader_crane_test.csv"), crane);
  EXPECT_EQ(make_signals(crane, log).samples(), log.samples());
  for (const char* name : {"hmf_2020_k4_load_sensing", "excavator", "emps"}) {
    const Machine other = load_machine(bundled_file(std::string("machines/") + name + ".yaml"));
    try {
      (void)make_signals(other, log);
      ADD_FAILURE() << name;
    } catch (const InputError& e) {
      EXPECT_THAT(e.what(), testing::HasSubstr("loader_crane_test.csv"));
      EXPECT_THAT(e.what(),
                  testing::HasSubstr(
                      "joints boom, jib, extension; cylinders boom, jib, extension; pumps main"));
    }
  }
}

}  // namespace
}  // namespace sparflow
